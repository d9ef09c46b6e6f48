"""The path that a front has driven: points by time and by distance, also from before the log.

SUMO's angle is the direction of the chord from the rear to the front, so the point
front - length x direction lies on the driven path. That tells where the path lay before the
first sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.curves import Hermite, even_slopes
from sumo3dviz_pt.motion.samples import LoggedSamples, absolute_times
from sumo3dviz_pt.motion.smoothers.front import Front

STEP = 0.1
"""Travelled distances are known at multiples of this time [s]."""

_STILL = 1e-3
"""Samples nearer to one another than this are of one place [m]."""

_APART = 0.05
"""Smallest distance between points of the path before the first sample [m]."""

_SLACK = 0.15
"""Largest share by which the distance along that path may differ from the straight distance."""


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """The path that a front has driven.

    Attributes:
        front: The motion of the front.
        places: Positions of the front at n knots, over time, (n, 3) [m].
        travelled: Level distance travelled since the beginning, never falling, (n,) [m].
        past: Points of the path up to the beginning, (p, 3) [m], p >= 2.
        past_travelled: Distances of those points, strictly rising to 0, (p,) [m].
    """

    front: Front
    places: Hermite
    travelled: Floats
    past: Floats
    past_travelled: Floats

    @classmethod
    def of(cls, front: Front, samples: LoggedSamples, *, length: float, yaw: float) -> Driven:
        """Follow a front.

        Args:
            front: The motion of the front.
            samples: The samples that it was made of.
            length: Length of the body [m].
            yaw: Yaw of the body at the beginning [rad].
        """
        knots = _moving(absolute_times(front.begin, front.end, step=STEP), samples)
        places = front.at(knots).positions
        steps = np.diff(places[:, :2], axis=0)
        travelled = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
        curve = Hermite(knots, places, even_slopes(knots, places))
        past, past_travelled = _past(
            samples, curve, np.interp(samples.times, knots, travelled), length, yaw
        )
        return cls(front, curve, travelled, past, past_travelled)

    @property
    def knots(self) -> Floats:
        """Times at which the travelled distance is known, (n,) [s]."""
        return self.places.knots

    def travelled_at(self, times: Floats, places: Floats) -> Floats:
        """Return the distance travelled at times, (n,) [m]; `places` are the front's, (n, 3)."""
        index = np.searchsorted(self.knots, times, side="right") - 1
        index = np.clip(index, 0, len(self.knots) - 1)
        away = places[:, :2] - self.places.values[index, :2]
        return np.asarray(self.travelled[index] + np.hypot(away[:, 0], away[:, 1]))

    def points_at(self, travelled: Floats) -> Floats:
        """Return points of the path, (n, 3) [m], by distance travelled, (n,) [m], also negative."""
        points = np.empty((len(travelled), 3))
        driven = travelled > 0.0
        if driven.any():
            # Strictly rising, so that a standstill is one point.
            rising = self.travelled + 1e-9 * np.arange(len(self.travelled))
            times = np.interp(travelled[driven], rising, self.knots)
            points[driven] = self.places.at(times)[0]
        if not driven.all():
            points[~driven] = self._before(travelled[~driven])
        return points

    def _before(self, travelled: Floats) -> Floats:
        """Return points of the path before the beginning; what is not known is straight."""
        points = np.stack(
            [np.interp(travelled, self.past_travelled, axis) for axis in self.past.T], axis=1
        )
        beyond = np.minimum(travelled - self.past_travelled[0], 0.0)
        step = (self.past[1] - self.past[0]) / (self.past_travelled[1] - self.past_travelled[0])
        return np.asarray(points + beyond[:, None] * step)


def _moving(knots: Floats, samples: LoggedSamples) -> Floats:
    """Return the knots without those while the road user stands, as much of a city does.

    A stop may be reached within the step after the one that logs it.
    """
    steps = np.abs(np.diff(samples.positions, axis=0)).max(axis=1) > _STILL
    steps[1:] |= steps[:-1].copy()
    index = np.searchsorted(samples.times[1:-1], knots, side="right")
    kept = steps[index]
    kept[[0, -1]] = True
    return np.union1d(knots[kept], samples.times[1:-1][steps[1:] != steps[:-1]])


def _past(
    samples: LoggedSamples, shown: Hermite, travelled: Floats, length: float, yaw: float
) -> tuple[Floats, Floats]:
    """Return the path before the first sample: where the rear was while it still lay there.

    Args:
        samples: The samples.
        shown: Positions of the front over time.
        travelled: Distance travelled at each sample, (n,) [m].
        length: Length of the body [m].
        yaw: Yaw of the body at the beginning [rad].

    Returns:
        Points, (p, 3) [m], and their distances, strictly rising to 0, (p,) [m].
    """
    # Choose the samples whose rear lies before the beginning, one of each place.
    yaws = samples.yaws.copy()
    yaws[0] = yaw
    near = np.flatnonzero(travelled < length - _APART)
    near = near[np.unique(np.floor(travelled[near] / _APART), return_index=True)[1]]
    # Put the rears behind the shown front; in changes of lanes the logged front is elsewhere.
    places = shown.at(samples.times[near])[0]
    ahead = np.array([np.cos(yaws[near]), np.sin(yaws[near]), np.tan(samples.slopes[near])]).T
    rears, behind = places - length * ahead, travelled[near] - length
    # Keep those that can lie on one path.
    kept = [0]
    for number in range(1, len(near)):
        step = behind[number] - behind[kept[-1]]
        if step < _APART:
            continue
        steps = (
            (rears[number] - rears[kept[-1]], step),
            (places[0] - rears[number], -behind[number]),
        )
        if all(_fits(float(np.hypot(*away[:2])), along) for away, along in steps):
            kept.append(number)
    return (
        np.concatenate([rears[kept], places[:1]]),
        np.concatenate([behind[kept], [0.0]]),
    )


def _fits(straight: float, along: float) -> bool:
    """Whether points that are `straight` apart can be `along` apart on a path [m]."""
    return abs(straight - along) < _SLACK * along + _APART
