"""Find road users that appear or vanish within the picture of a shot, where viewers notice it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CameraSettings, Job, LagrangianCamera
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.production import life_of
from sumo3dviz_pt.report.motion.report import Finding, PopUps
from sumo3dviz_pt.shot.cameras.build import Camera, build_camera

_BESIDE = 3.0
"""A body whose front is this far beside the picture can still reach into it [m]."""

_FARTHEST = 1000.0
"""Beyond this distance nobody notices: a car is only a few pixels high [m]."""


def pop_ups(
    job: Job,
    scenario: Scenario,
    trajectories: Sequence[Trajectory],
    *,
    births: Sequence[Finding],
    deaths: Sequence[Finding],
) -> tuple[PopUps, ...]:
    """Return who appears or vanishes in the pictures of a job's shots.

    If the job has no shots, each of its cameras is one. What stands between the eye and a road
    user is not considered.

    Args:
        job: The scene file.
        scenario: The simulation.
        trajectories: Its smoothed motion.
        births: Where and when road users appear in the log.
        deaths: Where and when they vanish from it.

    Raises:
        ConfigError: If a camera rides with an unknown road user.
    """
    shots = [(shot.camera, shot.start, shot.end) for shot in job.shots]
    if not shots:
        lives = tuple(trajectories)
        shots = [(name, *life_of(camera, lives)) for name, camera in job.cameras.items()]
    aspect = job.output.size[1] / job.output.size[0]
    location = scenario.network.location
    found = []
    for name, start, end in shots:
        camera = _camera(job.cameras[name], job, scenario, trajectories)
        seen = [
            tuple(_seen(camera, _between(events, start, end), location, aspect=aspect))
            for events in (births, deaths)
        ]
        nearest = [tuple(sorted(some, key=lambda each: each.value)) for some in seen]
        found.append(PopUps(name, start, end, *nearest))
    return tuple(found)


def _between(events: Sequence[Finding], start: float, end: float) -> list[Finding]:
    """Return the events within a time [s]."""
    return [event for event in events if start < event.time < end]


def _camera(
    settings: CameraSettings, job: Job, scenario: Scenario, trajectories: Sequence[Trajectory]
) -> Camera:
    """Build a camera with no body but that of the road user it rides with."""
    riders: tuple[Trajectory, ...] = ()
    if isinstance(settings, LagrangianCamera):
        named = (settings.vehicle,)
        riders = tuple(t for t in trajectories if t.id in named or t.key in named)
    fleet = build_fleet(riders, scenario.vehicle_types, job.vehicles, seed=job.seed)
    fleet = replace(fleet, location=scenario.network.location)
    return build_camera(settings, fleet=fleet, left_hand=scenario.network.left_hand)


def _seen(
    camera: Camera, events: Sequence[Finding], location: Location, *, aspect: float
) -> Iterator[Finding]:
    """Yield the events that lie in the picture; their value is the distance from the eye [m]."""
    for event in events:
        try:
            view = camera.view_at(event.time)
        except ConfigError:
            # The camera's own vehicle is not there then, so there is no picture.
            continue
        place = location.inside([event.x, event.y, event.z])
        distance = _distance(view, place, aspect=aspect)
        if distance is not None:
            yield replace(event, value=distance)


def _distance(view: View, place: Floats, *, aspect: float) -> float | None:
    """Return the distance from the eye to a place [m]; None if it is outside the picture."""
    place = place - view.position
    local = place @ view.world_from_camera.matrix[:3, :3]
    inside = bool(view.lens.sees(local, aspect, margin=_BESIDE))
    distance = float(np.linalg.norm(place))
    return distance if inside and distance < _FARTHEST else None
