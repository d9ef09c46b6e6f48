"""Headings that a body can have: near the logged angles, and turned only as it drives.

A move that is short for its width, or a path that is only guessed, would turn a body far off the
angle that the log has. SUMO's vehicles change lanes without turning at all, so a body that does
not turn so far is the nearer to the truth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.resting import resting
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


class Leeway(NamedTuple):
    """How far headings may be from the logged angles at n times.

    Attributes:
        logged: Logged yaws, unwrapped, (n,) [rad].
        free: Headings this near to them stay as they are, (n,) [rad].
        most: No heading is farther from them, (n,) [rad].
    """

    logged: Floats
    free: Floats
    most: Floats


def leeway(
    times: Floats, yaws: Floats, samples: LoggedSamples, *, loose: Floats | float = 1.0
) -> Leeway:
    """Return how far headings may be from the logged angles.

    Args:
        times: Within the samples, (n,) [s].
        yaws: Headings, (n,) [rad].
        samples: What is logged.
        loose: From 0, where bodies rest, to 1, where they drive, (n,).
    """
    step = np.searchsorted(samples.times[1:-1], times, side="right")
    turned = np.diff(samples.yaws)[step]
    share = (times - samples.times[step]) / np.diff(samples.times)[step]
    # Between two samples a turn is not as even as a straight line between their angles; but a
    # path that misses the angle of a sample says nothing about the turn.
    missed = np.interp(samples.times, times, np.unwrap(yaws)) - samples.yaws
    found = np.abs(wrapped(missed)) < _MOST
    bow = _BETWEEN * share * (1.0 - share) * np.maximum(np.abs(turned) - STEADY, 0.0)
    bow *= (found[1:] & found[:-1])[step]
    free = bow + _FREE_AT_REST + loose * (_FREE - _FREE_AT_REST)
    most = bow + _MOST_AT_REST + loose * (_MOST - _MOST_AT_REST)
    return Leeway(samples.yaws[step] + share * turned, free, most)


def aligned(yaws: Floats, near: Leeway) -> Floats:
    """Return headings turned towards the logged angles as far as needed; unwrapped, (n,) [rad]."""
    away = wrapped(yaws - near.logged)
    room = near.most - near.free
    soft = near.free + room * np.tanh(np.maximum(np.abs(away) - near.free, 0.0) / room)
    return np.asarray(near.logged + np.sign(away) * np.minimum(np.abs(away), soft))


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


def room_on_the_spot(times: Floats, samples: LoggedSamples) -> Floats:
    """Return how much somebody who needs no way could have turned until each time, (n,) [rad].

    Who rests turns before the rest, and in its first step.

    Args:
        times: Within the samples, (n,) [s].
        samples: What is logged.
    """
    rest = resting(samples)
    rest[1:] &= rest[:-1].copy()
    step = np.searchsorted(samples.times[1:-1], times[:-1] + 1e-9, side="right")
    room = np.where(rest[step], 0.0, FASTEST_TURN * np.diff(times))
    return np.concatenate([[0.0], np.cumsum(room)])


def calmed(room: Floats, yaws: Floats, near: Leeway | None = None) -> Floats:
    """Return the same turns, nowhere by more than there is room for, (n,) [rad].

    The result is the middle between the lowest and the highest curve of that slope that bound
    the yaws, or what is nearest to it within the leeway. Where all turns have room, they stay
    as they are.

    Args:
        room: How much could have been turned by then, never falling, (n,) [rad].
        yaws: Unwrapped, (n,) [rad].
        near: How far from the logged angles they may be; None is anywhere.
    """
    if (np.abs(np.diff(yaws)) <= np.diff(room)).all():
        return yaws
    calm = (_below(room, yaws) - _below(room, -yaws)) / 2.0
    if near is not None:
        high = _below(room, near.logged + near.most)
        low = -_below(room, near.most - near.logged)
        calm = np.where(low > high, (low + high) / 2.0, np.clip(calm, low, high))
    # The first yaw stays, because the body already stands like that.
    first = room - room[0]
    return np.clip(calm, yaws[0] - first, yaws[0] + first)


def _below(room: Floats, values: Floats) -> Floats:
    """Return the highest curve below values that rises and falls no faster than room, (n,)."""
    return np.minimum(
        np.minimum.accumulate(values - room) + room,
        np.minimum.accumulate((values + room)[::-1])[::-1] - room,
    )
