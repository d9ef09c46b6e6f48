"""Reads a simulation's files, makes its motion continuous, and refuses what they do not have.

A camera cannot ride with a road user that is not there; the message says when the log has it. One
sentence says what vehicles are drawn as whose type no file defines.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.files.atomic import can_replace, check_spared
from sumo3dviz_pt.job.settings import (
    CameraSettings,
    Job,
    ObjectSettings,
    ShotSettings,
)
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.traffic import (
    LandFiles,
    LogChoices,
    Scenario,
    ScenarioFiles,
    TypeGuess,
    unique_ids,
)
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.changed_traffic import changed, recorded_window
from sumo3dviz_pt.pipeline.traffic import motion_of as motion_of
from sumo3dviz_pt.sumo.values import parse_time as parse_time

if TYPE_CHECKING:
    from sumo3dviz_pt.sumo import Whereabouts


logger = logging.getLogger(__name__)

_NAMED = 3
"""Largest number of types that a note names for each vClass."""

_UNTOLD = "cars because nothing tells what they are"


def note_guesses(guesses: Sequence[TypeGuess], *, log: Path) -> None:
    """Say once a run what vehicles are drawn as whose type no file defines.

    Args:
        guesses: The types, and what is known of them.
        log: The vehicle log; each log has its own note.
    """
    if guesses:
        remedy = "Name their files in scenario.vehicle_types, or their classes in vehicles.types"
        text = guesses_in_words(guesses, remedy=remedy)
        logger.warning("%s: %s", log, text, extra={"once": f"types of {log}"})


def guesses_in_words(guesses: Sequence[TypeGuess], *, remedy: str) -> str:
    """Return one sentence on types that no file defines; empty where there are none.

    Args:
        guesses: The types, and what is known of them.
        remedy: What to do, as a clause that begins with a verb.
    """
    if not guesses:
        return ""
    # Types that nothing tells come first, as their pictures are likeliest to be wrong.
    groups: dict[tuple[bool, str, str], list[TypeGuess]] = {}
    for each in sorted(guesses, key=lambda each: (bool(each.vclass), -each.count)):
        groups.setdefault((bool(each.type_id), each.vclass, each.why), []).append(each)
    parts = [_in_words(group) for group in groups.values()]
    return f"no file defines the types of these vehicles: {'; '.join(parts)}. {remedy}"


def guess_notes(guesses: Sequence[TypeGuess]) -> list[str]:
    """Return the note of a proposal on types that no file defines, if there are some."""
    remedy = "Name files that define them by --additional, or correct vehicles.types"
    text = guesses_in_words(guesses, remedy=remedy)
    return [text] if text else []


def type_lines(guesses: Sequence[TypeGuess]) -> list[str]:
    """Return the lines of a scene file's section `vehicles` that keep what was guessed."""
    guessed = [each for each in guesses if each.vclass and each.type_id]
    if not guessed:
        return []
    lines = [f"    {_quoted(each.type_id)}: {each.vclass}  # {each.why}" for each in guessed]
    return ["vehicles:", "  types:  # no file defines these; correct what is wrong", *lines]


def _in_words(group: Sequence[TypeGuess]) -> str:
    """Return what the vehicles of types of one class are drawn as."""
    first = group[0]
    count = sum(each.count for each in group)
    how = f"vClass {first.vclass} because {first.why}" if first.vclass else _UNTOLD
    if not first.type_id:
        return f"{count} without a type drawn as {how}"
    names = ", ".join(repr(each.type_id) for each in group[:_NAMED])
    more = f" and {len(group) - _NAMED} more" if len(group) > _NAMED else ""
    return f"{names}{more} ({count} of them) drawn as {how}"


def _quoted(text: str) -> str:
    """Return a key as YAML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


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
    from sumo3dviz_pt.sumo.tracks import in_sumos_form, is_table

    named, logs = job.scenario, job.scenario.logs
    place = named.sumocfg or named.folder
    if place is not None:
        files = find_scenario(place, network=named.network, trajectories=logs, table=named.table)
        return replace(
            files,
            signals=named.signals or files.signals,
            additional=files.additional + named.additional,
            vehicle_types=files.vehicle_types + named.vehicle_types,
        )
    if not logs or (named.network is None and not all(map(is_table, logs))):
        raise ConfigError("give sumocfg or folder, or network and trajectories", key="scenario")
    return in_sumos_form(
        named.network,
        logs,
        named.table,
        signals=named.signals,
        additional=named.additional,
        vehicle_types=named.vehicle_types + named.additional,
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


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A simulation as it was read.

    Attributes:
        files: Where it lies.
        scenario: Network, objects, types and the log.
        trajectories: Its smoothed motion.
        begin: First time that can be shown [s].
        end: Last one [s].
        origin: A time from which frames are counted [s]; None is the first one.
        growing: Whether the simulation still runs, so that more is to come.
        behind: How far behind the last time a page that plays may be [s].
    """

    files: ScenarioFiles
    scenario: Scenario
    trajectories: tuple[Trajectory, ...]
    begin: float
    end: float
    origin: float | None = None
    growing: bool = False
    behind: float = math.inf

    def frames(self, fps: float) -> Floats:
        """Return the times of a film's frames that can be shown, increasing, (n,) [s]."""
        origin, step = self.begin if self.origin is None else self.origin, 1.0 / fps
        first = math.ceil((self.begin - origin) / step - 1e-9)
        count = math.floor((self.end - origin) / step + 1e-9) - first + 1
        return origin + step * np.arange(first, first + max(count, 1), dtype=np.float64)

    @classmethod
    def of(cls, job: Job, *, begin: float | None = None, end: float | None = None) -> Ground:
        """Read a job's simulation, or a window of it.

        Args:
            job: The scene file.
            begin: First time to show [s]; None is the log's.
            end: Last time to show [s]; None is the log's.

        Raises:
            InputError: If a file is wrong.
            ConfigError: If the log has nothing in the window.
        """
        files, scenario, trajectories = read(job, begin=begin, end=end)
        log = scenario.traffic
        first = log.begin if begin is None else max(begin, log.begin)
        last = log.end if end is None else min(end, log.end)
        if not first <= last:
            raise ConfigError(
                f"the log goes from {log.begin:.12g} s to {log.end:.12g} s:"
                " nothing lies in the window",
                key="from",
            )
        return cls(files, scenario, trajectories, first, last)


def spare_inputs(job: Job, *outputs: Path) -> None:
    """Refuse outputs that would replace what the scene is made from.

    Raises:
        ConfigError: If one would.
    """
    from sumo3dviz_pt.pipeline.provenance import files_of

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
        scenario = _read_once(files, stamps, _LogPart.of(job, begin, end))
        recorded = scenario if wider == (begin, end) else _read(files, _LogPart.of(job, *wider))
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
        whole = _read_once(files, stamps, _LogPart.of(job, None, None))
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
    """Return a simulation with only the road users of a window, and of soon before and after it.

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
    euler = bool(is_euler(trace for trace in log.traces if trace.kind == "vehicle"))
    return replace(whole, traffic=replace(log, traces=there, euler=euler))


@dataclass(frozen=True, slots=True)
class _LogPart:
    """What of a log is read, and how.

    Attributes:
        begin: First time to show [s]; None is the log's.
        end: Last time to show [s]; None is the log's.
        truncated: Whether the complete steps of a log that breaks off are used.
        misfit: Whether a log that seems wrong is used.
        classes: vClasses by type id or pattern.
        land: What tells what the land is like.
        versions: Which versions of these files.
    """

    begin: float | None
    end: float | None
    truncated: bool
    misfit: bool
    classes: tuple[tuple[str, str], ...]
    land: LandFiles
    versions: tuple[tuple[str, int, int], ...]

    @classmethod
    def of(cls, job: Job, begin: float | None, end: float | None) -> _LogPart:
        """Return what a scene file asks for in a window [s]."""
        classes = tuple(job.vehicles.types.items())
        own = job.scenario
        land = job.ground.files
        versions = stamps_of(each for each in (land.heights, land.picture) if each is not None)
        return cls(begin, end, own.allow_truncated, own.allow_misfit, classes, land, versions)


@lru_cache(maxsize=1)
def _read_once(
    files: ScenarioFiles, stamps: tuple[tuple[str, int, int], ...], log: _LogPart
) -> Scenario:
    """Read a scenario; the last one is kept, because most shots of a scene file share it.

    Args:
        files: The simulation's files.
        stamps: Which versions of them; see `stamps_of`.
        log: What of the log is read.
    """
    del stamps
    return _read(files, log)


def _read(files: ScenarioFiles, log: _LogPart) -> Scenario:
    """Read a scenario."""
    from sumo3dviz_pt.motion import MARGIN
    from sumo3dviz_pt.sumo import read_scenario

    return read_scenario(
        files,
        begin=log.begin,
        end=log.end,
        margin=MARGIN,
        allow_truncated=log.truncated,
        choices=LogChoices(log.misfit, dict(log.classes), log.land),
    )


def _named_in(files: ScenarioFiles) -> Iterator[Path]:
    """Yield all files that a scenario is read from."""
    yield files.network
    for some in (files.trajectories, files.signals, files.additional, files.vehicle_types):
        yield from some


def stamps_of(paths: Iterable[Path]) -> tuple[tuple[str, int, int], ...]:
    """Return name, time of the last change [ns] and size [bytes] of each file that exists."""
    stamps = []
    for path in paths:
        if path.exists():
            stat = path.stat()
            stamps.append((str(path.absolute()), stat.st_mtime_ns, stat.st_size))
    return tuple(stamps)


_SLACK = 1e-6
"""Tolerance of times, because those of frames are sums of fractions [s]."""

_MOST_SPANS = 4


def check_rider(
    camera: CameraSettings,
    *,
    name: str,
    times: Floats,
    trajectories: Sequence[Trajectory],
    logs: Sequence[Path],
) -> None:
    """Refuse a camera whose road user is not there all the time; only then the logs are searched.

    Args:
        camera: Of any kind.
        name: Of the camera.
        times: Of all frames, (n,) [s].
        trajectories: What was read around these times.
        logs: Where they come from, whole.

    Raises:
        ConfigError: Says when the log has the road user, or which one may be meant.
    """
    if not camera.rides_with:
        return
    missing = _missing(camera.rides_with, times, trajectories)
    if missing is not None:
        from sumo3dviz_pt.sumo import whereabouts

        raise _absent(camera.rides_with, whereabouts(logs, camera.rides_with), missing, name=name)


def check_companions(
    job: Job, films: Iterable[tuple[ShotSettings, Floats]], logs: Sequence[Path]
) -> None:
    """Refuse shots whose road user is not there all the time, before anything is built.

    Args:
        job: The scene file.
        films: Shots and the times of their frames, (n,) [s]; what comes after the log's end is
            no part of a film.
        logs: Of the simulation, whole.

    Raises:
        ConfigError: As `check_rider` does.
    """
    from sumo3dviz_pt.sumo import whereabouts

    for shot, times in films:
        camera = job.cameras[shot.camera]
        if not camera.rides_with:
            continue
        presence = whereabouts(logs, camera.rides_with)
        absent = _outside(times, presence.spans) & (times <= presence.end + _SLACK)
        if absent.any() or not presence.spans:
            missing = float(times[np.argmax(absent)])
            raise _absent(camera.rides_with, presence, missing, name=shot.camera)


def check_known(name: str, logs: Sequence[Path]) -> None:
    """Refuse a road user that no log ever has.

    Args:
        name: SUMO's id, or the key such as `person:walker_1`.
        logs: Of the simulation, whole.

    Raises:
        ConfigError: Says which one may be meant.
    """
    from sumo3dviz_pt.sumo import whereabouts

    presence = whereabouts(logs, name)
    if not presence.spans:
        hint = _hint(name, presence.ids)
        raise ConfigError(f"no vehicle or person is called {cut(name)!r}{hint}")


def _absent(vehicle: str, there: Whereabouts, missing: float, *, name: str) -> ConfigError:
    """Return an error that says why a camera cannot ride with a road user at a time [s]."""
    shown = repr(cut(vehicle))
    key = f"cameras.{name}.vehicle"
    if not there.spans:
        hint = _hint(vehicle, there.ids)
        return ConfigError(f"no vehicle or person is called {shown}{hint}", key=key)
    lives = ", ".join(f"{begin:.12g} to {end:.12g} s" for begin, end in there.spans[:_MOST_SPANS])
    lives += " and later" if len(there.spans) > _MOST_SPANS else ""
    inside = any(begin <= missing <= end for begin, end in there.spans)
    why = f"is not there at {missing:g} s"
    if inside:
        later = repr(cut(f"{vehicle}#2"))
        why = f"is not drawn at {missing:g} s (it rides in a vehicle then, or jumps, or is a train"
        why += f" that split or joined, which is {later} from then on)"
    return ConfigError(f"{shown} {why}; the log has it from {lives}", key=key)


def _missing(name: str, times: Floats, trajectories: Sequence[Trajectory]) -> float | None:
    """Return the first time at which a road user is not there [s]; None if it always is."""
    known = {trajectory.key: trajectory for trajectory in trajectories}
    keys = (f"vehicle:{name}", f"person:{name}", f"container:{name}", name)
    rider = next((known[key] for key in keys if key in known), None)
    pieces = () if rider is None else rider.pieces
    absent = _outside(times, [(piece.begin, piece.end) for piece in pieces])
    return float(times[np.argmax(absent)]) if absent.any() else None


def _outside(times: Floats, spans: Iterable[tuple[float, float]]) -> Bools:
    """Return which times lie in none of some spans, (n,)."""
    there = np.zeros(len(times), dtype=np.bool_)
    for begin, end in spans:
        there |= (times >= begin - _SLACK) & (times <= end + _SLACK)
    return ~there


def _hint(name: str, ids: frozenset[str]) -> str:
    """End of a sentence that names near ids and some that exist."""
    if not ids:
        return "; the log has nobody"
    near = did_you_mean(name, ids)
    some = ", ".join(repr(cut(each)) for each in sorted(ids)[:3])
    return (near if near.startswith("; did") else "") + f"; for example {some} exist"
