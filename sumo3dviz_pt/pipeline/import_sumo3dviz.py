"""Translates a configuration of sumo3Dviz 1.0 into a scene file.

What it says of files, cameras, times and looks is taken over; what needs no saying here
(where signals stand, what is a tree) and what has no counterpart is told.

References:
    sumo3Dviz: A three dimensional traffic visualisation. arXiv:2604.19194 (2026). What each
    key does there was read in its code, version 1.0.0.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.pipeline.stills.still import check_writable

FOV = 50.9
"""Panda3D's own horizontal opening angle at 16:9, which sumo3Dviz cannot change [deg]."""

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

_OBJECTS = {
    "fence_lines_file": "fences",
    "shops_positions_file": "shops",
    "homes_positions_file": "homes",
    "blocks_positions_file": "blocks",
    "tree_positions_file": "trees",
}

_UNNEEDED = {
    "rendering.record_video": "`render` and `view` are commands here",
    "rendering.headless": "nothing here needs a screen",
    "visualization.show_dashed_lane_seperator_line": "lines are painted as the network wants them",
    "visualization.lane_width": "lanes are as wide as in the network; `roads.lane_width` sets one",
    "visualization.tree_scale_1": "trees have their natural size; `objects.trees.scale` changes it",
    "visualization.tree_scale_2": "trees have their natural size; `objects.trees.scale` changes it",
    "visualization.tree_size_variability": "`objects.trees.variation` is the spread of sizes",
    "visualization.tree_color_variability": "leaves have natural colours",
    "visualization.viewer_height": "drivers' eyes are where the vehicle has them, as SUMO's"
    " classes tell; `cameras.lagrangian.eye_height` sets another height",
    "signals.traffic_light_positions": "signals stand at the network's stop lines",
}


@dataclass(slots=True)
class _Peer:
    """A configuration that is being read.

    Attributes:
        content: All of it.
        file: Where it stands.
        root: Folder that its paths refer to.
        read: Dotted keys that were understood.
    """

    content: Mapping[str, Any]
    file: Path
    root: Path
    read: set[str] = field(default_factory=set)

    def at(self, key: str) -> Any:
        """Return the value at a dotted key, or None; it counts as understood."""
        self.read.add(key)
        found: Any = self.content
        for word in key.split("."):
            if not isinstance(found, Mapping) or word not in found:
                return None
            found = found[word]
        return found

    def number(self, key: str, default: float = 0.0) -> float:
        """Return a number.

        Raises:
            ConfigError: If there is something else.
        """
        value = self.at(key)
        if value is None:
            return default
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ConfigError(f"{value!r} is no number", key=key, file=self.file)
        return float(value)

    def path(self, key: str) -> Path | None:
        """Return a file that it names."""
        value = self.at(f"paths.{key}")
        return self.root / str(value) if value else None


def translate(
    config: Path, *, output: Path, root: Path | None = None, trajectories: Path | None = None
) -> tuple[str, list[str]]:
    """Write a scene file from a configuration of sumo3Dviz.

    Args:
        config: Its YAML file.
        output: Where the scene file will lie; paths in it are relative to that.
        root: Folder that the configuration's paths refer to; default the folder above it
            in which its network lies.
        trajectories: Log of positions instead of the configuration's.

    Returns:
        The text, and notes for the user.

    Raises:
        ConfigError: If it is no such configuration, or the output's folder does not exist.
        InputError: If its network or its log of positions is missing.
    """
    check_writable(output)
    peer = _opened(config, root)
    settings = {
        "scenario": _scenario(peer, output.parent, trajectories),
        "template": "highway_day",
        "sky": {"preset": _sky(peer)},
        "ground": {"texture": str(peer.at("visualization.ground_texture") or "ground_grass")},
        "roads": {"line_width": peer.number("visualization.sep_line_width", 0.12)},
        "objects": dict(_objects(peer, output.parent)),
        "signals": _signals(peer),
        **_cameras(peer),
        "output": _output(peer),
    }
    kept = {key: value for key, value in settings.items() if value}
    make_job(kept, folder=output.parent)
    text = yaml.safe_dump(kept, sort_keys=False, allow_unicode=True, default_flow_style=None)
    return f"# From {config.name}, a configuration of sumo3Dviz.\n{text}", [*_notes(peer)]


def _opened(config: Path, root: Path | None) -> _Peer:
    """Read a configuration and find out what its paths refer to."""
    try:
        text = config.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"the configuration cannot be read: {error}", file=config) from error
    content, _ = parse_yaml(text, file=config)
    if not isinstance(content, dict) or not isinstance(content.get("paths"), dict):
        raise ConfigError("this is no configuration of sumo3Dviz: it has no `paths`", file=config)
    network = content["paths"].get("sumo_network_file")
    if not network:
        raise ConfigError("names no network", key="paths.sumo_network_file", file=config)
    # In sumo3Dviz, paths refer to the folder in which the program was started.
    places = [root] if root is not None else [Path.cwd(), *config.resolve().parents]
    for place in places:
        if (place / str(network)).is_file():
            return _Peer(content, config, place)
    packed = next((place / f"{network}.gz" for place in places), Path())
    hint = f"; {packed} is there: name it in the configuration" if packed.is_file() else ""
    if root is not None:
        raise InputError(f"there is no {root / str(network)}{hint}", file=config)
    raise InputError(
        f"{network} lies neither here nor beside the configuration nor above it;"
        " name the folder that its paths refer to with --root",
        file=config,
    )


def _scenario(peer: _Peer, folder: Path, trajectories: Path | None) -> dict[str, Any]:
    """Return the simulation's files."""
    own = peer.path("trajectory_file")
    log = trajectories or own
    if log is None or not log.is_file():
        raise InputError(
            f"the log of positions {log} does not exist; name one with --trajectories",
            file=peer.file,
        )
    network = peer.path("sumo_network_file")
    assert network is not None
    found: dict[str, Any] = {
        "network": _relative(network, folder),
        "trajectories": [_relative(log, folder)],
    }
    signals = peer.path("traffic_signal_states_file")
    if signals is not None and signals.is_file():
        found["signals"] = [_relative(signals, folder)]
    return found


def _relative(path: Path, folder: Path) -> str:
    """Return a path as it stands in a scene file."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive on Windows
        return path.resolve().as_posix()


def _sky(peer: _Peer) -> str:
    """Return our sky that is like one of theirs."""
    asked = str(peer.at("visualization.sky_texture") or "sky_cloudy")
    if asked not in _SKIES:
        raise ConfigError(
            f"sumo3Dviz has no sky {asked!r}; it has {', '.join(_SKIES)}",
            key="visualization.sky_texture",
            file=peer.file,
        )
    return _SKIES[asked]


def _objects(peer: _Peer, folder: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield where trees, houses and fences stand."""
    for key, family in _OBJECTS.items():
        path = peer.path(key)
        if path is not None and path.is_file():
            yield family, {"file": _relative(path, folder)}


def _signals(peer: _Peer) -> dict[str, Any]:
    """Return whether signals are drawn, and their design."""
    heads = int(peer.number("signals.num_heads", 3))
    counting = bool(peer.at("signals.countdown_timer"))
    design = "two_heads" if heads == 2 else "countdown" if counting else "three_heads"
    shown = peer.at("visualization.show_signals")
    return {"show": shown is not False, "design": design}


def _output(peer: _Peer) -> dict[str, Any]:
    """Return the size and rate of the film."""
    size = [peer.number("rendering.video_width_px", 1140)]
    size += [peer.number("rendering.video_height_px", 900)]
    return {
        # Video needs even sides.
        "size": [max(2, round(side / 2) * 2) for side in size],
        "fps": peer.number("rendering.video_fps", 25.0),
    }


def _cameras(peer: _Peer) -> dict[str, Any]:
    """Return the cameras by the names of their modes, and a shot for each that has times."""
    cameras: dict[str, Any] = {}
    shots = []
    for mode, build in _MODES.items():
        if peer.at(f"modes.{mode}") is None:
            continue
        cameras[mode] = build(peer, f"modes.{mode}")
        start, end = (peer.at(f"modes.{mode}.simtime_{which}") for which in ("start", "end"))
        if start is not None and end is not None:
            shots.append({"camera": mode, "from": float(start), "to": float(end)})
    return {"cameras": cameras, "shots": shots}


def _standing(peer: _Peer, mode: str) -> dict[str, Any]:
    """Return a camera that stands."""
    return {"mode": "eulerian", **_pose(peer, f"{mode}.camera_position"), "lens": {"fov": FOV}}


def _riding(peer: _Peer, mode: str) -> dict[str, Any]:
    """Return a driver's eye."""
    vehicle = peer.at(f"{mode}.ego_identifier")
    if vehicle is None:
        raise ConfigError("names nobody to ride with", key=f"{mode}.ego_identifier", file=peer.file)
    return {"mode": "lagrangian", "vehicle": str(vehicle), "view": "driver"}


def _flying(peer: _Peer, mode: str) -> dict[str, Any]:
    """Return a camera's path."""
    path = f"{mode}.camera_position_trajectory"
    stations = peer.at(path)
    if not isinstance(stations, Mapping) or not stations:
        raise ConfigError("holds no key frames", key=path, file=peer.file)
    frames = []
    for time in sorted(stations, key=float):
        # The times hold dots, so dotted keys would not find them.
        one = _Peer(stations[time], peer.file, peer.root)
        frames.append({"time": float(time), **_pose(one, "")})
    return {"mode": "cinematic", "lens": {"fov": FOV}, "keyframes": frames}


def _visiting(peer: _Peer, mode: str) -> dict[str, Any]:
    """Return where the interactive camera begins."""
    at = peer.at(f"{mode}.initial_camera_position.position") or [120.0, -20.0, 0.0]
    turned = peer.at(f"{mode}.initial_camera_position.orientation") or [180.0, 0.0, 0.0]
    heading = {"heading": _heading(float(turned[0])), "pitch": float(turned[1])}
    return {"mode": "eulerian", "position": [float(v) for v in at], **heading}


_MODES = {
    "eulerian": _standing,
    "lagrangian": _riding,
    "cinematic": _flying,
    "interactive": _visiting,
}


def _pose(peer: _Peer, key: str) -> dict[str, Any]:
    """Return the place and angles."""
    words = {
        word: peer.number(f"{key}.{word}".lstrip("."))
        for word in ("pos_x", "pos_y", "pos_z", "ori_h", "ori_p", "ori_r")
    }
    return {
        "position": [words["pos_x"], words["pos_y"], words["pos_z"]],
        "heading": _heading(words["ori_h"]),
        "pitch": words["ori_p"],
        "roll": words["ori_r"],
    }


def _heading(ori_h: float) -> float:
    """Return the degrees clockwise from north; theirs go counter-clockwise from +y."""
    return -ori_h % 360.0


def _notes(peer: _Peer) -> Iterator[str]:
    """Yield what was not taken over, and why."""
    for key, why in _UNNEEDED.items():
        if peer.at(key) is not None:
            yield f"{key} was not taken over: {why}"
    for key in (*_OBJECTS, "traffic_signal_states_file"):
        path = peer.path(key)
        if path is not None and not path.is_file():
            yield f"missing, and done without: {path}"
    if peer.at("visualization.show_other_vehicles") is False:
        yield "visualization.show_other_vehicles was not taken over: everyone is shown here"
    yield from _unknown(peer)
    yield (
        "their configurations name no vTypes: without scenario.vehicle_types everybody is drawn as"
        " a car"
    )
    yield "films run at real time here; sumo3Dviz 1.0 plays them twice as fast"


def _unknown(peer: _Peer) -> Iterator[str]:
    """Yield the keys that nobody understood."""
    for key in _leaves(peer.content):
        if not any(key == known or key.startswith(f"{known}.") for known in peer.read):
            yield f"{key} is no key of sumo3Dviz 1.0 and was left out"


def _leaves(content: Any, before: str = "") -> Iterator[str]:
    """Yield the dotted keys of all values."""
    if not isinstance(content, Mapping):
        yield before
        return
    for key, value in content.items():
        yield from _leaves(value, f"{before}.{key}" if before else str(key))
