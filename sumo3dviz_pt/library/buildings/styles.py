"""Building models by name, from `assets/buildings`: designs with sizes and colours to draw from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.library.buildings.build import raised, rectangle
from sumo3dviz_pt.library.buildings.design import Design
from sumo3dviz_pt.library.buildings.lights import Use
from sumo3dviz_pt.library.buildings.palettes import Coat, Colours, coats
from sumo3dviz_pt.library.buildings.shell import Shell

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

    designs: tuple[Design, ...]
    width: Span
    depth: Span
    height: Span
    colours: Colours
    variants: int = 5

    def build(self, seed: int, level: int) -> Shell:
        """Build the shell of a variant at a level of detail, its front at +x."""
        rng = np.random.default_rng(seed)
        width, depth, height = (
            float(rng.uniform(*s)) for s in (self.width, self.depth, self.height)
        )
        design = self.designs[int(rng.integers(len(self.designs)))]
        return raised(rectangle(depth, width), design, height=height, level=level, seed=seed)


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
    designs: tuple[Design, ...]
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
    found = {}
    for name, file in _FILES.items():
        try:
            found[name] = file.recipe.style()
        except ConfigError as error:
            raise ConfigError(str(error), key=f"buildings/{name}") from None
    return found


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
