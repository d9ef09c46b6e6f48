"""Heads beyond the junction, for drivers who cannot see those at their stop line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane
from sumo3dviz_pt.world.signals.heads import (
    BESIDE,
    POLE_BOTTOM,
    SPACING,
    UP,
    WIDE,
    Head,
    HeadDesign,
    SignalGroup,
    Stand,
    Support,
    direction_at_end,
    freest,
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
        stand = Stand(foot, foot + POLE_BOTTOM * UP, -outward, along, yaw)
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
