"""Small things on walls: down-pipes, machines under windows, signs that stick out.

In wall coordinates: (along, inward, up) [m].
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.buildings.facade import FAR, NEAR
from sumo3dviz_pt.library.buildings.fronts import letters
from sumo3dviz_pt.library.buildings.shell import Shell, box, joined, rectangles
from sumo3dviz_pt.model.geometry import Floats

_COOLED = 0.07  # share of windows with a machine under them


def down_pipe(height: float, *, level: int, rng: np.random.Generator, hopper: float = 0.5) -> Shell:
    """Build a pipe from the eaves to the ground near the beginning of a wall.

    Args:
        height: Of the wall [m].
        level: Of detail.
        rng: Places it.
        hopper: How far below the eaves water is collected [m].
    """
    u = 0.22 + 0.12 * float(rng.random())
    if level == FAR:
        return {}
    pipe = box((u - 0.055, -0.15, 0.0), (u + 0.055, -0.04, height - hopper), skip="btY")
    head = box((u - 0.13, -0.2, height - hopper - 0.3), (u + 0.13, 0.0, height - hopper), skip="Y")
    if level != NEAR:
        return {"pipe": pipe}
    clamps = [
        box((u - 0.075, -0.16, z), (u + 0.075, 0.0, z + 0.05), skip="Y")
        for z in np.arange(2.2, height - 1.5, 2.4).tolist()
    ]
    return {"pipe": np.concatenate([pipe, head, *clamps])}


def coolers(openings: Floats, *, level: int, rng: np.random.Generator) -> Shell:
    """Build air conditioners under some windows.

    Args:
        openings: Windows, (k, 4) as u0, u1, z0, z1 [m].
        level: Of detail.
        rng: Chooses windows.
    """
    some = openings[rng.random(len(openings)) < _COOLED]
    if level == FAR or not len(some):
        return {}
    parts: list[Shell] = []
    for u0, u1, z0, _ in some.tolist():
        u, z = (u0 + u1) / 2 - 0.4, z0 - 0.72
        case = box((u, -0.36, z), (u + 0.8, -0.06, z + 0.55), skip="Y")
        parts.append({"cooler": case})
        if level == NEAR:
            fan = rectangles(u + 0.06, u + 0.52, z + 0.06, z + 0.49, inward=-0.364)
            feet = box((u + 0.1, -0.3, z - 0.1), (u + 0.7, 0.0, z), skip="Yt")
            parts.append({"rail": np.concatenate([fan, feet])})
    return joined(parts)


def blade_signs(length: float, height: float, *, level: int, rng: np.random.Generator) -> Shell:
    """Build signs of shops that stick out over the pavement; both sides shine at night.

    Args:
        length: Of the wall [m].
        height: Of the ground floor [m].
        level: Of detail.
        rng: Chooses how many there are, where they hang and how large they are.
    """
    if length < 4.0:
        return {}
    parts: list[Shell] = []
    for number in range(int(rng.integers(0, max(int(length / 7.0), 1) + 1))):
        u, tall = float(rng.uniform(0.8, length - 0.8)), float(rng.uniform(0.55, 1.0))
        wide, low = float(rng.uniform(0.5, 0.8)), height - 0.2
        if level == FAR:
            continue
        faces = box((u - 0.06, -wide - 0.18, low), (u + 0.06, -0.18, low + tall), skip="ytYb")
        rim = box((u - 0.06, -wide - 0.18, low), (u + 0.06, -0.18, low + tall), skip="xX")
        parts.append({f"sign{number % 3}": faces, "joint": rim})
        parts.append({f"letter{number % 3}": _emblem(u, wide, (low, low + tall), rng)})
        if level == NEAR:
            arms = [
                box((u - 0.02, -0.2, z), (u + 0.02, 0.0, z + 0.04), skip="yY")
                for z in (low + 0.1, low + tall - 0.14)
            ]
            parts.append({"rail": np.concatenate(arms)})
    return joined(parts)


def _emblem(
    u: float, wide: float, heights: tuple[float, float], rng: np.random.Generator
) -> Floats:
    """Draw a mark over a name on both faces of a sign that sticks out, (n, 4, 3) [m].

    Args:
        u: Of the sign's middle, along the wall [m].
        wide: Of the sign, away from the wall [m].
        heights: Of its lower and upper edge [m].
        rng: Chooses mark and letters.
    """
    low, high = heights
    tall = high - low
    # The name fills the width; the mark is a diamond, a board or a pair of bars.
    name = letters(0.0, 0.0, 0.2, rng)
    scale = 0.8 * wide / max(float(np.ptp(name[..., 0])), 1e-6)
    name[..., 0] = (name[..., 0] - name[..., 0].min()) * scale - 0.4 * wide
    name[..., 2] = low + 0.12 * tall + 0.9 * min(scale, 1.0) * name[..., 2]
    size, z = 0.22 * min(wide, tall), low + 0.66 * tall
    corners = np.array([(-size, z), (0.0, z - size), (size, z), (0.0, z + size)])
    mark = np.insert(corners, 1, 0.0, axis=1)[None]
    sort = int(rng.integers(3))
    if sort == 1:
        mark = rectangles(-1.4 * size, 1.4 * size, z - 0.8 * size, z + 0.8 * size)
    if sort == 2:
        mark = rectangles(np.array([-size, 0.15 * size]), [-0.15 * size, size], z - size, z + size)
    flat = np.concatenate([name, mark])
    # From either side, words run to the right.
    sides = []
    for side in (-1.0, 1.0):
        out = -0.18 - wide / 2 + side * flat[..., 0]
        sides.append(np.stack([np.full_like(out, u + 0.063 * side), out, flat[..., 2]], axis=-1))
    return np.concatenate(sides)
