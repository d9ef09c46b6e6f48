"""Cut a trace where nothing may be interpolated: at gaps and teleports.

When SUMO teleports a vehicle, either rows of the log are missing or the vehicle jumps within one
step. A step longer than speed x dt + 8 m counts as such a jump.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.traffic import FASTEST, GAP_FACTOR, Trace
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.samples import LoggedSamples

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
    found = []
    for number in np.flatnonzero(gaps | teleports | (excess > UNLIKE)).tolist():
        begin, end = float(trace.times[number]), float(trace.times[number + 1])
        away = trace.positions[number + 1] - trace.positions[number]
        if gaps[number]:
            found.append(Remark("gap", begin, end, end - begin))
        elif teleports[number]:
            found.append(Remark("teleport", begin, end, float(np.linalg.norm(away[:2]))))
        else:
            found.append(Remark("unlike the log", begin, end, float(excess[number])))
    return tuple(found)


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
