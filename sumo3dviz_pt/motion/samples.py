"""What a smoother is given and the two values that every smoother needs.

A piece of a trace becomes `LoggedSamples`; moving averages of their piecewise linear
interpolation have a closed form through its antiderivative, so that a smoothed
value can be asked at any real time, whatever the frame rate.
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
        offsets: Place along the lane, (n,) [m]; NaN where the log has none.
    """

    times: Floats
    positions: Floats
    yaws: Floats
    slopes: Floats
    speeds: Floats
    lanes: Ints
    offsets: Floats

    def part(self, which: slice | Ints) -> LoggedSamples:
        """Some of the samples, in their order."""
        return LoggedSamples(*(getattr(self, item.name)[which] for item in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseLinear:
    """A piecewise linear function of time and its integral.

    Attributes:
        knots: Strictly increasing, (n,) [s], n >= 2.
        values: At the knots, (n, k).
        rates: Of each stretch, (n - 1, k).
        integrals: From the first knot to each knot, (n, k).
    """

    knots: Floats
    values: Floats
    rates: Floats
    integrals: Floats

    @classmethod
    def through(cls, knots: Floats, values: Floats) -> PiecewiseLinear:
        """Join points, (n,) [s] and (n, k), by straight lines."""
        steps = np.diff(knots)[:, None]
        areas = np.cumsum(steps * (values[1:] + values[:-1]) / 2.0, axis=0)
        return cls(
            knots,
            values,
            np.diff(values, axis=0) / steps,
            np.concatenate([np.zeros((1, values.shape[1])), areas]),
        )

    def average(self, times: Floats, *, half_width: float) -> tuple[Floats, Floats]:
        """Centred moving average and its derivative.

        The window shrinks symmetrically towards the ends, where it vanishes, so that the
        first and the last value are exact and the average never runs faster than the
        function itself.

        Args:
            times: Within the knots, (m,) [s].
            half_width: Half the window [s].

        Returns:
            Averages, (m, k), and their derivatives, (m, k) [1/s].
        """
        before, after = times - self.knots[0], self.knots[-1] - times
        half = np.minimum(half_width, np.minimum(before, after))
        low, high = self._stretch(times - half), self._stretch(times + half)
        value_low, area_low = self._value_and_area(times - half, low)
        value_high, area_high = self._value_and_area(times + half, high)
        # Within one stretch the average is the middle, without dividing by a vanishing width.
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
        """Number of the stretch in which each time lies, (m,)."""
        return np.searchsorted(self.knots[1:-1], times, side="right")

    def _value_and_area(self, times: Floats, stretch: Places) -> tuple[Floats, Floats]:
        """Value and integral from the first knot, (m, k) each."""
        since = (times - self.knots[stretch])[:, None]
        start, rate = self.values[stretch], self.rates[stretch]
        values = start + rate * since
        return values, self.integrals[stretch] + since * (start + values) / 2.0


def wrapped(angles: Floats) -> Floats:
    """The same angles in [-pi, pi), any shape [rad]."""
    return np.mod(angles + np.pi, 2.0 * np.pi) - np.pi


def nearest_turn(angles: Floats, reference: Floats) -> Floats:
    """The same angles, on the turn of 2 pi that is nearest to a reference [rad]."""
    return reference + wrapped(angles - reference)
