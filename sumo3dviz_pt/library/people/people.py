"""People from recipes: body, face, clothes, and how they stand and walk.

A walk is a posture for each phase of a stride. The stance leg follows the foot, which rolls from
heel to toe on a point of the ground; the swinging leg follows measured angles of hip and knee.

A recipe is the content of `recipe` in an asset's `asset.yaml`:

    body: {height: 1.78, woman: 0, build: 1.0, child: 0}
    face: {skin: [r, g, b], hair: [r, g, b], nose: 1, jaw: 1, brow: 1, lips: 1, beard: 0}
    head: [{style: short}, {style: cap, colour: [r, g, b]}]
    top: {cut: jacket, colour: null}       # null takes the wearer's colour; may have a `print`,
                                           # `sleeves` and an `edge` (collar, hood) of a colour
    bottom: {cut: trousers, colour: [r, g, b]}
    shoes: {colour: [r, g, b], sole: [r, g, b], shaft: 0.0}
    hose, gloves, scarf: {colour: [r, g, b]}    # tights under a skirt; scarf with `top.with`
    shirt, tie: [r, g, b]                       # under a blazer or a cardigan
    carries: [{what: backpack, colour: [r, g, b]}]    # shoulder_bag, tote, phone
    seed: 3

References:
    D. A. Winter, The Biomechanics and Motor Control of Human Gait: Normal, Elderly and
    Pathological, 2nd ed., 1991, natural cadence (angles of hip and knee, foot pitch);
    J. Perry, Gait Analysis, 1992 (pelvis and trunk); M. P. Murray et al., Walking patterns
    of normal men, J. Bone Joint Surg. 46A, 1964 (arms, stride).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.people.body import BARE, Garment, arm, leg, seat
from sumo3dviz_pt.library.people.cloth import PRINTS, printed, uneven, wrinkled
from sumo3dviz_pt.library.people.extremities import hand, shoe
from sumo3dviz_pt.library.people.hair import STYLES, cover_levels, headwear
from sumo3dviz_pt.library.people.head import Face, Skull, head
from sumo3dviz_pt.library.people.posture import (
    SIDES,
    BodyMeasures,
    FootPose,
    Posture,
    Swing,
    about_x,
    about_y,
    about_z,
    joints,
    matrices,
)
from sumo3dviz_pt.library.people.skin import Cloth, Counts, SkinPart, dressed, interpolated
from sumo3dviz_pt.library.people.wardrobe import (
    BAGS,
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

PHASES = 8
"""Phases of a stride; the first is the right heel's strike."""

TOE_OFF = 0.61
"""Share of a stride after which a foot leaves the ground."""

_HIP = ((0.61, -4), (0.65, 2), (0.7, 9), (0.75, 16), (0.8, 20), (0.85, 23), (0.92, 23), (1.0, 21))
_KNEE = ((0.61, 40), (0.66, 56), (0.71, 64), (0.76, 61), (0.82, 46), (0.89, 21), (0.95, 7), (1, 5))
"""Angles [deg] of the thigh, forward, and of the knee, flexed, by share of a stride."""

_FOOT = (
    *((0.0, 21.0), (0.05, 7.0), (0.09, 0.0), (0.34, 0.0), (0.40, -6.0), (0.50, -24.0)),
    *((0.56, -42.0), (0.61, -60.0), (0.67, -64.0), (0.75, -44.0), (0.83, -10.0), (0.90, 12.0)),
    *((0.96, 22.0), (1.0, 21.0)),
)
"""Angles of the sole against the ground [deg] by share of a stride; toes up is positive."""

_TOE_BEND = np.radians(32.0)
"""How far the foot lifts before the toes follow [rad]."""

_STRIKE = 0.158
"""Where the heel strikes, before the hips, as a share of stature."""


def stride_of(body: BodyMeasures) -> float:
    """Return the distance of two steps at an easy pace [m]."""
    return float(0.79 * body.height * (1.0 - 0.03 * body.woman))


def standing(body: BodyMeasures, habit: int = 0) -> Posture:
    """Stand at ease: the weight on one leg, the other foot aside, no arm as the other.

    Args:
        body: Measures of the person.
        habit: Which leg, where one looks and how arms hang; the same number is the same habit.
    """
    rest, h = joints(body), body.height
    rng = np.random.default_rng(habit)
    s, more = (1.0 if rng.uniform() < 0.5 else -1.0), rng.uniform(0.0, 1.0, 6)
    bears, free = ("l", "r") if s > 0 else ("r", "l")
    hips = np.array([0.0, s * (0.012 + 0.006 * more[0]) * h, rest["pelvis"][2] - 0.010 * h])
    out = np.array([(0.016 + 0.030 * more[1]) * h, -s * (0.010 + 0.020 * more[2]) * h, 0.0])
    feet = {
        bears: _flat(rest[f"foot_{bears}"] + [-0.006 * h, 0.002 * s * h, 0.0], yaw=0.12 * s),
        free: _flat(rest[f"foot_{free}"] + out, yaw=-s * (0.20 + 0.22 * more[3])),
    }
    arms = {
        bears: Swing(-0.06 + 0.08 * more[4], -0.05, 0.18 + 0.14 * more[5]),
        free: Swing(0.05 + 0.10 * more[5], -0.03, 0.34 + 0.40 * more[4]),
    }
    # The hip over the bearing leg is higher, the shoulder lower.
    pelvis = about_x(s * (0.035 + 0.020 * more[0]))
    chest = about_z(s * 0.06 * (more[1] - 0.5)) @ about_x(-s * 0.030) @ about_y(0.02 * more[2])
    look = about_z(0.9 * (more[3] - 0.5)) @ about_x(s * 0.03) @ about_y(0.10 * (more[4] - 0.3))
    return Posture(hips, pelvis, chest, look, feet, arms)


def _flat(ankle: Floats, *, yaw: float) -> FootPose:
    """Put a foot flat on the ground."""
    return FootPose(ankle, yaw=yaw)


def walking(body: BodyMeasures, phase: float) -> Posture:
    """Take the posture of one moment of a walk at an easy pace.

    Args:
        body: Measures of the person.
        phase: Share of a stride, [0, 1); 0 is the right heel's strike, 0.5 the left's.
    """
    h, turn = body.height, 2.0 * np.pi * phase
    sway = (0.009 + 0.004 * body.woman) * h
    hips = np.array([0.0, -sway * np.sin(turn - 0.35), _hip_height(body, phase)])
    pelvis = about_z(np.radians(5.0) * np.cos(turn)) @ about_x(
        np.radians(3.0 + 2.0 * body.woman) * np.sin(turn - 0.2) * -1.0
    )
    chest = about_z(-np.radians(8.5) * np.cos(turn)) @ about_y(np.radians(2.5))
    chest = chest @ about_x(np.radians(1.6) * np.sin(turn - 0.2))
    feet = {"r": _foot(body, phase, "r"), "l": _foot(body, (phase + 0.5) % 1.0, "l")}
    # Nobody swings both arms alike.
    arms = {"r": _arm(phase, 1.08), "l": _arm((phase + 0.5) % 1.0, 0.84)}
    head = about_z(-np.radians(1.5) * np.cos(turn)) @ about_y(np.radians(1.5))
    return Posture(hips, pelvis, chest, head, feet, arms)


def _hip_height(body: BodyMeasures, phase: float) -> float:
    """Return the height of the hips, lowest just after each heel strike [m]."""
    top = float(joints(body)["pelvis"][2])
    swing = np.cos(4.0 * np.pi * (phase - 0.30))
    return float(top - 0.0168 * body.height + 0.0088 * body.height * swing)


def _arm(phase: float, much: float) -> Swing:
    """Swing an arm backward while the leg of its side is forward."""
    wave = -much * np.cos(2.0 * np.pi * (phase - 0.02))
    return Swing(np.radians(-4.0 + 19.0 * wave), np.radians(-2.5), np.radians(21.0 + 11.0 * wave))


def _foot(body: BodyMeasures, phase: float, side: str) -> FootPose:
    """Place a foot at its own share of a stride."""
    yaw = SIDES[side] * np.radians(6.0)
    if phase <= TOE_OFF:
        return _stance(body, phase, side, yaw)
    return _swing(body, phase, side, yaw)


def _pitches(phase: float) -> tuple[float, float]:
    """Return the angles of the sole and of the toes against the ground [rad]."""
    turned = interpolated(phase, _FOOT) if phase < TOE_OFF else _foot_curve()(phase)
    pitch = float(np.radians(turned))
    return pitch, pitch if pitch > 0.0 else min(0.0, pitch + _TOE_BEND)


@cache
def _foot_curve() -> CubicSpline:
    """Interpolate the angle of the sole over a stride [deg]; the curve repeats with the stride."""
    angles = np.array(_FOOT)
    return CubicSpline(angles[:, 0], angles[:, 1], bc_type="periodic")


def _stance(body: BodyMeasures, phase: float, side: str, yaw: float) -> FootPose:
    """Place a foot on the ground, where it rolls over heel, sole, ball and toes."""
    rest = joints(body)
    ankle, heel, ball, tip = (rest[f"{n}_{side}"] for n in ("foot", "heel", "toes", "tip"))
    pitch, toes = _pitches(phase)
    turn, roll = about_z(yaw), about_y(-pitch)
    walked = stride_of(body) * phase
    strike = np.array([_STRIKE * body.height - walked, 0.0, 0.0])
    if pitch >= 0.0:
        place = strike + turn @ roll @ (ankle - heel)
    else:
        flat = turn @ (tip - heel)
        curl = turn @ about_y(-toes) @ (ball - tip)
        place = strike + flat + curl + turn @ roll @ (ankle - ball)
    place[1] += _track(body, side)
    return FootPose(place, pitch, toes, yaw)


def _track(body: BodyMeasures, side: str) -> float:
    """Return y of the line on which a foot comes down [m]."""
    return float(SIDES[side] * (0.034 - 0.010 * body.woman) * body.height)


def _swing(body: BodyMeasures, phase: float, side: str, yaw: float) -> FootPose:
    """Place a foot in the air by measured angles, shifted to meet the stance at both ends."""
    share = (phase - TOE_OFF) / (1.0 - TOE_OFF)
    ankle = _swung(body, phase, side)
    begin = _stance(body, TOE_OFF, side, yaw).ankle - _swung(body, TOE_OFF, side)
    end = _stance(body, 0.0, side, yaw).ankle - _swung(body, 1.0, side)
    pitch, toes = _pitches(phase)
    return FootPose(ankle + begin + share * (end - begin), pitch, toes, yaw)


def _swung(body: BodyMeasures, phase: float, side: str) -> Floats:
    """Return the ankle of a leg with the measured angles of hip and knee, (3,) [m]."""
    rest = joints(body)
    thigh = rest[f"thigh_{side}"][2] - rest[f"shank_{side}"][2]
    shank = rest[f"shank_{side}"][2] - rest[f"foot_{side}"][2]
    hip, knee = np.radians(interpolated(phase, _HIP)), np.radians(interpolated(phase, _KNEE))
    x = thigh * np.sin(hip) + shank * np.sin(hip - knee)
    z = _hip_height(body, phase) - thigh * np.cos(hip) - shank * np.cos(hip - knee)
    return np.array([float(x), _track(body, side), float(z)])


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
        Counts(TRUNK_RINGS, 24), Counts(16, 8), Counts(17, 12), Counts(8, 10), fine=True
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
    parts, poses = dressed(pieces, _on_foot(body, _in_hand(recipe), int(recipe.get("seed", 0))))
    return _grounded(parts, poses)


def _in_hand(recipe: Recipe) -> tuple[str, ...]:
    """Return what somebody holds."""
    return tuple(item["what"] for item in recipe.get("carries", ()) if item["what"] in _HELD)


_HELD: Mapping[str, tuple[str, float]] = {"phone": ("l", 0.62), "tote": ("r", 0.95)}
"""What hands can hold: the hand's side, and how far its fingers are curled."""


@lru_cache(maxsize=2)
def _on_foot(body: BodyMeasures, held: tuple[str, ...], habit: int) -> Floats:
    """Return the bones' matrices, standing and in each phase of a stride, (poses, bones, 3, 4)."""
    phases = np.arange(PHASES) / PHASES
    postures = [standing(body, habit), *(walking(body, phase) for phase in phases)]
    return np.stack([matrices(body, _holding(posture, held)) for posture in postures])


def _holding(posture: Posture, held: tuple[str, ...]) -> Posture:
    """Return a posture on foot whose hands hold something."""
    arms, head = dict(posture.arms), posture.head
    swing = arms["r"]
    if "tote" in held and isinstance(swing, Swing):
        arms["r"] = Swing(0.3 * swing.forward, -0.03, 0.06)
    if "phone" in held:
        arms["l"] = Swing(0.40, -0.03, 1.65)
        head = head @ about_y(0.30)
    return replace(posture, arms=arms, head=head)


def stride_length(recipe: Recipe) -> float:
    """Return the distance of two steps [m]; the distance walked divided by it is the phase."""
    return stride_of(measures(recipe))


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
    top = replace(top, fit=replace(top.fit, seed=seed))
    pieces = [
        *_headed(recipe, body, face, detail),
        *_upper(recipe, body, top, detail),
        *_lower(recipe, body, bottom, detail),
    ]
    for item in recipe.get("carries", ()):
        cloth = _cloth(item, "leather", "bag")
        pieces += BAGS[item["what"]](body, cloth, top.fit.ease, fine=detail.fine)
    for number, piece in enumerate(pieces):
        if detail.fine and piece.material in _PATCHES:
            chance = 97 * seed + number
            piece = uneven(piece, chance, patches=_PATCHES[piece.material])
            piece = wrinkled(piece, chance) if piece.material == "cloth" else piece
        yield piece


_PATCHES = {"cloth": 0.08, "leather": 0.06, "complexion": 0.03}
"""How much the reflectance of materials differs from place to place, as a share."""


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
        grown = STYLES[item["style"]].material == "hair"
        own = face.hair if grown else None
        material = str(item.get("material", STYLES[item["style"]].material))
        colour = colour_of(item["colour"]) if item.get("colour") else own
        cloth = Cloth(material, colour, "hair" if grown else "")
        yield from headwear(skull, item["style"], cloth, fine=detail.fine, under=number > 0)


def _upper(
    recipe: Recipe, body: BodyMeasures, top: Top, detail: FigureDetail
) -> Iterator[SkinPart]:
    """Build the garment on the trunk, sleeves, bare arms and hands."""
    # A suit is of one cloth.
    cloth = _cloth(recipe["top"], top.material, "lower")
    skin = Cloth("complexion", Face(**_tuples(recipe.get("face", {}))).skin, "skin")
    garment = Garment.of(body, top.fit)
    pattern = recipe["top"].get("print") if detail.fine else None
    worn = garment.piece(cloth, detail.trunk)
    yield _printed(worn, detail.trunk, pattern, body)
    sleeves = (
        _cloth({"colour": recipe["top"]["sleeves"]}, top.material)
        if ("sleeves" in recipe["top"])
        else cloth
    )
    gloves = _cloth(recipe["gloves"], "leather") if "gloves" in recipe else skin
    for number, side in enumerate(SIDES):
        cut = replace(top.sleeve, seed=top.fit.seed + 17 * number + 1)
        rows = detail.arm.rings if cut.end > 0.5 else detail.arm.rings // 2
        sleeve = arm(body, side, cut, sleeves, detail.arm.with_rings(rows))
        yield _printed(sleeve, detail.arm, pattern if pattern in _ON_SLEEVES else None, body)
        if cut.end < 0.9:
            bare = replace(BARE, start=max(cut.end - 0.16, 0.0))
            yield arm(body, side, bare, skin, detail.arm.with_rings(detail.arm.rings * 2 // 3))
        held = (_HELD[what] for what in _in_hand(recipe))
        curl = dict(held).get(side, float(recipe.get("curl", 0.28)))
        yield from hand(body, side, gloves, curl=curl, fine=detail.fine)
    if detail.fine:
        edge = recipe["top"].get("edge")
        sewn_on = cloth if edge is None else _cloth({"colour": edge}, top.material)
        for name in (*top.trimmings, *recipe["top"].get("with", ())):
            yield from trimming(name, recipe, garment, sewn_on if name in _EDGES else cloth)


_ON_SLEEVES = frozenset({"stripes", "checks"})
_EDGES = frozenset({"collar", "stand", "placket", "hood", "hood_only"})
"""Prints that sleeves have too, and trimmings that may have a colour of their own."""


def _printed(piece: SkinPart, counts: Counts, pattern: str | None, body: BodyMeasures) -> SkinPart:
    """Print a pattern on a tube, if there is one.

    Raises:
        ConfigError: If its name is unknown.
    """
    if pattern is None:
        return piece
    if pattern not in PRINTS:
        raise ConfigError(f"no print is called {pattern!r}; known: {', '.join(PRINTS)}")
    return printed(piece, counts.points, pattern, height=body.height)


def _lower(
    recipe: Recipe, body: BodyMeasures, bottom: Bottom, detail: FigureDetail
) -> Iterator[SkinPart]:
    """Build trousers or a skirt, bare legs and shoes."""
    cloth = _cloth(recipe["bottom"], "cloth", "lower")
    skin = Cloth("complexion", Face(**_tuples(recipe.get("face", {}))).skin, "skin")
    hose = _cloth(recipe["hose"], "cloth") if "hose" in recipe else skin
    seed = int(recipe.get("seed", 0))
    if bottom.legs is not None:
        counts = detail.trunk.with_rings(max(detail.trunk.rings // 5, 2))
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
            counts = detail.leg.with_rings(detail.leg.rings * 3 // 5)
            yield leg(body, side, replace(BARE, start=start), hose, counts)
        sole = Cloth("cloth", colour_of(shoes.get("sole", (0.02, 0.02, 0.02))))
        shaft = float(shoes.get("shaft", 0.0))
        upper = _cloth(shoes, "leather", "feet")
        yield from shoe(body, side, upper, sole, counts=detail.shoe, heel=shaft)


def _named(known: Mapping[str, Any], item: Mapping[str, Any], key: str) -> Any:
    """Look up the cut that a recipe's entry names; `key` is for the message."""
    if item["cut"] not in known:
        raise ConfigError(f"no {key} is called {item['cut']!r}; known: {', '.join(known)}")
    return known[item["cut"]]


def _cloth(item: Mapping[str, Any], material: str, role: str = "") -> Cloth:
    """Read the cloth of a recipe's entry, whose material has a default."""
    colour = item.get("colour")
    known = None if colour is None else colour_of(colour)
    return Cloth(str(item.get("material", material)), known, role)


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    """Turn YAML's lists into tuples."""
    return {
        key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
    }
