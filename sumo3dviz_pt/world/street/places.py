"""Where street furniture may stand: along the borders of roads, never on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, Transform, arc_length, settled
from sumo3dviz_pt.model.network import Edge, Lane, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings, Tile, edges_in

MARGIN = 0.25
"""Distance that everything keeps from carriageways and bicycle lanes [m]."""

_STEP = 1.0  # highest difference between the ground and the road beside it [m]
_GAP = 1.0  # between things [m]
_CAMERA = 2.5  # distance that things keep from cameras that are not high above [m]
_OUT = 2.0  # how far lamps and roofs of shelters stand out [m]
_WALKS = ("crossing",)


class Beside(NamedTuple):
    """Places beside a border.

    Attributes:
        places: (n, 2) [m].
        road: Height of the road there, (n,) [m].
        yaw: Direction of the road there, (n,) [rad].
    """

    places: Floats
    road: Floats
    yaw: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """The outer border of an edge's carriageway: a kerb, or where the verge begins.

    Attributes:
        edge: The edge.
        line: Along the driving direction, (n, 3) [m].
        outward: 1 if away from the road is left of the line, -1 if right.
        walk: Width of the sidewalk beyond it [m]; 0 without one.
        road: Width of the carriageway [m].
    """

    edge: Edge
    line: Floats
    outward: int
    walk: float
    road: float

    @property
    def length(self) -> float:
        """[m]."""
        return float(np.linalg.norm(np.diff(self.line[:, :2], axis=0), axis=1).sum())

    def at(self, along: Floats, out: Floats | float) -> Beside:
        """Return places beside the border.

        Args:
            along: Distances from its begin, (n,) [m].
            out: Distances away from the road, (n,) or one [m].
        """
        step = np.diff(self.line, axis=0)
        knots = arc_length(self.line[:, :2])
        points = np.column_stack([np.interp(along, knots, column) for column in self.line.T])
        which = np.clip(np.searchsorted(knots, along, side="right") - 1, 0, len(step) - 1)
        yaw = np.arctan2(step[which, 1], step[which, 0])
        away = self.outward * np.column_stack([-np.sin(yaw), np.cos(yaw)])
        places = points[:, :2] + np.broadcast_to(out, len(yaw))[:, None] * away
        return Beside(settled(places), points[:, 2], yaw)

    def inward(self, yaw: Floats) -> Floats:
        """Return directions towards the road where it runs in directions, (n,) [rad]."""
        return np.asarray(yaw - self.outward * np.pi / 2)


def border_of(network: Network, edge: Edge) -> Border | None:
    """Return the outer border of an edge, or None for one without a carriageway."""
    roads = [lane for lane in edge.lanes if drives(lane)]
    if edge.function != "normal" or not roads:
        return None
    outermost = min(lane.index for lane in edge.lanes if lane.allowed - {"pedestrian"})
    lane = edge.lanes[[k.index for k in edge.lanes].index(outermost)]
    walks = [k for k in edge.lanes if k.index < outermost and "pedestrian" in k.allowed]
    outward = 1 if network.left_hand else -1
    line = offset(lane.shape, outward * lane.width / 2)
    walk = sum(walk.width for walk in walks)
    return Border(edge, line, outward, walk, sum(k.width for k in edge.lanes) - walk)


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """Ground that things are put on, and what already stands there.

    Attributes:
        around: Lanes, cameras and chance.
        standing: Height of whatever people walk on at places, (n, 2) -> (n,) [m].
        crossings: Areas that people cross roads on.
        taken: Places of other things, (n, 2) [m].
        lines: Fences.
        tile: Where things may be put; None is everywhere. Neighbours do the same on their
            side, so nothing is put where it would touch the border.
        used: What was put here; it grows.
        yielded: Where nothing was put as it would stand right before a camera; it grows.
    """

    around: Surroundings
    standing: HeightAt
    crossings: shapely.STRtree
    taken: Floats
    lines: shapely.STRtree
    tile: Tile | None = None
    used: list[Floats] = field(default_factory=list)
    yielded: list[Floats] = field(default_factory=list)

    def holds(self, places: Floats) -> Bools:
        """Return which places, (n, 2) [m], are this site's."""
        if self.tile is None or not len(places):
            return np.ones(len(places), dtype=np.bool_)
        return self.tile.holds(places)

    def free(
        self, places: Floats, *, radius: float, walks: bool = True, height: float = 0.0
    ) -> Bools:
        """Return which places are clear of lanes, crossings, other things and cameras.

        Args:
            places: (n, 2) [m].
            radius: Of what shall stand there [m].
            walks: Whether crossings are kept clear, too.
            height: Of what shall stand there [m]; 0 for what is too low to hide anything.
        """
        if not len(places):
            return np.zeros(0, dtype=np.bool_)
        spots = shapely.points(places)
        clear = ~self.around.index.covers(places, margin=radius + MARGIN)
        if walks and len(self.crossings.geometries):
            clear[self.crossings.query(spots, predicate="dwithin", distance=radius + 1.0)[0]] = (
                False
            )
        if len(self.lines.geometries):
            clear[self.lines.query(spots, predicate="dwithin", distance=radius + 0.3)[0]] = False
        others = np.concatenate([self.taken, *self.used])
        if len(others):
            away = np.hypot(*(places[:, None] - others[None]).transpose(2, 0, 1))
            clear &= away.min(axis=1) > radius + _GAP
        if self.tile is not None:
            clear &= self.tile.depth(places) > radius + _GAP / 2.0
        clear &= self.around.clearance.distances(places) > radius + _CAMERA
        if height and clear.any():
            clear[clear] = self.in_nobodys_way(places[clear], height=height, reach=_OUT)
        return np.asarray(clear)

    def in_nobodys_way(self, places: Floats, *, height: float, reach: float) -> Bools:
        """Return where an upright thing would not stand right before a camera.

        Args:
            places: (n, 2) [m].
            height: Of the thing [m].
            reach: How far parts of it stand out [m].
        """
        ground = self.around.index.heights(places)
        hides = self.around.clearance.before_lens(places, ground, height=height, reach=reach)
        if hides.any():
            self.yielded.append(places[hides])
        return ~hides

    def fills_nothing(self, places: Floats, *, height: float, radius: float) -> Bools:
        """Return where a thing, low or high, would not fill much of a camera's picture.

        Args:
            places: (n, 2) [m].
            height: Of the thing [m].
            radius: Half of how wide it is [m].
        """
        ground = self.around.index.heights(places)
        fills = self.around.clearance.filled(places, ground, height=height, radius=radius)
        if fills.any():
            self.yielded.append(places[fills])
        return ~fills

    def level_with(self, places: Floats, road: Floats, *, among: Bools) -> Bools:
        """Return which places have ground about as high as the road beside them.

        Args:
            places: (n, 2) [m].
            road: Its height, (n,) [m].
            among: The places that still count, (n,); the heights of others are not computed.
        """
        level = np.array(among)
        if level.any():
            level[among] = np.abs(self.standing(places[among]) - road[among]) < _STEP
        return level

    def stand(
        self, places: Floats, road: Floats, yaws: Floats, *, among: Bools
    ) -> Transform | None:
        """Take the first place that is level with the road, and return how things stand there.

        Args:
            places: (n, 2) [m].
            road: Its height, (n,) [m].
            yaws: Where a thing would look, (n,) [rad].
            among: The places that are free, (n,).

        Returns:
            None if there is no such place.
        """
        good = self.level_with(places, road, among=among)
        if not good.any():
            return None
        i = int(np.argmax(good))
        self.use(places[i : i + 1])
        z = float(self.standing(places[i : i + 1])[0])
        return Transform.from_pose((*places[i], z), yaw=float(yaws[i]))

    def use(self, places: Floats) -> None:
        """Remember that something stands at places, (n, 2) [m]."""
        if len(places):
            self.used.append(np.asarray(places, dtype=np.float64))


def crossing_areas(network: Network) -> shapely.STRtree:
    """Return areas of all crossings."""
    lanes = [
        lane
        for edge in network.edges.values()
        if edge.function in _WALKS
        for lane in edge.lanes
        if len(lane.shape) > 1
    ]
    return shapely.STRtree(
        [shapely.LineString(k.shape[:, :2]).buffer(k.width / 2, cap_style="flat") for k in lanes]
    )


def borders_in(network: Network, box: shapely.Polygon, memory: Memory) -> list[Border]:
    """Return the borders of the edges that may run through a box, by edge id.

    Args:
        network: The network.
        box: Parallel to the axes [m].
        memory: Of the network's world.
    """
    borders = [
        memory.of(("border", edge.id), partial(border_of, network, edge))
        for edge in edges_in(network, box, memory)
    ]
    return [border for border in borders if border is not None and border.length > 1.0]


def borders_near(network: Network, around: Surroundings, *, reach: float) -> list[Border]:
    """Return the borders of edges that come near a camera, by edge id.

    Args:
        network: The network.
        around: The cameras.
        reach: A point of the edge lies within this distance of a camera [m].
    """
    borders: list[Border] = []
    box = shapely.box(-np.inf, -np.inf, np.inf, np.inf)
    if len(eyes := around.viewpoints[:, :2]):
        box = shapely.box(*(eyes.min(axis=0) - reach), *(eyes.max(axis=0) + reach))
    for edge in edges_in(network, box, around.memory):
        if edge.function != "normal":
            continue
        shape = edge.lanes[0].shape[:, :2]
        if around.distances(_dense(shape)).min() > reach:
            continue
        border = border_of(network, edge)
        if border is not None and border.length > 1.0:
            borders.append(border)
    return borders


def is_urban(border: Border) -> bool:
    """Return whether lamps and benches stand along an edge: in town, and no motorway."""
    if "motorway" in border.edge.type or "trunk" in border.edge.type:
        return False
    return border.walk > 0.0 or border.edge.told_speed <= 60.0 / 3.6 + 0.1


def spread(
    length: float, spacing: float, *, ends: tuple[float, float], shift: float = 0.5
) -> Floats:
    """Return evenly spaced distances along a length, clear of both ends, (n,) [m].

    Args:
        length: [m].
        spacing: About [m].
        ends: Kept clear at the begin and at the end [m].
        shift: Where the first one stands within a spacing, in [0, 1].
    """
    room = length - sum(ends)
    if room < 0.0:
        return np.zeros(0)
    count = max(1, round(room / spacing))
    at: Floats = ends[0] + (np.arange(count) + shift) * room / count
    return at


def drives(lane: Lane) -> bool:
    """Whether cars or buses drive on a lane."""
    return bool(lane.allowed & {"passenger", "bus", "truck", "delivery"})


def _dense(shape: Floats, step: float = 100.0) -> Floats:
    """Points along a polyline at most a step apart, (m, 2) [m]."""
    pieces: list[Sequence[float] | Floats] = []
    for a, b in pairwise(shape):
        count = int(np.hypot(*(b - a)) // step) + 1
        pieces += [a + (b - a) * k / count for k in range(count)]
    return np.array([*pieces, shape[-1]])


def offset(shape: Floats, left: float) -> Floats:
    """Return a polyline moved to its left [m]; bends are mitred."""
    step = np.diff(shape[:, :2], axis=0)
    length = np.linalg.norm(step, axis=1)
    shape, step = shape[np.append(True, length > 1e-3)], step[length > 1e-3]
    if not len(step):
        return shape
    step = step / np.linalg.norm(step, axis=1, keepdims=True)
    normal = np.column_stack([-step[:, 1], step[:, 0]])
    before, after = np.vstack([normal[:1], normal]), np.vstack([normal, normal[-1:]])
    mitre = (before + after) / np.maximum(1.0 + (before * after).sum(axis=1), 0.5)[:, None]
    moved: Floats = shape.copy()
    moved[:, :2] += left * mitre
    return moved
