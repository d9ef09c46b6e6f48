"""Cameras with shutters and focus: what a scene file says of them, put to any camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet, find_rider
from sumo3dviz_pt.job.lens import FocusOn
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.shutter import INSTANT, Shutter
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot.cameras.build import ALWAYS, Camera, build_camera
from sumo3dviz_pt.shot.cameras.riding import RidingCamera

_MOST_VIEWS = 120
"""Views that stand for a camera's way, at most."""

_NEAREST = 0.05
"""What a lens is focused on lies at least so far away [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """Who stays sharp.

    Attributes:
        trajectory: Of the road user.
        middle: Of its body, in the body's frame, (3,) [m].
    """

    trajectory: Trajectory
    middle: Floats

    def distance(self, view: View, time: float) -> float:
        """Return how far its middle is from a camera at a time, along the axis if that is plane."""
        pieces = self.trajectory.pieces
        piece = min(pieces, key=lambda each: max(each.begin - time, time - each.end))
        motion = piece.sample(np.array([min(max(time, piece.begin), piece.end)]))
        yaw = float(motion.yaws[0])
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        place = motion.positions[0] + self.middle[0] * ahead + (0.0, 0.0, self.middle[2])
        towards = place - view.position
        along = towards @ view.forward if view.lens.projection == "perspective" else 0.0
        away = along if view.lens.projection == "perspective" else np.linalg.norm(towards)
        return max(float(away), _NEAREST)


@dataclass(frozen=True, slots=True, eq=False)
class ExposedCamera:
    """A camera with a shutter, or with a lens that follows somebody with its focus.

    Attributes:
        camera: Where it is and what it sees with.
        shutter: When it lets light in.
        subject: Who stays sharp; None for what the lens is focused on anyway.
    """

    camera: Camera
    shutter: Shutter = INSTANT
    subject: Subject | None = None

    def view_at(self, time: float) -> View:
        """Return the view at a time [s]; errors as the camera's."""
        view = self.camera.view_at(time)
        if self.subject is None:
            return view
        lens = replace(view.lens, focus=self.subject.distance(view, time))
        return replace(view, lens=lens)

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return the camera's moments."""
        return self.camera.moments(times)


def exposed_camera(
    settings: CameraSettings,
    *,
    fleet: Fleet,
    left_hand: bool,
    step: float,
    focused: bool = True,
) -> Camera:
    """Build a camera with all that its settings say; a plain one stays as it is.

    Args:
        settings: Of the camera.
        fleet: Road users that it can ride with or be focused on.
        left_hand: Whether traffic keeps left.
        step: From a frame to the next [s].
        focused: Whether it must follow whom it is focused on; they need not be there if not.

    Raises:
        ConfigError: If whom it rides with or is focused on is unknown.
    """
    camera = build_camera(settings, fleet=fleet, left_hand=left_hand)
    shutter = shutter_of(settings, step)
    target = focus_target(settings) if focused else None
    if shutter == INSTANT and target is None:
        return camera
    if isinstance(camera, RidingCamera):
        # The last frame's shutter closes after whom it rides with is gone.
        camera = replace(camera, slack=max(camera.slack, shutter.lasts))
    return ExposedCamera(camera, shutter, None if target is None else _subject(fleet, target))


def shutter_of(settings: CameraSettings, step: float) -> Shutter:
    """Return a camera's shutter: it opens at the frame's time.

    Args:
        settings: Of the camera.
        step: From a frame to the next [s].
    """
    said = settings.shutter
    if said is None:
        return INSTANT
    span = said.span(step)
    moments = said.moments if span > 0.0 or said.rolling > 0.0 else 1
    return Shutter(0.0, span, moments, said.rolling)


def focus_target(settings: CameraSettings) -> str | None:
    """Return the id of the road user that a camera is focused on; None where it is on none."""
    focus = settings.lens.focus if settings.lens is not None else None
    return focus.vehicle if isinstance(focus, FocusOn) else None


def moments_of(camera: Camera, times: Floats) -> Floats:
    """Return the moments that a camera's frames at times, (n,) [s], show, all in one array [s]."""
    shutters = (camera.shutter.at(time) for time in times.tolist())
    return np.array([moment for shutter in shutters for moment in _moments(shutter)])


def camera_path_of(camera: Camera, times: Floats, aspect: float) -> CameraPath:
    """Return where a camera is and looks over a whole shot, by a few of its views."""
    every = max(1, -(-len(times) // _MOST_VIEWS))
    return CameraPath.of([camera.view_at(float(time)) for time in times[::every]], aspect=aspect)


def _moments(shutter: Shutter) -> Iterator[float]:
    """Yield the moments that a frame shows [s]: the middle of its exposure, and all others."""
    yield shutter.middle
    if not shutter.is_instant:
        yield from (moment for moment, _ in shutter.exposures())


def _subject(fleet: Fleet, target: str) -> Subject:
    """Return who stays sharp."""
    trajectory = find_rider(fleet, target)
    length, _, height = fleet.body(trajectory.key).size
    return Subject(trajectory, np.array([-0.5 * length, 0.0, 0.5 * height]))
