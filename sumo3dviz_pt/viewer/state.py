"""How a visitor stands in a scene: place, time and switches; orders lead from one to the next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CinematicCamera, EulerianCamera, KeyFrame, LagrangianCamera
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.live import Live
from sumo3dviz_pt.viewer import messages_in
from sumo3dviz_pt.viewer.keyframes import flight, key_frame, with_frame
from sumo3dviz_pt.viewer.walk import Eye, moved, turned

MOST_FRAMES = 500
"""Key frames that a page can add: an hour of them, at one every seven seconds."""

_FLIGHT = 10.0
"""Key frames that are dropped at one moment are flown through so fast [m/s]."""

_LEAST = 2.0
"""And lie at least so far apart [s]."""

_LOOK = frozenset({"KeyI", "KeyJ", "KeyK", "KeyL"})
"""Keys that turn the head; who rides cannot walk."""


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """Where a visitor is and what is switched on.

    Attributes:
        eye: The camera, while nobody is ridden with and nothing is flown.
        time: SUMO's [s].
        playing: Whether time runs.
        flying: Whether the camera follows the key frames.
        dynamic: Whether road users are shown.
        denoise: Whether standing pictures are cleaned.
        exposure: Beside the scene file's [EV].
        ride: The camera that rides with somebody, or None.
        keys: Movement keys that are down.
        frames: Key frames, in time order.
        heard: Number of the newest input.
    """

    eye: Eye
    time: float
    playing: bool = False
    flying: bool = False
    dynamic: bool = True
    denoise: bool = False
    exposure: float = 0.0
    ride: LagrangianCamera | None = None
    keys: frozenset[str] = frozenset()
    frames: tuple[KeyFrame, ...] = ()
    heard: int = 0

    @property
    def moves(self) -> bool:
        """Whether the next picture differs from this one by itself."""
        return self.playing or bool(self.keys)

    def view(self, live: Live) -> View:
        """What the visitor sees.

        Raises:
            ConfigError: If who is ridden with is not there.
        """
        if self.flying:
            return live.view_of(flight(self.frames), self.time)
        if self.ride is not None:
            return live.view_of(self.ride, self.time)
        return self.eye.view()


def advanced(stand: Stand, seconds: float, live: Live) -> Stand:
    """Some time later."""
    if stand.playing:
        last = stand.frames[-1].time if stand.flying else live.ground.end
        time = min(stand.time + seconds, last)
        on = time < last
        stand = replace(stand, time=time, playing=on)
        if not on and stand.flying:
            stand = replace(stand, flying=False, eye=Eye.of(stand.view(live)))
    if stand.flying or not stand.keys:
        return stand
    if stand.ride is not None:
        before = Eye(np.zeros(3), stand.ride.heading, stand.ride.pitch or 0.0)
        return _looking(stand, before, moved(before, stand.keys & _LOOK, seconds))
    ground = live.ground_at(stand.eye.position)
    return replace(stand, eye=moved(stand.eye, stand.keys, seconds, ground=ground))


def _looking(stand: Stand, before: Eye, after: Eye) -> Stand:
    """Who rides turns the head."""
    if stand.ride is None or after is before:
        return stand
    heading = (after.heading + 180.0) % 360.0 - 180.0
    turn = {"heading": heading, "pitch": after.pitch}
    return replace(stand, ride=stand.ride.model_copy(update=turn))


def outside(stand: Stand, live: Live) -> Stand:
    """Who rode or flew stands where the camera is, level."""
    if stand.ride is None and not stand.flying:
        return stand
    eye = replace(Eye.of(stand.view(live)), roll=0.0)
    return replace(stand, eye=eye, ride=None, flying=False)


@singledispatch
def obeyed(order: Any, stand: Stand, live: Live) -> Stand:
    """How a visitor stands after an order.

    Args:
        order: One of `orders`.
        stand: Before it.
        live: The scene.

    Raises:
        ConfigError: If the order cannot be followed.
    """
    raise TypeError(f"{type(order).__name__} does not move visitors")


@obeyed.register
def _(order: messages_in.Keys, stand: Stand, live: Live) -> Stand:
    """Hold keys."""
    return replace(stand, keys=frozenset(order.down), heard=max(order.id, stand.heard))


@obeyed.register
def _(order: messages_in.Drag, stand: Stand, live: Live) -> Stand:
    """Turn the picture."""
    stand = replace(stand, heard=max(order.id, stand.heard))
    if stand.flying:
        return stand
    if stand.ride is None:
        return replace(stand, eye=turned(stand.eye, order.dx, order.dy, order.width))
    before = Eye(np.zeros(3), stand.ride.heading, stand.ride.pitch or 0.0, 0.0, stand.eye.fov)
    return _looking(stand, before, turned(before, order.dx, order.dy, order.width))


@obeyed.register
def _(order: messages_in.GoTo, stand: Stand, live: Live) -> Stand:
    """See what one of the scene's cameras sees."""
    cameras = live.job.cameras
    if order.name not in cameras:
        raise ConfigError(f"no camera is called {order.name!r}", key="camera")
    camera = cameras[order.name]
    stand = replace(stand, ride=None, flying=False)
    if isinstance(camera, LagrangianCamera):
        return _riding(stand, camera, live)
    if isinstance(camera, CinematicCamera):
        time = within(camera.keyframes[0].time, live)
        stand = replace(stand, eye=Eye.of(live.view_of(camera, time)), time=time, playing=False)
        return stand if _unsaved(stand.frames, live) else replace(stand, frames=_frames_of(camera))
    assert isinstance(camera, EulerianCamera)
    return replace(stand, eye=Eye.of(live.view_of(camera, stand.time)))


def _frames_of(camera: CinematicCamera) -> tuple[KeyFrame, ...]:
    """The key frames of a path, each with its opening angle."""
    own = {"fov": camera.lens.fov}
    return tuple(key if key.fov else key.model_copy(update=own) for key in camera.keyframes)


def _unsaved(frames: tuple[KeyFrame, ...], live: Live) -> bool:
    """Whether there are key frames that no camera of the scene has."""
    paths = [each for each in live.job.cameras.values() if isinstance(each, CinematicCamera)]
    return bool(frames) and frames not in map(_frames_of, paths)


@obeyed.register
def _(order: messages_in.Place, stand: Stand, live: Live) -> Stand:
    """Stand somewhere."""
    eye = Eye(np.array(order.position), order.heading, order.pitch, order.roll, order.fov)
    return replace(stand, eye=eye, ride=None, flying=False)


@obeyed.register
def _(order: messages_in.SetTime, stand: Stand, live: Live) -> Stand:
    """Show a time."""
    return replace(stand, time=within(order.value, live))


@obeyed.register
def _(order: messages_in.Play, stand: Stand, live: Live) -> Stand:
    """Let time run; at the end of the log, from its beginning."""
    ended = order.on and stand.time >= live.ground.end
    return replace(stand, playing=order.on, time=live.ground.begin if ended else stand.time)


@obeyed.register
def _(order: messages_in.Step, stand: Stand, live: Live) -> Stand:
    """Go by frames of the film."""
    time = stand.time + order.frames / float(live.job.output.fps)
    return replace(stand, time=within(time, live), playing=False)


@obeyed.register
def _(order: messages_in.Dynamic, stand: Stand, live: Live) -> Stand:
    """Show road users or not."""
    return replace(stand, dynamic=order.on)


@obeyed.register
def _(order: messages_in.Denoise, stand: Stand, live: Live) -> Stand:
    """Clean standing pictures or not."""
    return replace(stand, denoise=order.on)


@obeyed.register
def _(order: messages_in.Exposure, stand: Stand, live: Live) -> Stand:
    """Brighter or darker."""
    return replace(stand, exposure=order.ev)


@obeyed.register
def _(order: messages_in.Ride, stand: Stand, live: Live) -> Stand:
    """Ride with somebody."""
    camera = LagrangianCamera(mode="lagrangian", vehicle=order.vehicle, view=order.view)
    return _riding(stand, camera, live)


@obeyed.register
def _(order: messages_in.Leave, stand: Stand, live: Live) -> Stand:
    """Get out."""
    return outside(stand, live)


@obeyed.register
def _(order: messages_in.KeyFrameOrder, stand: Stand, live: Live) -> Stand:
    """Work on the key frames; saving is not a visitor's own affair."""
    if order.act == "add":
        if len(stand.frames) >= MOST_FRAMES:
            raise ConfigError(f"a path has at most {MOST_FRAMES} key frames; save or clear it")
        return replace(stand, frames=with_frame(stand.frames, _dropped(stand, live)))
    if order.act == "remove":
        if not -1 <= order.index < len(stand.frames) or not stand.frames:
            raise ConfigError("there is no such key frame")
        kept = list(stand.frames)
        del kept[order.index]
        return replace(outside(stand, live), frames=tuple(kept))
    if order.act == "clear":
        return replace(outside(stand, live), frames=())
    if order.act == "stop":
        return replace(outside(stand, live), playing=False)
    if len(stand.frames) < 2:
        raise ConfigError("drop at least two key frames first")
    return replace(stand, ride=None, flying=True, playing=True, time=stand.frames[0].time)


def _dropped(stand: Stand, live: Live) -> KeyFrame:
    """A key frame here and now, or as much later as it takes to fly here."""
    eye, time = Eye.of(stand.view(live)), stand.time
    if stand.frames:
        last = stand.frames[-1]
        way = float(np.linalg.norm(eye.position - np.array(last.position)))
        if key_frame(eye, time).time in {frame.time for frame in stand.frames}:
            time = last.time + max(way / _FLIGHT, _LEAST)
    return key_frame(eye, time)


def _riding(stand: Stand, camera: LagrangianCamera, live: Live) -> Stand:
    """Ride with somebody, at a time when he is there."""
    riding = replace(stand, ride=camera, flying=False)
    begin, end = live.life_of(camera)
    if not begin <= stand.time <= end:
        riding = replace(riding, time=within(begin, live))
    riding.view(live)  # an error now, not later
    return riding


def within(time: float, live: Live) -> float:
    """The nearest time of the log [s]."""
    return min(max(time, live.ground.begin), live.ground.end)


def frames_said(frames: Sequence[KeyFrame]) -> list[Mapping[str, Any]]:
    """Key frames in words of the protocol."""
    return [frame.model_dump(mode="json", exclude_none=True) for frame in frames]


def said_of(eye: Eye) -> Mapping[str, Any]:
    """An eye in words of the protocol."""
    numbers = {name: round(getattr(eye, name), 3) for name in ("heading", "pitch", "roll", "fov")}
    return {"position": [round(float(x), 3) for x in eye.position], **numbers}
