"""Where wheels run: distances of places from the ways of motor vehicles."""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import BoundsXY, distance_to
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE, TRACK_WIDTH, is_driven

_REACH = 1.7
"""Wheels pass within this distance of a way's middle [m]."""

_FARTHEST = 160.0
"""Ways farther from the camera's path are left out [m]."""


def way_lines(layout: RoadLayout, focus: BoundsXY | None) -> shapely.STRtree:
    """Middles of all ways of motor vehicles near the camera, through junctions too."""
    strips = [strip for group in layout.strips.values() for strip in group]
    strips += [strip for inside in layout.insides.values() for strip in inside.ways]
    lines = [
        shapely.LineString(strip.lane.shape[:, :2])
        for strip in strips
        if is_driven(strip)
        and not strip.look.raised
        and len(strip.lane.shape) > 1
        and distance_to(focus, strip.lane.shape).min() < _FARTHEST
    ]
    return shapely.STRtree(lines)


def wheels_at(points: Floats, ways: shapely.STRtree) -> Floats:
    """How much wheels polish places: 1 in the middle of a track, 0 off all tracks.

    Args:
        points: (..., 2 or more) [m].
        ways: What `way_lines` gave.

    Returns:
        (...) in [0, 1].
    """
    flat = points[..., :2].reshape(-1, 2)
    most = np.zeros(len(flat))
    if len(ways.geometries) and len(flat):
        spots = np.asarray(shapely.points(flat))
        spot, way = ways.query(spots, predicate="dwithin", distance=_REACH)
        away = shapely.distance(spots[spot], ways.geometries[way])
        np.maximum.at(most, spot, np.exp(-0.5 * ((away - TRACK_PLACE) / TRACK_WIDTH) ** 2))
    return np.asarray(most.reshape(points.shape[:-1]))
