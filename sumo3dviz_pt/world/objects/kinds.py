"""The kinds of static objects, in one table: names, costs, how finely they are drawn.

POIs and polygons are objects of the kind that they mean. How finely these are drawn depends on
their distance from the cameras. Lines and outlines may not be too long: they are built as a whole,
seen or not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.buildings.styles import BLOCKS, HOMES, SHOPS
from sumo3dviz_pt.library.materials import colour_of
from sumo3dviz_pt.library.plants.leaves import (
    HIDDEN,
    PAIRS,
    Direction,
    clumped,
    seen_shares,
    some_leaves,
)
from sumo3dviz_pt.library.plants.species import Species, bare, leaf_tints
from sumo3dviz_pt.library.plants.tree import SHRUBS, SPECIES, tree
from sumo3dviz_pt.library.street.barriers import MODELS as BARRIERS
from sumo3dviz_pt.model.geometry import Colour, Floats, Ints
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.placement.surroundings import Surroundings

TREE_VARIANTS = 4
"""How many crowns of a species are told apart."""

_WEIGHTS = {name: kind.share for name, kind in (*SPECIES.items(), *SHRUBS.items())}

_SEEN = 0.15  # share of a leaf that makes it count as seen

FENCES = ("guard_rail", *BARRIERS)
"""Models of fences; types of the same names choose them, any other type the first."""


@dataclass(frozen=True, slots=True)
class Space:
    """An upright cylinder around an object's middle.

    Attributes:
        radius: [m].
        bottom: Height above the ground [m].
        top: Height above the ground [m].
    """

    radius: float
    bottom: float
    top: float


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of static object.

    Attributes:
        name: Its key in `objects`, and its family.
        words: Values of `type` that mean it, in lower case.
        form: `point`, `line` or `area`: what places it.
        models: What users can choose from.
        levels: Distances at which the next coarser level of detail begins [m].
        cost: Usual triangles of each level (of 40 m of a line or of walls).
        space: Where a camera must not be; None if it may be anywhere.
    """

    name: str
    words: frozenset[str]
    form: str
    models: tuple[str, ...]
    levels: tuple[float, ...]
    cost: tuple[int, ...]
    space: Space | None = None


KINDS: tuple[Kind, ...] = (
    Kind(
        "trees",
        frozenset({"tree", "trees"}),
        "point",
        tuple(SPECIES),
        levels=(13.0, 38.0, 70.0, 120.0, 240.0),
        cost=(51_000, 11_200, 4700, 2150, 790, 280),
        space=Space(radius=3.2, bottom=1.5, top=9.0),
    ),
    Kind(
        "shrubs",
        frozenset({"shrub", "shrubs", "bush", "bushes"}),
        "point",
        tuple(SHRUBS),
        levels=(8.0, 18.0, 35.0, 60.0, 110.0),
        cost=(26_000, 6500, 2200, 1150, 370, 135),
        space=Space(radius=1.6, bottom=0.0, top=2.5),
    ),
    Kind(
        "hedges",
        frozenset({"hedge", "hedges"}),
        "line",
        (),
        levels=(14.0, 40.0, 120.0),
        cost=(40_000, 11_000, 2900, 700),
    ),
    Kind(
        "fences",
        frozenset({"fence", "fences", "guardrail", *FENCES}),
        "line",
        FENCES,
        levels=(70.0, 300.0),
        cost=(470, 180, 24),
    ),
    Kind(
        "homes",
        frozenset({"home", "homes", "house", "houses"}),
        "point",
        tuple(HOMES),
        levels=(110.0, 350.0),
        cost=(1000, 220, 80),
        space=Space(radius=7.5, bottom=0.0, top=10.0),
    ),
    Kind(
        "shops",
        frozenset({"shop", "shops", "store"}),
        "point",
        tuple(SHOPS),
        levels=(110.0, 350.0),
        cost=(620, 190, 65),
        space=Space(radius=9.5, bottom=0.0, top=7.5),
    ),
    Kind(
        "blocks",
        frozenset({"block", "blocks", "apartments"}),
        "point",
        tuple(BLOCKS),
        levels=(110.0, 350.0),
        cost=(6200, 1300, 380),
        space=Space(radius=12.0, bottom=0.0, top=32.0),
    ),
    Kind(
        "buildings",
        frozenset({"building", "buildings"}),
        "area",
        (),
        levels=(90.0, 300.0),
        cost=(2800, 560, 150),
    ),
)
"""Every kind of static object."""

INVENTED = "town"
"""The `source` of what is invented beside the roads of a network without polygons."""

PLANTS = frozenset({"trees", "shrubs"})
"""Kinds that grow: they stand turned at random and keep their shape at every size."""


def kind_of(type_: str, source: str) -> str | None:
    """Return the kind that a POI or polygon means: by its type, else by its file's name.

    Args:
        type_: SUMO's `type`; `building.house` counts as `building`.
        source: The file it came from, such as `buildings_homes.add.xml`.
    """
    word = type_.lower().split(".")[0].strip()
    by_type = next((kind.name for kind in KINDS if word in kind.words), None)
    if by_type or word not in ("", "unknown"):
        return by_type
    stem = source.replace("\\", "/").rsplit("/", maxsplit=1)[-1].lower().split(".")[0]
    # `buildings_homes` means homes, so the last word that fits counts.
    for part in reversed(stem.replace("-", "_").split("_")):
        for kind in KINDS:
            if part in kind.words:
                return kind.name
    return None


@dataclass(frozen=True, slots=True)
class Plant:
    """A plant, whose crown and colour its name chooses.

    Attributes:
        kind: One of `PLANTS`.
        settings: Checked ones.
        seed: Of all chance.
        name: Unique among all objects.
        level: Of detail.
        season: What its leaves look like.
    """

    kind: Kind
    settings: ObjectSettings
    seed: int
    name: str
    level: int
    season: str = "summer"

    @property
    def bare(self) -> bool:
        """Whether it has no leaves."""
        return bare(_species(self.crown[0]), self.season)

    @property
    def crown(self) -> tuple[str, int, int, str]:
        """Its species, which of the crowns of that it has, the level of detail, the season."""
        variant = int(share_of(self.seed, self.name, "variant") * TREE_VARIANTS)
        species = drawn_model(self.kind, self.settings, self.seed, self.name)
        return species, variant, self.level, self.season


def body_of(plant: Plant) -> tuple[Part, ...]:
    """Return bark and leaves of a plant in its own frame."""
    bark, leaves = _tree(*plant.crown)
    return bark, replace(leaves, tint=leaf_tint(leaves, plant))


def seen_body(plant: Plant, eyes: Sequence[Direction]) -> tuple[tuple[Part, ...], tuple[Part, ...]]:
    """Return the parts of a plant that cameras see, and the clumps that its other leaves become.

    Args:
        plant: Not of the finest level.
        eyes: Directions of all cameras that picture it, in its own frame.
    """
    bark, leaves = body_of(plant)
    assert leaves.tint is not None
    shares = np.zeros(len(leaves.mesh.faces))
    for eye in eyes:
        shares = np.maximum(shares, _seen_leaves(*plant.crown, eye))
    seen, hidden = shares >= _SEEN, shares <= 0.0
    clumps = []
    for some, way in ((~seen & ~hidden, PAIRS), (hidden, HIDDEN[plant.level])):
        if some.any():
            mesh, tint = clumped(some_leaves(leaves.mesh, some), leaves.tint[some], way)
            clumps.append(Part(mesh, leaves.material, tint))
    if not seen.any():
        return (bark,), tuple(clumps)
    rest = Part(some_leaves(leaves.mesh, seen), leaves.material, leaves.tint[seen])
    return (bark, rest), tuple(clumps)


def check_settings(kind: Kind, settings: ObjectSettings) -> None:
    """Check names and colours before anything is built.

    Raises:
        ConfigError: If the settings name an unknown model, or a colour is not #rrggbb.
    """
    key = f"objects.{kind.name}"
    for model in settings.model:
        if model not in kind.models:
            hint = did_you_mean(model, kind.models)
            raise ConfigError(f"there is no model {model!r}{hint}", key=f"{key}.model")
    try:
        colour_in(settings)
    except ConfigError as error:
        raise ConfigError(str(error), key=f"{key}.colour") from None


def colour_in(settings: ObjectSettings) -> Colour | None:
    """Return the settings' colour as linear reflectance, or None."""
    return None if settings.colour is None else colour_of(settings.colour)


def drawn_model(kind: Kind, settings: ObjectSettings, seed: int, name: str) -> str:
    """Return the model that falls to an object by chance.

    Args:
        kind: Has the models.
        settings: May leave only some of them.
        seed: Of all chance.
        name: Of the object.
    """
    share = share_of(seed, name, "model")
    if settings.model:
        return settings.model[int(share * len(settings.model))]
    return kind.models[pick([_WEIGHTS.get(model, 1.0) for model in kind.models], share)]


def leaf_tint(leaves: Part, plant: Plant) -> Floats:
    """Tints of one plant's leaves: neighbours of one species still differ a little."""
    assert leaves.tint is not None
    colour, seed, name = colour_in(plant.settings), plant.seed, plant.name
    lightness = 0.84 + 0.32 * share_of(seed, name, "lightness")
    # From bluish to yellowish green, never towards other hues.
    warmth = 2.0 * share_of(seed, name, "warmth") - 1.0
    tint = leaves.tint * lightness * np.array([1.0 + 0.13 * warmth, 1.0, 1.0 - 0.12 * warmth])
    if colour is not None:
        tint = np.array(colour) * (tint.mean(axis=1) / tint.mean())[:, None]
    elif plant.season != "summer":
        chance = share_of(seed, name, "season")
        tint = leaf_tints(tint, _species(plant.crown[0]), plant.season, chance=chance)
    return np.asarray(np.clip(tint, 0.004, 0.8))


@cache
def _tree(species: str, variant: int, level: int, season: str) -> tuple[Part, ...]:
    return tree(species, seed=variant, level=level, season=season)


def _species(name: str) -> Species:
    """Return how a plant of a name grows."""
    return SPECIES.get(name) or SHRUBS[name]


@lru_cache(maxsize=4096)
def _seen_leaves(species: str, variant: int, level: int, season: str, eye: Direction) -> Floats:
    """Return which share an eye sees of each leaf of a crown, (n,)."""
    return seen_shares(_tree(species, variant, level, season)[1].mesh, eye)


def chosen(
    kind: Kind,
    settings: ObjectSettings | None,
    pois: Sequence[Poi],
    polygons: Sequence[Polygon],
) -> list[Poi] | list[Polygon]:
    """Return the objects of a kind, each id of a file once.

    Args:
        kind: Which kind.
        settings: Its `file`, if given, says alone what belongs to it; None counts as no file.
        pois: All points of interest.
        polygons: All polygons and lines.
    """
    file = None if settings is None else settings.file

    def belongs(item: Poi | Polygon) -> bool:
        if file is not None:
            return _same(Path(item.source), file)
        return kind_of(item.type, item.source) == kind.name

    if kind.form == "point":
        return [poi for poi in pois if belongs(poi)]
    fits = [polygon for polygon in polygons if belongs(polygon) and len(polygon.shape) > 1]
    if kind.form == "area":
        return [polygon for polygon in fits if len(polygon.shape) > 2]
    return fits


def _same(one: Path, other: Path) -> bool:
    """Whether two paths mean the same file."""
    return one == other or one.resolve() == other.resolve()


@dataclass(frozen=True, slots=True, eq=False)
class Staging:
    """What objects are built by beside their kind and settings.

    Attributes:
        around: Roads, ground, cameras and the seed.
        shrink: Factor of the distances at which a kind's levels of detail change, by its name; 1
            where it has none.
    """

    around: Surroundings
    shrink: Mapping[str, float] = field(default_factory=dict)

    def levels(self, kind: Kind, distances: Floats) -> Ints:
        """Return levels of detail of things at distances from the camera, (n,) [m], as (n,)."""
        return levels_of(kind, distances, shrink=self.shrink.get(kind.name, 1.0))

    def level(self, kind: Kind, distance: float) -> int:
        """Return the level of detail of a thing at a distance from the camera [m]."""
        return int(self.levels(kind, np.array([distance]))[0])


def levels_of(kind: Kind, distances: Floats, *, shrink: float) -> Ints:
    """Return levels of detail, (n,); 0 is the finest.

    Args:
        kind: Has the distances at which they change.
        distances: From the nearest camera, (n,) [m].
        shrink: Factor of those distances.
    """
    return np.searchsorted(np.array(kind.levels) * shrink, distances, side="right")


LONGEST = 50_000.0
"""Of one fence, hedge or wall of a building [m]."""

LONGEST_TOGETHER = 500_000.0
"""Of all of a kind [m]: ten times what stands along the motorways of a large city."""


def check_extents(kind: Kind, items: Sequence[Poi | Polygon]) -> None:
    """Refuse lines and outlines that are too long to be real.

    Raises:
        InputError: Names the polygon and its file.
    """
    together = 0.0
    for item in items:
        if not isinstance(item, Polygon) or item.source == INVENTED:
            continue
        way = float(np.linalg.norm(np.diff(item.shape[:, :2], axis=0), axis=1).sum())
        together += way
        if way > LONGEST or together > LONGEST_TOGETHER:
            most = f"at most {LONGEST / 1e3:g} km are drawn, {LONGEST_TOGETHER / 1e3:g} km in all"
            raise InputError(
                f"{together / 1e3:,.0f} km of {kind.name}, and {most}; mend or remove it",
                file=item.source,
                element=f'poly "{cut(item.id)}"',
            )
