"""Hands and shoes of a figure, and what hands hold."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.posture import SIDES, BodyMeasures, joints
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    Counts,
    SkinPart,
    Stack,
    carried,
    closed,
    rope,
    swollen,
    tube_piece,
    turns,
    weighed,
)
from sumo3dviz_pt.model.geometry import Floats

_SHOE = (
    # x, y, front, back, half, front z, back z, power
    (0.064, 0.0, 0.134, 0.126, 0.040, 0.004, 0.000, 2.5),
    (0.064, 0.0, 0.139, 0.133, 0.044, 0.010, 0.012, 2.5),
    (0.064, 0.0, 0.139, 0.133, 0.0445, 0.024, 0.026, 2.5),
    (0.064, 0.0, 0.136, 0.130, 0.0430, 0.030, 0.030, 2.5),
    (0.050, 0.0, 0.138, 0.118, 0.0425, 0.046, 0.046, 2.3),
    (0.036, 0.0, 0.116, 0.104, 0.0390, 0.061, 0.062, 2.1),
    (0.022, 0.0, 0.086, 0.088, 0.0350, 0.078, 0.078, 2.0),
    (0.010, 0.0, 0.056, 0.070, 0.0330, 0.098, 0.096, 2.0),
)
"""A shoe of 0.27 m around its ankle's foot point [m]."""


def shoe(
    body: BodyMeasures, side: str, upper: Cloth, sole: Cloth, *, counts: Counts, heel: float
) -> Iterator[SkinPart]:
    """Make a shoe of a sole and an upper.

    Args:
        body: Measures of the person.
        side: `l` or `r`.
        upper: Its leather or cloth.
        sole: Its rubber.
        counts: Rings, and points of a ring.
        heel: Height added to the shaft: 0 for shoes, 0.08 for boots [m].
    """
    rest = joints(body)
    s, place = SIDES[side], rest[f"foot_{side}"] * [1.0, 1.0, 0.0]
    rows = np.array(_SHOE)
    if heel > 0.0 and counts.rings > 4:
        shaft = rows[-1] + [0.0, 0.0, -0.006, -0.014, 0.003, heel, heel, 0.0]
        rows = np.concatenate([rows, shaft[None]])
    rings = Stack(rows).grid(min(counts.rings, len(rows)), counts.points)
    # Both feet curve inward in front.
    rings[..., 1] -= s * 0.012 * smoothstep(0.05, 0.20, rings[..., 0])
    slim = 1.0 - 0.07 * body.woman
    rings = place + rings * body.foot * [1.0, slim, 1.0]
    split = round(counts.rings * 3 / 8)
    ball = place[0] + 0.115 * body.foot
    rings = swollen(rings)
    halves = ((rings[: split + 1], sole, "bottom"), (rings[split:], upper, "top"))
    for part, cloth, lids in halves if split > 1 else ((rings, upper, "bottom"),):
        toes = smoothstep(ball - 0.02, ball + 0.02, part[..., 0].reshape(-1))
        weights = weighed(toes.size, {f"foot_{side}": 1.0 - toes, f"toes_{side}": toes})
        yield tube_piece(part, weights, cloth, lids=lids)


def hand(
    body: BodyMeasures, side: str, cloth: Cloth, *, curl: float, fine: bool
) -> Iterator[SkinPart]:
    """Make a hand of palm, thumb and fingers.

    Args:
        body: Measures of the person.
        side: `l` or `r`.
        cloth: Skin or glove.
        curl: 0 straight, 1 a fist.
        fine: Whether the fingers are apart.
    """
    for rings in _hand_rings(curl) if fine else (_mitten(),):
        placed = _at_wrist(body, side, rings)
        yield carried(closed(placed, bottom=True, top=True), f"hand_{side}", cloth)


def in_hand(body: BodyMeasures, side: str, rings: Floats, cloth: Cloth) -> SkinPart:
    """Put a closed piece into a hand.

    Args:
        body: Measures of the person.
        side: `l` or `r`.
        rings: To the thumb, out of the palm, to the fingers, (k, m, 3) [m].
        cloth: What it is made of.
    """
    placed = _at_wrist(body, side, rings)
    return carried(closed(placed, bottom=True, top=True), f"hand_{side}", cloth)


def _at_wrist(body: BodyMeasures, side: str, rings: Floats) -> Floats:
    """Carry rings from the hand's own frame: to the thumb, out of the palm, to the fingers."""
    rest, s = joints(body), SIDES[side]
    wrist, finger = rest[f"hand_{side}"], rest[f"finger_{side}"]
    size = float(np.linalg.norm(finger - wrist)) / 0.184
    along = (finger - wrist) / np.linalg.norm(finger - wrist)
    palm = np.array([0.0, -s, 0.0])
    palm -= (palm @ along) * along
    palm /= np.linalg.norm(palm)
    thumb = np.array([1.0, 0.0, 0.0])
    frame = np.stack([thumb, palm, along])
    placed = wrist + size * rings @ frame
    # Bottom to top, counter-clockwise: turn the order where the frame is left-handed.
    return np.asarray(placed if np.linalg.det(frame) > 0 else placed[:, ::-1])


def _mitten() -> Floats:
    """Make a hand for far away: rings from the wrist to the finger tips."""
    rows = [(0.0, 0.0, 0.0, 0.030, 0.020), (0.005, 0.016, 0.15, 0.040, 0.016)]
    return np.stack([_oval(*row, count=3) for row in rows])


def _oval(x: float, y: float, z: float, wide: float, thick: float, *, count: int) -> Floats:
    """Lay an oval of two half widths around a point, across the hand's length, (count, 3) [m]."""
    turn = turns(count)
    return np.stack([x + wide * np.cos(turn), y + thick * np.sin(turn), np.full(count, z)], axis=1)


def _hand_rings(curl: float) -> Iterator[Floats]:
    """Make the palm, four fingers and the thumb of the left hand."""
    palm = (
        (0.0, 0.0, -0.012, 0.027, 0.020),
        (0.0, 0.001, 0.012, 0.030, 0.0175),
        (0.004, 0.003, 0.050, 0.043, 0.016),
        (0.002, 0.002, 0.096, 0.042, 0.011),
    )
    yield np.stack([_oval(*row, count=6) for row in palm])
    for x, length, base in (
        *((0.033, 0.072, 0.090), (0.0115, 0.080, 0.094)),
        *((-0.0105, 0.075, 0.092), (-0.031, 0.060, 0.085)),
    ):
        yield _finger(np.array([x, 0.002, base]), length, curl)
    thumb = np.array([[0.022, 0.004, 0.022], [0.050, 0.014, 0.056], [0.050, 0.024, 0.094]])
    yield rope(thumb, np.array([0.015, 0.0125, 0.008]), 4)


def _finger(base: Floats, length: float, curl: float) -> Floats:
    """Make a finger that bends towards the palm."""
    bend = np.cumsum(np.radians([14.0 + 60.0 * curl, 18.0 + 72.0 * curl, 12.0 + 50.0 * curl]))
    bend, parts = bend[[0, 2]], length * np.array([0.5, 0.5])
    steps = np.stack([np.zeros(2), parts * np.sin(bend), parts * np.cos(bend)], axis=1)
    path = np.concatenate([base[None], base + np.cumsum(steps, axis=0)])
    return rope(path, np.array([0.0112, 0.0104, 0.0070]), 3)
