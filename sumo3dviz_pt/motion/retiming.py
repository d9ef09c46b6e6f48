"""Change when a recorded ride comes by, or how fast it is; its path stays as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.model.trajectory import MotionPiece, Trajectory

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
