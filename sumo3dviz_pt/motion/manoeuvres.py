"""What bodies do besides following their front: they stand, wiggle, back up, park.

While a road user stands, its logged places and angles may wiggle. SUMO's sublane model writes
places that go to and fro by a decimetre while the speed is zero. A body that followed them would be
driven to and fro, and would turn.

Headings stay near the logged angles, and turn only as the body drives. A move that is short for its
width, or a path that is only guessed, would turn a body far off the angle that the log has. SUMO's
vehicles change lanes without turning at all, so a body that does not turn so far is the nearer to
the truth.

A body does not follow its front where it backs up, or moves into a parking place. SUMO moves a
parking vehicle aside by up to 8 m in one step, while its logged lane and offset stay those of the
road.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.motion.samples import LoggedSamples, wrapped

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
    clear = np.abs(wrapped(missed)) < _MOST
    bow = _BETWEEN * share * (1.0 - share) * np.maximum(np.abs(turned) - STEADY, 0.0)
    bow *= (clear[1:] & clear[:-1])[step]
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


PARKING_TIME = 3.0
"""Shortest duration of a move into a parking place, if there is time [s]."""

_ASIDE = 1.5
"""A standing vehicle that moves further than this goes into or out of a parking place [m]."""

_SLIDING = 0.4
"""Steps that lead aside faster than this, and further aside than ahead, are of one move [m/s]."""

_STANDING = 0.5
"""A vehicle that is slower than this stands [m/s]."""

_CREEPING = 0.3
"""Steps that are driven slower than this do not count as driving on [m/s]."""

_STILL = 0.75
"""Samples nearer to one another than this are of one place, because queues creep [m]."""

AROUND = 8.0
"""Time before and after a change of lanes in which a vehicle may drive on [s]."""

LEAST_AHEAD = 1.5
"""A vehicle that drives less than this many times a change's width ahead is moved aside."""

_BACKING = 0.15
"""A step backward that is longer than this is real, not rounding [m]."""

_STRAIGHT = np.pi / 4.0
"""Where no lanes are known, only a vehicle that turns slower than this backs up [rad/s]."""

_LEAST_STEP = 0.2
"""A shorter step may turn as much as one of this duration [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class ManoeuvreStretch:
    """Samples of one manoeuvre, or of ordinary driving between manoeuvres.

    Attributes:
        samples: n samples, n >= 2.
        kind: `parking` or `reversing`; empty for ordinary driving.
    """

    samples: LoggedSamples
    kind: str = ""


def stretches(samples: LoggedSamples, *, kind: str) -> tuple[ManoeuvreStretch, ...]:
    """Cut samples where a manoeuvre begins or ends.

    Args:
        samples: Samples of one unbroken stretch of time, n >= 2.
        kind: Kind of the road user; only vehicles park and reverse.

    Returns:
        Stretches in order; each begins with the sample that the one before it ends with.
    """
    if kind != "vehicle":
        return (ManoeuvreStretch(samples),)
    parking, reversing = _flags(samples)
    if not (parking.any() or reversing.any()):
        return (ManoeuvreStretch(samples),)
    return tuple(_cut(samples, _ends(samples, parking, reversing)))


def _flags(samples: LoggedSamples) -> tuple[Bools, Bools]:
    """Return which steps are moves aside, and which lead backward, (n - 1,) each."""
    # Split each step into its parts ahead and aside of the vehicle.
    steps = np.diff(samples.positions[:, :2], axis=0)
    yaws = samples.yaws[:-1]
    ahead = steps[:, 0] * np.cos(yaws) + steps[:, 1] * np.sin(yaws)
    aside = np.abs(steps[:, 1] * np.cos(yaws) - steps[:, 0] * np.sin(yaws))
    # Parking in one step: a standing vehicle is moved. Its direction does not count, because a
    # vehicle that leaves a place across the road moves ahead.
    parking = (np.linalg.norm(steps, axis=1) > _ASIDE) & _slow(samples, steps)
    parking &= np.diff(samples.lanes) == 0
    # Parking in several steps: it slides aside while it hardly drives.
    times = np.diff(samples.times)
    sliding = (aside > _SLIDING * times) & (aside > np.abs(ahead))
    # A vehicle that is logged as fast as it moves aside turns a corner.
    sliding &= ~(np.fmax(samples.speeds[:-1], samples.speeds[1:]) * times > aside)
    for first, last in _stretches_of(sliding & ~parking):
        moved = float(aside[first:last].sum())
        if moved > _ASIDE and _driven_around(samples, ahead, (first, last)) < LEAST_AHEAD * moved:
            parking[first:last] = True
    # Reversing: a step leads backward, and the lanes or a steady angle confirm it.
    backward = (ahead < -_BACKING) & (aside < -ahead)
    # Where lanes are known their offsets decide: a long body in a tight turn points away from
    # its path, and lanes beside each other in a bend are not equally long.
    known = np.isfinite(samples.offsets) & (samples.lanes >= 0)
    falling = (np.diff(samples.lanes) == 0) & (np.diff(samples.offsets) < -_BACKING)
    straight = np.abs(np.diff(samples.yaws)) < _STRAIGHT * np.maximum(times, _LEAST_STEP)
    meant = np.where(known[1:] & known[:-1], falling, straight)
    return parking, backward & meant & ~parking


def _stretches_of(flags: Bools) -> list[tuple[int, int]]:
    """Return begin and end of each stretch of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def _driven_around(samples: LoggedSamples, ahead: Floats, ends: tuple[int, int]) -> float:
    """Return how far a vehicle drives on before, in and after some steps until it stands [m].

    Args:
        samples: The samples.
        ahead: Distance ahead in each step, (n - 1,) [m].
        ends: First of the steps, and the first after them.
    """
    times, rates = samples.times, ahead / np.diff(samples.times)
    first, last = ends
    low, high = first, last
    while low > 0 and rates[low - 1] > _CREEPING and times[first] - times[low - 1] <= AROUND:
        low -= 1
    while high < len(rates) and rates[high] > _CREEPING and times[high + 1] - times[last] <= AROUND:
        high += 1
    before, amid, after = (float(ahead[a:b].sum()) for a, b in ((low, first), ends, (last, high)))
    # A vehicle that stands in these steps makes the change either before or after them.
    stands = amid < _CREEPING * float(times[last] - times[first])
    return max(before, after) if stands else before + amid + after


def _slow(samples: LoggedSamples, steps: Floats) -> Bools:
    """Return whether a vehicle stands before and after each step, (n - 1,)."""
    if np.isfinite(samples.speeds).all():
        return np.asarray(np.maximum(samples.speeds[:-1], samples.speeds[1:]) < _STANDING)
    rates = np.linalg.norm(steps, axis=1) / np.diff(samples.times)
    padded = np.concatenate([[0.0], rates, [0.0]])
    return np.asarray(np.maximum(padded[:-2], padded[2:]) < _STANDING)


def _ends(
    samples: LoggedSamples, parking: Bools, reversing: Bools
) -> Iterator[tuple[int, int, str]]:
    """Yield first sample, last sample and kind of each manoeuvre, in order and disjoint."""
    last = step = 0
    while step < len(parking):
        if parking[step]:
            end = step + 1
            while end < len(parking) and parking[end]:
                end += 1
            first, end = _widened(samples, step, end, floor=last)
            yield first, end, "parking"
        elif reversing[step]:
            first, end = step, step + 1
            while end < len(reversing) and reversing[end]:
                end += 1
            yield first, end, "reversing"
        else:
            step += 1
            continue
        last = step = end


def _widened(samples: LoggedSamples, first: int, last: int, *, floor: int) -> tuple[int, int]:
    """Return samples around a move aside with enough time for it: later ones, then earlier ones."""
    times, before, after = samples.times, first, last
    while last + 1 < len(times) and times[last] - times[first] < PARKING_TIME:
        if not _same_place(samples, last + 1, after):
            break
        last += 1
    while first > floor and times[last] - times[first] < PARKING_TIME:
        if not _same_place(samples, first - 1, before):
            break
        first -= 1
    return first, last


def _same_place(samples: LoggedSamples, one: int, other: int) -> bool:
    """Whether two samples are of one place."""
    apart = samples.positions[one, :2] - samples.positions[other, :2]
    return float(np.hypot(*apart)) < _STILL


def _cut(
    samples: LoggedSamples, ends: Iterator[tuple[int, int, str]]
) -> Iterator[ManoeuvreStretch]:
    """Yield the manoeuvres, and what lies between them."""
    at = 0
    for first, last, kind in ends:
        if first > at:
            yield ManoeuvreStretch(samples.part(slice(at, first + 1)))
        # Of a move aside only the first and the last sample count.
        which = np.array([first, last]) if kind == "parking" else slice(first, last + 1)
        yield ManoeuvreStretch(samples.part(which), kind)
        at = last
    if at < len(samples.times) - 1:
        yield ManoeuvreStretch(samples.part(slice(at, None)))
