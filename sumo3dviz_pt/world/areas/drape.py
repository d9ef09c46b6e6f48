"""Lays flat shapes exactly on the triangles of the ground, and cuts holes into these.

A shape is divided along the ground's triangles, so it neither floats over a slope nor dips
into it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from sumo3dviz_pt.library.mesh.planar import polygon_parts, triangulate_many
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, area_vectors, unit

_NONE: Ints = np.zeros(0, dtype=np.int64)
_LEVEL = 1e-6  # heights that differ less are one [m]


class Draped(NamedTuple):
    """Shapes on the ground.

    Attributes:
        mesh: All of them, with the ground's normals.
        owners: Number of the shape that each face belongs to, (m,).
    """

    mesh: Mesh
    owners: Ints


@dataclass(frozen=True, slots=True, eq=False)
class GroundFaces:
    """The triangles of the ground.

    Attributes:
        corners: (n, 3, 3) [m].
        normals: Of their corners, (n, 3, 3).
        polygons: In plan, (n,).
        tree: Of them.
    """

    corners: Floats
    normals: Floats
    polygons: NDArray[Any]
    tree: shapely.STRtree

    @classmethod
    def of(cls, meshes: Sequence[Mesh]) -> GroundFaces:
        """Index meshes that together are the ground."""
        corners = [np.zeros((0, 3, 3))]
        normals = [np.zeros((0, 3, 3))]
        for mesh in meshes:
            corners.append(mesh.vertices[mesh.faces])
            flat = unit(area_vectors(mesh.vertices, mesh.faces))
            own = np.repeat(flat[:, None], 3, axis=1)
            normals.append(own if mesh.normals is None else mesh.normals[mesh.faces])
        all_corners = np.concatenate(corners)
        polygons = shapely.polygons(all_corners[..., :2])
        return cls(all_corners, np.concatenate(normals), polygons, shapely.STRtree(polygons))

    def draped(self, shapes: Sequence[shapely.Geometry], *, lift: float) -> Draped:
        """Return shapes as they lie on the ground.

        Args:
            shapes: In plan [m].
            lift: How far they lie above it [m].
        """
        laid_shapes = [self._laid(shape) for shape in shapes]
        vertices, normals, faces, owners = [], [], [], []
        count = 0
        for number, laid in enumerate(laid_shapes):
            vertices.append(laid.points + np.array([0.0, 0.0, lift]))
            normals.append(laid.normals)
            faces.append(laid.faces + count)
            owners.append(np.full(len(laid.faces), number))
            count += len(laid.points)
        if not laid_shapes:
            return Draped(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), np.zeros(0, np.int64))
        mesh = Mesh(np.concatenate(vertices), np.concatenate(faces), np.concatenate(normals))
        return Draped(mesh, np.concatenate(owners))

    def _laid(self, shape: shapely.Geometry) -> _Laid:
        """One shape on the ground."""
        parts = polygon_parts(shape)
        near = np.unique(self.tree.query(parts, predicate="intersects")[1]) if parts else _NONE
        heights = self.corners[near, :, 2]
        if not len(heights):
            return _Laid(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3), np.int64))
        if float(np.ptp(heights)) < _LEVEL:
            made = triangulate_many(parts)
            points = np.column_stack([made.vertices, np.full(len(made.vertices), heights.flat[0])])
            up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
            return _Laid(points, up, made.faces)
        return self._divided(parts)

    def _divided(self, parts: Sequence[shapely.Polygon]) -> _Laid:
        """Polygons, divided along the triangles that they lie on."""
        pieces: list[shapely.Polygon] = []
        homes: list[int] = []
        for part in parts:
            shapely.prepare(part)
            near = self.tree.query(part, predicate="intersects")
            inside = shapely.contains_properly(part, self.polygons[near])
            for k in near[inside].tolist():
                pieces.append(self.polygons[k])
                homes.append(k)
            border = near[~inside]
            cut = shapely.intersection(part, self.polygons[border])
            for k, shape in zip(border.tolist(), cut.tolist(), strict=True):
                for piece in polygon_parts(shape):
                    pieces.append(piece)
                    homes.append(k)
        made = triangulate_many(pieces)
        home = np.array(homes, dtype=np.int64)[made.owner] if homes else made.owner
        shares = self.shares(home, made.vertices)
        points = np.column_stack([made.vertices, (shares * self.corners[home, :, 2]).sum(axis=1)])
        normals = unit((shares[..., None] * self.normals[home]).sum(axis=1))
        return _Laid(points, normals, made.faces)

    def shares(self, face: Ints, points: Floats) -> Floats:
        """Return barycentric coordinates of points in triangles, (n, 3).

        Args:
            face: Numbers of the triangles, (n,).
            points: (n, 2) [m].
        """
        return barycentric(self.corners[face][..., :2], points)


class _Laid(NamedTuple):
    """Points (n, 3) [m], normals (n, 3) and faces (m, 3) of one shape."""

    points: Floats
    normals: Floats
    faces: Ints


def barycentric(corners: Floats, points: Floats) -> Floats:
    """Return barycentric coordinates, (n, 3), of points (n, 2) [m] in triangles (n, 3, 2) [m]."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    whole = _cross(b - a, c - a)
    whole = np.where(np.abs(whole) < 1e-12, 1.0, whole)
    v = _cross(points - a, c - a) / whole
    w = _cross(b - a, points - a) / whole
    return np.stack([1.0 - v - w, v, w], axis=1)


def _cross(one: Floats, other: Floats) -> Floats:
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


class CutMesh(NamedTuple):
    """A mesh with a hole.

    Attributes:
        mesh: What is left.
        sources: Number of the old face that each face comes from, (m,).
    """

    mesh: Mesh
    sources: Ints


def without(mesh: Mesh, hole: shapely.Geometry) -> CutMesh:
    """Cut a hole into a mesh that is seen from above.

    Args:
        mesh: Its vertical faces stay.
        hole: In plan [m].
    """
    numbers = np.arange(len(mesh.faces))
    parts = polygon_parts(hole)
    if not parts:
        return CutMesh(mesh, numbers)
    triangles = shapely.polygons(mesh.vertices[mesh.faces][..., :2])
    keep = np.ones(len(triangles), dtype=np.bool_)
    touched, left = _left_of(triangles, parts)
    keep[touched] = False
    # What is left of touched triangles becomes new ones, by the same plane.
    pieces: list[shapely.Polygon] = []
    homes: list[int] = []
    for k, shape in zip(touched.tolist(), left.tolist(), strict=True):
        for piece in polygon_parts(shape):
            pieces.append(piece)
            homes.append(k)
    made = triangulate_many(pieces)
    home = np.array(homes, dtype=np.int64)[made.owner] if homes else made.owner
    shares = barycentric(mesh.vertices[mesh.faces[home]][..., :2], made.vertices)

    def mixed(values: Floats) -> Floats:
        """Values at the new vertices, by those at the old ones."""
        return np.asarray((shares[..., None] * values[mesh.faces[home]]).sum(axis=1))

    vertices = np.column_stack([made.vertices, mixed(mesh.vertices)[:, 2]])
    faces = np.concatenate([mesh.faces[keep], made.faces + len(mesh.vertices)])
    normals, uvs = mesh.normals, mesh.uvs
    whole = Mesh(
        np.concatenate([mesh.vertices, vertices]),
        faces,
        None if normals is None else np.concatenate([normals, unit(mixed(normals))]),
        None if uvs is None else np.concatenate([uvs, mixed(uvs)]),
    )
    of_new = np.array(homes, dtype=np.int64)[made.owner[made.faces[:, 0]]] if homes else _NONE
    return CutMesh(whole, np.concatenate([numbers[keep], of_new]))


def _left_of(
    triangles: NDArray[Any], parts: Sequence[shapely.Polygon]
) -> tuple[Ints, NDArray[Any]]:
    """Numbers of the triangles that parts of a hole touch, and what these leave of them.

    Each part is taken only from what it touches: a town's hole is long, a triangle small.
    """
    part, triangle = shapely.STRtree(triangles).query(parts, predicate="intersects")
    order = np.lexsort((part, triangle))
    some = np.array(parts)
    shapely.prepare(some)
    part, triangle = part[order], triangle[order]
    covered = np.unique(triangle[shapely.contains_properly(some[part], triangles[triangle])])
    touched, number = np.unique(triangle, return_inverse=True)
    whole = np.isin(touched, covered)
    holes = shapely.multipolygons(some[part], indices=number)
    left = np.full(len(touched), shapely.Polygon())
    left[~whole] = shapely.difference(triangles[touched[~whole]], holes[~whole])
    return touched, left
