"""Find the files that a configuration of sumo3Dviz names."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path, PureWindowsPath
from typing import Any

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.sumo3dviz.configuration import Configuration

_OBJECTS = {
    "fence_lines_file": "fences",
    "shops_positions_file": "shops",
    "homes_positions_file": "homes",
    "blocks_positions_file": "blocks",
    "tree_positions_file": "trees",
}
"""Kinds of objects by the key that names their file."""


def open_configuration(file: Path, root: Path | None) -> Configuration:
    """Read a configuration and find out what its paths refer to.

    In sumo3Dviz, paths refer to the folder in which the program was started.

    Args:
        file: Its YAML file.
        root: That folder; default the working directory, or one above the configuration.

    Raises:
        ConfigError: If it is no configuration of sumo3Dviz.
        InputError: If its network is missing.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"the configuration cannot be read: {error}", file=file) from error
    content, _ = parse_yaml(text, file=file)
    if not isinstance(content, dict) or not isinstance(content.get("paths"), dict):
        raise ConfigError("this is no configuration of sumo3Dviz: it has no `paths`", file=file)
    network = content["paths"].get("sumo_network_file")
    if not network:
        raise ConfigError("names no network", key="paths.sumo_network_file", file=file)
    places = [root] if root is not None else [Path.cwd(), *file.resolve().parents]
    for place in places:
        if (place / str(network)).is_file():
            return Configuration(content, file, place)
    # Examples are often copied without the folders above them, or packed.
    place = root or file.resolve().parent
    if _nearest(str(network), place) is not None:
        return Configuration(content, file, place)
    if root is not None:
        raise InputError(f"there is no {root / str(network)}", file=file)
    raise InputError(
        f"{network} lies neither here nor beside the configuration nor above it;"
        " name the folder that its paths refer to with --root",
        file=file,
    )


def scenario_of(
    peer: Configuration, folder: Path, trajectories: Path | None
) -> dict[str, str | list[str]]:
    """Return the simulation's files as they stand in a scene file.

    Args:
        peer: The configuration.
        folder: Where the scene file will lie.
        trajectories: Log of positions instead of the configuration's.

    Raises:
        InputError: If there is no log of positions.
    """
    network = file_of(peer, "sumo_network_file")
    if network is None:
        raise InputError("the network does not exist", file=peer.file)
    log = trajectories or file_of(peer, "trajectory_file")
    if log is None or not log.is_file():
        log = _only_log(peer, log)
    found: dict[str, str | list[str]] = {
        "network": relative(network, folder),
        "trajectories": [relative(log, folder)],
    }
    signals = file_of(peer, "traffic_signal_states_file")
    if signals is not None:
        found["signals"] = [relative(signals, folder)]
    return found


def objects_of(peer: Configuration, folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield kinds of objects and where they stand, as in a scene file.

    Args:
        peer: The configuration.
        folder: Where the scene file will lie.
    """
    for key, family in _OBJECTS.items():
        path = file_of(peer, key)
        if path is not None:
            yield family, {"file": relative(path, folder)}


def file_of(peer: Configuration, key: str) -> Path | None:
    """Return a file that a configuration names; None, with a note, where it does not exist."""
    name = peer.at(f"paths.{key}")
    if not name:
        return None
    found = _nearest(str(name), peer.root)
    if found is None and key != "trajectory_file":
        peer.notes.append(f"missing, and done without: {peer.root / str(name)}")
    elif found is not None and found != peer.root / str(name):
        peer.moved.append(found)
    return found


def relative(path: Path, folder: Path) -> str:
    """Return a path as it stands in a scene file.

    Args:
        path: The file.
        folder: Where the scene file will lie.
    """
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive on Windows
        return path.resolve().as_posix()


def _nearest(name: str, place: Path) -> Path | None:
    """Return a named file, perhaps gzipped, or with fewer of the folders before its name."""
    parts = PureWindowsPath(name).parts if "\\" in name else Path(name).parts
    for first in range(len(parts)):
        path = place.joinpath(*parts[first:])
        for each in (path, path.with_name(f"{path.name}.gz")):
            if each.is_file():
                return each
    return None


def _only_log(peer: Configuration, named: Path | None) -> Path:
    """Return the only vehicle log that lies beside a configuration.

    Raises:
        InputError: If there is none, or several.
    """
    from sumo3dviz_pt.sumo.survey import survey_folder

    name = peer.at("paths.trajectory_file")
    wanted = named or (peer.root / str(name) if name else "of the configuration")
    logs = survey_folder(peer.file.resolve().parent).trajectories
    if len(logs) == 1:
        text = f"paths.trajectory_file: {wanted} does not exist; {logs[0]} is taken instead"
        peer.notes.append(text)
        return logs[0]
    raise InputError(
        f"the log of positions {wanted} does not exist; name one with --trajectories",
        file=peer.file,
    )
