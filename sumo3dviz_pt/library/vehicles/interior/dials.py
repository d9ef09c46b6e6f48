"""Two dials before the driver: speed to the left, the engine's revolutions to the right.

Their needles are bodies of their own, turned in every frame as the vehicle moves. There is no
log of gears: revolutions follow the speed as a continuously variable gear lets them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.solids import tube
from sumo3dviz_pt.library.street.strokes import lettering
from sumo3dviz_pt.library.vehicles.interior.sheets import flat, ring
from sumo3dviz_pt.library.vehicles.parts import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.lamps import VehicleLamp
from sumo3dviz_pt.model.scene import Part, Prototype

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

_REVS_PER_SPEED = 0.028  # and how much it grows with each m/s [1000/min]


def needle_angles(speed: float) -> tuple[float, float]:
    """Return where the needles of speed and revolutions point, from upright to the right [rad].

    Args:
        speed: Of the vehicle, of any sign [m/s].
    """
    speed = abs(speed)
    revs = _IDLE + _CRUISE * (1.0 - np.exp(-speed / _RISE)) + _REVS_PER_SPEED * speed
    return _angle(speed / _TOP_SPEED), _angle(revs / _TOP_REVS)


def shown_speed(angle: float) -> float:
    """Return the speed that a needle shows at an angle from upright, [m/s]."""
    return float((angle + _END) / (2.0 * _END) * _TOP_SPEED)


def _angle(share: float) -> float:
    """Where a needle points for a share of the scale [rad]."""
    return float((2.0 * min(share, 1.0) - 1.0) * _END)


def dial_middles(eye: Floats) -> Floats:
    """Return the axes of both needles in the frame of the eye's body, (2, 3) [m]."""
    return np.asarray(eye + np.array([(FACE - 0.003, left, _HEIGHT) for left in _LEFT]))


def dials(eye: Floats) -> Iterator[MaterialMesh]:
    """Build both dials without their needles: rings, ticks, and the numbers of the scale of speed.

    Args:
        eye: The driver's, (3,) [m].
    """
    for number, left in enumerate(_LEFT):
        middle = eye + np.array([FACE, left, _HEIGHT])
        yield "chrome", ring(middle, _RADIUS, 0.0022)
        for tick, angle in enumerate(_TICKS):
            long = 0.010 if tick % 2 == 0 else 0.005
            span = (0.93 * _RADIUS - long, 0.93 * _RADIUS)
            yield "plate", _stroke(middle - [0.003, 0.0, 0.0], float(angle), span, 0.0011)
        if number == 0:
            yield from _numbers(middle - np.array([0.003, 0.0, 0.0]))


def _numbers(middle: Floats) -> Iterator[MaterialMesh]:
    """Every 40 km/h, inside the ticks."""
    for tick, angle in enumerate(_TICKS):
        if tick % 2:
            continue
        drawn = lettering(str(20 * tick), height=0.0052, weight=0.17, gap=0.3).reshape(-1, 2)
        at = 0.56 * _RADIUS * np.array([np.sin(angle), np.cos(angle)])
        yield "plate", flat(drawn - drawn.min(axis=0) - 0.5 * np.ptp(drawn, axis=0) + at, middle)


def needle() -> Prototype:
    """Build a needle that points upright, on its axis, and what of it glows at night."""
    up = _stroke(np.zeros(3), 0.0, (0.1 * _RADIUS, 0.86 * _RADIUS), 0.0014)
    hub = tube([(0.004, 0.0, 0.0), (-0.002, 0.0, 0.0)], radius=0.1 * _RADIUS, sides=10)
    parts = (Part(up, "lamp_amber"), Part(hub, "trim"))
    lamps = tuple(_glow((-0.001, 0.0, share * _RADIUS)) for share in (0.3, 0.45, 0.6, 0.75))
    return Prototype(NEEDLE, parts, parts, lamps)


def tick_lamps(eye: Floats) -> tuple[VehicleLamp, ...]:
    """Return every other tick of both dials, which glows at night."""
    found = []
    for left in _LEFT:
        for angle in _TICKS[::2]:
            out = 0.86 * _RADIUS * np.array([-np.sin(angle), np.cos(angle)])
            x, y, z = eye + np.array([FACE - 0.004, left + out[0], _HEIGHT + out[1]])
            found.append(_glow((float(x), float(y), float(z))))
    return tuple(found)


def _glow(at: tuple[float, float, float]) -> VehicleLamp:
    """A point of light that shines at the driver."""
    return VehicleLamp("dials", at, (0.0045, 0.0045), float(np.pi))


def _stroke(middle: Floats, angle: float, span: tuple[float, float], half: float) -> Mesh:
    """A flat bar on a dial, away from its middle at an angle from upright to the right."""
    out = np.array([np.sin(angle), np.cos(angle)])
    side = half * np.array([-out[1], out[0]])
    a, b = span[0] * out, span[1] * out
    return flat(np.array([a - side, a + side, b + side, a - side, b + side, b - side]), middle)
