"""Finds which shots of a scene can share what is built of its place when they are reported on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import shapely

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scenario import Scenario, ScenarioFiles
from sumo3dviz_pt.motion import LogMotion
from sumo3dviz_pt.pipeline.production import check_window
from sumo3dviz_pt.pipeline.riders import check_rider
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.world.shared import Outlook

_TOGETHER = 150.0
"""Shots whose cameras come closer than this share a place [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Outing:
    """A shot, for which a place is to be built.

    Attributes:
        camera: The camera's name.
        times: Of its frames, (n,) [s].
    """

    camera: str
    times: Floats


def outlooks(
    job: Job, files: ScenarioFiles, scenario: Scenario, motion: LogMotion, outings: Sequence[Outing]
) -> list[Outlook | None]:
    """Return all cameras that share a shot's place, shot by shot; None for one that is alone.

    Args:
        job: The scene file.
        files: The simulation's files.
        scenario: As read, the whole log.
        motion: Of everyone in it.
        outings: The shots.

    Raises:
        ConfigError: If a shot lies outside of the log, or whom its camera rides with is not there.
    """
    if len(outings) < 2:
        return [None] * len(outings)
    ways = [_way(job, files, scenario, motion, outing) for outing in outings]
    plans = [shapely.MultiPoint(way.positions[:, :2]).convex_hull for way in ways]
    groups: list[set[int]] = []
    for number, plan in enumerate(plans):
        near = [g for g in groups if any(shapely.dwithin(plan, plans[k], _TOGETHER) for k in g)]
        groups = [g for g in groups if g not in near] + [{number}.union(*near)]
    found: list[Outlook | None] = [None] * len(outings)
    for group in groups:
        if len(group) > 1:
            joined = Outlook(CameraPath.joined([ways[k] for k in sorted(group)]))
            for k in group:
                found[k] = joined
    return found


def _way(
    job: Job, files: ScenarioFiles, scenario: Scenario, motion: LogMotion, outing: Outing
) -> CameraPath:
    """Return where a shot's camera is and looks."""
    from sumo3dviz_pt.shot.in_view import way_of

    camera, times = job.cameras[outing.camera], outing.times
    check_window(scenario, times)
    riders = motion.smooth(motion.named(getattr(camera, "vehicle", "")))
    logs = files.trajectories
    check_rider(camera, name=outing.camera, times=times, trajectories=riders, logs=logs)
    return way_of(world_of(scenario, job, files), riders, camera=camera, times=times)
