"""Translate the modes of sumo3Dviz into cameras and shots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sumo3dviz_pt.pipeline.sumo3dviz.configuration import Configuration

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
