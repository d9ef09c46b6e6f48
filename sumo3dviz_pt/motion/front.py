"""The motion of a road user's front, and curves through samples of it.

A smoother makes this motion; the front is the middle of the front bumper. Curves are cubic Hermite,
with slopes that make them smooth or monotone. All functions act on columns, (n, k), or on single
values, (n,), alike.

References:
    C. de Boor, A Practical Guide to Splines, chapter IV (C2 cubic spline by slopes).
    F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984): monotone slopes
    by the weighted harmonic mean (PCHIP).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import solve_banded

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark

_STILL = 1e-6
"""Values that change by less than this in a second stand."""


@dataclass(frozen=True, slots=True, eq=False)
class Hermite:
    """A cubic Hermite curve over time.

    Attributes:
        knots: Strictly increasing, (n,) [s], n >= 2.
        values: (n, k) or (n,).
        slopes: Of the same shape as the values, per second.
    """

    knots: Floats
    values: Floats
    slopes: Floats

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return values and their rates at times, (m,) [s]; constant outside the knots."""
        index = np.searchsorted(self.knots[1:-1], times, side="right")
        left = self.knots[index]
        step = self.knots[index + 1] - left
        share = np.minimum(np.maximum((times - left) / step, 0.0), 1.0)
        start, end = self.values.T.take(index, axis=-1), self.values.T.take(index + 1, axis=-1)
        first, last = self.slopes.T.take(index, axis=-1), self.slopes.T.take(index + 1, axis=-1)
        moved, rates = cubic(share, end - start, first * step, last * step)
        return (start + moved).T, (rates / step).T


def cubic(share: Floats, rise: Floats, first: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Return a cubic from 0 over a stretch of length 1, and its rate, (k, n) or (n,) each.

    It is evaluated relative to the left value (Horner), so that values far from zero keep
    their digits. Columns come as rows: numpy is 2.5 times as fast with long last axes.

    Args:
        share: Where on the stretch, in [0, 1], (n,).
        rise: Value of the cubic at the end, (k, n) or (n,).
        first: Its slope at the beginning, (k, n) or (n,).
        last: Its slope at the end, (k, n) or (n,).
    """
    bow = rise - first
    cube = (last - rise) - bow
    high = share * cube
    low = bow - cube + high
    return share * (first + share * low), first + share * (2.0 * low + high)


def smooth_slopes(knots: Floats, values: Floats) -> Floats:
    """Return the slopes of the cubic spline with continuous second derivative, (n,).

    The ends are parabolic: the slope of the outer stretch is the mean of its two slopes.
    """
    steps = np.diff(knots)
    rates = np.diff(values) / steps
    if len(rates) == 1:
        return np.repeat(rates, 2)
    bands = np.ones((3, len(knots)))
    bands[0, 2:], bands[2, :-2] = steps[:-1], steps[1:]
    bands[1, 1:-1] = 2.0 * (steps[:-1] + steps[1:])
    right = np.empty(len(knots))
    right[0], right[-1] = 2.0 * rates[0], 2.0 * rates[-1]
    right[1:-1] = 3.0 * (steps[1:] * rates[:-1] + steps[:-1] * rates[1:])
    return np.asarray(solve_banded((1, 1), bands, right))


def monotone_slopes(knots: Floats, values: Floats) -> Floats:
    """Return slopes without overshoot, zero at both ends, (n, k) or (n,) (PCHIP)."""
    slopes = np.zeros_like(values)
    if len(knots) < 3:
        return slopes
    steps = np.diff(knots).reshape(-1, *([1] * (values.ndim - 1)))
    rates = np.diff(values, axis=0) / steps
    left, right = rates[:-1], rates[1:]
    one, two = 2.0 * steps[1:] + steps[:-1], steps[1:] + 2.0 * steps[:-1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = (one + two) / (one / left + two / right)
    slopes[1:-1] = np.where(left * right > 0.0, mean, 0.0)
    return slopes


def even_slopes(knots: Floats, values: Floats) -> Floats:
    """Return slopes of parabolas through three values each, zero where they stand, (n, k)."""
    steps = np.diff(knots)[:, None]
    rates = np.diff(values, axis=0) / steps
    slopes = np.concatenate([rates[:1], rates])
    slopes[1:-1] = (steps[1:] * rates[:-1] + steps[:-1] * rates[1:]) / (steps[1:] + steps[:-1])
    still = (np.abs(rates) < _STILL).all(axis=1)
    slopes[:-1][still] = slopes[1:][still] = 0.0
    return slopes


def forward_slopes(slopes: Floats, rates: Floats) -> Floats:
    """Return slopes limited so that a Hermite curve through rising values never falls, (n,).

    Args:
        slopes: Wanted slopes at the knots, (n,).
        rates: Rates of the stretches between knots, (n - 1,), >= 0.

    References:
        F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980): slopes up to
        three times the rates beside them keep a cubic monotone.
    """
    padded = np.concatenate([rates[:1], rates, rates[-1:]])
    return np.clip(slopes, 0.0, 3.0 * np.minimum(padded[:-1], padded[1:]))


def eased(share: Floats) -> Floats:
    """Return u^3 (10 - 15 u + 6 u^2): 0 to 1, both derivatives zero at both ends."""
    share = np.clip(share, 0.0, 1.0)
    return share**3 * (10.0 + share * (6.0 * share - 15.0))


def eased_rate(share: Floats) -> Floats:
    """Return the derivative of `eased`: 30 u^2 (1 - u)^2 between 0 and 1, else 0."""
    share = np.clip(share, 0.0, 1.0)
    return 30.0 * (share * (1.0 - share)) ** 2


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
