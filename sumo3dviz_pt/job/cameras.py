"""Settings of cameras: what they see with, where they stand and how they move.

Lens, shutter and exposure are given as photographers say them.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from sumo3dviz_pt.job.surroundings import ObjectSettings as ObjectSettings
from sumo3dviz_pt.job.surroundings import ObjectsSettings as ObjectsSettings
from sumo3dviz_pt.job.values import (
    MOST_ENTRIES,
    Finite,
    Point,
    Positive,
    Quantity,
    Seconds,
    Settings,
    Turn,
    Whole,
)
from sumo3dviz_pt.model.numbers import PROJECTIONS, Projection, Stereo

FOV = 50.0
"""Of a camera that says nothing of it [deg]."""

_PART = re.compile(r"\s*1\s*/\s*([0-9.]+)\s*(?:s)?\s*")


def _part_of_second(value: Any) -> Any:
    """Return `1/50 s` as a number of seconds, and all else as it is."""
    match = _PART.fullmatch(value) if isinstance(value, str) else None
    return 1.0 / float(match[1]) if match and float(match[1]) > 0.0 else value


FocalLength = Annotated[float, Quantity("m", 0.001, 2.0)]
SensorWidth = Annotated[float, Quantity("m", 0.001, 0.5)]
Away = Annotated[float, Quantity("m", 0.05, 1e6)]
PlanWidth = Annotated[float, Quantity("m", 0.1, 1e5)]
EyeDistance = Annotated[float, Quantity("m", 0.0, 10.0)]
Time = Annotated[float, Quantity("s", 0.0, 60.0), BeforeValidator(_part_of_second)]


class FocusOn(Settings):
    """What a lens is focused on while it moves."""

    vehicle: str = Field(description="id of a vehicle (or person) of the log that stays sharp")


def _two(value: Any) -> Any:
    """Let a single coefficient stand for a list of one, and a missing one be 0."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, 0.0)
    return (*value, 0.0) if isinstance(value, list | tuple) and len(value) == 1 else value


Coefficient = Annotated[Finite, Field(ge=-1, le=1)]


class LensSettings(Settings):
    """What a camera sees with."""

    projection: Projection = Field("perspective", description="kind of picture")
    fov: Finite | None = Field(
        None,
        ge=2,
        le=360,
        description="horizontal opening angle [deg]; default 50, fisheye 180, equirectangular 360,"
        " and the view's own for riding cameras",
    )
    focal_length: FocalLength | None = Field(None, description="instead of fov, as `35 mm`")
    sensor: SensorWidth = Field(0.036, description="width of the sensor, as `36 mm`")
    width: PlanWidth | None = Field(
        None, description="of what an orthographic picture shows, as `120 m`"
    )
    f_number: Positive | None = Field(
        None, ge=0.5, le=128, description="depth of field, as 2.8; default all is sharp"
    )
    focus: Away | FocusOn | None = Field(
        None, description="what is sharp: a distance such as `12 m`, or `{vehicle: ID}`"
    )
    vignetting: Finite = Field(
        0.0, ge=0, le=1, description="share of the natural fall of light towards the corners"
    )
    distortion: Annotated[tuple[Coefficient, Coefficient], BeforeValidator(_two)] = Field(
        (0.0, 0.0), description="radial, k1 and k2 as OpenCV has them; negative is a barrel"
    )
    grain: Finite = Field(0.0, ge=0, le=1, description="of film; 1 is coarse")
    stereo: Stereo = Field(
        "none", description="both eyes in one picture: side_by_side or top_bottom (left on top)"
    )
    eye_distance: EyeDistance = Field(0.063, description="between both eyes, as `63 mm`")

    @model_validator(mode="after")
    def _fits_projection(self) -> LensSettings:
        """Refuse what a projection does not have."""
        name = self.projection
        if self.fov is not None and self.focal_length is not None:
            raise ValueError("give either fov or focal_length, not both")
        if (name == "orthographic") != (self.width is not None):
            raise ValueError(
                "an orthographic lens needs its width, as `width: 120 m`"
                if self.width is None
                else f"width belongs to orthographic lenses, and this one is {name}"
            )
        if self.fov is not None and name == "perspective" and self.fov > 170:
            raise ValueError(f"a perspective lens has a fov of at most 170, not {self.fov:g}")
        if name == "equirectangular" and self.fov not in (None, 180.0, 360.0):
            raise ValueError(f"an equirectangular lens has a fov of 180 or 360, not {self.fov:g}")
        if name != "perspective" and self.focal_length is not None:
            raise ValueError(f"focal_length belongs to perspective lenses; {name} ones have fov")
        if name == "orthographic" and (self.fov or self.f_number or self.stereo != "none"):
            raise ValueError("an orthographic lens has no fov, no f_number and no stereo")
        self._check_rest()
        return self

    def _check_rest(self) -> None:
        """Refuse what does not fit together."""
        if self.focus is not None and self.f_number is None:
            raise ValueError("focus does nothing without f_number; give one, such as 2.8")
        if self.projection != "perspective":
            if any(self.distortion):
                raise ValueError("distortion belongs to perspective lenses")
            if self.vignetting:
                raise ValueError("vignetting belongs to perspective lenses")
        elif any(self.distortion):
            # Whoever only wants to know what the settings are need not have numpy.
            from sumo3dviz_pt.model.projections import folds

            if folds(math.tan(math.radians(self.degrees(FOV) / 2.0)), self.distortion):
                raise ValueError("this distortion folds the picture back; take smaller numbers")

    @property
    def is_left_to_the_view(self) -> bool:
        """Whether a riding camera's view says how wide it is and how it bends lines."""
        given = self.fov or self.focal_length or "distortion" in self.model_fields_set
        return self.projection == "perspective" and not given

    @property
    def is_pinhole(self) -> bool:
        """Whether it is a plain pinhole, whatever its angle."""
        plain = self.projection == "perspective" and self.stereo == "none"
        return plain and self.f_number is None and not any(self.distortion)

    def check_size(self, size: tuple[int, int]) -> None:
        """Refuse a picture's size [px] that would stretch what it shows.

        Raises:
            ValueError: Says which size fits.
        """
        width, height = size
        along = {"side_by_side": width, "top_bottom": height}.get(self.stereo, 0)
        if along % 2:
            raise ValueError(f"a picture of both eyes has an even size, not {width}x{height}")
        if self.projection != "equirectangular":
            return
        eyes = {"side_by_side": 2.0, "top_bottom": 0.5}.get(self.stereo, 1.0)
        fitting = round(width / (self.degrees(FOV) / 180.0 * eyes))
        if fitting != height:
            raise ValueError(
                f"such a picture of {width} px in width is {fitting} px high, not {height}:"
                f" say `size: [{width}, {fitting}]`"
            )

    def degrees(self, default: float) -> float:
        """Return the horizontal opening angle [deg].

        Args:
            default: Of a perspective lens that does not say it [deg].
        """
        if self.focal_length is not None:
            return math.degrees(2.0 * math.atan(0.5 * self.sensor / self.focal_length))
        if self.fov is not None:
            return self.fov
        own = PROJECTIONS[self.projection]
        return default if own is None else own

    def aperture(self, degrees: float) -> float:
        """Return the radius of the hole through which light comes, for an angle [deg], [m].

        The focal length over the f-number is its diameter.
        """
        if self.f_number is None:
            return 0.0
        half = math.radians(min(degrees, 120.0)) / 2.0
        focal = self.focal_length or 0.5 * self.sensor / math.tan(half)
        return 0.5 * focal / self.f_number

    def in_words(self) -> str:
        """Return how wide it sees, in a few words."""
        if self.width is not None:
            return f"a plan {self.width:g} m wide"
        text = f"{self.degrees(FOV):g}° wide"
        return text if self.projection == "perspective" else f"{text}, {self.projection}"


class ShutterSettings(Settings):
    """When a camera lets light in: what moves meanwhile is blurred."""

    angle: Finite | None = Field(
        None, gt=0, le=360, description="share of a frame's time in which it is open [deg]"
    )
    time: Time | None = Field(None, description="instead of the angle, as `20 ms` or `1/50 s`")
    rolling: Time = Field(
        0.0, description="how much later the lowest row is seen than the highest, as `15 ms`"
    )
    moments: Whole = Field(
        8, ge=1, le=64, description="moments of an exposure at which everything is seen"
    )

    @model_validator(mode="after")
    def _one_way(self) -> ShutterSettings:
        """Ask for one way of saying how long it is open."""
        if self.angle is not None and self.time is not None:
            raise ValueError("give either angle or time, not both")
        return self

    def span(self, step: float) -> float:
        """Return how long it is open, of a frame's time [s]: by default half of it.

        Args:
            step: From a frame to the next [s].
        """
        if self.time is not None:
            return self.time
        return step * (180.0 if self.angle is None else self.angle) / 360.0


class ExposureSettings(Settings):
    """How bright a camera's pictures are."""

    mode: Literal["sky", "auto", "manual", "fixed"] = Field(
        "sky",
        description="sky: what looks right under an open sky; auto: metered once per shot, then"
        " locked; manual: by f_number, shutter and ISO; fixed: ev alone, as accounts tell it",
    )
    ev: Finite = Field(0.0, ge=-30, le=30, description="brighter than that by so much [EV]")
    iso: Positive = Field(100.0, le=1e7, description="sensitivity, where the mode is manual")


def _mode(value: Any) -> Any:
    """Let a word stand for an exposure, `auto`, and a number for one above the sky's own."""
    if isinstance(value, str):
        return {"mode": value}
    if isinstance(value, int | float) and not isinstance(value, bool):
        return {"ev": value}
    return value


Exposure = Annotated[ExposureSettings, BeforeValidator(_mode)]
"""An exposure, or a word, or a number of EV above the sky's own."""


class Photographic(Settings):
    """What all cameras have beside their lens."""

    shutter: ShutterSettings | None = Field(
        None, description="default: every frame is a single moment, and nothing blurs"
    )
    exposure: Exposure | None = Field(None, description="default: the sky's own")

    # What all of the program asks of a camera: a new mode overrides what differs for it.

    @property
    def rides_with(self) -> str:
        """The id of the vehicle (or person) that it rides with; empty if it rides with nobody."""
        return ""

    @property
    def preset(self) -> str:
        """The file of `scene_templates/camera` that it takes; empty if it takes none."""
        return ""

    @property
    def mirrored(self) -> bool:
        """Whether a further pass traces what a pane before it reflects."""
        return False

    @property
    def stands_at(self) -> Point | None:
        """Where it stands in network coordinates [m]; None if it moves."""
        return None

    @property
    def flown(self) -> tuple[KeyFrame, ...]:
        """The key frames that it flies through, each with its opening angle."""
        return ()

    @property
    def gaze(self) -> tuple[float, float]:
        """Where the head of a camera that rides is turned to: heading and pitch [deg]."""
        return 0.0, 0.0

    def gazing(self, heading: float, pitch: float) -> Self:
        """Return the same camera with its head turned [deg], if it has one."""
        return self


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

    @property
    def stands_at(self) -> Point:
        """Where it stands [m]."""
        return self.position

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

    @property
    def rides_with(self) -> str:
        """The id of the vehicle (or person) that it rides with."""
        return self.vehicle

    @property
    def preset(self) -> str:
        """Its view."""
        return self.view

    @property
    def mirrored(self) -> bool:
        """Whether its windscreen reflects the dashboard."""
        return self.reflections

    @property
    def gaze(self) -> tuple[float, float]:
        """Where its head is turned to: heading and pitch [deg]."""
        return self.heading, self.pitch or 0.0

    def gazing(self, heading: float, pitch: float) -> Self:
        """Return the same camera with its head turned [deg]."""
        return self.model_copy(update={"heading": heading, "pitch": pitch})

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

    @property
    def flown(self) -> tuple[KeyFrame, ...]:
        """Its key frames, each with its opening angle."""
        own = {"fov": self.lens.degrees(FOV)}
        return tuple(key if key.fov else key.model_copy(update=own) for key in self.keyframes)

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
key `clear_view`; what others ask of a camera are the properties of `Photographic`."""


def _point(point: tuple[float, ...]) -> str:
    """Return a point in words [m]."""
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
