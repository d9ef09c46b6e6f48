"""Finds lanes near points, such as the road that a house faces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.polylines import evenly_along, from_above
from sumo3dviz_pt.world.placement.nearest import Nearest

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
