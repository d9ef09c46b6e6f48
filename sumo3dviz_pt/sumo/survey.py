"""Tell SUMO's files apart by what is in them, not by their names."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import islice
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo.formats import format_of, is_log
from sumo3dviz_pt.sumo.other_files import OTHERS
from sumo3dviz_pt.sumo.plausibility.damage import note_damage
from sumo3dviz_pt.sumo.stops import KINDS
from sumo3dviz_pt.sumo.stream import Element, may_be_map, may_be_xml, read_elements, root_of
from sumo3dviz_pt.sumo.values import parse_time

logger = logging.getLogger(__name__)

ADDITIONAL_ROOTS = frozenset({"additional", "additionals", "add", "shapes", "vTypes"})
_PLACED = frozenset({"poi", "poly", "parkingArea", *KINDS})
"""Elements of additional files that stand somewhere."""

CONFIGURATION_ROOTS = frozenset({"configuration", "sumoConfiguration"})
_PLACES = {
    "net": "networks",
    "tlsStates": "signals",
    "tlsSwitches": "signals",
    "routes": "vehicle_types",
}
"""Fields of `Survey` by the root elements that decide alone."""

_ENTRIES = ("tlsState", "tlsSwitch")
"""Entries of signal logs; the first tell more."""

_PEEK = 20_000
"""Number of elements that show what a log holds, some seconds of a large city."""


@dataclass(frozen=True, slots=True)
class Survey:
    """The files of a place, by content.

    Attributes:
        networks: `<net>`.
        trajectories: Vehicle logs in any format.
        signals: `<tlsStates>` and `<tlsSwitches>`.
        additional: Files with a POI, a polygon, a stop or a parking area.
        vehicle_types: Route files, and additional files with a vType.
        configurations: SUMO's configurations.
        others: Files whose kind is known and of which no film can be made.
    """

    networks: tuple[Path, ...] = ()
    trajectories: tuple[Path, ...] = ()
    signals: tuple[Path, ...] = ()
    additional: tuple[Path, ...] = ()
    vehicle_types: tuple[Path, ...] = ()
    configurations: tuple[Path, ...] = ()
    others: tuple[Path, ...] = ()

    def __add__(self, other: Survey) -> Survey:
        """Join the files of two places; each file stands once."""
        return Survey(
            *(_once(getattr(self, f.name) + getattr(other, f.name)) for f in fields(Survey))
        )


def survey_folder(
    folder: Path, *, network: Path | None = None, named: Collection[Path] = ()
) -> Survey:
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
        asked = network is not None and network.resolve() in [n.resolve() for n in below.networks]
        if below.networks and not asked and (network is not None or top.networks):
            logger.info("%s: has its own network and is left out", sub)
        else:
            top = top + below
    return top


def survey_files(files: Iterable[Path], named: Collection[Path] = ()) -> Survey:
    """Sort files by content; files that are not of SUMO are left out.

    A note says which files of SUMO are damaged, but for those that a user names.
    """
    found = Survey()
    silent = {file.resolve() for file in named}
    for file in files:
        root = root_of(file) if may_be_xml(file) or may_be_map(file) else None
        if root is None and may_be_xml(file) and file.resolve() not in silent:
            note_damage(file)
        found = found + _sorted_in(file, root)
    return found


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


def _sorted_in(file: Path, root: str | None) -> Survey:
    """Return a survey of one file; its root element is given, or None if it is no XML."""
    one = (file,)
    if root in CONFIGURATION_ROOTS:
        # Other tools of SUMO use the same root for their own configurations.
        own = root == "sumoConfiguration" or file.suffix == ".sumocfg"
        return Survey(configurations=one if own else ())
    if root in ADDITIONAL_ROOTS:
        tags = {element.tag for element in readable_elements(file)}
        return Survey(
            additional=one if tags & _PLACED else (),
            vehicle_types=one if "vType" in tags else (),
        )
    if root in _PLACES:
        return Survey(**{_PLACES[root]: one})
    if root in OTHERS:
        return Survey(others=one)
    return Survey(trajectories=one if is_log(file) else ())


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
