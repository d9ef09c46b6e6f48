"""Water where ships have lanes: scenarios seldom have a polygon for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract, union
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.areas.covers import WATER, land_covers
from sumo3dviz_pt.world.roads.style import is_skipped

_BESIDE = 6.0  # how far water reaches beyond a lane [m]
_LEAST = 20.0  # smaller pieces between water and a polygon of water are left out [m2]
_SOURCE = "waterways of the network"


def with_waterways(scenario: Scenario) -> Scenario:
    """Return a scenario with polygons of water where lanes are for ships alone.

    Polygons of water stay what they are; only what they leave of waterways is added.

    Args:
        scenario: As read.
    """
    ways = _ways(scenario.network)
    if not ways:
        return scenario
    free = subtract(union(ways), _water(scenario.polygons))
    pieces = [part for part in polygon_parts(free) if part.area > _LEAST]
    added = tuple(
        Polygon(f"waterway {k}", "natural.water", _ring(piece), True, None, _SOURCE)
        for k, piece in enumerate(pieces)
    )
    return replace(scenario, polygons=(*scenario.polygons, *added))


def _ways(network: Network) -> list[shapely.Geometry]:
    """What ships need of waterways, from above."""
    return [
        shapely.LineString(lane.shape[:, :2]).buffer(0.5 * lane.width + _BESIDE, quad_segs=4)
        for lane in network.lanes.values()
        if is_skipped(lane)
    ]


def _water(polygons: Sequence[Polygon]) -> list[shapely.Geometry]:
    """Polygons that already are water, grown so that no bank is left between."""
    covers = land_covers()
    found = []
    for item in polygons:
        row = covers.row_of(item.type)
        if row is not None and row.cover == WATER and item.fill and len(item.shape) > 2:
            found.append(shapely.make_valid(shapely.Polygon(item.shape[:, :2])).buffer(_BESIDE))
    return found


def _ring(piece: shapely.Polygon) -> Floats:
    """The outline of a polygon, (n, 2) [m]; holes hang on it by cuts of no width."""
    ring = list(piece.exterior.coords)
    for hole in piece.interiors:
        away = [math.dist(point, hole.coords[0]) for point in ring]
        near = away.index(min(away))
        ring = [*ring[: near + 1], *hole.coords, *ring[near:]]
    return np.array(ring)
