"""Finds where the wheels of a log's vehicles passed, for tracks in snow."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.trajectory import MotionPiece
from sumo3dviz_pt.model.tyre_tracks import TyreTracks
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.world.rails.guards import TRAINS

REACH = 400.0
"""Tracks farther from every camera are not seen [m]."""

_STEP = 0.25  # of time [s]
_LEAST = 2  # moments of a way
_STANDS = 0.01  # a wheel that rolls less in a step stands [m]
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
    snow = None if course is None else course.first.snow
    if course is None or snow is None or not course.is_snowy or snow.roads == "cleared":
        return None
    eyes = viewpoints[:, :2] if len(viewpoints) else np.zeros((1, 2))
    low, high = eyes.min(axis=0) - REACH, eyes.max(axis=0) + REACH
    begins, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for trajectory, body in zip(fleet.trajectories, fleet.bodies, strict=True):
        if trajectory.kind != "vehicle" or body.vclass in _AFLOAT:
            continue
        half = 0.0 if body.vclass in _SINGLE else 0.43 * float(body.size[1])
        chance = share_of(fleet.seed, "tracks", trajectory.key)
        for piece in trajectory.pieces:
            for way in _ways(piece, half, chance):
                start, end = way[:-1], way[1:]
                step = np.hypot(*(end - start).T)
                seen = ((start > low) & (start < high)).all(axis=1)
                seen &= (step > _STANDS) & (step < _FARTHEST)
                begins.append(start[seen])
                ends.append(end[seen])
    return TyreTracks(np.concatenate(begins), np.concatenate(ends))


def _ways(piece: MotionPiece, half: float, chance: float) -> list[Floats]:
    """Return the ways of the wheels of one vehicle, each (n, 2) [m].

    Args:
        piece: Of its motion.
        half: Half the distance of its wheels across; 0 for one track [m].
        chance: How it strays, in [0, 1).
    """
    times = np.arange(piece.begin, piece.end, _STEP)
    if len(times) < _LEAST:
        return []
    motion = piece.sample(times)
    across = np.column_stack([-np.sin(motion.yaws), np.cos(motion.yaws)])
    along = motion.travelled / (17.0 + 20.0 * chance)
    stray = _STRAY * (np.sin(6.2831853 * chance + along) + 1.3 * (2.0 * chance - 1.0))
    sides = (-half, half) if half else (0.0,)
    return [motion.positions[:, :2] + across * (side + stray)[:, None] for side in sides]
