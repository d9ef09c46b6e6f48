"""A camera and a stretch of time become scene data and the state of every frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.job import CameraSettings, Job, LagrangianCamera, SkySettings
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.network import Connection, Network
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import (
    Bsdf,
    FrameState,
    Haze,
    LampSet,
    LeftOut,
    Mover,
    Prototype,
    SceneData,
    Slots,
    StaticPart,
    View,
)
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.scene import needs
from sumo3dviz_pt.scene.cameras import Camera, build_camera
from sumo3dviz_pt.scene.darkness import is_dark
from sumo3dviz_pt.scene.ground import build_ground
from sumo3dviz_pt.scene.materials import MATERIALS
from sumo3dviz_pt.scene.roads import RoadParts, build_roads
from sumo3dviz_pt.scene.roads_strips import BoundsXY
from sumo3dviz_pt.scene.scenery import build_scenery
from sumo3dviz_pt.scene.signals import Signals, build_signals
from sumo3dviz_pt.scene.sky import build_sky
from sumo3dviz_pt.scene.surroundings import surroundings
from sumo3dviz_pt.scene.traffic import Fleet, build_fleet, find_rider

ROAD_REACH = 2500.0
"""Roads farther from every eye than this vanish in the haze [m]."""

_MOST_VIEWS = 120


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """What a shot shows.

    Attributes:
        data: What does not change.
        fleet: Everyone on the road.
        camera: Where it is seen from.
        signals: The traffic lights.
        footway: Extra height of the walkable surface at points, (n, 2) -> (n,) [m].
        aspect: Height / width of the picture.
        limit: Road users in detail in one frame, at most.
        phases: The signal log.
    """

    data: SceneData
    fleet: Fleet
    camera: Camera
    signals: Signals
    footway: Callable[[Floats], Floats]
    aspect: float
    limit: int
    phases: Mapping[str, SignalPhases]

    def states_at(self, time: float) -> dict[str, str]:
        """State string of every logged traffic light at a time [s], by tls id."""
        states = {tls: phases.state_at(time) for tls, phases in self.phases.items()}
        return {tls: state for tls, state in states.items() if state is not None}

    def frame_at(self, time: float) -> FrameState:
        """The state of the frame at a time [s].

        Raises:
            ConfigError: If the camera rides with someone who does not exist then.
        """
        view = self.camera.view_at(time)
        movers = self._on_footways(self.fleet.movers_at(time, view=view))
        gaze = needs.Gaze.of([view], aspect=self.aspect)
        positions = np.array([mover.world_from_body.position for mover in movers]).reshape(-1, 1, 3)
        alive = np.ones((len(movers), 1), dtype=np.bool_)
        choice = needs.choose(gaze, alive, positions, limit=self.limit)
        return FrameState(
            time,
            view,
            tuple(m for m, near in zip(movers, choice.near[:, 0], strict=True) if near),
            tuple(m for m, far in zip(movers, choice.far[:, 0], strict=True) if far),
            self.signals.radiance_at(time),
        )

    def under_sky(self, settings: SkySettings) -> Shot:
        """The same shot under another sky; nothing else is built again.

        Args:
            settings: A preset, a file, or a sun by angles.

        Raises:
            ConfigError: If settings contradict each other or name what is unknown.
        """
        sky = build_sky(settings)
        lamps = tuple(replace(lamps, sampled=is_dark(sky)) for lamps in self.data.lamps)
        return replace(self, data=replace(self.data, sky=sky, lamps=lamps))

    def _on_footways(self, movers: Sequence[Mover]) -> tuple[Mover, ...]:
        """Lift walkers onto raised footways."""
        walkers = [index for index, mover in enumerate(movers) if mover.id.startswith("person:")]
        if not walkers:
            return tuple(movers)
        spots = np.array([movers[index].world_from_body.position[:2] for index in walkers])
        lifted = list(movers)
        for index, height in zip(walkers, self.footway(spots), strict=True):
            up = Transform.from_pose([0.0, 0.0, float(height)])
            mover = movers[index]
            lifted[index] = replace(mover, world_from_body=up @ mover.world_from_body)
        return tuple(lifted)


def build_shot(
    scenario: Scenario,
    trajectories: Sequence[Trajectory],
    job: Job,
    *,
    camera: CameraSettings,
    times: Floats,
) -> Shot:
    """Build everything that a shot needs, and nothing else.

    Args:
        scenario: The simulation.
        trajectories: Its smoothed motion.
        job: The scene file.
        camera: The shot's camera.
        times: Of all frames of the whole shot, (n,) [s].

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    fleet = build_fleet(trajectories, scenario.vehicle_types, job.vehicles, seed=job.seed)
    if isinstance(camera, LagrangianCamera):
        fleet = fleet.with_cockpit(find_rider(fleet, camera.vehicle).key)
    built = build_camera(camera, fleet=fleet, left_hand=scenario.network.left_hand)
    aspect = job.output.size[1] / job.output.size[0]
    every = max(1, -(-len(times) // _MOST_VIEWS))
    sparse = [built.view_at(float(time)) for time in times[::every]]
    gaze = needs.Gaze.of(sparse, aspect=aspect)
    sky = build_sky(job.sky, location=scenario.network.location)
    dark = is_dark(sky, job.lights)
    place = _place(scenario, job, gaze, dark=dark)
    crowd = _crowd(fleet, built, times, aspect)
    shown = sorted({*crowd.slots.near, *crowd.slots.far})
    opened = {name: fleet.prototypes[name] for name in shown}
    data = SceneData(
        materials=_materials(place, opened.values(), fleet.materials),
        static=place.static,
        prototypes=opened,
        lamps=tuple(replace(lamps, sampled=dark) for lamps in place.lamps),
        sky=sky,
        slots=crowd.slots,
        haze=Haze(),
        left_out=place.left_out + _nobody(scenario, fleet, crowd),
    )
    return Shot(
        data,
        fleet,
        built,
        place.signals,
        place.roads.surface_height_at,
        aspect,
        crowd.limit,
        scenario.signals,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Everything that does not move."""

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    roads: RoadParts
    signals: Signals
    lamps: tuple[LampSet, ...]
    left_out: tuple[LeftOut, ...]


def _place(scenario: Scenario, job: Job, gaze: needs.Gaze, *, dark: bool) -> _Place:
    """Build roads, ground, scenery and signals around the camera's path."""
    low, high = gaze.positions.min(axis=0), gaze.positions.max(axis=0)
    region = (
        float(low[0]) - ROAD_REACH,
        float(low[1]) - ROAD_REACH,
        float(high[0]) + ROAD_REACH,
        float(high[1]) + ROAD_REACH,
    )
    network = scenario.network
    roads = build_roads(network, job.roads, textured=job.textured, region=region)
    ground = build_ground(job.ground, network, roads=roads.layout, textured=job.textured)
    around = surroundings(network, seed=job.seed, gaze=gaze, height_at=ground.height_at)
    scenery = build_scenery(
        scenario.pois, scenario.polygons, job.objects, around=around, textured=job.textured
    )
    near = replace(network, connections=_connections_in(network, region))
    signals = build_signals(near, scenario.signals, job.signals, index=around.index)
    parts = (*roads.static, *ground.static, *scenery.static, *signals.static)
    return _Place(
        tuple(part for part in parts if len(part.part.mesh.faces)),
        {**MATERIALS, **roads.materials, **ground.materials, **scenery.materials},
        roads,
        signals,
        signals.lamps,
        (*scenery.left_out, *signals.left_out),
    )


def _connections_in(network: Network, region: BoundsXY) -> tuple[Connection, ...]:
    """Connections that begin within a box."""
    x0, y0, x1, y1 = region

    def inside(connection: Connection) -> bool:
        x, y = network.lanes[connection.from_lane].shape[-1][:2]
        return bool(x0 <= x <= x1 and y0 <= y <= y1)

    return tuple(connection for connection in network.connections if inside(connection))


def _crowd(fleet: Fleet, camera: Camera, times: Floats, aspect: float) -> needs.CrowdPlan:
    """Plan who is drawn how over the whole shot."""
    if not fleet.keys:
        return needs.CrowdPlan(Slots(), needs.MOST_NEAR)
    frames = []
    riders: set[str] = set()
    for part in needs.chunks(len(times)):
        views: list[View] = [camera.view_at(float(time)) for time in times[part]]
        riders |= {view.rides_in for view in views if view.cutaway and view.rides_in}
        alive, positions, _ = fleet.positions(times[part])
        frames.append((needs.Gaze.of(views, aspect=aspect), alive, positions))
    bodies = [
        fleet.cockpits.get(key, body.prototype.name) if key in riders else body.prototype.name
        for key, body in zip(fleet.keys, fleet.bodies, strict=True)
    ]
    return needs.plan_crowd(bodies, frames)


def _materials(
    place: _Place, prototypes: Iterable[Prototype], own: Mapping[str, Bsdf]
) -> dict[str, Bsdf]:
    """Only the materials in use."""
    used = {part.part.material for part in place.static}
    for prototype in prototypes:
        used |= {part.material for part in (*prototype.parts, *prototype.far)}
    if place.lamps:
        used.add("signal_lens")
    known = {**place.materials, **own}
    return {name: known[name] for name in sorted(used)}


def _nobody(scenario: Scenario, fleet: Fleet, crowd: needs.CrowdPlan) -> tuple[LeftOut, ...]:
    """Say which road users need nothing here."""
    out = []
    kinds = {trace.kind for trace in scenario.traffic.traces}
    if "person" not in kinds:
        out.append(LeftOut("persons", "the log has none in this time"))
    unused = sorted(set(fleet.prototypes) - set(crowd.slots.near) - set(crowd.slots.far))
    if unused:
        out.append(LeftOut(f"{len(unused)} bodies", "nobody in view of the shot shows them"))
    return tuple(out)
