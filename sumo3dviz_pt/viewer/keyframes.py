"""Cameras found by walking, as people write them in a scene file.

Numbers are rounded as a person would: centimetres and hundredths of a degree. What the page
plays is made of the rounded values, so that `render` shows the very same path.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.whole import whole
from sumo3dviz_pt.job.lens import FOV
from sumo3dviz_pt.job.settings import CinematicCamera, KeyFrame, LensSettings
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.pipeline.scene_file import make_job
from sumo3dviz_pt.viewer.insertion import inserted
from sumo3dviz_pt.viewer.walk import Eye, wrapped

_NAME = re.compile(r"[^\W\d][\w-]{0,59}")
"""What cameras may be called: words that need no quotes and suit names of films."""

_CLEAR_VIEW = False
"""A camera films what was seen where it was found, so nothing is cleared out of its view."""

_KEPT = f"    clear_view: {str(_CLEAR_VIEW).lower()}"


def key_frame(eye: Eye, time: float) -> KeyFrame:
    """Return a key frame where an eye is at a time [s], rounded."""
    x, y, z = (_rounded(value, 2) for value in eye.position.tolist())
    return KeyFrame(
        time=_rounded(time, 3),
        position=(x, y, z),
        heading=wrapped(_rounded(eye.heading, 2)),
        pitch=_rounded(eye.pitch, 2),
        roll=_rounded(eye.roll, 2),
        fov=_rounded(eye.fov, 1),
    )


def with_frame(frames: Sequence[KeyFrame], frame: KeyFrame) -> tuple[KeyFrame, ...]:
    """Add a key frame to others, in the order of time; it replaces one of its own time."""
    others = [each for each in frames if each.time != frame.time]
    return tuple(sorted([*others, frame], key=lambda each: each.time))


def flight(frames: Sequence[KeyFrame]) -> CinematicCamera:
    """Return the camera that flies through key frames; what `path_yaml` writes reads as the same.

    Raises:
        ConfigError: If there are none.
    """
    if not frames:
        raise ConfigError("there are no key frames yet; add one first", key="keyframes")
    default = FOV
    fovs = [default if frame.fov is None else frame.fov for frame in frames]
    common = fovs[0] if len(set(fovs)) == 1 else default
    keys = [
        frame.model_copy(update={"fov": None if fov == common else fov})
        for frame, fov in zip(frames, fovs, strict=True)
    ]
    lens = LensSettings(fov=common)
    return CinematicCamera(
        mode="cinematic", keyframes=tuple(keys), lens=lens, clear_view=_CLEAR_VIEW
    )


def camera_yaml(eye: Eye, name: str = "view") -> str:
    """Return a standing camera as it is written under `cameras:`."""
    frame = key_frame(eye, 0.0)
    lines = [f"  {name}:", "    mode: eulerian"]
    lines += [f"    {key}: {value}" for key, value in _aimed(frame)]
    lines += [f"    lens: {{fov: {_number(frame.fov)}}}", _KEPT]
    return "\n".join([*lines, ""])


def path_yaml(name: str, frames: Sequence[KeyFrame]) -> str:
    """Return a cinematic camera as it is written under `cameras:`.

    Raises:
        ConfigError: If there are no key frames.
    """
    camera = flight(frames)
    lines = [f"  {name}:", "    mode: cinematic"]
    lines += [f"    lens: {{fov: {_number(camera.lens.degrees(FOV))}}}", _KEPT, "    keyframes:"]
    for frame in camera.keyframes:
        values = [("time", _number(frame.time)), *_aimed(frame)]
        values += [] if frame.fov is None else [("fov", _number(frame.fov))]
        lines.append("      - {" + ", ".join(f"{key}: {value}" for key, value in values) + "}")
    return "\n".join([*lines, ""])


def _aimed(frame: KeyFrame) -> list[tuple[str, str]]:
    """Return the keys of place and aim; angles that are 0 anyway are left out."""
    values = [("position", _point(frame.position))]
    if frame.look_at is not None:
        values.append(("look_at", _point(frame.look_at)))
    else:
        values.append(("heading", _number(frame.heading)))
        values += [("pitch", _number(frame.pitch))] if frame.pitch else []
    return values + ([("roll", _number(frame.roll))] if frame.roll else [])


def _rounded(value: float, digits: int) -> float:
    """Return a number as it is written; there is no -0."""
    return round(value, digits) + 0.0


def _number(value: float | None) -> str:
    """Return a number without an exponent and needless zeros; it reads as the same one."""
    assert value is not None
    return str(np.format_float_positional(value + 0.0, trim="-"))


def _point(point: Sequence[float]) -> str:
    """Return a list of numbers."""
    return "[" + ", ".join(map(_number, point)) + "]"


def free_name(name: str, taken: Collection[str]) -> str:
    """Return the name, or the first of `name2`, `name3`, ... that is free."""
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name}{number}"
    return free


def save_camera(scene_file: Path, name: str, text: str) -> int:
    """Add a camera to a user's scene file; every other byte of it stays.

    Args:
        scene_file: The file.
        name: What the camera is to be called.
        text: Its entry, as from `camera_yaml` or `path_yaml`.

    Returns:
        The line in which it stands, from 1.

    Raises:
        ConfigError: If the name is taken or none, or the file cannot be read, added to
            safely, or written; it stays as it was then.
    """
    _check_name(name)
    try:
        before = scene_file.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"the scene file cannot be read: {error}", file=scene_file) from error
    old = _settings(before, name, scene_file)
    after, line = inserted(before, text, file=scene_file)
    _check_result(old, after, name, text, scene_file)
    _replace(scene_file.resolve(), after.encode("utf-8"))
    return line


def _check_name(name: str) -> None:
    """Refuse a name that is no plain word."""
    if not _NAME.fullmatch(name) or parse_yaml(name)[0] != name:
        message = "a camera's name starts with a letter and holds letters, digits, - and _ only"
        raise ConfigError(f"{message}, not {name!r}", key="cameras")


def _settings(text: str, name: str, file: Path) -> dict[str, Any]:
    """Return what a scene file says, if a camera's name is free in it."""
    settings = parse_yaml(text, file=file)[0]
    if not isinstance(settings, dict):
        raise ConfigError("a scene file is a mapping of keys to values; this is not", file=file)
    cameras = settings.get("cameras")
    if isinstance(cameras, dict) and name in cameras:
        message = f"a camera is called {name!r} already; {free_name(name, cameras)!r} is free"
        raise ConfigError(message, key="cameras", file=file)
    return settings


def _check_result(old: dict[str, Any], after: str, name: str, text: str, file: Path) -> None:
    """Refuse a changed file unless it says what it said and one camera more."""
    try:
        new, entry = parse_yaml(after)[0], parse_yaml(text)[0]
        cameras = {**(old.get("cameras") or {}), **entry}
        if set(entry) != {name} or new != {**old, "cameras": cameras}:
            raise ConfigError("it would change other settings")
        make_job(new, folder=file.parent)
    except ConfigError as error:
        message = f"the camera cannot be added here; paste its text by hand ({error})"
        raise ConfigError(message, key="cameras", file=file) from error


def _replace(file: Path, content: bytes) -> None:
    """Write a file anew, at once or not at all."""
    try:
        if not os.access(file, os.W_OK):
            raise PermissionError(13, "it is write-protected")
        with whole(file) as part:
            with part.open("wb") as stream:
                stream.write(content)
                stream.flush()
                os.fsync(stream.fileno())
            shutil.copymode(file, part)
    except OSError as error:
        message = f"the scene file cannot be written: {error.strerror or error}"
        raise ConfigError(message, file=file) from error
