"""A camera and a stretch of time become scene data and the state of every frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet, Level
from sumo3dviz_pt.cast.lamps import in_fog, running_lights
from sumo3dviz_pt.cast.poses import Present
from sumo3dviz_pt.job.settings import CameraSettings, Lights, SkySettings
from sumo3dviz_pt.library.vehicles.plates import LETTER
from sumo3dviz_pt.model.camera import CameraPath, frame_step
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import FrameState, Haze, Moment, Mover, SceneData, Slots, View
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot import crowd as visibility
from sumo3dviz_pt.shot.cameras.aiming import Camera
from sumo3dviz_pt.shot.crowd import (
    SHOT_TRIANGLES,
    CrowdFrames,
    CrowdPlan,
    absent_users,
    can_be_full,
    fitting,
    plan_crowd,
    shown_bodies,
    used_materials,
)
from sumo3dviz_pt.shot.falling import Flying
from sumo3dviz_pt.shot.in_wind import in_wind
from sumo3dviz_pt.shot.making_room import with_room
from sumo3dviz_pt.shot.road_users import (
    camera_path_of,
    countable,
    everyone,
    exposed_camera,
    moments_of,
    with_seat,
)
from sumo3dviz_pt.shot.tracks import on_tracks, on_what_is_drawn, ruts, wheel_tracks
from sumo3dviz_pt.world.build import World
from sumo3dviz_pt.world.cache import place_around
from sumo3dviz_pt.world.objects.stands import Stands
from sumo3dviz_pt.world.rails.crossings import Railway
from sumo3dviz_pt.world.roads.layout import RoadOwners
from sumo3dviz_pt.world.signals.signals import Signals
from sumo3dviz_pt.world.sky import build_sky, is_dark
from sumo3dviz_pt.world.weather import in_weather


@dataclass(slots=True, eq=False)
class _SeenParts:
    """Parts of road users while they are collected.

    Attributes:
        near: In detail.
        deforming: In detail, of those that take poses.
        far: Stand-ins.
    """

    near: list[Mover] = field(default_factory=list)
    deforming: list[Mover] = field(default_factory=list)
    far: list[Mover] = field(default_factory=list)


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """What a shot shows.

    Attributes:
        data: What does not change.
        fleet: Everyone on the road.
        camera: Where it is seen from.
        signals: The traffic lights.
        railway: The level crossings, whose barriers move.
        stands: Plants that share models.
        footway: Extra height of the walkable surface at points, (n, 2 or 3) -> (n,) [m].
        tracks: The same of the rails that trains stand on, or None.
        road_owners: Tell which edge or junction faces of its roads belong to.
        flying: What falls and flies before its camera, or None.
        settled: Puts a fleet onto the roads that are drawn.
        aspect: Height / width of the picture.
        limit: Road users in detail in one frame, at most.
        full_models: Models that are drawn in full detail where they are near enough.
        phases: The signal log.
        dark: Whether everyone has lights on.
        places: Around which there is detail for cameras that may go anywhere, (n, 3) [m];
            None where the shot's own camera is the only one.
    """

    data: SceneData
    fleet: Fleet
    camera: Camera
    signals: Signals
    railway: Railway
    stands: Stands
    footway: Callable[[Floats], Floats]
    aspect: float
    limit: int
    full_models: frozenset[str]
    phases: Mapping[str, SignalPhases]
    dark: bool
    places: Floats | None = None
    tracks: Callable[[Floats], Floats] | None = None
    road_owners: RoadOwners | None = None
    flying: Flying | None = None
    settled: Callable[[Fleet], Fleet] | None = None

    def present_at(self, time: float) -> Present:
        """Return everyone who exists at a time [s], people on raised footways."""
        return self._on_footways(self.fleet.presence.at(time))

    def states_at(self, time: float) -> dict[str, str]:
        """Return the state string of every logged traffic light at a time [s], by tls id."""
        states = {tls: phases.state_at(time) for tls, phases in self.phases.items()}
        return {tls: state for tls, state in states.items() if state is not None}

    def frame_at(self, time: float) -> FrameState:
        """Return the state of the frame at a time [s], in the middle of its exposure.

        Raises:
            ConfigError: If the camera rides with a road user that does not exist then.
        """
        moment = self.camera.shutter.at(time).middle
        return self.frame_of(moment, self.camera.view_at(moment))

    def exposed_at(self, time: float, *, samples: int) -> FrameState:
        """Return the state of the frame at a time [s], with all moments of its exposure.

        Args:
            time: The frame's [s].
            samples: Of a pixel; there are no more moments.

        Raises:
            ConfigError: If the camera rides with a road user that does not exist then.
        """
        frame, shutter = self.frame_at(time), self.camera.shutter
        if shutter.is_instant:
            return frame
        shutter = replace(shutter.at(time), moments=min(shutter.moments, max(samples, 1)))
        moments = [(rows, self.camera.view_at(at), at) for at, rows in shutter.exposures()]
        exposure = tuple(Moment(rows, self.frame_of(at, view)) for rows, view, at in moments)
        return replace(frame, exposure=exposure)

    def frame_of(self, time: float, view: View, *, detail: float = 1.0) -> FrameState:
        """Return the state of a frame that another camera takes.

        Args:
            time: SUMO's [s].
            view: Of that camera; a shot has room for what its own cameras see.
            detail: How far there is detail, as a share of how far there is in a film.
        """
        # Choose how each road user is drawn.
        present = self.present_at(time)
        drawn = [self.fleet.bodies[k].assembly.drawn for k in present.users.tolist()]
        camera_path = CameraPath.of([view], aspect=self.aspect)
        opened = self.fleet.places.get(view.rides_in or "", -1) if view.cutaway else -1
        choice = visibility.choose(
            camera_path,
            np.ones((len(drawn), 1), dtype=np.bool_),
            present.positions[:, None],
            limit=self.limit,
            can_be_full=can_be_full(drawn, self.full_models) & (present.users != opened),
            lengths=self.fleet.lengths[present.users],
        )
        if detail < 1.0:
            away = camera_path.away(present.positions[:, None])[:, 0]
            choice = choice.coarser(away > detail * visibility.near_end(camera_path))
        if self.places is not None:
            distances = np.linalg.norm(present.positions - view.position, axis=1)
            choice = fitting(choice, drawn, self.data.slots, distances)
        parts = self._parts(present, choice, view)
        weather = None if self.data.weather is None else self.data.weather.at(time)
        frame = FrameState(
            time,
            view,
            tuple(parts.near),
            tuple(parts.far),
            {**self.signals.radiance_at(time), **self.railway.radiance_at(time)},
            tuple(parts.deforming),
            (*self.railway.movers_at(time), *self.stands.movers_at(time, weather)),
            weather,
        )
        if self.flying is None:
            return frame
        camera = None if self.places is not None else self.camera
        flying = partial(self.flying.at, frame, present=present, camera=camera)
        return replace(frame, flying=flying)

    def _parts(self, present: Present, choice: visibility.Choice, view: View) -> _SeenParts:
        """The parts of all road users that are seen."""
        parts = _SeenParts()
        whole_detail, by_proxy = choice.full[:, 0], choice.far[:, 0]
        seen = np.flatnonzero(choice.near[:, 0] | whole_detail | by_proxy)
        wholes = self.fleet.wholes(present, seen, view=view)
        for row, whole in zip(seen.tolist(), wholes, strict=True):
            level: Level = "far" if by_proxy[row] else "full" if whole_detail[row] else "near"
            vclass = self.fleet.bodies[int(present.users[row])].vclass
            ridden, read = whole.id == view.rides_in, bool(choice.lettered[row, 0])
            made = self.fleet.parts(present, row, whole, level=level, ridden=ridden, lettered=read)
            for part in on_tracks(made, vclass, self.tracks):
                moves = self.fleet.prototypes[part.prototype].poses is not None
                some = parts.far if by_proxy[row] else parts.deforming if moves else parts.near
                some.append(part)
        return parts

    def parts_at(self, time: float, *, near: Floats, reach: float) -> Iterator[Mover]:
        """Yield the parts of road users near some places, in detail, whoever looks.

        Args:
            time: SUMO's [s].
            near: Places, (n, 3) [m].
            reach: How far from one of them, on the map [m].
        """
        present = self.present_at(time)
        away = present.positions[:, None, :2] - near[None, :, :2]
        rows = np.flatnonzero((np.linalg.norm(away, axis=2) <= reach).any(axis=1))
        wholes = self.fleet.wholes(present, rows)
        for row, whole in zip(rows.tolist(), wholes, strict=True):
            vclass = self.fleet.bodies[int(present.users[row])].vclass
            made = self.fleet.parts(present, row, whole, level="near", ridden=False)
            yield from on_tracks(made, vclass, self.tracks)

    def under_sky(self, settings: SkySettings, lights: Lights = "auto") -> Shot | None:
        """Return the same shot under another sky; nothing else is built again.

        Args:
            settings: A preset, a file, or a sun by angles.
            lights: The scene file's word on lamps.

        Returns:
            None if lamps are lit or go out with that sky: what shines is built with a shot.

        Raises:
            ConfigError: If settings contradict each other or name what is unknown.
        """
        sky = in_weather(build_sky(settings), self.data.weather)
        if is_dark(sky, lights) != self.dark:
            return None
        return replace(self, data=replace(self.data, sky=sky))

    def driven_by(
        self, fleet: Fleet, phases: Mapping[str, SignalPhases], *, world: World
    ) -> Shot | None:
        """Return the same shot with others on its roads and other signals; nothing else is built.

        Args:
            fleet: Everyone on the road, at the log's heights.
            phases: The signal log.
            world: What exists, as it did when the shot was built.

        Returns:
            None where a barrier moves that was built as one that never does.
        """
        assert self.settled is not None
        network, yellow = world.scenario.network, world.job.signals
        railway = self.railway.following(phases, network)
        if railway is None:
            return None
        cockpits = {key: own for key, own in self.fleet.cockpits.items() if key in fleet.places}
        fleet = replace(
            self.settled(fleet),
            cockpits=cockpits,
            prototypes={**fleet.prototypes, **self.fleet.prototypes},
        )
        return replace(
            self,
            fleet=fleet,
            phases=phases,
            signals=self.signals.following(phases, yellow),
            railway=railway,
            flying=None if self.flying is None else replace(self.flying, fleet=fleet),
        )

    def _on_footways(self, present: Present) -> Present:
        """Lift walkers onto raised footways."""
        walkers = np.flatnonzero(self.fleet.on_foot[present.users])
        if not len(walkers):
            return present
        lifted = present.positions.copy()
        lifted[walkers, 2] += self.footway(lifted[walkers])
        return replace(present, positions=lifted)


def build_shot(
    world: World, trajectories: Sequence[Trajectory], *, camera: CameraSettings, times: Floats
) -> Shot:
    """Build everything that a shot shows or is lit by, and nothing else.

    Args:
        world: What exists.
        trajectories: The smoothed motion of everyone on the road.
        camera: The shot's camera.
        times: Of all frames of the whole shot, (n,) [s].

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    job, left_hand = world.job, world.left_hand
    users = everyone(world, trajectories, counted=countable(world, trajectories, camera))
    fleet = with_seat(replace(users, times=times), camera, world=world)
    step = frame_step(times, fps=float(job.output.fps))
    exposed = partial(exposed_camera, camera, left_hand=left_hand, step=step)
    built = exposed(fleet=fleet)
    aspect = job.output.size[1] / job.output.size[0]
    moments = moments_of(built, times)
    camera_path = camera_path_of(built, moments, aspect)
    return ShotBuilder(world, aspect).shot(
        fleet,
        camera_path,
        camera=exposed,
        plan=partial(_crowd, times=moments, aspect=aspect, full=world.job.vehicles.full_models),
    )


@dataclass(frozen=True, slots=True, eq=False)
class ShotBuilder:
    """What a shot is made of, whatever its cameras."""

    world: World
    aspect: float

    def shot(
        self,
        fleet: Fleet,
        camera_path: CameraPath,
        *,
        camera: Callable[..., Camera],
        plan: Callable[..., CrowdPlan],
    ) -> Shot:
        """Put a shot together.

        Args:
            fleet: Everyone on the road, at the log's heights.
            camera_path: Where cameras are and look.
            camera: Builds the camera that it is seen from, of a `fleet`.
            plan: Makes room for road users, `fleet` and `camera`, in a number of triangles,
                `budget`.
        """
        # What stands leaves some triangles for road users.
        scenario, dark, weather = self.world.scenario, self.world.dark, self.world.weather
        job, left_hand = self.world.job, self.world.left_hand
        place = place_around(self.world, camera_path)
        standing = sum(len(part.part.mesh.faces) for part in place.static)
        # Everyone stands on the road that is drawn, and so do those with whom a camera rides.
        fleet = on_what_is_drawn(fleet, place, self.world)
        place = with_room(place, fleet, camera_path)
        built = camera(fleet=fleet)
        crowd = plan(fleet=fleet, camera=built, budget=SHOT_TRIANGLES - standing)
        lettered, counted = LETTER in crowd.slots.deforming, self.world.outlook is not None
        fleet = fleet.with_full_detail(crowd.full_models, lettered=lettered, counted=counted)
        # Put together what does not change.
        shown = shown_bodies(fleet.prototypes, crowd.slots)
        opened = in_fog(shown, weather, left_hand=left_hand)
        bodies = {**opened, **place.railway.prototypes, **place.stands.prototypes}
        eyes, across = camera_path.positions, math.hypot(*job.output.size)
        windswept = in_wind(place.static, weather, camera_path, pixels=across, seed=job.seed)
        data = SceneData(
            materials=used_materials(place, bodies.values(), fleet.materials),
            static=windswept.static,
            prototypes=bodies,
            lamps=place.lamps,
            sky=self.world.sky,
            slots=replace(
                crowd.slots,
                near={**crowd.slots.near, **place.railway.slots, **place.stands.slots},
            ),
            haze=Haze(),
            running=running_lights(
                opened.values(), dark=dark, left_hand=left_hand, weather=weather
            ),
            left_out=place.left_out + absent_users(scenario, fleet, crowd),
            weather=weather,
            tracks=wheel_tracks(weather, self.world.driven, eyes, seed=job.seed),
            ruts=ruts(weather, scenario.network.lanes.values(), eyes),
            swaying=windswept.swaying,
            origin={} if self.world.town is None else self.world.town.origin(scenario),
        )
        return Shot(
            data=data,
            fleet=fleet,
            camera=built,
            signals=place.signals,
            railway=place.railway,
            stands=place.stands,
            footway=place.footway,
            aspect=self.aspect,
            limit=crowd.limit,
            full_models=crowd.full_models,
            phases=scenario.signals,
            dark=dark,
            tracks=place.tracks,
            road_owners=place.road_owners,
            flying=Flying.of(data, fleet, job=job),
            settled=partial(on_what_is_drawn, place=place, world=self.world),
        )


def _crowd(
    *,
    fleet: Fleet,
    camera: Camera,
    times: Floats,
    aspect: float,
    budget: int,
    full: int | None,
) -> CrowdPlan:
    """Plan how road users are drawn over the whole shot, in a number of triangles."""
    if not fleet.keys:
        return CrowdPlan(Slots(), visibility.MOST_NEAR)
    frames = []
    riders: set[str] = set()
    for part in visibility.chunks(len(times)):
        views: list[View] = [camera.view_at(float(time)) for time in times[part]]
        riders |= {view.rides_in for view in views if view.cutaway and view.rides_in}
        alive, positions = fleet.positions(times[part])
        camera_path = CameraPath.of(views, aspect=aspect)
        frames.append(CrowdFrames(camera_path, alive, positions))
    bodies = [fleet.drawn(k, opened=key in riders) for k, key in enumerate(fleet.keys)]
    triangles = {name: body.triangles for name, body in fleet.prototypes.items()}
    return plan_crowd(bodies, frames, triangles=triangles, budget=budget, full=full)
