"""A figure's head: skull, face, ears and neck, with hair, caps, hoods and helmets.

Measures are those of the average adult head of anthropometric surveys (length 0.195 m, breadth
0.153 m, chin to vertex 0.232 m); eyes are at half height, nose and mouth at thirds below.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.posture import BodyMeasures
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    Folds,
    SkinPart,
    Stack,
    carried,
    closed,
    rope,
    swollen,
    turns,
    weighed,
)
from sumo3dviz_pt.model.geometry import Colour, Floats, Ints, unit

CHIN_TO_TOP = 0.231
"""Height of a man's head of 1.75 m stature [m]."""

_MAN = (
    # x, y, front, back, half, front z, back z, power
    (-0.012, 0.0, 0.054, 0.056, 0.062, -0.112, -0.070, 2.0),
    (-0.012, 0.0, 0.050, 0.050, 0.055, -0.050, -0.020, 2.0),
    (-0.010, 0.0, 0.054, 0.056, 0.054, -0.014, 0.022, 2.0),
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
    yield SkinPart(
        vertices, faces, weights, "complexion", _colours(skull.face, local), role="skin"
    )
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
        yield _sheet(skull, s, _LIPS, red, lift=0.0012, origin=(0.0, 0.0))
        line = tuple((away, 0.0462, 0.0476) for away, _, _ in _LIPS)
        yield _sheet(
            skull, s, line, Cloth("cloth", (0.05, 0.02, 0.018)), lift=0.0022, origin=(0, 0)
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
    angles = np.arcsin(np.clip(away / 0.0905, -1.0, 1.0))
    points = skull.surface(skull.level_at(angles, z), angles)
    points[:, 0] += lift
    points[:, 1] *= side
    first = 2 * np.arange(len(rows) - 1)[:, None, None]
    faces = (np.array([[0, 2, 3], [0, 3, 1]]) + first).reshape(-1, 3)
    faces = faces if side > 0 else faces[:, ::-1]
    return carried((skull.world(points), faces), "head", cloth)


def covering(skull: Skull, heights: Mapping[float, float], angles: Floats) -> Floats:
    """Return the levels of a line around the head, such as a hairline, (m,).

    Args:
        skull: Which head.
        heights: Height over the chin [m] by angle from the front [deg], up to 180.
        angles: Where to read it, (m,) [rad].
    """
    turn = np.degrees(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))
    z = np.interp(turn, list(heights), list(heights.values()))
    return skull.level_at(angles, z)


Heights = Mapping[float, float]
"""Height over the chin [m] by angle from the front [deg]."""

_SHORT: Heights = {
    **{0: 0.186, 24: 0.188, 44: 0.172, 58: 0.150, 68: 0.128, 76: 0.098},
    **{86: 0.100, 98: 0.130, 110: 0.126, 126: 0.075, 150: 0.036, 180: 0.028},
}
_LONG: Heights = {
    **{0: 0.186, 24: 0.184, 44: 0.165, 58: 0.135, 68: 0.085, 76: 0.000},
    **{86: -0.070, 98: -0.100, 126: -0.120, 150: -0.130, 180: -0.135},
}
_BOB: Heights = {
    **{0: 0.150, 24: 0.150, 44: 0.140, 58: 0.100, 66: 0.055, 76: 0.020},
    **{86: 0.006, 98: 0.000, 126: 0.000, 150: 0.005, 180: 0.008},
}
_RING: Heights = {
    **{0: 0.205, 40: 0.205, 60: 0.170, 70: 0.128, 78: 0.098},
    **{86: 0.100, 98: 0.130, 110: 0.126, 126: 0.075, 150: 0.036, 180: 0.028},
}
_FRINGE: Heights = {**_SHORT, 0: 0.150, 24: 0.152, 44: 0.150, 58: 0.140}
_LOOSE: Heights = {
    **{0: 0.182, 24: 0.180, 44: 0.160, 58: 0.120, 68: 0.060, 76: 0.000},
    **{86: -0.040, 98: -0.060, 126: -0.070, 150: -0.075, 180: -0.080},
}
_CHIN: Heights = {
    **{0: 0.184, 24: 0.182, 44: 0.160, 58: 0.112, 66: 0.060, 76: 0.028},
    **{86: 0.012, 98: 0.004, 126: -0.004, 150: -0.006, 180: -0.008},
}
_CAP: Heights = {0: 0.158, 50: 0.155, 90: 0.150, 130: 0.135, 180: 0.120}
_BEANIE: Heights = {0: 0.160, 50: 0.145, 80: 0.105, 100: 0.090, 130: 0.075, 180: 0.060}
_HOOD: Heights = {0: 0.190, 40: 0.180, 60: 0.120, 75: 0.030, 90: -0.030, 130: -0.070, 180: -0.080}
_BICYCLE: Heights = {0: 0.165, 50: 0.165, 90: 0.158, 130: 0.140, 180: 0.128}
_JET: Heights = {0: 0.160, 35: 0.155, 55: 0.120, 70: 0.035, 90: 0.012, 130: 0.005, 180: 0.005}
_FULL: Heights = {0: 0.155, 40: 0.150, 62: 0.120, 78: 0.020, 90: -0.015, 130: -0.015, 180: -0.010}


_SHIELD = Cloth("window")


@dataclass(frozen=True, slots=True)
class HairStyle:
    """What covers a head.

    Attributes:
        edge: Its lower edge.
        crown: Distance from the skin at the crown [m].
        sides: Distance from the skin at the sides [m].
        material: Its material.
        rough: Height of locks or folds [m].
        frayed: How far locks end above or below the edge [m].
        vents: Whether it has dark slots from front to back.
    """

    edge: Heights
    crown: float
    sides: float
    material: str = "hair"
    rough: float = 0.004
    frayed: float = 0.006
    vents: bool = False


STYLES: Mapping[str, HairStyle] = {
    "short": HairStyle(_SHORT, 0.015, 0.006),
    "crop": HairStyle(_SHORT, 0.007, 0.003, rough=0.001, frayed=0.003),
    "buzz": HairStyle(_SHORT, 0.004, 0.002, rough=0.0, frayed=0.002),
    "full": HairStyle(_SHORT, 0.024, 0.010, rough=0.007),
    "fringe": HairStyle(_FRINGE, 0.020, 0.009, rough=0.005, frayed=0.009),
    "faded": HairStyle(_SHORT, 0.021, 0.002, rough=0.005, frayed=0.003),
    "curly": HairStyle(_SHORT, 0.036, 0.022, rough=0.016, frayed=0.010),
    "afro": HairStyle(_SHORT, 0.062, 0.052, rough=0.012, frayed=0.006),
    "receding": HairStyle(_RING, 0.002, 0.007, rough=0.002),
    "long": HairStyle(_LONG, 0.016, 0.010, rough=0.007, frayed=0.022),
    "wavy": HairStyle(_LOOSE, 0.022, 0.022, rough=0.016, frayed=0.020),
    "bob": HairStyle(_BOB, 0.015, 0.012, rough=0.006, frayed=0.010),
    "chin": HairStyle(_CHIN, 0.018, 0.013, rough=0.008, frayed=0.012),
    "tied": HairStyle(_SHORT, 0.010, 0.006, rough=0.002),
    "bun": HairStyle(_SHORT, 0.011, 0.006, rough=0.002),
    "knot": HairStyle(_SHORT, 0.012, 0.007, rough=0.003),
    "plait": HairStyle(_SHORT, 0.011, 0.007, rough=0.003),
    "cap": HairStyle(_CAP, 0.018, 0.012, "cloth", rough=0.0),
    "hat": HairStyle(_CAP, 0.030, 0.014, "cloth", rough=0.002),
    "beanie": HairStyle(_BEANIE, 0.026, 0.013, "cloth", rough=0.003),
    "hood": HairStyle(_HOOD, 0.034, 0.030, "cloth", rough=0.006),
    "bicycle_helmet": HairStyle(_BICYCLE, 0.040, 0.024, "sign", rough=0.0, vents=True),
    "jet_helmet": HairStyle(_JET, 0.036, 0.038, "sign", rough=0.0),
    "full_helmet": HairStyle(_FULL, 0.040, 0.044, "sign", rough=0.0),
}
"""What can be on a head, by name; `bald` is nothing."""


def cover_levels(skull: Skull, styles: tuple[str, ...], *, fine: bool) -> Floats | None:
    """Return the levels above which some style hides the skin, (m,); None where none does.

    Args:
        skull: The head that it is for.
        styles: Names; those that are not in `STYLES` hide nothing.
        fine: Whether the head has its fine columns.
    """
    angles = head_angles(fine=fine)
    levels = [covering(skull, STYLES[s].edge, angles) for s in styles if s in STYLES]
    return np.min(levels, axis=0) if levels else None


def headwear(
    skull: Skull, style: str, cloth: Cloth, *, fine: bool, under: bool = False
) -> Iterator[SkinPart]:
    """Make hair or headwear, with its tail, brim or visor.

    Args:
        skull: The head that it is for.
        style: One of `STYLES`.
        cloth: What it is made of.
        fine: Whether to model locks and details.
        under: Whether something else is worn over it.
    """
    chosen = STYLES[style]
    rows = (4 if under else 9) if fine else 3
    yield _shell(skull, chosen, cloth, fine=fine, rows=rows)
    extra = _EXTRAS.get(style)
    if extra is not None and fine:
        yield from extra(skull, cloth)


def _shell(skull: Skull, style: HairStyle, cloth: Cloth, *, fine: bool, rows: int) -> SkinPart:
    """Make a shell from its edge, which is drawn in under itself, to the crown."""
    angles = head_angles(fine=fine)
    low = covering(skull, style.edge, angles)
    grown = fine and style.material == "hair"
    dice = np.random.default_rng(round(1e4 * (style.crown + style.sides)))
    # Before the face locks end alike.
    beside = smoothstep(0.9, -0.3, np.cos(angles))
    most = np.minimum(style.frayed, 0.004 + 0.05 * beside * style.frayed / 0.022)
    frayed = dice.uniform(-1.0, 1.0, len(angles)) * most * grown
    low = np.clip(low + frayed / 0.013, 0.0, 18.0)
    share = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, rows))[:, None] ** 1.1
    levels = low + (19.0 - low) * share
    turn = np.broadcast_to(angles, levels.shape)
    heights = _drop(skull, style, angles, share) + frayed * (1.0 - share)
    points = _base(skull, levels, turn, heights)
    away = points - np.array([-0.005, 0.0, 0.125])
    away[..., 2] = np.maximum(away[..., 2], 0.0)
    away = unit(away)
    crown = smoothstep(0.15, 0.22, points[..., 2])
    thick = style.sides + crown * (style.crown - style.sides)
    thick = thick * smoothstep(-0.10, 0.34, share)
    locks = style.rough * Folds.of(len(style.edge), slant=0.8)(points * 1.6)
    if grown:
        # Strands run from the crown to the edge and part into locks there.
        strands = np.where(np.arange(len(angles)) % 2, 1.0, -1.0) + dice.normal(0.0, 0.5, len(angles))
        size = np.minimum(0.0012 + 0.12 * style.rough, 0.3 * thick)
        locks = np.maximum(locks, -0.5 * thick) + size * strands * smoothstep(1.05, 0.5, share)
    if style.vents:
        locks = locks - 0.007 * _slots(angles) * _open_rows(share)
        # Helmets are drawn out behind.
        thick = thick + 0.016 * smoothstep(0.0, -0.10, points[..., 0]) * smoothstep(0.0, 0.3, share)
    points = points + away * (thick + locks)[..., None]
    inner = _base(skull, levels[:1], turn[:1], heights[:1]) - 0.006 * away[:1]
    rings = np.concatenate([inner, points]) if fine else swollen(points)
    shape = closed(skull.world(rings), bottom=False, top=True)
    piece = carried(shape, "head", cloth)
    if style.vents and fine and cloth.colour is not None:
        return _slotted(piece, _slots(angles), _open_rows(share)[:, 0])
    return _streaked(piece, len(angles)) if cloth.material == "hair" and fine else piece


def _slots(angles: Floats) -> Floats:
    """Return 1 for columns of a head that lie in a helmet's slot, else 0, (m,)."""
    turn = np.degrees(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))
    wanted = ((5.0, 14.0), (30.0, 45.0), (79.0, 105.0), (129.0, 131.0), (155.0, 157.0))
    inside = np.zeros(len(angles), dtype=np.bool_)
    for low, high in wanted:
        inside |= (turn > low) & (turn < high)
    return inside.astype(np.float64)


def _open_rows(share: Floats) -> Floats:
    """Return 1 for rows of a helmet that its slots run through, else 0."""
    return ((share > 0.30) & (share < 0.93)).astype(np.float64)


def _slotted(piece: SkinPart, columns: Floats, rows: Floats) -> SkinPart:
    """Darken a helmet's slots, and the foam at its edge."""
    assert piece.tint is not None
    quad = np.arange(len(piece.faces)) // 2
    row, column = np.minimum(quad // len(columns), len(rows) - 1), quad % len(columns)
    after = (column + 1) % len(columns)
    # The first row is the inside; row k lies between ring k - 1 and ring k of the shell.
    below, above = rows[np.maximum(row - 1, 0)], rows[row]
    inside = (columns[column] * columns[after] > 0) & (below * above > 0)
    dark = inside | (row == 0)
    return replace(piece, tint=np.where(dark[:, None], 0.012, piece.tint))


def _drop(skull: Skull, style: HairStyle, angles: Floats, share: Floats) -> Floats:
    """Return the heights of a shell's points, which may hang below the skull, (rows, m) [m]."""
    turn = np.degrees(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))
    low = np.interp(turn, list(style.edge), list(style.edge.values()))
    return np.asarray(low + (0.231 - low) * share)


def _base(skull: Skull, levels: Floats, turn: Floats, heights: Floats) -> Floats:
    """Return points of the skull's skin, or below the ears of a curtain that falls from it."""
    ear = skull.level_at(turn[0], np.full(turn.shape[1], 0.095))
    points = skull.stack.points(np.maximum(levels, ear), turn)
    fall = np.maximum(points[..., 2] - heights, 0.0) * (levels < ear)
    points[..., 2] -= fall
    points[..., :2] *= (1.0 + 0.35 * fall - 2.2 * fall**2)[..., None]
    points[..., 0] -= 0.10 * fall
    return np.asarray(points)


def _streaked(piece: SkinPart, columns: int) -> SkinPart:
    """Colour locks lighter and darker."""
    assert piece.tint is not None
    quad = np.arange(len(piece.faces)) // 2
    dice = np.random.default_rng(7)
    lock = dice.uniform(0.66, 1.36, columns)[quad % columns]
    lock = lock * dice.uniform(0.88, 1.12, len(piece.faces) // 2 + 1)[quad]
    # The roots are darker than what the sun has bleached.
    lock = lock * (0.72 + 0.36 * smoothstep(0.0, 6.0, quad // columns + 0.0))
    return replace(piece, tint=piece.tint * lock[:, None])


def _tail(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a pony tail."""
    rows = (
        (-0.150, 0.004, 0.010, 0.010, 0.012, -0.060, -0.060, 2.0),
        (-0.150, 0.003, 0.022, 0.020, 0.026, 0.010, 0.010, 2.0),
        (-0.146, 0.0, 0.026, 0.022, 0.030, 0.080, 0.080, 2.0),
        (-0.130, 0.0, 0.022, 0.020, 0.022, 0.140, 0.140, 2.0),
        (-0.108, 0.0, 0.010, 0.010, 0.012, 0.168, 0.168, 2.0),
    )
    yield on_head(skull, Stack(np.array(rows)).grid(6, 7), cloth)


def _plait(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a plait that hangs down the back."""
    bead = np.array([0.006, 0.017, 0.012, 0.019, 0.013, 0.021, 0.014, 0.022])
    z = np.array([-0.150, -0.120, -0.095, -0.065, -0.040, -0.005, 0.025, 0.060])
    x = np.array([-0.130, -0.128, -0.125, -0.120, -0.116, -0.112, -0.108, -0.102])
    rows = np.stack([x, 0 * x, bead, bead, 1.15 * bead, z, z, 0 * x + 2.0], axis=1)
    yield on_head(skull, Stack(rows).grid(8, 6), cloth)


def _knot(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a knot of hair low at the nape."""
    lift = np.radians([-75.0, -35.0, 5.0, 45.0, 80.0])
    rows = [
        (-0.112, 0, *[0.030 * np.cos(a)] * 2, 0.040 * np.cos(a), *[0.072 + 0.028 * np.sin(a)] * 2, 2)
        for a in lift
    ]
    yield on_head(skull, Stack(np.array(rows)).grid(5, 8), cloth)


def _hat_brim(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the soft brim of a hat."""
    turn = turns(14)
    flat = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    inner, outer = flat * [0.104, 0.086, 0.0], flat * [0.150, 0.128, 0.0]
    up, thick = np.array([-0.006, 0.0, 0.160]), np.array([0.0, 0.0, 0.004])
    drop = np.array([0.0, 0.0, 0.022])
    rings = [inner + up - thick, outer + up - drop - thick, outer + up - drop, inner + up + thick]
    yield on_head(skull, np.stack([rings[0], rings[1], rings[2], rings[3]]), cloth)


def _bun(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a knot of hair at the back."""
    lift = np.radians([-75.0, -35.0, 5.0, 45.0, 80.0])
    rows = [
        (-0.118, 0, *[0.036 * np.cos(a)] * 3, *[0.165 + 0.034 * np.sin(a)] * 2, 2) for a in lift
    ]
    yield on_head(skull, Stack(np.array(rows)).grid(5, 8), cloth)


def _brim(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the peak of a cap."""
    turn = np.radians(np.linspace(-62.0, 62.0, 9))
    inner = np.stack([0.088 * np.cos(turn), 0.080 * np.sin(turn), np.full(9, 0.168)], axis=1)
    outer = np.stack(
        [0.06 + 0.115 * np.cos(turn) ** 0.8, 0.078 * np.sin(turn), 0.160 - 0.012 * np.cos(turn)],
        axis=1,
    )
    # Around the peak's edge: above inside, above outside, below outside, below inside.
    thick = np.array([0.0, 0.0, 0.004])
    rings = np.stack([inner - thick, outer - thick, outer + thick, inner + thick], axis=1)
    yield on_head(skull, rings[::-1], cloth)


def _visor(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the dark shield before the eyes of a jet helmet."""
    yield _band(skull, (0.050, 0.165), 0.030, _SHIELD)


def _full_face(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the chin bar and the shield of a full-face helmet."""
    yield _band(skull, (-0.020, 0.075), 0.036, cloth)
    yield _band(skull, (0.070, 0.160), 0.032, _SHIELD)


def _band(skull: Skull, span: tuple[float, float], away: float, cloth: Cloth) -> SkinPart:
    """Make a closed band before the face, between two heights over the chin [m]."""
    turn = np.radians(np.linspace(-80.0, 80.0, 11))
    z = np.linspace(span[0], span[1], 4)
    bow = away + 0.012 * np.sin(np.linspace(0.2, 2.6, 4))
    reach = 0.094 + bow[:, None] * np.ones_like(turn)
    outer = np.stack(
        [
            reach * np.cos(turn),
            (reach - 0.016) * np.sin(turn),
            np.broadcast_to(z[:, None], reach.shape),
        ],
        axis=-1,
    )
    inner = outer * [0.9, 0.9, 1.0]
    rings = np.concatenate([outer, inner[:, ::-1]], axis=1)
    return on_head(skull, rings, cloth)


def _straps(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the straps of a bicycle helmet, which meet below the chin."""
    for s in (1.0, -1.0):
        for back in (0.030, -0.030):
            path = np.array(
                [[back, 0.081, 0.150], [0.012, 0.0775, 0.085], [0.022, 0.063, 0.030]]
            )
            path = np.concatenate([path, [[0.052, 0.026, -0.006]]]) * [1.0, s, 1.0]
            away = np.array([0.0, s, 0.0])
            yield on_head(skull, rope(path, np.full(4, 0.0075), 3, flat=away), Cloth("trim"))


_EXTRAS: Mapping[str, Callable[[Skull, Cloth], Iterator[SkinPart]]] = {
    "tied": _tail,
    "bun": _bun,
    "cap": _brim,
    "jet_helmet": _visor,
    "full_helmet": _full_face,
    "bicycle_helmet": _straps,
    "plait": _plait,
    "knot": _knot,
    "hat": _hat_brim,
}
