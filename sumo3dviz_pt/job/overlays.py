"""The scene file's settings of overlays: what is drawn over the developed film, never into it.

Lengths on the picture are shares of its height, so that a film looks the same at any size. Times
are the film's own: seconds from the shot's first frame.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from sumo3dviz_pt.job.values import (
    MOST_ENTRIES,
    Finite,
    HexColour,
    OneOrMoreNames,
    Positive,
    Settings,
)

Place = Literal["top_left", "top", "top_right", "middle", "bottom_left", "bottom", "bottom_right"]
"""Where on the picture something stands."""

FilmTime = Annotated[Finite, Field(ge=0, le=100_000)]
"""Seconds from the shot's first frame, in the film's own time."""

LetterSize = Annotated[Finite, Field(ge=0.01, le=0.5)]
"""Height of letters, as a share of the picture's height."""

_SIZE = 0.034
_ORANGE = "#ffb000"


class _Window(Settings):
    """Something that is shown for a while."""

    start: FilmTime = Field(0.0, alias="from", description="film's time at which it appears [s]")
    end: FilmTime | None = Field(
        None, alias="to", description="film's time at which it goes [s]; default the end"
    )

    @model_validator(mode="after")
    def _forward(self) -> _Window:
        """Refuse what would never be seen."""
        if self.end is not None and self.end <= self.start:
            raise ValueError(f"'to' ({self.end}) must be later than 'from' ({self.start})")
        return self


class TextOverlay(_Window):
    """Words that stand on the picture."""

    text: str = Field(min_length=1, description="the words; a line break begins a new line")
    place: Place = Field("top", description="where it stands")
    size: LetterSize = Field(_SIZE, description="height of letters, share of the picture's")
    colour: HexColour = Field("#ffffff", description="of the letters")


class SpeedOverlay(Settings):
    """The speed of the vehicle that the camera rides with."""

    place: Place = Field("bottom_left", description="where it stands")
    unit: Literal["km/h", "mph", "m/s"] = Field("km/h", description="of the number")
    vehicle: str | None = Field(None, description="another vehicle's id instead")
    size: LetterSize = Field(0.06, description="height of the number, share of the picture's")


class ClockOverlay(Settings):
    """The time."""

    place: Place = Field("top_right", description="where it stands")
    form: Literal["clock", "seconds"] = Field(
        "clock", description="SUMO's time as hours:minutes:seconds, or in seconds"
    )
    size: LetterSize = Field(_SIZE, description="height of digits, share of the picture's")


class LabelOverlay(Settings):
    """Words that follow road users."""

    ids: OneOrMoreNames = Field(description="ids or patterns of ids")
    text: str = Field("{id}", description="{id}, {speed} [km/h] and {distance} [m] are filled in")
    reach: Positive = Field(100.0, le=1000, description="farthest road users with labels [m]")
    size: LetterSize = Field(0.026, description="height of letters, share of the picture's")
    colour: HexColour = Field("#ffffff", description="of the letters")


class HighlightOverlay(Settings):
    """Frames around road users."""

    ids: OneOrMoreNames = Field(description="ids or patterns of ids")
    form: Literal["box", "frame"] = Field(
        "frame", description="edges of the body's box in space, or a frame around it"
    )
    colour: HexColour = Field(_ORANGE, description="of the lines")
    reach: Positive = Field(200.0, le=1000, description="farthest road users that have one [m]")


class TrailOverlay(Settings):
    """Where road users have driven, as lines on the ground."""

    ids: OneOrMoreNames = Field(description="ids or patterns of ids")
    seconds: Positive = Field(3.0, le=60, description="how far back, in SUMO's time [s]")
    colour: Literal["speed"] | HexColour = Field("speed", description="#rrggbb, or by speed")
    width: Positive = Field(0.3, le=5, description="of the line [m]")


class DotsOverlay(Settings):
    """A dot on each road user, coloured by its speed."""

    ids: OneOrMoreNames = Field(("*",), description="ids or patterns of ids")
    reach: Positive = Field(150.0, le=1000, description="farthest road users that have one [m]")
    size: LetterSize = Field(0.022, description="of the dots, share of the picture's height")


class SpeedScale(Settings):
    """Between which speeds colours run, and whether a scale shows it."""

    slowest: Finite = Field(0.0, ge=0, le=200, description="speed of the first colour [m/s]")
    fastest: Positive = Field(14.0, le=200, description="speed of the last colour [m/s]")
    place: Place | None = Field(None, description="where the scale stands; default nowhere")

    @model_validator(mode="after")
    def _rising(self) -> SpeedScale:
        """Refuse a scale without length."""
        if self.fastest <= self.slowest:
            raise ValueError(f"'fastest' ({self.fastest}) must be more than 'slowest'")
        return self


class MapOverlay(Settings):
    """The place from above: lanes, road users, the camera and what it sees."""

    place: Place = Field("bottom_right", description="where it stands")
    size: Annotated[Finite, Field(ge=0.1, le=1)] = Field(
        0.36, description="width and height, share of the picture's height"
    )
    radius: Positive = Field(60.0, le=500, description="how far it shows from its middle [m]")
    north_up: bool = Field(False, description="north is up, not where the camera looks")


class FadeOverlay(Settings):
    """How a film begins and ends."""

    start: FilmTime = Field(0.0, alias="in", description="from the colour to the picture [s]")
    end: FilmTime = Field(0.0, alias="out", description="from the picture to the colour [s]")
    colour: HexColour = Field("#000000", description="of nothing")


class StillOverlay(Settings):
    """A plain picture before or after a film."""

    show: Literal["blank", "fixation"] = Field("blank", description="nothing, or a cross")
    seconds: Positive = Field(1.0, le=3600, description="how long; rounded to whole frames [s]")
    colour: HexColour = Field("#777777", description="of the ground")
    text: str = Field("", description="words in its middle")


class CaptionOverlay(_Window):
    """A caption: in a file beside the film, not on it."""

    text: str = Field(min_length=1, description="the words")


class OverlaySettings(Settings):
    """What is drawn over the film; the film without all this lies beside it."""

    text: tuple[TextOverlay, ...] = Field((), max_length=MOST_ENTRIES, description="words")
    speed: SpeedOverlay | None = Field(
        None, description="speed of the vehicle that the camera rides with"
    )
    clock: ClockOverlay | None = Field(None, description="the time")
    labels: tuple[LabelOverlay, ...] = Field(
        (), max_length=MOST_ENTRIES, description="words that follow road users"
    )
    highlights: tuple[HighlightOverlay, ...] = Field(
        (), max_length=MOST_ENTRIES, description="frames around road users"
    )
    trails: tuple[TrailOverlay, ...] = Field(
        (), max_length=MOST_ENTRIES, description="where road users have driven"
    )
    dots: DotsOverlay | None = Field(
        None, description="a dot on each road user, coloured by its speed"
    )
    scale: SpeedScale = SpeedScale()
    map: MapOverlay | None = Field(None, description="the place from above")
    fade: FadeOverlay | None = Field(None, description="how the film begins and ends")
    before: tuple[StillOverlay, ...] = Field(
        (), max_length=100, description="plain pictures before the film"
    )
    after: tuple[StillOverlay, ...] = Field(
        (), max_length=100, description="plain pictures after the film"
    )
    captions: tuple[CaptionOverlay, ...] = Field(
        (), max_length=MOST_ENTRIES, description="words in a .vtt file beside the film"
    )
