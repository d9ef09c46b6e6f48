"""How the species of trees and shrubs grow: their habits as numbers, from `assets/plants`.

Habits, heights, bark and leaf arrangements are those of common European street trees, not of
old forest trees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.model.geometry import Colour


@dataclass(frozen=True, slots=True)
class Species(RecipeValue):
    """How a tree grows. Lengths are shares of its height, unless a unit is given.

    Attributes:
        height: Usual height [m].
        girth: Radius of the trunk at the ground.
        clear: Where the crown begins.
        reach: Length of the longest boughs.
        crown: Envelope of bough lengths at crown heights 0, 1/4, 1/2, 3/4, 1.
        rise: Angle between boughs and trunk, lowest and highest bough [rad].
        boughs: How many leave the trunk.
        leaf: Reflectance of the leaves.
        area: One-sided leaf area per squared height.
        bark: Reflectance of trunk and boughs.
        fork: Branches of a bough and twigs of a branch.
        bend: Upward bend of branches per step; negative droops.
        slender: Length of a leaf by its width.
        stray: How far leaves lie from their twig.
        turn: How far leaves turn away from their twig's direction.
        hang: How far leaves hang down.
        begin: Share of a twig, from its foot, that bears no leaves.
        top: Where the trunk ends.
        whorl: How many boughs leave the trunk at one height; 1 for spirals.
        flat: Whether boughs branch in a plane, as those of firs do.
        wobble: How crooked branches are.
        upper_bark: Reflectance of upper trunk and boughs, or None.
        marks: Share of dark marks on the bark.
        thick: Radius of a bough, by that of the trunk where it leaves it.
        autumn: Reflectance of the first and the last leaves of autumn.
        evergreen: Whether it keeps its leaves in winter.
        blossom: Reflectance of what hides most leaves in spring, or None.
        share: How often it is drawn where no species is chosen, against the shares of the others.
    """

    height: float
    girth: float
    clear: float
    reach: float
    crown: tuple[float, float, float, float, float]
    rise: tuple[float, float]
    boughs: int
    leaf: Colour
    area: float
    bark: Colour = (0.105, 0.083, 0.062)
    fork: tuple[int, int] = (7, 5)
    bend: float = 0.03
    slender: float = 1.6
    stray: float = 0.019
    turn: float = 0.8
    hang: float = 0.35
    begin: float = 0.2
    top: float = 0.9
    whorl: int = 1
    flat: bool = False
    wobble: float = 0.12
    upper_bark: Colour | None = None
    marks: float = 0.0
    thick: float = 0.5
    autumn: tuple[Colour, Colour] = ((0.34, 0.24, 0.035), (0.30, 0.12, 0.025))
    evergreen: bool = False
    blossom: Colour | None = None
    share: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _PlantFile(AssetFile):
    """Content of the `asset.yaml` of a plant."""

    kind: Literal["tree", "shrub"]
    recipe: Species


_FILES = read_family("plants", _PlantFile)

SPECIES: Mapping[str, Species] = MappingProxyType(
    {name: file.recipe for name, file in _FILES.items() if file.kind == "tree"}
)
"""Trees by name."""

SHRUBS: Mapping[str, Species] = MappingProxyType(
    {name: file.recipe for name, file in _FILES.items() if file.kind == "shrub"}
)
"""Shrubs by name."""
