"""A figure's head: skull, face, ears and neck, with hair, caps, hoods and helmets.

Measures are those of the average adult head of anthropometric surveys (length 0.195 m, breadth
0.153 m, chin to vertex 0.232 m); eyes are at half height, nose and mouth at thirds below.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.posture import BodyMeasures
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    SkinPart,
    Stack,
    carried,
    closed,
    swollen,
    weighed,
)
from sumo3dviz_pt.model.geometry import Colour, Floats, Ints

CHIN_TO_TOP = 0.231
"""Height of a man's head of 1.75 m stature [m]."""

_MAN = (
    # x, y, front, back, half, front z, back z, power
    # The neck widens to the muscles that carry the shoulders.
    (-0.020, 0.0, 0.054, 0.058, 0.084, -0.112, -0.070, 2.0),
    (-0.017, 0.0, 0.050, 0.052, 0.069, -0.050, -0.020, 2.0),
    (-0.010, 0.0, 0.054, 0.058, 0.057, -0.014, 0.022, 2.0),
    (0.000, 0.0, 0.071, 0.068, 0.055, -0.006, 0.045, 1.9),
    (0.000, 0.0, 0.087, 0.076, 0.0565, 0.003, 0.058, 1.9),
    (0.000, 0.0, 0.0915, 0.081, 0.0585, 0.016, 0.068, 1.95),
    (0.000, 0.0, 0.0865, 0.085, 0.0605, 0.031, 0.078, 2.0),
    (0.000, 0.0, 0.0920, 0.087, 0.0625, 0.0405, 0.085, 2.0),
    (0.000, 0.0, 0.0885, 0.088, 0.0640, 0.0465, 0.090, 2.0),
    (0.000, 0.0, 0.0935, 0.090, 0.0655, 0.0530, 0.095, 2.0),
    (0.000, 0.0, 0.0905, 0.093, 0.0675, 0.0660, 0.104, 2.0),
    (0.000, 0.0, 0.0905, 0.095, 0.0690, 0.0770, 0.112, 2.05),
    (0.000, 0.0, 0.0905, 0.097, 0.0705, 0.0920, 0.122, 2.1),
    (0.000, 0.0, 0.0905, 0.099, 0.0715, 0.1100, 0.134, 2.1),
    (0.000, 0.0, 0.0965, 0.100, 0.0730, 0.1270, 0.146, 2.15),
    (0.000, 0.0, 0.0965, 0.101, 0.0755, 0.1500, 0.162, 2.2),
    (0.000, 0.0, 0.0900, 0.099, 0.0760, 0.1780, 0.180, 2.2),
    (0.000, 0.0, 0.0740, 0.089, 0.0665, 0.2050, 0.205, 2.1),
    (0.000, 0.0, 0.0460, 0.062, 0.0430, 0.2230, 0.2225, 2.0),
    (0.000, 0.0, 0.0130, 0.018, 0.0120, 0.2305, 0.230, 2.0),
)
_TURNS = np.radians([0, 6, 13, 21, 31, 44, 60, 80, 104, 130, 156])
_COARSE = (0.0, 4.0, 12.0, 16.5)

EYE = (0.031, 0.1115)
"""y and z of the eyes over the chin [m]."""


@dataclass(frozen=True, slots=True)
class Face:
    """What a face is like.

    Attributes:
        skin: Its reflectance.
        nose: Factor of its size.
        jaw: Factor of the jaw's width.
        brow: Factor of the ridge over the eyes.
        lips: Factor of their redness.
        beard: 0 shaven, 1 full, in the hair's colour.
        eyes: Factor of their size.
        hair: Reflectance of hair and eyebrows.
    """

    skin: Colour = (0.48, 0.32, 0.24)
    nose: float = 1.0
    jaw: float = 1.0
    brow: float = 1.0
    lips: float = 1.0
    beard: float = 0.0
    eyes: float = 1.0
    hair: Colour = (0.03, 0.02, 0.014)


@dataclass(frozen=True, slots=True, eq=False)
class Skull:
    """The surface of a head about its chin, and where it sits.

    Attributes:
        stack: The rings.
        place: Origin of the head's frame, (3,) [m].
        size: Its factor.
        face: What is on it.
        levels: Levels of a fine table of heights, (k,).
    """

    stack: Stack
    place: Floats
    size: float
    face: Face
    levels: Floats = field(default_factory=lambda: np.linspace(0.0, 19.0, 191))

    @classmethod
    def of(cls, body: BodyMeasures, face: Face) -> Skull:
        """Shape the head of a body."""
        rows = np.array(_MAN)
        jaw = smoothstep(0.12, 0.02, rows[:, 5])
        rows[:, 4] *= 1.0 + jaw * (0.96 * face.jaw * (1.0 - 0.05 * body.woman) - 0.96)
        rows[3:7, 2] *= 1.0 - 0.02 * body.woman
        rows[14, 2] += 0.003 * (face.brow - 1.0) - 0.002 * body.woman - 0.003 * body.child
        # A slimmer neck.
        rows[:3, 2:5] *= (1.0 - 0.13 * body.woman - 0.18 * body.child) * body.build**0.5
        # A child's face is low under a high forehead.
        low = (rows[:, 5:7] > 0) & (rows[:, 5:7] < 0.15)
        squeezed = rows[:, 5:7] * 0.88
        cheeks = np.exp(-(((rows[:, 5] - 0.085) / 0.03) ** 2))
        rows[:, 4] *= 1.0 + body.child * (0.05 * cheeks - 0.13 * smoothstep(0.055, 0.0, rows[:, 5]))
        rows[3:8, 2] *= 1.0 - 0.07 * body.child
        rows[8:13, 2] *= 1.0 - 0.03 * body.child
        rows[:, 5:7] += body.child * np.where(low, squeezed - rows[:, 5:7], 0.0)
        place = np.array([0.002, 0.0, body.height - CHIN_TO_TOP * body.head])
        # The neck ends where the trunk begins, whatever the head's size.
        rows[0, 5:7] = (float(body.z(0.826)) - place[2]) / body.head + np.array([-0.012, 0.022])
        rows[1, 5:7] = 0.5 * (rows[0, 5:7] + rows[2, 5:7])
        return cls(Stack(rows), place, body.head, face)

    def surface(self, levels: Floats, angles: Floats) -> Floats:
        """Return points of skin with nose and eye sockets, in the head's frame, (..., 3) [m]."""
        points = self.stack.points(levels, angles)
        x, y, z = np.moveaxis(points, -1, 0)
        front = smoothstep(0.03, 0.07, x)
        return np.asarray(points + (front * self._relief(y, z))[..., None] * [1.0, 0.0, 0.0])

    def _relief(self, y: Floats, z: Floats) -> Floats:
        """Return how far features stand out of the face [m]."""
        nose = np.interp(
            z, [0.060, 0.0665, 0.075, 0.082, 0.100, 0.118], [0, 0.015, 0.0235, 0.021, 0.010, 0.0]
        )
        wide = np.interp(z, [0.066, 0.078, 0.115], [0.0135, 0.0115, 0.0075])
        relief = self.face.nose * nose * np.exp(-((y / wide) ** 2))
        away = np.abs(y) - EYE[0]
        relief -= 0.0085 * np.exp(-((away / 0.015) ** 2) - ((z - EYE[1]) / 0.0105) ** 2)
        relief += 0.0030 * np.exp(
            -(((np.abs(y) - 0.046) / 0.016) ** 2) - ((z - 0.088) / 0.014) ** 2
        )
        relief -= 0.0025 * np.exp(-(((np.abs(y) - 0.030) / 0.010) ** 2) - ((z - 0.055) / 0.02) ** 2)
        return np.asarray(relief)

    def level_at(self, angles: Floats, heights: Floats) -> Floats:
        """Return the levels of points at angles and heights over the chin, (n,)."""
        tables = self.stack.points(*np.meshgrid(self.levels, angles, indexing="ij"))[..., 2]
        return np.array(
            [np.interp(z, column, self.levels) for z, column in zip(heights, tables.T, strict=True)]
        )

    def world(self, points: Floats) -> Floats:
        """Carry points from the head's frame to the figure's rest, (..., 3) [m]."""
        return self.place + self.size * points


def head_angles(*, fine: bool) -> Floats:
    """Return the angles of a head's columns, denser in the face, (m,) [rad]."""
    if not fine:
        return np.radians([0.0, 50.0, 115.0, 180.0, 245.0, 310.0])
    return np.concatenate([_TURNS, [np.pi], 2.0 * np.pi - _TURNS[:0:-1]])


def head(
    skull: Skull, body: BodyMeasures, *, cover: Floats | None, fine: bool
) -> Iterator[SkinPart]:
    """Make head and neck.

    Args:
        skull: Its surface.
        body: Measures of the person.
        cover: Levels above which hair covers the head, one for each column, or None.
        fine: Whether to give it a face and ears.
    """
    angles = head_angles(fine=fine)
    levels = np.arange(20.0) if fine else np.array(_COARSE)
    points = skull.surface(*np.meshgrid(levels, angles, indexing="ij"))
    vertices, faces = closed(swollen(skull.world(points)), bottom=False, top=True)
    level = np.append(np.repeat(levels, len(angles)), 19.0)
    if fine and cover is not None:
        hidden = level > np.append(np.tile(cover, len(levels)), 0.0) + 1.0
        faces = faces[~hidden[faces].all(axis=1)]
        vertices, faces, level = _used(vertices, faces, level)
    neck = smoothstep(2.4, 0.2, level)
    weights = weighed(len(vertices), {"head": 1.0 - neck, "chest": neck})
    local = (vertices[faces].mean(axis=1) - skull.place) / skull.size
    yield SkinPart(vertices, faces, weights, "complexion", _colours(skull.face, local), role="skin")
    if fine:
        if (
            cover is None
            or cover[len(_TURNS) - 3] > skull.level_at(angles[8:9], np.array([0.09]))[0]
        ):
            yield from _ears(skull)
        yield from _eyes(skull)
        yield from _mouth(skull)


def _used(vertices: Floats, faces: Ints, level: Floats) -> tuple[Floats, Ints, Floats]:
    """Drop vertices that no face uses."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3), level[used]


def _colours(face: Face, at: Floats) -> Floats:
    """Return the reflectance of a head's faces at places about the chin, (m, 3)."""
    x, y, z = at.T
    skin, hair = np.array(face.skin), np.array(face.hair)
    front = smoothstep(0.02, 0.06, x)
    warm = np.exp(-(((np.abs(y) - 0.045) / 0.02) ** 2) - ((z - 0.080) / 0.022) ** 2)
    warm += 0.8 * np.exp(-((y / 0.014) ** 2) - ((z - 0.075) / 0.012) ** 2)
    tint = skin * (1.0 + front[:, None] * warm[:, None] * np.array([0.05, -0.10, -0.12]))
    socket = front * np.exp(-(((np.abs(y) - EYE[0]) / 0.017) ** 2) - ((z - EYE[1]) / 0.012) ** 2)
    tint = tint * (1.0 - 0.42 * socket[:, None])
    # The neck is in the shade of the chin; cheeks and chin of men are never quite bare.
    below = smoothstep(0.004, -0.016, z) * smoothstep(-0.02, 0.03, x)
    tint = tint * (1.0 - 0.22 * below[:, None])
    # A beard covers jaw, chin and upper lip and thins out towards the cheeks.
    jaw = smoothstep(0.074, 0.050, z - 0.35 * np.maximum(0.06 - x, 0.0)) * smoothstep(-0.03, 0.0, x)
    lip = np.exp(-((y / 0.022) ** 4) - ((z - 0.061) / 0.006) ** 2)
    grown = np.maximum(jaw * smoothstep(-0.03, -0.005, z), lip)
    share = (face.beard * grown)[:, None]
    return np.asarray(tint * (1.0 - share) + share * (0.75 * hair + 0.12 * skin))


def on_head(skull: Skull, rings: Floats, cloth: Cloth) -> SkinPart:
    """Return a closed piece that the head carries.

    Args:
        skull: The head that it is for.
        rings: In the head's frame, from bottom to top, (k, m, 3) [m].
        cloth: What it is made of.
    """
    return carried(closed(skull.world(rings), bottom=True, top=True), "head", cloth)


def _ears(skull: Skull) -> Iterator[SkinPart]:
    """Make two flat shells."""
    rows = (
        (0.004, 0.0, 0.008, 0.006, 0.004, -0.030, -0.030, 2.0),
        (0.000, 0.004, 0.012, 0.014, 0.007, -0.014, -0.012, 2.0),
        (-0.006, 0.007, 0.015, 0.018, 0.008, 0.012, 0.012, 2.0),
        (-0.008, 0.006, 0.012, 0.014, 0.006, 0.028, 0.028, 2.0),
    )
    rings = Stack(np.array(rows)).grid(4, 6)
    red, green, blue = skull.face.skin
    skin = (red, 0.88 * green, 0.86 * blue)
    for s in (1.0, -1.0):
        placed = rings * [1.0, s, 1.0] + [-0.006, s * 0.0715, 0.098]
        placed = placed if s > 0 else placed[:, ::-1]
        yield on_head(skull, placed, Cloth("complexion", skin, "skin"))


def _eyes(skull: Skull) -> Iterator[SkinPart]:
    """Make eyeballs between lids, and eyebrows."""
    hair = skull.face.hair
    for s in (1.0, -1.0):
        yield _sheet(skull, s, _LIDS, Cloth("hair", (0.02, 0.015, 0.012)), lift=0.0016)
        yield _sheet(skull, s, _WHITE, Cloth("complexion", (0.46, 0.43, 0.40)), lift=0.0024)
        yield _sheet(skull, s, _IRIS, Cloth("leather", (0.025, 0.018, 0.014)), lift=0.0032)
        yield _sheet(skull, s, _BROW, Cloth("hair", hair, "hair"), lift=0.0022)


_Outline = tuple[tuple[float, float, float], ...]

_LIDS: _Outline = ((-0.0165, -0.001, 0.003), (0.0, -0.0035, 0.0085), (0.0165, 0.0, 0.004))
_WHITE: _Outline = ((-0.0135, -0.0005, 0.001), (0.0, -0.0045, 0.0045), (0.0135, 0.0, 0.0015))
_IRIS: _Outline = ((-0.0055, -0.0035, 0.0030), (0.0, -0.0045, 0.0045), (0.0055, -0.0035, 0.0030))
_BROW: _Outline = ((-0.019, 0.0140, 0.0190), (0.002, 0.0165, 0.0215), (0.0205, 0.0130, 0.0150))
"""Outward distance from the eye's middle, lower and upper edge [m]."""


_LIPS: _Outline = (
    *((0.0, 0.0372, 0.0552), (0.006, 0.0375, 0.0560), (0.014, 0.0395, 0.0530)),
    (0.0235, 0.0462, 0.0476),
)
"""Outward distance from the face's middle, lower and upper edge over the chin [m]."""


def _mouth(skull: Skull) -> Iterator[SkinPart]:
    """Make lips and the dark line between them."""
    lips = np.array(skull.face.skin) * (
        1.0 + skull.face.lips * (np.array([0.84, 0.58, 0.60]) - 1.0)
    )
    for s in (1.0, -1.0):
        red = Cloth("complexion", (float(lips[0]), float(lips[1]), float(lips[2])), "skin")
        yield _sheet(skull, s, _LIPS, red, lift=0.0022, origin=(0.0, 0.0))
        line = tuple((away, 0.0462, 0.0476) for away, _, _ in _LIPS)
        yield _sheet(
            skull, s, line, Cloth("cloth", (0.05, 0.02, 0.018)), lift=0.0034, origin=(0, 0)
        )


def _sheet(
    skull: Skull,
    side: float,
    outline: _Outline,
    cloth: Cloth,
    *,
    lift: float,
    origin: tuple[float, float] = EYE,
) -> SkinPart:
    """Make a small patch on the face, from rows (outward, low, high) about an origin."""
    rows = np.array(outline) * (skull.face.eyes if origin is EYE else 1.0)
    away, z = np.repeat(origin[0] + rows[:, 0], 2), origin[1] + rows[:, 1:].reshape(-1)
    half = np.interp(
        z, [0.040, 0.053, 0.066, 0.092, 0.127], [0.0625, 0.0655, 0.0675, 0.0705, 0.073]
    )
    angles = np.arcsin(np.clip(away / half, -1.0, 1.0))
    points = skull.surface(skull.level_at(angles, z), angles)
    points[:, 0] += lift
    points[:, 1] *= side
    first = 2 * np.arange(len(rows) - 1)[:, None, None]
    faces = (np.array([[0, 2, 3], [0, 3, 1]]) + first).reshape(-1, 3)
    faces = faces if side > 0 else faces[:, ::-1]
    return carried((skull.world(points), faces), "head", cloth)
