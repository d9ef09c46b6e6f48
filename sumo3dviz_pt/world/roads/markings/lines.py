"""Lines along carriageways and through junctions.

Along carriageways there are edge lines, dividers and centre lines. Lines go through a junction
where a road only goes on, widens, merges or splits.

References:
    Widths and dashes follow common European practice (6 m dash and 12 m gap on
    motorways, 3 m and 3 m in towns; docs/facts/look.md, "Roads").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.mesh.bands import Band, band_along
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.library.street.road_styles import CentreLine, LineColour, RoadStyle
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.world.roads.areas import JunctionInside, opposite_edges
from sumo3dviz_pt.world.roads.strips import Strip, is_quiet, lane_line, style_of

WHITE = "line_white"
YELLOW = "line_yellow"

MOTORWAY_SPEED = 25.0
"""From this limit on, lines are those of a motorway [m/s]."""

_INSET = 0.12
"""Distance of an edge line from the carriageway's edge [m]."""

_SHARED = 0.5
"""Neighbouring lanes that cover more than this together come from or go to one lane [m2]."""

_PARTED = 0.25
"""Lanes have parted where the border of one lies at most this far in the other [m]."""

_DOUBLE = 1.2
"""How far the middles of both lines of a double line lie from its own, in widths of a line."""

_ADJACENT = 1.2
"""Directions closer than this share a centre line [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Paint:
    """Quads of one material that belong to an edge.

    Attributes:
        owner: Edge id.
        material: Such as `line_white`.
        quads: Corners counter-clockwise, (n, 4, 3) [m].
    """

    owner: str
    material: str
    quads: Floats


PAINTS: Mapping[LineColour, str] = {"white": WHITE, "yellow": YELLOW}
"""Materials of paint by the colours of a style."""


class SideColours(NamedTuple):
    """Materials of the lines along the borders of an edge.

    Attributes:
        right: Along its right border.
        left: Along its left border.
    """

    right: str
    left: str

    @classmethod
    def of(cls, style: RoadStyle, *, left_hand: bool) -> SideColours:
        """Return the colours of a style; inner borders lie on the side of oncoming traffic."""
        outer, inner = PAINTS[style.edge.outer], PAINTS[style.edge.inner]
        return cls(inner, outer) if left_hand else cls(outer, inner)


@dataclass(frozen=True, slots=True)
class LineStyle:
    """Measures of an edge's lines.

    Attributes:
        width: [m].
        dash: [m].
        gap: [m].
    """

    width: float
    dash: float
    gap: float


def line_style(edge: Edge, settings: RoadSettings) -> LineStyle:
    """Return measures that suit an edge's speed limit."""
    if edge.told_speed >= MOTORWAY_SPEED:
        return LineStyle(max(settings.line_width, 0.15), 6.0, 12.0)
    return LineStyle(settings.line_width, 3.0, 3.0)


def edge_paint(
    edge: Edge,
    strips: tuple[Strip, ...],
    settings: RoadSettings,
    *,
    sides: SideColours,
    open_side: str = "",
) -> list[Paint]:
    """Paint the dividers and edge lines of one edge.

    Args:
        edge: The edge.
        strips: Its strips from right to left.
        settings: Line width.
        sides: Materials of the lines along its right and its left border.
        open_side: `right`, `left`, `both` or empty: outer borders that get no line.
    """
    if is_quiet(edge):
        return []
    style = line_style(edge, settings)
    reference = lane_line(strips[len(strips) // 2].lane)
    quads: dict[str, list[Floats]] = {WHITE: [np.zeros((0, 4, 3))]}
    for before, after in zip((None, *strips), (*strips, None), strict=True):
        if before is not None and after is not None and _touch(before, after):
            quads[WHITE].append(_divider(before, after, style=style, reference=reference))
            continue
        if before is not None and after is not None and _overlap(before, after):
            quads[WHITE].append(_parting(before, after, style=style, reference=reference))
            continue
        if after is not None and open_side not in {"right", "both"}:
            colour = sides.right if before is None else WHITE
            quads.setdefault(colour, []).append(_outer(after, style=style, right=True))
        if before is not None and open_side not in {"left", "both"}:
            colour = sides.left if after is None else WHITE
            quads.setdefault(colour, []).append(_outer(before, style=style, right=False))
    return [Paint(edge.id, colour, np.concatenate(some)) for colour, some in quads.items()]


def centre_paint(
    network: Network,
    settings: RoadSettings,
    strips: Mapping[str, tuple[Strip, ...]],
    *,
    centre: CentreLine,
) -> tuple[list[Paint], frozenset[str]]:
    """Paint one shared line between the two directions of each road.

    Args:
        network: The network.
        settings: Line width.
        strips: Lanes of edges from right to left, by edge id.
        centre: Colour of the line, and where it is solid.

    Returns:
        The lines, and the edges whose inner border gets no other line.
    """
    paint, shared = [], set()
    for one, other in opposite_edges(network, strips):
        inner = [strips[key][0 if network.left_hand else -1] for key in (one, other)]
        if not all(strip.look.lines for strip in inner):
            continue
        middle = _middle(inner[0], inner[1], left_hand=network.left_hand)
        if middle is None:
            continue
        shared |= {one, other}
        edge = network.edges[one]
        count = sum(_is_driven(s) for key in (one, other) for s in strips[key])
        quads = _centre_quads(middle, line_style(edge, settings), lanes=count, centre=centre)
        if not is_quiet(edge):
            paint.append(Paint(one, PAINTS[centre.colour], quads))
    return paint, frozenset(shared)


def _touch(before: Strip, after: Strip) -> bool:
    """Whether two strips share their border."""
    return before.left.shape == after.right.shape and bool(np.array_equal(before.left, after.right))


def _overlap(before: Strip, after: Strip) -> bool:
    """Whether two strips cover the same place, as where a turn lane begins."""
    return bool(before.polygon.intersection(after.polygon).area > _SHARED)


def _parting(before: Strip, after: Strip, *, style: LineStyle, reference: Floats) -> Floats:
    """The line between two lanes from where they have parted, or up to where they join."""
    if not (before.look.lines and after.look.lines):
        return np.zeros((0, 4, 3))
    half = 0.5 * style.width
    band = band_along(after.right, right=-half, left=half, reference=reference)
    dashes = band.dashes(dash=style.dash, gap=style.gap)
    inside = before.polygon.buffer(-_PARTED)
    shapely.prepare(inside)
    return np.asarray(dashes[~shapely.intersects_xy(inside, dashes.mean(axis=1)[:, :2])])


def _is_driven(strip: Strip) -> bool:
    """Whether cars drive on a strip."""
    return strip.look.lines and "passenger" in strip.lane.allowed


def _divider(before: Strip, after: Strip, *, style: LineStyle, reference: Floats) -> Floats:
    """The line between two lanes of one direction."""
    if not (before.look.lines and after.look.lines):
        strip = before if before.look.lines else after
        beside = after if before.look.lines else before
        # A kerb shows the border better than paint.
        if not strip.look.lines or beside.look.raised:
            return np.zeros((0, 4, 3))
        return _outer(strip, style=style, right=strip is after)
    half = 0.5 * style.width
    band = band_along(after.right, right=-half, left=half, reference=reference)
    kept = _keeps_to(before, after), _keeps_to(after, before)
    if before.look.surface != after.look.surface or all(kept):
        return band.whole()
    if not any(kept):
        return band.dashes(dash=style.dash, gap=style.gap)
    # Whoever has the solid line on his side keeps his lane.
    pair = []
    for side, solid in zip((-_DOUBLE * style.width, _DOUBLE * style.width), kept, strict=True):
        line = band_along(after.right, right=side - half, left=side + half, reference=reference)
        pair.append(line.whole() if solid else line.dashes(dash=style.dash, gap=style.gap))
    return np.concatenate(pair)


def _keeps_to(strip: Strip, other: Strip) -> bool:
    """Whether nobody may change from a lane to one beside it."""
    lane = strip.lane
    return lane.keeps(lane.up if other.lane.index > lane.index else lane.down)


def _outer(strip: Strip, *, style: LineStyle, right: bool) -> Floats:
    """The solid line along an outer border."""
    if not strip.look.lines:
        return np.zeros((0, 4, 3))
    if right:
        return band_along(strip.right, right=_INSET, left=_INSET + style.width).whole()
    return band_along(strip.left, right=-_INSET - style.width, left=-_INSET).whole()


def _middle(one: Strip, other: Strip, *, left_hand: bool) -> Floats | None:
    """The line half-way between two opposite inner borders, if they are close."""
    here, there = (s.right if left_hand else s.left for s in (one, other))
    line = shapely.LineString(there[:, :2])
    points = shapely.points(here[:, :2])
    ends = shapely.distance(points, line)
    if float(np.median(ends)) > _ADJACENT:
        return None
    nearest = shapely.get_coordinates(
        shapely.line_interpolate_point(line, shapely.line_locate_point(line, points))
    )
    middle = here.copy()
    close = ends < _ADJACENT
    middle[close, :2] = 0.5 * (here[close, :2] + nearest[close])
    return middle


def _centre_quads(middle: Floats, style: LineStyle, *, lanes: int, centre: CentreLine) -> Floats:
    """Dashed between single lanes, a double solid line on wider roads."""
    half = 0.5 * style.width
    bands: list[Band] = [
        band_along(middle, right=side - half, left=side + half)
        for side in (-_DOUBLE * style.width, _DOUBLE * style.width)
    ]
    if lanes <= 2 and centre.solid == "wide_roads":
        single = band_along(middle, right=-half, left=half)
        return single.dashes(dash=style.dash, gap=style.gap)
    return np.concatenate([band.whole() for band in bands])


_CLEAR = 0.8
"""Outer borders with another way this near get no line [m]."""


def through_paint(
    network: Network,
    settings: RoadSettings,
    insides: Mapping[str, JunctionInside],
    *,
    sides: SideColours,
) -> list[Paint]:
    """Paint dividers and edge lines inside junctions without crossing traffic.

    Args:
        network: The network.
        settings: Line width.
        insides: Contents of junctions, by junction id.
        sides: Materials of the lines along right and left borders.
    """
    inner = _inner_connections(network)
    paint = []
    for key, inside in insides.items():
        if not _is_through(network, key, inner.get(key, [])):
            continue
        ways: dict[str, list[Strip]] = {}
        for strip in inside.ways:
            ways.setdefault(strip.lane.edge_id, []).append(strip)
        sources = {c.via.rpartition("_")[0]: c.from_lane for c in inner[key] if c.direction != "t"}
        for edge_id, source in sources.items():
            outer_edge = network.lanes[source].edge_id
            if edge_id not in ways or not style_of(outer_edge, settings).markings:
                continue
            others = [s for other, group in ways.items() if other != edge_id for s in group]
            strips = tuple(ways[edge_id])
            side = _open_side(strips, others)
            edge = _with_speed(network.edges[edge_id], network.edges[outer_edge])
            paint += edge_paint(edge, strips, settings, sides=sides, open_side=side)
    return paint


def _inner_connections(network: Network) -> dict[str, list[Connection]]:
    """Connections between normal edges that run over internal lanes, by junction."""
    by_junction: dict[str, list[Connection]] = {}
    for connection in network.connections:
        lane = network.lanes.get(connection.from_lane)
        if lane is None or connection.via not in network.lanes:
            continue
        edge = network.edges[lane.edge_id]
        if edge.function == "normal":
            by_junction.setdefault(edge.to_junction, []).append(connection)
    return by_junction


def _is_through(network: Network, key: str, connections: list[Connection]) -> bool:
    """Whether no vehicle's way crosses another one's in a junction."""
    if not connections or network.junctions[key].type.startswith("traffic_light"):
        return False
    targets: dict[str, set[str]] = {}
    sources: dict[str, set[str]] = {}
    for connection in connections:
        if connection.direction == "t":
            continue
        one = network.lanes[connection.from_lane].edge_id
        other = network.lanes[connection.to_lane].edge_id
        targets.setdefault(one, set()).add(other)
        sources.setdefault(other, set()).add(one)
    single_way = len(targets) == 1 or len(sources) == 1
    one_each = all(len(v) == 1 for v in [*targets.values(), *sources.values()])
    return bool(targets) and (single_way or (one_each and len(targets) <= 2))


def _open_side(strips: tuple[Strip, ...], others: list[Strip]) -> str:
    """Which outer borders run beside or into another way."""
    area = union([strip.polygon for strip in others])
    sides = [
        name
        for name, line in (("right", strips[0].right), ("left", strips[-1].left))
        if shapely.LineString(line[:, :2]).distance(area) < _CLEAR and not area.is_empty
    ]
    return "both" if len(sides) == 2 else "".join(sides)


def _with_speed(inner: Edge, outer: Edge) -> Edge:
    """An internal edge that is painted like the edge that leads into it."""
    return Edge(inner.id, inner.function, "", "", outer.lanes)
