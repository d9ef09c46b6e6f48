"""The command line that makes SUMO write what a film needs, and the files that it writes.

It follows from what a configuration of SUMO says about inputs and times, and from the network,
which is not read into memory as a whole. An option of the command line beats one of the
configuration. Some of SUMO's cannot be taken back, because an empty value counts as none given;
they get a value that has no effect.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.motion import MARGIN
from sumo3dviz_pt.recording.files import EVENTS, LOG, SIGNALS, RecordOrder, SumoSettings, events
from sumo3dviz_pt.sumo.file_names import replaced
from sumo3dviz_pt.sumo.find import CONFIGURATION_ROOTS
from sumo3dviz_pt.sumo.stream import Element, read_elements, root_of


def edge_names(path: Path) -> Iterator[str]:
    """Yield the ids of all edges, those within junctions, too.

    Raises:
        InputError: If the file is damaged or no network.
    """
    return (element.text("id") for element in _elements(path) if element.tag == "edge")


def has_heights(path: Path) -> bool:
    """Return whether SUMO writes heights: whether any lane is elsewhere than at height 0.

    Raises:
        InputError: If the file is damaged or no network.
    """
    return any(
        _is_high(point)
        for element in _elements(path)
        if element.tag == "lane"
        for point in element.text("shape", "").split()
    )


def _is_high(point: str) -> bool:
    """Return whether a point of a shape has a height that is not 0."""
    _, _, height = point.partition(",")[2].partition(",")
    return bool(height.strip("-0."))


def _elements(path: Path) -> Iterator[Element]:
    """Yield the elements of a network."""
    return read_elements(path, root="net", what="a SUMO network")


_SYNONYMS = {
    "net": "net-file",
    "n": "net-file",
    "routes": "route-files",
    "r": "route-files",
    "additional": "additional-files",
    "a": "additional-files",
    "b": "begin",
    "e": "end",
    "H": "human-readable-time",
}
"""Short names of options, which configurations may use."""


def read_settings(path: Path) -> SumoSettings:
    """Read a configuration of SUMO.

    Raises:
        InputError: If it is missing, damaged, no configuration, or names no network.
    """
    if not path.is_file():
        raise InputError("does not exist; give a .sumocfg", file=path)
    if root_of(path) not in CONFIGURATION_ROOTS:
        raise InputError("is not a configuration of SUMO; give a .sumocfg", file=path)
    options = _options(path)
    if not options.get("net-file"):
        raise InputError("names no net-file, so there is nothing to simulate", file=path)
    (network,) = _files(path, options["net-file"])[:1]
    end = _seconds(path, options, "end")
    return SumoSettings(
        path,
        network,
        _files(path, options.get("route-files", "")),
        _files(path, options.get("additional-files", "")),
        _seconds(path, options, "begin") or 0.0,
        None if end is None or end < 0.0 else end,
        frozenset(options),
    )


def _options(path: Path) -> Mapping[str, str]:
    """Return all options of a configuration by their long names."""
    options: dict[str, str] = {}
    roots = tuple(CONFIGURATION_ROOTS)
    for element in read_elements(path, root=roots, what="a configuration of SUMO"):
        value = element.text("value", element.text("v", ""))
        options[_SYNONYMS.get(element.tag, element.tag)] = value
    return options


def _files(path: Path, names: str) -> tuple[Path, ...]:
    """Return files that a configuration names, which are relative to itself."""
    return tuple(path.parent / replaced(name.strip()) for name in names.split(",") if name.strip())


def _seconds(path: Path, options: Mapping[str, str], name: str) -> float | None:
    """Return a time, which SUMO also writes as days:hours:minutes:seconds [s]; None if not given.

    Raises:
        InputError: If it is no time.
    """
    text = options.get(name, "").strip()
    if not text:
        return None
    try:
        parts = [float(part) for part in text.split(":")]
    except ValueError:
        parts = []
    if len(parts) not in (1, 3, 4):
        raise InputError(f"{name}: {text!r} is no time", file=path)
    *days, hours, minutes, seconds = [0.0, 0.0, *parts] if len(parts) == 1 else parts
    return sum(days) * 86_400.0 + hours * 3600.0 + minutes * 60.0 + seconds


PEOPLE = "person-fcd-output"
"""The option that sends people and containers to a log of their own."""

_PLACE = "sumo3dviz_place"
_CORNERS = 48
_EVERYWHERE = 1e7
"""Half the side of a square that holds every network [m]."""

_DIGITS = "3"
"""Decimals of places: SUMO's two would move the wheels of a slow car by half a centimetre."""

_SHAPES, _EDGES = "fcd-output.filter-shapes", "fcd-output.filter-edges.input-file"

_ATTRIBUTES = "id,x,y,z,angle,type,speed,pos,lane,edge,slope,signals,acceleration,accelerationLat"

_TAKEN_BACK = {
    "fcd-output.attributes": _ATTRIBUTES,
    "fcd-output.geo": "false",
    "fcd-output.utm": "false",
    "fcd-output.distance": "false",
    "fcd-output.speed-relative": "false",
    "fcd-output.max-leader-distance": "-1",
    "fcd-output.params": "",
    "fcd-output.skip-empty": "false",
    "human-readable-time": "false",
    "output.format": "xml",
    "device.fcd.begin": "-1",
}
"""Options that change a log, and values that change nothing; given only where the configuration
has the option, because older versions of SUMO do not know all of them."""


def arguments(
    settings: SumoSettings, order: RecordOrder, part: Path, prefix: str, *, listener: str = ""
) -> list[str]:
    """Return SUMO's command line, without the program.

    Args:
        settings: Of the simulation.
        order: What is to be kept.
        part: Folder for what is written; it exists.
        prefix: What SUMO puts before the names of the files that it writes.
        listener: `host:port` to which both logs are sent, in one stream; empty for files.
    """
    extra, log = part / EVENTS, listener or str((part / LOG).absolute())
    place = _place(order) if _is_placed(settings, order) else ""
    write_atomically(extra, events(listener or str((part / SIGNALS).absolute()), place))
    additional = [*settings.additional, extra]
    words = ["-c", str(settings.path.absolute()), "--output-prefix", prefix]
    words += ["--additional-files", ",".join(str(each.absolute()) for each in additional)]
    words += ["--fcd-output", log, "--fcd-output.acceleration", "true"]
    words += ["--fcd-output.signals", "true", "--precision", _DIGITS]
    # The configuration may thin its own log.
    words += ["--device.fcd.period", "0", "--no-step-log", "false", "--step-log.period", "10"]
    words += [f"--{PEOPLE}", log] if PEOPLE in settings.given else []
    words += [*_whom(settings, order), *_where(settings, order, part), *_when(settings, order)]
    # SUMO refuses an option that is given twice.
    back = [name for name in _TAKEN_BACK if name in settings.given and f"--{name}" not in words]
    return words + [word for name in back for word in (f"--{name}", _TAKEN_BACK[name])]


def _whom(settings: SumoSettings, order: RecordOrder) -> list[str]:
    """Return the options that say which road users are kept."""
    people = ["--person-device.fcd.probability", "1"]
    if "person-device.fcd.period" in settings.given:
        people += ["--person-device.fcd.period", "0"]
    if order.follow is None:
        return ["--device.fcd.probability", "1", *people]
    words = ["--device.fcd.probability", "0", "--device.fcd.explicit", order.follow]
    return [*words, "--device.fcd.radius", f"{order.radius:g}", *people]


def _is_placed(settings: SumoSettings, order: RecordOrder) -> bool:
    """Return whether SUMO has to be told a place: it was asked for, or replaces the owner's."""
    return order.around is not None or _SHAPES in settings.given


def _where(settings: SumoSettings, order: RecordOrder, part: Path) -> list[str]:
    """Return the place that is kept."""
    words = []
    if _is_placed(settings, order):
        words += [f"--{_SHAPES}", _PLACE]
    if _EDGES in settings.given:
        names = part / "edges.txt"
        write_atomically(names, "".join(f"edge:{name}\n" for name in edge_names(settings.network)))
        words += [f"--{_EDGES}", str(names.absolute())]
    return words


def _when(settings: SumoSettings, order: RecordOrder) -> list[str]:
    """Return the window that is kept, and the seed."""
    words = []
    if order.start is not None:
        begin = max(order.start - MARGIN, settings.begin)
        words += ["--device.fcd.begin", f"{begin:.12g}"]
    if order.end is not None:
        words += ["--end", f"{end_of(settings, order):.12g}"]
    return words + (["--seed", str(order.seed)] if order.seed is not None else [])


def end_of(settings: SumoSettings, order: RecordOrder) -> float | None:
    """Return when the simulation ends [s]; None when nobody is left."""
    if order.end is None:
        return settings.end
    end = order.end + MARGIN
    return end if settings.end is None else min(end, settings.end)


def _place(order: RecordOrder) -> str:
    """Return the place that is kept as a polygon of SUMO: a circle, or everywhere."""
    if order.around is None:
        side = _EVERYWHERE
        points = [(-side, -side), (side, -side), (side, side), (-side, side)]
    else:
        east, north, radius = order.around
        turns = [2.0 * math.pi * k / _CORNERS for k in range(_CORNERS)]
        points = [(east + radius * math.cos(t), north + radius * math.sin(t)) for t in turns]
    shape = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
    return f'    <poly id="{_PLACE}" shape="{shape}" color="0,0,0"/>\n'
