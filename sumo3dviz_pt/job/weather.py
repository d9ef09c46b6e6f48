"""Settings of the weather: physical quantities, each left out where it is absent."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sumo3dviz_pt.job.quantities import Quantity
from sumo3dviz_pt.job.ranges import MOST_ENTRIES, Finite, Seconds, Turn
from sumo3dviz_pt.job.values import Settings

CLEAREST = 100_000.0
"""Farthest visibility that may be asked for, as good as no fog [m]."""

Season = Literal["spring", "summer", "autumn", "winter"]
"""What leaves and grass look like."""

SnowyRoads = Literal["cleared", "tracked", "covered"]
"""Whether snow is ploughed off roads, driven off where wheels pass, or lies all over them."""

_Sight = Annotated[float, Quantity("m", 10.0, CLEAREST)]
_Height = Annotated[float, Quantity("m", 1.0, 5000.0)]
_Depth = Annotated[float, Quantity("m", 0.0, 1.0)]
_Rainfall = Annotated[float, Quantity("mm/h", 0.0, 200.0)]
_Snowfall = Annotated[float, Quantity("mm/h", 0.0, 20.0)]
_WindSpeed = Annotated[float, Quantity("m/s", 0.0, 40.0)]
_Share = Annotated[Finite, Field(ge=0.0, le=1.0)]


class FogSettings(Settings):
    """Droplets in the air."""

    visibility: _Sight = Field(
        description="distance at which a black thing keeps 2 % of contrast, such as 200 m;"
        " 10 m to 100 km"
    )
    height: _Height | None = Field(
        None,
        description="height in which its density falls to 37 %, such as 60 m; 1 m to 5 km; default"
        " equally dense up to 200 m",
    )


class RainSettings(Settings):
    """Drops that fall."""

    rate: _Rainfall = Field(description="how much falls, such as 10 mm/h; 0 to 200 mm/h")
    streaks: Finite | None = Field(
        None,
        ge=0,
        le=20,
        description="how many times as strong as in a photograph drops are seen in the air; default"
        " 6, 1 is physical, 0 is none",
    )


class SnowSettings(Settings):
    """Snow that lies, and snow that falls."""

    depth: _Depth | None = Field(
        None, description="of the snow that lies, such as 3 cm; 0 to 1 m; default none"
    )
    roads: SnowyRoads | None = Field(
        None, description="cleared, tracked by wheels or covered; default tracked"
    )
    falling: _Snowfall | None = Field(
        None, description="how much falls, as water, such as 1 mm/h; 0 to 20 mm/h; default none"
    )


class WindSettings(Settings):
    """Air that moves."""

    speed: _WindSpeed = Field(description="ten metres above the ground, such as 5 m/s; 0 to 40 m/s")
    bearing: Turn | None = Field(
        None,
        alias="from",
        description="where it comes from, clockwise from north [deg]; default 270, the west",
    )


class WeatherMoment(Settings):
    """The weather of a moment; numbers are interpolated between moments that give them."""

    time: Seconds = Field(description="SUMO's time [s]")
    fog: FogSettings | None = Field(None, description="as `weather.fog`")
    rain: RainSettings | None = Field(None, description="as `weather.rain`")
    wetness: _Share | None = Field(None, description="as `weather.wetness`")
    puddles: _Share | None = Field(None, description="as `weather.puddles`")
    snow: SnowSettings | None = Field(None, description="as `weather.snow`")
    wind: WindSettings | None = Field(None, description="as `weather.wind`")


class WeatherSettings(Settings):
    """The weather."""

    preset: str | None = Field(
        None, description="a name from `scene_templates/weather`; keys beside it win"
    )
    fog: FogSettings | None = Field(None, description="droplets in the air")
    rain: RainSettings | None = Field(None, description="drops that fall")
    wetness: _Share | None = Field(
        None, description="of what lies under the sky; default 1 where it rains, else 0"
    )
    puddles: _Share | None = Field(
        None, description="share of low places that are flooded; default half of the wetness"
    )
    snow: SnowSettings | None = Field(None, description="snow that lies or falls")
    wind: WindSettings | None = Field(None, description="moves leaves, boughs, rain and snow")
    windscreen: bool | None = Field(
        None,
        description="drops and wipers on the pane that rides look through in rain; default yes",
    )
    season: Season = Field("summer", description="what leaves and grass look like")
    course: tuple[WeatherMoment, ...] = Field(
        (), max_length=MOST_ENTRIES, description="weather that changes, by SUMO's time"
    )

    @model_validator(mode="after")
    def _forward(self) -> WeatherSettings:
        """Refuse moments that are not in order."""
        if any(later.time <= earlier.time for earlier, later in pairwise(self.course)):
            raise ValueError("the moments of a course follow each other in time")
        return self
