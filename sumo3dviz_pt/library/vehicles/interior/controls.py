"""What a driver looks at inside: dials, the screen in the middle, the steering wheel.

Places are given from the driver's eye, so that they show at the lower edge of a picture that looks
at the road: instruments, under their hood, some 17 degrees under the horizon. They are made of
smooth surfaces, rings and flat figures, as all insides of vehicles are.

Two dials before the driver: speed to the left, the engine's revolutions to the right. Their
needles are bodies of their own, turned in every frame as the vehicle moves. There is no log of
gears: revolutions follow the speed as a continuously variable gear lets them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, tube
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Part, Prototype, VehicleLamp


def sheet(points: Floats, *, normals: Floats | None = None) -> Mesh:
    """Build a smooth surface through a grid of points, (n, m, 3), that faces rows x columns."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, d, c), (a, c, b))])
    if normals is None:
        down, right = np.gradient(points, axis=0), np.gradient(points, axis=1)
        normals = np.cross(down, right)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True) + 1e-20
    return Mesh(points.reshape(-1, 3), faces, normals.reshape(-1, 3))


def ring(middle: Floats, radius: float, thick: float) -> Mesh:
    """Build a ring of round section that faces the driver."""
    across, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return rim(middle, across=radius * across, up=radius * up, thick=thick)


def rim(centre: Floats, *, across: Floats, up: Floats, thick: float) -> Mesh:
    """Build a ring of round section; `across` and `up` reach from its centre to its middle line."""
    turn = np.linspace(0.0, 2.0 * np.pi, 65)[:, None, None]
    section = np.linspace(0.0, 2.0 * np.pi, 12)[None, :, None]
    radius = float(np.linalg.norm(up))
    out = (np.sin(turn) * across + np.cos(turn) * up) / radius
    axis = np.cross(across, up) / radius**2
    normals = np.cos(section) * out - np.sin(section) * axis
    return sheet(centre + radius * out + thick * normals, normals=normals)


def flat(corners: Floats, place: Floats) -> Mesh:
    """Build triangles in an upright plane that faces the driver, (3m, 2) to the right, up."""
    points = np.column_stack([np.zeros(len(corners)), -corners[:, 0], corners[:, 1]]) + place
    faces = np.arange(len(points)).reshape(-1, 3)
    a, b, c = points[faces].transpose(1, 0, 2)
    backwards = np.cross(b - a, c - a)[:, 0] > 0.0
    faces[backwards] = faces[backwards][:, ::-1]
    return Mesh(points, faces, np.broadcast_to([-1.0, 0.0, 0.0], points.shape).copy())


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
    lamps = []
    for left in _LEFT:
        for angle in _TICKS[::2]:
            out = 0.86 * _RADIUS * np.array([-np.sin(angle), np.cos(angle)])
            x, y, z = eye + np.array([FACE - 0.004, left + out[0], _HEIGHT + out[1]])
            lamps.append(_glow((float(x), float(y), float(z))))
    return tuple(lamps)


def _glow(at: tuple[float, float, float]) -> VehicleLamp:
    """A point of light that shines at the driver."""
    return VehicleLamp("dials", at, (0.0045, 0.0045), float(np.pi))


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


class _Street(NamedTuple):
    """A bar on the screen's map, from the screen's middle [m]."""

    left: float
    up: float
    width: float
    height: float


_SCREEN = (0.69, 0.345, -0.214)
"""The screen's middle: ahead of the eye, towards the car's middle, over the eye [m]."""

_SCREEN_HALF = (0.115, 0.041)
"""Half its width and height [m]."""

_STREETS = (
    # left, up, width, height
    _Street(-0.02, 0.004, 0.007, 0.064),
    _Street(0.045, 0.004, 0.004, 0.064),
    _Street(-0.01, 0.016, 0.17, 0.005),
    _Street(-0.06, -0.012, 0.09, 0.004),
    _Street(0.085, 0.02, 0.004, 0.03),
)
"""What the screen shows."""


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
        yield "trim", tube(np.stack([centre, centre + radius * out]), radius=0.013, sides=7)
    hub = np.stack([centre - 0.035 * np.cross(across, up), centre])
    yield "interior", tube(hub, radius=0.06, sides=16)


def binnacle(eye: Floats, *, belt: float, front: float) -> Iterator[MaterialMesh]:
    """Build the hood over the instruments, and two dials without needles under it.

    Args:
        eye: The driver's, (3,) [m].
        belt: Height of the dashboard [m].
        front: x of the windscreen's foot [m].
    """
    yield from _hood(eye, foot=belt - eye[2] - 0.02, end=max(front - eye[0] - 0.12, 0.72))
    yield from dials(eye)


def screen(eye: Floats, *, belt: float) -> Iterator[MaterialMesh]:
    """Build a flat screen in the middle, with a map on it; arguments as in `binnacle`."""
    middle, (wide, high) = _screen_at(eye), _SCREEN_HALF
    yield "gloss_black", moved(box((0.0, -wide, -high), (0.012, wide, high)), *middle)
    edge = box((0.002, -wide - 0.004, -high - 0.004), (0.011, wide + 0.004, high + 0.004))
    yield "trim", moved(edge, *middle)
    foot = box((0.011, -0.04, belt - middle[2] - 0.03), (0.03, 0.04, 0.0))
    yield "trim", moved(foot, *middle)
    for y, z, width, height in _STREETS:
        low, top = (-0.001, y - width / 2, z - height / 2), (0.001, y + width / 2, z + height / 2)
        yield "screen_map", moved(box(low, top), *middle)


def screen_lamps(eye: Floats) -> tuple[VehicleLamp, ...]:
    """Return the screen's map, which glows at night."""
    middle = _screen_at(eye)
    return tuple(
        _lamp("screen", middle + np.array([-0.003, y, z]), (width, height))
        for y, z, width, height in _STREETS
    )


def _screen_at(eye: Floats) -> Floats:
    """Middle of the screen, (3,) [m]."""
    ahead, inwards, up = _SCREEN
    side = float(np.sign(eye[1]) or 1.0)
    return np.asarray(eye + np.array([ahead, -side * inwards, up]))


def _lamp(role: str, at: Floats, size: tuple[float, float]) -> VehicleLamp:
    """A lamp that shines at the driver."""
    x, y, z = (float(value) for value in at)
    return VehicleLamp(role, (x, y, z), size, float(np.pi))


def _hood(eye: Floats, *, foot: float, end: float) -> Iterator[MaterialMesh]:
    """The hood's skin from the dashboard to the lip, the lip and the dark under it."""
    wide, top = _HOOD
    along = np.linspace(0.0, 1.0, 14)
    turn = np.linspace(np.pi, 0.0, 41)
    # A flat arch: |cos| and |sin| to 2/3.4 are a superellipse of exponent 3.4.
    y = -wide * np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** (2 / 3.4)
    arch = np.abs(np.sin(turn)) ** (2 / 3.4)
    height = (top - foot) * np.sin(0.5 * np.pi * along) ** 1.3
    x = end + (_LIP - end) * along

    def ring(x: Floats, height: Floats, shrink: float = 0.0) -> Floats:
        z = foot + np.maximum(height[:, None] * arch - shrink, 0.0)
        across = np.broadcast_to(y * (1.0 - shrink / wide), z.shape)
        return eye + np.stack([np.broadcast_to(x[:, None], z.shape), across, z], axis=-1)

    yield "dash_pad", sheet(ring(x, height))
    ends = np.array([_LIP, _LIP - 0.006, _LIP - 0.006, _LIP])
    steps = [(0.0, ends[:1]), (0.003, ends[1:2]), (0.009, ends[2:3]), (0.012, ends[3:])]
    lip = np.concatenate([ring(at, height[-1:], shrink) for shrink, at in steps])
    yield "dash_pad", sheet(lip)
    inner = [ring(np.array([at]), height[-1:], 0.012) for at in (_LIP, FACE + 0.004)]
    yield "gap", sheet(np.concatenate(inner))
    back = inner[1] * [1.0, 1.0, 0.0] + [0.0, 0.0, eye[2] + foot - 0.06]
    yield "gloss_black", sheet(np.concatenate([inner[1], back]))
