"""What cars and heavy vehicles share, which are both made as the half with y >= 0 of a field.

Their recipes' frame is (d, y, z) with d behind the front; the body's frame has x = -d.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import Field, dual_contour
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, Transform

_FLIP = np.array([-1.0, 1.0, 1.0])


def half_surface(field: Field, grid: tuple[Floats, Floats, Floats], *, spacing: float) -> Surface:
    """Mesh the half of a body with y >= 0, all faces tagged 0; its seam lies at y = 0.

    Args:
        field: Negative inside the body.
        grid: Coordinates d, y and z of the grid's planes, (n,) each [m].
        spacing: Of the grid [m].
    """
    vertices, faces = dual_contour(field, grid)
    seam = _open_vertices(faces)
    seam = seam[np.abs(vertices[seam, 1]) < 0.6 * spacing]
    vertices[seam, 1] = 0.0
    return Surface(vertices, faces, np.zeros(len(faces), dtype=np.int64))


def _open_vertices(faces: Ints) -> Ints:
    """Vertices on edges that only one face has."""
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, uses = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(np.unique(unique[uses == 1]))


def rim_of(vertices: Floats, faces: Ints) -> Ints:
    """Return the edges around some faces, (n, 2), without those on the seam of the two halves."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = len(vertices)
    back = sides[:, 1] * count + sides[:, 0]
    rim = sides[~np.isin(sides[:, 0] * count + sides[:, 1], back)]
    return np.asarray(rim[(np.abs(vertices[rim, 1]) > 1e-9).any(axis=1)])


def both_sides(outline: Floats) -> Floats:
    """Complete an outline in (|y|, z) that ends in the middle by its mirror image, (n, 2) [m]."""
    middle = np.flatnonzero(np.abs(outline[:, 0]) < 1e-9)
    if len(middle) != 2:
        return outline
    # Begin where the outline leaves the middle and end where it comes back.
    begin = middle[1] if middle[1] - middle[0] == 1 else 0
    half = np.roll(outline, -begin, axis=0)
    return np.concatenate([half, (half * np.array([-1.0, 1.0]))[-2:0:-1]])


def forward(mesh: Mesh) -> Mesh:
    """Turn a mesh from the recipe's frame into the body's."""
    assert mesh.normals is not None
    return replace(
        mesh,
        vertices=mesh.vertices * _FLIP,
        faces=mesh.faces[:, ::-1],
        normals=mesh.normals * _FLIP,
    )


def fit_to(size: Sequence[float], *, low: Floats, high: Floats) -> Transform:
    """Return what stretches a body by the last millimetres to its declared size.

    Args:
        size: Length, width, height [m].
        low: Lowest corner of the body as it was made, (3,) [m].
        high: Highest corner, (3,) [m].
    """
    scale = np.asarray(size) / np.array([high[0] - low[0], 2.0 * high[1], high[2]])
    return Transform.from_pose((-high[0] * scale[0], 0.0, 0.0), scale=scale)
