"""Settings of the stimulus report: what is measured of films, and for whom."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from sumo3dviz_pt.job.ranges import MOST_ENTRIES, Finite, Metres, Positive
from sumo3dviz_pt.job.values import ONE_OR_MORE, Settings

CAMERA = "camera"
"""Name of the observer that every film has: its camera."""

_Place = tuple[Metres, Metres]
_Patterns = Annotated[tuple[str, ...], Field(max_length=MOST_ENTRIES), ONE_OR_MORE]
_Rates = Annotated[tuple[Positive, ...], Field(max_length=20)]


class ObserverSettings(Settings):
    """Somebody for whom vehicles arrive: who stands at a place, or a road user."""

    position: _Place | None = Field(
        None, description="x, y of who stands [m], such as a kerb; or give road_user"
    )
    road_user: str | None = Field(None, description="id of a road user, such as a cyclist")
    eye: Finite = Field(1.6, ge=0, le=100, description="height of the eye above the road [m]")
    across: _Place | None = Field(
        None,
        description="x, y where the way across ends that begins at `position` [m]; default"
        " straight over the nearest lane and 12 m beyond its middle. Of a road user it is the line"
        " through its front, at right angles to its heading",
    )

    @model_validator(mode="after")
    def _one(self) -> ObserverSettings:
        """Ask for a place or a road user."""
        if (self.position is None) == (self.road_user is None):
            raise ValueError("give either position or road_user")
        if self.across is not None and self.position in (None, self.across):
            raise ValueError("across is another place than position, and needs it")
        return self


class ReportSettings(Settings):
    """What films show, in numbers: light, motion, clutter, traffic, flashes."""

    write: bool = Field(
        True, description="whether there is one; it needs the layer `instance` beside the films"
    )
    white: Positive = Field(
        100.0,
        le=100_000,
        description="luminance of the display's white [cd/m2], for what is shown; its curve is"
        " taken as sRGB",
    )
    things: _Patterns = Field(
        ("vehicle:*", "person:*"),
        description="names of things whose visible share is told, such as sign:*: of the"
        " picture's pixels, those that show it",
    )
    observers: dict[str, ObserverSettings] = Field(
        default_factory=dict,
        max_length=100,
        description="for whom gaps, arrivals and angles of vehicles are told, by name, beside the"
        f" film's `{CAMERA}`",
    )
    within: Positive = Field(
        100.0, le=300, description="of which road users observers are told: so near [m]"
    )
    connections: _Rates = Field(
        (5.0, 25.0, 100.0), description="for which the time is told that a film takes [Mbit/s]"
    )

    @model_validator(mode="after")
    def _no_camera(self) -> ReportSettings:
        """Keep the name of the observer that is always there."""
        if CAMERA in self.observers:
            raise ValueError(f"no observer can be called {CAMERA!r}: the film's camera is")
        return self
