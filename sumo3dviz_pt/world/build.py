"""What exists, and what of it stands around a camera's path.

The path says where roads are built, and how much of them. What grows without a species (grass,
hedges, far woods) gets its colours of the season.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.library.buildings.shop_words import ENGLISH, language_in
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.plants.species import far_tints, grass_gain, grass_tints, hedge_tints
from sumo3dviz_pt.library.street.road_styles import road_style
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.model.scene import Bsdf, LampSet, LeftOut, Sky, StaticPart, aimed_at
from sumo3dviz_pt.model.traffic import Poi, Polygon, Scenario
from sumo3dviz_pt.model.trajectory import DrivenWays
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.world.areas.build import AreaParts, Below, build_areas, slabs_on
from sumo3dviz_pt.world.areas.slabs import SOURCE as SLABS
from sumo3dviz_pt.world.areas.slabs import Paving, SlabParts, slab_polygons
from sumo3dviz_pt.world.land.cuts import laid_beside
from sumo3dviz_pt.world.land.ground import GroundParts, build_ground, with_fields
from sumo3dviz_pt.world.land.horizon import Room, occupied
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.objects.kinds import INVENTED, kind_of
from sumo3dviz_pt.world.objects.lines import FAMILY as RAILS
from sumo3dviz_pt.world.objects.lines import Rails, guard_rails
from sumo3dviz_pt.world.objects.objects import BUDGET, Scenery, build_scenery
from sumo3dviz_pt.world.objects.stands import Stands
from sumo3dviz_pt.world.outlook import Outlook, RoadChoice, choose_roads
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.placement.surroundings import Surroundings, surroundings
from sumo3dviz_pt.world.plants.near import Meadow, build_meadow, lawn_of, near_eyes, tree_pits
from sumo3dviz_pt.world.plants.trees import (
    Planting,
    before_cameras,
    plant,
    plant_far,
    plot_of,
    why_bare,
    why_nowhere,
)
from sumo3dviz_pt.world.plants.wayside import gardens, verges, wayside, yard_hedges, yard_trees
from sumo3dviz_pt.world.rails.crossings import Railway, build_railway
from sumo3dviz_pt.world.roads.detectors import build_loops
from sumo3dviz_pt.world.roads.layout import RoadOwners, owners_of_roads
from sumo3dviz_pt.world.roads.roads import (
    DrawnSurface,
    RoadParts,
    build_roads,
    drawn_surface,
    with_plain,
)
from sumo3dviz_pt.world.roads.strips import BoundsXY, connections_in
from sumo3dviz_pt.world.rows.courts import court_height
from sumo3dviz_pt.world.rows.fronts import SOURCE, Given, Rows, grow_rows, in_view, why_none
from sumo3dviz_pt.world.rows.houses import FAMILY, Fronts, build_fronts
from sumo3dviz_pt.world.signals.signals import Signals, build_signals
from sumo3dviz_pt.world.sky import build_sky, is_dark, known_zone
from sumo3dviz_pt.world.street.furniture import stop_areas
from sumo3dviz_pt.world.street.islands import IslandParts, island_parts, island_shrubs, islands_of
from sumo3dviz_pt.world.street.street import build_street, site_of, standing_height
from sumo3dviz_pt.world.structures.tunnels import DAY_SET
from sumo3dviz_pt.world.town.layout import Town, near_cameras, with_town
from sumo3dviz_pt.world.town.parked import parked_cars
from sumo3dviz_pt.world.weather import in_weather, weather_over

_LEAF = "leaf"
_BLADES = ("ground/blades/", "ground/weeds")
_OWN = frozenset({"trees", "shrubs"})  # have their species' colours


def season_of(job: Job) -> str:
    """Return what leaves and grass look like in a scene file."""
    return "summer" if job.weather is None else job.weather.season


def language_at(location: Location) -> str:
    """Return the language of a network's place; English where it is not known.

    Raises:
        ConfigError: If the package that knows time zones is missing.
    """
    if location.place is None:
        return ENGLISH
    latitude, longitude = location.place
    zone = known_zone(latitude=latitude, longitude=longitude)
    return language_in(zone) if zone else ENGLISH


def in_season(parts: Iterable[StaticPart], season: str) -> tuple[StaticPart, ...]:
    """Return what stands, with its colours of a season.

    Args:
        parts: In summer's colours, but for trees and shrubs.
        season: Of the weather.
    """
    if season == "summer":
        return tuple(parts)
    return tuple(_turned(part, season) for part in parts)


def _turned(part: StaticPart, season: str) -> StaticPart:
    """Return a part in a season's colours."""
    tint = part.part.tint
    if part.part.material != _LEAF or tint is None or part.family in _OWN:
        return part
    far = part.family == "ground" and not part.id.startswith(_BLADES)
    change = far_tints if far else grass_tints if part.family == "ground" else hedge_tints
    return replace(part, part=replace(part.part, tint=change(tint, season)))


def grounds_in_season(materials: Mapping[str, Bsdf], season: str) -> Mapping[str, Bsdf]:
    """Return materials whose grounds of grass have their colour of a season."""
    if season == "summer":
        return materials
    gain = list(grass_gain(season))
    return {name: _grassy(bsdf, gain) for name, bsdf in materials.items()}


def _grassy(bsdf: Bsdf, gain: list[float]) -> Bsdf:
    """Return a material with another colour if it is a patchy ground of grass."""
    colour: Any = bsdf.get("base_color")
    if not isinstance(colour, Mapping) or not colour.get("patches"):
        return bsdf
    return {**bsdf, "base_color": {**colour, "gain": gain}}


ROAD_REACH = 2500.0
"""Roads farther from every eye than this vanish in the haze [m]."""

_GRID = 250.0
"""Where roads end is a multiple of this [m]."""

_WIDEST = 100.0
"""Roads reach no farther beyond the middles of lanes [m]."""


def region_of(world: World, camera_path: CameraPath) -> BoundsXY | None:
    """Return where roads and signals are built; None is everywhere.

    It ends at lines of a grid, so that most cameras of a scene share their roads.
    """
    path = np.array(path_box(camera_path))
    low = np.floor((path[:2] - ROAD_REACH) / _GRID) * _GRID
    high = np.ceil((path[2:] + ROAD_REACH) / _GRID) * _GRID
    first, last = world.memory.of(("extent",), partial(_extent, world.scenario.network))
    if (low <= first).all() and (high >= last).all():
        return None
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _extent(network: Network) -> Floats:
    """The south-western and the north-eastern corner of all that is drawn, (2, 2) [m]."""
    shapes = [lane.shape for lane in network.lanes.values()]
    shapes += [junction.outline for junction in network.junctions.values()]
    points = np.concatenate([np.zeros((0, 2)), *(shape[:, :2] for shape in shapes)])
    if not len(points):
        return np.zeros((2, 2))
    # Lanes are wider than their middles.
    return np.stack([points.min(axis=0) - _WIDEST, points.max(axis=0) + _WIDEST])


def path_box(camera_path: CameraPath) -> BoundsXY:
    """Return the box around a camera's way [m]."""
    low, high = camera_path.positions.min(axis=0), camera_path.positions.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def roads_around(world: World, choice: RoadChoice, camera_path: CameraPath) -> RoadParts:
    """Build roads in detail, and beyond them what shows no more than its surface.

    Args:
        world: What exists.
        choice: Which roads are built.
        camera_path: Where the camera is; wear is finer near it.

    Raises:
        ConfigError: If a surface is unknown.
    """
    settings, textured = world.job.roads, world.job.textured
    memory = world.memory.within("chosen", *choice.name)
    roads = build_roads(
        choice.detailed,
        settings,
        textured=textured,
        region=choice.region,
        focus=path_box(camera_path),
        memory=memory,
    )
    if choice.plain is None:
        return roads
    return with_plain(roads, choice.plain, settings, textured=textured, memory=memory)


STATIC_BUDGET = 880_000
"""Triangles of everything that does not move, about; the rest is traffic's."""

_LEAST_SCENERY = 250_000


@dataclass(frozen=True, slots=True, eq=False)
class BuiltPlace:
    """Everything that does not move.

    Attributes:
        static: In world coordinates.
        materials: What it can be made of, by name.
        surface: Of roads, as it is drawn; None where all of it has one height.
        footway: Extra height of the walkable surface at points, (n, 2) -> (n,) [m].
        tracks: The same of the rails that trains stand on, or None.
        road_owners: Tell which edge or junction faces of roads belong to.
        signals: The traffic lights.
        railway: The level crossings.
        lamps: Everything that stands and shines.
        left_out: What was left out, and why.
        stands: Plants that share models.
    """

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    surface: DrawnSurface | None
    footway: Callable[[Floats], Floats]
    tracks: Callable[[Floats], Floats] | None
    road_owners: RoadOwners
    signals: Signals
    railway: Railway
    lamps: tuple[LampSet, ...]
    left_out: tuple[LeftOut, ...]
    stands: Stands


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """What exists, whatever looks at it.

    Attributes:
        scenario: Roads, objects and signals, also invented; its road users belong to the cast.
        job: The scene file; its shots, output and quality have no effect here.
        sky: What lights it.
        clearance: The scene file's cameras that nothing grows into or before.
        memory: What was built of it. All shots of a scene file share one.
        key: A hash of all that it is made from, to keep its places on disk; empty keeps none.
        weather: Over time; None for a dry and clear summer.
        driven: Where all vehicles of the log were, if snow lies.
        outlook: Of a report, which counts and does not render; None builds all.
        town: What of it is invented, if anything.
    """

    scenario: Scenario
    job: Job
    sky: Sky
    clearance: Clearance
    memory: Memory
    key: str = ""
    weather: WeatherCourse | None = None
    driven: DrivenWays | None = None
    outlook: Outlook | None = None
    town: Town | None = None

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        job: Job,
        *,
        clearance: Clearance | None = None,
        memory: Memory | None = None,
        key: str = "",
    ) -> World:
        """Return the world of a scene file.

        Args:
            scenario: As read.
            job: The scene file.
            clearance: As the attribute; default none.
            memory: What was built of the same world before.
            key: As the attribute.

        Raises:
            ConfigError: If the sky's settings contradict each other.
        """
        memory = memory or Memory()
        weather = weather_over(job.weather, scenario.network, memory)
        sky = in_weather(build_sky(job.sky, location=scenario.network.location), weather)
        clear = clearance or Clearance()
        scenario, town = with_town(scenario, job, clear, memory)
        return cls(scenario, job, sky, clear, memory, key, weather, town=town)

    @property
    def dark(self) -> bool:
        """Whether lamps are lit."""
        return is_dark(self.sky, self.job.lights)

    @property
    def left_hand(self) -> bool:
        """Whether traffic keeps left."""
        return self.scenario.network.left_hand


def build_place(world: World, camera_path: CameraPath) -> BuiltPlace:
    """Build roads, ground, scenery, street furniture and signals around a camera's path.

    Args:
        world: What exists.
        camera_path: Where the camera is and looks.

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    job, dark = world.job, world.dark
    scenario = replace(
        world.scenario, polygons=(*world.scenario.polygons, *slab_polygons(world.scenario))
    )
    # Roads and ground, and what grows on it.
    region = region_of(world, camera_path)
    land, areas = _land(world, scenario, camera_path, region)
    roads, around = land.roads, land.around
    scenario = near_cameras(scenario, around)
    islands, areas = _islands(world, land, areas)
    grown = _grown(scenario, job, land, areas)
    # What stands along the roads.
    links = connections_in(scenario.network, region)
    style = road_style(job.roads.marking_style, scenario.network)
    signals = build_signals(
        replace(scenario.network, connections=links),
        scenario.signals,
        job.signals,
        style=style.signals,
        around=around,
        standing=standing_height(roads, land.ground),
    )
    railway = build_railway(
        scenario, links, around=around, style=style, raised=roads.surface_height_at
    )
    feet = np.concatenate([signals.feet, railway.feet])
    site = site_of(scenario, around, roads=roads, ground=land.ground, supports=feet)
    street = build_street(scenario, job.street, site=site, dark=dark, style=style.signs)
    rails = _rails(scenario, job, land)
    loops = build_loops(scenario, job.objects, roads, around)
    # Objects, in as many triangles as the rest leaves.
    beside = (signals, railway, street, islands, loops)
    made = (roads, land.ground, grown.meadow, grown.planting, grown.fronts, *beside)
    fixed = [part for some in made for part in some.static]
    fixed += [*grown.pits, *areas.static, *areas.grown.static]
    fixed += parked_cars(() if world.town is None else world.town.cars, around)
    taken = sum(len(part.part.mesh.faces) for part in fixed)
    scenery = build_scenery(
        grown.scenario.pois,
        (*scenario.polygons, *rails.polygons, *grown.hedges),
        job.objects,
        around=around,
        textured=job.textured,
        budget=min(BUDGET, max(STATIC_BUDGET - taken, _LEAST_SCENERY)),
    )
    sources = (grown.planting, grown.fronts, grown.meadow, areas, rails, scenery, *beside)
    season = season_of(job)
    return BuiltPlace(
        in_season((p for p in (*fixed, *scenery.static) if len(p.part.mesh.faces)), season),
        grounds_in_season({**_materials(land, grown, scenery), **areas.materials}, season),
        drawn_surface(roads.layout),
        land.slabs.walked_on(roads.surface_height_at),
        roads.rail_height_at,
        owners_of_roads(roads.layout),
        signals,
        railway,
        (
            *aimed_at((*signals.lamps, *railway.lamps), dark=dark),
            *scenery.lamps,
            *(some for some in land.ground.lamps if not (dark and some.id == DAY_SET)),
            *grown.fronts.lamps,
            *street.lamps,
        ),
        tuple(out for some in sources for out in some.left_out),
        scenery.stands,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _PreparedLand:
    """What everything stands on, and what it is placed by."""

    roads: RoadParts
    ground: GroundParts
    around: Surroundings
    rows: Rows
    slabs: SlabParts


def _land(
    world: World, whole: Scenario, camera_path: CameraPath, region: BoundsXY | None
) -> tuple[_PreparedLand, AreaParts]:
    """Roads and ground around a camera's path, and what covers the ground.

    Args:
        world: What exists.
        whole: Its scenario, and what its stops take.
        camera_path: Where the camera is and looks.
        region: Where roads are built.
    """
    scenario, job = world.scenario, world.job
    network, textured = scenario.network, job.textured
    # Roads first: everything else stands beside or below them.
    lanes = world.memory.of(("lane index",), partial(build_lane_index, network))
    lay = partial(
        surroundings, lanes, seed=job.seed, camera_path=camera_path, clearance=world.clearance
    )
    choice = choose_roads(network, region, replace(lay(), memory=world.memory))
    roads = roads_around(world, choice, camera_path)
    room = Room(occupied(scenario.pois, scenario.polygons, world.clearance.places), camera_path)
    ground = build_ground(
        job.ground, network, roads=roads.layout, textured=textured, seed=job.seed, room=room
    )
    # What objects are placed by.
    around = lay(height_at=ground.height_at)
    around = replace(
        around,
        dark=world.dark,
        memory=world.memory,
        season=season_of(world.job),
        language=language_at(network.location),
        windy=world.weather is not None and world.weather.strongest_wind > 0.0,
    )
    # What is paved beside roads decides where the ground shows.
    slabs = slabs_on(scenario, job, roads=roads, ground=ground, around=around)
    rows = _rows(world, whole, roads, around)
    if not roads.layout.cells.is_flat:
        courts = Paving(rows.forecourts, court_height(roads.layout))
        ground = laid_beside(ground, [*slabs.pavings, courts], solid=_solid(rows, roads))
        around = replace(around, height_at=ground.height_at)
    below = Below(roads, ground, slabs)
    areas = build_areas(scenario, job, below=below, around=around, region=region)
    return _PreparedLand(roads, areas.ground, around, rows, slabs), areas


def _solid(rows: Rows, roads: RoadParts) -> list[shapely.Geometry]:
    """What needs no wall beside it that holds back the ground."""
    return [*roads.layout.paved, *(shapely.Polygon(house.plan) for house in rows.houses)]


@dataclass(frozen=True, slots=True, eq=False)
class _Grown:
    """What stands where a scenario says nothing, and the scenario with it."""

    scenario: Scenario
    fronts: Fronts
    planting: Planting
    meadow: Meadow
    pits: Sequence[StaticPart]
    hedges: Sequence[Polygon]


def _grown(scenario: Scenario, job: Job, land: _PreparedLand, areas: AreaParts) -> _Grown:
    """Houses along streets, then planting beside them, then grass between all of it."""
    roads, around = land.roads, land.around
    rows, fronts = _fronts(scenario, land)
    scenario = replace(scenario, polygons=(*scenario.polygons, *rows.polygons()))
    drawn = [k for k in scenario.pois if k.source != INVENTED and _is_drawn(k, job)]
    lost = before_cameras(drawn, scenario.network, around)
    planting = _planting(scenario, job, roads, around)
    planting = replace(planting, left_out=(*planting.left_out, *lost))
    yards = gardens(rows) if _why_barren(job) is None else ()
    trees = yard_trees(yards, around)
    planted = (*planting.pois, *trees, *areas.grown.pois)
    scenario = replace(scenario, pois=(*scenario.pois, *planted))
    meadow = _meadow(scenario, job, land, areas, covered=rows.forecourts)
    courts = court_height(roads.layout)
    pits = tree_pits(scenario.pois, rows.forecourts, standing=courts, around=around)
    return _Grown(scenario, fronts, planting, meadow, pits, yard_hedges(yards, around))


def _is_drawn(poi: Poi, job: Job) -> bool:
    """Whether the scene file does not switch off the kind of a point of interest."""
    kind = kind_of(poi.type, poi.source)
    return kind is None or getattr(job.objects, kind) is not None


def _materials(land: _PreparedLand, grown: _Grown, scenery: Scenery) -> dict[str, Bsdf]:
    """Everything that does not move may be made of these."""
    ground = land.ground.materials
    return {
        **MATERIALS,
        **land.roads.materials,
        **(with_fields(ground) if grown.planting.open else ground),
        **scenery.materials,
        **grown.fronts.materials,
    }


def _rows(world: World, scenario: Scenario, roads: RoadParts, around: Surroundings) -> Rows:
    """Rows of houses along city streets where the scenario has no buildings."""
    why, paved, network = why_none(scenario.polygons), roads.layout.paved, scenario.network
    if not world.job.textured:
        why = "everything is shown in plain colours"
    if world.job.street.fronts == "none":
        why = "switched off by `street.fronts`"
    if why is not None:
        return Rows(why=why)
    shapes = (*scenario.polygons, *stop_areas(network, scenario.stops))
    given = Given(scenario.pois, shapes, world.town.characters if world.town else None)
    return grow_rows(network, paved, given, around=around)


def _fronts(scenario: Scenario, land: _PreparedLand) -> tuple[Rows, Fronts]:
    """Rows of houses as they are seen, over areas."""
    rows, roads, around = land.rows, land.roads, land.around
    if rows.why:
        return rows, Fronts(left_out=(LeftOut(FAMILY, rows.why),))
    near = scenario.network.location.boundary[:2]
    return rows, build_fronts(in_view(rows, around), roads.layout, around=around, near=near)


def _why_barren(job: Job) -> str | None:
    """Why our code plants nothing at all, or None."""
    if job.ground.planting == "none":
        return "switched off by `ground.planting`"
    if not job.textured:
        return "everything is shown in plain colours"
    return why_nowhere(job.ground.texture)


def _why_unfurnished(job: Job) -> str | None:
    """Why no islands and guard rails stand, or None."""
    if job.street.furniture == "none":
        return "switched off by `street.furniture`"
    return None if job.textured else "everything is shown in plain colours"


def _planting(scenario: Scenario, job: Job, roads: RoadParts, around: Surroundings) -> Planting:
    """Trees and shrubs where the scenario has none."""
    if (why := _why_barren(job)) is not None:
        return Planting((), (LeftOut("planting", why),))
    plot = plot_of(roads.layout.paved, scenario.pois, scenario.polygons)
    belts, far = wayside(scenario.network, plot, scenario.pois, around=around)
    far = (*far, *verges(scenario.network, plot, around=around))
    own = [item for item in scenario.polygons if item.source not in (SOURCE, INVENTED)]
    why = why_bare([poi for poi in scenario.pois if poi.source != INVENTED], own, around)
    if why is not None:
        return Planting(belts, (LeftOut("planting away from fast roads", why),), far)
    plot = replace(plot, objects=np.array([*plot.objects, *(poi.position for poi in belts)]))
    planted = plant(scenario.network, plot, around=around)
    static = (*far, *plant_far(plot, around=around))
    return replace(planted, pois=(*belts, *planted.pois), static=static, open=True)


def _islands(world: World, land: _PreparedLand, areas: AreaParts) -> tuple[IslandParts, AreaParts]:
    """Kerbed islands between roads, and areas with what grows on those."""
    job, roads, around = world.job, land.roads, land.around
    if (why := _why_unfurnished(job)) is not None:
        return island_parts((), roads.layout, why=why), areas
    find = partial(islands_of, world.scenario.network, roads.layout, around.index)
    islands = roads.layout.memory.of(("islands",), find)
    shrubs = island_shrubs(islands, around) if _why_barren(job) is None else ()
    grown = replace(areas.grown, pois=(*areas.grown.pois, *shrubs))
    bare = (*areas.bare, *(island.shape for island in islands if island.paved))
    return island_parts(islands, roads.layout), replace(areas, grown=grown, bare=bare)


def _rails(scenario: Scenario, job: Job, land: _PreparedLand) -> Rails:
    """Guard rails where the scenario has no fences; none where everything is plain."""
    if (why := _why_unfurnished(job)) is not None:
        return Rails(left_out=(LeftOut(RAILS, why),))
    slabs = [shapely.Polygon(k.shape) for k in scenario.polygons if k.source == SLABS]
    paved = [*land.roads.layout.paved, *slabs]
    return guard_rails(scenario.network, paved, scenario.polygons, around=land.around)


def _meadow(
    scenario: Scenario,
    job: Job,
    land: _PreparedLand,
    areas: AreaParts,
    *,
    covered: Sequence[shapely.Polygon],
) -> Meadow:
    """Blades of grass near the cameras; none where everything is plain."""
    if not job.textured:
        return Meadow((), (LeftOut("grass blades", "everything is shown in plain colours"),))
    lawn = lawn_of(
        job.ground.texture,
        paved=[*land.roads.layout.paved, *areas.bare],
        pois=scenario.pois,
        polygons=scenario.polygons,
        eyes=land.around.viewpoints,
        mown=areas.mown,
    )
    lawn = replace(lawn, covered=near_eyes(covered, land.around.viewpoints))
    return build_meadow(lawn, around=land.around)
