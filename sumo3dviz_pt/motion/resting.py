"""Standing road users, whose logged places and angles may wiggle though they do not move.

SUMO's sublane model writes places that go to and fro by a decimetre while the speed is zero. A
body that followed them would be driven to and fro, and would turn.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Bools
from sumo3dviz_pt.motion.samples import LoggedSamples

_RESTING = 1e-9
"""A road user that is logged no faster than this rests [m/s]; logs say 0.00."""

_WIGGLE, _TWIST = 0.25, np.radians(5.0)
"""Rows of one rest differ by no more than this from its first [m, rad]."""

_ROUNDING = 0.025
"""Offsets along a lane that differ by less than this are of one place [m]."""

_FORGOTTEN = 5.0
"""Way over which a road user returns from where it rested to where it is logged [m]."""


def settled(samples: LoggedSamples) -> LoggedSamples:
    """Return samples that stand still wherever the road user rests.

    All rows of a rest become as its first one. What that takes away is given back over the next
    metres of way, so that no step becomes longer.
    """
    samples = _unmoved(samples)
    rest = np.nan_to_num(samples.speeds, nan=np.inf) <= _RESTING
    both = rest[1:] & rest[:-1]
    apart = np.diff(samples.positions, axis=0)
    moved = (apart != 0.0).any(axis=1) | (np.diff(samples.yaws) != 0.0)
    if not (both & moved).any():
        return samples
    rows = np.arange(len(rest))
    positions, offsets = samples.positions.copy(), samples.offsets.copy()
    ahead = np.column_stack([np.cos(samples.yaws), np.sin(samples.yaws)])
    lengths = np.hypot(apart[:, 0], apart[:, 1])
    shift, way = np.zeros(3), np.inf
    for row in rows[1:].tolist():
        if way >= _FORGOTTEN and not rest[row - 1]:
            continue
        first = int(rows[row - 1])
        away = samples.positions[row] - samples.positions[first]
        twist = abs(samples.yaws[row] - samples.yaws[first])
        stays = rest[row - 1] and (rest[row] or lengths[row - 1] == 0.0)
        if stays and np.hypot(*away[:2]) <= _WIGGLE and twist <= _TWIST:
            rows[row], positions[row], offsets[row] = first, positions[first], offsets[first]
            continue
        if first < row - 1:
            shift, way = positions[row - 1] - samples.positions[row - 1], 0.0
        way += float(lengths[row - 1])
        back = shift * max(1.0 - way / _FORGOTTEN, 0.0)
        positions[row] += back
        offsets[row] += back[:2] @ ahead[row]
    still, times, speeds = samples.part(rows), samples.times, samples.speeds
    return replace(still, times=times, speeds=speeds, positions=positions, offsets=offsets)


def _unmoved(samples: LoggedSamples) -> LoggedSamples:
    """Return samples whose offsets along lanes stay where their places do, despite rounding."""
    moved = (np.diff(samples.positions, axis=0) != 0.0).any(axis=1) | (np.diff(samples.lanes) != 0)
    first = np.concatenate([[0], np.where(moved, np.arange(1, len(moved) + 1), 0)])
    held = samples.offsets[np.maximum.accumulate(first)]
    return replace(
        samples,
        offsets=np.where(np.abs(samples.offsets - held) < _ROUNDING, held, samples.offsets),
    )


def resting(samples: LoggedSamples) -> Bools:
    """Return in which steps between samples a road user rests, (n - 1,)."""
    still = settled(samples)
    moved = np.abs(np.diff(still.positions, axis=0)).max(axis=1)
    return np.asarray((moved < 1e-9) & (np.abs(np.diff(still.yaws)) < 1e-9))
