"""Polygons to triangles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.model.geometry import Floats, Ints, settled


def triangulate(polygon: Polygon) -> tuple[Floats, Ints]:
    """Cut a polygon, which may have holes, into triangles.

    Args:
        polygon: A valid polygon [m].

    Returns:
        Vertices, (n, 2) [m], and counter-clockwise faces, (m, 3).
    """
    import mapbox_earcut

    rings = [polygon.exterior, *polygon.interiors]
    loops = [shapely.get_coordinates(ring)[:-1] for ring in rings]
    vertices = np.concatenate(loops)
    ends = np.cumsum([len(loop) for loop in loops]).astype(np.uint32)
    # Small numbers keep earcut's predicates exact far from the origin; a row of corners on
    # one line must not bend either way by a last bit.
    local = settled(vertices - vertices[0])
    faces = mapbox_earcut.triangulate_float64(local, ends).reshape(-1, 3).astype(np.int64)
    return vertices, _counter_clockwise(vertices, faces)


Triangles = tuple[Floats, Ints]
"""Vertices, (n, 2) [m], and counter-clockwise faces, (m, 3)."""


def triangulate_all(polygons: Sequence[Polygon]) -> Triangles:
    """Cut polygons into triangles; which polygon a triangle comes from is not told."""
    made = triangulate_many(polygons)
    return made.vertices, made.faces


class Owned(NamedTuple):
    """Triangles of many polygons.

    Attributes:
        vertices: (n, 2) [m].
        faces: Counter-clockwise, (m, 3).
        owner: Number of the polygon that each vertex belongs to, (n,).
    """

    vertices: Floats
    faces: Ints
    owner: Ints


def triangulate_many(polygons: Sequence[Polygon]) -> Owned:
    """Cut many polygons into triangles."""
    corners, faces, owners = [np.zeros((0, 2))], [np.zeros((0, 3), np.int64)], []
    count = 0
    for number, polygon in enumerate(polygons):
        vertices, triangles = triangulate(polygon)
        corners.append(vertices)
        faces.append(triangles + count)
        owners.append(np.full(len(vertices), number, dtype=np.int64))
        count += len(vertices)
    owner = np.concatenate(owners) if owners else np.zeros(0, np.int64)
    return Owned(np.concatenate(corners), np.concatenate(faces), owner)


def _counter_clockwise(vertices: Floats, faces: Ints) -> Ints:
    """Turn all faces one way round and drop those without area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    faces = np.where((twice < 0)[:, None], faces[:, ::-1], faces)
    return faces[np.abs(twice) > 1e-9]
