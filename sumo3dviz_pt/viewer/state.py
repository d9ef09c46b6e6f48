"""A client's state: place, time and switches; each order makes the next state of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import CameraSettings, KeyFrame, LagrangianCamera
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.live import Live
from sumo3dviz_pt.viewer import messages
from sumo3dviz_pt.viewer.keyframes import ViewerEye, flight, key_frame, moved, turned, with_frame

MOST_FRAMES = 500
"""Key frames that a page can add: an hour of them, at one every seven seconds."""

_FLIGHT = 10.0
"""Speed of the flight between key frames that were added at one moment of the log [m/s]."""

_LEAST = 2.0
"""Such key frames lie at least this far apart [s]."""

_LOOK = frozenset({"KeyI", "KeyJ", "KeyK", "KeyL"})
"""Keys that turn the head: the only ones that act on a camera that rides in a vehicle."""


@dataclass(frozen=True, slots=True, eq=False)
class ViewerState:
    """Where a client is and what is switched on.

    Attributes:
        eye: The camera, while it neither rides with a road user nor flies.
        time: SUMO's [s].
        ahead: By how much time that runs is ahead of the film's frame that is shown [s].
        playing: Whether time runs.
        speed: SUMO's seconds for each second that it runs.
        flying: Whether the camera follows the key frames.
        dynamic: Whether road users are shown.
        denoise: Whether standing pictures are cleaned.
        exposure: Beside the scene file's [EV].
        ride: The camera that rides with a road user, or None.
        keys: Movement keys that are down.
        frames: Key frames, in time order.
        heard: Number of the newest input.
    """

    eye: ViewerEye
    time: float
    ahead: float = 0.0
    playing: bool = False
    speed: float = 1.0
    flying: bool = False
    dynamic: bool = True
    denoise: bool = False
    exposure: float = 0.0
    ride: CameraSettings | None = None
    keys: frozenset[str] = frozenset()
    frames: tuple[KeyFrame, ...] = ()
    heard: int = 0

    @property
    def moves(self) -> bool:
        """Whether the next picture differs from this one by itself."""
        return self.playing or bool(self.keys)

    def view(self, live: Live) -> View:
        """Return what the client sees.

        Raises:
            ConfigError: If the road user that it rides with is not there.
        """
        if self.flying:
            return live.view_of(flight(self.frames), self.time)
        if self.ride is not None:
            return live.view_of(self.ride, self.time)
        return self.eye.view()

    def said(self, live: Live) -> ViewerEye:
        """Return where the client is, in SUMO's coordinates; errors as in `view`."""
        return ViewerEye.of(self.view(live)).said(live.location)


_HELD = 0.25
"""Longest time for which a key counts between two pictures [s], or one would walk past what one
wants to see."""


def advanced(state: ViewerState, seconds: float, live: Live) -> ViewerState:
    """Return the state after some time.

    Args:
        state: Before.
        seconds: That pass [s].
        live: The scene.
    """
    if state.playing:
        ground = live.ground
        last = state.frames[-1].time if state.flying else ground.end
        runs = state.time + state.ahead + state.speed * seconds
        if ground.growing:
            # At the end of what is known of a simulation that runs, one waits for more.
            runs = max(min(runs, ground.end), ground.end - ground.behind)
            last = last if state.flying else np.inf
        runs = min(runs, last)
        on = runs < last
        time = max(live.frame_before(runs), state.time) if on else last
        state = replace(state, time=time, ahead=runs - time, playing=on)
        if not on and state.flying:
            state = replace(state, flying=False, eye=ViewerEye.of(state.view(live)))
    if state.flying or not state.keys:
        return state
    seconds = min(seconds, _HELD)
    if state.ride is not None:
        before = ViewerEye(np.zeros(3), *state.ride.gaze)
        return _looking(state, before, moved(before, state.keys & _LOOK, seconds))
    height = live.ground_at(state.eye.position)
    return replace(state, eye=moved(state.eye, state.keys, seconds, ground=height))


def _looking(state: ViewerState, before: ViewerEye, after: ViewerEye) -> ViewerState:
    """Turn the head of a camera that rides."""
    if state.ride is None or after is before:
        return state
    heading = (after.heading + 180.0) % 360.0 - 180.0
    return replace(state, ride=state.ride.gazing(heading, after.pitch))


def outside(state: ViewerState, live: Live) -> ViewerState:
    """Leave the vehicle or the flight: the eye stands where the camera is, level."""
    if state.ride is None and not state.flying:
        return state
    eye = replace(ViewerEye.of(state.view(live)), roll=0.0)
    return replace(state, eye=eye, ride=None, flying=False)


@singledispatch
def obeyed(order: Any, state: ViewerState, live: Live) -> ViewerState:
    """Return a client's state after an order.

    Args:
        order: One of `messages_in`.
        state: Before it.
        live: The scene.

    Raises:
        ConfigError: If the order cannot be followed.
    """
    raise TypeError(f"{type(order).__name__} does not move clients")


@obeyed.register
def _(order: messages.Keys, state: ViewerState, live: Live) -> ViewerState:
    """Hold keys."""
    return replace(state, keys=frozenset(order.down), heard=max(order.id, state.heard))


@obeyed.register
def _(order: messages.Drag, state: ViewerState, live: Live) -> ViewerState:
    """Turn the picture."""
    state = replace(state, heard=max(order.id, state.heard))
    if state.flying:
        return state
    if state.ride is None:
        return replace(state, eye=turned(state.eye, order.dx, order.dy, order.width))
    before = ViewerEye(np.zeros(3), *state.ride.gaze, 0.0, state.eye.fov)
    return _looking(state, before, turned(before, order.dx, order.dy, order.width))


@obeyed.register
def _(order: messages.GoTo, state: ViewerState, live: Live) -> ViewerState:
    """See what one of the scene's cameras sees."""
    cameras = live.job.cameras
    if order.name not in cameras:
        raise ConfigError(f"no camera is called {order.name!r}", key="camera")
    camera = cameras[order.name]
    state = replace(state, ride=None, flying=False)
    if camera.rides_with:
        return _riding(state, camera, live)
    if camera.flown:
        time = within(camera.flown[0].time, live)
        state = replace(
            state, eye=ViewerEye.of(live.view_of(camera, time)), time=time, playing=False
        )
        return state if _unsaved(state.frames, live) else replace(state, frames=camera.flown)
    return replace(state, eye=ViewerEye.of(live.view_of(camera, state.time)))


def _unsaved(frames: tuple[KeyFrame, ...], live: Live) -> bool:
    """Return whether there are key frames that no camera of the scene has."""
    return bool(frames) and frames not in [each.flown for each in live.job.cameras.values()]


@obeyed.register
def _(order: messages.StandAt, state: ViewerState, live: Live) -> ViewerState:
    """Stand somewhere."""
    place = live.location.inside(order.position)
    eye = ViewerEye(place, order.heading, order.pitch, order.roll, order.fov)
    return replace(state, eye=eye, ride=None, flying=False)


@obeyed.register
def _(order: messages.SetTime, state: ViewerState, live: Live) -> ViewerState:
    """Show a time."""
    return replace(state, time=within(order.value, live))


@obeyed.register
def _(order: messages.Play, state: ViewerState, live: Live) -> ViewerState:
    """Let time run; at the end of the log, from its beginning."""
    ended = order.on and state.time >= live.ground.end and not live.ground.growing
    return replace(state, playing=order.on, time=live.ground.begin if ended else state.time)


@obeyed.register
def _(order: messages.Speed, state: ViewerState, live: Live) -> ViewerState:
    """Let time run faster or slower."""
    return replace(state, speed=order.factor)


@obeyed.register
def _(order: messages.StepFrames, state: ViewerState, live: Live) -> ViewerState:
    """Go by frames of the film."""
    time = state.time + order.frames / float(live.job.output.fps)
    return replace(state, time=within(time, live), playing=False)


@obeyed.register
def _(order: messages.Dynamic, state: ViewerState, live: Live) -> ViewerState:
    """Show road users or not."""
    return replace(state, dynamic=order.on)


@obeyed.register
def _(order: messages.Denoise, state: ViewerState, live: Live) -> ViewerState:
    """Clean standing pictures or not."""
    return replace(state, denoise=order.on)


@obeyed.register
def _(order: messages.Exposure, state: ViewerState, live: Live) -> ViewerState:
    """Make pictures brighter or darker."""
    return replace(state, exposure=order.ev)


@obeyed.register
def _(order: messages.Ride, state: ViewerState, live: Live) -> ViewerState:
    """Ride with a road user."""
    camera = LagrangianCamera(mode="lagrangian", vehicle=order.vehicle, view=order.view)
    return _riding(state, camera, live)


@obeyed.register
def _(order: messages.Leave, state: ViewerState, live: Live) -> ViewerState:
    """Get out."""
    return outside(state, live)


@obeyed.register
def _(order: messages.KeyFrameOrder, state: ViewerState, live: Live) -> ViewerState:
    """Work on the key frames; the render thread saves them."""
    if order.act == "add":
        if len(state.frames) >= MOST_FRAMES:
            raise ConfigError(f"a path has at most {MOST_FRAMES} key frames; save or clear it")
        return replace(state, frames=with_frame(state.frames, _dropped(state, live)))
    if order.act == "remove":
        if not -1 <= order.index < len(state.frames) or not state.frames:
            raise ConfigError("there is no such key frame")
        frames = list(state.frames)
        del frames[order.index]
        return replace(outside(state, live), frames=tuple(frames))
    if order.act == "clear":
        return replace(outside(state, live), frames=())
    if order.act == "stop":
        return replace(outside(state, live), playing=False)
    if len(state.frames) < 2:
        raise ConfigError("drop at least two key frames first")
    return replace(state, ride=None, flying=True, playing=True, time=state.frames[0].time)


def _dropped(state: ViewerState, live: Live) -> KeyFrame:
    """Return a key frame here and now, or as much later as it takes to fly here."""
    eye, time = state.said(live), state.time
    if state.frames:
        last = state.frames[-1]
        way = float(np.linalg.norm(eye.position - np.array(last.position)))
        if key_frame(eye, time).time in {frame.time for frame in state.frames}:
            time = last.time + max(way / _FLIGHT, _LEAST)
    return key_frame(eye, time)


def _riding(state: ViewerState, camera: CameraSettings, live: Live) -> ViewerState:
    """Ride with a road user, at a time at which it is there."""
    riding = replace(state, ride=camera, flying=False)
    begin, end = live.life_of(camera)
    if not begin <= state.time <= end:
        riding = replace(riding, time=within(begin, live))
    riding.view(live)  # an error now, not later
    return riding


def within(time: float, live: Live) -> float:
    """Return the nearest time of the log [s]."""
    return min(max(time, live.ground.begin), live.ground.end)


def frames_said(frames: Sequence[KeyFrame]) -> list[Mapping[str, Any]]:
    """Write key frames as messages to pages hold them."""
    return [frame.model_dump(mode="json", exclude_none=True) for frame in frames]


def said_of(eye: ViewerEye) -> Mapping[str, Any]:
    """Write an eye as messages to pages hold it."""
    numbers = {name: round(getattr(eye, name), 3) for name in ("heading", "pitch", "roll", "fov")}
    return {"position": [round(float(x), 3) for x in eye.position], **numbers}
