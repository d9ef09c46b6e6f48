"""Finds where a body does not follow its front: backing up, and moves aside into a parking place.

References:
    shared facts on SUMO's logs, section 3: who parks is moved aside by up to 8 m in one
    step, while lane and place stay those of the road.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.motion.samples import Samples

PARKING_TIME = 3.0
"""A move aside takes at least so long, if there is time [s]."""

_ASIDE = 1.5
"""A step further while standing is a move into or out of a parking place [m]."""

_STANDING = 0.5
"""[m/s]."""

_STILL = 0.75
"""Samples nearer to one another are of one place: queues creep [m]."""

_AROUND = 8.0
"""So long before and after a change of lanes counts whether a vehicle drives on [s]."""

_AHEAD = 1.5
"""Who drives so many times a change's width meanwhile needs no manoeuvre."""

_BACKING = 0.15
"""A step backward that is longer is meant [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Samples of one way to move.

    Attributes:
        samples: n >= 2, or n = 1 for the only sample of a piece.
        kind: Empty where the body follows its front; else `parking` or `reversing`.
    """

    samples: Samples
    kind: str = ""


def stretches(samples: Samples, *, kind: str) -> tuple[Stretch, ...]:
    """Cut samples where the way to move changes.

    Args:
        samples: Of one piece, n >= 2.
        kind: Of the road user; only vehicles park and reverse.

    Returns:
        Stretches in order; each begins with the sample that the one before it ends with.
    """
    if kind != "vehicle":
        return (Stretch(samples),)
    parking, reversing = _flags(samples)
    if not (parking.any() or reversing.any()):
        return (Stretch(samples),)
    return tuple(_cut(samples, _ends(samples, parking, reversing)))


def _flags(samples: Samples) -> tuple[Bools, Bools]:
    """Which steps are moves aside, and which lead backward, (n - 1,) each."""
    steps = np.diff(samples.positions[:, :2], axis=0)
    yaws = samples.yaws[:-1]
    ahead = steps[:, 0] * np.cos(yaws) + steps[:, 1] * np.sin(yaws)
    aside = np.abs(steps[:, 1] * np.cos(yaws) - steps[:, 0] * np.sin(yaws))
    # Out of a place across the road, the way aside is ahead.
    parking = (np.linalg.norm(steps, axis=1) > _ASIDE) & _slow(samples, steps)
    for step in np.flatnonzero(parking & (np.diff(samples.lanes) != 0)).tolist():
        parking[step] = _driven_around(samples, step, ahead) < _AHEAD * aside[step]
    straight = np.abs(np.diff(samples.yaws)) < np.pi / 4.0
    reversing = (ahead < -_BACKING) & (aside < -ahead) & straight & ~parking
    return parking, reversing


def _driven_around(samples: Samples, step: int, ahead: Floats) -> float:
    """How far a vehicle drives on around a step aside [m]."""
    near = np.abs(samples.times[:-1] - samples.times[step]) <= _AROUND
    return float(np.abs(ahead[near]).sum())


def _slow(samples: Samples, steps: Floats) -> Bools:
    """Whether a vehicle stands before and after each step, (n - 1,)."""
    if np.isfinite(samples.speeds).all():
        return np.asarray(np.maximum(samples.speeds[:-1], samples.speeds[1:]) < _STANDING)
    rates = np.linalg.norm(steps, axis=1) / np.diff(samples.times)
    padded = np.concatenate([[0.0], rates, [0.0]])
    return np.asarray(np.maximum(padded[:-2], padded[2:]) < _STANDING)


def _ends(samples: Samples, parking: Bools, reversing: Bools) -> Iterator[tuple[int, int, str]]:
    """First and last sample of every manoeuvre, in order and disjoint."""
    last = step = 0
    while step < len(parking):
        if parking[step]:
            first, end = _widened(samples, step, floor=last)
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


def _widened(samples: Samples, step: int, *, floor: int) -> tuple[int, int]:
    """Samples around a move aside between which there is time for it: after it, then before."""
    times, first, last = samples.times, step, step + 1
    while last + 1 < len(times) and times[last] - times[first] < PARKING_TIME:
        if not _same_place(samples, last + 1, step + 1):
            break
        last += 1
    while first > floor and times[last] - times[first] < PARKING_TIME:
        if not _same_place(samples, first - 1, step):
            break
        first -= 1
    return first, last


def _same_place(samples: Samples, one: int, other: int) -> bool:
    """Whether two samples are of one place."""
    apart = samples.positions[one, :2] - samples.positions[other, :2]
    return float(np.hypot(*apart)) < _STILL


def _cut(samples: Samples, ends: Iterator[tuple[int, int, str]]) -> Iterator[Stretch]:
    """Manoeuvres and what lies between them."""
    at = 0
    for first, last, kind in ends:
        if first > at:
            yield Stretch(samples.part(slice(at, first + 1)))
        # While standing for a move aside only its ends count.
        which = np.array([first, last]) if kind == "parking" else slice(first, last + 1)
        yield Stretch(samples.part(which), kind)
        at = last
    if at < len(samples.times) - 1:
        yield Stretch(samples.part(slice(at, None)))
