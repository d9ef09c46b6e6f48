"""Measures of sampled motion: how fast, how hard, how suddenly.

Each takes motion at uniform times and gives one value for each time, in the horizontal
plane. The value is NaN where a neighbour is missing that the formula needs, so nothing
is ever measured across a gap. With the step h and positions p:

* velocity (p[i+1] - p[i-1]) / 2h, acceleration (p[i+1] - 2 p[i] + p[i-1]) / h^2 and
  jerk (p[i+2] - 2 p[i+1] + 2 p[i-1] - p[i-2]) / 2h^3 are central differences of second
  order (Fornberg, "Generation of finite difference formulas on arbitrarily spaced grids",
  Mathematics of Computation 51, 1988, table 1);
* jumps and heading rates are differences between one frame and the next, as films show
  them: a central difference would hide half of a leap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.trajectory import Motion
from sumo3dviz_pt.motion.headings import REAR_AXLE
from sumo3dviz_pt.motion.samples import wrapped

JUMP_FACTOR = 1.5
"""A frame may move by this many times the logged speed x time ..."""

JUMP_SLACK = 0.02
"""... and by two centimetres: SUMO rounds to one [m]."""

_SLOW = 0.3
"""Slower than this the velocity's direction is noise; the heading is used instead [m/s]."""

_CHUNK = 32
"""Number of places that are measured together; they lie on a short stretch of road."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionMeasures:
    """What motion does at n times; NaN where unknown.

    Attributes:
        speeds: Of the front, (n,) [m/s], >= 0.
        accelerations: Change of speed along the path, (n,) [m/s2]; braking is negative.
        sideways: Acceleration across the path, to the left, (n,) [m/s2].
        jerks: Size of the change of acceleration, (n,) [m/s3], >= 0.
        heading_rates: To the next frame, counter-clockwise, (n,) [rad/s].
        crabs: Sideways speed of the rear axle, to the left, (n,) [m/s]; 0 for real tyres.
        jumps: Distance to the next frame, (n,) [m], >= 0.
    """

    speeds: Floats
    accelerations: Floats
    sideways: Floats
    jerks: Floats
    heading_rates: Floats
    crabs: Floats
    jumps: Floats


@dataclass(frozen=True, slots=True)
class Peak:
    """A largest value.

    Attributes:
        value: The value with its sign.
        time: Its time [s].
    """

    value: float
    time: float


def measure(motion: Motion, *, step: float, length: float) -> MotionMeasures:
    """Return all measures of motion at uniform times.

    Args:
        motion: Motion at n times that are `step` apart.
        step: Time between them [s], > 0.
        length: Length of the body [m].
    """
    places, yaws = motion.positions[:, :2], motion.yaws
    moving = velocities(places, step=step)
    along, across = accelerations(places, yaws, step=step)
    return MotionMeasures(
        np.asarray(np.linalg.norm(moving, axis=1)),
        along,
        across,
        jerks(places, step=step),
        heading_rates(yaws, step=step),
        crabs(places, yaws, step=step, axle=REAR_AXLE * length),
        jumps(places),
    )


def velocities(places: Floats, *, step: float) -> Floats:
    """Return central differences of places, (n, 2) [m] to (n, 2) [m/s]."""
    found = np.full(places.shape, np.nan)
    found[1:-1] = (places[2:] - places[:-2]) / (2.0 * step)
    return found


def accelerations(places: Floats, yaws: Floats, *, step: float) -> tuple[Floats, Floats]:
    """Return the acceleration along and across the path, (n,) [m/s2] each.

    Along is the direction of the velocity, or that of the heading where it hardly moves.

    Args:
        places: (n, 2) [m].
        yaws: (n,) [rad].
        step: Time between them [s].
    """
    found = np.full(places.shape, np.nan)
    found[1:-1] = (places[2:] - 2.0 * places[1:-1] + places[:-2]) / step**2
    moving = velocities(places, step=step)
    speeds = np.linalg.norm(moving, axis=1)
    heading = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    with np.errstate(invalid="ignore"):
        along = np.where(
            (speeds < _SLOW)[:, None], heading, moving / np.maximum(speeds, 1e-12)[:, None]
        )
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    return np.asarray((found * along).sum(axis=1)), np.asarray((found * across).sum(axis=1))


def jerks(places: Floats, *, step: float) -> Floats:
    """Return the size of the third derivative of places, (n, 2) [m] to (n,) [m/s3]."""
    found = np.full(len(places), np.nan)
    if len(places) >= 5:
        third = places[4:] - 2.0 * places[3:-1] + 2.0 * places[1:-3] - places[:-4]
        found[2:-2] = np.linalg.norm(third, axis=1) / (2.0 * step**3)
    return found


def heading_rates(yaws: Floats, *, step: float) -> Floats:
    """Return the turn to the next frame, the shorter way round, (n,) [rad] to (n,) [rad/s]."""
    found = np.full(yaws.shape, np.nan)
    found[:-1] = wrapped(np.diff(yaws)) / step
    return found


def crabs(places: Floats, yaws: Floats, *, step: float, axle: float) -> Floats:
    """Return the speed of the rear axle across the body, (n,) [m/s].

    Args:
        places: Positions of the front, (n, 2) [m].
        yaws: (n,) [rad].
        step: Time between them [s].
        axle: Distance of the axle behind the front [m].
    """
    heading = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    moving = velocities(places - axle * heading, step=step)
    return np.asarray(moving[:, 1] * heading[:, 0] - moving[:, 0] * heading[:, 1])


def jumps(places: Floats) -> Floats:
    """Return the distance to the next frame, (n, 2) [m] to (n,) [m]."""
    found = np.full(len(places), np.nan)
    found[:-1] = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return found


def excess(jumped: Floats, speeds: Floats, *, step: float) -> Floats:
    """Return how much further frames jump than 1.5 x logged speed x step + 2 cm, (n,) [m].

    Args:
        jumped: Distances from `jumps`, (n,) [m].
        speeds: The larger logged speed of the samples around each frame, (n,) [m/s].
        step: Time between the frames [s].
    """
    return np.asarray(jumped - (JUMP_FACTOR * speeds * step + JUMP_SLACK))


def largest(values: Floats, times: Floats, *, count: int = 1, apart: float = 1.0) -> list[Peak]:
    """Return the largest values by size, each as one peak.

    Args:
        values: (n,), may hold NaN.
        times: (n,) [s].
        count: Largest number of peaks.
        apart: Values nearer than this to a larger peak belong to it [s].
    """
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    found: list[Peak] = []
    while len(found) < count and sizes.size:
        best = int(np.argmax(sizes))
        if sizes[best] < 0.0:
            break
        found.append(Peak(float(values[best]), float(times[best])))
        near: Bools = np.abs(times - times[best]) < apart
        sizes[near] = -1.0
        sizes[best] = -1.0
    return found


def offsets(places: Floats, lines: Sequence[Floats]) -> Floats:
    """Return distances from the nearest of some lines, positive to its left, (n,) [m].

    Args:
        places: (n, 2) [m].
        lines: Polylines, (k, 2) [m] each, k >= 2; without any the result is NaN.
    """
    if not lines:
        return np.full(len(places), np.nan)
    starts = np.concatenate([line[:-1] for line in lines])
    along = np.concatenate([np.diff(line, axis=0) for line in lines])
    found = np.empty(len(places))
    for first in range(0, len(places), _CHUNK):
        some = places[first : first + _CHUNK]
        near = _candidates(some, starts, along)
        found[first : first + _CHUNK] = _nearest(some, starts[near], along[near])
    return found


def _candidates(places: Floats, starts: Floats, along: Floats) -> Bools:
    """Return which stretches can be the nearest of any place; the places lie together, (m,)."""
    middle = (places.min(axis=0) + places.max(axis=0)) / 2.0
    reach = float(np.linalg.norm(places - middle, axis=1).max())
    half = np.linalg.norm(along, axis=1) / 2.0
    away = np.linalg.norm(starts + along / 2.0 - middle, axis=1)
    return np.asarray(away - half <= (away + half).min() + 2.0 * reach)


def _nearest(places: Floats, starts: Floats, along: Floats) -> Floats:
    """Return signed distances from the nearest of some stretches, (n,) [m]."""
    lengths = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    units = along / lengths[:, None]
    part = places[:, None, :] - starts
    ahead = (part * units).sum(axis=2)
    left = part[:, :, 1] * units[:, 0] - part[:, :, 0] * units[:, 1]
    away = np.hypot(left, ahead - np.clip(ahead, 0.0, lengths))
    nearest = np.argmin(away, axis=1)
    rows = np.arange(len(part))
    signs = np.where(left[rows, nearest] < 0.0, -1.0, 1.0)
    return np.asarray(signs * away[rows, nearest])
