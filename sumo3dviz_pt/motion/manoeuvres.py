"""Find where a body does not follow its front: backing up, and moves into a parking place.

SUMO moves a parking vehicle aside by up to 8 m in one step, while its logged lane and offset stay
those of the road.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.motion.samples import LoggedSamples

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
    told = np.isfinite(samples.offsets) & (samples.lanes >= 0)
    falling = (np.diff(samples.lanes) == 0) & (np.diff(samples.offsets) < -_BACKING)
    straight = np.abs(np.diff(samples.yaws)) < _STRAIGHT * np.maximum(times, _LEAST_STEP)
    meant = np.where(told[1:] & told[:-1], falling, straight)
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
