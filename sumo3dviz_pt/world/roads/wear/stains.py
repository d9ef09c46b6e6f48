"""Dirt and wet stains on footways and bicycle lanes near the camera."""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract
from sumo3dviz_pt.model.geometry import UNWORN, Floats, Mesh
from sumo3dviz_pt.world.roads.drops import cut_on_grid
from sumo3dviz_pt.world.roads.strips import BoundsXY, distance_to
from sumo3dviz_pt.world.roads.style import BICYCLE, PAVING
from sumo3dviz_pt.world.roads.wear.noise import patchy

STAINED = frozenset({PAVING, BICYCLE})
"""Surfaces that show stains."""

_STEP = 0.7
"""Size of the pieces whose corners know their stains [m]."""

_FARTHEST = 55.0
"""Stains fade up to this distance from the camera's path [m]."""


def cut_for_stains(piece: shapely.Geometry, focus: BoundsXY | None) -> list[shapely.Geometry]:
    """A polygon in small pieces near the camera."""
    if focus is None:
        return [piece]
    reach = shapely.box(*focus).buffer(_FARTHEST)
    if piece.area < _STEP**2 or not piece.intersects(reach):
        return [piece]
    x0, y0, x1, y1 = shapely.intersection(piece, reach).bounds
    # One grid for all polygons, so that neighbours meet in the same points.
    x, y = (
        _STEP * np.arange(np.floor(low / _STEP), np.ceil(high / _STEP) + 1)
        for low, high in ((x0, x1), (y0, y1))
    )
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)
    squares = np.asarray(shapely.polygons(quads.reshape(-1, 4, 2)))
    covered = shapely.box(x[0], y[0], x[-1], y[-1])
    return [*polygon_parts(subtract(piece, [covered])), *cut_on_grid(piece, squares)]


def stained_mesh(mesh: Mesh, focus: BoundsXY | None) -> Mesh:
    """A mesh whose vertices know how dirty they are.

    Args:
        mesh: Cut by `cut_for_stains`.
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
