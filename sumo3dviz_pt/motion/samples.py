"""Logged samples of one unbroken stretch of time, and their moving averages.

The moving average of a piecewise linear function has a closed form through its integral, so a
smoothed value is known at any real time, whatever the frame rate.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats, Ints

Places = NDArray[np.intp]
"""Indices into an array."""


@dataclass(frozen=True, slots=True, eq=False)
class LoggedSamples:
    """One unbroken stretch of logged samples.

    Attributes:
        times: Strictly increasing, (n,) [s], n >= 1.
        positions: Middle of the front bumper, (n, 3) [m].
        yaws: Counter-clockwise from east, unwrapped, (n,) [rad].
        slopes: Nose up, (n,) [rad].
        speeds: (n,) [m/s]; NaN where the log has none.
        lanes: Index into the log's lane names, (n,); -1 where the log has none.
        offsets: Position along the lane, (n,) [m]; NaN where the log has none.
    """

    times: Floats
    positions: Floats
    yaws: Floats
    slopes: Floats
    speeds: Floats
    lanes: Ints
    offsets: Floats

    def part(self, which: slice | Ints) -> LoggedSamples:
        """Return some of the samples, in their order."""
        return LoggedSamples(*(getattr(self, item.name)[which] for item in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseLinear:
    """A piecewise linear function of time and its integral.

    Attributes:
        knots: Strictly increasing, (n,) [s], n >= 2.
        values: At the knots, (n, k).
        rates: Change per second of each stretch between knots, (n - 1, k).
        integrals: Integrals from the first knot to each knot, (n, k).
    """

    knots: Floats
    values: Floats
    rates: Floats
    integrals: Floats

    @classmethod
    def through(cls, knots: Floats, values: Floats) -> PiecewiseLinear:
        """Join values, (n, k), at knots, (n,) [s], by straight lines."""
        steps = np.diff(knots)[:, None]
        areas = np.cumsum(steps * (values[1:] + values[:-1]) / 2.0, axis=0)
        return cls(
            knots,
            values,
            np.diff(values, axis=0) / steps,
            np.concatenate([np.zeros((1, values.shape[1])), areas]),
        )

    def average(self, times: Floats, *, half_width: float) -> tuple[Floats, Floats]:
        """Return the centred moving average and its derivative.

        The window shrinks symmetrically towards the ends, where it vanishes. So the first and
        the last value are exact, and the average never changes faster than the function itself.

        Args:
            times: Times within the knots, (m,) [s].
            half_width: Half the window [s].

        Returns:
            Averages, (m, k), and their derivatives, (m, k) [1/s].
        """
        before, after = times - self.knots[0], self.knots[-1] - times
        half = np.minimum(half_width, np.minimum(before, after))
        low, high = self._stretch(times - half), self._stretch(times + half)
        value_low, area_low = self._value_and_area(times - half, low)
        value_high, area_high = self._value_and_area(times + half, high)
        # Within one stretch the average is the middle value; no vanishing width divides it.
        straight = ((low == high) | (half < 1e-9))[:, None]
        width = np.where(straight, 1.0, 2.0 * half[:, None])
        averages = np.where(
            straight, (value_low + value_high) / 2.0, (area_high - area_low) / width
        )
        rates = (value_high - value_low) / width
        if (half < half_width).any():
            # Where the window grows or shrinks with time, its far end moves twice as fast.
            opening = ((before < half_width) & (before < after))[:, None]
            rates = np.where(opening, 2.0 * (value_high - averages) / width, rates)
            closing = ((after < half_width) & (after <= before))[:, None]
            rates = np.where(closing, 2.0 * (averages - value_low) / width, rates)
        return averages, np.where(straight, self.rates[low], rates)

    def _stretch(self, times: Floats) -> Places:
        """Return the number of the stretch in which each time lies, (m,)."""
        return np.searchsorted(self.knots[1:-1], times, side="right")

    def _value_and_area(self, times: Floats, stretch: Places) -> tuple[Floats, Floats]:
        """Return values and integrals from the first knot, (m, k) each."""
        since = (times - self.knots[stretch])[:, None]
        start, rate = self.values[stretch], self.rates[stretch]
        values = start + rate * since
        return values, self.integrals[stretch] + since * (start + values) / 2.0


def absolute_times(begin: float, end: float, *, step: float) -> Floats:
    """Return both ends of a time span and the multiples of `step` between them, (n,) [s].

    As the times between are absolute, moving the beginning or the end moves none of them.

    Args:
        begin: First time [s].
        end: Last time [s].
        step: Time between the others [s].
    """
    inner = np.arange(np.ceil(begin / step), np.floor(end / step) + 1.0) * step
    inner = inner[(inner > begin + 1e-6) & (inner < end - 1e-6)]
    return np.concatenate([[begin], inner, [end]])


def wrapped(angles: Floats) -> Floats:
    """Return the same angles in [-pi, pi), any shape [rad]."""
    return np.mod(angles + np.pi, 2.0 * np.pi) - np.pi


def nearest_turn(angles: Floats, reference: Floats) -> Floats:
    """Return angles plus the multiples of 2 pi that bring them nearest a reference [rad]."""
    return reference + wrapped(angles - reference)
