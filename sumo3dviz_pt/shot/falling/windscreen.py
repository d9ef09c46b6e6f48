"""The wet pane before a driver's eye: where it is, and how its wipers move."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.cast.cockpits import has_windscreen
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.falling import Cabin, Windscreen
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.panes import Pane
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.weather import WeatherCourse

_RATES = ((0.0, 0.0), (0.2, 0.1), (1.0, 0.2), (4.0, 0.45), (10.0, 0.75), (25.0, 1.0), (50.0, 1.1))
"""Turns of wipers each second by the rate of rain [mm/h]: from an interval of ten seconds to the
65 a minute of the faster step."""

_RAISED = 0.12  # from the roof down to the pane's upper edge [m]
_BEFORE = 0.32  # from the eye to the upper edge, along the vehicle [m]
_WIDE = 0.8  # share of the vehicle's width
_SETTLING = (
    28.0  # drops large enough to be seen that settle on a square metre in a second, at 1 mm/h
)


_RARELY = 0.01  # turns each second that stand for wipers at rest


def has_pane(course: WeatherCourse | None, job: Job) -> bool:
    """Return whether rides look through a wet pane, with wipers, at any time.

    Args:
        course: The weather over time, or None.
        job: The scene file.
    """
    if course is None or not course.rains:
        return False
    return job.weather is None or job.weather.windscreen is not False


def windscreen_of(
    body: Body, cabin: Cabin, view: View, *, course: WeatherCourse, time: float
) -> Windscreen | None:
    """Return the pane before a camera that sits in a vehicle; it is dry while no rain falls.

    Ships, aircraft, containers and such have none.

    Args:
        body: What the vehicle shows.
        cabin: Where it is.
        view: The camera.
        course: The weather over time.
        time: [s].
    """
    if not has_windscreen(body):
        return None
    weather = course.at(time)
    rate = 0.0 if weather.rain is None else weather.rain.rate
    pane = pane_of(body)
    frame, (across, tall) = pane.world_from_pane.matrix, pane.size
    camera = view.world_from_camera.matrix
    placed = np.linalg.inv(camera) @ cabin.world_from_body @ frame
    # Two blades side by side that turn the same way, from the passenger's side.
    side = 1.0 if (np.linalg.inv(cabin.world_from_body) @ camera)[1, 3] >= 0.0 else -1.0
    pivots = np.array([[side * 0.36 * across, -0.04], [-side * 0.12 * across, -0.04]])
    long = min(0.47 * across, 0.95 * tall)
    turns = turned(course, time)
    per_second = max(_turns(rate), _RARELY)
    wet = _SETTLING * rate**0.8
    return Windscreen(
        placed, (across, tall), pivots, (0.1 * long, long), turns, 1.0 / per_second, wet
    )


def pane_of(body: Body) -> Pane:
    """Return the windscreen of a body, placed in the body's own frame."""
    _, width, height = body.size
    foot, eye = body.seat.cowl, body.seat.eye
    top = np.array([min(eye[0] + _BEFORE, foot[0] - 0.05), 0.0, height - _RAISED])
    top[2] = max(top[2], foot[2] + 0.3)
    frame, tall = _frame(np.array([foot[0], 0.0, foot[2]]), top)
    return Pane(Transform(frame), (_WIDE * width, tall))


def _frame(foot: Floats, top: Floats) -> tuple[Floats, float]:
    """Return the pane's placement in the body's frame, (4, 4), and its height [m]."""
    up = top - foot
    tall = float(np.linalg.norm(up))
    up /= tall
    left = np.array([0.0, 1.0, 0.0])
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1], frame[:3, 2] = left, up, np.cross(left, up)
    frame[:3, 3] = foot
    return frame, tall


def turned(course: WeatherCourse, time: float) -> float:
    """Return how often wipers have turned since time 0."""
    low, high = sorted((0.0, time))
    moments = [low, *(at for at in course.times if low < at < high), high]
    # Finer steps between moments, as turns do not follow the rate evenly.
    times = np.unique(np.concatenate([np.linspace(a, b, 17) for a, b in pairwise(moments)]))
    rates = [course.at(float(at)).rain for at in times]
    each = np.array([_turns(0.0 if rain is None else rain.rate) for rain in rates])
    total = float((0.5 * (each[1:] + each[:-1]) * np.diff(times)).sum())
    return total if time >= 0.0 else -total


def _turns(rate: float) -> float:
    """Return the turns of wipers each second in a rain [mm/h]."""
    rates, turns = np.array(_RATES).T
    return float(np.interp(rate, rates, turns))
