"""A wheelchair with a person in it: the catalogue has no model for this class."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, lathe, moved, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.build import MaterialMesh

_HIP = (-0.86, 0.57)
"""x and z of the hips [m]."""

_NECK = (_HIP[0] + 0.22, _HIP[1] + 0.50)
"""x and z of the neck [m]."""

_GRIP = (-0.55, 0.62)
"""x and z of the hands [m]."""

_FOOT = 0.15
"""Height of the feet [m]."""


def wheelchair(*, fine: bool) -> Iterator[MaterialMesh]:
    """Build a wheelchair with a person in it, 1.2 m long and tall, in detail where it is `fine`."""
    for y in (-0.30, 0.30):
        for material, mesh in _wheel(-0.85, radius=0.31, tyre=0.022, fine=fine):
            yield material, moved(mesh, 0.0, y, 0.0)
        if fine:
            for material, mesh in _wheel(-0.30, radius=0.10, tyre=0.02, fine=False):
                yield material, moved(mesh, 0.0, 0.8 * y, 0.0)
    yield "trim", box((-0.96, -0.22, 0.43), (-0.48, 0.22, 0.49))
    yield "trim", box((-1.0, -0.22, 0.45), (-0.95, 0.22, 0.98))
    yield from _person(fine=fine)


def _person(*, fine: bool) -> Iterator[MaterialMesh]:
    """Somebody who sits and holds the armrests."""
    sides = 7 if fine else 3
    (hx, hz), (gx, gz) = _HIP, _GRIP
    trunk = [
        (hx, 0.0, hz - 0.08),
        (hx + 0.06, 0.0, hz + 0.18),
        (hx + 0.17, 0.0, hz + 0.40),
        (_NECK[0], 0.0, _NECK[1]),
    ]
    yield "cloth", tube(trunk, radius=(0.13, 0.15, 0.17, 0.07), sides=sides + 2 if fine else 4)
    for s in (-1.0, 1.0):
        knee = (hx + 0.42, 0.13 * s, hz - 0.10)
        leg = [(hx, 0.09 * s, hz), knee, (hx + 0.20, 0.12 * s, _FOOT)]
        yield "interior", tube(leg, radius=(0.095, 0.07, 0.045), sides=sides)
        shoulder, hand = (_NECK[0] - 0.06, 0.18 * s, _NECK[1] - 0.08), (gx, 0.24 * s, gz)
        elbow = (0.5 * (_NECK[0] + gx), 0.26 * s, gz + 0.10)
        if fine:
            yield "cloth", tube((shoulder, elbow, hand), radius=(0.055, 0.046, 0.035), sides=7)
        else:
            yield "cloth", tube((shoulder, hand), radius=0.045, sides=3)
    yield from _head(_NECK[0] + 0.05, _NECK[1] + 0.14, fine=fine)


def _head(x: float, z: float, *, fine: bool) -> Iterator[MaterialMesh]:
    """Head, neck and hair."""
    segments, rings = (9, 6) if fine else (4, 3)
    face = superellipsoid((0.095, 0.075, 0.12), squareness=2.1, segments=segments, rings=rings)
    yield "skin", moved(face, x, 0.0, z)
    if not fine:
        return
    yield "skin", tube([(x - 0.01, 0.0, z - 0.16), (x, 0.0, z - 0.05)], radius=0.05, sides=7)
    hair = superellipsoid((0.10, 0.085, 0.085), squareness=2.1, segments=9, rings=5)
    yield "interior", moved(hair, x - 0.018, 0.0, z + 0.045)


def _wheel(x: float, *, radius: float, tyre: float, fine: bool) -> Iterator[MaterialMesh]:
    """A thin wheel in the plane y = 0, with an axle at x and a tyre of this half thickness [m]."""
    inner = radius - 2.0 * tyre
    if not fine:
        wedge = [(inner, -tyre), (radius, 0.0), (inner, tyre)]
        yield "rubber", moved(lathe(wedge, segments=8 if radius > 0.2 else 6), x, 0.0, radius)
        return
    turn = np.radians([-150.0, -70.0, 0.0, 70.0, 150.0])
    ring = [(radius - tyre + tyre * float(np.cos(t)), tyre * float(np.sin(t))) for t in turn]
    rim = [(inner, 0.5 * tyre), (inner, -0.5 * tyre)]
    yield "rubber", moved(lathe(ring, segments=20, crease=1.2), x, 0.0, radius)
    yield "rim", moved(lathe(rim, segments=20), x, 0.0, radius)
    hub = [(0.0, -1.2 * tyre), (0.12 * radius, -tyre), (0.12 * radius, tyre), (0.0, 1.2 * tyre)]
    yield "rim", moved(lathe(hub, segments=6), x, 0.0, radius)
