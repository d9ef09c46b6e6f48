"""What a car's panes tell the renderer, so that it can show the cabin behind them.

Each corner tells where it lies in the cabin (its `wear`), and two numbers that are the same all
over a pane (its `uvs`): how large the cabin is, and which way the car looks, with what is random.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sumo3dviz_pt.model.geometry import Floats

CABIN_REACH = 8.0
"""Places in a cabin lie within half of this around the driver's seat, along each axis [m]."""

CABIN_STEPS = ((0.5, 0.06), (0.24, 0.04), (0.5, 0.03), (0.7, 0.1), (0.4, 0.2))
"""Least value and step of each measure of a cabin, in the order of `CabinSize` [m]."""

CABIN_LEVELS = 16
"""How many values of each measure are told apart."""

HEADINGS, CHANCES = 4096, 64
"""How many directions, and how many cars of one kind, are told apart."""

PACKED = CABIN_LEVELS ** len(CABIN_STEPS)
"""How many numbers the first of a pane's two can tell apart."""


@dataclass(frozen=True, slots=True)
class CabinSize:
    """How large a cabin is.

    Attributes:
        rear: From the front seats' backs to those behind [m].
        roof: Height over the windows' lower edge [m].
        half: Half its width at that height [m].
        cowl: How far the windscreen's foot lies ahead of the driver's back [m].
        tail: How far the rear window's foot lies behind it [m].
    """

    rear: float
    roof: float
    half: float
    cowl: float
    tail: float

    @property
    def packed(self) -> float:
        """All of them in one number in [0, 1)."""
        number = 0
        for field, (least, step) in zip(fields(self), CABIN_STEPS, strict=True):
            level = round((getattr(self, field.name) - least) / step)
            number = number * CABIN_LEVELS + min(max(level, 0), CABIN_LEVELS - 1)
        return float((number + 0.5) / PACKED)


@dataclass(frozen=True, slots=True)
class Cabin:
    """A cabin, and where in a body it is.

    Attributes:
        seat: x of the driver's back and height of the windows' lower edge [m].
        size: How large it is.
    """

    seat: tuple[float, float]
    size: CabinSize

    def places(self, points: Floats) -> Floats:
        """Return where points of the body, (n, 3) [m], lie in the cabin, (n, 3) in [0, 1]."""
        middle = np.array([self.seat[0], 0.0, self.seat[1]])
        return np.asarray(np.clip((points - middle) / CABIN_REACH + 0.5, 0.0, 1.0))

    def numbers(self, *, yaw: float = 0.0, chance: float = 0.0) -> tuple[float, float]:
        """Return the two numbers of its panes, in [0, 1) each.

        Args:
            yaw: Where the body looks to in the frame of its vertices [rad].
            chance: Of who never moves, [0, 1); road users bring their own.
        """
        heading = round(yaw / (2.0 * np.pi) * HEADINGS) % HEADINGS
        return self.size.packed, (heading * CHANCES + int(chance * CHANCES) + 0.5) / (
            HEADINGS * CHANCES
        )


def cabin_of(numbers: Floats) -> Cabin:
    """Return a cabin from the list in `baked.yaml`: place, height, and the sizes in their order."""
    seat, low, *sizes = (float(value) for value in numbers)
    return Cabin((seat, low), CabinSize(*sizes))
