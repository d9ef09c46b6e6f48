"""Plane geometry on top of shapely, and its triangles.

Unions are safe, gaps can be closed, and polygons are made out of any geometry. Polygons and regular
grids become triangles.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from sumo3dviz_pt.model.geometry import Floats, Ints, settled

SMALLEST_AREA = 1e-5
"""Polygons below this area [m2] are dropped; nobody can see them."""

GRID = 1e-6
"""Overlays are computed on this grid [m].

Without a grid GEOS 3.14.1 was seen to drop an 85 m2 polygon from a union of 1,150 and
to find 7 m2 in common to two polygons that share no more than an edge.
"""


def union(shapes: Sequence[shapely.Geometry] | NDArray[shapely.Geometry]) -> shapely.Geometry:
    """Unite any number of shapes [m]; none give an empty one."""
    return shapely.union_all([areal(shape) for shape in shapes], grid_size=GRID)


def closing(shape: shapely.Geometry, reach: float) -> shapely.Geometry:
    """Fill gaps up to twice the reach [m] and keep outer corners (morphological closing)."""
    # Slivers without any area make GEOS divide by 0; what it returns is whole.
    with np.errstate(divide="ignore", invalid="ignore"):
        grown = shape.buffer(reach, join_style="mitre", mitre_limit=2.0)
        return grown.buffer(-reach, join_style="mitre", mitre_limit=2.0)


def polygon_parts(shape: shapely.Geometry) -> list[Polygon]:
    """Return the polygons in any geometry, without lines, points and crumbs."""
    if shape.geom_type == "Polygon" and shape.is_valid:
        return [shape] if shape.area > SMALLEST_AREA else []
    return [
        part
        for piece in shapely.get_parts(shapely.make_valid(shape)).tolist()
        for part in shapely.get_parts(piece).tolist()
        if part.geom_type == "Polygon" and part.area > SMALLEST_AREA
    ]


def sides(areas: Sequence[shapely.Geometry]) -> NDArray[shapely.Geometry]:
    """Return all sides of polygons as lines, (n,); a tree finds many short ones faster."""
    rings = shapely.get_parts(shapely.boundary(list(areas)))  # one by one: no side joins two
    points, ring = shapely.get_coordinates(rings, return_index=True)
    ends = np.stack([points[:-1], points[1:]], axis=1)
    return np.asarray(shapely.linestrings(ends[ring[1:] == ring[:-1]]))


def subtract(shape: shapely.Geometry, others: Iterable[shapely.Geometry]) -> shapely.Geometry:
    """Take others off a shape, one by one, so that shared edges stay exact."""
    left = areal(shape)
    for other in others:
        left = areal(shapely.difference(left, areal(other), grid_size=GRID))
    return left


def common(one: shapely.Geometry, other: shapely.Geometry) -> shapely.Geometry:
    """Return what two shapes share, without lines and points."""
    return areal(shapely.intersection(areal(one), areal(other), grid_size=GRID))


def areal(shape: shapely.Geometry) -> shapely.Geometry:
    """Drop the lines and points that overlays and repairs may leave in a shape."""
    if shape.geom_type in {"Polygon", "MultiPolygon"}:
        return shape
    return shapely.MultiPolygon(polygon_parts(shape))


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
