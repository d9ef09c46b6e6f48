"""Coarser meshes for what is only a few pixels large."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh

_COARSEST = 0.22
"""Of a body's smallest side: in larger cells a bicycle would be gone."""


def clustered_body(meshes: Sequence[Mesh], cell: float) -> tuple[Mesh, ...]:
    """Coarser meshes of a body with the outline that it had.

    Of the vertices in a cell the outermost stays: means of them would lie inside the body,
    and cars would lose a tenth of their outline.

    Args:
        meshes: All parts of the body.
        cell: Side of the grid's cells [m]; small bodies get smaller ones.

    Returns:
        One flat mesh for each part, without texture coordinates; some may have no faces left.

    References:
        Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex
        scenes, 1993.
    """
    used = [mesh.vertices[mesh.faces].reshape(-1, 3) for mesh in meshes]
    points = np.concatenate([np.zeros((0, 3)), *used])
    if not len(points):
        return tuple(Mesh(mesh.vertices, mesh.faces) for mesh in meshes)
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-3)
    side = max(0.2 * cell, min(cell, _COARSEST * float(size.min())))
    return tuple(_merged(mesh, side, middle=(low + high) / 2.0, size=size) for mesh in meshes)


def _merged(mesh: Mesh, cell: float, *, middle: Floats, size: Floats) -> Mesh:
    """One part, where the body has a middle and a size, (3,) [m]."""
    if not len(mesh.faces):
        return Mesh(mesh.vertices, mesh.faces)
    keys = np.floor(mesh.vertices / cell + 0.5).astype(np.int64)
    _, place = np.unique(keys, axis=0, return_inverse=True)
    place = place.reshape(-1)
    out = np.square((mesh.vertices - middle) / size).sum(axis=1)
    order = np.argsort(-out, kind="stable")
    _, first = np.unique(place[order], return_index=True)
    vertices = mesh.vertices[order[first]]
    faces = place[mesh.faces]
    # Twins of one face cover each other.
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    faces = faces[np.sort(first)]
    return Mesh(vertices, faces[_areas(vertices, faces) > 1e-6])


def _areas(vertices: Floats, faces: Ints) -> Floats:
    """Areas of faces, (m,) [m2]."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
