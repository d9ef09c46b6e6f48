"""Where signal heads stand: at every signalled stop line and crossing.

Vehicles: a pole 0.7 m beyond the edge's outer border (right in right-hand traffic),
sidewalk and bicycle lane included, 4.5 m behind the stop line, so that the pictures of drivers
who wait at the line show it, or nearer where a carriageway is in the way; it carries one head per
different course of the edge, in lane order. Edges with three or more signalled lanes
also get an arm with heads over each lane. Pedestrians: a pole at either end of a
crossing, or the pole of a road's heads or of another crossing that stands near.

Heads are repeated beyond the junction for drivers who cannot see those at their stop line.

References:
    Distance from stop line to signal: FGSV, Richtlinien fuer Lichtsignalanlagen (RiLSA),
    which asks for 2.5 m at least and 3.5 m usually.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Network
from sumo3dviz_pt.world.placement.lanes import DrivenGround
from sumo3dviz_pt.world.signals.heads import (
    ARM_BOTTOM,
    BESIDE,
    POLE_BOTTOM,
    RAIL_BOTTOM,
    SPACING,
    UP,
    WALK_BOTTOM,
    WALKS,
    WIDE,
    CourseOf,
    Head,
    HeadDesign,
    HeadStand,
    SignalGroup,
    Support,
    direction_at_end,
    freest,
    kind_of,
    leftward,
    row_offsets,
)

_ASIDE, _ABOVE = np.tan(np.radians([23.0, 14.5]))
"""How far aside of straight ahead and above it the view of a waiting driver shows a head, as
tangents; the preset `driver` has 30 and 16 degrees."""

_EYE_BACK, _EYE_ASIDE, _EYE_UP = 3.1, 0.37, 1.2
"""A waiting driver's eye: before the lane's end, towards the road's middle, and above [m]."""

_NEAREST, _FARTHEST = 6.0, 60.0  # from a stop line to a head beyond the junction [m]
_TRIED = np.array([0.6, 1.5, 2.5, 4.0, 6.0, 9.0, 12.0, 16.0, 20.0])
"""Places behind a junction's end [m]; the later ones where drivers do not see the first."""


def far_side_heads(
    edge: Edge,
    links: Sequence[Connection],
    heads: Sequence[Head],
    groups: Sequence[SignalGroup],
    design: HeadDesign,
) -> tuple[list[Head], list[Support]]:
    """Repeat an edge's heads beyond its junction, where its drivers need that.

    Args:
        edge: The edge.
        links: Of its signalled lanes.
        heads: Those at its stop line.
        groups: What they show.
        design: How heads are made, and when they are repeated.
    """
    shown = [group for group in groups if group.kind in ("vehicle", "bicycle")]
    lanes = [lane for lane in edge.lanes if any(k.from_lane == lane.id for k in links)]
    left_hand = design.network.left_hand
    hidden = any(out_of_view(lane, links, heads, left_hand=left_hand) for lane in lanes)
    wanted = design.far_side == "always" or (
        design.far_side == "when_hidden" and (hidden or len(lanes) >= WIDE)
    )
    junction = design.network.junctions.get(edge.to_junction)
    if not wanted or not lanes or not shown or junction is None or len(junction.outline) < 3:
        return [], []
    # Go straight across the junction, from the middle of the lanes, to its other side.
    along, yaw = direction_at_end(lanes[-1].shape)
    start = np.mean([lane.shape[-1] for lane in lanes], axis=0)
    reach = _across(junction, start, along)
    # Stand beside the road that goes on there, at the side of the stop line's pole, and at
    # its other side too where some of many lanes would not see that.
    outward = leftward(along) if left_hand else -leftward(along)
    width = sum(lane.width for lane in edge.lanes) / 2
    bar = (len(shown) - 1) * SPACING
    aside = width + BESIDE + bar / 2 + np.arange(0.0, 7.0, 0.5)
    ahead = (reach + _TRIED)[:, None, None] * along
    row = [offset * outward for offset in row_offsets(len(shown))]
    height = POLE_BOTTOM + 0.3 * design.lamps + 0.12
    made: list[Head] = []
    supports: list[Support] = []
    for side in (outward, -outward):
        shown_by = [*heads, *made]
        if made and not any(
            out_of_view(lane, links, shown_by, left_hand=left_hand) for lane in lanes
        ):
            break
        places = start + (ahead + aside[:, None] * side).reshape(-1, 3)
        foot = freest(_well_seen(design, lanes, places), row, design.ground)
        stand = HeadStand(foot, foot + POLE_BOTTOM * UP, -outward, along, yaw)
        made += stand.row(shown, lamps=design.lamps)
        supports.append(Support(foot, yaw, height, bar=bar))
    return made, supports


def _across(junction: Junction, start: Floats, along: Floats) -> float:
    """How far it is from a place straight across a junction to its other side [m].

    Where its outline does not lie there, or ends at once, a head stands as near as the view of
    those who wait still shows it.
    """
    outline = shapely.Polygon(junction.outline[:, :2]).convex_hull
    ray = shapely.LineString([start[:2], (start + _FARTHEST * along)[:2]])
    inside = shapely.get_coordinates(shapely.intersection(ray, outline))
    return float(np.clip(((inside - start[:2]) @ along[:2]).max(initial=0.0), _NEAREST, _FARTHEST))


def _well_seen(design: HeadDesign, lanes: Sequence[Lane], places: Floats) -> Floats:
    """Places of poles, (n, 3), those first whose heads most of the lanes' drivers see."""
    tops = places + (POLE_BOTTOM + 0.3 * design.lamps) * UP
    count = sum(_pictured(lane, tops, left_hand=design.network.left_hand) for lane in lanes)
    return np.asarray(places[np.argsort(-np.asarray(count), kind="stable")])


def out_of_view(
    lane: Lane, links: Sequence[Connection], heads: Sequence[Head], *, left_hand: bool
) -> bool:
    """Return whether the picture of a driver who waits first on a lane shows no head of his.

    Args:
        lane: Where he waits.
        links: Of its edge.
        heads: Those that show none of the lane's own links do not count.
        left_hand: Whether traffic keeps left.
    """
    own = {(k.tls, k.link_index) for k in links if k.from_lane == lane.id}
    mine = [head for head in heads if any((head.tls, link) in own for link in head.links)]
    tops = np.array([head.position + 0.3 * head.lamps * UP for head in mine]).reshape(-1, 3)
    return not _pictured(lane, tops, left_hand=left_hand).any()


def _pictured(lane: Lane, tops: Floats, *, left_hand: bool) -> Ints:
    """Which tops of heads, (n, 3), are in the picture of who waits first on a lane, 0 or 1."""
    along, _ = direction_at_end(lane.shape)
    left = leftward(along)
    middle = -left if left_hand else left
    towards = tops - (lane.shape[-1] - _EYE_BACK * along + _EYE_ASIDE * middle + _EYE_UP * UP)
    ahead = np.maximum(towards @ along, 1e-6)
    shown = (np.abs(towards @ left) < _ASIDE * ahead) & (towards[:, 2] < _ABOVE * ahead)
    return np.asarray(shown, dtype=np.int64)


_NEAR = 2.6  # a pole this near is shared [m]
_LEVEL = 0.6  # poles whose feet differ by more in height are not shared [m]
_APART = np.cos(np.radians(50.0))  # heads on one pole look into directions that differ by more


@dataclass(slots=True)
class _Pole:
    """A support with its heads.

    Attributes:
        support: What carries them.
        heads: Their numbers.
    """

    support: Support
    heads: list[int]


def with_shared_poles(
    heads: Sequence[Head], supports: Sequence[Support]
) -> tuple[list[Head], list[Support]]:
    """Return heads and supports with few poles where people cross.

    A pole with a single head for people on foot is left out where another pole stands near,
    and no head on that looks into a similar direction; the head hangs on it instead.

    Args:
        heads: All of them, each at the foot of its support.
        supports: All of them.
    """
    made = list(heads)
    by_foot: dict[bytes, list[int]] = {}
    for number, head in enumerate(heads):
        by_foot.setdefault(head.foot.tobytes(), []).append(number)
    poles = [_Pole(support, by_foot.get(support.foot.tobytes(), [])) for support in supports]
    stay = [pole for pole in poles if not _may_move(pole, heads)]
    for pole in poles:
        if not _may_move(pole, heads):
            continue
        other = _host(pole, stay, made)
        if other is None:
            stay.append(pole)
            continue
        (number,) = pole.heads
        foot = other.support.foot
        hung = made[number].position - made[number].foot + foot
        made[number] = replace(made[number], position=hung, foot=foot)
        other.heads.append(number)
    return made, [pole.support for pole in poles if any(pole is one for one in stay)]


def _may_move(pole: _Pole, heads: Sequence[Head]) -> bool:
    """Whether a pole carries nothing but one head for people on foot."""
    return len(pole.heads) == 1 and heads[pole.heads[0]].walks


def _host(pole: _Pole, others: Sequence[_Pole], heads: Sequence[Head]) -> _Pole | None:
    """The nearest pole that can take a pole's head, or None."""
    yaw = heads[pole.heads[0]].yaw
    hosts = []
    for other in others:
        step = other.support.foot - pole.support.foot
        similar = any(np.cos(heads[k].yaw - yaw) > _APART for k in other.heads)
        away = round(float(np.hypot(step[0], step[1])), 6)
        if away <= _NEAR and abs(step[2]) <= _LEVEL and not similar and not other.support.rail:
            hosts.append((away, other))
    return min(hosts, key=lambda one: one[0])[1] if hosts else None


_BEHIND = (4.5, 3.5, 2.0)  # places behind the stop line that are tried first [m]
_LAST = 0.5  # and the last one [m]
_STEPS = np.arange(0.0, 8.0, 0.5)  # how far a pole may move outwards [m]
_RAIL_BESIDE = 2.6  # from a track's middle to the mast of its signal [m]


def sites(
    network: Network,
    links: Sequence[Connection],
    *,
    ground: DrivenGround,
    course_of: CourseOf,
    lamps: int,
    far_side: str = "never",
) -> tuple[list[Head], list[Support]]:
    """Place signal heads and what carries them.

    Args:
        network: The road network.
        links: Signalled connections.
        ground: Keeps poles off carriageways.
        course_of: Says what a head for a link shows.
        lamps: Of a head for vehicles, 2 or 3.
        far_side: When a head stands beyond the junction, too; as in `SignalStyle`.
    """
    heads: list[Head] = []
    supports: list[Support] = []
    design = HeadDesign(network, ground, course_of, lamps, far_side)
    for edge, own in _by_edge(network, links).items():
        if network.edges[edge].function in WALKS:
            made = _crossing(network.edges[edge], design.groups(own, lamps=2), ground)
        elif all(kind_of(network, link) == "rail" for link in own):
            made = _rail_signal(network, network.edges[edge], own, design)
        else:
            made = _approach(network, network.edges[edge], own, design)
        heads += made[0]
        supports += made[1]
    return with_shared_poles(heads, supports)


def _by_edge(network: Network, links: Sequence[Connection]) -> Mapping[str, list[Connection]]:
    """Links by the edge whose end they guard, or by the crossing they let people onto."""
    by_edge: dict[str, list[Connection]] = {}
    for link in links:
        start, end = (
            network.edges[network.lanes[lane].edge_id] for lane in (link.from_lane, link.to_lane)
        )
        if start.function in WALKS:
            crossing = end if end.function == "crossing" else start
            by_edge.setdefault(crossing.id, []).append(link)
        elif start.function != "internal":
            by_edge.setdefault(start.id, []).append(link)
    return by_edge


def _approach(
    network: Network, edge: Edge, links: list[Connection], design: HeadDesign
) -> tuple[list[Head], list[Support]]:
    """Heads at the end of an edge."""
    # Choose what the heads on the pole show.
    lamps = design.lamps
    number = {lane.id: lane.index for lane in edge.lanes}
    links = sorted(links, key=lambda link: (number[link.from_lane], link.link_index))
    groups = design.groups(links, lamps=lamps)
    # Find a place for the pole.
    along, yaw = direction_at_end(edge.lanes[0].shape)
    outward = leftward(along) if network.left_hand else -leftward(along)
    bar = (len(groups) - 1) * SPACING
    # Lanes that end beside the pole do not cover its place behind their ends: probe there too.
    places = _feet(edge, along, outward, bar)
    row = [offset * -outward for offset in row_offsets(len(groups))]
    foot = freest(places, row, design.ground, wishes=(-2.0 * along, -4.5 * along))
    stand = HeadStand(foot, foot + POLE_BOTTOM * UP, -outward, along, yaw)
    heads = stand.row(groups, lamps=lamps)
    # Where the road is wide, an arm carries heads over each lane.
    driven = [k for k in links if kind_of(network, k) in ("vehicle", "tram")]
    over = {k.from_lane for k in driven}
    lanes = [lane for lane in edge.lanes if lane.id in over]
    height = POLE_BOTTOM + 0.3 * lamps + 0.12
    if len(lanes) < WIDE:
        beyond = far_side_heads(edge, driven, heads, groups, design)
        return [*heads, *beyond[0]], [Support(foot, yaw, height, bar=bar), *beyond[1]]
    for lane in lanes:
        own = design.groups([k for k in links if k.from_lane == lane.id], lamps=lamps)
        across = float((lane.shape[-1] - foot) @ -outward)
        bottom = foot - across * outward + (ARM_BOTTOM + 0.3 * (3 - lamps)) * UP
        heads += replace(stand, bottom=bottom).row(own, lamps=lamps)
    reach = max((float((lane.shape[-1] - foot) @ leftward(along)) for lane in lanes), key=abs)
    reach += 0.5 * float(np.sign(reach))
    beyond = far_side_heads(edge, driven, heads, groups, design)
    return [*heads, *beyond[0]], [Support(foot, yaw, ARM_BOTTOM + 1.0, reach, bar), *beyond[1]]


def _rail_signal(
    network: Network, edge: Edge, links: list[Connection], design: HeadDesign
) -> tuple[list[Head], list[Support]]:
    """A mast at the right of each track (left where traffic keeps left), at its end."""
    heads: list[Head] = []
    supports: list[Support] = []
    for lane in edge.lanes:
        groups = design.groups([k for k in links if k.from_lane == lane.id], lamps=2)
        if not groups:
            continue
        along, yaw = direction_at_end(lane.shape)
        outward = leftward(along) if network.left_hand else -leftward(along)
        aside = _RAIL_BESIDE + np.array([0.0, 0.4, -0.4, 0.8, 1.2, 1.8, 2.4, 3.0])
        back = np.array([0.0, -4.0, -8.0, -15.0, -25.0])
        places = lane.shape[-1] + (back[:, None, None] * along + aside[:, None] * outward)
        foot = freest(places.reshape(-1, 3), (), design.ground, margin=0.55)
        stand = HeadStand(foot, foot + RAIL_BOTTOM * UP, -outward, along, yaw)
        heads += stand.row(groups, lamps=2)
        bar = (len(groups) - 1) * SPACING
        supports.append(Support(foot, yaw, RAIL_BOTTOM + 0.75, bar=bar, rail=True))
    return heads, supports


def _crossing(
    edge: Edge, groups: Sequence[SignalGroup], ground: DrivenGround
) -> tuple[list[Head], list[Support]]:
    """Heads at both ends of a crossing, each looking over the road."""
    lane = edge.lanes[0]
    heads: list[Head] = []
    supports: list[Support] = []
    for shape in (lane.shape, lane.shape[::-1]):
        along, yaw = direction_at_end(shape)
        beside = -leftward(along) * (lane.width / 2 + 0.35)
        places = [
            shape[-1] + out * along + side * beside
            for side in (1.0, -1.0, 1.5, -1.5)
            for out in (0.4, 0.1, 0.9, 1.5, 2.2, 3.0)
        ]
        foot = freest(np.array(places), (), ground)
        stand = HeadStand(foot, foot + WALK_BOTTOM * UP, leftward(along), along, yaw)
        heads += stand.row(groups, lamps=2)
        bar = (len(groups) - 1) * SPACING
        supports.append(Support(foot, yaw, WALK_BOTTOM + 0.7, bar=bar))
    return heads, supports


def _feet(edge: Edge, along: Floats, outward: Floats, bar: float) -> Floats:
    """Places for a pole with a crossbar at an edge's end, best first, (n, 3) [m]."""
    outer, inner = edge.lanes[0], edge.lanes[-1]
    border = outer.shape[-1] + (outer.width / 2 + BESIDE + bar / 2) * outward
    near = [border + behind * along + _STEPS[:4, None] * outward for behind in _BEHIND]
    far = border + _LAST * along + _STEPS[:, None] * outward
    opposite = inner.shape[-1] + _LAST * along - (inner.width / 2 + BESIDE) * outward
    return np.vstack([*near, far, opposite])
