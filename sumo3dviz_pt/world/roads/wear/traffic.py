"""Where wheels run: distances of places from the ways of motor vehicles."""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE, TRACK_WIDTH, is_driven

_REACH = 1.7
"""Wheels pass within this distance of a way's middle [m]."""


def way_lines(layout: RoadLayout) -> shapely.STRtree:
    """Return the middles of all ways of motor vehicles, through junctions too."""
    return layout.memory.of(("ways",), lambda: shapely.STRtree(_middles(layout)))


def _middles(layout: RoadLayout) -> list[shapely.LineString]:
    """Middles of driven lanes, as lines."""
    strips = [strip for group in layout.strips.values() for strip in group]
    strips += [strip for inside in layout.insides.values() for strip in inside.ways]
    return [
        shapely.LineString(strip.lane.shape[:, :2])
        for strip in strips
        if is_driven(strip) and not strip.look.raised and len(strip.lane.shape) > 1
    ]


def wheels_at(points: Floats, ways: shapely.STRtree) -> Floats:
    """Return how much wheels polish places: 1 in the middle of a track, 0 off all tracks.

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
