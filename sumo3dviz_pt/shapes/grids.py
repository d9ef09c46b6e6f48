"""Regular grids of triangles."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh


def polar_grid(radii: Floats, *, segments: int) -> Mesh:
    """A level disc around the origin, facing up.

    Args:
        radii: Increasing radii of its rings, (n,) [m], n >= 1.
        segments: Sectors, >= 3.
    """
    turns = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    rings = radii[:, None, None] * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    flat = np.concatenate([np.zeros((1, 2)), rings.reshape(-1, 2)])
    column = np.arange(segments)
    after = (column + 1) % segments
    fan = np.stack([np.zeros_like(column), 1 + column, 1 + after], axis=1)
    inner = 1 + (np.arange(len(radii) - 1) * segments)[:, None]
    a, b = inner + column, inner + after
    c, d = b + segments, a + segments
    quads = [np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, c, b], -1).reshape(-1, 3)]
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    return Mesh(vertices, np.concatenate([fan, *quads]))


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
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertices = np.stack([xx, yy, z], axis=-1).reshape(-1, 3)
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return Mesh(vertices, faces, normals)
