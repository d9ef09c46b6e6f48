"""Normals that corners share, except across creases, and meshes with fewer triangles.

The coarser meshes are for what is only a few pixels large.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, area_vectors, areas, settled, unit


def share_normals(owner: Ints, normals: Floats, *, crease: float) -> Floats:
    """Average normals of corners at one vertex that agree within an angle [rad].

    Args:
        owner: Vertex of each corner, (k,).
        normals: Normals of the corners, any length as weight, (k, 3).
        crease: Largest angle between normals that are averaged [rad].
    """
    unit = normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-20)
    order = np.argsort(owner, kind="stable")
    ranked = owner[order]
    total = np.zeros_like(normals)
    limit = np.cos(crease)
    widest = int(np.bincount(owner).max())
    for shift in range(-widest + 1, widest):
        first, second = _shifted(len(order), shift)
        same = ranked[first] == ranked[second]
        i, j = order[first][same], order[second][same]
        agree = (unit[i] * unit[j]).sum(axis=1) > limit
        np.add.at(total, i[agree], normals[j[agree]])
    return np.asarray(total / (np.linalg.norm(total, axis=1, keepdims=True) + 1e-20))


def smooth_normals(vertices: Floats, faces: Ints) -> Floats:
    """Return area-weighted normals, shared by vertices at one place (to 1 mm), (n, 3)."""
    areas = area_vectors(vertices, faces)
    places, place = np.unique(np.round(settled(vertices), 3), axis=0, return_inverse=True)
    place = place.reshape(-1)
    total = np.zeros((len(places), 3))
    np.add.at(total, place[faces].reshape(-1), np.repeat(areas, 3, axis=0))
    return unit(total[place])


def _shifted(count: int, shift: int) -> tuple[slice, slice]:
    """Return slices that pair each place with the place `shift` further."""
    if shift >= 0:
        return slice(0, max(count - shift, 0)), slice(min(shift, count), count)
    return slice(min(-shift, count), count), slice(0, max(count + shift, 0))


def weld(owner: Ints, positions: Floats, normals: Floats) -> Mesh:
    """Build a mesh from corners, joining those with the same vertex and normal.

    Args:
        owner: Vertex of each corner, (3m,).
        positions: Positions of the corners, (3m, 3) [m].
        normals: Unit normals of the corners, (3m, 3).
    """
    keys = np.concatenate([owner[:, None], np.round(normals * 2000.0).astype(np.int64)], axis=1)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return Mesh(positions[first], inverse.reshape(-1, 3), normals[first])


_COARSEST = 0.22
"""Of a body's smallest side: in larger cells a bicycle would be gone."""

_LARGER = 1.05
"""A cell may be larger than it should be by this factor, so that a whole number of them fits."""


def clustered_body(meshes: Sequence[Mesh], cell: float) -> tuple[Mesh, ...]:
    """Make coarser meshes of a body that keep its outline.

    Of the vertices in a cell the outermost stays: means of them would lie inside the body,
    and cars would lose a tenth of their outline. Cells are centred at both ends of the body,
    so that its ends are not cut off.

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
    fitting = size / np.ceil(size / (_LARGER * side))
    # What is smaller than a cell lies in one.
    cells = np.where(size < side, 2.0 * side, fitting)
    return tuple(_merged(mesh, cells, low=low, size=size) for mesh in meshes)


def _merged(mesh: Mesh, cells: Floats, *, low: Floats, size: Floats) -> Mesh:
    """Make one part coarser; cells, the body's lower end and its size are (3,) each [m]."""
    if not len(mesh.faces):
        return Mesh(mesh.vertices, mesh.faces)
    keys = np.floor((mesh.vertices - low) / cells + 0.5).astype(np.int64)
    _, place = np.unique(numbered_rows(keys), return_inverse=True)
    out = np.square((mesh.vertices - low) / size - 0.5).sum(axis=1)
    order = np.argsort(-out, kind="stable")
    _, first = np.unique(place[order], return_index=True)
    vertices = mesh.vertices[order[first]]
    faces = place[mesh.faces]
    # Twins of one face cover each other.
    _, first = np.unique(numbered_rows(np.sort(faces, axis=1)), return_index=True)
    faces = faces[np.sort(first)]
    return Mesh(vertices, faces[areas(vertices, faces) > 1e-6])


def numbered_rows(rows: Ints) -> Ints:
    """Return one number for each row, (n, k) -> (n,), that compares as the row does.

    NumPy sorts numbers several times faster than rows.
    """
    if not len(rows):
        return np.zeros(0, np.int64)
    low = rows.min(axis=0)
    # In Python's whole numbers, which do not overflow.
    pairs = zip(low.tolist(), rows.max(axis=0).tolist(), strict=True)
    spans = [highest - lowest + 1 for lowest, highest in pairs]
    if math.prod(spans) >= 1 << 62:
        return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
    return np.asarray(np.ravel_multi_index(tuple((rows - low).T), spans), np.int64)
