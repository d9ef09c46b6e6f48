"""Finds the ruts of lanes, in which water stands: where all wheels roll, day by day."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.tyre_tracks import TyreTracks
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.shot.wheel_tracks import REACH
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE

_DRIVEN = frozenset({"passenger", "bus", "truck"})
_PIECE = 5.0  # the longest straight piece of a rut [m]
_SHORTEST = 0.05  # [m]


def ruts(
    course: WeatherCourse | None, lanes: Iterable[Lane], viewpoints: Floats
) -> TyreTracks | None:
    """Return the ruts of driven lanes near cameras; None where no puddles stand.

    Junctions have none: ways cross there, and wheels wear all of it.

    Args:
        course: The weather over time, or None.
        lanes: Of the network.
        viewpoints: Where cameras are, (n, 3) [m].
    """
    if course is None or not any(moment.puddles > 0.0 for moment in course.moments):
        return None
    eyes = viewpoints[:, :2] if len(viewpoints) else np.zeros((1, 2))
    low, high = eyes.min(axis=0) - REACH, eyes.max(axis=0) + REACH
    begins, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
    for lane in lanes:
        if lane.edge_id.startswith(":") or (lane.allowed and not lane.allowed & _DRIVEN):
            continue
        for start, end in _sides(lane.shape[:, :2]):
            seen = ((np.maximum(start, end) > low) & (np.minimum(start, end) < high)).all(axis=1)
            begins.append(start[seen])
            ends.append(end[seen])
    return TyreTracks(np.concatenate(begins), np.concatenate(ends))


def _sides(middle: Floats) -> list[tuple[Floats, Floats]]:
    """Return where straight pieces of a lane's two ruts begin and end, (n, 2) [m] each.

    Args:
        middle: Of the lane, (n, 2) [m].
    """
    steps = np.hypot(*np.diff(middle, axis=0).T)
    kept = np.flatnonzero(steps > _SHORTEST)
    counts = np.ceil(steps[kept] / _PIECE).astype(np.int64)
    row = np.repeat(kept, counts)
    number = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    along = np.diff(middle, axis=0)[row] / steps[row, None]
    across = TRACK_PLACE * np.column_stack([-along[:, 1], along[:, 0]])
    share = np.stack([number, number + 1]) / np.repeat(counts, counts)
    start, end = (middle[row] + (each * steps[row])[:, None] * along for each in share)
    return [(start + side * across, end + side * across) for side in (-1.0, 1.0)]
