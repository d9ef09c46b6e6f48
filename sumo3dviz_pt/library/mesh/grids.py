"""Regular grids of triangles."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.vectors import unit


def height_field(x: Floats, y: Floats, z: Floats) -> Mesh:
    """A surface over a rectangular grid, facing up, with smooth normals.

    Args:
        x: Increasing, (n,) [m].
        y: Increasing, (m,) [m].
        z: Heights, (m, n) [m].
    """
    columns = len(x)
    xx, yy = np.meshgrid(x, y)
    index = np.arange(z.size).reshape(z.shape)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = b + columns, a + columns
    slope_y, slope_x = np.gradient(z, y, x)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(z)], axis=-1).reshape(-1, 3)
    vertices = np.stack([xx, yy, z], axis=-1).reshape(-1, 3)
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return Mesh(vertices, faces, unit(normals))
