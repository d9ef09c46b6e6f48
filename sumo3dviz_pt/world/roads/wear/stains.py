"""Dirt and wet stains on footways and bicycle lanes near the camera.

Smooth noise over the ground plane says where stains, dirt and worn spots lie.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract
from sumo3dviz_pt.model.geometry import UNWORN, Floats, Ints, Mesh
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.world.roads.drops import cut_on_grid
from sumo3dviz_pt.world.roads.strips import BICYCLES, PAVING, BoundsXY, distance_to


def patchy(points: Floats, scale: float, *, salt: int) -> Floats:
    """Return the value noise on a square lattice, smoothly interpolated.

    Args:
        points: (..., 2 or more) [m]; only x and y count.
        scale: Distance of the lattice's points [m], > 0.
        salt: Another noise for each.

    Returns:
        (...) in [-1, 1].

    References:
        Hash of the lattice: Steele et al., "Fast splittable pseudorandom number
        generators", OOPSLA 2014 (the finaliser of SplitMix64).
    """
    # Lattices of different noises must not share their corners.
    x, y = (points[..., k] / scale + 0.37 * salt for k in range(2))
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    u, v = (eased(f) for f in (x - i, y - j))
    below = _hashed(i, j, salt) * (1.0 - u) + _hashed(i + 1, j, salt) * u
    above = _hashed(i, j + 1, salt) * (1.0 - u) + _hashed(i + 1, j + 1, salt) * u
    return np.asarray(below * (1.0 - v) + above * v)


def _hashed(i: Ints, j: Ints, salt: int) -> Floats:
    """Numbers in [-1, 1) for cells of the lattice."""
    bits = i.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    bits = (bits ^ (j.astype(np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F))) + np.uint64(salt)
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray((bits >> np.uint64(11)) * (2.0 / (1 << 53)) - 1.0)


Tile = tuple[int, int]
"""A square of the ground by its numbers east and north of the origin."""

STAINED = frozenset({PAVING, *BICYCLES})
"""Surfaces that show stains."""

_STEP = 0.7
"""Size of the pieces whose corners have a wear each [m]."""

_PER_TILE = 24
"""Pieces along a side of a tile."""

_TILE = _PER_TILE * _STEP
"""Length of a tile's sides [m]."""

_FARTHEST = 55.0
"""Stains fade up to this distance from the camera's path [m]."""


def stain_tiles(area: shapely.Geometry, focus: BoundsXY | None) -> tuple[Tile, ...]:
    """Return tiles of an area near the camera, in which its pieces are small.

    Args:
        area: A polygon [m].
        focus: Box around the camera's path [m]; without one no tile is near.
    """
    if focus is None or is_small(area):
        return ()
    x0, y0, x1, y1 = area.bounds
    low = np.maximum([x0, y0], np.array(focus[:2]) - _FARTHEST)
    high = np.minimum([x1, y1], np.array(focus[2:]) + _FARTHEST)
    if (low >= high).any():
        return ()
    # Number the tiles that the two corners lie in.
    first, last = (np.floor(corner / _TILE).astype(np.int64) for corner in (low, high))
    tiles = [(i, j) for i in range(first[0], last[0] + 1) for j in range(first[1], last[1] + 1)]
    boxes = [_box(tile) for tile in tiles]
    shapely.prepare(area)
    near = shapely.intersects(area, boxes)
    return tuple(tile for tile, inside in zip(tiles, near, strict=True) if inside)


def is_small(piece: shapely.Geometry) -> bool:
    """Return whether a polygon is so small that its corners alone can show its stains."""
    return bool(piece.area < _STEP**2)


def cut_for_stains(piece: shapely.Geometry, tile: Tile) -> list[shapely.Geometry]:
    """Return the part of a polygon in a tile, in small pieces; nothing of one that is small."""
    if is_small(piece):
        return []
    # One grid for all polygons, so that neighbours meet in the same points.
    low, high = np.floor(np.array(piece.bounds).reshape(2, 2) / _STEP).astype(np.int64)
    first = np.maximum(np.array(tile) * _PER_TILE, low)
    last = np.minimum((np.array(tile) + 1) * _PER_TILE, high + 1)
    if (first >= last).any():
        return []
    x, y = (_STEP * np.arange(a, b + 1) for a, b in zip(first, last, strict=True))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)
    return cut_on_grid(piece, np.asarray(shapely.polygons(quads.reshape(-1, 4, 2))))


def without_tiles(piece: shapely.Geometry, tiles: Sequence[Tile]) -> list[shapely.Geometry]:
    """Return the part of a polygon outside some tiles; a small one as it is."""
    if not tiles or is_small(piece):
        return [piece]
    return polygon_parts(subtract(piece, [_box(tile) for tile in tiles]))


def _box(tile: Tile) -> shapely.Geometry:
    """A tile's area."""
    low, high = (_STEP * _PER_TILE * (np.array(tile) + more) for more in (0, 1))
    return shapely.box(*low, *high)


def stained_mesh(mesh: Mesh, focus: BoundsXY | None) -> Mesh:
    """Return a mesh with the dirt at each vertex as its wear.

    Args:
        mesh: Cut by `cut_for_stains` near the camera.
        focus: Box around the camera's path [m]; without one all is clean.
    """
    wear = np.tile(UNWORN, (len(mesh.vertices), 1))
    if focus is not None:
        fade = np.clip(1.5 - 1.5 * distance_to(focus, mesh.vertices) / _FARTHEST, 0.0, 1.0)
        wear[:, 0] = 1.0 - fade * _dirt(mesh.vertices)
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, mesh.uvs, wear)


def _dirt(points: Floats) -> Floats:
    """Brightness lost at points, (n, 3) [m], as (n,)."""
    broad, middle = patchy(points, 4.5, salt=11), patchy(points, 1.7, salt=12)
    spilled = np.clip(3.0 * patchy(points, 1.9, salt=13) - 1.7, 0.0, 1.0)
    dusty = np.clip(0.09 + 0.12 * broad + 0.07 * middle, 0.0, 0.28)
    return np.asarray(dusty + 0.2 * spilled)
