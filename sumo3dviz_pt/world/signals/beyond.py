"""Heads beyond the junction, for drivers who cannot see those at their stop line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.network import Edge, Lane
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

_STRAIGHT = np.radians(25.0)  # a driver sees heads at most so far above or aside [rad]
_EYE_BACK, _EYE_UP = 3.2, 1.2  # a waiting driver's eye before the lane's end, and above it [m]
_FARTHEST = 60.0  # from a stop line to a head beyond the junction [m]


def far_side_heads(
    edge: Edge,
    lanes: Sequence[Lane],
    heads: Sequence[Head],
    groups: Sequence[SignalGroup],
    design: HeadDesign,
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
        design.far_side == "when_hidden" and (hidden or len(lanes) >= WIDE)
    )
    junction = design.network.junctions.get(edge.to_junction)
    if not wanted or not shown or junction is None or len(junction.outline) < 3:
        return [], []
    # Go straight across the junction, from the middle of the lanes, to its other side.
    along, yaw = direction_at_end(lanes[-1].shape)
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
    outward = leftward(along) if design.network.left_hand else -leftward(along)
    width = sum(lane.width for lane in edge.lanes) / 2
    bar = (len(shown) - 1) * SPACING
    aside = width + BESIDE + bar / 2 + np.arange(0.0, 7.0, 0.5)
    ahead = (reach + np.array([0.6, 1.5, 2.5, 4.0, 6.0]))[:, None, None] * along
    row = [offset * outward for offset in row_offsets(len(shown))]
    height = POLE_BOTTOM + 0.3 * design.lamps + 0.12
    made: list[Head] = []
    supports: list[Support] = []
    for side in (outward, -outward):
        if made and not any(_out_of_view(lane, [*heads, *made]) for lane in lanes):
            break
        places = start + (ahead + aside[:, None] * side).reshape(-1, 3)
        foot = freest(places, row, design.ground)
        stand = Stand(foot, foot + POLE_BOTTOM * UP, -outward, along, yaw)
        made += stand.row(shown, lamps=design.lamps)
        supports.append(Support(foot, yaw, height, bar=bar))
    return made, supports


def _out_of_view(lane: Lane, heads: Sequence[Head]) -> bool:
    """Whether a driver who waits on a lane sees no head well."""
    along, _ = direction_at_end(lane.shape)
    eye = lane.shape[-1] - _EYE_BACK * along + _EYE_UP * UP
    towards = np.array([head.position + 0.15 * head.lamps * UP for head in heads]) - eye
    ahead = towards @ along
    away = np.linalg.norm(towards, axis=1)
    return bool((ahead < np.cos(_STRAIGHT) * away).all())
