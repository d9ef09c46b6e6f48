"""Headings of bodies: the chord behind the front, a dragged rear axle, or the log's angles.

A heading is a curve of yaw and pitch over time. The chord from the rear to the front along the
driven path is SUMO's own definition of the angle. On the shown path the chord keeps still while
the body stands, turns into changes of lanes by itself, and never flips. The tractrix is the curve
of a rear axle that cannot slip sideways.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.alignment import (
    aligned,
    calmed,
    leeway,
    room_on_the_spot,
    turning_room,
)
from sumo3dviz_pt.motion.curves import Hermite, eased, monotone_slopes
from sumo3dviz_pt.motion.driven import STEP, Driven
from sumo3dviz_pt.motion.resting import resting
from sumo3dviz_pt.motion.samples import LoggedSamples, absolute_times, wrapped

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
