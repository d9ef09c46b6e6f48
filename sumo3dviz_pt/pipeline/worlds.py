"""Keeps what was built of a world for its next shot, and says what its places depend on.

What lies in snow depends on where all vehicles of a log were, whatever part of it is shown.
"""

from __future__ import annotations

import gc
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.job.settings import Job, Lights, SkySettings
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import Scenario, ScenarioFiles
from sumo3dviz_pt.model.trajectory import DrivenWay, DrivenWays
from sumo3dviz_pt.pipeline.changed_traffic import shows
from sumo3dviz_pt.pipeline.provenance import contents, package_hashes, versions, with_files
from sumo3dviz_pt.pipeline.reading import stamps_of
from sumo3dviz_pt.world.memory import Memory

if TYPE_CHECKING:
    from sumo3dviz_pt.job.settings import CameraSettings
    from sumo3dviz_pt.model.geometry import Floats
    from sumo3dviz_pt.pipeline.reading import Ground
    from sumo3dviz_pt.shot.build import Shot
    from sumo3dviz_pt.world.build import World


def driven_ways(job: Job, files: ScenarioFiles, *, location: Location) -> DrivenWays:
    """Return where all vehicles of the whole log were, but for those that the scene leaves out.

    A ride that the scene file delays or paces drives where it was recorded, only at other times,
    so its way is the recorded one. Of large logs, what is read is kept in the user's cache.

    Args:
        job: The scene file.
        files: The simulation's files.
        location: Of the network.

    Raises:
        InputError: If a log is damaged.
    """
    read_from = (*files.trajectories, *files.vehicle_types)
    classes = tuple(job.vehicles.types.items())
    truncated = job.scenario.allow_truncated
    all_ways = _whole(files, stamps_of(read_from), classes, location, truncated)
    if job.traffic is None:
        return all_ways
    shown = shows(job)
    ways = tuple(way for way in all_ways.ways if shown(*way.key.split(":", 1)))
    return replace(all_ways, ways=ways)


@lru_cache(maxsize=1)
def _whole(
    files: ScenarioFiles,
    stamps: tuple[tuple[str, int, int], ...],
    classes: tuple[tuple[str, str], ...],
    location: Location,
    truncated: bool,
) -> DrivenWays:
    """Return where all vehicles were; the last log's is kept, as all shots of a scene share it.

    Args:
        files: The simulation's files.
        stamps: Which versions of them; see `stamps_of`.
        classes: vClasses by type id or pattern.
        location: Of the network.
        truncated: Whether the complete steps of a log that breaks off are used.
    """
    from sumo3dviz_pt.sumo.fcd import read_trajectories
    from sumo3dviz_pt.sumo.guesses import TypesOfUsers
    from sumo3dviz_pt.sumo.types import read_vehicle_types

    del stamps
    log = read_trajectories(files.trajectories, allow_truncated=truncated, location=location)
    known = TypesOfUsers(read_vehicle_types(files.vehicle_types), dict(classes))
    ways = []
    for trace in log.traces:
        if trace.kind == "vehicle":
            kind = known.of(trace.kind, trace.id, trace.type_id)
            places = trace.positions[:, :2]
            way = (trace.times, places, trace.yaws, trace.speeds)
            ways.append(DrivenWay(trace.key, kind.vclass, kind.width, *way))
    return DrivenWays(log.step, tuple(ways))


_APART = {
    *("cameras", "shots", "output", "overlays", "quality", "scenario", "motion", "vehicles"),
    *("sky", "lights", "weather", "template", "traffic"),
}
"""Keys that do not change what exists. Cameras that keep a view clear do; `world_of` adds them,
whether lamps are lit, and what of the weather has a shape."""

_ASPECT = 9.0 / 16.0
"""Height / width of the pictures that are kept clear, whatever size is rendered."""


@contextmanager
def without_collecting() -> Iterator[None]:
    """Keep Python from searching for circles of objects, 8 % of the time that building takes.

    What is built has none: without the search, memory peaks at the same.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def world_of(scenario: Scenario, job: Job, files: ScenarioFiles) -> World:
    """Return the world of a scene file, with all that was built of it in this process.

    What was built serves all of its cameras, shots, qualities and sizes, until a setting, a
    file or a camera that keeps its view clear is another one. One world is remembered at a
    time.

    Args:
        scenario: As read, for any window of time.
        job: The scene file.
        files: The simulation's files.

    Raises:
        ConfigError: If the sky's settings contradict each other, or a camera looks at the
            point where it stands.
    """
    from sumo3dviz_pt.shot.cameras.aiming import clearance_of, clearing
    from sumo3dviz_pt.world.areas.covers import with_waterways
    from sumo3dviz_pt.world.build import World

    location = scenario.network.location
    settings = [job.model_dump(mode="json", exclude=_APART), _shaping(job, location)]
    stamps = stamps_of(_shown_by(files))
    cameras = [camera.model_dump(mode="json") for camera in clearing(job.cameras.values())]
    name = json.dumps([settings, stamps, cameras], sort_keys=True, default=str)
    clearance = clearance_of(job.cameras.values(), aspect=_ASPECT, location=location)
    key = _key_of(job, files, cameras, location)
    scenario = with_waterways(scenario)
    world = World.of(scenario, job, clearance=clearance, memory=_memory_of(name), key=key)
    if world.weather is None or not world.weather.is_snowy:
        return world
    return replace(world, driven=driven_ways(job, files, location=location))


def _key_of(
    job: Job, files: ScenarioFiles, cameras: Sequence[Mapping[str, Any]], location: Location
) -> str:
    """Return a hash of all that a world is made from; files count by content.

    Pictures count by their places, too: materials name them, and a place that was kept by an
    installation that is gone would name pictures that are gone.
    """
    content = {
        "settings": with_files(job.model_dump(exclude=_APART), _where_and_what),
        "library": str(data_root("assets")),
        "files": [contents(path) for path in _shown_by(files)],
        "cameras": cameras,
        "shaping": _shaping(job, location),
        "versions": versions(),
        "package": package_hashes(),
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()


def _shown_by(files: ScenarioFiles) -> tuple[Path, ...]:
    """Return a simulation's files that say what exists, not what is on the road."""
    return (files.network, *files.signals, *files.additional)


def _where_and_what(path: Path) -> list[str]:
    """Return a file's place, and the hashes of its content."""
    return [str(path.resolve()), *contents(path)]


def _shaping(job: Job, location: Location) -> Mapping[str, Any]:
    """Return what of light and weather changes what stands; the sun, fog and wetness do not."""
    season = "summer" if job.weather is None else job.weather.season
    return {"season": season, "dark": lamps_are_lit(job.sky, job.lights, location)}


@lru_cache(maxsize=64)
def lamps_are_lit(sky: SkySettings, lights: Lights, location: Location) -> bool:
    """Return whether it is dark; many shots of a study share that.

    Args:
        sky: The scene file's.
        lights: Its word on lamps.
        location: Of the network.

    Raises:
        ConfigError: If settings contradict each other or name what is unknown.
    """
    from sumo3dviz_pt.world.sky import build_sky, is_dark

    if lights != "auto" or sky.file is not None:
        # No sun is asked for, and files take time to read.
        return lights == "on"
    return is_dark(build_sky(sky, location=location))


@lru_cache(maxsize=1)
def _memory_of(name: str) -> Memory:
    """Return what was built of the world of a name; only the last name's is kept."""
    return Memory()


def roam_around(
    job: Job,
    ground: Ground,
    *,
    frames: Floats,
    eyes: Floats | None = None,
    riding: tuple[CameraSettings, ...] = (),
) -> Shot:
    """Build everything around some places, for cameras that may go anywhere.

    Args:
        job: The scene file.
        ground: Its simulation.
        frames: Times that are shown one after the other, increasing, (n,) [s].
        eyes: Places with detail, (n, 3) [m]; None is where the scene's cameras are.
        riding: Further cameras that sit in a vehicle.

    Raises:
        ConfigError: If a choice does not exist.
    """
    from sumo3dviz_pt.shot.picking import build_roam

    return build_roam(
        world_of(ground.scenario, job, ground.files),
        ground.trajectories,
        times=frames,
        eyes=eyes,
        riding=riding,
        growing=ground.growing,
    )
