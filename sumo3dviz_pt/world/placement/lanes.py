"""Finds lanes near points, such as the road that a house faces, and where vehicles may drive.

Vehicles may drive on the asphalt of junctions between their lanes, too. Of points that are equally
near, the first counts, on every machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.mesh.planar import subtract, union
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, evenly_along, from_above, settled
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.world.roads.strips import is_footway

_NEAREST = 4
"""Points that are looked at; places in a plane seldom have more nearest ones."""


class Nearest:
    """An index of points that gives the same nearest points on every machine.

    SciPy's tree gives any of several points that are equally near, which rounding decides.
    That happens: lanes that begin where others end have points in common, and many a house
    stands in the middle between two streets.
    """

    def __init__(self, points: Floats) -> None:
        """Index points, (n, 2) [m], n >= 1."""
        places, self._first = np.unique(settled(points), axis=0, return_index=True)
        self._tree = cKDTree(places)

    def query(self, places: Floats) -> tuple[Floats, Ints]:
        """Return distances of places, (m, 2) [m], to the nearest points, and their indices."""
        count = min(_NEAREST, len(self._first))
        away, index = self._tree.query(settled(places), k=range(1, count + 1))
        away, first = settled(away), self._first[index]
        nearest = away.min(axis=1)
        equal = np.where(away == nearest[:, None], first, np.iinfo(np.int64).max)
        return nearest, np.asarray(equal.min(axis=1), dtype=np.int64)


_STEP = 4.0  # distance between sampled lane points [m]
_OFF_FOOT = ("normal", "internal", "connector")


@dataclass(frozen=True, slots=True, eq=False)
class LaneIndex:
    """Carriageway lanes, searchable.

    Attributes:
        areas: A tree of their outlines.
        points: Sampled centre lines, (n, 3) [m].
        directions: Unit driving directions there, (n, 2).
        tree: Over the points' x and y; None for a network without such lanes.
    """

    areas: shapely.STRtree
    points: Floats
    directions: Floats
    tree: Nearest | None

    def covers(self, places: Floats, *, margin: float = 0.0) -> Bools:
        """Return whether places, (m, 2) [m], lie on a carriageway or within a margin [m] of one."""
        covered = np.zeros(len(places), dtype=np.bool_)
        if len(places) and len(self.areas.geometries):
            shapes = shapely.points(places)
            hits = self.areas.query(shapes, predicate="dwithin", distance=margin)
            covered[hits[0]] = True
        return covered

    def meets(self, area: shapely.Geometry) -> bool:
        """Return whether an area and a carriageway have a point in common."""
        return bool(len(self.areas.query(area, predicate="intersects")))

    def nearest(self, places: Floats) -> tuple[Ints, Floats]:
        """Index of the nearest sampled lane point and its distance [m] for places, (m, 2)."""
        if self.tree is None or not len(places):
            return np.zeros(len(places), np.int64), np.full(len(places), np.inf)
        distance, index = self.tree.query(places)
        return index, distance

    def heights(self, places: Floats) -> Floats:
        """Return the height of the road nearest to places, (m,) [m]; 0 without roads."""
        if self.tree is None:
            return np.zeros(len(places))
        height: Floats = self.points[self.nearest(places)[0], 2]
        return height


def build_lane_index(network: Network) -> LaneIndex:
    """Index every lane that is not for pedestrians only."""
    lanes = [lane for lane in _carriageways(network) if len(lane.shape) > 1]
    if not lanes:
        return LaneIndex(shapely.STRtree([]), np.zeros((0, 3)), np.zeros((0, 2)), None)
    half = np.array([lane.width / 2 for lane in lanes])
    shapes = [lane.shape for lane in lanes]
    areas = shapely.buffer(from_above(shapes), half, cap_style="flat")
    points, sides = evenly_along(shapes, lambda lengths: np.maximum(lengths // _STEP, 1) + 1)
    directions = sides[:, :2]
    directions = directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-12)
    return LaneIndex(shapely.STRtree(areas), points, directions, Nearest(points[:, :2]))


def _carriageways(network: Network) -> Iterable[Lane]:
    """Lanes of roads and junctions on which something drives."""
    for edge in network.edges.values():
        if edge.function in _OFF_FOOT:
            yield from (lane for lane in edge.lanes if lane.allowed - {"pedestrian"})


@dataclass(frozen=True, slots=True, eq=False)
class DrivenGround:
    """Lanes and the asphalt of junctions, searchable.

    Attributes:
        lanes: Carriageway lanes.
        outlines: A tree of the outlines of junctions.
        walks: A tree of footways and walking areas, which lie on junctions.
        crossings: A tree of crossings, which lie on the asphalt.
        known: Asphalt of junctions by their place in `outlines`; it grows.
    """

    lanes: LaneIndex
    outlines: shapely.STRtree
    walks: shapely.STRtree
    crossings: shapely.STRtree
    known: dict[int, shapely.Geometry] = field(default_factory=dict)

    def covers(self, places: Floats, *, margin: float = 0.0) -> Bools:
        """Return whether places, (m, 2) [m], may be driven on, or lie within a margin [m] of it."""
        covered = self.lanes.covers(places, margin=margin)
        if not len(places) or not len(self.outlines.geometries):
            return covered
        spots = shapely.points(places)
        spot, keys = self.outlines.query(spots, predicate="dwithin", distance=margin)
        for key in np.unique(keys).tolist():
            own = spot[keys == key]
            covered[own] |= shapely.dwithin(spots[own], self._asphalt(key), margin)
        return covered

    def _asphalt(self, key: int) -> shapely.Geometry:
        """What vehicles may drive on in a junction, besides lanes."""
        if key not in self.known:
            outline = self.outlines.geometries[key]
            walks, crossings = (
                tree.geometries[tree.query(outline, predicate="intersects")]
                for tree in (self.walks, self.crossings)
            )
            paved = subtract(union(walks), list(crossings))
            self.known[key] = subtract(outline, [paved])
        return self.known[key]


def driven_ground(network: Network, lanes: LaneIndex) -> DrivenGround:
    """Index where vehicles may drive in a network with these lanes."""
    outlines = [
        _area(junction.outline)
        for junction in network.junctions.values()
        if junction.type != "internal" and len(junction.outline) > 2
    ]
    walks, crossings = [], []
    for edge in network.edges.values():
        if edge.function == "walkingarea":
            walks += [_area(lane.shape) for lane in edge.lanes if len(lane.shape) > 2]
        elif edge.function == "crossing":
            crossings += [_strip(lane) for lane in edge.lanes]
        elif edge.function == "normal":
            walks += [_strip(lane) for lane in edge.lanes if is_footway(lane)]
    return DrivenGround(lanes, *(shapely.STRtree(some) for some in (outlines, walks, crossings)))


def _strip(lane: Lane) -> shapely.Geometry:
    """A lane from above."""
    line = shapely.LineString(lane.shape[:, :2])
    return line.buffer(lane.width / 2, cap_style="flat")


def _area(outline: Floats) -> shapely.Geometry:
    """An outline, (n, 3) [m], as a valid area."""
    return shapely.make_valid(shapely.Polygon(np.round(outline[:, :2], 3)))


def facing_roads(places: Floats, index: LaneIndex) -> Floats:
    """Return yaws at a right angle to the nearest lane and towards it, (n,) [rad]."""
    if index.tree is None:
        return np.zeros(len(places))
    nearest, _ = index.nearest(places)
    along = index.directions[nearest]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    side = ((index.points[nearest, :2] - places) * across).sum(axis=1)
    across *= np.where(settled(side) < 0, -1.0, 1.0)[:, None]
    yaws: Floats = np.arctan2(across[:, 1], across[:, 0])
    return yaws
