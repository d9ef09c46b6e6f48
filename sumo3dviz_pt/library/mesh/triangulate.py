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
    made = triangulate_many([polygon])
    return made.vertices, made.faces


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
    import mapbox_earcut

    # All corners of all rings at once, each ring's without its last one, which is its first.
    rings, of_ring = shapely.get_rings(np.asarray(polygons, dtype=object), return_index=True)
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    inner = np.append(ring[1:] == ring[:-1], False)[: len(ring)]
    vertices, ring = corners[inner], ring[inner]
    owner = of_ring[ring].astype(np.int64)
    starts = np.searchsorted(owner, np.arange(len(polygons) + 1))
    # Small numbers keep earcut's predicates exact far from the origin; a row of corners on
    # one line must not bend either way by a last bit.
    local = settled(vertices - vertices[starts[owner]])
    ends = np.searchsorted(ring, np.arange(len(rings)), side="right")
    last = np.searchsorted(of_ring, np.arange(len(polygons) + 1))
    faces = [np.zeros((0, 3), np.int64)]
    for number, start in enumerate(starts[:-1].tolist()):
        own = (ends[last[number] : last[number + 1]] - start).astype(np.uint32)
        cut = mapbox_earcut.triangulate_float64(local[start : starts[number + 1]], own)
        faces.append(cut.reshape(-1, 3).astype(np.int64) + start)
    return Owned(vertices, _counter_clockwise(vertices, np.concatenate(faces)), owner)


def _counter_clockwise(vertices: Floats, faces: Ints) -> Ints:
    """Turn all faces one way round and drop those without area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    faces = np.where((twice < 0)[:, None], faces[:, ::-1], faces)
    return faces[np.abs(twice) > 1e-9]
