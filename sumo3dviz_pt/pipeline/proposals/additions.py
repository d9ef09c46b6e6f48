"""What our code adds around a place of a scenario: terrain on slopes, and rows of houses.

Both are found as the world finds them, but without cameras that keep their view clear: a house
that stands in the way here may later be left out, and never the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy import ndimage

from sumo3dviz_pt.job.settings import GroundSettings, RoadSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.world.land.build import build_ground
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.lane_index import LaneIndex
from sumo3dviz_pt.world.placement.surroundings import HeightAt, surroundings
from sumo3dviz_pt.world.roads.layout import RoadLayout, layout_roads
from sumo3dviz_pt.world.rows.fronts import Given, grow_rows, why_none
from sumo3dviz_pt.world.street.furniture import stop_areas

GROWN = 130.0
"""What our code adds is found up to this distance from a place, along each axis [m]."""

_ROOF = 16.0  # height of houses in rows, about [m]
_NEAR = 110.0  # houses farther than this from the place hide nothing [m]
_GRID = 2.5  # steps of the heights around the place that are kept [m]
_SEED = 1


@dataclass(frozen=True, slots=True, eq=False)
class Additions:
    """What our code adds.

    Attributes:
        land: Height of the terrain, or None where roads are level.
        houses: Plans of houses.
        roofs: Heights of their roofs above zero, one for each house [m].
    """

    land: HeightAt | None = None
    houses: list[shapely.Geometry] = field(default_factory=list)
    roofs: Floats = field(default_factory=lambda: np.zeros(0))


def additions(scenario: Scenario, network: Network, index: LaneIndex, place: Floats) -> Additions:
    """Return what our code adds around a place.

    Args:
        scenario: What it has put somewhere keeps its place.
        network: The roads near the place.
        index: Their lanes.
        place: (3,) [m].
    """
    if not network.edges:
        return Additions()
    layout = layout_roads(network, RoadSettings())
    land = None
    if not layout.cells.is_flat:
        settings = GroundSettings(horizon="flat")
        ground = build_ground(settings, network, roads=layout, textured=False)
        land = _sampled(ground.height_at, place)
    houses = _houses(scenario, network, layout, index, place)
    roofs = [float(index.heights(np.array(plan.centroid.coords))[0]) + _ROOF for plan in houses]
    return Additions(land, houses, np.array(roofs))


def _sampled(height_at: HeightAt, place: Floats) -> HeightAt:
    """Return the highest of a terrain near points, by a grid around a place, (n, 2) -> (n,) [m].

    Many thousand lines of sight are compared with it, for which the terrain itself is too slow.
    """
    steps = np.arange(-GROWN, GROWN + 0.5 * _GRID, _GRID)
    x, y = np.meshgrid(place[0] + steps, place[1] + steps, indexing="ij")
    heights = np.asarray(height_at(np.column_stack([x.ravel(), y.ravel()])))
    heights = ndimage.maximum_filter(heights.reshape(x.shape), size=3, mode="nearest")

    def land(places: Floats) -> Floats:
        """Return the height of the grid's point next to places, (n, 2) -> (n,) [m]."""
        cell = np.rint((places[:, :2] - place[:2] + GROWN) / _GRID).astype(np.int64)
        row, column = np.clip(cell, 0, len(steps) - 1).T
        return np.asarray(heights[row, column])

    return land


def _houses(
    scenario: Scenario, network: Network, layout: RoadLayout, index: LaneIndex, place: Floats
) -> list[shapely.Geometry]:
    """Plans of houses in rows near a place."""
    if why_none(scenario.polygons) is not None:
        return []
    around = surroundings(index, seed=_SEED, viewpoints=place[None], clearance=Clearance())
    given = Given(scenario.pois, (*scenario.polygons, *stop_areas(network, scenario.stops)))
    rows = grow_rows(network, layout.paved, given, around=around)
    plans = [shapely.Polygon(house.plan) for house in rows.houses]
    middle = shapely.Point(place[:2])
    return [plan for plan in plans if shapely.dwithin(plan, middle, _NEAR)]
