"""Markings across the road and on lanes: stop lines, crossings, arrows, words, bicycles.

Arrows are on lanes that lead different ways out of a junction, words on lanes that only buses may
use, and bicycles on bicycle lanes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from sumo3dviz_pt.library.mesh.bands import Band, band_along, on_lane, without_repeats
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.street.road_styles import (
    BusLanePaint,
    CrossingPaint,
    GiveWayLine,
    RoadStyle,
)
from sumo3dviz_pt.model.geometry import Floats, arc_length
from sumo3dviz_pt.model.network import Connection, Edge, Lane, Network
from sumo3dviz_pt.world.rails.ways import at_level_crossing, only_rails
from sumo3dviz_pt.world.roads.markings.lines import PAINTS, WHITE, Paint
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, in_region, is_driven, is_footway

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


_ARROWS_ENDS = (9.0, 34.0)
"""Distance of the arrows' tips from the lane's end [m]."""

_SHORTEST = 14.0
"""Length of free lane before an arrow's tip, at least [m]."""

_LENGTH, _SHAFT, _ARROWS_HEAD, _WING = 5.0, 0.16, 1.6, 0.42
"""Length, width of the shaft, length of the head and half its width [m]; towns."""

_TURN_ONLY = (
    ((0.0, 0.0), (2.3, 0.0), (2.8, 0.12), (3.1, 0.44)),
    ((2.70, 0.42), (3.50, 0.42), (3.30, 1.25)),
)
_TURN_TOO = (((1.0, 0.0), (1.7, 0.2), (2.0, 0.44)), ((1.60, 0.42), (2.40, 0.42), (2.25, 1.2)))
"""Shaft and head of arrows to the left: along the lane and to the left [m]."""

_SIDES = {"s": "s", "l": "l", "L": "l", "r": "r", "R": "r"}


def arrow_paint(network: Network, strips: Mapping[str, tuple[Strip, ...]]) -> list[Paint]:
    """Paint arrows before junctions where the lanes of an edge lead different ways."""
    ways = _directions(network)
    paint = []
    for edge, group in strips.items():
        lanes = [strip for strip in group if strip.look.lines and is_driven(strip)]
        shown = [ways.get(strip.lane.id, "") for strip in lanes]
        if len(lanes) < 2 or len(set(shown)) < 2:
            continue
        for strip, sides in zip(lanes, shown, strict=True):
            paint += [Paint(edge, WHITE, quads) for quads in _arrows(strip, sides) if len(quads)]
    return paint


def _directions(network: Network) -> dict[str, str]:
    """Where each lane leads: some of `l`, `r` and `s`, by lane id."""
    sides_of: dict[str, set[str]] = {}
    for connection in network.connections:
        side = _SIDES.get(connection.direction)
        if side is not None:
            sides_of.setdefault(connection.from_lane, set()).add(side)
    return {lane: "".join(sorted(sides)) for lane, sides in sides_of.items()}


def _arrows(strip: Strip, sides: str) -> list[Floats]:
    """Quads of all arrows on a strip."""
    middle = 0.5 * (strip.right + strip.left)
    stations = arc_length(middle[:, :2])
    if not sides or np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    tips = [stations[-1] - away for away in _ARROWS_ENDS if stations[-1] - away > _SHORTEST]
    flat = [quad for side in sides for quad in _arrow(side, alone=len(sides) == 1)]
    return [on_lane(np.array(flat) + np.array([tip - _LENGTH, 0.0]), middle) for tip in tips]


def _arrow(side: str, *, alone: bool) -> list[Floats]:
    """Quads of one arrow, each (4, 2) [m]: along the lane, to the left."""
    half = 0.5 * _SHAFT
    if side == "s":
        neck = _LENGTH - _ARROWS_HEAD
        shaft = [[0, -half], [neck, -half], [neck, half], [0, half]]
        head = [[neck, -_WING], [_LENGTH, 0], [_LENGTH, 0], [neck, _WING]]
        return [np.array(shaft, float), np.array(head, float)]
    bend, tip = _TURN_ONLY if alone else _TURN_TOO
    line = np.array([[along, aside, 0.0] for along, aside in bend])
    ribbon = band_along(line, right=-half, left=half).whole()[..., :2]
    quads = [*ribbon, np.array([*tip, tip[-1]])]
    return quads if side == "l" else [_mirrored(quad) for quad in quads]


def _mirrored(quad: Floats) -> Floats:
    """A quad on the other side of the lane's middle, still counter-clockwise."""
    return quad[[3, 2, 1, 0]] * [1.0, -1.0]


_WORDS_FIRST, _WORDS_ENDS = 8.0, 12.0
"""From a lane's begin to the first word, and free length before its end [m]."""

_APART = 1.2
"""Between words of one text, as a share of a letter's height."""

_SHARE = 0.62
"""Width of a word, as a share of the lane's."""


def is_bus_lane(lane: Lane) -> bool:
    """Return whether buses may use a lane and cars may not."""
    return bool(lane.allowed & {"bus", "coach"}) and not (
        "passenger" in lane.allowed or only_rails(lane)
    )


def word_paint(strips: Mapping[str, tuple[Strip, ...]], style: BusLanePaint) -> list[Paint]:
    """Write a text on all bus lanes, upright for their drivers."""
    return [
        Paint(edge, PAINTS[style.colour], on_lane(quads, _middle(strip)))
        for edge, group in strips.items()
        for strip in group
        if strip.look.lines and is_bus_lane(strip.lane)
        for quads in _texts(strip, style)
    ]


def _middle(strip: Strip) -> Floats:
    """The middle line of a strip, (n, 3) [m]."""
    return 0.5 * (strip.right + strip.left)


def _texts(strip: Strip, style: BusLanePaint) -> list[Floats]:
    """Quads of all words on a strip: along it and to the left, (n, 4, 2) [m] each."""
    stations = arc_length(_middle(strip)[:, :2])
    words = style.word.split()
    room = len(words) * style.height * (1.0 + _APART)
    if np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    starts = np.arange(_WORDS_FIRST, stations[-1] - _WORDS_ENDS - room, style.every)
    flat = [_word(word, style.height, _SHARE * strip.look.width) for word in words]
    each = style.height * (1.0 + _APART)
    return [
        quads + np.array([start + k * each, 0.0])
        for start in starts.tolist()
        for k, quads in enumerate(flat)
    ]


def _word(word: str, height: float, width: float) -> Floats:
    """Quads of a word that begins at the origin, (n, 4, 2) [m]; its letters are stretched."""
    flat = lettering(word, height=1.0, weight=0.17)
    low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
    share = (flat - low) / (high - low)
    along, left = height * share[..., 1], width * (0.5 - share[..., 0])
    triangles = np.stack([along, left], axis=-1)
    return np.concatenate([triangles, triangles[:, 2:]], axis=1)


_EACH, _CYCLES_FIRST, _CYCLES_ENDS = 48.0, 14.0, 8.0
"""Distance of symbols, of the last one from the lane's end, and what stays free [m]."""

_STROKE = 0.065
_REAR, _FRONT = (-0.30, 0.42), (0.30, 0.42)
_CRANK, _SEAT, _CYCLES_HEAD = (-0.05, 0.42), (-0.14, 1.08), (0.19, 1.12)
_STROKES = (
    (_REAR, _CRANK, _CYCLES_HEAD, (-0.11, 0.95), _CRANK),
    (_REAR, (-0.11, 0.95)),
    (_FRONT, _CYCLES_HEAD, (0.15, 1.32), (0.28, 1.36)),
    ((-0.11, 0.95), _SEAT),
    ((-0.26, 1.1), (-0.03, 1.1)),
)
"""A bicycle seen from its right, to the right and along the lane [m]; twice as long as wide."""

_WHEEL = (0.19, 0.36)
_NARROWEST = 1.15


def cycle_paint(strips: Mapping[str, tuple[Strip, ...]], surface: str) -> list[Paint]:
    """Paint a bicycle every 48 m on each bicycle lane of a surface, upright for cyclists on it."""
    return [
        Paint(edge, WHITE, quads)
        for edge, group in strips.items()
        for strip in group
        if strip.look.surface == surface and strip.look.lines and strip.look.width >= _NARROWEST
        for quads in _symbols(strip)
    ]


def _symbols(strip: Strip) -> list[Floats]:
    """Quads of all symbols on a strip."""
    middle = 0.5 * (strip.right + strip.left)
    stations = arc_length(middle[:, :2])
    if np.min(np.diff(stations), initial=1.0) < 1e-6:
        return []
    flat = _bicycle()
    at = np.arange(stations[-1] - _CYCLES_FIRST, _CYCLES_ENDS, -_EACH)
    return [on_lane(flat + np.array([start, 0.0]), middle) for start in at]


def _bicycle() -> Floats:
    """Quads of one symbol: along the lane and to the left, (n, 4, 2) [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 17)
    ring = np.column_stack([_WHEEL[0] * np.cos(turn), _WHEEL[1] * np.sin(turn)])
    lines = [np.array(stroke) for stroke in _STROKES]
    lines += [ring + middle for middle in (_REAR, _FRONT)]
    quads = []
    for line in lines:
        path = np.column_stack([line[:, 1], -line[:, 0], np.zeros(len(line))])
        band = band_along(path, right=-0.5 * _STROKE, left=0.5 * _STROKE)
        quads.append(band.whole()[..., :2])
    return np.concatenate(quads)
