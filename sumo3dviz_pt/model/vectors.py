"""Unit vectors, lengths along lines and areas of triangles."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints


def unit(vectors: Floats) -> Floats:
    """Scale vectors, (..., n), to length 1; those without a length stay 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))


def arc_length(points: Floats) -> Floats:
    """Return the distance of each vertex along a polyline from its first one.

    Args:
        points: Vertices, (n, 2) or (n, 3) [m], n >= 1; give (n, 2) to measure from above.

    Returns:
        Non-decreasing distances, (n,) [m]; the first is 0.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def area_vectors(vertices: Floats, faces: Ints) -> Floats:
    """Return the cross product of two sides of each triangle, (..., m, 3) [m2].

    It points along the triangle's normal and is as long as twice its area.

    Args:
        vertices: Positions, (..., n, 3) [m].
        faces: Counter-clockwise vertex indices, (m, 3).
    """
    a, b, c = (vertices[..., faces[:, k], :] for k in range(3))
    return np.cross(b - a, c - a)


def areas(vertices: Floats, faces: Ints) -> Floats:
    """Return the areas of triangles, (m,) [m2]; arguments as of `area_vectors`."""
    return np.asarray(0.5 * np.linalg.norm(area_vectors(vertices, faces), axis=-1))
