"""The kinds of static objects, in one table: what they are called and what they cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job import ObjectSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Bsdf, Colour, Part
from sumo3dviz_pt.scene.chance import share_of
from sumo3dviz_pt.scene.materials import MATERIALS
from sumo3dviz_pt.scene.surfaces import colour_of, metres_per_tile, surface_material
from sumo3dviz_pt.shapes.building_styles import BLOCKS, HOMES, SHOPS, SURFACES, Style, palette
from sumo3dviz_pt.shapes.facade import FAR, NEAR
from sumo3dviz_pt.shapes.shell import Palette, Shell, paint
from sumo3dviz_pt.shapes.trees import SPECIES, tree

TREE_VARIANTS = 4
"""How many crowns of a species are told apart."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of static object.

    Attributes:
        name: Its key in `objects`, and its family.
        words: Values of `type` that mean it, in lower case.
        form: `point`, `line` or `area`: what places it.
        models: What users can choose from.
        levels: Distances at which the next coarser level of detail begins [m].
        cost: Usual triangles of each level (of 40 m of a line).
        body: Radius and lowest and highest height that a camera must not be in [m].
    """

    name: str
    words: frozenset[str]
    form: str
    models: tuple[str, ...]
    levels: tuple[float, ...]
    cost: tuple[int, ...]
    body: tuple[float, float, float] = (0.0, 0.0, 0.0)


KINDS: tuple[Kind, ...] = (
    Kind(
        "trees",
        frozenset({"tree", "trees"}),
        "point",
        tuple(SPECIES),
        (20.0, 40.0, 75.0, 170.0),
        (29_500, 10_900, 4050, 2150, 260),
        (2.8, 2.0, 9.0),
    ),
    Kind(
        "fences",
        frozenset({"fence", "fences", "guardrail", "guard_rail"}),
        "line",
        (),
        (70.0, 300.0),
        (470, 180, 24),
    ),
    Kind(
        "homes",
        frozenset({"home", "homes", "house", "houses"}),
        "point",
        tuple(HOMES),
        (110.0, 350.0),
        (900, 260, 90),
        (6.0, 0.0, 9.0),
    ),
    Kind(
        "shops",
        frozenset({"shop", "shops", "store"}),
        "point",
        tuple(SHOPS),
        (110.0, 350.0),
        (540, 190, 60),
        (8.5, 0.0, 6.0),
    ),
    Kind(
        "blocks",
        frozenset({"block", "blocks", "apartments"}),
        "point",
        tuple(BLOCKS),
        (110.0, 350.0),
        (4400, 1450, 260),
        (9.5, 0.0, 30.0),
    ),
    Kind(
        "buildings", frozenset({"building", "buildings"}), "area", (), (90.0, 300.0), (900, 300, 90)
    ),
)
"""Every kind of static object."""


def kind_of(type_: str, source: str) -> str | None:
    """The kind that a POI or polygon means: by its type, else by its file's name.

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


def body_of(
    kind: Kind, settings: ObjectSettings, *, seed: int, name: str, level: int
) -> tuple[Part, ...]:
    """The parts of one object in its own frame, chosen by its name.

    Args:
        kind: Of point objects.
        settings: Checked ones.
        seed: Of all chance.
        name: Unique among all objects.
        level: Of detail.
    """
    return _BODIES[kind.name](kind, settings, seed, name, level)


def plan_of(kind: Kind, settings: ObjectSettings, *, seed: int, name: str) -> Floats:
    """Lowest and highest corner of a building's walls in its own frame, (2, 2) [m]."""
    style = STYLES[kind.name][_drawn_model(kind, settings, seed, name)]
    variant = int(share_of(seed, name, "variant") * style.variants)
    walls = _shell(style, variant, FAR)["wall"][..., :2].reshape(-1, 2)
    return np.stack([walls.min(axis=0), walls.max(axis=0)])


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
    """The settings' colour as linear reflectance, or None."""
    return None if settings.colour is None else colour_of(settings.colour)


def _drawn_model(kind: Kind, settings: ObjectSettings, seed: int, name: str) -> str:
    """The model that an object's name falls on."""
    models = settings.model or kind.models
    return models[int(share_of(seed, name, "model") * len(models))]


def building_palette(
    style: Style, settings: ObjectSettings, *, seed: int, name: str, level: int
) -> Palette:
    """Colours of one building, chosen by its name; textures only nearby."""
    rng = np.random.default_rng(int(share_of(seed, name, "colour") * 2**48))
    return palette(style, rng, colour_in(settings), textured=level == NEAR)


@cache
def surface_tiles() -> Mapping[str, float]:
    """Metres per tile of every surface that buildings show."""
    return {name: metres_per_tile(name.removeprefix("surface:")) for name in SURFACES.values()}


def material_of(name: str, *, textured: bool) -> Bsdf:
    """The material of a static object, from `MATERIALS` or a surface asset."""
    if name in MATERIALS:
        return MATERIALS[name]
    return surface_material(name.removeprefix("surface:"), textured=textured)


def _tree_body(
    kind: Kind, settings: ObjectSettings, seed: int, name: str, level: int
) -> tuple[Part, ...]:
    species = _drawn_model(kind, settings, seed, name)
    variant = int(share_of(seed, name, "variant") * TREE_VARIANTS)
    colour = colour_in(settings)
    # Neighbours of one species still differ a little in hue and lightness.
    factor = 0.85 + 0.3 * np.array([share_of(seed, name, c) for c in ("red", "green", "blue")])
    parts = []
    for part in _tree(species, variant, level):
        if part.tint is None:
            parts.append(part)
            continue
        base = part.tint * factor
        if colour is not None:
            base = np.array(colour) * (base.mean(axis=1) / base.mean())[:, None]
        parts.append(Part(part.mesh, part.material, np.clip(base, 0.005, 0.8)))
    return tuple(parts)


def _building_body(styles: Mapping[str, Style]) -> Callable[..., tuple[Part, ...]]:
    def body(
        kind: Kind, settings: ObjectSettings, seed: int, name: str, level: int
    ) -> tuple[Part, ...]:
        model = _drawn_model(kind, settings, seed, name)
        variant = int(share_of(seed, name, "variant") * styles[model].variants)
        colours = building_palette(styles[model], settings, seed=seed, name=name, level=level)
        return paint(_shell(styles[model], variant, level), colours, tiles=surface_tiles())

    return body


@cache
def _tree(species: str, variant: int, level: int) -> tuple[Part, ...]:
    return tree(species, seed=variant, level=level)


@cache
def _shell(style: Style, variant: int, level: int) -> Shell:
    return style.build(variant, level)


STYLES: Mapping[str, Mapping[str, Style]] = {"homes": HOMES, "shops": SHOPS, "blocks": BLOCKS}
"""Models of the kinds that are buildings at points."""

_BODIES: Mapping[str, Callable[..., tuple[Part, ...]]] = {
    "trees": _tree_body,
    **{name: _building_body(styles) for name, styles in STYLES.items()},
}
