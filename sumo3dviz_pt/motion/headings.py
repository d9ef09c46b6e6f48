"""Headings of bodies: the chord behind the front, a dragged rear axle, or what the log says.

References:
    shared facts on motion, section 5.5. The chord from the rear to the front along the
    driven path is SUMO's own definition of the angle; on the displayed path it holds while
    standing, turns into changes of lanes by itself and never flips. The tractrix is what a
    rear axle does that cannot slip sideways.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.curves import Hermite, eased, monotone_slopes
from sumo3dviz_pt.motion.driven import Driven
from sumo3dviz_pt.motion.front import FrontMotion
from sumo3dviz_pt.motion.samples import Samples, nearest_turn

Heading = Literal["chord", "tractrix"]

Headings = Callable[[Floats, FrontMotion, Floats], tuple[Floats, Floats]]
"""Yaw and pitch, (n,) [rad] each, from times, the front's motion and its way, (n,) each."""

STEEPEST = np.radians(30.0)
"""No road is steeper; SUMO logs up to 90 degrees at kerbs and stairs [rad]."""

_AXLE = 0.78
"""Where the rear axle is, as a share of the length behind the front."""

_STEP = 0.04
"""Between the places over which the rear axle is dragged [s]."""

_LEAST_LEVEL = 0.2
"""A chord shorter than this share of the length says nothing about the slope."""


def chord(driven: Driven, length: float) -> Headings:
    """Along the chord from the point of the path one length behind to the front."""

    def headings(times: Floats, motion: FrontMotion, ways: Floats) -> tuple[Floats, Floats]:
        del times
        rear = driven.points_at(ways - length)
        ahead = motion.positions - rear
        return np.arctan2(ahead[:, 1], ahead[:, 0]), _pitches(ahead, length)

    return headings


def tractrix(driven: Driven, length: float, *, yaw: float) -> Headings:
    """Along the line from a rear axle that the front drags, which never slips sideways."""
    front = driven.front
    first, last = np.ceil(front.begin / _STEP), np.floor(front.end / _STEP)
    inner = np.arange(first, last + 1.0) * _STEP
    inner = inner[(inner > front.begin) & (inner < front.end)]
    knots = np.concatenate([[front.begin], inner, [front.end]])
    dragged = np.unwrap(_dragged(front.at(knots).positions[:, :2], _AXLE * length, yaw))
    along = chord(driven, length)

    def headings(times: Floats, motion: FrontMotion, ways: Floats) -> tuple[Floats, Floats]:
        return np.interp(times, knots, dragged), along(times, motion, ways)[1]

    return headings


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


def own(times: Floats, motion: FrontMotion, ways: Floats) -> tuple[Floats, Floats]:
    """What the smoother itself says.

    Raises:
        ValueError: If it says nothing.
    """
    del times, ways
    if motion.yaws is None or motion.pitches is None:
        raise ValueError("the smoother gives no headings")
    return motion.yaws, motion.pitches


def logged(
    samples: Samples, *, yaw: float, at_once: bool
) -> tuple[Callable[[Floats], Floats], Headings]:
    """The log's angles, for bodies that do not follow their fronts.

    Args:
        samples: n >= 2.
        yaw: At the beginning [rad].
        at_once: Whether only the first and the last angle count, joined by one eased turn.

    Returns:
        Yaw by time; yaw and pitch as other headings give them.
    """
    yaws = nearest_turn(samples.yaws, np.full(len(samples.yaws), yaw))
    yaws = np.unwrap(np.concatenate([[yaw], yaws[1:]]))
    curve = Hermite(samples.times, yaws, monotone_slopes(samples.times, yaws))
    begin, length = samples.times[0], samples.times[-1] - samples.times[0]

    def turned(times: Floats) -> Floats:
        if at_once:
            return np.asarray(yaws[0] + eased((times - begin) / length) * (yaws[-1] - yaws[0]))
        return curve.at(times)[0]

    def headings(times: Floats, motion: FrontMotion, ways: Floats) -> tuple[Floats, Floats]:
        del motion, ways
        return turned(times), np.interp(times, samples.times, samples.slopes)

    return turned, headings


def _pitches(ahead: Floats, length: float) -> Floats:
    """Nose up along chords, (n, 3) -> (n,) [rad]."""
    level = np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), _LEAST_LEVEL * length)
    return np.clip(np.arctan2(ahead[:, 2], level), -STEEPEST, STEEPEST)
