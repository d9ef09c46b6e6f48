"""Markings across the road: stop lines, give-way lines, zebra crossings."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sumo3dviz_pt.library.mesh.bands import Band, band_along
from sumo3dviz_pt.library.mesh.polyline import without_repeats
from sumo3dviz_pt.library.street.road_styles import CrossingPaint, GiveWayLine, RoadStyle
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.rails.guards import at_level_crossing, only_rails
from sumo3dviz_pt.world.roads.markings.lines import WHITE, Paint
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, in_region
from sumo3dviz_pt.world.roads.style import is_footway

SETBACK = 0.3
"""From a stop line to the lane's end [m]; SUMO's vehicles stop 1 m before the end."""

_CROSS_LINE = 0.3
"""Width of lines along both sides of a crossing [m]."""

_STUD, _STUD_EACH = 0.12, 0.5
"""Size of the studs of a crossing, and their distance [m]."""

_FASTEST_GIVE_WAY = 20.0
"""Faster roads merge without a give-way line [m/s]."""

_NONE = np.zeros((0, 4, 3))


def stop_paint(
    network: Network, strips: Mapping[str, tuple[Strip, ...]], style: RoadStyle
) -> list[Paint]:
    """Paint stop and give-way lines of all edges, just before the lanes' ends.

    Args:
        network: Says where traffic stops or gives way.
        strips: Lanes of edges from right to left, by edge id.
        style: Shapes and sizes of both.
    """
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
                paint.append(Paint(key, WHITE, _across(strip, style.stop_line)))
            elif gives_way:
                paint.append(Paint(key, WHITE, _yield_line(strip, style.give_way)))
    return paint


def zebra_paint(network: Network, style: CrossingPaint, *, region: BoundsXY | None) -> list[Paint]:
    """Paint all crossings that are signalled or have priority, but none over tracks alone.

    Args:
        network: The network.
        style: How either kind is painted.
        region: Only crossings that touch this box [m]; None is everywhere.
    """
    reached: dict[str, list[Connection]] = {}
    for connection in network.connections:
        reached.setdefault(connection.to_lane, []).append(connection)
    paint = []
    for edge in network.edges.values():
        if edge.function != "crossing" or not in_region(edge.lanes[0].shape, region):
            continue
        ways_in, shape = reached.get(edge.lanes[0].id, []), edge.lanes[0].shape
        signalled = any(c.tls for c in ways_in)
        over_rails = at_level_crossing(network, edge.id) or _over_tracks(network, edge)
        if over_rails or not (signalled or any(c.state == "M" for c in ways_in)):
            continue
        kind = style.signalled if signalled else style.unsignalled
        quads = _CROSSINGS[kind](shape, edge.lanes[0].width, style.bar)
        paint.append(Paint(edge.id, WHITE, quads))
    return paint


def _over_tracks(network: Network, crossing: Edge) -> bool:
    """Whether a crossing leads over nothing but tracks."""
    roads = [network.edges[key] for key in crossing.crossed_edges if key in network.edges]
    lanes = [lane for road in roads for lane in road.lanes if not is_footway(lane)]
    return bool(lanes) and all(only_rails(lane) for lane in lanes)


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


def _across(strip: Strip, length: float, *, back: float = 0.0) -> Floats:
    """The last part of a strip, from border to border, or a part `back` before it [m]."""
    band = _ends_band(strip)
    end = band.stations[-1] - back
    if end < 2.0 * length + SETBACK:
        return _NONE
    return band.quads(end - SETBACK - length, end - SETBACK)


def _yield_line(strip: Strip, style: GiveWayLine) -> Floats:
    """What lies across the end of a strip that gives way, (n, 4, 3) [m]."""
    if style.shape != "two_lines":
        return _pieces_across(strip, style, 0.0)
    rows = [_pieces_across(strip, style, back) for back in (0.0, 2.0 * style.depth)]
    return np.concatenate(rows)


def _pieces_across(strip: Strip, style: GiveWayLine, back: float) -> Floats:
    """One row of pieces across a strip, `back` before the usual place [m]."""
    whole = _across(strip, style.depth, back=back)
    if len(whole) != 1:
        return _NONE
    # Spread as many pieces as fit, evenly.
    right, left = whole[0, :2], whole[0, [3, 2]]
    width = float(np.linalg.norm(left[0, :2] - right[0, :2]))
    each = style.width + style.gap
    count = int((width - style.gap) / each)
    starts = 0.5 * (width - (count * each - style.gap)) + np.arange(count) * each
    # Triangles point at the driver: their near side has no width.
    tip = 0.5 * style.width if style.shape == "triangles" else 0.0
    spans = [(starts + tip, starts + style.width - tip), (starts, starts + style.width)]
    corners = [
        right[k] + (at / width)[:, None] * (left[k] - right[k])
        for k, at in ((0, spans[0][0]), (1, spans[1][0]), (1, spans[1][1]), (0, spans[0][1]))
    ]
    return np.stack(corners, axis=1)


def _bars(shape: Floats, width: float, bar: float) -> Floats:
    """Bars along the traffic, side by side along a crossing's middle line."""
    line = without_repeats(shape)
    length = float(arc_length(line[:, :2])[-1])
    count = int((length - 0.5 * bar) / (2.0 * bar))
    if count < 1:
        return _NONE
    start = 0.5 * (length - (2 * count - 1) * bar)
    band = band_along(line, right=-0.5 * width, left=0.5 * width)
    pieces = [band.quads(start + 2 * k * bar, start + (2 * k + 1) * bar) for k in range(count)]
    return np.concatenate([_NONE, *pieces])


def _cross_lines(shape: Floats, width: float, bar: float) -> Floats:
    """A line along either side of a crossing; `bar` has no effect."""
    del bar
    line, half = without_repeats(shape), 0.5 * width
    sides = [(-half, -half + _CROSS_LINE), (half - _CROSS_LINE, half)]
    return np.concatenate([band_along(line, right=r, left=g).whole() for r, g in sides])


def _studs(shape: Floats, width: float, bar: float) -> Floats:
    """Studs along either side of a crossing; `bar` has no effect."""
    del bar
    line, half = without_repeats(shape), 0.5 * width
    return np.concatenate(
        [
            band_along(line, right=side - _STUD / 2, left=side + _STUD / 2).dashes(
                dash=_STUD, gap=_STUD_EACH - _STUD
            )
            for side in (-half, half)
        ]
    )


_CROSSINGS: Mapping[str, Callable[[Floats, float, float], Floats]] = {
    "bars": _bars,
    "lines": _cross_lines,
    "studs": _studs,
}
"""What crossings of a middle line and a width [m] look like, with bars of a width [m]."""
