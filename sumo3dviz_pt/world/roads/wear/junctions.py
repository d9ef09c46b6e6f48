"""Wheel tracks and oil where ways cross a junction."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.roads.cells import Polygons
from sumo3dviz_pt.world.roads.graded import NOTHING, Graded, clipped, joined
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, distance_to
from sumo3dviz_pt.world.roads.wear.lanes import is_driven, wear_across
from sumo3dviz_pt.world.roads.wear.noise import patchy

_STEP = 0.34
"""Distance of vertices [m]."""

_FARTHEST = 140.0
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
        if ways and polygon.area <= _LARGEST and distance_to(focus, middle)[0] <= _FARTHEST:
            yield DrivenJunction(index, surface, polygon, ways)


def _worn_inside(layout: RoadLayout, junction: DrivenJunction) -> Graded:
    """Wear of one junction, at its height."""
    piece = _worn(junction.polygon, junction.ways)
    cell = np.full(len(piece.vertices), junction.cell)
    heights = layout.cells.heights(cell, piece.vertices[:, :2])
    return replace(piece, vertices=np.column_stack([piece.vertices[:, :2], heights]))


def _worn(polygon: shapely.Geometry, ways: Sequence[Strip]) -> Graded:
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
        own[near] = wear_across(away, strength=_strength(way)) * (
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


def _strength(way: Strip) -> float:
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
