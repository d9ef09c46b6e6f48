"""People from recipes: body, face, clothes, and the poses of standing and walking.

A recipe is the content of `recipe` in an asset's `asset.yaml`:

    body: {height: 1.78, woman: 0, build: 1.0, child: 0}
    face: {skin: [r, g, b], hair: [r, g, b], nose: 1, jaw: 1, brow: 1, lips: 1, beard: 0}
    head: [{style: short}, {style: cap, colour: [r, g, b]}]
    top: {cut: jacket, colour: null}       # null takes the wearer's colour
    bottom: {cut: trousers, colour: [r, g, b]}
    shoes: {colour: [r, g, b], sole: [r, g, b], shaft: 0.0}
    hose, gloves, scarf: {colour: [r, g, b]}    # tights under a skirt; scarf with `top.with`
    shirt, tie: [r, g, b]                       # under a blazer
    carries: [{what: backpack, colour: [r, g, b]}]
    seed: 3
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.people import gait
from sumo3dviz_pt.library.people.extras import backpack, shoulder_bag
from sumo3dviz_pt.library.people.hair import STYLES, cover_levels, headwear
from sumo3dviz_pt.library.people.head import Face, Skull, head
from sumo3dviz_pt.library.people.limbs import BARE, arm, hand, leg, shoe
from sumo3dviz_pt.library.people.posture import Posture, matrices
from sumo3dviz_pt.library.people.rig import SIDES, BodyMeasures
from sumo3dviz_pt.library.people.skin import Cloth, SkinPart, dressed
from sumo3dviz_pt.library.people.stack import Counts
from sumo3dviz_pt.library.people.trunk import Garment, seat
from sumo3dviz_pt.library.people.wardrobe import (
    BOTTOMS,
    TOPS,
    TRUNK_RINGS,
    Bottom,
    Recipe,
    Top,
    colour_of,
    trimming,
)
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Part, Poses


@dataclass(frozen=True, slots=True)
class FigureDetail:
    """How finely a figure is modelled.

    Attributes:
        trunk: Of what is on the trunk.
        arm: Of an arm.
        leg: Of a leg.
        shoe: Of a shoe.
        fine: Whether face, fingers and small things are modelled.
    """

    trunk: Counts
    arm: Counts
    leg: Counts
    shoe: Counts
    fine: bool


LEVELS: Mapping[str, FigureDetail] = {
    "middle": FigureDetail(
        Counts(TRUNK_RINGS, 18), Counts(11, 8), Counts(13, 9), Counts(8, 10), fine=True
    ),
    "far": FigureDetail(Counts(4, 6), Counts(3, 4), Counts(3, 4), Counts(2, 4), fine=False),
}
"""Levels of detail by name."""


def figure(recipe: Recipe, level: str = "middle") -> tuple[tuple[Part, ...], Poses]:
    """Build a person on foot, facing +x; the origin is on the ground below the body's middle.

    Args:
        recipe: Content of `recipe` in an `asset.yaml`.
        level: One of `LEVELS`.

    Returns:
        Parts, standing, and their poses: 0 stands, 1 to 8 are the phases of one stride from
        the right heel's strike on. Parts of `cloth` without a tint take the wearer's colour.

    Raises:
        ConfigError: If a name in the recipe is unknown.
    """
    body = measures(recipe)
    pieces = list(clothed(recipe, LEVELS[level]))
    parts, poses = dressed(pieces, _on_foot(body))
    return _grounded(parts, poses)


@lru_cache(maxsize=2)
def _on_foot(body: BodyMeasures) -> Floats:
    """Return the bones' matrices, standing and in each phase of a stride, (poses, bones, 3, 4)."""
    phases = np.arange(gait.PHASES) / gait.PHASES
    postures = [gait.standing(body), *(gait.walking(body, phase) for phase in phases)]
    return np.stack([matrices(body, posture) for posture in postures])


def stride_length(recipe: Recipe) -> float:
    """Return the distance of two steps [m]; the distance walked divided by it is the phase."""
    return gait.stride_length(measures(recipe))


def in_posture(recipe: Recipe, detail: FigureDetail, posture: Posture) -> tuple[Part, ...]:
    """Build a person in one posture, such as a rider.

    Args:
        recipe: Content of `recipe` in an `asset.yaml`.
        detail: How finely the person is modelled.
        posture: Where hands and feet are.

    Raises:
        ConfigError: If a name in the recipe is unknown.
    """
    body = measures(recipe)
    return dressed(list(clothed(recipe, detail)), matrices(body, posture)[None])[0]


def measures(recipe: Recipe) -> BodyMeasures:
    """Read the measures of a recipe's body."""
    return BodyMeasures(**recipe.get("body", {}))


def _grounded(parts: tuple[Part, ...], poses: Poses) -> tuple[tuple[Part, ...], Poses]:
    """Move every pose down to the ground, by a few millimetres."""
    low = poses.vertices[..., 2].min(axis=1)
    shift = np.array([0.0, 0.0, 1.0]) * low[:, None, None]
    moved = Poses(poses.vertices - shift, poses.normals)
    down = [
        replace(part, mesh=replace(part.mesh, vertices=part.mesh.vertices - shift[0]))
        for part in parts
    ]
    return tuple(down), moved


def clothed(recipe: Recipe, detail: FigureDetail) -> Iterator[SkinPart]:
    """Build all pieces of a person at rest.

    Raises:
        ConfigError: If a name in the recipe is unknown.
    """
    body, face = measures(recipe), Face(**_tuples(recipe.get("face", {})))
    seed = int(recipe.get("seed", 0))
    top = _named(TOPS, recipe["top"], "top")
    bottom = _named(BOTTOMS, recipe["bottom"], "bottom")
    yield from _headed(recipe, body, face, detail)
    yield from _upper(recipe, body, replace(top, fit=replace(top.fit, seed=seed)), detail)
    yield from _lower(recipe, body, bottom, detail)
    for item in recipe.get("carries", ()):
        make = {"backpack": backpack, "shoulder_bag": shoulder_bag}[item["what"]]
        yield from make(body, _cloth(item, "leather"), top.fit.ease, fine=detail.fine)


def _headed(
    recipe: Recipe, body: BodyMeasures, face: Face, detail: FigureDetail
) -> Iterator[SkinPart]:
    """Build head, hair and headwear."""
    skull = Skull.of(body, face)
    worn = recipe.get("head", ())
    cover = cover_levels(skull, tuple(item["style"] for item in worn), fine=detail.fine)
    yield from head(skull, body, cover=cover, fine=detail.fine)
    for number, item in enumerate(worn if detail.fine else worn[:1]):
        if item["style"] not in STYLES:
            raise ConfigError(f"no style is called {item['style']!r}; known: {', '.join(STYLES)}")
        own = face.hair if STYLES[item["style"]].material == "hair" else None
        material = str(item.get("material", STYLES[item["style"]].material))
        colour = colour_of(item["colour"]) if item.get("colour") else own
        cloth = Cloth(material, colour)
        yield from headwear(skull, item["style"], cloth, fine=detail.fine, under=number > 0)


def _upper(
    recipe: Recipe, body: BodyMeasures, top: Top, detail: FigureDetail
) -> Iterator[SkinPart]:
    """Build the garment on the trunk, sleeves, bare arms and hands."""
    cloth = _cloth(recipe["top"], top.material)
    skin = Cloth("complexion", Face(**_tuples(recipe.get("face", {}))).skin)
    garment = Garment.of(body, top.fit)
    yield garment.piece(cloth, detail.trunk)
    gloves = _cloth(recipe["gloves"], "leather") if "gloves" in recipe else skin
    for number, side in enumerate(SIDES):
        cut = replace(top.sleeve, seed=top.fit.seed + 17 * number + 1)
        rows = detail.arm.rings if cut.end > 0.5 else detail.arm.rings // 2
        yield arm(body, side, cut, cloth, detail.arm.with_rings(rows))
        if cut.end < 0.9:
            bare = replace(BARE, start=max(cut.end - 0.16, 0.0))
            yield arm(body, side, bare, skin, detail.arm.with_rings(detail.arm.rings - 3))
        curl = float(recipe.get("curl", 0.28))
        yield from hand(body, side, gloves, curl=curl, fine=detail.fine)
    if detail.fine:
        for name in (*top.trimmings, *recipe["top"].get("with", ())):
            yield from trimming(name, recipe, garment, cloth)


def _lower(
    recipe: Recipe, body: BodyMeasures, bottom: Bottom, detail: FigureDetail
) -> Iterator[SkinPart]:
    """Build trousers or a skirt, bare legs and shoes."""
    cloth = _cloth(recipe["bottom"], "cloth")
    skin = Cloth("complexion", Face(**_tuples(recipe.get("face", {}))).skin)
    hose = _cloth(recipe["hose"], "cloth") if "hose" in recipe else skin
    seed = int(recipe.get("seed", 0))
    if bottom.legs is not None:
        counts = detail.trunk.with_rings(detail.trunk.rings // 3)
        yield seat(body, cloth, counts=counts, ease=0.4 * bottom.legs.ease + 0.002)
    if bottom.skirt is not None:
        fit = replace(bottom.skirt, seed=seed + 5)
        counts = detail.trunk.with_rings(detail.trunk.rings * 2 // 3)
        yield Garment.of(body, fit).piece(cloth, counts)
    shoes = recipe["shoes"]
    for number, side in enumerate(SIDES):
        if bottom.legs is not None:
            cut = replace(bottom.legs, seed=seed + 31 * number + 2)
            rows = detail.leg.rings if cut.end > 0.5 else detail.leg.rings // 2
            yield leg(body, side, cut, cloth, detail.leg.with_rings(rows))
        if bottom.legs is None or bottom.legs.end < 0.9:
            start = 0.37 if bottom.legs is None else bottom.legs.end - 0.12
            counts = detail.leg.with_rings(detail.leg.rings - 4)
            yield leg(body, side, replace(BARE, start=start), hose, counts)
        sole = Cloth("cloth", colour_of(shoes.get("sole", (0.02, 0.02, 0.02))))
        shaft = float(shoes.get("shaft", 0.0))
        upper = _cloth(shoes, "leather")
        yield from shoe(body, side, upper, sole, counts=detail.shoe, heel=shaft)


def _named(known: Mapping[str, Any], item: Mapping[str, Any], key: str) -> Any:
    """Look up the cut that a recipe's entry names; `key` is for the message."""
    if item["cut"] not in known:
        raise ConfigError(f"no {key} is called {item['cut']!r}; known: {', '.join(known)}")
    return known[item["cut"]]


def _cloth(item: Mapping[str, Any], material: str) -> Cloth:
    """Read the cloth of a recipe's entry, whose material has a default."""
    colour = item.get("colour")
    return Cloth(str(item.get("material", material)), None if colour is None else colour_of(colour))


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    """Turn YAML's lists into tuples."""
    return {
        key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
    }
