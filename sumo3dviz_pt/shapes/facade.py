"""Walls with windows, in wall coordinates: (along, inward, up) [m].

Window sizes, the 0.2 m inset and the tilted panes are those of the look study
(reflections that break up pane by pane are what makes a facade look real).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.shapes.shell import Shell, joined, rectangles

NEAR, MIDDLE, FAR = 0, 1, 2
"""Levels of detail."""

_TILT = 0.004  # standard deviation of a pane's corners from its plane [m]
_FRAME = 0.06  # width of a window frame [m]


@dataclass(frozen=True, slots=True)
class Facade:
    """How the windows of a wall look.

    Attributes:
        bay: Distance between window axes [m]; the wall's length rounds it.
        width: Of a window [m].
        height: Of a window [m].
        sill: Height above the floor [m].
        inset: Of the pane behind the wall [m].
        blinds: Share of windows with a lowered blind, [0, 1].
        divided: Whether a window has a mullion in the middle.
    """

    bay: float = 3.1
    width: float = 1.3
    height: float = 1.5
    sill: float = 0.9
    inset: float = 0.16
    blinds: float = 0.4
    divided: bool = True

    def openings(self, length: float, floor: float) -> Floats:
        """Windows of one storey, (k, 4) as u0, u1, z0, z1 [m]; none where there is no room."""
        count = int(length / self.bay + 0.35)
        if count < 1 or length < self.width + 0.6:
            return np.zeros((0, 4))
        axes = (np.arange(count) + 0.5) * length / count
        low = np.full(count, floor + self.sill)
        half = self.width / 2
        return np.stack([axes - half, axes + half, low, low + self.height], axis=1)


def storey(length: float, low: float, high: float, openings: Floats) -> Floats:
    """The wall around a row of openings, (n, 4, 3) [m].

    Args:
        length: Of the wall [m].
        low: Where the storey begins [m].
        high: Where it ends [m].
        openings: Within the storey, sorted along the wall, (k, 4) as u0, u1, z0, z1 [m].
    """
    u0, u1, z0, z1 = openings.T
    piers = rectangles(np.append(0.0, u1), np.append(u0, length), low, high)
    below = rectangles(u0, u1, low, z0)[z0 > low + 1e-6]
    above = rectangles(u0, u1, z1, high)[z1 < high - 1e-6]
    return np.concatenate([piers, below, above])


def windows(
    openings: Floats, facade: Facade, *, level: int, rng: np.random.Generator
) -> dict[str, Floats]:
    """What fills the openings of a wall.

    Args:
        openings: (k, 4) as u0, u1, z0, z1 [m].
        facade: How they look.
        level: `NEAR` for reveals, frames and sills, `MIDDLE` for panes flush with the wall.
        rng: Tilts the panes and lowers the blinds.
    """
    if not len(openings):
        return {}
    if level != NEAR:
        return {"window": _upright(openings)}
    u0, u1, z0, z1 = openings.T
    inset, bar = facade.inset, _FRAME
    panes = rectangles(u0 + bar, u1 - bar, z0 + bar, z1 - bar, inward=inset)
    # A pane stays plane: two of its edges tilt, the fourth corner follows.
    tilt = rng.normal(0.0, _TILT, (len(panes), 2))
    panes[:, 1:3, 1] += tilt[:, :1]
    panes[:, 2:, 1] += tilt[:, 1:]
    drop = rng.choice([0.25, 0.5, 0.9], len(panes)) * (z1 - z0)
    low = np.maximum(z1 - drop, z0 + bar)
    blind = rectangles(u0 + bar, u1 - bar, low, z1 - bar, inward=inset - 0.015)
    return {
        "window": panes,
        "reveal": _reveals(openings, inset),
        "frame": _frames(openings, inset - 0.02, facade.divided),
        "blind": blind[rng.random(len(blind)) < facade.blinds],
        "sill": _sills(openings),
    }


def wall(
    length: float,
    floors: Floats,
    facade: Facade,
    *,
    level: int,
    rng: np.random.Generator,
) -> dict[str, Floats]:
    """A wall of storeys with windows.

    Args:
        length: Of the wall [m].
        floors: Where storeys begin, and where the last one ends, (n + 1,) [m].
        facade: How its windows look.
        level: Level of detail.
        rng: Tilts the panes and lowers the blinds.
    """
    if level == FAR:
        return _bands(length, floors, facade)
    parts: list[Shell] = []
    for low, high in pairwise(floors.tolist()):
        openings = facade.openings(length, low)
        parts.append({"wall": storey(length, low, high, openings)})
        parts.append(windows(openings, facade, level=level, rng=rng))
    return joined(parts)


def _bands(length: float, floors: Floats, facade: Facade) -> dict[str, Floats]:
    """A wall seen from afar: a darker band per storey instead of windows."""
    openings = facade.openings(length, 0.0)
    if not len(openings):
        every = rectangles(0.0, length, floors[0], floors[-1])
        return {"wall": every}
    low, high = floors[:-1] + facade.sill, floors[:-1] + facade.sill + facade.height
    ends = np.append(low, floors[-1])
    starts = np.append(floors[0], high)
    u0, u1 = openings[0, 0], openings[-1, 1]
    return {
        "wall": np.concatenate(
            [
                rectangles(0.0, length, starts, ends),
                rectangles(0.0, u0, low, high),
                rectangles(u1, length, low, high),
            ]
        ),
        "band": rectangles(u0, u1, low, high),
    }


def _upright(openings: Floats, inward: float = 0.0) -> Floats:
    """Rectangles of openings, (k, 4, 3), behind the wall's face [m]."""
    u0, u1, z0, z1 = openings.T
    return rectangles(u0, u1, z0, z1, inward=inward)


def _reveals(openings: Floats, inset: float) -> Floats:
    """The four faces of the wall's thickness in each opening, (4 k, 4, 3)."""
    front = _upright(openings)
    back = _upright(openings, inset)
    rolled = [
        np.stack([front[:, i], front[:, j], back[:, j], back[:, i]], axis=1)
        for i, j in ((0, 1), (1, 2), (2, 3), (3, 0))
    ]
    return np.concatenate(rolled)


def _frames(openings: Floats, inward: float, divided: bool) -> Floats:
    """Flat bars around each opening, and one in the middle if wanted."""
    u0, u1, z0, z1 = openings.T
    bar = _FRAME
    middle = (u0 + u1) / 2
    bars = [
        rectangles(u0, u1, z0, z0 + bar, inward=inward),
        rectangles(u0, u1, z1 - bar, z1, inward=inward),
        rectangles(u0, u0 + bar, z0 + bar, z1 - bar, inward=inward),
        rectangles(u1 - bar, u1, z0 + bar, z1 - bar, inward=inward),
        rectangles(middle - bar / 2, middle + bar / 2, z0 + bar, z1 - bar, inward=inward),
    ]
    return np.concatenate(bars if divided else bars[:-1])


def _sills(openings: Floats) -> Floats:
    """Boards in front of each opening: front and top, (2 k, 4, 3)."""
    u0, u1, z0, _ = openings.T
    front = rectangles(u0 - 0.08, u1 + 0.08, z0 - 0.06, z0, inward=-0.07)
    top = front[:, [3, 2, 2, 3]].copy()
    top[:, 2:, 1] = 0.0
    return np.concatenate([front, top])
