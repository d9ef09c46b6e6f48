"""The path that a front has driven: points by time and by way, also from before the log.

References:
    shared facts on SUMO's logs, section 3: the angle is that of the chord from the rear
    to the front, so that front - length x direction lies on the driven way. That tells
    where the path lay before the first sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.curves import Hermite, even_slopes
from sumo3dviz_pt.motion.front import Front
from sumo3dviz_pt.motion.samples import LoggedSamples

_STEP = 0.1
"""Ways are known at multiples of this time, so that the asked window moves none of them [s]."""

_STILL = 1e-3
"""Samples nearer to one another are of one place [m]."""

_APART = 0.05
"""Points of the path before the first sample are at least so far apart [m]."""

_SLACK = 0.15
"""Between points of that path the way is longer or shorter by no more than this share."""


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """Where a front was.

    Attributes:
        front: Its motion.
        places: Of the front at the times at which the way is known, (n, 3) [m].
        ways: Level way since the beginning, never falling, (n,) [m].
        past: Points of the path up to the beginning, (p, 3) [m], p >= 2.
        past_ways: Their ways, strictly rising to 0, (p,) [m].
    """

    front: Front
    places: Hermite
    ways: Floats
    past: Floats
    past_ways: Floats

    @classmethod
    def of(cls, front: Front, samples: LoggedSamples, *, length: float, yaw: float) -> Driven:
        """Follow a front.

        Args:
            front: Its motion.
            samples: That it was made of.
            length: Of the body [m].
            yaw: Of the body at the beginning [rad].
        """
        knots = _moving(absolute_times(front.begin, front.end), samples)
        places = front.at(knots).positions
        steps = np.diff(places[:, :2], axis=0)
        ways = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
        curve = Hermite(knots, places, even_slopes(knots, places))
        past, past_ways = _past(samples, curve, np.interp(samples.times, knots, ways), length, yaw)
        return cls(front, curve, ways, past, past_ways)

    @property
    def knots(self) -> Floats:
        """Times at which the way is known, (n,) [s]."""
        return self.places.knots

    def way_at(self, times: Floats, places: Floats) -> Floats:
        """Way since the beginning at times, (n,) [m]; `places` are the front's then, (n, 3)."""
        index = np.searchsorted(self.knots, times, side="right") - 1
        index = np.clip(index, 0, len(self.knots) - 1)
        away = places[:, :2] - self.places.values[index, :2]
        return np.asarray(self.ways[index] + np.hypot(away[:, 0], away[:, 1]))

    def points_at(self, ways: Floats) -> Floats:
        """Points of the path, (n, 3) [m], by way since the beginning, (n,) [m]; also negative."""
        points = np.empty((len(ways), 3))
        driven = ways > 0.0
        if driven.any():
            # Strictly rising, so that a standstill is one point.
            rising = self.ways + 1e-9 * np.arange(len(self.ways))
            times = np.interp(ways[driven], rising, self.knots)
            points[driven] = self.places.at(times)[0]
        if not driven.all():
            points[~driven] = self._before(ways[~driven])
        return points

    def _before(self, ways: Floats) -> Floats:
        """Points of the path before the beginning; straight on beyond what is known."""
        points = np.stack([np.interp(ways, self.past_ways, axis) for axis in self.past.T], axis=1)
        beyond = np.minimum(ways - self.past_ways[0], 0.0)
        step = (self.past[1] - self.past[0]) / (self.past_ways[1] - self.past_ways[0])
        return np.asarray(points + beyond[:, None] * step)


def absolute_times(begin: float, end: float, *, step: float = _STEP) -> Floats:
    """Absolute times between two, and both, (n,) [s]."""
    inner = np.arange(np.ceil(begin / step), np.floor(end / step) + 1.0) * step
    inner = inner[(inner > begin + 1e-6) & (inner < end - 1e-6)]
    return np.concatenate([[begin], inner, [end]])


def _moving(knots: Floats, samples: LoggedSamples) -> Floats:
    """The knots without those between two samples of one place: much of a city stands."""
    steps = np.abs(np.diff(samples.positions, axis=0)).max(axis=1)
    index = np.searchsorted(samples.times[1:-1], knots, side="right")
    kept = (steps > _STILL)[index]
    kept[[0, -1]] = True
    return np.union1d(
        knots[kept], samples.times[1:-1][(steps[1:] > _STILL) != (steps[:-1] > _STILL)]
    )


def _past(
    samples: LoggedSamples, shown: Hermite, ways: Floats, length: float, yaw: float
) -> tuple[Floats, Floats]:
    """The path before the first sample: where the rear was at the samples of the first length."""
    yaws = samples.yaws.copy()
    yaws[0] = yaw
    near = np.flatnonzero(ways < length - _APART)
    # Who stands tells the same again and again.
    near = near[np.unique(np.floor(ways[near] / _APART), return_index=True)[1]]
    # From where the front is shown, which within changes of lanes is not where it is logged.
    places = shown.at(samples.times[near])[0]
    ahead = np.array([np.cos(yaws[near]), np.sin(yaws[near]), np.tan(samples.slopes[near])]).T
    rears, behind = places - length * ahead, ways[near] - length
    kept = [0]
    for number in range(1, len(near)):
        step = behind[number] - behind[kept[-1]]
        if step < _APART:
            continue
        steps = (
            (rears[number] - rears[kept[-1]], step),
            (places[0] - rears[number], -behind[number]),
        )
        if all(_fits(float(np.hypot(*away[:2])), way) for away, way in steps):
            kept.append(number)
    return (
        np.concatenate([rears[kept], places[:1]]),
        np.concatenate([behind[kept], [0.0]]),
    )


def _fits(distance: float, way: float) -> bool:
    """Whether two points can lie so far apart on a path: angles that jump tell of no path."""
    return abs(distance - way) < _SLACK * way + _APART
