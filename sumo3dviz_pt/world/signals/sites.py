"""Where signal heads stand: at every signalled stop line and crossing.

Vehicles: a pole 0.7 m beyond the edge's outer border (right in right-hand traffic),
sidewalk and bicycle lane included, 3.5 m behind the stop line, so that drivers who wait at
the line see it, or nearer where a carriageway is in the way; it carries one head per
different course of the edge, in lane order. Edges with three or more signalled lanes
also get an arm with heads over each lane. Pedestrians: a pole at either end of a crossing.

References:
    Distance from stop line to signal: FGSV, Richtlinien fuer Lichtsignalanlagen (RiLSA),
    which asks for 2.5 m at least and 3.5 m usually.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Lane, Network
from sumo3dviz_pt.world.placement.lane_index import LaneIndex
from sumo3dviz_pt.world.rails.guards import guard_of, only_rails
from sumo3dviz_pt.world.signals.aspects import AspectCourse

POLE_BOTTOM, ARM_BOTTOM, WALK_BOTTOM = 2.2, 4.7, 2.1
"""Heights of the lower edge of heads on poles, on arms and for pedestrians [m]."""
_BESIDE, _SPACING = 0.7, 0.56
_BEHIND = (3.5, 2.0)  # places behind the stop line that are tried first [m]
_LAST = 0.5  # and the last one [m]
_WIDE = 3  # signalled lanes from which an arm reaches over the road
_STEPS = np.arange(0.0, 8.0, 0.5)  # how far a pole may move outwards [m]
_UP = np.array([0.0, 0.0, 1.0])
_TURN = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
_CIRCLE = np.column_stack([np.cos(_TURN), np.sin(_TURN), 0.0 * _TURN])
_WALKS = ("crossing", "walkingarea")
_CYCLISTS = frozenset({"bicycle", "scooter"})
RAIL_BOTTOM = 3.9
"""Height of the lower edge of rail signals [m]."""
_RAIL_BESIDE = 2.6  # from a track's middle to the mast of its signal [m]
_STRAIGHT = np.radians(25.0)  # a driver sees heads at most so far above or aside [rad]
_EYE_BACK, _EYE_UP = 3.2, 1.2  # a waiting driver's eye before the lane's end, and above it [m]
_FARTHEST = 60.0  # from a stop line to a head beyond the junction [m]


HeadKind = Literal["vehicle", "foot", "bicycle", "tram", "rail"]
"""For whom a head is: road vehicles, people on foot, cyclists alone, trams alone, trains."""


@dataclass(frozen=True, slots=True, eq=False)
class Head:
    """A signal head to be built.

    Attributes:
        tls: Id of its traffic light.
        links: Every link whose state it shows; the first names it.
        course: What it shows.
        lamps: 2 or 3.
        position: Below the middle of its housing, (3,) [m].
        yaw: Driving or walking direction of those who see it [rad].
        foot: Where its pole stands, (3,) [m].
        kind: For whom it is.
        counter: Whether it has digits that count seconds.
    """

    tls: str
    links: tuple[int, ...]
    course: AspectCourse
    lamps: int
    position: Floats
    yaw: float
    foot: Floats
    kind: HeadKind = "vehicle"
    counter: bool = False

    @property
    def walks(self) -> bool:
        """Whether it is for people on foot."""
        return self.kind == "foot"

    @property
    def over_road(self) -> bool:
        """Whether it hangs on an arm."""
        return float(self.position[2] - self.foot[2]) > ARM_BOTTOM - 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Support:
    """A pole, or a mast with an arm.

    Attributes:
        position: Its foot, (3,) [m].
        yaw: As its heads' [rad].
        height: [m].
        reach: Length of the arm, to the left positive [m]; 0 for a pole.
        bar: Width of the crossbar that several heads hang on [m]; 0 for none.
        rail: Whether it carries a rail signal.
    """

    position: Floats
    yaw: float
    height: float
    reach: float = 0.0
    bar: float = 0.0
    rail: bool = False

    @property
    def foot(self) -> Floats:
        """Where it stands, (3,) [m]."""
        return self.position


CourseOf = Callable[[Connection, int], AspectCourse]
"""The course of a connection's link as a head with 2 or 3 lamps shows it."""


@dataclass(frozen=True, slots=True)
class _SignalGroup:
    """Links of a traffic light that always show the same.

    Attributes:
        tls: Id of the traffic light.
        course: What it shows them.
        links: Their numbers.
        kind: For whom it is.
    """

    tls: str
    course: AspectCourse
    links: tuple[int, ...]
    kind: HeadKind = "vehicle"


@dataclass(frozen=True, slots=True, eq=False)
class _HeadDesign:
    """How heads are made, whatever they stand at.

    Attributes:
        network: Says who uses a lane.
        index: Keeps poles off carriageways.
        course_of: Says what a head for a link shows.
        lamps: Of a head for vehicles, 2 or 3.
        far_side: When a head stands beyond the junction, too; as in `SignalStyle`.
    """

    network: Network
    index: LaneIndex
    course_of: CourseOf
    lamps: int
    far_side: str = "never"

    def groups(self, links: Sequence[Connection], *, lamps: int) -> list[_SignalGroup]:
        """Links that always show the same on heads of 2 or 3 lamps, in the order given."""
        found: dict[tuple[str, AspectCourse, HeadKind], list[int]] = {}
        for link in links:
            key = (link.tls, self.course_of(link, lamps), kind_of(self.network, link))
            if link.link_index not in found.setdefault(key, []):
                found[key].append(link.link_index)
        return [
            _SignalGroup(tls, course, tuple(numbers), kind)
            for (tls, course, kind), numbers in found.items()
        ]


@dataclass(frozen=True, slots=True, eq=False)
class _Stand:
    """Where some heads hang side by side.

    Attributes:
        foot: Of their pole, (3,) [m].
        bottom: Of the middle of their row, (3,) [m].
        inward: Direction of the row, from the outer lanes' heads on, (3,).
        along: Driving or walking direction of those who see them, (3,).
        yaw: The same as an angle [rad].
    """

    foot: Floats
    bottom: Floats
    inward: Floats
    along: Floats
    yaw: float

    def row(self, groups: Sequence[_SignalGroup], *, lamps: int) -> list[Head]:
        """Return one head of so many lamps for each group."""
        offsets = (np.arange(len(groups)) - (len(groups) - 1) / 2) * _SPACING
        return [
            Head(
                group.tls,
                group.links,
                group.course,
                lamps,
                self.bottom + offset * self.inward - 0.19 * self.along,
                self.yaw,
                self.foot,
                group.kind,
            )
            for group, offset in zip(groups, offsets, strict=True)
        ]


def kind_of(network: Network, link: Connection) -> HeadKind:
    """Return for whom a head is that shows the state of a connection."""
    lane = network.lanes[link.from_lane]
    if network.edges[lane.edge_id].function in _WALKS:
        return "foot"
    if guard_of(network, link) == "rail signal":
        return "rail"
    if only_rails(lane):
        return "tram" if "tram" in lane.allowed else "rail"
    return "bicycle" if lane.allowed and lane.allowed <= _CYCLISTS else "vehicle"


def sites(
    network: Network,
    links: Sequence[Connection],
    *,
    index: LaneIndex,
    course_of: CourseOf,
    lamps: int,
    far_side: str = "never",
) -> tuple[list[Head], list[Support]]:
    """Place signal heads and what carries them.

    Args:
        network: The road network.
        links: Signalled connections.
        index: Keeps poles off carriageways.
        course_of: Says what a head for a link shows.
        lamps: Of a head for vehicles, 2 or 3.
        far_side: When a head stands beyond the junction, too; as in `SignalStyle`.
    """
    heads: list[Head] = []
    supports: list[Support] = []
    design = _HeadDesign(network, index, course_of, lamps, far_side)
    for edge, own in _by_edge(network, links).items():
        if network.edges[edge].function in _WALKS:
            made = _crossing(network.edges[edge], design.groups(own, lamps=2), index)
        elif all(kind_of(network, link) == "rail" for link in own):
            made = _rail_signal(network, network.edges[edge], own, design)
        else:
            made = _approach(network, network.edges[edge], own, design)
        heads += made[0]
        supports += made[1]
    return heads, supports


def _by_edge(network: Network, links: Sequence[Connection]) -> Mapping[str, list[Connection]]:
    """Links by the edge whose end they guard, or by the crossing they let people onto."""
    found: dict[str, list[Connection]] = {}
    for link in links:
        start, end = (
            network.edges[network.lanes[lane].edge_id] for lane in (link.from_lane, link.to_lane)
        )
        if start.function in _WALKS:
            crossing = end if end.function == "crossing" else start
            found.setdefault(crossing.id, []).append(link)
        elif start.function != "internal":
            found.setdefault(start.id, []).append(link)
    return found


def _approach(
    network: Network, edge: Edge, links: list[Connection], design: _HeadDesign
) -> tuple[list[Head], list[Support]]:
    """Heads at the end of an edge."""
    # Choose what the heads on the pole show.
    lamps = design.lamps
    number = {lane.id: lane.index for lane in edge.lanes}
    links = sorted(links, key=lambda link: (number[link.from_lane], link.link_index))
    groups = design.groups(links, lamps=lamps)
    # Find a place for the pole.
    along, yaw = _direction(edge.lanes[0].shape)
    outward = _left(along) if network.left_hand else -_left(along)
    bar = (len(groups) - 1) * _SPACING
    # Lanes that end beside the pole do not cover its place behind their ends: probe there too.
    probes = (0.0 * along, -2.0 * along, -4.5 * along, -bar / 2 * outward)
    foot = _freest(_feet(edge, along, outward, bar), probes, design.index)
    stand = _Stand(foot, foot + POLE_BOTTOM * _UP, -outward, along, yaw)
    heads = stand.row(groups, lamps=lamps)
    # Where the road is wide, an arm carries heads over each lane.
    over = {k.from_lane for k in links if kind_of(network, k) in ("vehicle", "tram")}
    lanes = [lane for lane in edge.lanes if lane.id in over]
    height = POLE_BOTTOM + 0.3 * lamps + 0.12
    if len(lanes) < _WIDE:
        beyond = _far_side(edge, lanes, heads, groups, design)
        return [*heads, *beyond[0]], [Support(foot, yaw, height, bar=bar), *beyond[1]]
    for lane in lanes:
        own = design.groups([k for k in links if k.from_lane == lane.id], lamps=lamps)
        across = float((lane.shape[-1] - foot) @ -outward)
        bottom = foot - across * outward + (ARM_BOTTOM + 0.3 * (3 - lamps)) * _UP
        heads += replace(stand, bottom=bottom).row(own, lamps=lamps)
    reach = max((float((lane.shape[-1] - foot) @ _left(along)) for lane in lanes), key=abs)
    reach += 0.5 * float(np.sign(reach))
    beyond = _far_side(edge, lanes, heads, groups, design)
    return [*heads, *beyond[0]], [Support(foot, yaw, ARM_BOTTOM + 1.0, reach, bar), *beyond[1]]


def _far_side(
    edge: Edge,
    lanes: Sequence[Lane],
    heads: Sequence[Head],
    groups: Sequence[_SignalGroup],
    design: _HeadDesign,
) -> tuple[list[Head], list[Support]]:
    """Repeat an edge's heads beyond its junction, where its drivers need that.

    Args:
        edge: The edge.
        lanes: Its signalled lanes.
        heads: Those at its stop line.
        groups: What they show.
        design: How heads are made, and when they are repeated.
    """
    shown = [group for group in groups if group.kind in ("vehicle", "bicycle")]
    hidden = any(_out_of_view(lane, heads) for lane in lanes)
    wanted = design.far_side == "always" or (
        design.far_side == "when_hidden" and (hidden or len(lanes) >= _WIDE)
    )
    junction = design.network.junctions.get(edge.to_junction)
    if not wanted or not shown or junction is None or len(junction.outline) < 3:
        return [], []
    # Go straight across the junction, from the middle of the lanes, to its other side.
    along, yaw = _direction(lanes[-1].shape)
    start = np.mean([lane.shape[-1] for lane in lanes], axis=0)
    outline = shapely.Polygon(junction.outline[:, :2]).convex_hull
    ray = shapely.LineString([start[:2], (start + _FARTHEST * along)[:2]])
    inside = shapely.intersection(ray, outline)
    if inside.is_empty:
        return [], []
    reach = float(((shapely.get_coordinates(inside) - start[:2]) @ along[:2]).max())
    if not 8.0 < reach < _FARTHEST - 1.0:
        return [], []
    # Stand beside the road that goes on there, at the side of the stop line's pole, and at
    # its other side too where some of many lanes would not see that.
    outward = _left(along) if design.network.left_hand else -_left(along)
    width = sum(lane.width for lane in edge.lanes) / 2
    bar = (len(shown) - 1) * _SPACING
    aside = width + _BESIDE + bar / 2 + np.arange(0.0, 7.0, 0.5)
    ahead = (reach + np.array([0.6, 1.5, 2.5, 4.0, 6.0]))[:, None, None] * along
    probes = (0.0 * along, -bar / 2 * outward, bar / 2 * outward)
    height = POLE_BOTTOM + 0.3 * design.lamps + 0.12
    made: list[Head] = []
    supports: list[Support] = []
    for side in (outward, -outward):
        if made and not any(_out_of_view(lane, [*heads, *made]) for lane in lanes):
            break
        places = start + (ahead + aside[:, None] * side).reshape(-1, 3)
        foot = _freest(places, probes, design.index)
        stand = _Stand(foot, foot + POLE_BOTTOM * _UP, -outward, along, yaw)
        made += stand.row(shown, lamps=design.lamps)
        supports.append(Support(foot, yaw, height, bar=bar))
    return made, supports


def _out_of_view(lane: Lane, heads: Sequence[Head]) -> bool:
    """Whether a driver who waits on a lane sees no head well."""
    along, _ = _direction(lane.shape)
    eye = lane.shape[-1] - _EYE_BACK * along + _EYE_UP * _UP
    towards = np.array([head.position + 0.15 * head.lamps * _UP for head in heads]) - eye
    ahead = towards @ along
    away = np.linalg.norm(towards, axis=1)
    return bool((ahead < np.cos(_STRAIGHT) * away).all())


def _rail_signal(
    network: Network, edge: Edge, links: list[Connection], design: _HeadDesign
) -> tuple[list[Head], list[Support]]:
    """A mast at the right of each track (left where traffic keeps left), at its end."""
    heads: list[Head] = []
    supports: list[Support] = []
    for lane in edge.lanes:
        groups = design.groups([k for k in links if k.from_lane == lane.id], lamps=2)
        if not groups:
            continue
        along, yaw = _direction(lane.shape)
        outward = _left(along) if network.left_hand else -_left(along)
        aside = _RAIL_BESIDE + np.array([0.0, 0.4, -0.4, 0.8, 1.2, 1.8, 2.4, 3.0])
        back = np.array([0.0, -4.0, -8.0, -15.0, -25.0])
        places = lane.shape[-1] + (back[:, None, None] * along + aside[:, None] * outward)
        foot = _freest(places.reshape(-1, 3), (0.0 * along,), design.index, margin=0.55)
        stand = _Stand(foot, foot + RAIL_BOTTOM * _UP, -outward, along, yaw)
        heads += stand.row(groups, lamps=2)
        bar = (len(groups) - 1) * _SPACING
        supports.append(Support(foot, yaw, RAIL_BOTTOM + 0.75, bar=bar, rail=True))
    return heads, supports


def _crossing(
    edge: Edge, groups: Sequence[_SignalGroup], index: LaneIndex
) -> tuple[list[Head], list[Support]]:
    """Heads at both ends of a crossing, each looking over the road."""
    lane = edge.lanes[0]
    heads: list[Head] = []
    supports: list[Support] = []
    for shape in (lane.shape, lane.shape[::-1]):
        along, yaw = _direction(shape)
        beside = -_left(along) * (lane.width / 2 + 0.35)
        places = [
            shape[-1] + out * along + side * beside
            for side in (1.0, -1.0, 1.5, -1.5)
            for out in (0.4, 0.1, 0.9, 1.5, 2.2, 3.0)
        ]
        foot = _freest(np.array(places), (0.0 * along,), index)
        stand = _Stand(foot, foot + WALK_BOTTOM * _UP, _left(along), along, yaw)
        heads += stand.row(groups, lamps=2)
        bar = (len(groups) - 1) * _SPACING
        supports.append(Support(foot, yaw, WALK_BOTTOM + 0.7, bar=bar))
    return heads, supports


def _feet(edge: Edge, along: Floats, outward: Floats, bar: float) -> Floats:
    """Places for a pole with a crossbar at an edge's end, best first, (n, 3) [m]."""
    outer, inner = edge.lanes[0], edge.lanes[-1]
    border = outer.shape[-1] + (outer.width / 2 + _BESIDE + bar / 2) * outward
    near = [border + behind * along + _STEPS[:4, None] * outward for behind in _BEHIND]
    far = border + _LAST * along + _STEPS[:, None] * outward
    opposite = inner.shape[-1] + _LAST * along - (inner.width / 2 + _BESIDE) * outward
    return np.vstack([*near, far, opposite])


def _freest(
    candidates: Floats, probes: Sequence[Floats], index: LaneIndex, *, margin: float = 0.3
) -> Floats:
    """The first place that is most clear of carriageways, and never one on a lane.

    Args:
        candidates: Places for a pole, best first, (n, 3) [m].
        probes: Vectors from the pole to what must not be over a carriageway, (3,) each; the
            first is the pole's own foot.
        index: The network's lanes.
        margin: Between a pole's middle and a lane, at least [m].
    """
    blocked = np.array([index.covers((candidates + k)[:, :2], margin=margin) for k in probes])
    # A pole on a lane is worse than any number of heads over one.
    cost = blocked.sum(axis=0) + len(probes) * blocked[0]
    best: Floats = candidates[int(np.argmin(cost))]
    if cost.min() <= len(probes):
        return best
    # In joined junctions all usual places may lie on lanes: take the nearest that does not.
    rings = best + np.concatenate([r * _CIRCLE for r in np.arange(0.5, 40.0, 0.5)])
    free = ~index.covers(rings[:, :2], margin=margin)
    return np.asarray(rings[int(np.argmax(free))] if free.any() else best)


def _direction(shape: Floats) -> tuple[Floats, float]:
    """Horizontal unit direction at a polyline's end, (3,), and its yaw [rad]."""
    away = np.linalg.norm(shape[:, :2] - shape[-1, :2], axis=1)
    far = np.flatnonzero(away > 1.0)
    step = shape[-1] - shape[far[-1] if len(far) else 0]
    length = float(np.hypot(step[0], step[1]))
    if length < 1e-9:
        return np.array([1.0, 0.0, 0.0]), 0.0
    return np.array([step[0], step[1], 0.0]) / length, float(np.arctan2(step[1], step[0]))


def _left(along: Floats) -> Floats:
    """The horizontal direction to the left of another."""
    return np.array([-along[1], along[0], 0.0])
