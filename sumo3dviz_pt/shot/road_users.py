"""Who is on the road of a shot, and in whom its camera sits."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

from sumo3dviz_pt.cast.finding import find_trajectory
from sumo3dviz_pt.cast.fleet import Fleet, build_fleet, find_rider
from sumo3dviz_pt.cast.lights import vehicle_lights
from sumo3dviz_pt.job.settings import CameraSettings, LagrangianCamera
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot.falling.windscreen import has_pane
from sumo3dviz_pt.world.build import World


def countable(
    world: World, trajectories: Sequence[Trajectory], camera: CameraSettings
) -> frozenset[str]:
    """Return keys of those whose shape a report does not need: all but whom a camera rides in.

    Args:
        world: Says whether a report is made of it.
        trajectories: Of everyone on the road.
        camera: The shot's camera.
    """
    if world.outlook is None:
        return frozenset()
    keys = {each.key for each in trajectories}
    if isinstance(camera, LagrangianCamera):
        keys.discard(find_trajectory(trajectories, camera.vehicle).key)
    return frozenset(keys)


def everyone(
    world: World, trajectories: Sequence[Trajectory], *, counted: Container[str] = ()
) -> Fleet:
    """Return everyone on the road.

    Args:
        world: Says which types there are, and whether they have lights on.
        trajectories: Their smoothed motion.
        counted: Keys of those whose numbers of triangles are enough.
    """
    scenario, job = world.scenario, world.job
    fleet = build_fleet(
        trajectories,
        scenario.vehicle_types,
        job.vehicles,
        seed=job.seed,
        lights=vehicle_lights(
            scenario.traffic.traces, dark=world.dark, seed=job.seed, weather=world.weather
        ),
        counted=counted,
    )
    parked = frozenset[str]() if world.driven is None else world.driven.parked
    location, suspension = scenario.network.location, job.motion.suspension
    return replace(fleet, location=location, suspension=suspension, parked=parked)


def with_seat(fleet: Fleet, camera: CameraSettings, *, world: World) -> Fleet:
    """Return the same fleet; the vehicle that a camera rides in can be opened.

    Args:
        fleet: Everyone on the road.
        camera: Its settings.
        world: Tells on which side drivers sit, and whether wipers move.
    """
    if not isinstance(camera, LagrangianCamera):
        return fleet
    key, wet = find_rider(fleet, camera.vehicle).key, has_pane(world.weather, world.job)
    return fleet.with_cockpit(key, left_hand=world.left_hand, wipers=not wet)
