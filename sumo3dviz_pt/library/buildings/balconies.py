"""Balconies and loggias of a wall, in wall coordinates: (along, inward, up) [m]."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sumo3dviz_pt.library.buildings.facade import FAR, NEAR, Facade
from sumo3dviz_pt.library.buildings.shell import Shell, box, joined, rectangles
from sumo3dviz_pt.model.geometry import Floats

Balconies = Literal["none", "iron", "solid", "glass", "gallery"]
"""Iron bars, a solid parapet, a glass one, or a gallery along the whole storey."""

_DEEP, _RAIL = 1.1, 1.0  # of a balcony's slab, and of its railing above the floor [m]
_PITCH = 0.14  # of bars [m]


def balconies(
    length: float, floors: Floats, facade: Facade, *, sort: Balconies, level: int, seed: int
) -> Shell:
    """Build balconies in front of some bays, from the second upper storey on.

    Args:
        length: Of the wall [m].
        floors: Of the upper storeys, and where the last one ends, (n + 1,) [m].
        facade: Says where the bays are.
        sort: Which kind.
        level: Of detail.
        seed: Chooses the bays.
    """
    openings = facade.openings(length, 0.0)
    if sort == "none" or not len(openings):
        return {}
    if sort == "gallery":
        return joined(
            [_balcony(0.15, length - 0.15, float(z), "solid", level) for z in floors[:-1]]
        )
    bays = french_doors(sort, seed) or slice(None)
    parts: list[Shell] = []
    for u0, u1, *_ in openings[bays].tolist():
        wide = min(u0, length - u1, 0.5)
        parts += [_balcony(u0 - wide, u1 + wide, float(z), sort, level) for z in floors[1:-1]]
    return joined(parts)


def french_doors(sort: Balconies, seed: int) -> slice | None:
    """Choose the bays whose windows reach the floor: those with balconies, None for none."""
    if sort == "none":
        return None
    if sort == "gallery":
        return slice(1, None, 2)
    rng = np.random.default_rng([seed, 17])
    return slice(int(rng.integers(0, 2)), None, int(rng.integers(2, 4)))


def _balcony(u0: float, u1: float, z: float, sort: Balconies, level: int) -> Shell:
    """Build a slab and its railing."""
    if level == FAR:
        if sort == "iron":  # a slab and its shadow, and a veil of bars
            return {
                "trim": box((u0, -_DEEP, z - 0.12), (u1, 0.0, z + 0.04), skip="YxX"),
                "rail": rectangles(u0, u1, z + _RAIL - 0.3, z + _RAIL, inward=-_DEEP),
            }
        return {"panel": rectangles(u0, u1, z - 0.1, z + _RAIL, inward=-_DEEP)}
    slab = {"trim": box((u0, -_DEEP, z - 0.12), (u1, 0.0, z + 0.04), skip="Y")}
    z0, z1 = z + 0.04, z + _RAIL
    if sort in ("solid", "glass"):
        role = "panel" if sort == "solid" else "glazing"
        return joined([slab, {role: _upright(u0, u1, z0, z1, 0.0)}, _handrail(u0, u1, z1, level)])
    if level != NEAR:
        # From here on, bars are a veil: a low dark band stands for them.
        return joined([slab, {"rail": _upright(u0, u1, z1 - 0.12, z1, 0.01)}])
    return joined([slab, {"rail": _bars(u0, u1, z0, z1)}, _handrail(u0, u1, z1, level)])


def _upright(u0: float, u1: float, z0: float, z1: float, inset: float) -> Floats:
    """Build front and sides of a railing, both faces of each, (6, 4, 3)."""
    y, thick = -_DEEP + inset, 0.05
    outer = box((u0 + inset, y, z0), (u1 - inset, 0.0, z1), skip="Ybt")
    inner = box((u0 + inset + thick, y + thick, z0), (u1 - inset - thick, 0.0, z1), skip="Ybt")
    return np.concatenate([outer, inner[:, ::-1]])


def _handrail(u0: float, u1: float, z: float, level: int) -> Shell:
    """Build a rail along the top of the parapet's front and sides."""
    if level != NEAR:
        return {}
    front = box((u0, -_DEEP - 0.01, z), (u1, -_DEEP + 0.05, z + 0.05), skip="bxX")
    left = box((u0, -_DEEP + 0.05, z), (u0 + 0.06, 0.0, z + 0.05), skip="YybX")
    right = box((u1 - 0.06, -_DEEP + 0.05, z), (u1, 0.0, z + 0.05), skip="Yybx")
    return {"rail": np.concatenate([front, left, right])}


def _bars(u0: float, u1: float, z0: float, z1: float) -> Floats:
    """Build upright bars: flat ones in front, seen from outside and inside, (n, 4, 3)."""
    u = np.linspace(u0 + 0.03, u1 - 0.03, max(int((u1 - u0) / _PITCH), 2))
    front = rectangles(u - 0.011, u + 0.011, z0, z1, inward=-_DEEP + 0.02)
    y = np.linspace(-_DEEP + 0.15, -0.1, 6)
    sides = []
    for u_side in (u0 + 0.03, u1 - 0.03):
        side = rectangles(y - 0.011, y + 0.011, z0, z1)[:, :, [1, 0, 2]]
        side[..., 0] = u_side
        sides.append(side if u_side > u0 + 0.1 else side[:, ::-1])
    # No camera stands on a balcony, so bars need one face only.
    return np.concatenate([front, *sides])
