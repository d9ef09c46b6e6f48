"""Everything of a shot that does not move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.job import Job
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import Bsdf, LeftOut, StaticPart
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.scene import needs
from sumo3dviz_pt.scene.ground import build_ground, with_fields
from sumo3dviz_pt.scene.guard_rails import guard_rails
from sumo3dviz_pt.scene.materials import MATERIALS
from sumo3dviz_pt.scene.meadow import Meadow, build_meadow, lawn_of
from sumo3dviz_pt.scene.planting import Planting, plant, plot_of, why_bare, why_nowhere
from sumo3dviz_pt.scene.planting_far import plant_far
from sumo3dviz_pt.scene.roads import RoadParts, build_roads
from sumo3dviz_pt.scene.roads_strips import BoundsXY
from sumo3dviz_pt.scene.scenery import BUDGET, build_scenery
from sumo3dviz_pt.scene.signals import Signals, build_signals
from sumo3dviz_pt.scene.street import build_street, site_of
from sumo3dviz_pt.scene.street_fronts import SOURCE, Rows, grow_rows, why_none
from sumo3dviz_pt.scene.street_houses import FAMILY, Fronts, build_fronts, court_height
from sumo3dviz_pt.scene.surroundings import Surroundings, surroundings
from sumo3dviz_pt.scene.tree_pits import tree_pits
from sumo3dviz_pt.scene.verges import verges
from sumo3dviz_pt.scene.wayside import wayside
from sumo3dviz_pt.scene.woods import Room, occupied

STATIC_BUDGET = 880_000
"""Triangles of everything that does not move, about; the rest is traffic's."""

_LEAST_SCENERY = 250_000

ROAD_REACH = 2500.0
"""Roads farther from every eye than this vanish in the haze [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Everything that does not move.

    Attributes:
        static: In world coordinates.
        materials: What it can be made of, by name.
        roads: Where people walk, among others.
        signals: The traffic lights.
        lamps: Everything that stands and shines.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    roads: RoadParts
    signals: Signals
    lamps: tuple[LampSet, ...]
    left_out: tuple[LeftOut, ...]


def build_place(scenario: Scenario, job: Job, gaze: needs.Gaze, *, dark: bool) -> Place:
    """Build roads, ground, scenery, street furniture and signals around a camera's path.

    Args:
        scenario: The simulation.
        job: The scene file.
        gaze: Where the camera is and looks.
        dark: Whether lamps are lit.

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    low, high = gaze.positions.min(axis=0), gaze.positions.max(axis=0)
    region = (
        float(low[0]) - ROAD_REACH,
        float(low[1]) - ROAD_REACH,
        float(high[0]) + ROAD_REACH,
        float(high[1]) + ROAD_REACH,
    )
    network = scenario.network
    path = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    roads = build_roads(network, job.roads, textured=job.textured, region=region, focus=path)
    ground = build_ground(
        job.ground,
        network,
        roads=roads.layout,
        textured=job.textured,
        seed=job.seed,
        room=Room(occupied(scenario.pois, scenario.polygons, gaze.positions), gaze),
    )
    around = surroundings(network, seed=job.seed, gaze=gaze, height_at=ground.height_at)
    around = replace(around, dark=dark)
    rows, fronts = _fronts(scenario, job, roads, around)
    own = scenario.polygons
    scenario = replace(scenario, polygons=(*own, *rows.polygons()))
    planting = _planting(scenario, job, roads, around)
    scenario = replace(scenario, pois=(*scenario.pois, *planting.pois))
    meadow = _meadow(scenario, job, roads, around)
    near = replace(network, connections=_connections_in(network, region))
    signals = build_signals(
        near, scenario.signals, job.signals, around=around, raised=roads.surface_height_at
    )
    site = site_of(scenario, around, roads=roads, ground=ground, supports=signals.feet)
    street = build_street(scenario, job.street, site=site, dark=dark)
    fixed = (
        *roads.static,
        *ground.static,
        *meadow.static,
        *planting.static,
        *fronts.static,
        *signals.static,
        *street.static,
    )
    courts = court_height(roads.layout)
    pits = tree_pits(scenario.pois, rows.forecourts, standing=courts, around=around)
    fixed = (*fixed, *pits)
    taken = sum(len(part.part.mesh.faces) for part in fixed)
    rails = _rails(scenario.network, job, roads, (own, around))
    scenery = build_scenery(
        scenario.pois,
        (*own, *rails),
        job.objects,
        around=around,
        textured=job.textured,
        budget=min(BUDGET, max(STATIC_BUDGET - taken, _LEAST_SCENERY)),
    )
    parts = (*fixed, *scenery.static)
    return Place(
        tuple(part for part in parts if len(part.part.mesh.faces)),
        {
            **MATERIALS,
            **roads.materials,
            **(with_fields(ground.materials) if planting.open else ground.materials),
            **scenery.materials,
            **fronts.materials,
        },
        roads,
        signals,
        (*aimed_at(signals.lamps, dark=dark), *scenery.lamps, *fronts.lamps, *street.lamps),
        (
            *planting.left_out,
            *fronts.left_out,
            *meadow.left_out,
            *scenery.left_out,
            *signals.left_out,
            *street.left_out,
        ),
    )


def aimed_at(lamps: Sequence[LampSet], *, dark: bool) -> tuple[LampSet, ...]:
    """Lamps that change, with light paths that aim at them only when it is dark."""
    return tuple(replace(some, sampled=dark) if some.radiance is None else some for some in lamps)


def _fronts(
    scenario: Scenario, job: Job, roads: RoadParts, around: Surroundings
) -> tuple[Rows, Fronts]:
    """Rows of houses along city streets where the scenario has no buildings over areas."""
    why = why_none(scenario.polygons)
    if not job.textured:
        why = "everything is shown in plain colours"
    if job.street.fronts == "none":
        why = "switched off by `street.fronts`"
    if why is not None:
        return Rows(), Fronts(left_out=(LeftOut(FAMILY, why),))
    paved = list(roads.layout.outline)
    rows = grow_rows(scenario.network, paved, (scenario.pois, scenario.polygons), around=around)
    near = scenario.network.location.boundary[:2]
    return rows, build_fronts(rows, roads.layout, around=around, near=near)


def _planting(scenario: Scenario, job: Job, roads: RoadParts, around: Surroundings) -> Planting:
    """Trees and shrubs where the scenario has none."""
    why = why_nowhere(job.ground.texture)
    if not job.textured:
        why = "everything is shown in plain colours"
    if job.ground.planting == "none":
        why = "switched off by `ground.planting`"
    if why is not None:
        return Planting((), (LeftOut("planting", why),))
    plot = plot_of(list(roads.layout.outline), scenario.pois, scenario.polygons)
    belts, far = wayside(scenario.network, plot, scenario.pois, around=around)
    far = (*far, *verges(scenario.network, plot, around=around))
    own = [item for item in scenario.polygons if item.source != SOURCE]
    why = why_bare(scenario.pois, own, around)
    if why is not None:
        return Planting(belts, (LeftOut("planting away from fast roads", why),), far)
    plot = replace(plot, objects=np.array([*plot.objects, *(poi.position for poi in belts)]))
    found = plant(scenario.network, plot, around=around)
    static = (*far, *plant_far(plot, around=around))
    return replace(found, pois=(*belts, *found.pois), static=static, open=True)


def _rails(
    network: Network, job: Job, roads: RoadParts, how: tuple[Sequence[Polygon], Surroundings]
) -> tuple[Polygon, ...]:
    """Guard rails where the scenario has no fences; none where everything is plain."""
    own, around = how
    if not job.textured or job.street.furniture == "none" or not len(around.viewpoints):
        return ()
    return guard_rails(network, list(roads.layout.outline), own, around=around)


def _meadow(scenario: Scenario, job: Job, roads: RoadParts, around: Surroundings) -> Meadow:
    """Blades of grass near the cameras; none where everything is plain."""
    if not job.textured:
        return Meadow((), (LeftOut("grass blades", "everything is shown in plain colours"),))
    lawn = lawn_of(
        job.ground.texture,
        paved=list(roads.layout.outline),
        pois=scenario.pois,
        polygons=scenario.polygons,
        eyes=around.viewpoints,
    )
    return build_meadow(lawn, around=around)


def _connections_in(network: Network, region: BoundsXY) -> tuple[Connection, ...]:
    """Connections that begin within a box."""
    x0, y0, x1, y1 = region

    def inside(connection: Connection) -> bool:
        x, y = network.lanes[connection.from_lane].shape[-1][:2]
        return bool(x0 <= x <= x1 and y0 <= y <= y1)

    return tuple(connection for connection in network.connections if inside(connection))
