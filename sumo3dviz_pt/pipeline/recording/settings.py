"""Reads what a configuration of SUMO says about inputs and times."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.pipeline.recording.files import SumoSettings
from sumo3dviz_pt.sumo.outputs import replaced
from sumo3dviz_pt.sumo.stream import read_elements, root_of
from sumo3dviz_pt.sumo.survey import CONFIGURATION_ROOTS

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
    given = _options(path)
    if not given.get("net-file"):
        raise InputError("names no net-file, so there is nothing to simulate", file=path)
    (network,) = _files(path, given["net-file"])[:1]
    end = _seconds(path, given, "end")
    return SumoSettings(
        path,
        network,
        _files(path, given.get("route-files", "")),
        _files(path, given.get("additional-files", "")),
        _seconds(path, given, "begin") or 0.0,
        None if end is None or end < 0.0 else end,
        frozenset(given),
    )


def _options(path: Path) -> Mapping[str, str]:
    """Return all options of a configuration by their long names."""
    found: dict[str, str] = {}
    roots = tuple(CONFIGURATION_ROOTS)
    for element in read_elements(path, root=roots, what="a configuration of SUMO"):
        value = element.text("value", element.text("v", ""))
        found[_SYNONYMS.get(element.tag, element.tag)] = value
    return found


def _files(path: Path, names: str) -> tuple[Path, ...]:
    """Return files that a configuration names, which are relative to itself."""
    return tuple(path.parent / replaced(name.strip()) for name in names.split(",") if name.strip())


def _seconds(path: Path, given: Mapping[str, str], name: str) -> float | None:
    """Return a time, which SUMO also writes as days:hours:minutes:seconds [s]; None if not given.

    Raises:
        InputError: If it is no time.
    """
    text = given.get(name, "").strip()
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
