"""A shot for cameras that go anywhere, such as a client's in the viewer.

It is not known where the camera will be and look. So everything around some places is built,
in all directions, and there is room for everyone on the road, at least as a stand-in.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import CameraSettings, Job, LagrangianCamera
from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import Slots, View
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot import visibility
from sumo3dviz_pt.shot.build import Shot, ShotBuilder
from sumo3dviz_pt.shot.cameras.build import Camera, build_camera
from sumo3dviz_pt.shot.cameras.standing import StandingCamera
from sumo3dviz_pt.shot.crowd import CrowdFrames, CrowdPlan, plan_crowd
from sumo3dviz_pt.shot.road_users import everyone, with_seat
from sumo3dviz_pt.world.build import World

_STEP = 1.0
"""Between the times at which room is made [s]."""

_MOST_NEAR = 48
"""Road users in detail at once: recording a scene of 240 takes three times as long as of 60."""

_ABOVE = 25.0
"""Height of the first view where the scene file has no camera [m]."""


def build_roam(
    world: World,
    trajectories: Sequence[Trajectory],
    *,
    times: tuple[float, float],
    frames: Floats | None = None,
    eyes: Floats | None = None,
    riding: Sequence[LagrangianCamera] = (),
) -> Shot:
    """Build everything around some places, and room for everyone.

    Args:
        world: What exists; the cabins that its scene file's cameras sit in can be opened.
        trajectories: The smoothed motion of everyone on the road.
        times: First and last that can be shown [s].
        frames: Times that are shown one after the other, increasing, (n,) [s]: motion is
            worked out for many of them at once. Others take longer.
        eyes: Places around which there is detail, (n, 3) [m]; default: where the scene's
            cameras are.
        riding: Further cameras that sit in a vehicle.

    Returns:
        A shot whose own camera stands where the scene's first one is at the first time.

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    # Everyone on the road; the cabins that cameras sit in can be opened.
    scenario, job, left_hand = world.scenario, world.job, world.left_hand
    fleet = replace(everyone(world, trajectories), times=frames)
    for camera in (*job.cameras.values(), *riding):
        fleet = with_seat(fleet, camera, world=world)
    # Places around which there is detail.
    views = list(_views(job, fleet, times, left_hand=left_hand)) or [_overview(scenario)]
    places = np.stack([view.position for view in views]) if eyes is None else eyes
    moments = np.arange(times[0], times[1] + _STEP, _STEP)
    # Build the shot.
    builder = ShotBuilder(world, job.output.size[1] / job.output.size[0])
    home, room = StandingCamera(views[0]), partial(_room, eyes=places, times=moments)
    camera_path = CameraPath.all_round(places)
    shot = builder.shot(fleet, camera_path, camera=lambda **_: home, plan=room)
    return replace(shot, places=places)


def camera_view(shot: Shot, camera: CameraSettings, time: float, *, left_hand: bool) -> View:
    """Return the view of a camera.

    Args:
        shot: Has the road users that it may ride with.
        camera: Its settings.
        time: SUMO's [s].
        left_hand: Whether traffic keeps left, so that drivers sit on the right.

    Raises:
        ConfigError: If it rides with a road user that does not exist then.
    """
    return build_camera(camera, fleet=shot.fleet, left_hand=left_hand).view_at(time)


def _views(
    job: Job, fleet: Fleet, times: tuple[float, float], *, left_hand: bool
) -> Iterator[View]:
    """Yield the views that stand for the ways of the scene's cameras."""
    for settings in job.cameras.values():
        camera = build_camera(settings, fleet=fleet, left_hand=left_hand)
        yield from (camera.view_at(time) for time in camera.moments(times))


def _overview(scenario: Scenario) -> View:
    """From above the middle of all roads, to the north."""
    lanes = [lane.shape for lane in scenario.network.lanes.values()]
    middle = np.median(np.concatenate(lanes), axis=0) if lanes else np.zeros(3)
    middle = middle + np.array([0.0, -2.0 * _ABOVE, _ABOVE])
    placed = Transform.from_pose(tuple(middle), yaw=np.pi / 2.0, pitch=-np.arctan(0.5))
    return View(placed, Lens.of_degrees(60.0))


def _room(*, fleet: Fleet, camera: Camera, eyes: Floats, times: Floats, budget: int) -> CrowdPlan:
    """Room for those near any of the places in detail, and for everyone as a stand-in.

    None are drawn in full detail, which takes instances and triangles and would be seen in
    stills only. Each opened cabin has a slot of its own, as the vehicle may also be seen closed.
    Where the shot's own camera stands does not matter.
    """
    del camera
    bodies = [replace(fleet.drawn(k), full=()) for k in range(len(fleet.keys))]
    frames, most = [], Counter[str]()
    for part in visibility.chunks(len(times)):
        alive, positions = fleet.positions(times[part])
        for eye in eyes:
            camera_path = CameraPath.all_round(np.tile(eye, (alive.shape[1], 1)))
            frames.append(CrowdFrames(camera_path, alive, positions))
        for column in alive.T:
            there = Counter(name for k in np.flatnonzero(column) for name in bodies[k].far)
            most |= there
    triangles = {name: body.triangles for name, body in fleet.prototypes.items()}
    plan = plan_crowd(bodies, frames, triangles=triangles, budget=budget, limit=_MOST_NEAR)
    near = dict(plan.slots.near)
    for cockpit in fleet.cockpits.values():
        near |= Counter(cockpit.names)
    slots = Slots(dict(sorted(near.items())), dict(sorted(most.items())), plan.slots.deforming)
    return replace(plan, slots=slots)
