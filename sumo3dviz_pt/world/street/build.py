"""Street lamps, signs and furniture: where they stand, and what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import StreetSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import LeftOut, Part, StaticPart
from sumo3dviz_pt.world.land.build import GroundParts
from sumo3dviz_pt.world.objects.build import merged
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings
from sumo3dviz_pt.world.roads.build import RoadParts
from sumo3dviz_pt.world.roads.heights import heights_near
from sumo3dviz_pt.world.street.corners import place_corners
from sumo3dviz_pt.world.street.furniture import furniture_parts, place_furniture, place_stops
from sumo3dviz_pt.world.street.lamps import REACH, lamp_parts, lamp_sets, place_lamps
from sumo3dviz_pt.world.street.places import Border, Site, borders_near, crossing_areas
from sumo3dviz_pt.world.street.signs import GANTRY_REACH, place_signs

FAMILIES = ("street lamps", "signs", "furniture")
"""What users call the families."""


@dataclass(frozen=True, slots=True, eq=False)
class StreetParts:
    """Street furniture, ready for the scene.

    Attributes:
        static: Few parts per family.
        lamps: What shines by night.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...] = ()
    lamps: tuple[LampSet, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def build_street(
    scenario: Scenario,
    settings: StreetSettings,
    *,
    site: Site,
    dark: bool,
) -> StreetParts:
    """Build street lamps, signs and furniture near the camera's path.

    Args:
        scenario: Roads, POIs and stops.
        settings: Which of them stand by themselves.
        site: Where things may stand; see `site_of`.
        dark: Whether lamps shine.
    """
    network = scenario.network
    borders = borders_near(network, site.around, reach=GANTRY_REACH)
    near = [border for border in borders if _within(border, site.around, REACH)]
    shelters, stop_signs, cramped = place_stops(network, scenario.stops, site)
    signs = place_signs(network, borders, site) if settings.signs == "auto" else []
    auto = settings.lamps == "auto"
    lamps = place_lamps(near if auto else [], scenario.pois, site)
    pieces = place_furniture(near, scenario.pois, site, auto=settings.furniture == "auto")
    if settings.furniture == "auto":
        pieces += place_corners(network, site)
    parts: dict[str, Sequence[Part]] = {
        "street lamps": lamp_parts(lamps, site, dark=dark),
        "signs": [*signs, *stop_signs],
        "furniture": furniture_parts([*shelters, *pieces], site),
    }
    static = [part for family in FAMILIES for part in merged(family, parts[family])]
    return StreetParts(
        tuple(static),
        lamp_sets(lamps, site) if dark else (),
        _absent(parts, settings, cramped),
    )


def site_of(
    scenario: Scenario,
    around: Surroundings,
    *,
    roads: RoadParts,
    ground: GroundParts,
    supports: Floats,
) -> Site:
    """The ground that street furniture stands on.

    Args:
        scenario: Its trees, houses and fences keep their places.
        around: Lanes, cameras and chance.
        roads: Sidewalks and their height.
        ground: Everything else.
        supports: Feet of signals, (n, 2) [m].
    """
    trees = [poi.position for poi in scenario.pois if kind_of(poi.type, poi.source) is not None]
    taken = np.array([*trees, *supports.tolist()], dtype=np.float64).reshape(-1, 2)
    lines = [
        shapely.LineString(item.shape[:, :2])
        for item in scenario.polygons
        if len(item.shape) > 1 and kind_of(item.type, item.source) == "fences"
    ]
    walls = [
        shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
        for item in scenario.polygons
        if len(item.shape) > 2 and kind_of(item.type, item.source) == "buildings"
    ]
    return Site(
        around,
        standing_height(roads, ground),
        crossing_areas(scenario.network),
        taken,
        shapely.STRtree([*lines, *walls]),
    )


def standing_height(roads: RoadParts, ground: GroundParts) -> HeightAt:
    """Height of whatever lies on top: sidewalk, road or ground."""
    tree = shapely.STRtree(roads.layout.outline)

    def height_at(places: Floats) -> Floats:
        """Height at places, (n, 2) -> (n,) [m]."""
        heights = np.array(ground.height_at(places), dtype=np.float64)
        paved = np.unique(tree.query(shapely.points(places), predicate="intersects")[0])
        if len(paved):
            spots = places[paved]
            heights[paved] = heights_near(roads.layout.cells, spots)
            heights[paved] += roads.surface_height_at(spots)
        return heights

    return height_at


def _within(border: Border, around: Surroundings, reach: float) -> bool:
    """Whether a part of an edge is near a camera."""
    at = np.linspace(0.0, border.length, max(2, int(border.length / 100.0) + 1))
    return bool(around.distances(border.at(at, 0.0)[0]).min() < reach)


def _absent(
    parts: dict[str, Sequence[Part]], settings: StreetSettings, cramped: int
) -> tuple[LeftOut, ...]:
    """Say what is missing and why."""
    given = {"street lamps": "lamps", "signs": "signs", "furniture": "furniture"}
    left_out = []
    for family, key in given.items():
        if not parts[family]:
            off = getattr(settings, key) == "none"
            why = f"switched off by `street.{key}`" if off else "no road near the camera has any"
            left_out.append(LeftOut(family, why))
    if cramped:
        left_out.append(LeftOut(f"{cramped} bus shelters", "there is no room beside the stop"))
    return tuple(left_out)
