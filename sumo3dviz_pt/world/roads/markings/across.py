"""Markings across the road: stop lines, give-way lines, zebra crossings."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sumo3dviz_pt.library.mesh.bands import Band, band_along
from sumo3dviz_pt.library.mesh.polyline import without_repeats
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.roads.markings.lines import WHITE, Paint
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, in_region

STOP_WIDTH = 0.5
"""Length of a stop line along the lane [m]."""

SETBACK = 0.3
"""From a stop line to the lane's end [m]; SUMO's vehicles stop 1 m before the end."""

_GIVE_WAY_WIDTH = 0.35
_GIVE_WAY_DASH = 0.5
_GIVE_WAY_GAP = 0.25
_BAR = 0.5
"""Width of a zebra's bars, and of the gaps between them [m]."""

_FASTEST_GIVE_WAY = 20.0
"""Faster roads merge without a give-way line [m/s]."""

_NONE = np.zeros((0, 4, 3))


def stop_paint(network: Network, strips: Mapping[str, tuple[Strip, ...]]) -> list[Paint]:
    """Paint stop and give-way lines of all edges, just before the lanes' ends."""
    leaving: dict[str, list[Connection]] = {}
    for connection in network.connections:
        leaving.setdefault(connection.from_lane, []).append(connection)
    paint = []
    for key, group in strips.items():
        edge = network.edges[key]
        gives_way = _gives_way(network, edge, leaving)
        for strip in group:
            if not strip.look.lines:
                continue
            if _stops(leaving.get(strip.lane.id, [])):
                paint.append(Paint(key, WHITE, _across(strip, STOP_WIDTH)))
            elif gives_way:
                paint.append(Paint(key, WHITE, _dashed_across(strip)))
    return paint


def zebra_paint(network: Network, *, region: BoundsXY | None) -> list[Paint]:
    """Paint bars of all crossings that are signalled or have priority."""
    reached: dict[str, list[Connection]] = {}
    for connection in network.connections:
        reached.setdefault(connection.to_lane, []).append(connection)
    paint = []
    for edge in network.edges.values():
        if edge.function != "crossing" or not in_region(edge.lanes[0].shape, region):
            continue
        ways_in = reached.get(edge.lanes[0].id, [])
        if any(c.tls or c.state == "M" for c in ways_in):
            paint.append(Paint(edge.id, WHITE, _bars(edge.lanes[0].shape, edge.lanes[0].width)))
    return paint


def _stops(connections: list[Connection]) -> bool:
    """Whether vehicles of a lane stop at its end: at a light or a stop sign."""
    return any(c.tls or c.state in {"s", "w"} for c in connections)


def _gives_way(network: Network, edge: Edge, leaving: Mapping[str, list[Connection]]) -> bool:
    """Whether a whole edge is minor, so that it ends in a give-way line.

    One minor connection does not make it so: turning left is minor on main roads too.
    """
    junction = network.junctions.get(edge.to_junction)
    if junction is None or not junction.type.startswith("priority"):
        return False
    if max(lane.speed for lane in edge.lanes) > _FASTEST_GIVE_WAY:
        return False
    ways = [c for lane in edge.lanes for c in leaving.get(lane.id, []) if c.direction != "t"]
    ways = [c for c in ways if network.edges[network.lanes[c.to_lane].edge_id].function == "normal"]
    # Ramps only go straight on: they merge without stopping.
    turns = any(c.direction != "s" for c in ways)
    return turns and all(c.state == "m" for c in ways)


def _ends_band(strip: Strip) -> Band:
    """A strip as a band from border to border."""
    middle = 0.5 * (strip.right + strip.left)
    return Band(strip.right, strip.left, arc_length(middle[:, :2]) + np.arange(len(middle)) * 1e-9)


def _across(strip: Strip, length: float) -> Floats:
    """The last part of a strip, from border to border."""
    band = _ends_band(strip)
    end = band.stations[-1]
    if end < 2.0 * length + SETBACK:
        return _NONE
    return band.quads(end - SETBACK - length, end - SETBACK)


def _dashed_across(strip: Strip) -> Floats:
    """Short blocks across the end of a strip."""
    whole = _across(strip, _GIVE_WAY_WIDTH)
    if len(whole) != 1:
        return _NONE
    right, left = whole[0, :2], whole[0, [3, 2]]
    width = float(np.linalg.norm(left[0, :2] - right[0, :2]))
    count = int((width - _GIVE_WAY_GAP) / (_GIVE_WAY_DASH + _GIVE_WAY_GAP))
    used = count * (_GIVE_WAY_DASH + _GIVE_WAY_GAP) - _GIVE_WAY_GAP
    starts = 0.5 * (width - used) + np.arange(count) * (_GIVE_WAY_DASH + _GIVE_WAY_GAP)
    near, far = starts / width, (starts + _GIVE_WAY_DASH) / width
    corners = [right + share[:, None, None] * (left - right)[None] for share in (near, far)]
    return np.stack(
        [corners[0][:, 0], corners[0][:, 1], corners[1][:, 1], corners[1][:, 0]], axis=1
    )


def _bars(shape: Floats, width: float) -> Floats:
    """Bars along the traffic, side by side along a crossing's middle line."""
    line = without_repeats(shape)
    length = float(arc_length(line[:, :2])[-1])
    count = int((length - 0.5 * _BAR) / (2.0 * _BAR))
    if count < 1:
        return _NONE
    start = 0.5 * (length - (2 * count - 1) * _BAR)
    band = band_along(line, right=-0.5 * width, left=0.5 * width)
    pieces = [band.quads(start + 2 * k * _BAR, start + (2 * k + 1) * _BAR) for k in range(count)]
    return np.concatenate([_NONE, *pieces])
