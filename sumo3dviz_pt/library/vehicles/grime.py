"""Road dirt on painted bodies: how much of it covers each vertex.

It travels as v of the meshes' uvs, where the paint that renders vehicles looks it up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh

MOST = 0.55
"""Share of the paint that is covered where there is most dirt."""

_FILM = 0.05
"""Everywhere below the windows."""


def grimed(mesh: Mesh, *, length: float, low: float, axles: Sequence[tuple[float, float]]) -> Mesh:
    """A body's paint with its dirt in v: on sills, behind wheels and at the rear.

    Args:
        mesh: In the body's frame, with normals.
        length: Of the body [m].
        low: Height of its lower edge [m].
        axles: Distance behind the front and radius of the wheels [m].
    """
    x, y, z = mesh.vertices.T
    up = np.maximum(z - low, 0.0)
    normals = mesh.normals if mesh.normals is not None else np.zeros_like(mesh.vertices)
    flank = np.clip(2.0 * np.abs(normals[:, 1]) - 0.4, 0.0, 1.0)
    dirt = 0.42 * np.exp(-up / 0.13) + _FILM * np.exp(-((up / 0.7) ** 4))
    for d, radius in axles:
        behind = -x - d - 0.8 * radius
        spray = np.exp(-np.maximum(behind, 0.0) / 0.45) * np.clip(behind / 0.1 + 1.0, 0.0, 1.0)
        dirt = dirt + 0.4 * flank * spray * np.exp(-((up / 0.33) ** 2))
    rear = np.clip(-2.0 * normals[:, 0] - 0.6, 0.0, 1.0) * (-x > 0.5 * length)
    dirt = dirt + 0.3 * rear * np.exp(-((up / 0.45) ** 2))
    dirt = dirt * np.clip(1.3 - normals[:, 2], 0.0, 1.0) * _patches(x, np.abs(y), z)
    covered = np.clip(dirt, 0.0, MOST)
    return replace(mesh, uvs=np.column_stack([np.full(len(covered), 0.5), covered]))


def _patches(x: Floats, y: Floats, z: Floats) -> Floats:
    """Uneven on a scale of decimetres, the same on both flanks, 1 on average."""
    waves = np.sin(9.1 * x + 3.0 * z) * np.sin(12.7 * z - 4.1 * x + 2.0 * y)
    return np.asarray(1.0 + 0.3 * waves + 0.15 * np.sin(31.0 * x + 17.0 * z))
