"""What is paved between footways and houses: its height, its paving and its sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.materials import metres_per_tile, planar_uvs
from sumo3dviz_pt.library.mesh.bands import walls
from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.mesh.planar import polygon_parts, triangulate_many
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.world.placement.surroundings import HeightAt
from sumo3dviz_pt.world.roads.cells import heights_near
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import PAVING

_ABOVE = 0.004  # how far forecourts lie above footways, whose rim and small stones they cover [m]
_DEEP = 0.5  # of their sides [m]
_SQUARE = 1.5  # forecourts on slopes consist of squares of this size [m]
_STEP, _COUNT, _NEAR = 1.0, 16, 12.0  # points of pavements that shape them: distance, number, reach
_OWN, _SHARED = 0.2, 1.5  # up to and from these distances one footway, and all, give heights [m]


def court_height(layout: RoadLayout) -> HeightAt:
    """Return the height of forecourts at places: that of the footways beside them."""

    def height_at(places: Floats) -> Floats:
        """Return height at places, (n, 2) -> (n,) [m]."""
        if not len(places):
            return np.zeros(0)
        # Squares share their corners: each is asked once.
        once, number = np.unique(places, axis=0, return_inverse=True)
        heights = heights_near(layout.cells, once)
        if not layout.cells.is_flat:
            heights = _joined(heights, once, layout)
        return heights[number.reshape(-1)] + SIDEWALK_HEIGHT + _ABOVE

    return height_at


@dataclass(frozen=True, slots=True, eq=False)
class _Borders:
    """Points along the borders of what is paved.

    Attributes:
        starts: (n, 2) [m].
        ends: The next points, (n, 2) [m].
        tree: Of their middles.
    """

    starts: Floats
    ends: Floats
    tree: cKDTree


def _joined(heights: Floats, places: Floats, layout: RoadLayout) -> Floats:
    """Heights that go over from one street's to another's where both are near, (n,) [m].

    Args:
        heights: By the nearest footway, (n,) [m].
        places: (n, 2) [m].
        layout: The roads.
    """
    borders = layout.memory.of(("borders",), partial(_borders, layout))
    away, near = (
        np.asarray(nearest).reshape(len(places), -1)
        for nearest in borders.tree.query(places, k=min(_COUNT, len(borders.starts)))
    )
    used, own = np.unique(near, return_inverse=True)
    own = own.reshape(near.shape)
    # Each piece of a border goes on along its own slope.
    start, end = borders.starts[used], borders.ends[used]
    levels = heights_near(layout.cells, np.concatenate([start, end]))
    low, high = np.split(levels, 2)
    way = end - start
    length = np.maximum(np.hypot(*way.T), 1e-6)
    slope = ((high - low) / length**2)[:, None] * way
    middles = 0.5 * (start + end)
    along = ((places[:, None] - middles[own]) * slope[own]).sum(axis=2)
    weights = length[own] / (away**2 + 0.04) ** 2
    mean = (weights * (0.5 * (low + high)[own] + along)).sum(axis=1) / weights.sum(axis=1)
    share = smoothstep(_OWN, _SHARED, away[:, 0]) * (away[:, 0] < _NEAR)
    return np.asarray(heights + share * (mean - heights))


def _borders(layout: RoadLayout) -> _Borders:
    """Points along all borders of what is paved."""
    rings = shapely.get_parts(shapely.boundary(list(layout.outline)))
    points, ring = shapely.get_coordinates(shapely.segmentize(rings, _STEP), return_index=True)
    same = ring[1:] == ring[:-1]
    starts, ends = points[:-1][same], points[1:][same]
    return _Borders(starts, ends, cKDTree(0.5 * (starts + ends)))


def court_meshes(
    areas: Sequence[shapely.Polygon], layout: RoadLayout, near: tuple[float, float]
) -> list[Mesh]:
    """Return paving at the height of the footways beside it; where all is level, with its sides.

    Args:
        areas: The forecourts.
        layout: The roads.
        near: A point of the network [m] near which texture coordinates are small.
    """
    if not areas:
        return []
    # Cut the areas into triangles; on slopes so small ones that they follow the footways.
    flat = layout.cells.is_flat
    pieces = [[area] if flat else _squares(area) for area in areas]
    cut = [triangulate_many([shapely.orient_polygons(p) for p in some]) for some in pieces]
    ends = np.cumsum([len(made.vertices) for made in cut])[:-1]
    # Ask for all heights at once: each request for heights of a sloped road is expensive.
    places = np.concatenate([made.vertices for made in cut])
    level = np.split(court_height(layout)(places), ends)
    # Raise them, and close their sides.
    tile = metres_per_tile(PAVING)
    meshes = []
    for area, made, heights in zip(areas, cut, level, strict=True):
        top = np.column_stack([made.vertices, heights])
        mesh = Mesh(top, made.faces)
        if flat:
            # Vertices come ring by ring, as triangles are cut.
            whole = shapely.orient_polygons(area)
            sizes = [len(ring.coords) - 1 for ring in (whole.exterior, *whole.interiors)]
            rings = np.split(top, np.cumsum(sizes)[:-1])
            sides = walls(rings, [ring - [0.0, 0.0, _DEEP] for ring in rings])
            vertices = np.concatenate([top, sides.vertices])
            mesh = Mesh(vertices, np.concatenate([made.faces, sides.faces + len(top)]))
        uvs = planar_uvs(mesh.vertices, tile=tile, near=near)
        meshes.append(replace(mesh, uvs=uvs))
    return meshes


def _squares(area: shapely.Polygon) -> list[shapely.Polygon]:
    """An area cut along a grid of the plane."""
    low, high = np.reshape(area.bounds, (2, 2)) / _SQUARE
    x, y = (np.arange(np.floor(a), np.ceil(b)) * _SQUARE for a, b in zip(low, high, strict=True))
    x, y = (grid.ravel() for grid in np.meshgrid(x, y))
    squares = shapely.box(x, y, x + _SQUARE, y + _SQUARE)
    shapely.prepare(area)
    squares = squares[shapely.intersects(area, squares)]
    border = ~shapely.contains_properly(area, squares)
    squares[border] = shapely.intersection(area, squares[border])
    return [
        part
        for piece, cut in zip(squares.tolist(), border.tolist(), strict=True)
        for part in (polygon_parts(piece) if cut else [piece])
    ]


def court_sides(
    areas: Sequence[shapely.Polygon], layout: RoadLayout, ground_at: HeightAt
) -> list[Mesh]:
    """Return walls from the borders of sloped forecourts down into the ground.

    Args:
        areas: The forecourts.
        layout: The roads.
        ground_at: Height of the ground.
    """
    lines = [
        _crossed(shapely.get_coordinates(ring))
        for area in areas
        for whole in [shapely.orient_polygons(area)]
        for ring in (whole.exterior, *whole.interiors)
    ]
    if not lines:
        return []
    places = np.concatenate(lines)
    top = court_height(layout)(places)
    foot = np.minimum(top, ground_at(places)) - _DEEP
    ends = np.cumsum([len(line) for line in lines])[:-1]
    rings = [np.split(np.column_stack([places, z]), ends) for z in (top, foot)]
    return [walls(*rings)]


def _crossed(ring: Floats) -> Floats:
    """A closed line, (n, 2) [m], with points where it crosses the grid of squares, (m, 2) [m]."""
    points = []
    for start, end in pairwise(ring):
        low, high = np.minimum(start, end) / _SQUARE, np.maximum(start, end) / _SQUARE
        shares = [np.zeros(1)]
        for axis in np.flatnonzero(high - low > 1e-9):
            lines = np.arange(np.ceil(low[axis]), np.floor(high[axis]) + 1.0) * _SQUARE
            shares.append((lines - start[axis]) / (end[axis] - start[axis]))
        share = np.unique(np.concatenate(shares))
        points.append(start + share[share < 1.0, None] * (end - start))
    return np.concatenate(points)
