"""Translates a configuration of sumo3Dviz 1.0 into a scene file.

Its modes become cameras and shots. What it says of files, cameras, times and looks is taken over;
what needs no saying here (where signals stand, what is a tree), what has no counterpart and what
had no effect there is told.

References:
    sumo3Dviz: A three dimensional traffic visualisation. arXiv:2604.19194 (2026). What each
    key does there was read in its code, version 1.0.0.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PureWindowsPath
from typing import Any

import yaml

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.pipeline.still import check_writable


@dataclass(slots=True)
class Configuration:
    """A configuration that is being read.

    Attributes:
        content: All of it.
        file: Where it stands.
        root: Folder that its paths refer to.
        read: Dotted keys that were understood.
        notes: What a user should know of its translation.
        moved: Files that lie elsewhere than it says, or are packed.
    """

    content: Mapping[str, Any]
    file: Path
    root: Path
    read: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    moved: list[Path] = field(default_factory=list)

    def at(self, key: str) -> Any:
        """Return the value at a dotted key, or None; it counts as understood."""
        self.read.add(key)
        value: Any = self.content
        for word in key.split("."):
            if not isinstance(value, Mapping) or word not in value:
                return None
            value = value[word]
        return value

    def number(self, key: str, default: float = 0.0) -> float:
        """Return a number.

        Raises:
            ConfigError: If there is something else.
        """
        value = self.at(key)
        return default if value is None else self.as_number(value, key)

    def numbers(self, key: str, default: Sequence[float]) -> list[float]:
        """Return as many numbers as the default has.

        Raises:
            ConfigError: If there is something else.
        """
        value = self.at(key)
        value = list(default) if value is None else value
        if not isinstance(value, list) or len(value) != len(default):
            raise self.error(f"{value!r} are not {len(default)} numbers", key)
        return [self.as_number(each, key) for each in value]

    def as_number(self, value: Any, key: str) -> float:
        """Return a value as a number; the key is for messages.

        Raises:
            ConfigError: If it is none.
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(f"{value!r} is no number", key)
        return float(value)

    def error(self, message: str, key: str) -> ConfigError:
        """Return an error that names a key and the file."""
        return ConfigError(message, key=key, file=self.file)

    def unknown(self) -> Iterator[str]:
        """Yield the dotted keys that were not understood."""
        for key in _leaves(self.content):
            if not any(key == known or key.startswith(f"{known}.") for known in self.read):
                yield key


def _leaves(content: Any, before: str = "") -> Iterator[str]:
    """Yield the dotted keys of all values."""
    if not isinstance(content, Mapping):
        yield before
        return
    for key, value in content.items():
        yield from _leaves(value, f"{before}.{key}" if before else str(key))


FOV = 50.9
"""Panda3D's own horizontal opening angle at 16:9, which sumo3Dviz cannot change [deg]."""

_POSE = ("pos_x", "pos_y", "pos_z", "ori_h", "ori_p", "ori_r")


def cameras_of(peer: Configuration, log: Path) -> dict[str, Any]:
    """Return cameras by the names of their modes, and a shot for each that has times.

    Args:
        peer: The configuration.
        log: The log of positions.
    """
    cameras: dict[str, Any] = {}
    shots = []
    for mode, build in _MODES.items():
        if peer.at(f"modes.{mode}") is None:
            continue
        cameras[mode] = build(peer, f"modes.{mode}")
        shot = _shot(peer, mode, log)
        if shot is not None:
            shots.append(shot)
    return {"cameras": cameras, "shots": shots}


def _shot(peer: Configuration, mode: str, log: Path) -> dict[str, Any] | None:
    """Return a mode's shot, as long as its ego is there: sumo3Dviz films no longer than that."""
    from sumo3dviz_pt.sumo import whereabouts

    keys = [f"modes.{mode}.simtime_{which}" for which in ("start", "end")]
    if any(peer.at(key) is None for key in keys):
        return None
    start, end = (peer.number(key) for key in keys)
    shot = {"camera": mode, "from": start, "to": end}
    ego = peer.at(f"modes.{mode}.ego_identifier")
    if ego is None:
        return shot
    spans = whereabouts([log], str(ego)).spans
    common = [(max(start, first), min(end, last)) for first, last in spans]
    first, last = max(common, key=lambda span: span[1] - span[0], default=(start, end))
    if not spans:
        peer.notes.append(f"modes.{mode}.ego_identifier: {ego!r} is not in the log {log}")
        return shot
    if last <= first:
        there = ", ".join(f"{a:.12g} to {b:.12g} s" for a, b in spans)
        text = f"no shot for modes.{mode}: {ego!r} is in the log at other times ({there})"
        peer.notes.append(text)
        return None
    if (first, last) != (start, end):
        span = f"{first:.12g} to {last:.12g} s"
        peer.notes.append(f"modes.{mode} is filmed from {span}, while {ego!r} is in the log")
    return {**shot, "from": first, "to": last}


def _standing(peer: Configuration, mode: str) -> dict[str, Any]:
    """Return a camera that stands."""
    return {"mode": "eulerian", **_pose(peer, f"{mode}.camera_position"), "lens": {"fov": FOV}}


def _riding(peer: Configuration, mode: str) -> dict[str, Any]:
    """Return a driver's eye."""
    vehicle = peer.at(f"{mode}.ego_identifier")
    if vehicle is None:
        raise peer.error("names nobody to ride with", f"{mode}.ego_identifier")
    return {"mode": "lagrangian", "vehicle": str(vehicle), "view": "driver"}


def _flying(peer: Configuration, mode: str) -> dict[str, Any]:
    """Return a camera's path."""
    path = f"{mode}.camera_position_trajectory"
    stations = peer.at(path)
    if not isinstance(stations, Mapping) or not stations:
        raise peer.error("holds no key frames", path)
    times = {_time(peer, key, path): key for key in stations}
    frames = []
    for time, key in sorted(times.items()):
        # The times hold dots, so dotted keys would not find them.
        one = replace(peer, content={"station": stations[key]}, read=set())
        frames.append({"time": time, **_pose(one, "station")})
    return {"mode": "cinematic", "lens": {"fov": FOV}, "keyframes": frames}


def _time(peer: Configuration, key: Any, path: str) -> float:
    """Return the time of a key frame [s]."""
    try:
        return float(key)
    except (TypeError, ValueError):
        raise peer.error(f"{key!r} is no time in seconds", path) from None


def _visiting(peer: Configuration, mode: str) -> dict[str, Any]:
    """Return where the interactive camera begins."""
    own = f"{mode}.initial_camera_position"
    position = peer.numbers(f"{own}.position", (120.0, -20.0, 0.0))
    turned = peer.numbers(f"{own}.orientation", (180.0, 0.0, 0.0))
    angles = _angles(*turned)
    return {"mode": "eulerian", "position": position, **angles, "lens": {"fov": FOV}}


_MODES = {
    "eulerian": _standing,
    "lagrangian": _riding,
    "cinematic": _flying,
    "interactive": _visiting,
}


def _pose(peer: Configuration, key: str) -> dict[str, Any]:
    """Return the place and angles at a key."""
    x, y, z, *turned = (peer.number(f"{key}.{word}") for word in _POSE)
    return {"position": [x, y, z], **_angles(*turned)}


def _angles(ori_h: float, ori_p: float, ori_r: float) -> dict[str, float]:
    """Return our angles; their heading goes counter-clockwise from +y [deg]."""
    return {"heading": -ori_h % 360.0, "pitch": ori_p, "roll": ori_r}


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
        why = getattr(error, "strerror", None) or error
        message = f"the configuration cannot be read ({why}); check the path"
        raise ConfigError(message, file=file) from error
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
    scenario: dict[str, str | list[str]] = {
        "network": relative(network, folder),
        "trajectories": [relative(log, folder)],
    }
    signals = file_of(peer, "traffic_signal_states_file")
    if signals is not None:
        scenario["signals"] = [relative(signals, folder)]
    return scenario


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
    file = _nearest(str(name), peer.root)
    if file is None and key != "trajectory_file":
        peer.notes.append(f"missing, and done without: {peer.root / str(name)}")
    elif file is not None and file != peer.root / str(name):
        peer.moved.append(file)
    return file


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
    from sumo3dviz_pt.sumo.find import survey_folder

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


_SKIES = {
    "sky_blue": "sky_blue",
    "sky_cloudy": "sky_daycloud1",
    "sky_overcast": "sky_overcast",
    "sky_dawn": "sky_dawn",
    "sky_night_stars": "sky_night1",
    "sky_night_clear": "sky_night2",
    "sky_night_forest": "sky_night1",
    "sky_night_desert": "sky_night2",
    "sky_halloween": "sky_halloween",
}

_TREES = {"tree_scale_1": 0.2, "tree_scale_2": 0.5}
"""Keys that scale the two models of trees, and their defaults."""

_UNNEEDED = {
    "rendering.record_video": "`render` and `view` are commands here",
    "rendering.headless": "nothing here needs a screen",
    "visualization.show_dashed_lane_seperator_line": "lines are painted as the network wants them",
    "visualization.lane_width": "lanes are as wide as in the network; `roads.lane_width` sets one",
    "visualization.tree_color_variability": "leaves have natural colours",
    "visualization.viewer_height": "it had no effect there, where eyes are always 2.12 m high;"
    " here they are where the vehicle has them, and `cameras.lagrangian.eye_height` sets a height",
    "signals.traffic_light_positions": "signals stand at the network's stop lines, and all have"
    " one design",
}
"""Keys that are not taken over, and why."""


def translate(
    config: Path, *, output: Path, root: Path | None = None, trajectories: Path | None = None
) -> tuple[str, list[str]]:
    """Write a scene file from a configuration of sumo3Dviz.

    Args:
        config: Its YAML file.
        output: Where the scene file will lie; paths in it are relative to that.
        root: Folder that the configuration's paths refer to; default the folder above it
            in which its network lies.
        trajectories: Log of positions instead of the configuration's; where both are missing,
            the only one that lies beside the configuration.

    Returns:
        The text, and notes for the user.

    Raises:
        ConfigError: If it is no such configuration, or the output's folder does not exist.
        InputError: If its network or its log of positions is missing.
    """
    check_writable(output)
    folder = output.parent
    if trajectories is not None and not trajectories.is_file():
        raise InputError("the log of positions does not exist", file=trajectories)
    peer = open_configuration(config, root)
    scenario = scenario_of(peer, folder, trajectories)
    settings = {
        "scenario": scenario,
        "template": "highway_day",
        "sky": {"preset": _sky(peer)},
        "ground": {"texture": str(peer.at("visualization.ground_texture") or "ground_grass")},
        "roads": _roads(peer),
        "objects": _objects(peer, folder),
        "signals": _signals(peer),
        **cameras_of(peer, folder / scenario["trajectories"][0]),
        "output": _output(peer),
    }
    stated = {key: value for key, value in settings.items() if value}
    make_job(stated, folder=folder)
    text = yaml.safe_dump(stated, sort_keys=False, allow_unicode=True, default_flow_style=None)
    return f"# From {config.name}, a configuration of sumo3Dviz.\n{text}", [*_notes(peer)]


def _sky(peer: Configuration) -> str:
    """Return our sky that is like one of theirs."""
    sky = str(peer.at("visualization.sky_texture") or "sky_cloudy")
    if sky not in _SKIES:
        message = f"sumo3Dviz has no sky {sky!r}; it has {', '.join(_SKIES)}"
        raise peer.error(message, "visualization.sky_texture")
    return _SKIES[sky]


def _roads(peer: Configuration) -> dict[str, Any]:
    """Return how lines are painted; those without a width were not seen."""
    width = peer.number("visualization.sep_line_width", 0.12)
    return {"line_width": width} if width > 0.0 else {"markings": False}


def _objects(peer: Configuration, folder: Path) -> dict[str, Any]:
    """Return where trees, houses and fences stand, and how large the trees are."""
    objects = dict(objects_of(peer, folder))
    scales = [peer.number(f"visualization.{key}", usual) / usual for key, usual in _TREES.items()]
    spread = peer.number("visualization.tree_size_variability", 1.0)
    scale = sum(scales) / len(scales) * (spread or 1.0)
    if abs(scale - 1.0) > 1e-6:
        objects.setdefault("trees", {})["scale"] = round(scale, 3)
    if not spread:
        objects.setdefault("trees", {})["variation"] = 0.0
        text = (
            "visualization.tree_size_variability: 0 hid all trees there; here they are of one size"
        )
        peer.notes.append(text)
    return objects


def _signals(peer: Configuration) -> dict[str, Any]:
    """Return whether signals are drawn, and their design."""
    heads = int(peer.number("signals.num_heads", 3))
    counting = peer.at("signals.countdown_timer") is not False
    design = "two_heads" if heads == 2 else "countdown" if counting else "three_heads"
    shown = peer.at("visualization.show_signals")
    return {"show": shown is not False, "design": design}


def _output(peer: Configuration) -> dict[str, Any]:
    """Return the size and rate of the film."""
    size = [peer.number("rendering.video_width_px", 1140)]
    size += [peer.number("rendering.video_height_px", 900)]
    return {
        # Video needs even sides.
        "size": [max(2, round(side / 2) * 2) for side in size],
        "fps": peer.number("rendering.video_fps", 25.0),
    }


def _notes(peer: Configuration) -> Iterator[str]:
    """Yield what was not taken over, and why."""
    for key, why in _UNNEEDED.items():
        if peer.at(key) is not None:
            yield f"{key} was not taken over: {why}"
    if peer.at("visualization.show_other_vehicles") is False:
        yield "visualization.show_other_vehicles was not taken over: everyone is shown here"
    if peer.moved:
        names = ", ".join(path.name for path in peer.moved)
        yield f"found in {peer.root}, but not just where the configuration says: {names}"
    yield from peer.notes
    for key in peer.unknown():
        yield f"{key} is no key of sumo3Dviz 1.0 and was left out"
    yield (
        "their configurations name no vTypes: name the files that define them in"
        " scenario.vehicle_types, or vehicles are drawn as their names say, else as cars"
    )
    yield "films run at real time here; sumo3Dviz 1.0 plays them twice as fast"
