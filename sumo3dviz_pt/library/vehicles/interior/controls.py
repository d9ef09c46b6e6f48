"""Instruments under their hood, the screen in the middle and the steering wheel.

Places are given from the driver's eye, so that they show at the lower edge of a picture
that looks at the road: instruments some 17 degrees under the horizon.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, tube
from sumo3dviz_pt.library.vehicles.interior.dials import FACE, dials
from sumo3dviz_pt.library.vehicles.interior.sheets import rim, sheet
from sumo3dviz_pt.library.vehicles.parts import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.lamps import VehicleLamp

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
