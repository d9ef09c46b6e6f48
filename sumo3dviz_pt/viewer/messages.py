"""Messages between a page and the render thread; orders of a page are checked as they come in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.job.settings import Settings
from sumo3dviz_pt.job.values import Finite, Point, Seconds, Turn, Whole

InputId = Annotated[Whole, Field(ge=0, le=2**53)]
Pixels = Annotated[Finite, Field(ge=-1e5, le=1e5)]


class _Input(Settings):
    """Base of what keys and pointer do; pages number it, to measure how late pictures are."""

    id: InputId = 0


class _Toggle(Settings):
    """Base of what is switched on or off."""

    on: bool


class Keys(_Input):
    """The movement keys that are down."""

    do: Literal["keys"]
    down: tuple[str, ...] = Field(max_length=32)


class Drag(_Input):
    """The pointer was dragged over the picture [px]."""

    do: Literal["drag"]
    dx: Pixels
    dy: Pixels
    width: Pixels = Field(gt=0.0)


class GoTo(Settings):
    """See what one of the scene's cameras sees."""

    do: Literal["camera"]
    name: str


class StandAt(Settings):
    """Stand somewhere; angles as in scene files [deg]."""

    do: Literal["eye"]
    position: Point
    heading: Turn
    pitch: Finite = Field(0.0, ge=-90.0, le=90.0)
    roll: Turn = 0.0
    fov: Finite = Field(50.0, ge=2.0, le=170.0)


class SetTime(Settings):
    """Show a time [s]."""

    do: Literal["time"]
    value: Seconds


class Play(_Toggle):
    """Let time run."""

    do: Literal["play"]


class Speed(Settings):
    """Let time run faster or slower than clocks do."""

    do: Literal["speed"]
    factor: Finite = Field(ge=0.01, le=100.0)


class StepFrames(Settings):
    """Go on or back by frames."""

    do: Literal["step"]
    frames: Whole = Field(ge=-1000, le=1000)


class Dynamic(_Toggle):
    """Show road users or not."""

    do: Literal["dynamic"]


class Denoise(_Toggle):
    """Remove noise of standing pictures or not."""

    do: Literal["denoise"]


class Pick(Settings):
    """Ride with the road user that is seen at a point of the picture, from its top left."""

    do: Literal["pick"]
    x: Finite = Field(ge=0.0, le=1.0)
    y: Finite = Field(ge=0.0, le=1.0)


class Ride(Settings):
    """Ride with a road user."""

    do: Literal["ride"]
    vehicle: str
    view: str = "chase"


class Leave(Settings):
    """Get out, and stand where the camera was."""

    do: Literal["leave"]


class UnderSky(Settings):
    """Another sky, for all pages."""

    do: Literal["sky"]
    preset: str


class InWeather(Settings):
    """Another weather, for all pages; without a name, the scene file's own."""

    do: Literal["weather"]
    preset: str


class Template(Settings):
    """Another look, for all pages."""

    do: Literal["template"]
    name: str


class Exposure(Settings):
    """Brighter or darker than the scene file says [EV]."""

    do: Literal["exposure"]
    ev: Finite = Field(ge=-10.0, le=10.0)


class TakeStill(Settings):
    """A picture at a preset's quality."""

    do: Literal["still"]
    quality: str


class AskYaml(Settings):
    """The camera as text for a scene file."""

    do: Literal["yaml"]


class SaveView(Settings):
    """Put the view into the scene file as a standing camera."""

    do: Literal["save"]
    name: str = Field(max_length=200)


class KeyFrameOrder(Settings):
    """Work on the key frames."""

    do: Literal["keyframe"]
    act: Literal["add", "remove", "clear", "play", "stop", "save"]
    index: Whole = Field(-1, ge=-1)
    name: str = "path"


Order = (
    Keys
    | Drag
    | GoTo
    | StandAt
    | SetTime
    | Play
    | Speed
    | StepFrames
    | Dynamic
    | Denoise
    | Pick
    | Ride
    | Leave
    | UnderSky
    | InWeather
    | Template
    | Exposure
    | TakeStill
    | AskYaml
    | SaveView
    | KeyFrameOrder
)

_ORDERS: TypeAdapter[Order] = TypeAdapter(Annotated[Order, Field(discriminator="do")])


def parsed(raw: Mapping[str, Any]) -> Order:
    """Read a page's message as an order.

    Raises:
        ConfigError: If it is none.
    """
    try:
        return _ORDERS.validate_python(raw)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        why = cut(f"{place}: {first['msg']}", most=200)
        raise ConfigError(f"the page asked for nonsense ({why})") from error


@dataclass(frozen=True, slots=True)
class Frame:
    """A picture; a newer one may replace it while it waits.

    Attributes:
        info: `seq` and what is said about it.
        jpeg: The file.
    """

    info: dict[str, Any]
    jpeg: bytes


@dataclass(frozen=True, slots=True)
class Note:
    """Anything else; none gets lost.

    Attributes:
        content: With its `kind`.
    """

    content: dict[str, Any]


Message = Frame | Note
