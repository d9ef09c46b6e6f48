"""Cameras by mode: where the eye is, how it is aimed, what it sees with, at any time.

A camera is a pure function of time. The type of its settings decides which builder makes it; each
mode's module in this folder registers its own. A camera is aimed by angles, or at a point, and sees
with the lens that the scene file describes. Some cameras must keep a clear view; they are chosen
here, too.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import singledispatch
from typing import Protocol

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.cameras import FOV
from sumo3dviz_pt.job.settings import (
    CameraSettings,
    EulerianCamera,
    KeyFrame,
    LensSettings,
    Settings,
)
from sumo3dviz_pt.model.camera import CameraPath, Shutter
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.world.placement.clearance import Clearance

_NEAREST = 1e-6
"""A target must be further away than this [m]."""


@dataclass(frozen=True, slots=True)
class Aim:
    """A viewing direction with its tilt.

    Attributes:
        yaw: Counter-clockwise from east [rad].
        pitch: Upwards [rad].
        roll: Clockwise as the viewer sees it [rad].
    """

    yaw: float
    pitch: float
    roll: float = 0.0

    def placed(self, position: Floats) -> Transform:
        """Return `world_from_camera` of an eye at a position, (3,) [m]."""
        return Transform.from_pose(position, yaw=self.yaw, pitch=self.pitch, roll=self.roll)


def aim_of(settings: EulerianCamera | KeyFrame, location: Location = UNPLACED) -> Aim:
    """Return the aim that settings ask for.

    Args:
        settings: In SUMO's coordinates.
        location: From where ours are counted.

    Raises:
        ConfigError: If the camera is to look at the point where it stands.
    """
    roll = float(np.radians(settings.roll))
    if settings.look_at is not None:
        subject, eye = location.inside([settings.look_at, settings.position])
        return aim_at(subject - eye, roll=roll)
    assert settings.heading is not None
    yaw = np.pi / 2 - np.radians(settings.heading)
    return Aim(float(yaw), float(np.radians(settings.pitch)), roll)


def aim_at(direction: Floats, *, roll: float = 0.0) -> Aim:
    """Aim along a direction, (3,); straight up or down, north is the picture's top or foot.

    Raises:
        ConfigError: If the direction vanishes.
    """
    level = float(np.hypot(direction[0], direction[1]))
    if np.hypot(level, direction[2]) < _NEAREST:
        raise ConfigError("look_at is the camera's own position", key="cameras")
    yaw = np.arctan2(direction[1], direction[0]) if level > _NEAREST else np.pi / 2
    return Aim(float(yaw), float(np.arctan2(direction[2], level)), roll)


ALWAYS = (float("-inf"), float("inf"))
"""All of time [s]."""


class Camera(Protocol):
    """Anything that has a view at any time."""

    @property
    def shutter(self) -> Shutter:
        """When it lets light in."""

    def view_at(self, time: float) -> View:
        """Return the view at a time [s].

        Raises:
            ConfigError: If the camera rides with a road user that does not exist then.
        """

    def moments(self, times: tuple[float, float] = ALWAYS) -> tuple[float, ...]:
        """Return increasing times whose views stand for all of its way [s].

        Args:
            times: First and last of interest [s]. A camera that rides with a road user has no
                moments if the road user does not exist between them; other cameras may ignore
                them.
        """


@singledispatch
def build_camera(settings: Settings, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """Make the camera that a scene file asks for.

    Args:
        settings: One of the job's camera settings.
        fleet: Road users that a camera can ride with.
        left_hand: Whether traffic keeps left, so that drivers sit on the right.

    Raises:
        ConfigError: If the road user that it rides with or its view is unknown, or if it looks
            at the point where it stands.
    """
    raise TypeError(f"{type(settings).__name__} is no camera")


def lens_of(settings: LensSettings, *, degrees: float = FOV) -> Lens:
    """Return the lens that settings ask for: the only place that reads their projection.

    Args:
        settings: Of the lens.
        degrees: Opening angle of a perspective lens that does not say it [deg].
    """
    if settings.width is not None:
        return Lens(0.0, settings.projection, width=settings.width)
    degrees = settings.degrees(degrees)
    focus = settings.focus if isinstance(settings.focus, float) else float("inf")
    return Lens(
        float(np.radians(degrees)),
        settings.projection,
        aperture=settings.aperture(degrees),
        focus=focus,
        distortion=settings.distortion,
        stereo=settings.stereo,
        eye_distance=settings.eye_distance,
    )


def alone(settings: CameraSettings, location: Location = UNPLACED) -> Camera:
    """Make a camera that rides with nobody; errors as in `build_camera`."""
    return build_camera(settings, fleet=Fleet((), (), (), {}, location=location))


_VIEWS = 60
"""Views that stand for the way of a camera that moves, beside those at its moments."""


def clearance_of(
    cameras: Iterable[CameraSettings], *, aspect: float, location: Location = UNPLACED
) -> Clearance:
    """Return the ways of all cameras that ride in no vehicle and want a clear view.

    Args:
        cameras: All of a scene file.
        aspect: Height / width of the picture.
        location: From where the world's places are counted.

    Raises:
        ConfigError: If a camera looks at the point where it stands.
    """
    by_camera = [_views(camera, location) for camera in clearing(cameras)]
    return Clearance(tuple(CameraPath.of(views, aspect=aspect) for views in by_camera if views))


def clearing(cameras: Iterable[CameraSettings]) -> list[CameraSettings]:
    """Return those cameras that ride in no vehicle and want a clear view."""
    return [camera for camera in cameras if getattr(camera, "clear_view", False)]


def _views(settings: CameraSettings, location: Location) -> list[View]:
    """Views along a camera's way."""
    camera = alone(settings, location)
    moments = camera.moments()
    between = np.linspace(moments[0], moments[-1], _VIEWS) if len(moments) > 1 else moments
    return [camera.view_at(time) for time in sorted({*moments, *map(float, between)})]
