"""National habits of markings, signals and signs, from `assets/road_styles`.

What differs from country to country stands in one table for each style; what a shape looks like
stands in the code that draws it (`national`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.model.network import Location, Network

CrossDesign = Literal["red_ends", "red_border", "lettered"]
"""How the boards of a St Andrew's cross are painted."""

LineColour = Literal["white", "yellow"]
"""Colour of paint."""

AUTO = "auto"
"""The word that lets the network choose its style."""

_STATES = (
    # west, south, east, north [deg]: the lower United States, Alaska, and Canada above them
    (-125.0, 24.5, -66.9, 49.0),
    (-170.0, 51.0, -130.0, 72.0),
    (-141.0, 49.0, -52.0, 84.0),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class CentreLine(RecipeValue):
    """The line between opposite directions.

    Attributes:
        colour: Of its paint.
        solid: Where it is two solid lines: on `wide_roads` of three lanes and more, or `always`.
    """

    colour: LineColour
    solid: Literal["wide_roads", "always"]


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeLine(RecipeValue):
    """The solid lines along a carriageway.

    Attributes:
        outer: Colour on the kerb's side.
        inner: Colour on the side of a median.
    """

    outer: LineColour
    inner: LineColour


@dataclass(frozen=True, slots=True, kw_only=True)
class GiveWayLine(RecipeValue):
    """What lies across a lane that gives way.

    Attributes:
        shape: Blocks side by side, triangles that point at the driver, or two rows of dashes.
        depth: Along the lane [m].
        width: Of each piece, across the lane [m].
        gap: Between pieces [m].
    """

    shape: Literal["blocks", "triangles", "two_lines"]
    depth: float
    width: float
    gap: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossingPaint(RecipeValue):
    """How crossings of people on foot are painted.

    Attributes:
        signalled: At traffic lights: bars along the road, two lines across it, or studs.
        unsignalled: Where people have priority.
        bar: Width of bars and of the gaps between them [m].
    """

    signalled: Literal["bars", "lines", "studs"]
    unsignalled: Literal["bars", "lines", "studs"]
    bar: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BusLanePaint(RecipeValue):
    """What is written on bus lanes.

    Attributes:
        word: The text; drivers read its words from the nearest to the farthest.
        height: Of letters along the lane [m].
        every: Distance of repetitions [m].
        colour: Of the paint.
    """

    word: str
    height: float
    every: float
    colour: LineColour


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalStyle(RecipeValue):
    """What traffic lights look like and where they stand.

    Attributes:
        housing: Colour of the housings of vehicles' heads.
        border: Of the board behind them.
        far_side: When a head stands beyond the junction, too.
    """

    housing: Literal["black", "yellow"]
    border: Literal["white", "none"]
    far_side: Literal["when_hidden", "always", "never"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SignStyle(RecipeValue):
    """What traffic signs look like.

    Attributes:
        limit: A speed limit is a round sign with a red ring, or a white panel with words.
        unit: Of speed limits.
        give_way: What is written on the triangle that tells drivers to give way; may be empty.
        priority: Whether a yellow diamond tells drivers that they go first.
    """

    limit: Literal["ring", "panel"]
    unit: Literal["km/h", "mph"]
    give_way: str
    priority: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadStyle(RecipeValue):
    """A country's habits.

    Attributes:
        centre: Line between opposite directions.
        edge: Lines along a carriageway.
        stop_line: Its length along the lane [m].
        give_way: What lies across a lane that gives way.
        crossing: Paint of crossings.
        bicycle_surface: Surface of bicycle lanes; an asset's name.
        bus_lane: What is written on bus lanes.
        signals: Traffic lights.
        signs: Traffic signs.
        st_andrews_cross: The cross at level crossings.
    """

    centre: CentreLine
    edge: EdgeLine
    stop_line: float
    give_way: GiveWayLine
    crossing: CrossingPaint
    bicycle_surface: str
    bus_lane: BusLanePaint
    signals: SignalStyle
    signs: SignStyle
    st_andrews_cross: CrossDesign


@dataclass(frozen=True, slots=True, kw_only=True)
class _StyleFile(AssetFile):
    """Content of an `asset.yaml` with a style."""

    kind: Literal["road_style"]
    recipe: RoadStyle


STYLES: Mapping[str, RoadStyle] = {
    name: file.recipe for name, file in read_family("road_styles", _StyleFile).items()
}
"""All styles by the names that users choose."""


def style_name(name: str, network: Network) -> str:
    """Return the name of a network's style; a name other than `auto` is returned as it is.

    Left-hand traffic is british, networks in the United States and Canada are american,
    and all others are european.
    """
    if name != AUTO:
        return name
    if network.left_hand:
        return "british"
    return "american" if _in_north_america(network.location) else "european"


def road_style(name: str, network: Network) -> RoadStyle:
    """Return a style by its name, or with `auto` that of the network's place."""
    return STYLES[style_name(name, network)]


def _in_north_america(location: Location) -> bool:
    """Whether a network whose place is known lies there."""
    if location.place is None:
        return False
    y, x = location.place
    return any(w <= x <= e and s <= y <= n for w, s, e, n in _STATES)
