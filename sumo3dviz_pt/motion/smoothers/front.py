"""What a smoother makes: the motion of a road user's front, the middle of its front bumper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark

_INSTANT = 1e-4
"""Half the time over which a velocity is measured: short for traffic, long for rounding [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class FrontMotion:
    """The front at n times.

    Attributes:
        positions: (n, 3) [m].
        speeds: Along the path, (n,) [m/s].
        yaws: (n,) [rad]; None where the body follows its front.
        pitches: Nose up, (n,) [rad]; None where the body follows its front.
    """

    positions: Floats
    speeds: Floats
    yaws: Floats | None = None
    pitches: Floats | None = None


class Front(Protocol):
    """The front of one road user over an unbroken stretch of time."""

    @property
    def begin(self) -> float:
        """First sample's time [s]."""

    @property
    def end(self) -> float:
        """Last sample's time [s]."""

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What was noticed."""

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class JoinedFronts:
    """Fronts that follow one another without a gap.

    Attributes:
        fronts: Fronts in time order; each begins where the one before it ends.
        noted: What was noticed of the whole.
    """

    fronts: tuple[Front, ...]
    noted: tuple[Remark, ...] = ()

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return self.fronts[0].begin

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return self.fronts[-1].end

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What was noticed of the whole and in all of them."""
        return self.noted + tuple(remark for front in self.fronts for remark in front.remarks)

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        joints = np.array([front.begin for front in self.fronts[1:]])
        which = np.searchsorted(joints, times, side="right")
        positions, speeds = np.empty((len(times), 3)), np.empty(len(times))
        for number in np.unique(which).tolist():
            inside = which == number
            part = self.fronts[number].at(times[inside])
            positions[inside], speeds[inside] = part.positions, part.speeds
        return FrontMotion(positions, speeds)


def velocity(front: Front, time: float) -> Floats:
    """Return the velocity of a front at a time within it, (3,) [m/s]."""
    low, high = max(time - _INSTANT, front.begin), min(time + _INSTANT, front.end)
    positions = front.at(np.array([low, high])).positions
    return np.asarray((positions[1] - positions[0]) / (high - low))
