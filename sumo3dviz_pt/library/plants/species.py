"""How the species of trees and shrubs grow, and what seasons do to them.

Habits are numbers, read from `assets/plants`. Habits, heights, bark and leaf arrangements are those
of common European street trees, not of old forest trees.

Seasons change the colours of leaves and grass, and bare the crowns. Autumn colours are those of
each species' `asset.yaml`; all others are factors on summer's, chosen by eye beside photographs of
central Europe. Winter is late January, spring late April, autumn mid October.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.model.geometry import Colour, Floats


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
    """Content of the `asset.yaml` of a plant.

    Attributes:
        planted: Where our code plants it, by the names that `urn` is asked for: its lots in the
            urn from which species are drawn there, each as its turn and its weight.
    """

    kind: Literal["tree", "shrub"]
    recipe: Species
    planted: Mapping[str, tuple[tuple[int, float], ...]] = field(default_factory=dict)


_FILES = read_family("plants", _PlantFile)

SPECIES: Mapping[str, Species] = MappingProxyType(
    {name: file.recipe for name, file in _FILES.items() if file.kind == "tree"}
)
"""Trees by name."""

SHRUBS: Mapping[str, Species] = MappingProxyType(
    {name: file.recipe for name, file in _FILES.items() if file.kind == "shrub"}
)
"""Shrubs by name."""


def urn(where: str) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Return the species that are drawn somewhere, with their weights, in the order of their turns.

    Args:
        where: Such as `alleys`; a species may have several lots.
    """
    lots = sorted(
        (turn, name, weight)
        for name, file in _FILES.items()
        for turn, weight in file.planted.get(where, ())
    )
    return tuple(name for _, name, _ in lots), tuple(weight for _, _, weight in lots)


_FRESH = np.array([1.22, 1.12, 0.85])  # spring's leaves, by summer's
_FROSTED = np.array([0.92, 0.80, 0.95])  # winter's needles
_FADED = np.array([1.35, 0.98, 0.72])  # autumn's grass
_BLEACHED = np.array([1.55, 1.0, 1.05])  # winter's grass
_HEDGE = np.array([1.15, 0.78, 0.80])  # winter's hedges and weeds
_TURNED = np.array([[0.30, 0.155, 0.028], [0.24, 0.085, 0.022], [0.33, 0.22, 0.035]])
_BARE = np.array([0.150, 0.126, 0.106])  # a wood without leaves from afar
_CONIFER = 0.115  # crowns that reflect less green than this from afar keep their needles

_GRASS = {"spring": _FRESH, "autumn": _FADED, "winter": _BLEACHED}


def bare(kind: Species, season: str) -> bool:
    """Return whether a plant has no leaves in a season."""
    return season == "winter" and not kind.evergreen


def leafy(kind: Species, season: str) -> Species:
    """Return how a plant's leaves grow in a season: small ones in spring, fewer in autumn."""
    if kind.evergreen or season not in ("spring", "autumn"):
        return kind
    return replace(kind, area=kind.area * (0.62 if season == "spring" else 0.72))


def twiggy(kind: Species) -> Species:
    """Return a plant whose leaves are what is left in winter: slender, upright twigs.

    From afar they veil the crown as twigs do, which are too thin to be built one by one.
    """
    colour = kind.upper_bark or kind.bark
    red, green, blue = (1.15 * channel for channel in colour)
    return replace(
        kind,
        leaf=(red, green, blue),
        area=0.18 * kind.area,
        slender=26.0,
        turn=0.42,
        hang=-0.25,
        stray=0.6 * kind.stray,
        begin=0.0,
    )


def leaf_tints(tint: Floats, kind: Species, season: str, *, chance: float) -> Floats:
    """Return the colours of one plant's leaves in a season.

    Args:
        tint: In summer, (n, 3).
        kind: Its species.
        season: Of the weather.
        chance: How far this plant has turned, in [0, 1).
    """
    if season == "summer" or bare(kind, season):
        return tint
    if kind.evergreen:
        return np.asarray(tint * (_FROSTED if season == "winter" else 1.0))
    if season == "spring":
        return _spring(tint, kind)
    # Leaves turn one by one, sooner where they are light; some trees are late.
    light = tint.mean(axis=1) / max(float(tint.mean()), 1e-6)
    ripple = np.modf(np.abs(np.sin(np.arange(len(tint)) // 2 * 12.9898) * 43758.5453))[0]
    turned = np.clip(0.35 + 0.75 * chance + 0.9 * (light - 1.0) + 0.7 * (ripple - 0.5), 0.0, 1.0)
    first, last = np.array(kind.autumn[0]), np.array(kind.autumn[1])
    hue = np.clip(0.15 + 0.8 * chance + 0.6 * (ripple - 0.5), 0.0, 1.0)[:, None]
    coloured = (first + hue * (last - first)) * light[:, None]
    return np.asarray(np.clip(tint + turned[:, None] * (coloured - tint), 0.004, 0.8))


def _spring(tint: Floats, kind: Species) -> Floats:
    """Return the colours of young leaves, and of blossoms among them."""
    fresh = np.clip(tint * _FRESH, 0.004, 0.8)
    if kind.blossom is None:
        return np.asarray(fresh)
    # A diamond of two triangles is one leaf or one blossom.
    some = np.modf(np.abs(np.sin(np.arange(len(tint)) // 2 * 78.233) * 43758.5453))[0] < 0.72
    return np.where(some[:, None], np.array(kind.blossom), fresh)


def grass_tints(tint: Floats, season: str) -> Floats:
    """Return the colours of blades, (n, 3), in a season."""
    return np.asarray(np.clip(tint * _GRASS.get(season, 1.0), 0.004, 0.8))


def grass_gain(season: str) -> Colour:
    """Return what a season multiplies a ground of grass with."""
    red, green, blue = np.broadcast_to(_GRASS.get(season, np.ones(3)), 3).tolist()
    return red, green, blue


def hedge_tints(tint: Floats, season: str) -> Floats:
    """Return the colours of hedges, (n, 3): they keep their leaves."""
    if season == "winter":
        return np.asarray(np.clip(tint * _HEDGE, 0.004, 0.8))
    return np.asarray(np.clip(tint * _FRESH, 0.004, 0.8)) if season == "spring" else tint


def far_tints(tint: Floats, season: str) -> Floats:
    """Return the colours of woods and rows of trees far away, (n, 3), which have no species."""
    if season == "spring":
        return np.asarray(np.clip(tint * _FRESH, 0.004, 0.8))
    if season == "summer":
        return tint
    # Neighbouring faces belong to one tree and so turn alike: their summer green is the same.
    broad = np.clip((tint[:, 1] - 0.5 * _CONIFER) / (0.5 * _CONIFER), 0.0, 1.0)[:, None]
    light = tint.mean(axis=1, keepdims=True) / max(float(tint.mean()), 1e-6)
    if season == "winter":
        return np.asarray(tint + 0.9 * broad * (_BARE * light - tint))
    pick = np.floor(997.0 * tint[:, 0] / np.maximum(tint[:, 1], 1e-6)).astype(np.int64) % 3
    return np.asarray(np.clip(tint + 0.7 * broad * (_TURNED[pick] * light - tint), 0.004, 0.8))
