"""Settings of what is around cameras: weather, objects, tables of traffic, its changes, sound.

Weather is physical quantities, each left out where it is absent. Static objects are trees, fences,
buildings. Tables of other tools tell traffic by their columns. Recorded traffic is changed in
single rides, and in how many there are. Sound tracks are for tools of auralisation, and for the
sound that is made here.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from sumo3dviz_pt.job.values import (
    MOST_ENTRIES,
    File,
    Finite,
    HexColour,
    Names,
    OneOrMoreFiles,
    OneOrMoreNames,
    Positive,
    Quantity,
    Seconds,
    Settings,
    Turn,
    Whole,
)
from sumo3dviz_pt.model.numbers import TablePoint, TableRole, TableUnit

if TYPE_CHECKING:
    from sumo3dviz_pt.model.traffic import TableChoices


class ObjectSettings(Settings):
    """Static objects of one kind, from POIs or polygons."""

    file: File | None = Field(None, description="default: by the POI's or polygon's type")
    model: OneOrMoreNames = Field((), description="models to draw from; default all")
    scale: Finite = Field(1.0, ge=0.01, le=20, description="mean size factor")
    variation: Finite = Field(0.2, ge=0, lt=1, description="relative spread of sizes")
    colour: HexColour | None = Field(None, description="#rrggbb; default seeded, natural")


class ObjectsSettings(Settings):
    """Static objects by kind."""

    trees: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    shrubs: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    hedges: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    fences: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    homes: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    shops: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    blocks: ObjectSettings | None = Field(ObjectSettings(), description="null leaves them out")
    buildings: ObjectSettings | None = Field(ObjectSettings(), description="building polygons")
    detectors: bool = Field(
        False, description="whether loops of the scenario's detectors show in the asphalt"
    )
    triangles: Whole | None = Field(
        None,
        ge=10_000,
        le=2_000_000,
        description="of each kind, about: what is far is coarser; by default all kinds share what"
        " roads and street furniture leave; studies have 200000",
    )


MOST_DELAY = 120.0
"""Most by which a ride may be moved in time [s]; so much more of the log is read."""

_Delay = Annotated[float, Quantity("s", -MOST_DELAY, MOST_DELAY)]
_Gap = Annotated[float, Quantity("s", 0.0, 60.0)]


class RideEdit(Settings):
    """Another time or pace of a recorded ride, along the path that it took."""

    delay: _Delay | None = Field(
        None, description="how much later it comes by everywhere, such as 0.8 s; earlier below 0"
    )
    behind: str | None = Field(None, description="id of the road user that it follows")
    gap: _Gap | None = Field(
        None,
        description="time from the rear of `behind` to its own front, such as 1.5 s, where that"
        " rear is `at`",
    )
    at: Seconds | None = Field(None, description="SUMO's time at which the gap is kept [s]")
    moves: Literal["auto", "self", "behind"] = Field(
        "auto",
        description="who is moved in time for the gap: the ride itself, or `behind`, the one ahead;"
        " auto moves the one ahead where a camera rides with this one, so that its drive stays",
    )
    pace: Finite | None = Field(
        None, ge=0.5, le=2.0, description="factor of its speed; where it is at `around` it stays"
    )
    around: Seconds | None = Field(None, description="SUMO's time that `pace` leaves as it is [s]")

    @model_validator(mode="after")
    def _one_way(self) -> RideEdit:
        """Ask for a delay or a gap, and for all that a gap and a pace need."""
        gap = (self.behind, self.gap, self.at)
        if any(value is not None for value in gap) and None in gap:
            raise ValueError("a gap needs behind, gap and at")
        if self.gap is not None and self.delay is not None:
            raise ValueError("give either delay or gap")
        if self.gap is None and self.moves != "auto":
            raise ValueError("`moves` says who is moved for a gap: it needs behind, gap and at")
        if (self.pace is None) != (self.around is None):
            raise ValueError("a pace needs around, and around a pace")
        if self.gap is None and self.delay is None and self.pace is None:
            raise ValueError("give delay, gap or pace")
        return self


class ColumnSettings(Settings):
    """A column of a table of trajectories."""

    column: str = Field(description="its name in the table")
    unit: TableUnit | None = Field(
        None, description="what its numbers are in; default what its values tell"
    )
    zero: Literal["east", "north"] | None = Field(
        None, description="where an angle of 0 points; default what motion tells"
    )
    turn: Literal["left", "right"] | None = Field(
        None, description="to which side angles grow; default what motion tells"
    )


class TableSettings(Settings):
    """Tables of trajectories that are no logs of SUMO."""

    file: OneOrMoreFiles = Field(description="text with any separator, or Parquet")
    columns: dict[TableRole, str | ColumnSettings] = Field(
        default_factory=dict,
        description="column by what it holds: its name, or a mapping; default what names tell",
    )
    point: TablePoint | None = Field(
        None, description="where on the body x and y are; default centre, or the data set's"
    )
    downwards: bool | None = Field(
        None, description="y grows downwards, as in pictures; default the data set's, or false"
    )
    rate: Finite | None = Field(
        None, ge=0.01, le=1000, description="frames in a second; default the data set's, or 25 [Hz]"
    )
    classes: dict[str, str] = Field(
        default_factory=dict,
        max_length=MOST_ENTRIES,
        description="vClass by the table's word or number for a class",
    )

    def __hash__(self) -> int:
        """Tell what differs apart, so that scenes can be keys."""
        return hash(self.model_dump_json())

    @property
    def choices(self) -> TableChoices:
        """How the tables are to be understood."""
        from sumo3dviz_pt.model.traffic import TableChoices, TableColumn

        columns: dict[str, TableColumn] = {
            role: TableColumn(own)
            if isinstance(own, str)
            else TableColumn(own.column, own.unit or "", own.zero or "", own.turn or "")
            for role, own in self.columns.items()
        }
        return TableChoices(columns, self.point or "", self.downwards, self.rate, self.classes)


class TrafficSettings(Settings):
    """What is changed of the recorded traffic."""

    rides: dict[str, RideEdit] = Field(
        default_factory=dict, max_length=MOST_ENTRIES, description="other times or paces, by id"
    )
    leave_out: Names = Field((), description="ids of road users that are not shown; * and ?")
    share: Finite = Field(
        1.0,
        ge=0.0,
        le=1.0,
        description="of vehicles that are shown, chosen by id and seed; a smaller share is part of"
        " a larger one; those that rides, cameras and by_id name stay",
    )


Playing = Literal["none", "stereo", "binaural", "ambisonics"]
"""What a film sounds like."""


class SoundSettings(Settings):
    """Tracks of everyone near the camera, for other tools; and sound that is made of them here."""

    radius: Positive = Field(
        150.0,
        le=2000,
        description="who comes as near to the camera has a track, and is heard [m]",
    )
    rate: Finite | None = Field(
        None,
        ge=1,
        le=1000,
        description="samples of tracks per second of film; default one for each frame",
    )
    play: Playing = Field(
        "none",
        description="sound of the film, beside it (WAV) and in it: stereo for loudspeakers,"
        " binaural for headphones, ambisonics for players that turn with the head; none has tracks"
        " only",
    )
    full_scale: Finite = Field(
        100.0,
        ge=60,
        le=160,
        description="sound pressure level that the largest sine of the recording stands for [dB]",
    )
    murmur: Finite | None = Field(
        35.0,
        ge=0,
        le=90,
        description="level of the steady murmur of a town around [dB(A)]; null is none",
    )
    soft_ground: Finite = Field(
        0.0,
        ge=0,
        le=1,
        description="share of ground between road and camera that swallows sound, such as grass",
    )


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
