"""What a figure wears over its clothes or carries: collars, scarves, hoods, bags."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.people.rig import BodyMeasures
from sumo3dviz_pt.library.people.skin import Cloth, SkinPart, hemmed, trunk_weights, tube_piece
from sumo3dviz_pt.library.people.stack import Stack, rope, swollen, turns
from sumo3dviz_pt.library.people.trunk import NECK, Fit, Garment
from sumo3dviz_pt.model.geometry import Floats


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
    back = -0.066 * h * body.build**0.5 - ease
    main = np.array([back - 0.075, 0.0, float(body.z(0.715))])
    yield _pack(body, main, np.array([0.085, 0.148, 0.225]), cloth, power=3.4, fine=fine)
    if not fine:
        return
    pocket = main + np.array([-0.078, 0.0, -0.075])
    yield _pack(body, pocket, np.array([0.040, 0.115, 0.110]), cloth, power=3.0)
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
