"""Headings of bodies: the chord behind the front, a dragged rear axle, or what the log says.

A heading is a curve of yaw and pitch over time, through what is known every 0.1 s.

References:
    shared facts on motion, section 5.5. The chord from the rear to the front along the
    driven path is SUMO's own definition of the angle; on the displayed path it holds while
    standing, turns into changes of lanes by itself and never flips. The tractrix is what a
    rear axle does that cannot slip sideways.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.curves import Hermite, eased, monotone_slopes
from sumo3dviz_pt.motion.driven import Driven, absolute_times
from sumo3dviz_pt.motion.samples import LoggedSamples

Heading = Literal["chord", "tractrix"]

STEEPEST = np.radians(30.0)
"""No road is steeper; SUMO logs up to 90 degrees at kerbs and stairs [rad]."""

FASTEST_TURN = np.radians(130.0)
"""No body turns faster, whatever the path does: a lane's corners can [rad/s]."""

REAR_AXLE = 0.78
"""Where the rear axle is, as a share of the length behind the front."""

_STEP = 0.04
"""Between the places over which the rear axle is dragged [s]."""

_LEAST_LEVEL = 0.2
"""A chord shorter than this share of the length says nothing about the slope."""

_EASED = 9
"""Knots of an eased turn."""


def chords(driven: Driven, length: float) -> Floats:
    """From the point of the path one length behind to the front, at the knots, (n, 3) [m]."""
    return driven.places.values - driven.points_at(driven.ways - length)


def chord(driven: Driven, ahead: Floats) -> Hermite:
    """Along the chords.

    Args:
        driven: The path.
        ahead: From `chords`.

    Returns:
        Yaw and pitch, (n, 2) [rad], unwrapped.
    """
    yaws = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    return _curve(driven.knots, calmed(driven.knots, yaws), slopes_of(ahead))


def tractrix(driven: Driven, ahead: Floats, length: float, *, yaw: float) -> Hermite:
    """Along the line from a rear axle that the front drags, which never slips sideways.

    Args:
        driven: The path.
        ahead: From `chords`; says the pitch.
        length: Of the body [m].
        yaw: At the beginning [rad].

    Returns:
        Yaw and pitch, (n, 2) [rad], unwrapped.
    """
    front = driven.front
    knots = np.unique(
        np.concatenate([driven.knots, absolute_times(front.begin, front.end, step=_STEP)])
    )
    dragged = _dragged(front.at(knots).positions[:, :2], REAR_AXLE * length, yaw)
    slopes = np.interp(knots, driven.knots, slopes_of(ahead))
    return _curve(knots, calmed(knots, np.unwrap(dragged)), slopes)


def slopes_of(ahead: Floats) -> Floats:
    """Nose up along chords, (n, 3) [m] -> (n,) [rad]; folded ones are not steep."""
    if not np.ptp(ahead[:, 2]):
        return np.full(len(ahead), np.arctan2(ahead[0, 2], np.hypot(*ahead[0, :2])))
    level = np.hypot(ahead[:, 0], ahead[:, 1])
    return np.asarray(np.arctan2(ahead[:, 2], np.maximum(level, _LEAST_LEVEL * level.max())))


def logged(samples: LoggedSamples, *, yaw: float, at_once: bool) -> Hermite:
    """The log's angles, for bodies that do not follow their fronts.

    Args:
        samples: n >= 2.
        yaw: At the beginning [rad].
        at_once: Whether only the first and the last angle count, joined by one eased turn.

    Returns:
        Yaw and pitch, (n, 2) [rad], unwrapped.
    """
    yaws = np.unwrap(np.concatenate([[yaw], samples.yaws[1:]]))
    if not at_once:
        curve = _curve(samples.times, yaws, samples.slopes)
        knots = absolute_times(float(samples.times[0]), float(samples.times[-1]))
        shown = curve.at(knots)[0]
        return _curve(knots, calmed(knots, shown[:, 0]), shown[:, 1])
    share = np.linspace(0.0, 1.0, _EASED)
    times = samples.times[0] + share * (samples.times[-1] - samples.times[0])
    turned = yaws[0] + eased(share) * (yaws[-1] - yaws[0])
    return _curve(times, turned, np.interp(times, samples.times, samples.slopes))


def calmed(times: Floats, yaws: Floats) -> Floats:
    """The same turns, nowhere faster than `FASTEST_TURN`, (n,) [rad].

    The middle between the lowest and the highest curve of that slope that bound the yaws;
    turns that are slow enough stay as they are.
    """
    if (np.abs(np.diff(yaws)) <= FASTEST_TURN * np.diff(times)).all():
        return yaws
    reach = np.ptp(yaws) / FASTEST_TURN
    low, high = yaws.copy(), yaws.copy()
    for step in range(1, len(times)):
        later = times[step:] - times[:-step]
        if later.min() > reach:
            break
        away = FASTEST_TURN * later
        low[:-step] = np.minimum(low[:-step], yaws[step:] + away)
        low[step:] = np.minimum(low[step:], yaws[:-step] + away)
        high[:-step] = np.maximum(high[:-step], yaws[step:] - away)
        high[step:] = np.maximum(high[step:], yaws[:-step] - away)
    # It begins as the body stood.
    first = FASTEST_TURN * (times - times[0])
    return np.clip((low + high) / 2.0, yaws[0] - first, yaws[0] + first)


def _curve(times: Floats, yaws: Floats, pitches: Floats) -> Hermite:
    """A curve that stands where its knots do."""
    values = np.column_stack([yaws, np.clip(pitches, -STEEPEST, STEEPEST)])
    return Hermite(times, values, monotone_slopes(times, values))


def _dragged(places: Floats, base: float, yaw: float) -> Floats:
    """Yaw at every place of a line of a length whose rear end only follows, (n,) [rad]."""
    x, y = (places[0] - base * np.array([np.cos(yaw), np.sin(yaw)])).tolist()
    yaws = np.empty(len(places))
    for number, (front_x, front_y) in enumerate(places.tolist()):
        away_x, away_y = front_x - x, front_y - y
        share = base / max((away_x * away_x + away_y * away_y) ** 0.5, 1e-9)
        x, y = front_x - share * away_x, front_y - share * away_y
        yaws[number] = np.arctan2(away_y, away_x)
    return yaws
