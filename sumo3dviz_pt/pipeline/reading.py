"""Reads a simulation's files and makes its motion continuous."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.files.outputs import can_replace, check_spared
from sumo3dviz_pt.job.settings import Job, ObjectSettings
from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.model.scenario import LogChoices, Scenario, ScenarioFiles
from sumo3dviz_pt.model.traffic import unique_ids
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.changed_traffic import changed, recorded_window
from sumo3dviz_pt.pipeline.guessed_types import note_guesses
from sumo3dviz_pt.pipeline.smoothing import motion_of as motion_of
from sumo3dviz_pt.sumo.values import parse_time as parse_time

logger = logging.getLogger(__name__)

_LARGEST = 1_500_000_000
"""Text of logs beyond which only the window is read [bytes]: ten million rows."""

_PACKED = (".gz", ".parquet", ".zip")


def scenario_files(job: Job) -> ScenarioFiles:
    """Return where a job's simulation lies.

    Raises:
        InputError: If network or trajectories are missing.
        ConfigError: If the scene file names none.
    """
    from sumo3dviz_pt.sumo import find_scenario

    named = job.scenario
    place = named.sumocfg or named.folder
    if place is not None:
        files = find_scenario(place, network=named.network, trajectories=named.trajectories)
        return replace(
            files,
            signals=named.signals or files.signals,
            additional=files.additional + named.additional,
            vehicle_types=files.vehicle_types + named.vehicle_types,
        )
    if named.network is None or not named.trajectories:
        raise ConfigError("give sumocfg or folder, or network and trajectories", key="scenario")
    return ScenarioFiles(
        named.network,
        named.trajectories,
        named.signals,
        named.additional,
        named.vehicle_types + named.additional,
    )


def object_files(job: Job) -> tuple[Path, ...]:
    """Return the files of static objects that the scene file names."""
    kinds = (getattr(job.objects, name) for name in type(job.objects).model_fields)
    own = (kind.file for kind in kinds if isinstance(kind, ObjectSettings))
    return tuple(file for file in own if file is not None)


def read(
    job: Job, *, begin: float | None = None, end: float | None = None
) -> tuple[ScenarioFiles, Scenario, tuple[Trajectory, ...]]:
    """Read a simulation's window and smooth its motion.

    Args:
        job: The scene file.
        begin: First time to show [s]; the margin that smoothing needs is added.
        end: Last time to show [s].
    """
    files, scenario = read_files(job, begin=begin, end=end)
    return files, scenario, motion_of(job, scenario).smooth()


def spare_inputs(job: Job, *outputs: Path) -> None:
    """Refuse outputs that would replace what the scene is made from.

    Raises:
        ConfigError: If one would.
    """
    from sumo3dviz_pt.pipeline.accounts.provenance import files_of

    replacing = [path for path in outputs if can_replace(path)]
    if replacing:
        read = files_of(job, scenario_files(job))
        for path in replacing:
            check_spared(path, read)


def read_files(
    job: Job, *, begin: float | None = None, end: float | None = None
) -> tuple[ScenarioFiles, Scenario]:
    """Read a simulation's window; change its traffic if asked.

    Whoever is there in the window is read from the first to the last row, so that where somebody
    is at a time does not hang on the window. Of logs that are too large for that, or damaged,
    the window and the margin that smoothing needs are read.

    Args:
        job: The scene file.
        begin: First time to show [s]; None is the log's.
        end: Last time to show [s]; None is the log's.
    """
    from sumo3dviz_pt.motion import MARGIN

    announce(Doing.READ)
    files = scenario_files(job)
    extra = tuple(path for path in object_files(job) if path not in files.additional)
    files = replace(files, additional=files.additional + extra)
    stamps = stamps_of(_named_in(files))
    wider = recorded_window(job, begin, end, margin=MARGIN)
    whole = _whole(job, files, stamps, (begin, end))
    if whole is not None:
        scenario, recorded = (_living(whole, *span) for span in ((begin, end), wider))
    else:
        scenario = _read_once(files, stamps, _AskedLog.of(job, begin, end))
        recorded = scenario if wider == (begin, end) else _read(files, _AskedLog.of(job, *wider))
    note_guesses(scenario.guesses, log=files.trajectories[0])
    lives = whole is not None
    return files, changed(job, scenario, recorded, begin=begin, end=end, whole=lives)


def _whole(
    job: Job,
    files: ScenarioFiles,
    stamps: tuple[tuple[str, int, int], ...],
    window: tuple[float | None, float | None],
) -> Scenario | None:
    """Return a simulation with all of its log; None if that is not to be had.

    Args:
        job: The scene file.
        files: The simulation's files.
        stamps: Which versions of them.
        window: First and last time to show [s]; of nothing but the window its reader says why.
    """
    sizes = {name: size for name, _, size in stamps}
    logs = [str(path.absolute()) for path in files.trajectories]
    # Packed logs are as large as a fifteenth of their text.
    rows = sum(sizes.get(name, 0) * (15 if name.endswith(_PACKED) else 1) for name in logs)
    if window == (None, None):
        return None
    if rows > _LARGEST:
        _say_part("is large", files)
        return None
    try:
        whole = _read_once(files, stamps, _AskedLog.of(job, None, None))
    except InputError as error:
        _say_part(f"cannot be read whole ({cut(str(error))})", files)
        return None
    return whole if _living(whole, *window).traffic.traces else None


def _say_part(why: str, files: ScenarioFiles) -> None:
    """Say that only a part of a log is read, and what hangs on it."""
    message = (
        f"the log {why}, so only the film's window and what smoothing needs around it are read:"
        " who stands or turns as the window begins may be placed otherwise in another film"
    )
    logger.warning("%s: %s", files.trajectories[0], message, extra={"once": message})


@lru_cache(maxsize=2)
def _living(whole: Scenario, begin: float | None, end: float | None) -> Scenario:
    """Return a simulation with those only who are there in a window, or soon before or after it.

    Of road users that share an id, each keeps the number that it has in the whole log.

    Args:
        whole: The simulation, with all of its log.
        begin: First time of the window [s]; None is open.
        end: Last time of the window [s]; None is open.
    """
    from sumo3dviz_pt.motion import MARGIN
    from sumo3dviz_pt.motion.setting import is_euler

    low = -math.inf if begin is None else begin - MARGIN
    high = math.inf if end is None else end + MARGIN
    log = whole.traffic
    pairs = zip(log.traces, unique_ids(log.traces), strict=True)
    there = tuple(
        trace if name == trace.id else replace(trace, id=name)
        for trace, name in pairs
        if trace.times[0] <= high and trace.times[-1] >= low
    )
    told = bool(is_euler(trace for trace in log.traces if trace.kind == "vehicle"))
    return replace(whole, traffic=replace(log, traces=there, euler=told))


@dataclass(frozen=True, slots=True)
class _AskedLog:
    """What of a log is read, and how.

    Attributes:
        begin: First time to show [s]; None is the log's.
        end: Last time to show [s]; None is the log's.
        truncated: Whether the complete steps of a log that breaks off are used.
        misfit: Whether a log that seems wrong is used.
        classes: vClasses by type id or pattern.
    """

    begin: float | None
    end: float | None
    truncated: bool
    misfit: bool
    classes: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, job: Job, begin: float | None, end: float | None) -> _AskedLog:
        """Return what a scene file asks for in a window [s]."""
        classes = tuple(job.vehicles.types.items())
        own = job.scenario
        return cls(begin, end, own.allow_truncated, own.allow_misfit, classes)


@lru_cache(maxsize=1)
def _read_once(
    files: ScenarioFiles, stamps: tuple[tuple[str, int, int], ...], log: _AskedLog
) -> Scenario:
    """Read a scenario; the last one is kept, because most shots of a scene file share it.

    Args:
        files: The simulation's files.
        stamps: Which versions of them; see `stamps_of`.
        log: What of the log is read.
    """
    del stamps
    return _read(files, log)


def _read(files: ScenarioFiles, log: _AskedLog) -> Scenario:
    """Read a scenario."""
    from sumo3dviz_pt.motion import MARGIN
    from sumo3dviz_pt.sumo import read_scenario

    return read_scenario(
        files,
        begin=log.begin,
        end=log.end,
        margin=MARGIN,
        allow_truncated=log.truncated,
        choices=LogChoices(log.misfit, dict(log.classes)),
    )


def _named_in(files: ScenarioFiles) -> Iterator[Path]:
    """Yield all files that a scenario is read from."""
    yield files.network
    for some in (files.trajectories, files.signals, files.additional, files.vehicle_types):
        yield from some


def stamps_of(paths: Iterable[Path]) -> tuple[tuple[str, int, int], ...]:
    """Return name, time of the last change [ns] and size [bytes] of each file that exists."""
    found = []
    for path in paths:
        if path.exists():
            stat = path.stat()
            found.append((str(path.absolute()), stat.st_mtime_ns, stat.st_size))
    return tuple(found)
