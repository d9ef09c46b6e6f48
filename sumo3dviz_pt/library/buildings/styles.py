"""Buildings by style: over any footprint, and in closed rows along a street.

Styles are read from `assets/buildings`: designs with sizes and colours to draw from. The outline of
a footprint tells which style suits it.

Closed rows stand along a building line, which runs with its land on the left. Neighbours share a
party wall at a right angle to the line; a house at a corner keeps its whole corner, with a wing on
each side.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.library.buildings.building import (
    BuildingDesign,
    RoofKind,
    Walls,
    below_roof,
    raised,
    rectangle,
)
from sumo3dviz_pt.library.buildings.palettes import Coat, Colours, Use, coats
from sumo3dviz_pt.library.buildings.shell import Shell
from sumo3dviz_pt.library.buildings.shop_words import UNTOLD, Writing
from sumo3dviz_pt.model.geometry import Bools, Floats, arc_length, settled

Span = tuple[float, float]
"""From and to."""

BuildingKind = Literal["home", "shop", "block", "row", "shed"]
"""What a building is: homes, shops and blocks can be chosen by model; rows are closed streets."""

Footprint = Literal[
    "shed", "low_house", "house", "long_house", "wide", "large", "block", "long_block", "tower"
]
"""Sorts of footprints by size, shape and height; `footprint.footprint_of` tells them apart."""


@dataclass(frozen=True, slots=True)
class BuildingStyle:
    """A kind of building with its sizes and colours.

    Attributes:
        designs: To draw from.
        width: Of the front [m].
        depth: [m].
        height: Of the walls [m].
        colours: To draw from.
        variants: How many shells are told apart.
    """

    designs: tuple[BuildingDesign, ...]
    width: Span
    depth: Span
    height: Span
    colours: Colours
    variants: int = 5

    @property
    def has_shops(self) -> bool:
        """Whether words may be written on it."""
        return any(design.foot in ("shops", "band") for design in self.designs)

    def build(self, seed: int, level: int, writing: Writing = UNTOLD) -> Shell:
        """Build the shell of a variant at a level of detail, its front at +x."""
        rng = np.random.default_rng(seed)
        width, depth, height = (
            float(rng.uniform(*s)) for s in (self.width, self.depth, self.height)
        )
        design = self.designs[int(rng.integers(len(self.designs)))]
        plan, walls = rectangle(depth, width), Walls(writing=writing)
        return raised(plan, design, height=height, level=level, seed=seed, walls=walls)


@dataclass(frozen=True, slots=True)
class RowStyle:
    """A style of houses in closed rows.

    Attributes:
        style: How they look.
        share: How usual it is, against the shares of the others.
        corners: Whether it suits corner houses, whose plans have wings.
    """

    style: BuildingStyle
    share: float
    corners: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class _StyleRecipe(RecipeValue):
    """What a style is made from; sizes, designs and variants as those of `BuildingStyle`.

    Attributes:
        walls: Palettes, coats of one, or coats of its own.
        roofs: Such of slopes and decks.
        use: What the building is for.
    """

    width: Span
    depth: Span
    height: Span
    walls: tuple[str | Coat, ...]
    roofs: tuple[str | Coat, ...]
    designs: tuple[BuildingDesign, ...]
    use: Use = "home"
    variants: int = 5

    def style(self) -> BuildingStyle:
        """Make the style, with its colours looked up."""
        colours = Colours(coats(self.walls), coats(self.roofs), self.use)
        return BuildingStyle(
            self.designs, self.width, self.depth, self.height, colours, self.variants
        )


@dataclass(frozen=True, slots=True)
class _InRows(RecipeValue):
    """How usual a style is in closed rows; as in `RowStyle`."""

    share: float
    corners: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class _BuildingFile(AssetFile):
    """Content of the `asset.yaml` of a building.

    Attributes:
        model: What users call it among its kind; None for the folder's name.
        footprints: The sorts of footprints that it suits, and how usual it is there.
        rows: Whether, and how often, it stands in closed rows.
    """

    kind: BuildingKind
    recipe: _StyleRecipe
    model: str | None = None
    footprints: Mapping[Footprint, int] = field(default_factory=dict)
    rows: _InRows | None = None


_FILES = read_family("buildings", _BuildingFile)


def _styles() -> dict[str, BuildingStyle]:
    """Make the styles of all files, by folder."""
    styles = {}
    for name, file in _FILES.items():
        try:
            styles[name] = file.recipe.style()
        except ConfigError as error:
            raise ConfigError(str(error), key=f"buildings/{name}") from None
    return styles


_STYLES = _styles()


def _models(kind: BuildingKind) -> dict[str, BuildingStyle]:
    """Return the styles of a kind by the names that users give."""
    some = {name: file for name, file in _FILES.items() if file.kind == kind}
    return {file.model or name: _STYLES[name] for name, file in some.items()}


def _suiting(footprint: Footprint) -> tuple[BuildingStyle, ...]:
    """Return the styles for a sort of footprints, usual ones first and more than once."""
    some = [(file.footprints.get(footprint, 0), name) for name, file in _FILES.items()]
    usual = sorted(some, key=lambda item: -item[0])
    return tuple(_STYLES[name] for count, name in usual for _ in range(count))


HOMES: Mapping[str, BuildingStyle] = _models("home")
"""Family houses by model."""

SHOPS: Mapping[str, BuildingStyle] = _models("shop")
"""Shops by model."""

BLOCKS: Mapping[str, BuildingStyle] = _models("block")
"""Apartment and office blocks by model."""

ROWS: tuple[RowStyle, ...] = tuple(
    RowStyle(_STYLES[name], file.rows.share, file.rows.corners)
    for name, file in _FILES.items()
    if file.rows is not None
)
"""Styles of houses in closed rows."""

SUITING: Mapping[str, tuple[BuildingStyle, ...]] = {
    name: _suiting(name) for name in get_args(Footprint)
}
"""Styles for each sort of footprints, the usual ones more than once."""


_SMALL, _HOME, _LARGE = 30.0, 240.0, 1100.0  # areas of sheds, of homes, of halls [m2]
_LOW, _BLOCK, _TOWER = 4.0, 9.0, 24.0  # heights of one storey, of blocks, of towers [m]


def cleaned(shape: Floats, *, tolerance: float = 0.25) -> Floats | None:
    """Trace the outline of a footprint, counter-clockwise without repeats, (n, 2) [m].

    Args:
        shape: (n, 2) [m], closed or not, crossing itself or not.
        tolerance: Smaller corners are cut [m].

    Returns:
        None if less than 6 m2 are left.
    """
    if len(shape) < 3:
        return None
    valid = shapely.make_valid(Polygon(settled(shape[:, :2])))
    parts = [p for p in shapely.get_parts(valid).tolist() if p.geom_type == "Polygon"]
    if not parts:
        return None
    largest = max(parts, key=lambda part: float(part.area)).simplify(tolerance)
    if largest.area < 6.0 or largest.buffer(-0.3).is_empty:
        return None
    corners: Floats = shapely.get_coordinates(shapely.orient_polygons(largest).exterior)[:-1]
    # Simplifying keeps a ring's two ends, even where they coincide.
    apart: Floats = corners[np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) > 0.05]
    return apart if len(apart) > 2 else None


def style_for(
    plan: Floats, height: float, *, share: float, roof: RoofKind | None = None
) -> BuildingStyle:
    """Choose a style that suits a footprint.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls [m].
        share: In [0, 1); chooses among those that suit.
        roof: Which its designs have; default any.
    """
    fits = SUITING[footprint_of(plan, height)]
    if roof is None:
        return fits[int(share * len(fits))]
    roofed = [style for style in fits if any(each.roof == roof for each in style.designs)] or fits
    style = roofed[int(share * len(roofed))]
    own = tuple(each for each in style.designs if each.roof == roof)
    made = (
        replace(each, roof=roof, pitch=_SLIGHT if roof == "skillion" else each.pitch)
        for each in style.designs
    )
    return replace(style, designs=own or tuple(made))


def ended_at(
    style: BuildingStyle, plan: Floats, top: float, *, seed: int, rise: float | None = None
) -> tuple[BuildingStyle, float]:
    """Return a style of one design whose roof ends at a height, and the height of its walls [m].

    Args:
        style: Gives the design.
        plan: Counter-clockwise corners, (n, 2) [m].
        top: Of its roof [m].
        seed: As for `extruded`; chooses the same design.
        rise: Of the roof [m]; default as the design has it.
    """
    design, height = below_roof(plan, style.designs[seed % len(style.designs)], top, rise=rise)
    return replace(style, designs=(design,)), height


def footprint_of(plan: Floats, height: float) -> Footprint:
    """Tell what sort of footprint a plan, (n, 2) [m], is under walls of a height [m]."""
    polygon = Polygon(plan)
    if polygon.area < _SMALL:
        return "shed"
    around = polygon.minimum_rotated_rectangle
    corners = shapely.get_coordinates(around.exterior)
    sides = np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1))
    slender, boxy = float(sides[1] / sides[0]), polygon.area > 0.8 * around.area
    if height >= _BLOCK:
        return "tower" if height > _TOWER else "long_block" if slender > 2.5 else "block"
    return _low_footprint(polygon.area, height, slender if boxy else 0.0)


def _low_footprint(area: float, height: float, slender: float) -> Footprint:
    """Tell what sort a low footprint is; slender is 0 for those that are no rectangles."""
    if area > _LARGE:
        return "large"
    if area > _HOME or not slender:
        return "wide"
    if height < _LOW:
        return "low_house"
    return "long_house" if slender > 1.9 else "house"


_SLIGHT = 0.2  # pitch of a roof of one slope [rad]
_UNKNOWN = Walls(fronts=())


def extruded(
    plan: Floats,
    height: float,
    *,
    level: int,
    seed: int,
    style: BuildingStyle,
    walls: Walls = _UNKNOWN,
) -> Shell:
    """Raise a building over a footprint.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls above the ground [m].
        level: Level of detail.
        seed: Of all chance.
        style: Says which designs it may have.
        walls: What they look at and say; without fronts, the longest one stands at a street.
    """
    design: BuildingDesign = style.designs[seed % len(style.designs)]
    if not walls.fronts:
        after = np.roll(plan, -1, axis=0)
        longest = int(np.argmax(settled(np.linalg.norm(after - plan, axis=1))))
        walls = replace(walls, fronts=(longest,))
    return raised(plan, design, height=height, level=level, seed=seed, walls=walls)


_CORNER = np.radians(28.0)  # a sharper turn is a corner
_BEND = np.radians(4.0)  # a slighter turn is none
_JOINED = 9.0  # turns closer together belong to one corner [m]
_WING = 3.5  # what a corner house has beyond its neighbours' depth [m]
_CLEAR, _WALL = 0.5, 13.5  # distance of party walls from bends, and their length [m]
_USUAL, _LEAST = 15.5, 8.0  # widths of houses [m]
_SPREAD = 0.22  # of party walls around even ones, as a share of a width
_STEP = 2.0  # between tested points of a line [m]

Share = Callable[[Floats, str], float]
"""A number in [0, 1) for a place, (2,) [m], and a word."""


@dataclass(frozen=True, slots=True, eq=False)
class Lot:
    """The front of one house.

    Attributes:
        line: Its front, with the house on the left, (n, 2) [m].
        corner: Whether it stands at a corner.
        joined: Whether another lot begins where it begins, and where it ends.
    """

    line: Floats
    corner: bool
    joined: tuple[bool, bool] = (True, True)

    def plan(self, depth: float) -> Floats | None:
        """Return the counter-clockwise corners of a house, front walls first, or None without room.

        Args:
            depth: From the front to the back [m].
        """
        back = shapely.LineString(self.line).offset_curve(depth, join_style="mitre")
        if back.geom_type != "LineString" or back.is_empty:
            return None
        inner = shapely.get_coordinates(back)
        ends = self.line[[0, -1]]
        # Where a wing is shorter than the house is deep, the offset has lost its end.
        if np.abs(np.linalg.norm(inner[[0, -1]] - ends, axis=1) - depth).max() > 0.3:
            return None
        plan = np.concatenate([self.line, inner[::-1]])
        return plan if shapely.Polygon(plan).is_valid else None


def lots_along(
    line: Floats, fit: Callable[[Floats], Bools], *, depth: float, share: Share
) -> list[Lot]:
    """Divide a building line into lots.

    Args:
        line: (n, 2) [m], its land on the left; closed if its ends coincide.
        fit: Which places, (m, 2) [m], may bear a front.
        depth: Of houses at corners [m].
        share: Says where party walls stand around even places.

    Returns:
        Lots in order, without those that are narrower than a house.
    """
    line = _from_a_corner(settled(_straightened(line)))
    knots = arc_length(line)
    corners = _corners(line, knots, depth)
    lots: list[Lot] = []
    for begin, end in _runs(line, knots, fit):
        cuts = _cuts(line, knots, (begin, end), corners, share)
        for number, (a, b) in enumerate(pairwise(cuts)):
            corner = any(a < (low + high) / 2 < b for low, high in corners)
            lots.append(
                Lot(_piece(line, knots, a, b), corner, (number > 0, number < len(cuts) - 2))
            )
    return [lot for lot in lots if arc_length(lot.line)[-1] > _LEAST - 1.5]


def _cuts(
    line: Floats,
    knots: Floats,
    run: tuple[float, float],
    corners: Sequence[tuple[float, float]],
    share: Share,
) -> list[float]:
    """Choose where party walls stand along a run, its ends included [m]."""
    begin, end = run
    inside = [(a, b) for a, b in corners if a >= begin - 0.1 and b <= end + 0.1]
    # A corner at the end of a run has no room for its second wing.
    for a, b in corners:
        if (a, b) not in inside and b > begin and a < end:
            if a < begin:
                begin = min(b, end)
            else:
                end = max(a, begin)
    places = [begin]
    for low, high in [*inside, (end, end)]:
        places += _even(_at(line, knots, places[-1]), places[-1], low, share)
        places += [low, high] if high > low else []
    places.append(end)
    # A wall behind a bend to the left needs room, or backs would cross.
    room = _CLEAR + _WALL * np.tan(np.clip(_turns(line), 0.0, 1.2) / 2)
    cuts = [places[0]]
    for cut in places[1:]:
        near = np.flatnonzero(np.abs(knots[1:-1] - cut) < room)
        if len(near) and begin < cut < end:
            cut = float((knots[1:-1] + room)[near[0]])
        if cut > cuts[-1] + 0.5:
            cuts.append(cut)
    return cuts


def _even(place: Floats, low: float, high: float, share: Share) -> list[float]:
    """Space party walls about evenly between two others [m]."""
    count = max(round((high - low) / _USUAL), 1)
    width = (high - low) / count
    return [
        low + width * (k + _SPREAD * (2.0 * share(place, f"cut{k}") - 1.0)) for k in range(1, count)
    ]


def _runs(line: Floats, knots: Floats, fit: Callable[[Floats], Bools]) -> list[tuple[float, float]]:
    """Find the stretches on which fronts may stand, as distances along the line [m]."""
    count = max(int(knots[-1] / _STEP), 1) + 1
    at = np.linspace(0.0, knots[-1], count)
    good = np.concatenate([[False], fit(_at(line, knots, at)), [False]])
    begins, ends = np.flatnonzero(~good[:-1] & good[1:]), np.flatnonzero(good[:-1] & ~good[1:]) - 1
    pairs = zip(at[begins].tolist(), at[ends].tolist(), strict=True)
    return [(a, b) for a, b in pairs if b - a > _LEAST]


def _corners(line: Floats, knots: Floats, depth: float) -> list[tuple[float, float]]:
    """Find the stretches that corner houses take, wings included, in order and apart [m]."""
    turns = _turns(line)
    groups: list[list[int]] = []
    for k in np.flatnonzero(turns > _BEND).tolist():
        if groups and knots[k + 1] - knots[groups[-1][-1] + 1] < _JOINED:
            groups[-1].append(k)
        else:
            groups.append([k])
    spans: list[tuple[float, float]] = []
    for group in groups:
        if turns[group].sum() < _CORNER:
            continue
        low, high = knots[group[0] + 1] - depth - _WING, knots[group[-1] + 1] + depth + _WING
        if spans and low < spans[-1][1]:  # two corners of a narrow block
            middle = (low + spans[-1][1]) / 2
            spans[-1], low = (spans[-1][0], middle), middle
        spans.append((max(float(low), 0.0), min(float(high), float(knots[-1]))))
    return [(a, b) for a, b in spans if b > a]


def _from_a_corner(line: Floats) -> Floats:
    """Let a closed line begin in the middle of its longest side; leave an open one as it is."""
    if len(line) < 4 or np.linalg.norm(line[0] - line[-1]) > 1e-6:
        return line
    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    k = int(np.argmax(settled(step)))
    middle = (line[k] + line[k + 1]) / 2
    return np.concatenate([[middle], line[k + 1 : -1], line[: k + 1], [middle]])


def _straightened(line: Floats) -> Floats:
    """Drop bends of a line that are too slight to be seen, (m, 2)."""
    simple = shapely.get_coordinates(shapely.LineString(line).simplify(0.5))
    keep = np.append(True, np.linalg.norm(np.diff(simple, axis=0), axis=1) > 0.05)
    return np.asarray(simple[keep])


def _turns(line: Floats) -> Floats:
    """Return the turns to the left at the inner vertices, (n - 2,) [rad]."""
    step = np.diff(line, axis=0)
    angle = np.arctan2(step[:, 1], step[:, 0])
    return np.asarray((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)


def _at(line: Floats, knots: Floats, at: Floats | float) -> Floats:
    """Return the places at distances along a line, (m, 2) or (2,)."""
    return settled(np.stack([np.interp(at, knots, column) for column in line.T], axis=-1))


def _piece(line: Floats, knots: Floats, a: float, b: float) -> Floats:
    """Cut out the piece of a line between two distances along it, (n, 2)."""
    inner = line[(knots > a + 0.05) & (knots < b - 0.05)]
    return np.concatenate([_at(line, knots, a)[None], inner, _at(line, knots, b)[None]])
