"""Headings that a body can have: near the logged angles, and turned only as it drives.

A move that is short for its width, or a path that is only guessed, would turn a body far off the
angle that the log has. SUMO's vehicles change lanes without turning at all, so a body that does
not turn so far is the nearer to the truth.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.samples import LoggedSamples, wrapped

FASTEST_TURN = np.radians(130.0)
"""Fastest turn of a body [rad/s]; the corners of a lane can turn faster."""

TIGHTEST = 1.6
"""No vehicle turns tighter than on this radius [m]: SUMO's turnarounds at dead ends."""

STEADY = np.radians(5.0)
"""Where logged angles differ by no more than this, the log turns a body nowhere [rad]."""

_FREE, _FREE_AT_REST = np.radians(10.0), np.radians(3.0)
"""Headings this near to the logged angle stay as they are [rad]."""

_MOST, _MOST_AT_REST = np.radians(17.0), np.radians(6.0)
"""No heading is farther from the logged angle where that is steady [rad]."""

_BETWEEN = 3.0
"""How much of a turn between two samples the heading may differ by half-way, times four."""


def aligned(
    times: Floats, yaws: Floats, samples: LoggedSamples, *, loose: Floats | float = 1.0
) -> Floats:
    """Return headings turned towards the logged angles as far as needed; unwrapped, (n,) [rad].

    Args:
        times: Within the samples, (n,) [s].
        yaws: Headings, (n,) [rad].
        samples: What is logged.
        loose: From 0, where bodies rest, to 1, where they drive, (n,).
    """
    step = np.searchsorted(samples.times[1:-1], times, side="right")
    turned = np.diff(samples.yaws)[step]
    share = (times - samples.times[step]) / np.diff(samples.times)[step]
    logged = samples.yaws[step] + share * turned
    # Between two samples a turn is not as even as a straight line between their angles.
    bow = _BETWEEN * share * (1.0 - share) * np.maximum(np.abs(turned) - STEADY, 0.0)
    free = bow + _FREE_AT_REST + loose * (_FREE - _FREE_AT_REST)
    room = _MOST_AT_REST - _FREE_AT_REST + loose * (_MOST - _MOST_AT_REST - _FREE + _FREE_AT_REST)
    away = wrapped(yaws - logged)
    size = np.abs(away)
    soft = free + room * np.tanh(np.maximum(size - free, 0.0) / room)
    return np.asarray(logged + np.sign(away) * np.minimum(size, soft))


def sharpest(length: float) -> float:
    """Return how much a body may turn for each metre that its front drives [rad/m].

    Both ends of a chord of length L on a path turn it by at most 2 / L; on a turnaround of
    radius R the chord is no longer than 2 R.

    Args:
        length: Length over which the body follows its front [m].
    """
    return 2.0 / min(length, 2.0 * TIGHTEST)


def turning_room(times: Floats, travelled: Floats, length: float) -> Floats:
    """Return how much a body could have turned until each time, never falling, (n,) [rad].

    Args:
        times: (n,) [s].
        travelled: Distance travelled by then, (n,) [m].
        length: Length over which the body follows its front [m].
    """
    by_way = sharpest(length) * np.maximum(np.diff(travelled), 0.0)
    room = np.minimum(by_way, FASTEST_TURN * np.diff(times))
    return np.concatenate([[0.0], np.cumsum(room)])


def calmed(room: Floats, yaws: Floats) -> Floats:
    """Return the same turns, nowhere by more than there is room for, (n,) [rad].

    The result is the middle between the lowest and the highest curve of that slope that bound
    the yaws. Where all turns have room, they stay as they are.

    Args:
        room: How much could have been turned by then, never falling, (n,) [rad].
        yaws: Unwrapped, (n,) [rad].
    """
    if (np.abs(np.diff(yaws)) <= np.diff(room)).all():
        return yaws
    low = np.minimum(
        np.minimum.accumulate(yaws - room) + room,
        np.minimum.accumulate((yaws + room)[::-1])[::-1] - room,
    )
    high = np.maximum(
        np.maximum.accumulate(yaws + room) - room,
        np.maximum.accumulate((yaws - room)[::-1])[::-1] + room,
    )
    # The first yaw stays, because the body already stands like that.
    return np.clip((low + high) / 2.0, yaws[0] - room + room[0], yaws[0] + room - room[0])
