"""Land covers and the types of polygons that mean them, from `assets/areas`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from typing import Literal

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_asset
from sumo3dviz_pt.model.geometry import Colour

FAMILY, _ASSET = "areas", "land_cover"

WATER = "water"
"""The cover that is cut into the ground."""

AS_IS = "as_is"
"""The cover of types that leave the ground as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cover(RecipeValue):
    """What the ground looks like, and what grows on it.

    Attributes:
        surface: A surface's name; `water`, or `ground` for the ground as it is.
        colours: Mean linear reflectances, one of which an area gets by chance; none leaves
            the surface's own.
        blades: Of grass near cameras.
        pattern: What is drawn on it.
        trees: On a hectare.
        shrubs: On a hectare.
        species: Of its trees, with weights.
    """

    surface: str
    colours: tuple[Colour, ...] = ()
    blades: Literal["none", "mown", "tall"] = "none"
    pattern: Literal["bays", "pitch", "court", "tramlines", "vines", "paths", "graves"] | None = (
        None
    )
    trees: float = 0.0
    shrubs: float = 0.0
    species: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeRow(RecipeValue):
    """A type of polygons and its cover.

    Attributes:
        type: A pattern of lower-case types; `*` and `?` are wildcards.
        cover: The cover's name.
        width: Of lines of this type [m]; lines of other types cover nothing.
        line: Cover of lines, where it is another one.
    """

    type: str
    cover: str
    width: float | None = None
    line: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Waves(RecipeValue):
    """A tile of small waves.

    Attributes:
        filename: Normals of the waves, a picture.
        tile: Width of the picture [m].
    """

    filename: str
    tile: float


@dataclass(frozen=True, slots=True, kw_only=True)
class WaterLook(RecipeValue):
    """How water looks and lies.

    Attributes:
        colour: Linear reflectance of what is seen below its surface.
        roughness: [0, 1].
        specular: Strength of the reflection.
        waves: Their tile.
        depth: How far the surface lies below the ground beside it [m].
        bank: Width of the bank [m].
    """

    colour: Colour
    roughness: float
    specular: float
    waves: Waves
    depth: float
    bank: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LandCovers(RecipeValue):
    """All covers, and the types that mean them.

    Attributes:
        water: How water looks.
        covers: By name.
        types: The first row that fits a type decides.
    """

    water: WaterLook
    covers: Mapping[str, Cover]
    types: Sequence[TypeRow]

    def row_of(self, type_: str) -> TypeRow | None:
        """Return the row of a polygon's type, or None for a type that no row fits."""
        word = type_.strip().lower().replace("=", ".")
        return next((row for row in self.types if fnmatchcase(word, row.type)), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class _LandCoverFile(AssetFile):
    """Content of the `asset.yaml`."""

    kind: Literal["land_cover"]
    recipe: LandCovers


@cache
def land_covers() -> LandCovers:
    """Return the covers that come with the package.

    Raises:
        ConfigError: If the file has an unknown key, or lacks one.
    """
    return read_asset(FAMILY, _ASSET, _LandCoverFile).recipe


def waves_file() -> str:
    """Return where the picture of waves lies."""
    folder = catalog.find(FAMILY, _ASSET).folder
    return str(folder / land_covers().water.waves.filename)
