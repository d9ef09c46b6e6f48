"""Whether something would stand in a camera, or hide the roads that one looks at."""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.world.placement.clearance import KEEP_CLEAR
from sumo3dviz_pt.world.placement.surroundings import Surroundings

_FARTHEST = 110.0  # up to this distance roads must stay in sight [m]
_MOST = 0.12  # which share of them may be hidden by one thing
_ROOM = 2.0  # walls may stand out this far from their plan, for example balconies [m]


def hides(area: shapely.Polygon, around: Surroundings, *, over: float = np.inf) -> bool:
    """Return whether something stands in a camera, or before much of what a resting one looks at.

    Args:
        area: Its outline [m].
        around: Roads and cameras.
        over: Cameras higher than this above the roads look over it [m].
    """
    wide = area.buffer(KEEP_CLEAR + _ROOM)
    if shapely.intersects(around.clearance.tracks, wide).any():
        return True
    return any(
        _share(area, outlook, around) > _MOST
        for outlook in around.clearance.outlooks
        if _above_roads(outlook, around) <= over
    )


def _above_roads(outlook: CameraPath, around: Surroundings) -> float:
    """How high above the roads near it a resting camera stands [m]."""
    eye = outlook.positions[0]
    return float(eye[2] - around.index.heights(eye[None, :2])[0])


def _share(area: shapely.Polygon, outlook: CameraPath, around: Surroundings) -> float:
    """Which share of the roads that a camera looks at an area hides."""
    eye = outlook.positions[0, :2]
    if area.distance(shapely.Point(eye)) > _FARTHEST:
        return 0.0
    points = around.index.points[:, :2]
    away = np.hypot(*(points - eye).T)
    seen = points[(away < _FARTHEST) & (away > 3.0)]
    seen = seen[around.pictured(seen, radius=1.0, by=outlook)]
    if not len(seen):
        return 0.0
    rays = shapely.linestrings(np.stack([np.broadcast_to(eye, seen.shape), seen], axis=1))
    return float(shapely.intersects(rays, area).mean())
