"""What a driver looks at inside: dials under their hood, the steering wheel.

Places are given from the driver's eye, so that they show at the lower edge of a picture that looks
at the road: instruments, under their hood, some 17 degrees under the horizon.

Two dials before the driver: speed to the left, the engine's revolutions to the right. Their
needles are bodies of their own, turned in every frame as the vehicle moves. There is no log of
gears: revolutions follow the speed as a continuously variable gear lets them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.library.mesh.solids import superellipsoid, tube
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.vehicles.interior.flats import flat, rim, ring, sheet
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import Part, Prototype, VehicleLamp

FACE = 0.625
"""Of the dials, ahead of the eye [m]."""

NEEDLE = "dial needle"
"""Name of a needle's body."""

_LEFT = (0.078, -0.078)
"""Of the dials' middles from the eye [m]: speed, revolutions."""

_RADIUS, _HEIGHT = 0.041, -0.204  # of a dial, and of its middle over the eye [m]
_END = np.radians(130.0)
"""From upright to the last tick on either side [rad]."""

_TICKS = np.linspace(-_END, _END, 14)
"""From upright, growing to the right; 20 km/h from each to the next."""

_TOP_SPEED = 260.0 / 3.6  # of the last tick [m/s]
_TOP_REVS, _IDLE, _CRUISE, _RISE = 6.5, 0.8, 1.4, 6.0
"""Of the last tick, at a stand and beyond it when driving [1000/min]; and the speed by which most
of that has been reached [m/s]."""

_DIGIT = 0.0064  # height of a dial's numbers [m]


class _Scale(NamedTuple):
    """What is written on a dial.

    Attributes:
        step: From a long tick to the next.
        red: The first tick that warns.
        unit: Of its numbers.
    """

    step: int
    red: int
    unit: str


_SCALES = (_Scale(40, 99, "km/h"), _Scale(1, 12, "x1000"))

_REVS_PER_SPEED = 0.028  # and how much it grows with each m/s [1000/min]


def needle_angles(speed: float) -> tuple[float, float]:
    """Return where the needles of speed and revolutions point, from upright to the right [rad].

    Args:
        speed: Of the vehicle, of any sign [m/s].
    """
    speed = abs(speed)
    revs = _IDLE + _CRUISE * (1.0 - np.exp(-speed / _RISE)) + _REVS_PER_SPEED * speed
    return _angle(speed / _TOP_SPEED), _angle(revs / _TOP_REVS)


def _angle(share: float) -> float:
    """Where a needle points for a share of the scale [rad]."""
    return float((2.0 * min(share, 1.0) - 1.0) * _END)


def dial_middles(eye: Floats) -> Floats:
    """Return the axes of both needles in the frame of the eye's body, (2, 3) [m]."""
    return np.asarray(eye + np.array([(FACE - 0.003, left, _HEIGHT) for left in _LEFT]))


def dials(eye: Floats) -> Iterator[MaterialMesh]:
    """Build both dials without their needles: rings, ticks, numbers, and what stands between them.

    Args:
        eye: The driver's, (3,) [m].
    """
    for left, scale in zip(_LEFT, _SCALES, strict=True):
        middle = eye + np.array([FACE, left, _HEIGHT])
        yield "chrome", ring(middle, _RADIUS, 0.0016)
        face = middle - np.array([0.003, 0.0, 0.0])
        for tick, angle in enumerate(_TICKS):
            long = 0.0075 if tick % 2 == 0 else 0.0045
            span = (0.95 * _RADIUS - long, 0.95 * _RADIUS)
            colour = "plate" if tick < scale.red else "dial_red"
            yield colour, _stroke(face, float(angle), span, 0.0009)
            if tick % 2 == 0:
                at = 0.6 * _RADIUS * np.array([np.sin(angle), np.cos(angle)])
                yield "plate", _text(str(scale.step * tick // 2), _DIGIT, at, face)
        yield "plate", _text(scale.unit, 0.0034, np.array([0.0, 0.26 * _RADIUS]), face)
    between = eye + np.array([FACE - 0.003, 0.0, _HEIGHT])
    yield "plate", _text("D", 0.009, np.array([0.0, 0.011]), between)
    yield "plate", _text("412 km", 0.0042, np.array([0.0, -0.003]), between)


def _text(text: str, height: float, at: Floats, face: Floats) -> Mesh:
    """A line of text about a point of a plane that faces the driver."""
    drawn = lettering(text, height=height, weight=0.17, gap=0.28)
    low, high = drawn.min(axis=(0, 1)), drawn.max(axis=(0, 1))
    return flat((drawn - 0.5 * (low + high) + at).reshape(-1, 2), face)


def needle() -> Prototype:
    """Build a needle that points upright, on its axis, and what of it glows at night."""
    up = _stroke(np.zeros(3), 0.0, (0.1 * _RADIUS, 0.86 * _RADIUS), 0.0014)
    hub = tube([(0.004, 0.0, 0.0), (-0.002, 0.0, 0.0)], radius=0.1 * _RADIUS, sides=10)
    parts = (Part(up, "lamp_amber"), Part(hub, "trim"))
    # Lamps are ellipses: several, one a little before the next, make a line.
    lamps = tuple(
        _glow((-0.001 - 1e-4 * k, 0.0, share * _RADIUS), (0.0026, 0.3 * _RADIUS))
        for k, share in enumerate((0.26, 0.42, 0.58, 0.72))
    )
    return Prototype(NEEDLE, parts, parts, lamps)


def tick_lamps(eye: Floats) -> tuple[VehicleLamp, ...]:
    """Return every other tick of both dials, which glows at night."""
    lamps = []
    for left in _LEFT:
        for angle in _TICKS[::2]:
            out = 0.86 * _RADIUS * np.array([-np.sin(angle), np.cos(angle)])
            x, y, z = eye + np.array([FACE - 0.004, left + out[0], _HEIGHT + out[1]])
            lamps.append(_glow((float(x), float(y), float(z))))
    return tuple(lamps)


def _glow(
    at: tuple[float, float, float], size: tuple[float, float] = (0.003, 0.003)
) -> VehicleLamp:
    """A spot of light that shines at the driver, of a width and height [m]."""
    return VehicleLamp("dials", at, size, float(np.pi))


def _stroke(middle: Floats, angle: float, span: tuple[float, float], half: float) -> Mesh:
    """A flat bar on a dial, away from its middle at an angle from upright to the right."""
    out = np.array([np.sin(angle), np.cos(angle)])
    side = half * np.array([-out[1], out[0]])
    a, b = span[0] * out, span[1] * out
    return flat(np.array([a - side, a + side, b + side, a - side, b + side, b - side]), middle)


_LEAN = np.radians(24.0)
"""Of the wheel's rim, from upright."""

_LIP = 0.56
"""Of the instruments' hood, ahead of the eye [m]."""

_HOOD = (0.185, -0.139)
"""Half width of the hood at its foot and height of its lip over the eye [m]."""

_BEAD = 0.0045
"""Half as thick is its lip [m]."""


def wheel(eye: Floats, *, belt: float, large: bool) -> Iterator[MaterialMesh]:
    """Build the steering wheel before the driver: rim, hub and three spokes.

    Args:
        eye: The driver's, (3,) [m].
        belt: Height of the dashboard [m].
        large: Whether it is that of a truck or bus.
    """
    radius = 0.23 if large else 0.187
    low = eye[2] - 0.30 if large else eye[2] - 0.338
    centre = np.array([eye[0] + 0.40, eye[1], min(belt - 0.04, low)])
    across = np.array([0.0, 1.0, 0.0])
    up = np.array([np.sin(_LEAN), 0.0, np.cos(_LEAN)])
    yield "leather_rim", rim(centre, across=radius * across, up=radius * up, thick=0.0155)
    for angle in (np.pi / 2, np.pi, 3 * np.pi / 2):
        out = np.sin(angle) * across + np.cos(angle) * up
        spoke = np.stack([centre + share * radius * out for share in (0.25, 0.6, 1.0)])
        yield "trim", tube(spoke, radius=[0.028, 0.017, 0.013], sides=10)
    cushion = superellipsoid((0.03, 0.088, 0.066), squareness=3.0, segments=32, rings=14)
    turned = Transform.from_pose(centre - 0.01 * np.cross(across, up), pitch=-_LEAN)
    yield "leather_rim", turned.mesh(cushion)
    badge = ring(np.zeros(3), 0.017, 0.0014)
    yield (
        "chrome",
        Transform.from_pose(turned.points(np.array([[-0.0305, 0.0, 0.0]]))[0], pitch=-_LEAN).mesh(
            badge
        ),
    )


def binnacle(eye: Floats, *, belt: float, front: float) -> Iterator[MaterialMesh]:
    """Build the hood over the instruments, and two dials without needles under it.

    Args:
        eye: The driver's, (3,) [m].
        belt: Height of the dashboard [m].
        front: x of the windscreen's foot [m].
    """
    yield from _hood(eye, foot=belt - eye[2] - 0.02, end=max(front - eye[0] - 0.12, 0.72))
    yield from dials(eye)


def _hood(eye: Floats, *, foot: float, end: float) -> Iterator[MaterialMesh]:
    """The hood's skin from the dashboard to the lip, the lip and the dark under it."""
    wide, top = _HOOD
    along = np.linspace(0.0, 1.0, 14)
    turn = np.linspace(np.pi, 0.0, 57)
    # A flat arch: |cos| and |sin| to 2/3.4 are a superellipse of exponent 3.4.
    y = -wide * np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** (2 / 3.4)
    arch = np.abs(np.sin(turn)) ** (2 / 3.4)
    # It rises from the pad, and runs nearly level to the lip, so that a driver sees light on it.
    risen = np.minimum(along / 0.7, 1.0)
    level = np.maximum(along - 0.7, 0.0) / 0.3
    height = (top - foot) * (0.96 * np.sin(0.5 * np.pi * risen) ** 1.3 + 0.04 * level)
    x = end + (_LIP - end) * along

    def ring(x: Floats, height: Floats, shrink: float = 0.0) -> Floats:
        z = foot + np.maximum(height[:, None] * arch - shrink, 0.0)
        across = np.broadcast_to(y * (1.0 - shrink / wide), z.shape)
        return eye + np.stack([np.broadcast_to(x[:, None], z.shape), across, z], axis=-1)

    yield "dash_pad", sheet(ring(x, height))
    # The lip is half a round bead.
    bead = np.linspace(0.0, np.pi, 7)
    lip = [
        ring(np.array([_LIP - _BEAD * np.sin(t)]), height[-1:], _BEAD * (1.0 - np.cos(t)))
        for t in bead.tolist()
    ]
    yield "dash_pad", sheet(np.concatenate(lip))
    inner = [ring(np.array([at]), height[-1:], 2.0 * _BEAD) for at in (_LIP, FACE + 0.004)]
    yield "gap", sheet(np.concatenate(inner))
    back = inner[1] * [1.0, 1.0, 0.0] + [0.0, 0.0, eye[2] + foot - 0.06]
    yield "gloss_black", sheet(np.concatenate([inner[1], back]))
