"""Traffic lights: heads of stacked lamps, poles and arms.

Frame of a head: origin below the middle of its housing, the lenses look to -x, that
is, towards traffic that drives to +x; +y is that traffic's left.

References:
    Lenses of 200 mm, housings of 300 mm per lamp: EN 12368.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform, merge_meshes
from sumo3dviz_pt.shapes.solids import box, tube

HOUSING = 0.30
"""Height of the housing of one lamp [m]."""
WIDTH = 0.30
"""Width of a housing [m]."""
RADIUS = 0.10
"""Of a lens [m]."""


def housing(lamps: int, *, backing: bool = True) -> Mesh:
    """The dark body of a head with visors.

    Args:
        lamps: How many lamps are stacked.
        backing: Whether a black board stands around the head.
    """
    tall = HOUSING * lamps
    parts = [box((-0.1, -WIDTH / 2, 0.0), (0.1, WIDTH / 2, tall))]
    if backing:
        parts.append(box((-0.04, -0.26, -0.1), (-0.03, 0.26, tall + 0.1)))
    parts += [_visor(HOUSING * (i + 0.5)) for i in range(lamps)]
    return merge_meshes(parts)


def lens(index: int, *, segments: int = 12) -> Mesh:
    """A slightly domed disc; index 0 is the lowest lamp."""
    turn = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    rim = np.column_stack([np.full(segments, -0.105), -np.sin(turn), np.cos(turn)])
    rim[:, 1:] *= RADIUS
    middle = np.array([0.0, 0.0, HOUSING * (index + 0.5)])
    vertices = np.vstack([np.array([-0.125, 0.0, 0.0]), rim]) + middle
    ring = np.arange(segments) + 1
    faces = np.column_stack([np.zeros(segments, int), np.roll(ring, -1), ring])
    normals = vertices - middle - np.array([0.15, 0.0, 0.0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(vertices, faces, normals)


def pole(height: float, *, radius: float = 0.055) -> Mesh:
    """An upright pole from 0.5 m below the ground."""
    return tube(np.array([(0, 0, -0.5), (0, 0, height)], float), radius=radius, sides=10)


def mast(height: float, reach: float, *, radius: float = 0.09) -> Mesh:
    """A pole with an arm to its left (+y), `reach` long [m]; negative reaches to the right."""
    bend = np.array(
        [
            (0, 0, height - 0.6),
            (0, 0.12 * np.sign(reach), height - 0.15),
            (0, 0.6 * np.sign(reach), height),
            (0, reach, height + 0.15),
        ],
        float,
    )
    return merge_meshes(
        [
            tube(np.array([(0, 0, -0.5), (0, 0, height - 0.6)], float), radius=radius, sides=12),
            tube(bend, radius=radius * 0.75, sides=10),
        ]
    )


def placed(mesh: Mesh, position: Sequence[float] | Floats, yaw: float) -> Mesh:
    """A mesh moved to a place [m] and turned [rad]."""
    return Transform.from_pose(np.asarray(position), yaw=yaw).mesh(mesh)


def _visor(z: float) -> Mesh:
    """A hood over a lens: part of a cylinder, deeper on top than at its sides."""
    turn = np.linspace(np.radians(-15), np.radians(195), 9)
    y, up = 0.125 * np.cos(turn), 0.125 * np.sin(turn)
    front = -0.13 - 0.17 * np.clip(0.35 + 0.65 * np.sin(turn), 0.0, 1.0)
    back = np.column_stack([np.full(9, -0.1), y, z + up])
    edge = np.column_stack([front, y, z + up])
    normals = np.column_stack([np.zeros(9), np.cos(turn), np.sin(turn)])
    i = np.arange(8)
    faces = np.column_stack([i, i + 9, i + 10, i, i + 10, i + 1]).reshape(-1, 3)
    return Mesh(np.vstack([back, edge]), faces, np.vstack([normals, normals]))


def crossbar(width: float, height: float) -> Mesh:
    """A horizontal bar that several heads hang on, `width` between the outer ones [m]."""
    ends = np.array([(-0.04, -width / 2, height), (-0.04, width / 2, height)], float)
    return tube(ends, radius=0.03, sides=6)
