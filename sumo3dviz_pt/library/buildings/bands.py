"""Bands that run around buildings, and which way walls look."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.buildings.roofs import inset, upright
from sumo3dviz_pt.library.buildings.shell import Shell
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.vectors import unit


def band(plan: Floats, heights: tuple[float, float], out: Floats, role: str) -> Shell:
    """Build a band around a building: face, top and underside.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        heights: Where it begins and ends [m].
        out: How far it reaches out of each wall, (n,) [m].
        role: What it is made of.
    """
    outer = inset(plan, -out)
    if outer is None:
        return {}
    low, high = heights
    after, around = np.roll(plan, -1, axis=0), np.roll(outer, -1, axis=0)

    def level(points: Floats, z: float) -> Floats:
        """Lift points of the plan to a height."""
        return np.column_stack([points, np.full(len(points), z)])

    top = np.stack([level(p, high) for p in (outer, around, after, plan)], axis=1)
    under = np.stack([level(p, low) for p in (around, outer, plan, after)], axis=1)
    upright_faces = upright(outer, low, high)
    # Along a wall that it does not reach out of, only its ends beyond the wall show.
    flush = np.asarray(out) == 0.0
    before, behind = _between(outer, plan, low, high), _between(after, around, low, high)
    ends = np.concatenate([before[flush], behind[flush]])
    faces = [upright_faces[~flush], ends, top]
    return {role: np.concatenate(faces if low < 0 else [*faces, under])}


def _between(begins: Floats, ends: Floats, low: float, high: float) -> Floats:
    """Build an upright face from each of some points to each of others, (n, 4, 3)."""
    corners = ((begins, low), (ends, low), (ends, high), (begins, high))
    return np.stack([np.column_stack([p, np.full(len(p), z)]) for p, z in corners], axis=1)


def outward(plan: Floats) -> Floats:
    """Unit normals of the walls of a plan, outwards, (n, 2)."""
    along = unit(np.roll(plan, -1, axis=0) - plan)
    return np.column_stack([along[:, 1], -along[:, 0]])
