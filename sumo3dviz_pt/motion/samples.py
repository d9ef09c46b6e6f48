"""Logged samples: cut where nothing may be interpolated, averaged, and changed in time.

A trace is cut at gaps and teleports. When SUMO teleports a vehicle, either rows of the log are
missing or the vehicle jumps within one step. A step longer than speed x dt + 8 m counts as such a
jump.

The moving average of a piecewise linear function has a closed form through its integral, so a
smoothed value is known at any real time, whatever the frame rate.

A recorded ride may come by at another time, or at another pace; its path stays as it was.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.traffic import FASTEST, GAP_FACTOR, Trace
from sumo3dviz_pt.model.trajectory import MotionPiece, Remark, Trajectory

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


TELEPORT_SLACK = 8.0
"""Distance by which a vehicle's step may exceed speed x dt [m]; a change of lanes needs some."""

BACKWARD_SLACK = 2.0
"""The same for a step backward [m]: no vehicle backs up faster than the log says."""

WALKING_SLACK = 2.0
"""The same for a person [m]: SUMO puts people who wait at a stop on their places there."""

PARKING_SLACK = 15.0
"""The same for a vehicle that stands before and after [m]: parking places lie far off lanes."""

_STANDING = 0.5
"""A vehicle that is logged slower than this stands [m/s]."""

UNLIKE = 2.0
"""A step that exceeds 1.5 x logged speed x dt by more than this gets a remark [m]."""

_ACCELERATION = 5.0
"""Where no speed is logged: largest change of speed between steps [m/s2]."""


def split(trace: Trace, *, step: float) -> tuple[LoggedSamples, ...]:
    """Cut a trace into unbroken stretches.

    Args:
        trace: n >= 1 samples.
        step: Median step of the whole log [s]; 0 looks for no gaps.

    Returns:
        Stretches in time order, together all samples; yaws are unwrapped in each.
    """
    if len(trace.times) == 0:
        return ()
    cuts = np.flatnonzero(_gaps(trace, step=step) | _teleports(trace)) + 1
    bounds = [0, *cuts.tolist(), len(trace.times)]
    return tuple(_samples(trace, slice(first, last)) for first, last in pairwise(bounds))


def _samples(trace: Trace, part: slice) -> LoggedSamples:
    """Return one stretch of a trace."""
    known = len(trace.offsets) == len(trace.times)
    times = trace.times[part]
    # Some tools log backing up as a negative speed.
    return LoggedSamples(
        times,
        trace.positions[part],
        np.unwrap(trace.yaws[part]),
        trace.slopes[part],
        np.abs(trace.speeds[part]),
        trace.lanes[part],
        trace.offsets[part] if known else np.full(len(times), np.nan),
    )


def breaks(trace: Trace, *, step: float) -> tuple[Remark, ...]:
    """Return remarks on where and why a trace was cut, and on steps that its speeds do not explain.

    Arguments as in `split`.
    """
    gaps, teleports = _gaps(trace, step=step), _teleports(trace)
    excess = _excess(trace)
    remarks = []
    for number in np.flatnonzero(gaps | teleports | (excess > UNLIKE)).tolist():
        begin, end = float(trace.times[number]), float(trace.times[number + 1])
        away = trace.positions[number + 1] - trace.positions[number]
        if gaps[number]:
            remarks.append(Remark("gap", begin, end, end - begin))
        elif teleports[number]:
            remarks.append(Remark("teleport", begin, end, float(np.linalg.norm(away[:2]))))
        else:
            remarks.append(Remark("unlike the log", begin, end, float(excess[number])))
    return tuple(remarks)


def _excess(trace: Trace) -> Floats:
    """Return by how much each step exceeds 1.5 x logged speed x dt, (n - 1,) [m]."""
    lengths = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1)
    speeds = np.abs(trace.speeds)
    fastest = np.fmax(speeds[:-1], speeds[1:])
    known = np.isfinite(fastest) & ~_parked(trace)
    return np.where(known, lengths - 1.5 * fastest * np.diff(trace.times), 0.0)


def _gaps(trace: Trace, *, step: float) -> Bools:
    """Return which steps between samples lack rows, (n - 1,)."""
    steps = np.diff(trace.times)
    return steps > GAP_FACTOR * step if step > 0.0 else np.zeros(len(steps), dtype=np.bool_)


def _teleports(trace: Trace) -> Bools:
    """Return which steps between samples are longer than any drive explains, (n - 1,)."""
    steps = np.diff(trace.times)
    level = np.diff(trace.positions[:, :2], axis=0)
    lengths = np.linalg.norm(level, axis=1)
    reach = _reach(np.abs(trace.speeds), steps=steps, lengths=lengths)
    if trace.kind != "vehicle":
        return np.asarray(lengths > reach + WALKING_SLACK)
    slack = np.where(_parked(trace), PARKING_SLACK, TELEPORT_SLACK)
    ahead = level[:, 0] * np.cos(trace.yaws[:-1]) + level[:, 1] * np.sin(trace.yaws[:-1])
    thrown = ~_parked(trace) & (-ahead > 1.5 * reach + BACKWARD_SLACK)
    return np.asarray((lengths > reach + slack) | thrown)


def _parked(trace: Trace) -> Bools:
    """Return whether a vehicle's logged speeds say that it stands around each step, (n - 1,)."""
    standing = np.abs(trace.speeds) < _STANDING
    return np.asarray(standing[1:] & standing[:-1])


def _reach(speeds: Floats, *, steps: Floats, lengths: Floats) -> Floats:
    """Return how long each step may be without slack, (n - 1,) [m]."""
    logged = np.fmax(speeds[:-1], speeds[1:])
    if np.isfinite(logged).all():
        return np.asarray(logged * steps)
    # Without logged speeds, the steps before and after tell how fast it was.
    shown = lengths / steps
    around = np.full(len(steps) + 2, -np.inf)
    around[1:-1] = shown
    neighbours = np.maximum(around[:-2], around[2:])
    alone = ~np.isfinite(neighbours)
    guessed = np.where(alone, FASTEST, neighbours + _ACCELERATION * steps / 2.0)
    return np.where(np.isfinite(logged), logged, np.minimum(guessed, FASTEST)) * steps


_FINE = 0.1
"""Longest recorded time between the samples of a ride at another pace [s]: they need no lanes."""


def delayed(trace: Trace, delay: float) -> Trace:
    """Return a ride that comes by later everywhere.

    Args:
        trace: As recorded.
        delay: By how much [s].
    """
    return replace(trace, times=trace.times + delay)


def paced(
    trace: Trace, trajectory: Trajectory, *, pace: float, around: float, step: float
) -> Trace:
    """Return a ride at another pace, sampled from its continuous motion.

    At time t it is where it was at around + (t - around) pace, and `pace` times as fast.

    Args:
        trace: As recorded.
        trajectory: Its continuous motion.
        pace: Factor of its speed, above 0.
        around: The moment at which it is where it was [s].
        step: Median step of the log [s].
    """
    apart = (min(_FINE, step) if step > 0.0 else _FINE) / max(1.0, pace)
    times = np.concatenate([_moments(piece, pace, around, apart) for piece in trajectory.pieces])
    recorded = around + (times - around) * pace
    # Rounding must not leave a piece.
    motion = trajectory.sample(recorded)
    times, recorded = times[motion.alive], recorded[motion.alive]
    rows = np.clip(np.searchsorted(trace.times, recorded + 1e-9) - 1, 0, len(trace.times) - 1)
    return replace(
        trace,
        times=times,
        positions=motion.positions[motion.alive],
        yaws=motion.yaws[motion.alive],
        speeds=motion.speeds[motion.alive] * pace,
        slopes=np.interp(recorded, trace.times, trace.slopes),
        # The front may have left the lane of the sample before.
        lanes=np.full(len(times), -1, dtype=trace.lanes.dtype),
        signals=trace.signals[rows],
        offsets=np.empty(0),
    )


def _moments(piece: MotionPiece, pace: float, around: float, apart: float) -> Floats:
    """Return moments of a piece at another pace, its ends included, (n,) [s]."""
    begin, end = (around + (time - around) / pace for time in (piece.begin, piece.end))
    count = 1 + int(np.ceil((end - begin) / apart - 1e-9))
    return np.linspace(begin, end, max(count, 1))
