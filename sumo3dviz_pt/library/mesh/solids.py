"""Small closed pieces: lathed bodies, boxes, superellipsoids, tubes, rounded outlines in stacks."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.library.mesh.shading import share_normals, weld
from sumo3dviz_pt.model.geometry import (
    Floats,
    Ints,
    Mesh,
    Transform,
    area_vectors,
    merge_meshes,
    unit,
)

_SHARP = 1e-4  # smaller bevels are left out [m]


def shaded(vertices: Floats, faces: Ints, *, crease: float = 0.7) -> Mesh:
    """Give a triangle list smooth normals, except across creases.

    Args:
        vertices: (n, 3) [m]; equal positions should be one vertex.
        faces: Outward triangles, (m, 3); degenerate ones are dropped.
        crease: Angle above which an edge stays sharp [rad].
    """
    areas = area_vectors(vertices, faces)
    solid = np.linalg.norm(areas, axis=1) > 1e-9
    faces, areas = faces[solid], areas[solid]
    owner = faces.reshape(-1)
    normals = share_normals(owner, np.repeat(areas, 3, axis=0), crease=crease)
    return weld(owner, vertices[owner], normals)


def lathe(profile: Sequence[Sequence[float]], *, segments: int, crease: float = 0.7) -> Mesh:
    """Turn a profile around the y axis.

    Args:
        profile: (radius, y) pairs [m]; where y grows along it, the outside is away
            from the axis.
        segments: Number of facets around.
        crease: Angle above which an edge stays sharp [rad].
    """
    turns = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    points = np.asarray(profile, dtype=np.float64)
    radius, y = points[:, 0, None], points[:, 1, None]
    vertices = np.stack(
        [
            radius * np.sin(turns),
            np.broadcast_to(y, (len(points), segments)),
            radius * np.cos(turns),
        ],
        axis=-1,
    ).reshape(-1, 3)
    faces = grid_faces(len(points), segments, closed=True)
    # Poles: all vertices of a ring of radius 0 are one vertex.
    rings = np.arange(len(points)).repeat(segments)
    first = np.where(
        radius[:, 0].repeat(segments) < 1e-9, rings * segments, np.arange(len(vertices))
    )
    return shaded(vertices, first[faces], crease=crease)


def box(low: Sequence[float], high: Sequence[float]) -> Mesh:
    """Build an axis-aligned box with sharp edges between two corners [m]."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    vertices = np.asarray(low) + corners * (np.asarray(high) - np.asarray(low))
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return shaded(vertices, _fan(quads), crease=0.2)


def bevelled(low: Sequence[float], high: Sequence[float], *, bevel: float) -> Mesh:
    """Build a box with bevelled edges that are shaded round.

    Args:
        low: Lowest corner, (3,) [m].
        high: Highest corner, (3,) [m].
        bevel: Width of the bevels [m].
    """
    corners = np.array([low, high], dtype=np.float64)
    middle, half = corners.mean(axis=0), 0.5 * (corners[1] - corners[0])
    bevel = min(bevel, 0.9 * float(half.min()))
    if bevel < _SHARP:
        return box(low, high)
    signs = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64) * 2.0 - 1.0
    # Each corner of the box becomes a triangle: one vertex for each face that meets there.
    sizes = np.where(np.eye(3) > 0.0, half, half - bevel)
    vertices = middle + signs[:, None, :] * sizes
    return shaded(vertices.reshape(-1, 3), _BEVEL_FACES, crease=0.9)


def _bevel_faces() -> Ints:
    """Triangles of a bevelled box: 6 sides, 12 bevels, 8 corners; outward."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    inset = np.stack([signs * np.where(np.eye(3)[a] > 0, 1.0, 0.8) for a in range(3)], axis=1)
    points = inset.reshape(-1, 3)
    polygons = [[3 * c, 3 * c + 1, 3 * c + 2] for c in range(8)]
    for axis in range(3):
        for sign in (-1, 1):
            ring = [c for c in range(8) if signs[c, axis] == sign]
            ring = [ring[0], ring[1], ring[3], ring[2]]
            polygons.append([3 * c + axis for c in ring])
    for c in range(8):
        for axis in range(3):
            other = c + (4 >> axis)
            if signs[c, axis] > 0:
                continue
            p, q = (axis + 1) % 3, (axis + 2) % 3
            polygons.append([3 * c + p, 3 * other + p, 3 * other + q, 3 * c + q])
    faces = []
    for polygon in polygons:
        a, b, c = points[polygon[0]], points[polygon[1]], points[polygon[2]]
        outward = np.dot(np.cross(b - a, c - a), points[polygon].mean(axis=0)) > 0
        ring = polygon if outward else polygon[::-1]
        faces += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
    return np.array(faces, dtype=np.int64)


_BEVEL_FACES = _bevel_faces()


def prism(outline: Sequence[Sequence[float]], *, half_width: float, crease: float = 0.4) -> Mesh:
    """Extrude a convex outline to both sides.

    Args:
        outline: Counter-clockwise (x, z) pairs [m].
        half_width: How far it reaches to either side in y [m].
        crease: Angle above which an edge stays sharp [rad].
    """
    points = np.asarray(outline, dtype=np.float64)
    count = len(points)
    sides = [
        np.column_stack([points[:, 0], np.full(count, y), points[:, 1]])
        for y in (-half_width, half_width)
    ]
    ring = np.arange(count)
    after = (ring + 1) % count
    hull = np.stack([ring, after, after + count, ring + count], axis=1)
    caps = [list(ring), list(ring[::-1] + count)]
    faces = np.concatenate([_fan(hull[:, ::-1]), _fan(caps)])
    return shaded(np.concatenate(sides), faces, crease=crease)


def slab(outer: Floats, inner: Floats) -> Mesh:
    """Build a thin piece between two quads with equal sense, (4, 3) each [m].

    Args:
        outer: Counter-clockwise when seen from outside.
        inner: Its back.
    """
    sides = [(k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4) for k in range(4)]
    return shaded(
        np.concatenate([outer, inner]), _fan([(0, 1, 2, 3), (7, 6, 5, 4), *sides]), crease=0.3
    )


def _fan(polygons: Sequence[Sequence[int]] | Ints) -> Ints:
    """Cut convex polygons, given by their vertex numbers, into triangles."""
    return np.array(
        [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)], dtype=np.int64
    )


def superellipsoid(
    half: Sequence[float], *, squareness: float, segments: int = 12, rings: int = 8
) -> Mesh:
    """Build a rounded body around the origin.

    Args:
        half: Half sizes along x, y, z [m].
        squareness: Exponent, 2 is an ellipsoid, 4 nearly a box.
        segments: Facets around z.
        rings: Facets from pole to pole.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    lift = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)[:, None]
    directions = np.stack(
        [
            np.cos(lift) * np.cos(turn),
            np.cos(lift) * np.sin(turn),
            np.broadcast_to(np.sin(lift), (rings + 1, segments)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    size = (np.abs(directions) ** squareness).sum(axis=1) ** (1.0 / squareness)
    vertices = directions / size[:, None] * np.asarray(half)
    numbers = np.arange(len(vertices))
    ring = numbers // segments
    numbers = np.where((ring == 0) | (ring == rings), ring * segments, numbers)
    return shaded(vertices, numbers[grid_faces(rings + 1, segments, closed=True)], crease=1.2)


def tube(path: ArrayLike, *, radius: ArrayLike, sides: int = 6) -> Mesh:
    """Build a closed tube along a polyline.

    Args:
        path: (n, 3) [m], n >= 2.
        radius: One for all or one for each point, (n,) [m].
        sides: Facets around.
    """
    points = np.asarray(path, dtype=np.float64)
    radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(points))
    along = unit(np.gradient(points, axis=0))
    helper = np.array([0.0, 1.0, 0.0]) if abs(along[0, 1]) < 0.9 else np.array([0.0, 0.0, 1.0])
    across = unit(np.cross(along, helper))
    upwards = np.cross(along, across)
    turn = (np.arange(sides) + 0.5)[None, :, None] * 2.0 * np.pi / sides
    ring = np.cos(turn) * across[:, None] + np.sin(turn) * upwards[:, None]
    vertices = (points[:, None] + radii[:, None, None] * ring).reshape(-1, 3)
    count = len(vertices)
    caps = [list(range(sides))[::-1], list(range(count - sides, count))]
    faces = np.concatenate([grid_faces(len(points), sides, closed=True), _fan(caps)])
    return shaded(vertices, faces, crease=0.9)


def fitted(
    pieces: Sequence[tuple[str, Mesh]], *, length: float, width: float, height: float
) -> list[tuple[str, Mesh]]:
    """Stretch pieces to a size, on the ground, behind x = 0 and centred on y = 0.

    Args:
        pieces: Material and mesh.
        length: Along x [m].
        width: Along y [m].
        height: Along z [m].
    """
    bounds = np.stack([mesh.bounds for _, mesh in pieces])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    scale = np.array([length, width, height]) / (high - low)
    anchor = np.array([high[0], 0.5 * (low[1] + high[1]), low[2]])
    fit = Transform.from_pose(-anchor * scale, scale=scale)
    return [(material, fit.mesh(mesh)) for material, mesh in pieces]


def solid_faces(mesh: Mesh) -> Mesh:
    """Drop the faces that lose their area when a mesh is stored as float32."""
    stored = mesh.vertices.astype(np.float32).astype(np.float64)
    solid = np.linalg.norm(area_vectors(stored, mesh.faces), axis=1) > 1e-12
    return mesh if solid.all() else replace(mesh, faces=mesh.faces[solid])


def by_material(pieces: Iterable[tuple[str, Mesh]]) -> dict[str, Mesh]:
    """Join pieces of one material, materials in alphabetical order."""
    groups: dict[str, list[Mesh]] = defaultdict(list)
    for material, mesh in pieces:
        groups[material].append(mesh)
    return {material: merge_meshes(meshes) for material, meshes in sorted(groups.items())}


def moved(mesh: Mesh, *offset: float) -> Mesh:
    """Shift a mesh by (x, y, z) [m]."""
    return Transform.from_pose(offset).mesh(mesh)


def mirrored(mesh: Mesh) -> Mesh:
    """Mirror a mesh in the plane y = 0; it still faces outward."""
    flip = np.array([1.0, -1.0, 1.0])
    normals = None if mesh.normals is None else mesh.normals * flip
    return Mesh(mesh.vertices * flip, mesh.faces[:, ::-1], normals, mesh.uvs)


def on_both_sides(pieces: Iterable[tuple[str, Mesh]]) -> Iterator[tuple[str, Mesh]]:
    """Yield each piece, and after it its mirror image."""
    for material, mesh in pieces:
        yield material, mesh
        yield material, mirrored(mesh)
