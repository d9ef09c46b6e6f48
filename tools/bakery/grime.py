"""Road dirt on painted bodies: how much of it covers each vertex.

Each vertex carries it as v of its uv, from where the paint of vehicles reads it; u says how far
rain runs down there in streaks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh

MOST = 0.55
"""Share of the paint that is covered where there is most dirt."""

_FILM = 0.05
"""Share that is covered everywhere below the windows."""


@dataclass(frozen=True, slots=True)
class Dirt:
    """What decides where a body is dirty.

    Attributes:
        length: Of the body [m].
        low: Height of its lower edge [m].
        axles: Distances of the axles behind the front [m].
        radius: Of the wheels [m].
    """

    length: float
    low: float
    axles: tuple[float, ...]
    radius: float


def grimed(mesh: Mesh, dirt: Dirt) -> Mesh:
    """Return a body's paint with its dirt in v: on sills, behind wheels and at the rear.

    Args:
        mesh: In the body's frame, with normals.
        dirt: Where it is dirty.
    """
    x, y, z = mesh.vertices.T
    up = np.maximum(z - dirt.low, 0.0)
    normals = mesh.normals if mesh.normals is not None else np.zeros_like(mesh.vertices)
    flank = np.clip(2.0 * np.abs(normals[:, 1]) - 0.4, 0.0, 1.0)
    share = 0.42 * np.exp(-up / 0.13) + _FILM * np.exp(-((up / 0.7) ** 4))
    for d in dirt.axles:
        behind = -x - d - 0.8 * dirt.radius
        spray = np.exp(-np.maximum(behind, 0.0) / 0.45) * np.clip(behind / 0.1 + 1.0, 0.0, 1.0)
        share = share + 0.4 * flank * spray * np.exp(-((up / 0.33) ** 2))
    rear = np.clip(-2.0 * normals[:, 0] - 0.6, 0.0, 1.0) * (-x > 0.5 * dirt.length)
    share = share + 0.3 * rear * np.exp(-((up / 0.45) ** 2))
    share = share * np.clip(1.3 - normals[:, 2], 0.0, 1.0) * _patches(x, np.abs(y), z)
    covered = np.clip(share, 0.0, MOST)
    return replace(mesh, uvs=np.column_stack([_streaks(dirt, mesh.vertices, normals), covered]))


def _streaks(dirt: Dirt, points: Floats, normals: Floats) -> Floats:
    """How far rain runs down in streaks, (n,) in [0, 1]: at the rear, and under the windows."""
    x, _, z = points.T
    rear = np.clip(-2.0 * normals[:, 0] - 0.4, 0.0, 1.0) * (-x > 0.5 * dirt.length)
    flank = np.clip(2.0 * np.abs(normals[:, 1]) - 0.8, 0.0, 1.0)
    upright = np.clip(1.6 - 2.0 * np.abs(normals[:, 2]), 0.0, 1.0)
    streaks = (0.95 * rear + 0.4 * flank) * upright * (z > dirt.low)
    return np.asarray(np.clip(streaks, 0.0, 0.999))


def _patches(x: Floats, y: Floats, z: Floats) -> Floats:
    """A pattern of decimetres that makes dirt uneven, the same on both flanks, 1 on average."""
    waves = np.sin(9.1 * x + 3.0 * z) * np.sin(12.7 * z - 4.1 * x + 2.0 * y)
    return np.asarray(1.0 + 0.3 * waves + 0.15 * np.sin(31.0 * x + 17.0 * z))
