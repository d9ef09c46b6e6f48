"""Moves an eye, and writes where it stands into the cameras of a scene file.

Keys move the eye and dragging turns it; where it goes is a pure function of what was pressed.
Angles are those of a scene file: degrees, headings clockwise from north. Within a step the eye goes
along its exact arc, so that two short steps lead where one long step leads and the speed of the
computer does not matter.

Cameras that were found by walking are written as people write them. Numbers are rounded as a person
would: centimetres and hundredths of a degree. What the page plays is made of the rounded values, so
that `render` shows the very same path.

An entry is added to the `cameras:` of a YAML text without touching anything else in it. The
parser's events say where the last camera ends, to the character; comments, blank lines and line
ends stay as they are. Whether the result says what it should is checked by the caller of
`inserted`, which only finds the place.
"""

from __future__ import annotations

import os
import re
import shutil
import textwrap
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import atomic_path
from sumo3dviz_pt.job.cameras import FOV
from sumo3dviz_pt.job.settings import CinematicCamera, KeyFrame, LensSettings
from sumo3dviz_pt.job.yaml12 import parse_yaml
from sumo3dviz_pt.model.geometry import Floats, Transform, frozen
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.scene_file import make_job

SPEED = 10.0
"""Speed of movement [m/s]."""

HASTE = 5.0
"""Shift makes movement this many times as fast; turning keeps its speed, so that one can aim."""

TURN = 60.0
"""Speed of turning [deg/s]."""

CLEARANCE = 0.1
"""Eyes stay this far above the ground [m]."""

STEEPEST = 89.0
"""Pitches lie within plus and minus this [deg]: straight up, a heading means nothing."""

AXES = (
    ("ahead", ("KeyW", "ArrowUp"), ("KeyS", "ArrowDown")),
    ("right", ("KeyD", "ArrowRight"), ("KeyA", "ArrowLeft")),
    ("up", ("KeyR",), ("KeyF",)),
    ("heading", ("KeyL",), ("KeyJ",)),
    ("pitch", ("KeyI",), ("KeyK",)),
)
"""What keys do: a name, the browser's codes that add to it, and those that take from it."""

FASTER = frozenset({"ShiftLeft", "ShiftRight"})

_SWING = 4.0
"""A heading turns by at most this many times the drag: near the poles it would whirl."""

_UPRIGHT = 1e-9
"""A view whose direction is less level than this has no heading of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class ViewerEye:
    """A standing camera, in angles as a scene file has them.

    Attributes:
        position: (3,) [m].
        heading: Clockwise from north, [0, 360) [deg].
        pitch: Upwards, [-90, 90] [deg].
        roll: Clockwise as the viewer sees it [deg].
        fov: Horizontal opening angle [deg].
    """

    position: Floats
    heading: float
    pitch: float = 0.0
    roll: float = 0.0
    fov: float = 50.0

    def __post_init__(self) -> None:
        """Freeze the position and wrap the angles."""
        object.__setattr__(self, "position", frozen(self.position).reshape(3))
        object.__setattr__(self, "heading", wrapped(self.heading))

    @classmethod
    def of(cls, view: View) -> ViewerEye:
        """Return the eye of a view; straight up or down it is turned, not tilted."""
        rotation = view.world_from_camera.matrix[:3, :3]
        ahead, left, up = rotation.T
        level = float(np.hypot(ahead[0], ahead[1]))
        yaw, roll = np.arctan2(-left[0], left[1]), 0.0
        if level > _UPRIGHT:
            yaw, roll = np.arctan2(ahead[1], ahead[0]), np.arctan2(left[2], up[2])
        pitch = np.arctan2(ahead[2], level)
        yaw, pitch, roll, fov = np.degrees([yaw, pitch, roll, view.lens.free_opening]).tolist()
        return cls(view.position, 90.0 - yaw, pitch, roll, fov)

    def said(self, location: Location) -> ViewerEye:
        """Return the same eye in SUMO's coordinates, for whoever is told of it."""
        return replace(self, position=location.outside(self.position))

    def view(self) -> View:
        """Return what the eye sees."""
        yaw, pitch, roll, fov = np.radians([90.0 - self.heading, self.pitch, self.roll, self.fov])
        placed = Transform.from_pose(
            self.position, yaw=float(yaw), pitch=float(pitch), roll=float(roll)
        )
        return View(placed, Lens(float(fov)))


def wrapped(heading: float) -> float:
    """Return a heading in [0, 360) [deg]."""
    turned = float(np.mod(heading, 360.0))
    return 0.0 if turned >= 360.0 else turned  # -1e-20 modulo 360 rounds to 360


def moved(
    eye: ViewerEye, keys: frozenset[str], seconds: float, *, ground: float = -np.inf
) -> ViewerEye:
    """Return where held keys take an eye.

    Args:
        eye: Where it was; it is returned itself if nothing moves it.
        keys: Codes of the keys that are down, as browsers name them; others do nothing.
        seconds: How long they were down.
        ground: Height of the ground; the eye stays a little above it [m].
    """
    held = {name: _sign(keys, more, less) for name, more, less in AXES}
    if seconds <= 0.0 or not any(held.values()):
        return eye
    turn = held["heading"] * TURN * seconds
    way = SPEED * seconds * (HASTE if keys & FASTER else 1.0)
    step = way * _arc(np.array([held["ahead"], held["right"], held["up"]]), eye.heading, turn)
    lowest = ground + CLEARANCE
    position = eye.position + step
    position[2] = max(max(eye.position[2], lowest) + step[2], lowest)
    pitch = eye.pitch + held["pitch"] * TURN * seconds
    # A view from straight above keeps its pitch until a key changes it.
    pitch = float(np.clip(pitch, -STEEPEST, STEEPEST)) if held["pitch"] else eye.pitch
    return replace(eye, position=position, heading=eye.heading + turn, pitch=pitch)


def _sign(keys: frozenset[str], more: tuple[str, ...], less: tuple[str, ...]) -> int:
    """Return 1, 0 or -1: opposite keys cancel, two keys of one meaning count once."""
    return (not keys.isdisjoint(more)) - (not keys.isdisjoint(less))


def _arc(held: Floats, heading: float, turn: float) -> Floats:
    """Return the displacement for a way of 1, (3,), while the heading turns.

    Args:
        held: Ahead, right and up, each -1, 0 or 1.
        heading: At the begin [deg].
        turn: Until the end [deg].
    """
    size = np.linalg.norm(held)
    if size == 0.0:
        return np.zeros(3)
    ahead, right, up = held / size
    # The chord of an arc points half-way between its ends and is shorter than the arc.
    middle, half = np.radians(heading + turn / 2.0), np.radians(turn / 2.0)
    chord = np.sinc(half / np.pi)
    east = ahead * np.sin(middle) + right * np.cos(middle)
    north = ahead * np.cos(middle) - right * np.sin(middle)
    return np.array([chord * east, chord * north, up])


def turned(eye: ViewerEye, dx: float, dy: float, width: float) -> ViewerEye:
    """Return where dragging turns an eye: what was in the picture's middle follows the pointer.

    The direction that was straight ahead lies `dx`, `dy` beside the middle afterwards, exactly
    so up to pitches of 75 degrees; elsewhere in the picture the scene follows the pointer as
    far as perspective allows.

    Args:
        eye: How it looked.
        dx: Way of the pointer to the right [px].
        dy: Way of the pointer down [px].
        width: Of the picture as shown, in the same pixels.
    """
    if width <= 0.0 or (dx == 0.0 and dy == 0.0):
        return eye
    pixel = Lens.of_degrees(eye.fov).pixel_width(width)
    across, up = -dx * pixel, -dy * pixel
    c, s = np.cos(np.radians(eye.roll)), np.sin(np.radians(eye.roll))
    left, high = c * across - s * up, s * across + c * up
    ray = np.array([1.0, left, high]) / np.sqrt(1.0 + left * left + high * high)
    # Turn the camera until that ray is as high as the old direction, then as far round.
    height = np.sin(np.radians(eye.pitch)) / np.hypot(ray[0], ray[2])
    pitch = np.arcsin(np.clip(height, -1.0, 1.0)) - np.arctan2(ray[2], ray[0])
    steepest = np.radians(STEEPEST)
    pitch = float(np.clip(pitch, -steepest, steepest))
    ahead = np.cos(pitch) * ray[0] - np.sin(pitch) * ray[2]
    most = _SWING * np.arctan(abs(left))
    sideways = float(np.degrees(np.clip(np.arctan2(ray[1], ahead), -most, most)))
    return replace(eye, heading=eye.heading + sideways, pitch=float(np.degrees(pitch)))


_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
"""Line breaks as YAML's scanner sees them."""

_STEP = 2
"""Spaces of each level, in what is inserted and where the file itself shows no level."""


@dataclass(frozen=True, slots=True)
class _InsertionPlace:
    """Where an entry goes.

    Attributes:
        index: Of the character before which it is inserted; a line begins there, or the
            text ends.
        column: Of `cameras`.
        step: Spaces by which each level is indented.
        head: Whether `cameras:` itself is missing.
    """

    index: int
    column: int
    step: int
    head: bool = False


def inserted(text: str, entry: str, *, file: Path | None = None) -> tuple[str, int]:
    """Return a scene file's text with one more camera after the others.

    Args:
        text: Valid YAML.
        entry: The camera's name and settings, indented by twos.
        file: For messages.

    Returns:
        The new text, and the line of it in which the camera's name stands, from 1.

    Raises:
        ConfigError: If cameras are not written line by line; names the line.
    """
    place = _place(text, file)
    before, after = text[: place.index], text[place.index :]
    newline = _newline(text, place.index)
    lines = textwrap.dedent(entry).splitlines()
    added = ["cameras:"] if place.head else []
    added = [" " * place.column + line for line in added]
    added += [_indented(line, place) for line in lines]
    # The last line of the file may lack its end.
    gap = newline if before and not _BREAK.fullmatch(before[-1]) else ""
    line = len(_BREAK.findall(before + gap)) + (2 if place.head else 1)
    return before + gap + newline.join([*added, ""]) + after, line


def _indented(line: str, place: _InsertionPlace) -> str:
    """Return a line of an entry at the depth that the file's other cameras have."""
    words = line.lstrip(" ")
    level = 1 + (len(line) - len(words)) // _STEP
    return " " * (place.column + place.step * level) + words


def _newline(text: str, index: int) -> str:
    """Return the last line end before a place, or else in the text."""
    ends = _BREAK.findall(text[:index]) or _BREAK.findall(text)
    return ends[-1] if ends and ends[-1] in ("\r\n", "\r") else "\n"


def _place(text: str, file: Path | None) -> _InsertionPlace:
    """Find where the next camera goes."""
    events = list(yaml.parse(text, Loader=yaml.SafeLoader))
    root = next((event for event in events if isinstance(event, yaml.NodeEvent)), None)
    if not isinstance(root, yaml.MappingStartEvent) or root.flow_style:
        raise _by_hand("the file is written in braces", root, file)
    number = events.index(root) + 1
    column = _start(events[number]).column
    while not isinstance(events[number], yaml.MappingEndEvent):
        key, value = number, _after(events, number)
        number = _after(events, value)
        name = events[key]
        if isinstance(name, yaml.ScalarEvent) and name.value == "cameras":
            return _within(text, name, events[value:number], file)
    return _InsertionPlace(_foot(text, events), column, _STEP, head=True)


def _after(events: Sequence[yaml.Event], number: int) -> int:
    """Return the number of the event after a node."""
    depth = 0
    while True:
        event = events[number]
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        number += 1
        if not depth:
            return number


def _within(
    text: str, key: yaml.Event, value: Sequence[yaml.Event], file: Path | None
) -> _InsertionPlace:
    """Return where the next camera goes under `cameras:`."""
    first, column = value[0], _start(key).column
    if isinstance(first, yaml.ScalarEvent) and _start(first).index == _end(first).index:
        index = _after_comments(text, _line_after(text, _end(key).index), column + 1)
        return _InsertionPlace(index, column, _STEP)
    if not isinstance(first, yaml.MappingStartEvent) or first.flow_style or len(value) < 3:
        raise _by_hand("cameras are not written line by line", key, file)
    entries = _start(value[1]).column
    # Block collections end where the next token begins, after any comments.
    ends = [
        _end(event).index
        for event in value
        if not (_ends_a_block(event) or isinstance(event, yaml.CollectionStartEvent))
    ]
    index = _after_comments(text, _line_after(text, max(ends)), entries)
    return _InsertionPlace(index, column, entries - column)


def _ends_a_block(event: yaml.Event) -> bool:
    """Return whether an event ends a collection without a bracket."""
    ends = isinstance(event, yaml.CollectionEndEvent)
    return bool(ends and _start(event).index == _end(event).index)


def _line_after(text: str, index: int) -> int:
    """Return where the line after a place starts, or its own line if nothing stands before it."""
    begin = max((match.end() for match in _BREAK.finditer(text, 0, index)), default=0)
    if not text[begin:index].strip(" "):
        return begin
    line_end = _BREAK.search(text, index)
    return len(text) if line_end is None else line_end.end()


def _after_comments(text: str, index: int, column: int) -> int:
    """Skip comments that are indented at least as far as a column: they belong to cameras."""
    here = index
    while here < len(text):
        match = _BREAK.search(text, here)
        following = len(text) if match is None else match.end()
        line = text[here:following]
        words = line.strip()
        if words.startswith("#") and len(line) - len(line.lstrip(" ")) >= column:
            index = following
        elif words:
            break
        here = following
    return index


def _foot(text: str, events: Sequence[yaml.Event]) -> int:
    """Return where a further key goes: at the end of the document."""
    end = next(event for event in events if isinstance(event, yaml.DocumentEndEvent))
    return _start(end).index if end.explicit else len(text)


def _start(event: yaml.Event) -> yaml.Mark:
    """Return where an event begins."""
    assert isinstance(event.start_mark, yaml.Mark)
    return event.start_mark


def _end(event: yaml.Event) -> yaml.Mark:
    """Return where an event ends."""
    assert isinstance(event.end_mark, yaml.Mark)
    return event.end_mark


def _by_hand(reason: str, event: yaml.Event | None, file: Path | None) -> ConfigError:
    """Return an error that says what to do instead."""
    line = _start(event).line + 1 if event is not None else None
    message = f"{reason}; paste the camera's text there by hand"
    return ConfigError(message, key="cameras", file=file, line=line)


_NAME = re.compile(r"[^\W\d][\w-]{0,59}")
"""What cameras may be called: words that need no quotes and suit names of films."""

_CLEAR_VIEW = False
"""A camera films what was seen where it was found, so nothing is cleared out of its view."""

_KEPT = f"    clear_view: {str(_CLEAR_VIEW).lower()}"


def key_frame(eye: ViewerEye, time: float) -> KeyFrame:
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


def camera_yaml(eye: ViewerEye, name: str = "view") -> str:
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
        with atomic_path(file) as part:
            with part.open("wb") as stream:
                stream.write(content)
                stream.flush()
                os.fsync(stream.fileno())
            shutil.copymode(file, part)
    except OSError as error:
        message = f"the scene file cannot be written: {error.strerror or error}"
        raise ConfigError(message, file=file) from error
