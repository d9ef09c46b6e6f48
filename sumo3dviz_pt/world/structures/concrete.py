"""The look of walls, decks and linings: bare concrete."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.materials.by_key import material_name, metres_per_tile
from sumo3dviz_pt.model.geometry import UNWORN, Mesh
from sumo3dviz_pt.model.vectors import area_vectors

SURFACE = "concrete"
"""Its key among the surfaces."""

MATERIAL = material_name(SURFACE)


def concrete(mesh: Mesh) -> Mesh:
    """Return a mesh that shows concrete: no two faces share a corner.

    The texture lies on each face along the two axes that it faces least.
    """
    if not len(mesh.faces):
        return mesh
    corners = mesh.vertices[mesh.faces]
    facing = np.abs(area_vectors(mesh.vertices, mesh.faces))
    # A wall shows its height upright, however steep it is.
    facing[:, 2] *= 0.7
    axis = np.argmax(np.round(facing, 6), axis=1)
    first, second = np.array([1, 0, 0])[axis], np.array([2, 2, 1])[axis]
    rows = np.arange(len(corners))[:, None]
    ends = np.arange(3)[None, :]
    shift = np.floor(mesh.vertices.min(axis=0))
    local = corners - shift
    uvs = np.stack([local[rows, ends, k[:, None]] for k in (first, second)], axis=-1)
    count = 3 * len(corners)
    return Mesh(
        corners.reshape(-1, 3),
        np.arange(count).reshape(-1, 3),
        None,
        uvs.reshape(-1, 2) / metres_per_tile(SURFACE),
        np.tile(UNWORN, (count, 1)),
    )
