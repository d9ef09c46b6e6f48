"""Normals that corners of a surface share, but across creases, and meshes of them."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh


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
