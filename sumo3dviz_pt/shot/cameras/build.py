"""Cameras: where the eye is and what it sees with, at any time.

A camera is a pure function of time. The type of its settings decides which builder makes it;
each mode's module in this folder registers its own.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Protocol

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import Settings
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.model.shutter import Shutter

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
