"""Find the files of a scenario, from a SUMO configuration or by searching a folder."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.scenario import ScenarioFiles
from sumo3dviz_pt.sumo.other_files import OTHERS, advice, remedy
from sumo3dviz_pt.sumo.outputs import Affixes, not_set, replaced
from sumo3dviz_pt.sumo.stream import read_elements, root_of
from sumo3dviz_pt.sumo.survey import (
    CONFIGURATION_ROOTS,
    Survey,
    readable_elements,
    signal_logs,
    survey_files,
    survey_folder,
    vehicle_logs,
)

logger = logging.getLogger(__name__)

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
    path: Path, *, network: Path | None = None, trajectories: Sequence[Path] = ()
) -> ScenarioFiles:
    """Find the files of a scenario.

    A configuration's own files come first; what it does not name or what is missing is
    looked for, by content, beside it and one folder down. A folder with exactly one
    configuration is read through that. A subfolder that has a network of its own is
    another scenario and is ignored.

    Args:
        path: A .sumocfg or a folder.
        network: Network to use instead of the one found.
        trajectories: Vehicle logs to use instead of those found.

    Returns:
        The files that exist, and those named but missing.

    Raises:
        InputError: If there is no network or vehicle log, or several to choose from.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("does not exist; give a .sumocfg or a folder", file=path)
    configuration, folder = (None, path) if path.is_dir() else (path, path.parent)
    named = _NamedFiles() if configuration is None else _named_by(configuration)
    first = network or next((net for net in named.network if net.is_file()), None)
    own = (*trajectories, *((network,) if network else ()))
    found = survey_folder(folder, network=first, named=own)
    if configuration is None and len(found.configurations) == 1:
        return find_scenario(found.configurations[0], network=network, trajectories=trajectories)
    if "inputs" in named.unset:
        logger.warning("%s", named.unset["inputs"])
    inputs = survey_files(file for file in named.inputs if file.is_file())
    logs = tuple(trajectories) or _existing(named.trajectories)
    outputs = [named.affixes.written(file) for file in _signal_outputs(named.inputs)]
    return ScenarioFiles(
        network=first or _only(found, named, path),
        trajectories=logs or _logs(found, named, path),
        signals=signal_logs(_existing(outputs) or found.signals),
        additional=(inputs + found).additional,
        vehicle_types=(inputs + found).vehicle_types,
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
    return plain if plain.exists() else folder / name.replace("\\", "/")


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


def _only(found: Survey, named: _NamedFiles, place: Path) -> Path:
    """Return the network if there is exactly one."""
    networks = found.networks
    if not networks:
        why = named.unset.get("network") or advice(_roots(found.others), networks=True)
        why = why or "name it by --network"
        raise InputError(f"no network (.net.xml) was found; {why}", file=place)
    if len(networks) > 1:
        raise InputError(f"{_names(networks)} are networks; name one by --network", file=place)
    return networks[0]


def _logs(survey: Survey, named: _NamedFiles, place: Path) -> tuple[Path, ...]:
    """Return the vehicle logs to use.

    Args:
        survey: What was found by content.
        named: What a configuration names; found logs with similar names are preferred.
        place: Where they were looked for, for messages.
    """
    found = survey.trajectories
    starts = tuple(path.name.split(".")[0] for path in named.trajectories)
    alike = tuple(file for file in found if file.name.startswith(starts))
    logs = vehicle_logs(alike) or vehicle_logs(found)
    if not found:
        run = "run sumo with --fcd-output fcd.xml.gz"
        if survey.configurations or not place.is_dir():
            run = f"let init --record run the simulation, or {run}"
        why = named.unset.get("trajectories") or advice(_roots(survey.others), networks=False)
        parts = ("no vehicle log was found", *([why] if why else []), run)
        raise InputError(f"{'; '.join(parts)}, or name a log by --trajectories", file=place)
    if not logs:
        raise InputError(
            f"{_names(found)} are vehicle logs; name one by --trajectories", file=place
        )
    return logs


def _roots(files: Sequence[Path]) -> dict[Path, str | None]:
    """Return the root elements of files."""
    return {file: root_of(file) for file in files}


def _names(files: Sequence[Path]) -> str:
    names = [file.name for file in files[:4]]
    more = len(files) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")
