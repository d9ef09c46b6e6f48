"""Where all vehicles of a log were, whatever part of it is shown: for what lies in snow."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.scenario import ScenarioFiles
from sumo3dviz_pt.model.tyre_tracks import DrivenWay, DrivenWays
from sumo3dviz_pt.pipeline.changed_traffic import shows
from sumo3dviz_pt.pipeline.reading import stamps_of


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
    found = _whole(files, stamps_of(read_from), classes, location, truncated)
    if job.traffic is None:
        return found
    shown = shows(job)
    ways = tuple(way for way in found.ways if shown(*way.key.split(":", 1)))
    return replace(found, ways=ways)


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
    from sumo3dviz_pt.sumo.guesses.types import TypesOfUsers
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
