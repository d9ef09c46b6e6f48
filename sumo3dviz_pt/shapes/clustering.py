"""Coarser meshes for what is only a few pixels large."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh


def clustered(mesh: Mesh, cell: float) -> Mesh:
    """Merge all vertices of each cell of a grid; flat, without texture coordinates.

    Args:
        mesh: Any triangles.
        cell: Side of the grid's cells [m].

    Returns:
        What is left of the faces; perhaps none.

    References:
        Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex
        scenes, 1993.
    """
    if not len(mesh.faces):
        return Mesh(mesh.vertices, mesh.faces)
    keys = np.floor(mesh.vertices / cell + 0.5).astype(np.int64)
    _, place, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    sums = np.zeros((len(count), 3))
    np.add.at(sums, place, mesh.vertices)
    vertices = sums / count[:, None]
    faces = place[mesh.faces]
    # Twins of one face cover each other.
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    faces = faces[np.sort(first)]
    return Mesh(vertices, faces[_areas(vertices, faces) > 1e-6])


def _areas(vertices: Floats, faces: Ints) -> Floats:
    """Areas of faces, (m,) [m2]."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
