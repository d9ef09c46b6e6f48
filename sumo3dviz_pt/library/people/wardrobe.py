"""Garments by name, and what is sewn to them or carried: collars, scarves, hoods, bags."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.library.people.body import NECK, Fit, Garment, GarmentCut
from sumo3dviz_pt.library.people.extremities import in_hand
from sumo3dviz_pt.library.people.posture import BodyMeasures, joints
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    SkinPart,
    Stack,
    carried,
    closed,
    hemmed,
    rope,
    swollen,
    trunk_weights,
    tube_piece,
    turns,
)
from sumo3dviz_pt.model.geometry import Colour, Floats


def collar(
    body: BodyMeasures, cloth: Cloth, *, rise: float, away: float, count: int, drop: float = 0.0
) -> SkinPart:
    """Build a band around the neck.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        rise: Its height [m].
        away: Distance from the neck [m].
        count: Points of a ring.
        drop: How far its front opens downward [m].
    """
    neck = (0.0365 - 0.0045 * body.woman) * body.height * body.build**0.5 + away
    low = float(body.z(0.838))
    x = -0.007 * body.height
    rows = [
        (x, 0.0, neck + 0.014, neck + 0.012, neck + 0.018, low - 0.030 - drop, low - 0.004, 2.0),
        (x, 0.0, neck + 0.003, neck + 0.003, neck + 0.003, low - 0.012 - drop, low + 0.016, 2.0),
        (
            x + 0.004,
            0.0,
            neck + drop,
            neck,
            neck + 0.2 * drop,
            low - 0.012 + rise - 1.2 * drop,
            low + 0.016 + rise,
            2.0,
        ),
    ]
    rings = hemmed(Stack(np.array(rows)).grid(4, count), depth=0.010, at_top=True)
    return tube_piece(rings, trunk_weights(body, rings.reshape(-1, 3)), cloth)


def scarf(body: BodyMeasures, cloth: Cloth, *, count: int) -> Iterator[SkinPart]:
    """Build a thick loop around the neck with one hanging end.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        count: Points of a ring.
    """
    h, low = body.height, float(body.z(0.845))
    turn = np.linspace(0.0, 2.0 * np.pi, 13)
    wide = 0.048 * h
    drop = 0.022 * (1.0 + np.cos(turn))
    path = np.stack([wide * np.cos(turn) - 0.004 * h, wide * np.sin(turn), low - drop], axis=1)
    path[-1] += [0.008, 0.004, -0.03]
    yield _bound(body, rope(path, 0.030 + 0.005 * np.sin(3.0 * turn), count), cloth)
    front = Garment.of(body, Fit(0.55, NECK, 0.030, 0.6))
    share = np.array([0.825, 0.79, 0.75, 0.71, 0.67, 0.645])
    path = front.smooth(share, np.array([0.10, 0.17, 0.21, 0.23, 0.26, 0.27]))
    path[:, 0] += 0.014
    wide_end = np.array([0.026, 0.032, 0.036, 0.039, 0.042, 0.044])
    yield _bound(body, rope(path, wide_end, count, flat=np.array([1.0, 0.0, 0.3])), cloth)


def _bound(body: BodyMeasures, rings: Floats, cloth: Cloth) -> SkinPart:
    """Bind a closed rope to the trunk that it lies on."""
    return tube_piece(rings, trunk_weights(body, rings.reshape(-1, 3)), cloth, lids="bottom top")


def folded_hood(body: BodyMeasures, cloth: Cloth) -> SkinPart:
    """Build a hood that lies on the back."""
    h, low = body.height, float(body.z(0.842))
    turn = np.radians(np.linspace(40.0, 320.0, 9))
    behind = 0.5 * (1.0 - np.cos(turn))
    path = np.stack(
        [
            0.050 * h * np.cos(turn) - 0.004 * h - 0.022 * behind,
            0.052 * h * np.sin(turn),
            low - 0.012 + 0.014 * behind,
        ],
        axis=1,
    )
    return _bound(body, rope(path, 0.016 + 0.030 * behind**2, 6), cloth)


def _pack(
    body: BodyMeasures,
    middle: Floats,
    half: Floats,
    cloth: Cloth,
    *,
    power: float,
    fine: bool = True,
) -> SkinPart:
    """Build a soft box bound to the trunk; `half` holds its half sizes, (3,) [m]."""
    lift = np.array([-0.98, -0.85, 0.0, 0.75, 0.97]) if fine else np.array([-0.9, 0.9])
    slim = np.array([0.72, 0.97, 1.0, 0.93, 0.62]) if fine else np.array([0.9, 0.9])
    rows = [
        (*middle[:2], *(half[0] * s,) * 2, half[1] * s, *(middle[2] + half[2] * z,) * 2, power)
        for z, s in zip(lift, slim, strict=True)
    ]
    rings = Stack(np.array(rows)).grid(6, 12) if fine else _corners(rows)
    weights = trunk_weights(body, np.tile(middle, (rings[..., 0].size, 1)))
    return tube_piece(rings, weights, cloth, lids="bottom top")


def _corners(rows: list[tuple[float, ...]]) -> Floats:
    """Build two rings of four corners each, (2, 4, 3) [m]."""
    turn = turns(4, offset=0.5)
    return swollen(Stack(np.array(rows)).grid(np.array([0.0, 1.0]), turn))


def backpack(body: BodyMeasures, cloth: Cloth, ease: float, *, fine: bool) -> Iterator[SkinPart]:
    """Build a pack with a pocket and two straps.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        ease: How far the garment below stands off the skin [m].
        fine: Whether to model pocket and straps.
    """
    h = body.height
    size = float(np.clip(h / 1.72, 0.74, 1.0))
    back = -0.066 * h * body.build**0.5 - ease
    main = np.array([back - 0.062 * size, 0.0, float(body.z(0.712))])
    yield _pack(body, main, size * np.array([0.074, 0.142, 0.215]), cloth, power=4.4, fine=fine)
    if not fine:
        return
    pocket = main + size * np.array([-0.064, 0.0, -0.082])
    yield _pack(body, pocket, size * np.array([0.038, 0.112, 0.100]), cloth, power=4.0)
    # A dark zip runs around the lid.
    dark = Cloth("cloth", (0.012, 0.012, 0.013))
    seam = np.linspace(-1.0, 1.0, 7)
    path = np.stack([-0.066 - 0.010 * (1 - seam**2), 0.116 * seam, 0.105 - 0.0 * seam], axis=1)
    yield _bound(body, rope(main + size * path, np.full(7, 0.006), 3), dark)
    shape = Garment.of(body, Fit(0.60, NECK, ease + 0.004, 0.4))
    for s in (1.0, -1.0):
        share = np.array([0.825, 0.830, 0.815, 0.78, 0.74, 0.70, 0.67])
        angle = s * np.radians([140.0, 95.0, 62.0, 47.0, 44.0, 55.0, 80.0])
        path = shape.smooth(share, angle)
        away = np.stack([np.cos(angle), np.sin(angle), 0.5 + 0.0 * angle], axis=1)
        yield _bound(body, rope(path + 0.006 * away, np.full(7, 0.030), 4, flat=away), cloth)


def shoulder_bag(
    body: BodyMeasures, cloth: Cloth, ease: float, *, fine: bool
) -> Iterator[SkinPart]:
    """Build a bag at the right hip on a strap over the left shoulder.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        ease: How far the garment below stands off the skin [m].
        fine: Whether to model the strap.
    """
    h = body.height
    hip = np.array([0.01, -0.100 * h * body.build**0.5 - ease - 0.055, float(body.z(0.50))])
    yield _pack(body, hip, np.array([0.150, 0.050, 0.125]), cloth, power=3.2, fine=fine)
    if not fine:
        return
    shape = Garment.of(body, Fit(0.50, NECK, ease + 0.010, 0.7))
    for s in (1.0, -1.0):
        share = np.array([0.832, 0.80, 0.74, 0.68, 0.62, 0.58])
        angle = np.radians([80.0, 52.0, 28.0, -5.0, -45.0, -80.0])
        angle = angle if s > 0 else np.pi - angle
        path = shape.smooth(share, angle)
        away = np.stack([np.cos(angle), np.sin(angle), 0.3 + 0.0 * angle], axis=1)
        path = np.concatenate([path + 0.008 * away, [hip + np.array([s * 0.10, 0.02, 0.11])]])
        away = np.concatenate([away, [[0.0, -1.0, 0.0]]])
        yield _bound(body, rope(path, np.full(7, 0.020), 4, flat=away), cloth)


def tote(body: BodyMeasures, cloth: Cloth, ease: float, *, fine: bool) -> Iterator[SkinPart]:
    """Build a bag that hangs from the right hand.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        ease: How far the garment below stands off the skin [m].
        fine: Whether to model its handles.
    """
    rest = joints(body)
    grip = rest["hand_r"] + 0.56 * (rest["finger_r"] - rest["hand_r"])
    middle = grip + np.array([0.0, -0.018 - 0.5 * ease, -0.34])
    lift = np.array([-0.98, -0.6, 0.5, 1.0]) if fine else np.array([-0.95, 0.95])
    wide = np.array([0.80, 0.95, 1.0, 0.97]) if fine else np.array([0.9, 0.95])
    rows = [
        (*middle[:2], 0.165 * w, 0.165 * w, 0.050 * t, *(middle[2] + 0.165 * z,) * 2, 3.2)
        for z, w, t in zip(lift, wide, np.linspace(1.3, 0.45, len(lift)), strict=True)
    ]
    rings = Stack(np.array(rows)).grid(4, 10) if fine else _corners(rows)
    yield carried(closed(rings, bottom=True, top=True), "hand_r", cloth)
    for y in (0.012, -0.012) if fine else ():
        near = 0.018 + 0.5 * ease
        path = np.array([[-0.085, y, 0.15], [-0.045, y, 0.27], [-0.014, near + 0.3 * y, 0.335]])
        loop = middle + np.concatenate([path, path[::-1] * [-1.0, 1.0, 1.0]])
        yield carried(
            closed(rope(loop, np.full(6, 0.009), 3), bottom=True, top=True), "hand_r", cloth
        )


def phone(body: BodyMeasures, cloth: Cloth, ease: float, *, fine: bool) -> Iterator[SkinPart]:
    """Build a telephone in the left hand.

    Args:
        body: Measures of the person.
        cloth: What it is made of.
        ease: How far the garment below stands off the skin [m].
        fine: Whether it is there: from far away nobody sees it.
    """
    if fine:
        corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [0.036, 0.0045]
        corners = corners + np.array([0.004, 0.026])
        rings = [np.column_stack([corners, np.full(4, z)]) for z in (0.012, 0.160)]
        yield in_hand(body, "l", np.stack(rings), cloth)


BAGS: Mapping[str, Callable[..., Iterator[SkinPart]]] = {
    "backpack": backpack,
    "shoulder_bag": shoulder_bag,
    "tote": tote,
    "phone": phone,
}
"""What people carry, by name."""


@dataclass(frozen=True, slots=True)
class Top:
    """How a garment for the trunk is cut.

    Attributes:
        fit: On the trunk.
        sleeve: On the arms.
        trimmings: What is sewn on, such as `zip`.
        material: Of its cloth.
    """

    fit: Fit
    sleeve: GarmentCut
    trimmings: tuple[str, ...] = ()
    material: str = "cloth"


TOPS: Mapping[str, Top] = {
    # Fit: hem, top, ease, drape, flare, folds. Cut: end, ease, flare, loose.
    "tee": Top(Fit(0.492, 0.842, 0.012, 0.5), GarmentCut(0.36, 0.012, 0.012, 0.7)),
    "shirt": Top(Fit(0.488, 0.848, 0.014, 0.5), GarmentCut(1.0, 0.008), ("collar", "placket")),
    "sweater": Top(Fit(0.506, 0.848, 0.018, 0.45), GarmentCut(1.0, 0.010, 0.0)),
    "jacket": Top(
        Fit(0.498, 0.848, 0.026, 0.7), GarmentCut(1.0, 0.015), ("stand", "zip", "pockets")
    ),
    "hoodie": Top(Fit(0.502, 0.848, 0.026, 0.6), GarmentCut(1.0, 0.016), ("hood",)),
    "padded": Top(
        Fit(0.490, 0.848, 0.042, 0.6, folds=0.003, quilted=0.010),
        GarmentCut(1.0, 0.026, folds=0.010),
        ("stand", "zip"),
    ),
    "blazer": Top(
        Fit(0.441, 0.848, 0.020, 0.45, folds=0.007),
        GarmentCut(1.0, 0.011, folds=0.009),
        ("lapels",),
    ),
    "coat": Top(Fit(0.30, 0.848, 0.026, 0.55, 0.012), GarmentCut(1.0, 0.016), ("stand", "overlap")),
    "trench": Top(
        Fit(0.33, 0.848, 0.020, 0.25, 0.035), GarmentCut(1.0, 0.015), ("stand", "overlap", "belt")
    ),
    "dress": Top(Fit(0.29, 0.838, 0.006, 0.02, 0.075, 0.010), GarmentCut(0.40, 0.006, 0.004, 0.3)),
    "polo": Top(
        Fit(0.500, 0.844, 0.011, 0.45), GarmentCut(0.36, 0.010, 0.006, 0.6), ("collar", "buttons")
    ),
    "vest": Top(Fit(0.500, 0.836, 0.010, 0.45), GarmentCut(0.16, 0.008, 0.004, 0.5)),
    "gilet": Top(
        Fit(0.500, 0.848, 0.036, 0.55, folds=0.003, quilted=0.009),
        GarmentCut(0.14, 0.020, folds=0.004),
        ("stand", "zip"),
    ),
    "parka": Top(
        Fit(0.405, 0.848, 0.030, 0.65, 0.010),
        GarmentCut(1.0, 0.019),
        ("hood_only", "zip", "pockets"),
    ),
    "bomber": Top(
        Fit(0.535, 0.848, 0.030, 0.75, -0.012),
        GarmentCut(1.0, 0.018),
        ("stand", "zip", "pockets"),
    ),
    "cardigan": Top(Fit(0.470, 0.846, 0.020, 0.45), GarmentCut(1.0, 0.011), ("opened",)),
    "blouse": Top(Fit(0.505, 0.840, 0.012, 0.35), GarmentCut(0.95, 0.010, 0.006)),
    "leather": Top(
        Fit(0.525, 0.848, 0.016, 0.4, folds=0.006), GarmentCut(1.0, 0.010), ("stand", "zip")
    ),
}
"""Garments for the trunk by name."""


@dataclass(frozen=True, slots=True)
class Bottom:
    """How a garment for the legs is cut.

    Attributes:
        legs: Trouser legs, or None for a skirt.
        skirt: On hips and thighs, or None.
    """

    legs: GarmentCut | None
    skirt: Fit | None = None


BOTTOMS: Mapping[str, Bottom] = {
    # Cut: end, ease, flare, loose, folds. Fit: hem, top, ease, drape, flare, folds.
    "trousers": Bottom(GarmentCut(1.0, 0.003)),
    "wide": Bottom(GarmentCut(1.0, 0.008, 0.012)),
    "jeans": Bottom(GarmentCut(1.0, 0.002, 0.0, 0.6)),
    "leggings": Bottom(GarmentCut(0.97, 0.002, 0.0, 0.08, 0.002)),
    "shorts": Bottom(GarmentCut(0.43, 0.010, 0.014)),
    "skirt": Bottom(None, Fit(0.295, 0.605, 0.004, 0.1, 0.060, 0.010)),
    "pencil": Bottom(None, Fit(0.30, 0.605, 0.004, 0.35, 0.006, 0.003)),
    "none": Bottom(None),
}
"""Garments for the legs by name."""


Recipe = Mapping[str, Any]
"""A look's `recipe`."""

TRUNK_RINGS = 25
"""Rings of a garment on the trunk in the middle level."""

_DARK = Cloth("cloth", (0.02, 0.02, 0.022))
_SEAM = Cloth("cloth", (0.028, 0.028, 0.030))


def trimming(name: str, recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Sew something to the garment on the trunk.

    Args:
        name: A key of `TRIMMINGS`.
        recipe: Of the whole look; holds the colours of scarf, shirt and tie.
        garment: What it is sewn to.
        cloth: What the garment is made of.
    """
    yield from TRIMMINGS[name](recipe, garment, cloth)


def _collar(rise: float, away: float) -> Callable[[Recipe, Garment, Cloth], Iterator[SkinPart]]:
    """Return what sews a band around the neck on."""

    def sew(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
        apart = away + 0.2 * garment.fit.ease
        yield collar(garment.body, cloth, rise=rise, away=apart, count=12)

    return sew


def _strip(
    wide: float, own: Cloth | None
) -> Callable[[Recipe, Garment, Cloth], Iterator[SkinPart]]:
    """Return what sews a strip down the front on."""

    def sew(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
        shares = _rows(garment)
        edge = np.full(len(shares), wide)
        yield garment.patch(shares, -edge, edge, own or cloth, lift=0.005)

    return sew


def _rows(garment: Garment) -> Floats:
    """Return the levels of the garment's own rings below the neck; a strip lies flat on them."""
    shares = garment.shares(TRUNK_RINGS)
    return np.asarray(shares[shares < 0.838])


def _hood(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Add a hood on the back and a pouch before the belly."""
    yield folded_hood(garment.body, cloth)
    wide = np.array([0.75, 0.75, 0.65, 0.48])
    yield garment.patch(np.array([0.53, 0.55, 0.58, 0.61]), -wide, wide, cloth, lift=0.012)


def _overlap(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Lay the front edge of a coat over the other side."""
    shares = _rows(garment)
    edge = np.ones(len(shares))
    yield garment.patch(shares, -0.10 * edge, 0.16 * edge, cloth, lift=0.006)


def _hood_alone(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Add a hood on the back."""
    yield folded_hood(garment.body, cloth)


def _pockets(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Add two slanted pocket openings before the hips."""
    low = max(garment.fit.hem + 0.025, 0.525)
    shares = np.array([low, low + 0.022, low + 0.045])
    near = np.array([0.86, 0.74, 0.64])
    for s in (1.0, -1.0):
        edges = (s * near, s * (near + 0.07))
        yield garment.patch(
            shares, min(edges, key=np.sum), max(edges, key=np.sum), _SEAM, lift=0.006
        )


def _opened(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Show the shirt below a garment that is open in front."""
    shares = _rows(garment)
    wide = np.linspace(0.15, 0.20, len(shares))
    shirt = Cloth("cloth", colour_of(recipe.get("shirt", (0.62, 0.63, 0.64))))
    yield garment.patch(shares, -wide, wide, shirt, lift=0.010)
    yield garment.patch(shares, wide, wide + 0.07, cloth, lift=0.016)
    yield garment.patch(shares, -wide - 0.07, -wide, cloth, lift=0.016)


def _belt(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Add a belt of the same cloth."""
    for k in range(6):
        right = np.full(2, -np.pi + k * np.pi / 3)
        yield garment.patch(np.array([0.605, 0.625]), right, right + np.pi / 3, cloth, lift=0.012)


def _scarf(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Add a scarf in its own colour."""
    own = Cloth("cloth", colour_of(recipe["scarf"]["colour"]))
    yield from scarf(garment.body, own, count=6)


def _suit(recipe: Recipe, garment: Garment, cloth: Cloth) -> Iterator[SkinPart]:
    """Add the shirt front, tie, collars and lapels of a blazer."""
    yield collar(garment.body, cloth, rise=0.018, away=0.014, count=12, drop=0.035)
    shares = np.linspace(0.655, 0.838, 7)
    wide = 0.02 + 0.46 * np.linspace(0.0, 1.0, 7) ** 1.1
    wide[-1] += 0.20
    shirt = Cloth("cloth", colour_of(recipe.get("shirt", (0.62, 0.63, 0.64))))
    yield collar(garment.body, shirt, rise=0.026, away=0.008, count=12)
    yield garment.patch(shares, -wide, wide, shirt, lift=0.008)
    flap = np.array([0.05, 0.17, 0.27, 0.34, 0.38, 0.36, 0.20])
    yield garment.patch(shares, wide, wide + flap, cloth, lift=0.014)
    yield garment.patch(shares, -wide - flap, -wide, cloth, lift=0.014)
    if "tie" in recipe:
        narrow = np.array([0.05, 0.075, 0.075, 0.07, 0.065, 0.06, 0.09])
        tie = Cloth("cloth", colour_of(recipe["tie"]))
        yield garment.patch(shares, -narrow, narrow, tie, lift=0.013)


def colour_of(values: Any) -> Colour:
    """Read a colour from three numbers."""
    red, green, blue = (float(value) for value in values)
    return red, green, blue


TRIMMINGS: Mapping[str, Callable[[Recipe, Garment, Cloth], Iterator[SkinPart]]] = {
    "collar": _collar(0.026, 0.011),
    "stand": _collar(0.034, 0.016),
    "zip": _strip(0.03, _DARK),
    "placket": _strip(0.10, None),
    "hood": _hood,
    "hood_only": _hood_alone,
    "pockets": _pockets,
    "opened": _opened,
    "buttons": _strip(0.045, None),
    "overlap": _overlap,
    "belt": _belt,
    "scarf": _scarf,
    "lapels": _suit,
}
"""What can be sewn to a garment, by name."""
