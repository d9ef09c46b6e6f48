"""The path that a front has driven, and how the body and units behind it follow.

The path has points by time and by distance, also from before the log. SUMO's angle is the direction
of the chord from the rear to the front, so the point front - length x direction lies on the driven
path. That tells where the path lay before the first sample.

A heading is a curve of yaw and pitch over time: that of the chord behind the front, of a dragged
rear axle, or of the log's angles. The chord from the rear to the front along the driven path is
SUMO's own definition of the angle. On the shown path the chord keeps still while the body stands,
turns into changes of lanes by itself, and never flips. The tractrix is the curve of a rear axle
that cannot slip sideways.

Units of a vehicle follow the driven path, made straighter where the log is straight. SUMO's
vehicles change lanes without turning. In a jam, the path of such a change lies across the lanes,
and a lorry's short tractor on it would stand across them, too. So each step of the path is turned
to within some degrees of the angles that are logged around it. Chords of such a path keep within
the same degrees, whatever the units' lengths, and units still turn only as they drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.front import Front, Hermite, eased, even_slopes, monotone_slopes
from sumo3dviz_pt.motion.manoeuvres import (
    STEADY,
    aligned,
    calmed,
    leeway,
    resting,
    room_on_the_spot,
    turning_room,
)
from sumo3dviz_pt.motion.samples import LoggedSamples, absolute_times, wrapped

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
    chosen = steps[index]
    chosen[[0, -1]] = True
    return np.union1d(knots[chosen], samples.times[1:-1][steps[1:] != steps[:-1]])


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
    apart = [0]
    for number in range(1, len(near)):
        step = behind[number] - behind[apart[-1]]
        if step < _APART:
            continue
        steps = (
            (rears[number] - rears[apart[-1]], step),
            (places[0] - rears[number], -behind[number]),
        )
        if all(_fits(float(np.hypot(*away[:2])), along) for away, along in steps):
            apart.append(number)
    return (
        np.concatenate([rears[apart], places[:1]]),
        np.concatenate([behind[apart], [0.0]]),
    )


def _fits(straight: float, along: float) -> bool:
    """Whether points that are `straight` apart can be `along` apart on a path [m]."""
    return abs(straight - along) < _SLACK * along + _APART


Heading = Literal["chord", "tractrix"]

STEEPEST = np.radians(30.0)
"""Steepest pitch that is shown [rad]; SUMO logs up to 90 degrees at kerbs and stairs."""

REAR_AXLE = 0.78
"""Distance of the rear axle from the front as a share of the body's length."""

_STEP = 0.04
"""Time between the positions over which the rear axle is dragged [s]."""

_LEAST_LEVEL = 0.2
"""A chord shorter than this share of the longest one says nothing about the slope."""

_EASED = 9
"""Number of knots of an eased turn."""

_STRAIGHTENED = 1.5
"""A body stands nearly as it is logged; it turns there over this many of its lengths."""


def chords(driven: Driven, length: float) -> Floats:
    """Return vectors from the path's point one length [m] behind to the front, (n, 3) [m]."""
    return driven.places.values - driven.points_at(driven.travelled - length)


def chord(driven: Driven, ahead: Floats, samples: LoggedSamples, length: float) -> Hermite:
    """Return the headings along chords that come from `chords`, kept near the logged angles.

    Args:
        driven: The driven path.
        ahead: The chords, (n, 3) [m].
        samples: What is logged.
        length: Length of the body [m].

    Returns:
        Yaw and pitch over time, (n, 2) [rad], unwrapped.
    """
    knots, first = driven.knots, np.arctan2(ahead[0, 1], ahead[0, 0])
    yaws = np.arctan2(ahead[:, 1], ahead[:, 0])
    away = _way_to_rest(driven, samples) / (_STRAIGHTENED * length)
    near = leeway(knots, yaws, samples, loose=np.minimum(away, 1.0))
    yaws = aligned(yaws, near)
    # The first yaw stays, because the body already stands like that.
    yaws[0] += wrapped(first - yaws[0])
    calm = calmed(turning_room(knots, driven.travelled, length), yaws, near)
    return _curve(knots, calm, slopes_of(ahead))


def _way_to_rest(driven: Driven, samples: LoggedSamples) -> Floats:
    """Return the way from each knot to the nearest place where the body rests, (n,) [m]."""
    rest = resting(samples)
    rests = np.unique(np.interp(samples.times[:-1][rest], driven.knots, driven.travelled))
    bounds = np.concatenate([[-np.inf], rests, [np.inf]])
    after = np.searchsorted(bounds[1:-1], driven.travelled) + 1
    near = np.minimum(driven.travelled - bounds[after - 1], bounds[after] - driven.travelled)
    return np.asarray(near)


def tractrix(driven: Driven, ahead: Floats, length: float, *, yaw: float) -> Hermite:
    """Return the headings from a rear axle that the front drags and that never slips sideways.

    Args:
        driven: The driven path.
        ahead: Vectors from `chords`, which give the pitch, (n, 3) [m].
        length: Length of the body [m].
        yaw: Yaw at the beginning [rad].

    Returns:
        Yaw and pitch over time, (n, 2) [rad], unwrapped.
    """
    front = driven.front
    knots = np.unique(
        np.concatenate([driven.knots, absolute_times(front.begin, front.end, step=_STEP)])
    )
    dragged = _dragged(front.at(knots).positions[:, :2], REAR_AXLE * length, yaw)
    slopes = np.interp(knots, driven.knots, slopes_of(ahead))
    room = turning_room(knots, np.interp(knots, driven.knots, driven.travelled), length)
    return _curve(knots, calmed(room, np.unwrap(dragged)), slopes)


def slopes_of(ahead: Floats) -> Floats:
    """Return the pitch of chords, (n, 3) [m] -> (n,) [rad]; short chords do not get steep."""
    if not np.ptp(ahead[:, 2]):
        return np.full(len(ahead), np.arctan2(ahead[0, 2], np.hypot(*ahead[0, :2])))
    level = np.hypot(ahead[:, 0], ahead[:, 1])
    return np.asarray(np.arctan2(ahead[:, 2], np.maximum(level, _LEAST_LEVEL * level.max())))


def logged(samples: LoggedSamples, *, yaw: float, at_once: bool) -> Hermite:
    """Return the log's angles as headings, for bodies that do not follow their fronts.

    Args:
        samples: n samples, n >= 2.
        yaw: Yaw at the beginning [rad].
        at_once: Whether only the first and the last angle count, joined by one eased turn.

    Returns:
        Yaw and pitch over time, (n, 2) [rad], unwrapped.
    """
    yaws = np.unwrap(np.concatenate([[yaw], samples.yaws[1:]]))
    if not at_once:
        curve = _curve(samples.times, yaws, samples.slopes)
        knots = absolute_times(float(samples.times[0]), float(samples.times[-1]), step=STEP)
        knots = np.union1d(knots, samples.times)
        shown = curve.at(knots)[0]
        room = room_on_the_spot(knots, samples)
        return _curve(knots, calmed(room, shown[:, 0]), shown[:, 1])
    share = np.linspace(0.0, 1.0, _EASED)
    times = samples.times[0] + share * (samples.times[-1] - samples.times[0])
    turned = yaws[0] + eased(share) * (yaws[-1] - yaws[0])
    return _curve(times, turned, np.interp(times, samples.times, samples.slopes))


def _curve(times: Floats, yaws: Floats, pitches: Floats) -> Hermite:
    """Return a heading through knots; it stands still wherever they do."""
    values = np.column_stack([yaws, np.clip(pitches, -STEEPEST, STEEPEST)])
    return Hermite(times, values, monotone_slopes(times, values))


def _dragged(places: Floats, base: float, yaw: float) -> Floats:
    """Return the yaw of a dragged line at each position of its front, (n,) [rad].

    Args:
        places: Positions of the front, (n, 2) [m].
        base: Length of the line [m].
        yaw: Yaw at the beginning [rad].
    """
    x, y = (places[0] - base * np.array([np.cos(yaw), np.sin(yaw)])).tolist()
    yaws = np.empty(len(places))
    for number, (front_x, front_y) in enumerate(places.tolist()):
        away_x, away_y = front_x - x, front_y - y
        share = base / max((away_x * away_x + away_y * away_y) ** 0.5, 1e-9)
        x, y = front_x - share * away_x, front_y - share * away_y
        yaws[number] = np.arctan2(away_y, away_x)
    return yaws


_MOST = np.radians(18.0)
"""Where the angles logged around it are steady, the path is no farther from any of them [rad]."""

_LOOSER = 6.0
"""It may be this many times farther as they differ by more than that: in bends it is as driven."""

_AROUND = 0.5
"""The angle of each place is logged while the body is over it, and this many lengths about it."""

_FAR = 100.0
"""Longer than any vehicle on a road [m]."""

_PARTS = 17
"""Number of points of a step that is turned, or is beside one."""

_POINT = 1e-6
"""Shorter steps lead nowhere [m]."""


@dataclass(frozen=True, eq=False)
class UnitPath:
    """A path that is straighter than the driven one, as seen from its end.

    Attributes:
        driven: The driven path.
        samples: What is logged.
        length: Length over which the body follows its front [m].
    """

    driven: Driven
    samples: LoggedSamples
    length: float

    @cached_property
    def shifts(self) -> tuple[Floats, Floats] | None:
        """How far it has led aside from the driven one; None where it is the same.

        Distances travelled, rising, (n,) [m], and what was gained by then, (n, 2) [m]. Only of
        vehicles that bend does anybody ask.
        """
        driven = self.driven
        ways = np.concatenate(
            [driven.past_travelled[:1] - _FAR, driven.past_travelled[:-1], driven.travelled]
        )
        gained = _gained(ways, driven, self.samples, self.length)
        if not gained.any():
            return None
        # Between two knots a quick move aside is bent, so look there more closely.
        turned = np.convolve(gained.any(axis=1), [1, 1, 1], mode="same") > 0
        parts = np.linspace(ways[:-1][turned], ways[1:][turned], _PARTS).ravel()
        ways = np.union1d(ways, parts)
        gained = _gained(ways, driven, self.samples, self.length)
        return ways, np.concatenate([np.zeros((1, 2)), np.cumsum(gained, axis=0)])

    def straightened(self, points: Floats, travelled: Floats, ways: Floats) -> Floats:
        """Return points of the driven path as units follow it from a front that stays.

        Args:
            points: Of k places on each of n paths, (n, k, 3) [m].
            travelled: Distances that the fronts have travelled, (n,) [m].
            ways: Distances travelled at the points, (n, k) [m].
        """
        if self.shifts is None:
            return points
        known, shifts = self.shifts
        moved = points.copy()
        for axis, values in enumerate(shifts.T):
            aside = np.interp(travelled, known, values)[:, None]
            moved[..., axis] -= aside - np.interp(ways, known, values)
        return moved


def _gained(ways: Floats, driven: Driven, samples: LoggedSamples, length: float) -> Floats:
    """Return what each step of a path gains as it is turned to where the log heads.

    Args:
        ways: Distances travelled at the ends of n - 1 steps, rising, (n,) [m].
        driven: The driven path.
        samples: What is logged.
        length: Length over which the body follows its front [m].

    Returns:
        Aside and ahead, (n - 1, 2) [m]; 0 where it stays.
    """
    steps = np.diff(driven.points_at(ways)[:, :2], axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    middle, most = _logged_around(ways, driven, samples, length)
    away = wrapped(np.arctan2(steps[:, 1], steps[:, 0]) - middle)
    turned = middle + np.clip(away, -most, most)
    straight = lengths[:, None] * np.column_stack([np.cos(turned), np.sin(turned)])
    far = (np.abs(away) > most) & (lengths > _POINT)
    return np.where(far[:, None], straight - steps, 0.0)


def _logged_around(
    ways: Floats, driven: Driven, samples: LoggedSamples, length: float
) -> tuple[Floats, Floats]:
    """Return the middle of the angles logged around each step, and how far it may be from it.

    Args:
        ways: Distances travelled at the ends of n - 1 steps, rising, (n,) [m].
        driven: The driven path.
        samples: What is logged.
        length: Length over which the body follows its front [m].

    Returns:
        Both (n - 1,) [rad].
    """
    known = np.interp(samples.times, driven.knots, driven.travelled)
    # An angle is the chord's, so it tells of the path one length back.
    first = np.searchsorted(known, ways[:-1] - _AROUND * length, side="right") - 1
    last = np.searchsorted(known, ways[1:] + (1.0 + _AROUND) * length) + 1
    spans = np.column_stack([np.maximum(first, 0), np.minimum(last, len(known))]).ravel()
    # One more, because the end of a span is an index, too.
    yaws = np.append(samples.yaws, samples.yaws[-1])
    low, high = np.minimum.reduceat(yaws, spans)[::2], np.maximum.reduceat(yaws, spans)[::2]
    spread = high - low
    most = _MOST - spread / 2.0 + _LOOSER * np.maximum(spread - STEADY, 0.0)
    return (low + high) / 2.0, most
