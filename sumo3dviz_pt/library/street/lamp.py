"""Street lamps: a tapered pole, an arm over the kerb, a flat head of light-emitting diodes.

Frame: origin at the foot of the pole, +x towards the road, z up.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, prism, tube
from sumo3dviz_pt.library.street.traffic_light import foot, upward
from sumo3dviz_pt.model.geometry import Mesh, merge_meshes

LENS = (0.60, 0.24)
"""Size of the area that shines: across the road and along it [m]."""

REACH = 1.5
"""From the pole to the middle of the lens [m]."""


def pole(height: float, *, level: int = 0) -> Mesh:
    """Build pole, arm and the case of the head; the lens hangs below at a height [m].

    Args:
        height: Of the lens above the foot [m].
        level: 0 near, 1 beyond 60 m, 2 beyond 150 m.
    """
    sides = (12, 7, 4)[level]
    bend = np.linspace(0.0, np.pi / 2, (6, 3, 2)[level])
    top, radius = height + 0.05, 0.55
    arm = [
        *(
            (radius * (1 - np.cos(t)), 0.0, top - radius + radius * np.sin(t))
            for t in bend.tolist()
        ),
        (REACH - 0.25, 0.0, top),
    ]
    radii = np.linspace(0.046, 0.03, len(arm))
    parts = [tube(arm, radius=radii, sides=sides)]
    if level == 0:
        profile = [(0.0, -0.5), (0.085, -0.5), (0.085, 1.2), (0.07, 1.3), (0.046, top - radius)]
        parts += [upward([*profile, (0.0, top - radius)], segments=sides), foot(0.085)]
        parts.append(box((-0.095, -0.045, 0.5), (-0.06, 0.045, 0.95)))
    else:
        ends = [(0.0, 0.0, -0.5), (0.0, 0.0, top - radius)]
        parts.append(tube(ends, radius=(0.085, 0.046), sides=sides))
    return merge_meshes(parts)


def head(height: float, *, level: int = 0) -> Mesh:
    """Build the case over the lens, thin towards its tip."""
    back, tip = REACH - 0.42, REACH + 0.36
    low = height + 0.006
    if level == 2:
        return box((back, -0.13, low), (tip, 0.13, height + 0.09))
    outline = [
        (back, low),
        (tip, low),
        (tip + 0.02, low + 0.02),
        (REACH + 0.1, height + 0.07),
        (back + 0.1, height + 0.11),
        (back, height + 0.09),
    ]
    return prism(outline, half_width=0.145, crease=0.5)


def lens(height: float) -> Mesh:
    """Build the area that shines, looking down, of two triangles."""
    u, v = LENS[0] / 2, LENS[1] / 2
    corners = [(REACH - u, -v), (REACH - u, v), (REACH + u, v), (REACH + u, -v)]
    vertices = np.array([(x, y, height) for x, y in corners])
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 0.0, -1.0], (4, 1)))
