"""Regular grids of triangles."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.model.vectors import unit


def grid_faces(rows: int, columns: int, *, closed: bool = False) -> Ints:
    """Return the triangles of a grid of vertices, (m, 3); the first halves of all quads come first.

    Args:
        rows: Of vertices, which are numbered row by row.
        columns: Of vertices.
        closed: Whether the last column joins the first.
    """
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - (not closed)), indexing="ij")
    after = (j + 1) % columns
    a, b = i * columns + j, i * columns + after
    c, d = (i + 1) * columns + after, (i + 1) * columns + j
    return np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )


def height_field(x: Floats, y: Floats, z: Floats) -> Mesh:
    """Build a surface over a rectangular grid, facing up, with smooth normals.

    Args:
        x: Increasing, (n,) [m].
        y: Increasing, (m,) [m].
        z: Heights, (m, n) [m].
    """
    xx, yy = np.meshgrid(x, y)
    slope_y, slope_x = np.gradient(z, y, x)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(z)], axis=-1).reshape(-1, 3)
    vertices = np.stack([xx, yy, z], axis=-1).reshape(-1, 3)
    return Mesh(vertices, grid_faces(*z.shape), unit(normals))
