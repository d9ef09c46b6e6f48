"""Tells SUMO's files apart by what is in them, and finds those of a scenario.

The names of files do not count. A scenario's files are found from a SUMO configuration or by
searching a folder. Names in a configuration may hold variables, and SUMO adds to the names of
outputs. Damaged files of SUMO are noted, which a search would otherwise pass over.

References:
    `StringUtils::substituteEnvironment` and `OutputDevice::getDevice` of Eclipse SUMO 1.2x.
"""

from __future__ import annotations

import logging
import os
import re
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from itertools import islice
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import ScenarioFiles, TableChoices
from sumo3dviz_pt.sumo.additional import DETECTORS, KINDS, UNSEEN
from sumo3dviz_pt.sumo.file_names import Affixes, not_set, replaced
from sumo3dviz_pt.sumo.formats import format_of, is_log
from sumo3dviz_pt.sumo.formats.outputs import OUTPUT_ROOTS
from sumo3dviz_pt.sumo.stream import (
    OTHERS,
    Element,
    advice,
    chunks,
    may_be_map,
    may_be_xml,
    read_elements,
    remedy,
    root_of,
)
from sumo3dviz_pt.sumo.tracks import LANE_ROOTS, in_sumos_form, is_table, tells_places, why_no_table
from sumo3dviz_pt.sumo.values import parse_time

logger = logging.getLogger(__name__)

_WHAT = {
    # Root element: what such a file holds.
    "net": "a network",
    "fcd-export": "a vehicle log",
    "tlsStates": "a signal log",
    "routes": "vehicle types",
    "additional": "objects or vehicle types",
    "additionals": "objects or vehicle types",
    "add": "objects or vehicle types",
    "shapes": "objects",
    "vTypes": "vehicle types",
    "configuration": "a configuration",
    "sumoConfiguration": "a configuration",
}
_NAMES = frozenset({"net", "add", "rou", "fcd", "poly", "sumocfg"})
"""Parts of file names by which SUMO's files are known."""

_COMMENTS = re.compile(rb"<!--.*?-->", re.DOTALL)
_FIRST_TAG = re.compile(rb"<([A-Za-z][\w.-]*)")


def note_damage(file: Path) -> None:
    """Say that a file of SUMO is left out because it is damaged; nothing of other files.

    Args:
        file: A file whose root element cannot be read.
    """
    try:
        head = next(chunks(file), b"")
    except InputError as error:
        # What it held cannot be told any more, unless by its name.
        if _NAMES & set(file.name.split(".")):
            _note(file, f"{error}; the file is left out")
        return
    match = _FIRST_TAG.search(_COMMENTS.sub(b"", head))
    what = _WHAT.get(match[1].decode("ascii", errors="replace")) if match else None
    if what is None:
        return
    try:
        for _ in read_elements(file, root=(), what="a file of SUMO"):
            pass
    except InputError as error:
        _note(file, f"{error}; it seems to hold {what} and is left out")


def _note(file: Path, text: str) -> None:
    """Say it once a run."""
    logger.warning("%s", text, extra={"once": f"damage of {file}"})


ADDITIONAL_ROOTS = frozenset({"additional", "additionals", "add", "shapes", "vTypes"})
_PLACED = frozenset({"poi", "poly", "parkingArea", *KINDS, *DETECTORS, *UNSEEN})
"""Elements of additional files that stand somewhere, or are named as they do not."""

CONFIGURATION_ROOTS = frozenset({"configuration", "sumoConfiguration"})
_PLACES = {
    "net": "networks",
    "tlsStates": "signals",
    "tlsSwitches": "signals",
    "routes": "vehicle_types",
}
"""Fields of `FileSurvey` by the root elements that decide alone."""

_ENTRIES = ("tlsState", "tlsSwitch")
"""Entries of signal logs; the first tell more."""

_PEEK = 20_000
"""Number of elements that show what a log holds, some seconds of a large city."""


@dataclass(frozen=True, slots=True)
class FileSurvey:
    """The files of a place, by content.

    Attributes:
        networks: `<net>`.
        trajectories: Vehicle logs in any format.
        signals: `<tlsStates>` and `<tlsSwitches>`.
        additional: Files with a POI, a polygon, a stop, a parking area or a detector.
        vehicle_types: Route files, and additional files with a vType.
        configurations: SUMO's configurations.
        tables: Tables of other tools, and outputs that tell where vehicles are, too.
        others: Files whose kind is known and of which no film can be made.
    """

    networks: tuple[Path, ...] = ()
    trajectories: tuple[Path, ...] = ()
    signals: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    vehicle_types: tuple[Path, ...] = ()
    configurations: tuple[Path, ...] = ()
    tables: tuple[Path, ...] = ()
    others: tuple[Path, ...] = ()

    def __add__(self, other: FileSurvey) -> FileSurvey:
        """Join the files of two places; each file stands once."""
        return FileSurvey(
            *(_once(getattr(self, f.name) + getattr(other, f.name)) for f in fields(FileSurvey))
        )


def survey_folder(
    folder: Path, *, network: Path | None = None, named: Collection[Path] = ()
) -> FileSurvey:
    """Look at the files of a folder and of its subfolders, one level down.

    A subfolder with a network of its own is another scenario and is left out, unless
    its network is the given one, or no network is given and the folder itself has none.

    Args:
        folder: Where to look.
        network: The scenario's network, if it is known.
        named: Files that a user names, whose own readers say what is wrong with them.

    Returns:
        The files of SUMO; unreadable files are left out.
    """
    top = survey_files((file for file in sorted(folder.iterdir()) if file.is_file()), named)
    for sub in sorted(sub for sub in folder.iterdir() if _is_place(sub)):
        below = survey_files((file for file in sorted(sub.iterdir()) if file.is_file()), named)
        wanted = network is not None and network.resolve() in [n.resolve() for n in below.networks]
        if below.networks and not wanted and (network is not None or top.networks):
            logger.info("%s: has its own network and is left out", sub)
        else:
            top = top + below
    return top


def survey_files(files: Iterable[Path], named: Collection[Path] = ()) -> FileSurvey:
    """Sort files by content; files that are not of SUMO are left out.

    A note says which files of SUMO are damaged, but for those that a user names.
    """
    survey = FileSurvey()
    silent = {file.resolve() for file in named}
    for file in files:
        stat = file.stat()
        one, damaged = _looked_at(file, (stat.st_ino, stat.st_mtime_ns, stat.st_size))
        if damaged and file.resolve() not in silent:
            note_damage(file)
        survey = survey + one
    return survey


@lru_cache(maxsize=1024)
def _looked_at(file: Path, stamp: tuple[int, int, int]) -> tuple[FileSurvey, bool]:
    """Return a survey of one file, and whether it is XML whose root cannot be read.

    A command asks several times, and looks at each version of a file once.

    Args:
        file: The file.
        stamp: Which version of it.
    """
    del stamp
    is_xml = may_be_xml(file)
    root = root_of(file) if is_xml or may_be_map(file) else None
    return _sorted_in(file, root), is_xml and root is None


def vehicle_logs(logs: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return logs that belong together: one with vehicles, and any with persons only.

    Args:
        logs: All vehicle logs of a place.

    Returns:
        The one with vehicles first. The result is empty where several hold vehicles, or
        several logs hold none, because then it is not clear which is meant.
    """
    if len(logs) < 2:
        return logs
    tags = {log: {e.tag for e in _peek(format_of(log).elements(log))} for log in logs}
    main = [log for log in logs if "vehicle" in tags[log]]
    others = [log for log in logs if tags[log] & {"person", "container"} and log not in main]
    together = (*main, *others)
    return together if len(main) == 1 or len(together) == 1 else ()


def signal_logs(logs: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the signal logs to use: with every step, then with switches, then with green times.

    Returns:
        Logs in order of entries per second; one that adds no light is left out.
    """
    entries = {log: [e for e in _peek(readable_elements(log)) if e.tag in _ENTRIES] for log in logs}
    chosen: list[Path] = []
    covered: set[str] = set()
    for log in sorted(logs, key=lambda log: _rank(entries[log])):
        lights = {element.text("id", "") for element in entries[log]}
        if lights - covered:
            chosen.append(log)
            covered |= lights
    return tuple(chosen)


def _sorted_in(file: Path, root: str | None) -> FileSurvey:
    """Return a survey of one file; its root element is given, or None if it is no XML."""
    one = (file,)
    if root in CONFIGURATION_ROOTS:
        # Other tools of SUMO use the same root for their own configurations.
        own = root == "sumoConfiguration" or file.suffix == ".sumocfg"
        return FileSurvey(configurations=one if own else ())
    if root in ADDITIONAL_ROOTS:
        tags = {element.tag for element in readable_elements(file)}
        return FileSurvey(
            additional=one if tags & _PLACED else (),
            vehicle_types=one if "vType" in tags else (),
        )
    if root in _PLACES:
        return FileSurvey(**{_PLACES[root]: one})
    if root in OTHERS:
        return FileSurvey(others=one)
    if is_log(file) and root not in OUTPUT_ROOTS:
        return FileSurvey(trajectories=one)
    told = root in OUTPUT_ROOTS or root in LANE_ROOTS or is_table(file)
    return FileSurvey(tables=one if told else ())


def readable_elements(file: Path) -> Iterator[Element]:
    """Yield the elements of a file up to damage, which its own reader will report."""
    return _up_to_damage(read_elements(file, root=(), what="a file of SUMO"))


def _up_to_damage(elements: Iterator[Element]) -> Iterator[Element]:
    try:
        yield from elements
    except InputError as error:
        logger.debug("%s", error)


def _peek(elements: Iterator[Element]) -> list[Element]:
    """Return the first elements up to damage."""
    return list(islice(_up_to_damage(elements), _PEEK))


def _rank(entries: list[Element]) -> tuple[int, float]:
    """Return a number that is smaller for a log that tells more."""
    tags = [_ENTRIES.index(entry.tag) for entry in entries[:1]]
    return (*tags, len(_ENTRIES))[0], -_density(entries)


def _density(entries: list[Element]) -> float:
    """Return the entries per second; 0 where all are of one time."""
    try:
        times = [parse_time(entry.text("time", "")) for entry in (*entries[:1], *entries[-1:])]
    except ValueError:
        return 0.0
    span = times[-1] - times[0] if times else 0.0
    return len(entries) / span if span > 0 else 0.0


def _is_place(path: Path) -> bool:
    return path.is_dir() and not path.name.startswith(".")


def _once(files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return each file once, under the first of its names."""
    first: dict[Path, Path] = {}
    for file in files:
        first.setdefault(file.resolve(), file)
    return tuple(first.values())


_OPTIONS = {
    "net-file": "network",
    "net": "network",
    "route-files": "inputs",
    "routes": "inputs",
    "additional-files": "inputs",
    "additional": "inputs",
    "fcd-output": "trajectories",
    "person-fcd-output": "trajectories",
}
"""SUMO's option names and their synonyms."""

_SIGNAL_EVENTS = frozenset({"SaveTLSStates", "SaveTLSSwitchStates", "SaveTLSSwitchTimes"})


@dataclass(slots=True)
class _NamedFiles:
    """Files that a configuration names, whether they exist or not."""

    network: list[Path] = field(default_factory=list)
    inputs: list[Path] = field(default_factory=list)
    trajectories: list[Path] = field(default_factory=list)
    affixes: Affixes = field(default_factory=Affixes)
    unset: dict[str, str] = field(default_factory=dict)
    """Variables that are not set, by what the option is about that names them."""

    def missing(self) -> tuple[Path, ...]:
        """Return the files that do not exist."""
        named = (*self.network, *self.inputs, *self.trajectories)
        return tuple(path for path in dict.fromkeys(named) if not path.is_file())


def find_scenario(
    path: Path,
    *,
    network: Path | None = None,
    trajectories: Sequence[Path] = (),
    table: TableChoices | None = None,
) -> ScenarioFiles:
    """Find the files of a scenario.

    A configuration's own files come first; what it does not name or what is missing is
    looked for, by content, beside it and one folder down. A folder with exactly one
    configuration is read through that. A subfolder that has a network of its own is
    another scenario and is ignored.

    Args:
        path: A .sumocfg, a folder, a vehicle log, or a table of trajectories.
        network: Network to use instead of the one found.
        trajectories: Vehicle logs to use instead of those found.
        table: How tables of trajectories are to be understood.

    Returns:
        The files that exist, and those named but missing.

    Raises:
        InputError: If there is no network or vehicle log, or several to choose from.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("does not exist; give a .sumocfg or a folder", file=path)
    configuration, folder = (None, path) if path.is_dir() else (path, path.parent)
    if configuration is not None and tells_places(path):
        configuration, trajectories = None, trajectories or (path,)
    elif configuration is not None and (why := _no_table(path)):
        raise InputError(why, file=path)
    named = _NamedFiles() if configuration is None else _named_by(configuration)
    first = network or next((net for net in named.network if net.is_file()), None)
    own = (*trajectories, *((network,) if network else ()))
    survey = survey_folder(folder, network=first, named=own)
    if configuration is None and len(survey.configurations) == 1:
        only = survey.configurations[0]
        return find_scenario(only, network=network, trajectories=trajectories, table=table)
    if "inputs" in named.unset:
        logger.warning("%s", named.unset["inputs"])
    inputs = survey_files(file for file in named.inputs if file.is_file())
    logs = tuple(trajectories) or _existing(named.trajectories)
    outputs = [named.affixes.written(file) for file in _signal_outputs(named.inputs)]
    tables = logs or survey.trajectories or survey.tables
    # Of tables a network can be made.
    alone = first is None and not survey.networks and bool(tables) and all(map(is_table, tables))
    network = None if alone else first or _only(survey, named, path)
    if not logs:
        logs = _logs(survey, named, path)
        if configuration is not None:
            _note_found(logs[0], configuration)
    return in_sumos_form(
        network,
        logs,
        table or TableChoices(),
        signals=signal_logs(_existing(outputs) or survey.signals),
        additional=(inputs + survey).additional,
        vehicle_types=(inputs + survey).vehicle_types,
        missing=named.missing(),
    )


def files_behind(place: Path) -> tuple[Path, ...]:
    """Return the configuration that a scenario is read through, and the files that it names.

    Args:
        place: A .sumocfg, or a folder with one; nothing is returned for one with none or several.
    """
    configurations = survey_folder(place).configurations if place.is_dir() else (place,)
    if len(configurations) != 1:
        return ()
    named = _named_by(configurations[0])
    return (*configurations, *_existing([*named.network, *named.inputs, *named.trajectories]))


def _no_table(path: Path) -> str:
    """Return why a text is no table of trajectories; empty for anything else."""
    return "" if may_be_xml(path) or may_be_map(path) else why_no_table(path, TableChoices())


def _named_by(configuration: Path) -> _NamedFiles:
    """Return the files that a configuration names, relative to itself."""
    if (root := root_of(configuration)) not in CONFIGURATION_ROOTS:
        if root is not None and root in OTHERS:
            message = f"is {OTHERS[root].what}; {remedy(root, configuration)}"
            raise InputError(message, file=configuration)
        # Complain about damage before complaining about the kind of file.
        for _ in read_elements(configuration, root=(), what="a configuration of SUMO"):
            pass
        raise InputError(
            "is not a configuration of SUMO; give a .sumocfg or a folder", file=configuration
        )
    named = _NamedFiles()
    affixes: dict[str, str] = {}
    for element in read_elements(
        configuration, root=tuple(CONFIGURATION_ROOTS), what="a configuration of SUMO"
    ):
        target = _OPTIONS.get(element.tag)
        value = element.text("value", element.text("v", ""))
        if element.tag in ("output-prefix", "output-suffix"):
            affixes[element.tag.removeprefix("output-")] = replaced(value)
            target = "trajectories" if not_set(value) else None
        elif target is not None and value:
            paths = [_path(configuration.parent, name) for name in value.split(",") if name.strip()]
            getattr(named, target).extend(paths)
        if target is not None and not_set(value):
            variables = " and ".join(not_set(value))
            named.unset[target] = (
                f'{element.tag}="{value}" of {configuration.name} names {variables}, which is not'
                " set in the environment; set it as it was when SUMO ran"
            )
    named.affixes = Affixes(**affixes)
    named.trajectories = [named.affixes.written(path) for path in named.trajectories]
    return named


def _path(folder: Path, name: str) -> Path:
    """Return a file that SUMO names; files written on Windows may hold backslashes."""
    name = replaced(name.strip())
    plain = folder / name
    path = plain if plain.exists() else folder / name.replace("\\", "/")
    short = Path(os.path.normpath(path))  # where a folder is a link, `..` leads elsewhere
    return short if path.exists() and short.exists() and short.samefile(path) else path


def _signal_outputs(inputs: list[Path]) -> list[Path]:
    """Return the signal logs that additional files tell SUMO to write, relative to these files."""
    return [
        _path(file.parent, element.attributes["dest"])
        for file in inputs
        if file.is_file() and root_of(file) != "routes"
        for element in readable_elements(file)
        if element.tag == "timedEvent"
        and element.attributes.get("type") in _SIGNAL_EVENTS
        and "dest" in element.attributes
    ]


def _existing(paths: Sequence[Path]) -> tuple[Path, ...]:
    return tuple(path for path in paths if path.is_file())


def _only(survey: FileSurvey, named: _NamedFiles, place: Path) -> Path:
    """Return the network if there is exactly one."""
    networks = survey.networks
    if not networks:
        why = named.unset.get("network") or advice(_roots(survey.others), networks=True)
        why = why or "name it by --network"
        raise InputError(f"no network (.net.xml) was found; {why}", file=place)
    if len(networks) > 1:
        raise InputError(f"{_names(networks)} are networks; name one by --network", file=place)
    return networks[0]


def _logs(survey: FileSurvey, named: _NamedFiles, place: Path) -> tuple[Path, ...]:
    """Return the vehicle logs to use.

    Args:
        survey: What was found by content.
        named: What a configuration names; found logs with similar names are preferred.
        place: Where they were looked for, for messages.
    """
    every = survey.trajectories or survey.tables
    starts = tuple(path.name.split(".")[0] for path in named.trajectories)
    alike = tuple(file for file in every if file.name.startswith(starts))
    logs = vehicle_logs(alike) or vehicle_logs(every)
    if not survey.trajectories:
        logs = every if len(every) == 1 else ()
    if not every:
        run = "run sumo with --fcd-output fcd.xml.gz"
        if survey.configurations or not place.is_dir():
            run = f"let init --record run the simulation, or {run}"
        why = named.unset.get("trajectories") or advice(_roots(survey.others), networks=False)
        parts = ("no vehicle log was found", *([why] if why else []), run)
        raise InputError(f"{'; '.join(parts)}, or name a log by --trajectories", file=place)
    if not logs:
        raise InputError(
            f"{_names(every)} are vehicle logs; name one by --trajectories", file=place
        )
    return logs


def _note_found(log: Path, configuration: Path) -> None:
    """Say which log is taken that a configuration does not name, and when it was written."""
    written = time.strftime("%Y-%m-%d %H:%M", time.localtime(log.stat().st_mtime))
    logger.warning(
        "%s names no vehicle log that is there; %s is taken, written %s; init --record runs the"
        " simulation anew, --trajectories names another log",
        configuration.name,
        log.relative_to(configuration.parent),
        written,
        extra={"once": f"log beside {configuration}"},
    )


def _roots(files: Sequence[Path]) -> dict[Path, str | None]:
    """Return the root elements of files."""
    return {file: root_of(file) for file in files}


def _names(files: Sequence[Path]) -> str:
    alike = len({file.name for file in files}) < len(files)
    names = [f"{file.parent.name}/{file.name}" if alike else file.name for file in files[:4]]
    more = len(files) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")
