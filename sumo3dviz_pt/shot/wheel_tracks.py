"""Finds where the wheels of a log's vehicles passed, for tracks in snow."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.tyre_tracks import TyreTracks
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.world.rails.guards import TRAINS

REACH = 400.0
"""Tracks farther from every camera are not seen [m]."""

_STEP = 0.25  # of time [s]
_FARTHEST = 20.0  # a straight piece is shorter [m]
_STRAY = 0.3  # how far drivers stray from the middle of their way [m]
_SINGLE = frozenset({"bicycle", "motorcycle", "moped"})  # have one track
_AFLOAT = frozenset({"aircraft", "cable_car", "drone", "ship", *TRAINS})


def wheel_tracks(
    course: WeatherCourse | None, fleet: Fleet, viewpoints: Floats
) -> TyreTracks | None:
    """Return where wheels passed, over the whole log; None if snow keeps no tracks.

    Args:
        course: The weather over time, or None.
        fleet: Everyone on the road.
        viewpoints: Where cameras are, (n, 3) [m].
    """
    if course is None or not course.is_snowy:
        return None
    snow = course.first.snow
    if snow is None or snow.roads == "cleared":
        return None
    begins, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
    if not len(viewpoints):
        viewpoints = np.zeros((1, 3))
    low, high = viewpoints[:, :2].min(axis=0) - REACH, viewpoints[:, :2].max(axis=0) + REACH
    for number, trajectory in enumerate(fleet.trajectories):
        body = fleet.bodies[number]
        if trajectory.kind != "vehicle" or body.vclass in _AFLOAT:
            continue
        chance = share_of(fleet.seed, "tracks", trajectory.key)
        half = 0.0 if body.vclass in _SINGLE else 0.43 * float(body.size[1])
        for piece in trajectory.pieces:
            times = np.arange(piece.begin, piece.end, _STEP)
            if len(times) < 2:
                continue
            motion = piece.sample(times)
            middle = motion.positions[:, :2]
            across = np.column_stack([-np.sin(motion.yaws), np.cos(motion.yaws)])
            stray = _STRAY * np.sin(6.2831853 * chance + motion.travelled / (17.0 + 20.0 * chance))
            stray = stray + 1.3 * _STRAY * (2.0 * chance - 1.0)
            for side in {-half, half}:
                way = middle + across * (side + stray)[:, None]
                start, end = way[:-1], way[1:]
                step = np.hypot(*(end - start).T)
                seen = ((start > low) & (start < high)).all(axis=1)
                seen &= (step > 0.01) & (step < _FARTHEST)
                begins.append(start[seen])
                ends.append(end[seen])
    return TyreTracks(np.concatenate(begins), np.concatenate(ends))
