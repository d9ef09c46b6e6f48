"""Cameras: where the eye is and what it sees with, at any time.

A camera is a pure function of time. The type of its settings decides which builder makes it;
a new kind is one more registered builder here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from typing import Protocol

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import CinematicCamera, EulerianCamera, LagrangianCamera, Settings
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.shutter import INSTANT, Shutter
from sumo3dviz_pt.shot.cameras.aiming import aim_of
from sumo3dviz_pt.shot.cameras.flying import build_flight
from sumo3dviz_pt.shot.cameras.lenses import lens_of
from sumo3dviz_pt.shot.cameras.riding import build_ride


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


@dataclass(frozen=True, slots=True, eq=False)
class StandingCamera:
    """An Eulerian camera: the same view at all times.

    Attributes:
        view: Where it stands and what it sees.
        shutter: When it lets light in.
    """

    view: View
    shutter: Shutter = INSTANT

    def view_at(self, time: float) -> View:
        """Return the view, whatever the time."""
        return self.view


def standing_view(settings: EulerianCamera) -> View:
    """Return what a camera that stands still sees.

    Raises:
        ConfigError: If it looks at the point where it stands.
    """
    placed = aim_of(settings).placed(np.array(settings.position))
    return View(placed, lens_of(settings.lens))


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


@build_camera.register
def _(settings: EulerianCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """A camera that stands still."""
    return StandingCamera(standing_view(settings))


@build_camera.register
def _(settings: LagrangianCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """A camera that rides with a road user."""
    return build_ride(settings, fleet=fleet, left_hand=left_hand)


@build_camera.register
def _(settings: CinematicCamera, *, fleet: Fleet, left_hand: bool = False) -> Camera:
    """A camera that flies through key frames."""
    return build_flight(settings)
