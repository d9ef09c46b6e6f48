"""Settings of cameras: what they see with, where they stand and how they move."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sumo3dviz_pt.job.lens import ExposureSettings as ExposureSettings
from sumo3dviz_pt.job.lens import LensSettings as LensSettings
from sumo3dviz_pt.job.lens import Photographic as Photographic
from sumo3dviz_pt.job.lens import ShutterSettings as ShutterSettings
from sumo3dviz_pt.job.objects import ObjectSettings as ObjectSettings
from sumo3dviz_pt.job.objects import ObjectsSettings as ObjectsSettings
from sumo3dviz_pt.job.ranges import (
    MOST_ENTRIES,
    Finite,
    Point,
    Positive,
    Seconds,
    Turn,
)
from sumo3dviz_pt.job.values import Settings as Settings

Lights = Literal["auto", "on", "off"]
"""When lamps are lit."""


_CLEAR_VIEW = Field(
    True, description="houses, trees and street furniture that are added keep out of the way"
)


class EulerianCamera(Photographic):
    """A camera that stands still."""

    mode: Literal["eulerian"]
    position: Point = Field(description="x, y, z in network coordinates [m]; z above the ground")
    heading: Turn | None = Field(None, description="clockwise from north [deg]")
    pitch: Finite = Field(0.0, ge=-90, le=90, description="upwards [deg]")
    roll: Turn = Field(0.0, description="clockwise [deg]")
    look_at: Point | None = Field(None, description="instead of heading and pitch [m]")
    lens: LensSettings = LensSettings()
    clear_view: bool = _CLEAR_VIEW

    @model_validator(mode="after")
    def _one_way(self) -> EulerianCamera:
        """Ask for exactly one way of aiming."""
        if (self.heading is None) == (self.look_at is None):
            raise ValueError("give either heading (with pitch) or look_at")
        return self

    def in_words(self) -> str:
        """Return what it does, in one line."""
        aim = f"heading {self.heading:g}°" if self.heading is not None else ""
        aim = aim or f"looking at {_point(self.look_at or ())}"
        return f"stands at {_point(self.position)}, {aim}, {self.lens.in_words()}"


class LagrangianCamera(Photographic):
    """A camera that rides with a road user."""

    mode: Literal["lagrangian"]
    vehicle: str = Field(description="id of a vehicle (or person) of the log")
    view: str = Field("driver", description="a name from `scene_templates/camera`")
    eye_height: Positive | None = Field(None, le=1000, description="above the ground [m]")
    heading: Turn = Field(0.0, description="clockwise from straight ahead [deg]")
    pitch: Finite | None = Field(None, ge=-90, le=90, description="upwards [deg]")
    bobbing: bool = Field(False, description="whether the head of who walks rises with each step")
    reflections: bool = Field(
        False, description="whether the windscreen reflects the dashboard, in views from inside"
    )
    lens: LensSettings | None = Field(None, description="default: the view's own")

    def in_words(self) -> str:
        """Return what it does, in one line."""
        return f"rides with {self.vehicle}, view {self.view}"


class KeyFrame(Settings):
    """A point on a cinematic camera's path."""

    time: Seconds = Field(description="SUMO's time [s]")
    position: Point = Field(description="x, y, z in network coordinates [m]")
    heading: Turn | None = Field(None, description="clockwise from north [deg]")
    pitch: Finite = Field(0.0, ge=-90, le=90, description="upwards [deg]")
    roll: Turn = Field(0.0, description="clockwise [deg]")
    look_at: Point | None = Field(None, description="instead of heading and pitch [m]")
    fov: Finite | None = Field(None, ge=2, le=170, description="[deg]; default the lens's")

    @model_validator(mode="after")
    def _one_way(self) -> KeyFrame:
        """Ask for exactly one way of aiming."""
        if (self.heading is None) == (self.look_at is None):
            raise ValueError("give either heading (with pitch) or look_at")
        return self


class CinematicCamera(Photographic):
    """A camera that flies through key frames."""

    mode: Literal["cinematic"]
    keyframes: tuple[KeyFrame, ...] = Field(
        min_length=1, max_length=MOST_ENTRIES, description="in time order"
    )
    lens: LensSettings = LensSettings()
    clear_view: bool = _CLEAR_VIEW

    @model_validator(mode="after")
    def _in_order(self) -> CinematicCamera:
        """Refuse key frames that do not go forward in time."""
        times = [key.time for key in self.keyframes]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError("the times of keyframes must increase")
        return self

    def in_words(self) -> str:
        """Return what it does, in one line."""
        first, last = self.keyframes[0], self.keyframes[-1]
        ways = f"{_point(first.position)} to {_point(last.position)}"
        many = len(self.keyframes)
        return f"flies from {ways}, {first.time:.12g} to {last.time:.12g} s, {many} key frames"


CameraSettings = Annotated[
    EulerianCamera | LagrangianCamera | CinematicCamera, Field(discriminator="mode")
]
"""The settings of one camera; its key `mode` says which. A mode that rides in no vehicle has a
key `clear_view`."""


def _point(point: tuple[float, ...]) -> str:
    """Return a point in words [m]."""
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
