"""Translates a configuration of sumo3Dviz 1.0 into a scene file.

What it says of files, cameras, times and looks is taken over; what needs no saying here
(where signals stand, what is a tree), what has no counterpart and what had no effect there is
told.

References:
    sumo3Dviz: A three dimensional traffic visualisation. arXiv:2604.19194 (2026). What each
    key does there was read in its code, version 1.0.0.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.pipeline.stills.still import check_writable
from sumo3dviz_pt.pipeline.sumo3dviz.cameras import FOV as FOV
from sumo3dviz_pt.pipeline.sumo3dviz.cameras import cameras_of
from sumo3dviz_pt.pipeline.sumo3dviz.configuration import Configuration
from sumo3dviz_pt.pipeline.sumo3dviz.files import objects_of, open_configuration, scenario_of

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
    kept = {key: value for key, value in settings.items() if value}
    make_job(kept, folder=folder)
    text = yaml.safe_dump(kept, sort_keys=False, allow_unicode=True, default_flow_style=None)
    return f"# From {config.name}, a configuration of sumo3Dviz.\n{text}", [*_notes(peer)]


def _sky(peer: Configuration) -> str:
    """Return our sky that is like one of theirs."""
    asked = str(peer.at("visualization.sky_texture") or "sky_cloudy")
    if asked not in _SKIES:
        message = f"sumo3Dviz has no sky {asked!r}; it has {', '.join(_SKIES)}"
        raise peer.error(message, "visualization.sky_texture")
    return _SKIES[asked]


def _roads(peer: Configuration) -> dict[str, Any]:
    """Return how lines are painted; those without a width were not seen."""
    width = peer.number("visualization.sep_line_width", 0.12)
    return {"line_width": width} if width > 0.0 else {"markings": False}


def _objects(peer: Configuration, folder: Path) -> dict[str, Any]:
    """Return where trees, houses and fences stand, and how large the trees are."""
    found = dict(objects_of(peer, folder))
    scales = [peer.number(f"visualization.{key}", usual) / usual for key, usual in _TREES.items()]
    spread = peer.number("visualization.tree_size_variability", 1.0)
    scale = sum(scales) / len(scales) * (spread or 1.0)
    if abs(scale - 1.0) > 1e-6:
        found.setdefault("trees", {})["scale"] = round(scale, 3)
    if not spread:
        found.setdefault("trees", {})["variation"] = 0.0
        text = (
            "visualization.tree_size_variability: 0 hid all trees there; here they are of one size"
        )
        peer.notes.append(text)
    return found


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
