"""What traffic does to lanes and junctions: polished wheel tracks, oil.

Wheels run along the ways of motor vehicles; how far places lie from these tells their wear, also
where ways cross a junction.

References:
    Places and strengths: docs/facts/look.md, "Roads", matched by eye to dash-cam pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.roads.cells import Polygons, quad_polygons
from sumo3dviz_pt.world.roads.graded import NOTHING, Graded, clipped, graded_on, joined, whole_quads
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, distance_to, is_driven
from sumo3dviz_pt.world.roads.wear.stains import patchy

TRACK_PLACE, TRACK_WIDTH, TRACK_LOSS = 0.85, 0.30, 0.17
"""Wheel tracks: distance from the lane's middle [m], Gaussian width [m], lost brightness."""

OIL_WIDTH, OIL_LOSS = 0.27, 0.34
"""Drips along the lane's middle: Gaussian width [m], lost brightness."""

_FINE = (0.0, 0.16, 0.34, 0.55, 0.85, 1.15, 1.5)
"""Distances from the middle [m] at which vertices stand, near the camera."""

_COARSE = (0.0, 0.38, 0.85, 1.5)
"""The same farther away."""

_FAR = 300.0
"""From this distance to the camera's path on, fewer vertices do [m]."""

_FARTHEST = 1200.0
"""Lanes farther from the camera's path [m] show no wear."""

_QUEUE, _WAITED = (40.0, 30.0, 22.0, 16.0, 11.0, 7.0, 4.0), 0.7
"""Where wear changes before stop lines [m], and how much more of it there is at the line."""

_DUST = ((0.01, 0.16, 0.34, 0.52), (0.62, 0.72, 0.9, 1.0))
"""Distance from the road's own border [m], and brightness that dirt leaves there."""

_MOST = 1.6  # strength of wear at the most

_EDGE = 0.06
"""Distance from the lane's border at which wear has ended [m]."""

_NARROWEST = 1.0
"""Lanes less than this from middle to border are left alone [m]."""


def wear_across(distance: Floats, *, strength: float | Floats = 1.0) -> Floats:
    """Return the factor of brightness at a distance from a lane's middle [m], any shape."""
    track = np.exp(-0.5 * ((np.abs(distance) - TRACK_PLACE) / TRACK_WIDTH) ** 2)
    oil = np.exp(-0.5 * (distance / OIL_WIDTH) ** 2)
    return np.asarray((1.0 - strength * TRACK_LOSS * track) * (1.0 - strength * OIL_LOSS * oil))


def lane_wear(
    layout: RoadLayout,
    *,
    surfaces: frozenset[str],
    focus: BoundsXY | None,
    stops: frozenset[str] = frozenset(),
) -> dict[str, Graded]:
    """Build the wear of all driven lanes, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; None takes every lane as near.
        stops: Lanes that vehicles wait on.
    """
    chosen: dict[str, list[Graded]] = {}
    first = 0
    # Cells of carriageways come first, in the order of their strips.
    for key, group in layout.strips.items():
        for strip in (s for s in group if not s.look.raised):
            cells = layout.cells.polygons[first : first + len(strip.quads)]
            first += len(strip.quads)
            if strip.look.surface in surfaces and is_driven(strip):
                strength = _strength(key, strip)
                wear = np.full((len(cells), 2), strength)
                rows = _LaneRows(strip.quads, cells, wear, strip is group[0])
                if strip.lane.id in stops:
                    rows = _queued(rows)
                worn = _worn(rows, focus=focus)
                chosen.setdefault(strip.look.surface, []).append(worn)
    return {surface: joined(pieces) for surface, pieces in chosen.items()}


def _strength(edge: str, strip: Strip) -> float:
    """How worn a lane is: it varies, and slow lanes bear the lorries."""
    return 0.75 + 0.55 * share_of(0, "wear", edge, strip.lane.id)


@dataclass(frozen=True, slots=True, eq=False)
class _LaneRows:
    """Pieces of a lane.

    Attributes:
        quads: Their corners, (n, 4, 3) [m].
        cells: What is left of each from above, (n,).
        strength: Wear at both ends, (n, 2).
        dusty: Whether the right border is the road's.
    """

    quads: Floats
    cells: Polygons
    strength: Floats
    dusty: bool

    def __getitem__(self, chosen: Bools) -> _LaneRows:
        """Some of them."""
        rows = (self.quads[chosen], self.cells[chosen], self.strength[chosen])
        return _LaneRows(*rows, self.dusty)


def _queued(rows: _LaneRows) -> _LaneRows:
    """Rows cut near the lane's end, where engines drip and tyres brake."""
    sides = rows.quads[:, [1, 2]] - rows.quads[:, [0, 3]]
    lengths = np.linalg.norm(sides[..., :2], axis=-1).mean(axis=1)
    togo = np.append(np.cumsum(lengths[::-1])[::-1], 0.0)
    whole = whole_quads(rows.quads, rows.cells)
    quads, cells, strength = [], [], []
    for k, quad in enumerate(rows.quads):
        cuts = [mark for mark in _QUEUE if togo[k + 1] + 0.05 < mark < togo[k] - 0.05]
        marks = np.array([togo[k], *(cuts if whole[k] else ()), togo[k + 1]])
        at = (togo[k] - marks) / max(lengths[k], 1e-6)
        right = quad[0] + at[:, None] * (quad[1] - quad[0])
        left = quad[3] + at[:, None] * (quad[2] - quad[3])
        pieces = np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)
        quads.append(pieces)
        cells.append(quad_polygons(pieces) if len(pieces) > 1 else rows.cells[k : k + 1])
        more = rows.strength[k, 0] * (1.0 + _WAITED * np.exp(-np.maximum(marks - 4.0, 0.0) / 14.0))
        more = np.minimum(more, _MOST)
        strength.append(np.stack([more[:-1], more[1:]], axis=1))
    return _LaneRows(
        np.concatenate(quads), np.concatenate(cells), np.concatenate(strength), rows.dusty
    )


def _worn(rows: _LaneRows, *, focus: BoundsXY | None) -> Graded:
    """One strip's wear: fine columns near, coarse ones farther away, none beyond."""
    away = distance_to(focus, rows.quads.mean(axis=1))
    pieces = []
    for stations, chosen in (
        (_FINE, away < _FAR),
        (_COARSE, (away >= _FAR) & (away < _FARTHEST)),
    ):
        if chosen.any():
            pieces.append(_columned(rows[chosen], stations))
    return joined(pieces)


def _columned(rows: _LaneRows, stations: tuple[float, ...]) -> Graded:
    """Quads with columns at distances from their middle."""
    # Leave out what is too narrow.
    quads = rows.quads
    width = np.linalg.norm((quads[:, [3, 2]] - quads[:, [0, 1]])[..., :2], axis=-1).min(axis=1)
    half = np.minimum(0.5 * width - (_DUST[0][-1] if rows.dusty else _EDGE), stations[-1])
    keep = half > _NARROWEST
    if not keep.any():
        return NOTHING
    rows, width, half = rows[keep], width[keep], half[keep]
    # Wear on both sides of the middle.
    out = np.array(stations)[None] * (half / stations[-1])[:, None]
    place = np.concatenate([-out[:, :0:-1], out], axis=1)
    wear = np.zeros((len(place), 2, place.shape[1], 3))
    wear[..., 0] = wear_across(place[:, None], strength=rows.strength[..., None])
    wear[:, :, [0, -1], 0] = 1.0
    # Dust along the road's own border.
    if rows.dusty:
        away, factor = (np.array(values) for values in _DUST)
        place = np.concatenate([away[:-1] - 0.5 * width[:, None], place], axis=1)
        dust = np.zeros((len(place), 2, len(away) - 1, 3))
        dust[..., 0] = factor[:-1]
        wear = np.concatenate([dust, wear], axis=2)
    shares = 0.5 + place / width[:, None]
    return graded_on(rows.quads, shares, wear, polygons=rows.cells)


_REACH = 1.7
"""Wheels pass within this distance of a way's middle [m]."""


def way_lines(layout: RoadLayout) -> shapely.STRtree:
    """Return the middles of all ways of motor vehicles, through junctions too."""
    return layout.memory.of(("ways",), lambda: shapely.STRtree(_middles(layout)))


def _middles(layout: RoadLayout) -> list[shapely.LineString]:
    """Middles of driven lanes, as lines."""
    strips = [strip for group in layout.strips.values() for strip in group]
    strips += [strip for inside in layout.insides.values() for strip in inside.ways]
    return [
        shapely.LineString(strip.lane.shape[:, :2])
        for strip in strips
        if is_driven(strip) and not strip.look.raised and len(strip.lane.shape) > 1
    ]


def wheels_at(points: Floats, ways: shapely.STRtree) -> Floats:
    """Return how much wheels polish places: 1 in the middle of a track, 0 off all tracks.

    Args:
        points: (..., 2 or more) [m].
        ways: What `way_lines` gave.

    Returns:
        (...) in [0, 1].
    """
    flat = points[..., :2].reshape(-1, 2)
    most = np.zeros(len(flat))
    if len(ways.geometries) and len(flat):
        spots = np.asarray(shapely.points(flat))
        spot, way = ways.query(spots, predicate="dwithin", distance=_REACH)
        away = shapely.distance(spots[spot], ways.geometries[way])
        np.maximum.at(most, spot, np.exp(-0.5 * ((away - TRACK_PLACE) / TRACK_WIDTH) ** 2))
    return np.asarray(most.reshape(points.shape[:-1]))


_STEP = 0.34
"""Distance of vertices [m]."""

_JUNCTIONS_FARTHEST = 140.0
"""Junctions farther from the camera's path [m] show none."""

_LARGEST = 5_000.0
"""Junctions of more than this [m2] show none."""

_DARKEST = 0.52
"""Where many ways cross, wear ends at this factor."""

_NOTICED = 0.985
"""Places brighter than this are left out."""

_WIDEST = 4.0
"""Farther from its middle [m] than this, a way's wear is less than a float's last bit."""

_SAME_START = 0.6
"""Ways that begin closer than this [m] leave the same lane."""


def junction_wear(
    layout: RoadLayout, *, surfaces: frozenset[str], focus: BoundsXY | None
) -> dict[str, Graded]:
    """Build the wear of junctions near the camera's path, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; without one no junction is near.
    """
    junctions = near_junctions(layout, surfaces=surfaces, focus=focus)
    return built_inside(layout, "tracks", junctions, partial(_worn_inside, layout))


@dataclass(frozen=True, slots=True, eq=False)
class DrivenJunction:
    """The surface of a junction that vehicles drive across.

    Attributes:
        cell: Its number among the layout's cells.
        surface: Its surface key.
        polygon: Its outline from above [m].
        ways: What vehicles drive along; at least one.
    """

    cell: int
    surface: str
    polygon: shapely.Geometry
    ways: Sequence[Strip]


def built_inside(
    layout: RoadLayout,
    name: str,
    junctions: Iterable[DrivenJunction],
    build: Callable[[DrivenJunction], Graded],
) -> dict[str, Graded]:
    """Build a piece for each junction, and join those on one surface, by surface key.

    Args:
        layout: The roads; its memory keeps the pieces for other shots.
        name: What the pieces are called in that memory.
        junctions: Where there is a piece.
        build: Makes it of the junction's cell and ways.
    """
    chosen: dict[str, list[Graded]] = {}
    keep = layout.memory.by_content
    for junction in junctions:
        knots = layout.cells.knots[junction.cell]
        ways = (way.lane.id for way in junction.ways)
        made_of = digest_of(junction.polygon, knots, *ways)
        owner = layout.cells.owners[junction.cell]
        piece = keep.of((name, owner, made_of), partial(build, junction))
        chosen.setdefault(junction.surface, []).append(piece)
    return {surface: joined(pieces) for surface, pieces in chosen.items()}


def near_junctions(
    layout: RoadLayout, *, surfaces: frozenset[str], focus: BoundsXY | None
) -> Iterator[DrivenJunction]:
    """Yield the junctions near the camera's path that show use.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; without one no junction is near.
    """
    cells = layout.cells
    for index in map(int, np.flatnonzero(np.isnan(cells.quads[:, 0, 0]))):
        inside = layout.insides.get(cells.owners[index])
        surface, polygon = cells.surfaces[index], cells.polygons[index]
        if focus is None or inside is None or surface not in surfaces or polygon.is_empty:
            continue
        ways = [strip for strip in inside.ways if is_driven(strip)]
        middle = shapely.get_coordinates(polygon.centroid)
        if (
            ways
            and polygon.area <= _LARGEST
            and distance_to(focus, middle)[0] <= _JUNCTIONS_FARTHEST
        ):
            yield DrivenJunction(index, surface, polygon, ways)


def _worn_inside(layout: RoadLayout, junction: DrivenJunction) -> Graded:
    """Wear of one junction, at its height."""
    piece = _junctions_worn(junction.polygon, junction.ways)
    cell = np.full(len(piece.vertices), junction.cell)
    heights = layout.cells.heights(cell, piece.vertices[:, :2])
    return replace(piece, vertices=np.column_stack([piece.vertices[:, :2], heights]))


def _junctions_worn(polygon: shapely.Geometry, ways: Sequence[Strip]) -> Graded:
    """Wear on one polygon, at height 0."""
    # Find how bright the points of a grid are.
    x0, y0, x1, y1 = polygon.bounds
    x, y = np.arange(x0, x1 + _STEP, _STEP), np.arange(y0, y1 + _STEP, _STEP)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    factor = brightness(grid.reshape(-1, 2), ways).reshape(grid.shape[:2])
    # Keep the squares that differ visibly from fresh asphalt.
    corner = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    flat = grid.reshape(-1, 2)
    quads = quads[factor.reshape(-1)[quads].min(axis=1) < _NOTICED]
    # Cut those at the polygon's border.
    shapes = shapely.polygons(flat[quads])
    shapely.prepare(polygon)
    whole = shapely.contains_properly(polygon, shapes)
    edge = ~whole & shapely.intersects(polygon, shapes)
    wear = np.tile((1.0, 0.0, 0.0), (len(flat), 1))
    wear[:, 0] = factor.reshape(-1)
    points = np.column_stack([flat, np.zeros(len(flat))])
    inner = Graded(points, _halves(quads[whole]), wear)
    outer = Graded(points, _halves(quads[edge]), wear)
    parts = [clipped(outer, part) for part in polygon_parts(polygon)] if edge.any() else []
    return joined([_compact(inner), *parts]) if whole.any() or parts else NOTHING


def _halves(quads: Ints) -> Ints:
    """Two triangles of each quad."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _compact(piece: Graded) -> Graded:
    """A piece without unused vertices."""
    used, faces = np.unique(piece.faces, return_inverse=True)
    return Graded(piece.vertices[used], faces.reshape(-1, 3), piece.wear[used])


def brightness(points: Floats, ways: Sequence[Strip]) -> Floats:
    """Return the brightness that traffic and dirt leave at points of a junction.

    Args:
        points: (n, 2) [m].
        ways: Of motor vehicles.

    Returns:
        (n,) in (0, 1].

    Ways out of one lane share their tracks; those of different lanes add up. Few
    drivers turn, and some turn less than others.
    """
    lanes: list[tuple[Floats, Floats]] = []
    spots: Polygons = np.asarray(shapely.points(points))
    for way in ways:
        line = way.lane.shape[:, :2]
        near = _around(points, line)
        away = shapely.distance(spots[near], shapely.LineString(line))
        own = np.ones(len(points))
        own[near] = wear_across(away, strength=_junctions_strength(way)) * (
            1.0 - 0.05 * np.exp(-((away / 1.5) ** 4))
        )
        for k, (start, worn) in enumerate(lanes):
            if np.hypot(*(start - line[0])) < _SAME_START:
                lanes[k] = (start, np.minimum(worn, own))
                break
        else:
            lanes.append((line[0], own))
    total = np.prod([worn for _, worn in lanes], axis=0) * stained(points)
    return np.asarray(np.maximum(total, _DARKEST))


def stained(points: Floats) -> Floats:
    """Return the brightness that dirt has left at points, (n, 2) [m], as (n,) in [0.8, 1]."""
    broad, small = patchy(points, 5.5, salt=3), patchy(points, 1.4, salt=4)
    blots = np.clip(2.5 * patchy(points, 0.8, salt=5) - 1.3, 0.0, 1.0)
    return np.asarray(1.0 - np.clip(0.04 + 0.06 * broad + 0.04 * small, 0.0, 0.1) - 0.1 * blots)


def _junctions_strength(way: Strip) -> float:
    """How worn a way is: it varies, and bends are driven less."""
    line = way.lane.shape[:, :2]
    first, last = line[1] - line[0], line[-1] - line[-2]
    turned = 1.0 - float(first @ last) / max(float(np.hypot(*first) * np.hypot(*last)), 1e-9)
    busy = 1.15 if turned < 0.2 else 0.85
    return busy * (0.35 + 0.55 * share_of(0, "wear", way.lane.id))


def _around(points: Floats, line: Floats) -> Ints:
    """Numbers of the points, (n, 2) [m], in the boxes around a line's sides that it may wear."""
    near = np.zeros(len(points), dtype=np.bool_)
    for ends in pairwise(line):
        low, high = np.minimum(*ends) - _WIDEST, np.maximum(*ends) + _WIDEST
        near |= ((points >= low) & (points <= high)).all(axis=1)
    return np.flatnonzero(near)
