"""Moves an eye by keys and turns it by dragging; a pure function of what was pressed.

Angles are those of a scene file: degrees, headings clockwise from north. Within a step the
eye goes along its exact arc, so that two short steps lead where one long step leads and the
speed of the computer does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Transform, frozen
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.scene import View

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

CODES = FASTER | {code for _, more, less in AXES for code in (*more, *less)}
"""All keys that move an eye."""

_SWING = 4.0
"""A heading turns by at most this many times the drag: near the poles it would whirl."""

_UPRIGHT = 1e-9
"""A view whose direction is less level than this has no heading of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class Eye:
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
    def of(cls, view: View) -> Eye:
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

    def said(self, location: Location) -> Eye:
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


def moved(eye: Eye, keys: frozenset[str], seconds: float, *, ground: float = -np.inf) -> Eye:
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


def turned(eye: Eye, dx: float, dy: float, width: float) -> Eye:
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
