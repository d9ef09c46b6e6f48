"""Mirrors that a driver looks into: one inside of cars, and one at each side of all vehicles.

Every pane is aimed: what its middle shows lies in a direction that is given, whoever sits where.
Outer panes are parts of spheres, which show more, and smaller. The radii of the main ones follow UN
Regulation 46, at least 1.2 m, and so do places at the driver's side: not more than 55 degrees
aside of straight ahead.

References:
    UN Regulation 46, Devices for indirect vision, 6.1.2.2 (radii of curvature), 15.2 (fields of
    vision).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.solids import moved, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, Transform, unit

_FLAT = 1e6
"""Radius of a plane pane [m]."""

_RINGS, _SECTORS = 10, 56
_SQUARENESS = 4.5
_PRESSED = 0.12
"""Of its depth has the side of a housing on which the panes sit."""

_HEAVY = 2.25
"""Vehicles that are wider have mirrors on arms before them [m]."""


@dataclass(frozen=True, slots=True)
class _Pane:
    """A pane, and where it looks.

    Attributes:
        half: Half its width and height [m].
        radius: Of its curvature [m].
        above: Its middle over that of the housing [m].
        out: To the outside from straight back [rad].
        down: Below the horizon [rad].
    """

    half: tuple[float, float]
    radius: float
    above: float = 0.0
    out: float = 0.0
    down: float = 0.0


@dataclass(frozen=True, slots=True)
class _Outer:
    """The mirrors of a kind of vehicle.

    Attributes:
        panes: From above.
        back: Behind the windscreen's foot [m].
        out: Beyond the body's side [m].
        up: Over the dashboard, or over the eye where `over_eye` says so [m].
        half: Half width and height of the housing [m].
        over_eye: Whether it is the eye's height that counts.
    """

    panes: tuple[_Pane, ...]
    back: float
    out: float
    up: float
    half: tuple[float, float]
    over_eye: bool


_INNER = _Pane((0.108, 0.028), _FLAT, down=float(np.radians(1.0)))
INNER_PLACE = (0.66, 0.255, 0.135)
"""Of the inner mirror: ahead of the eye, towards the middle, over the eye [m]."""

_DEGREE = float(np.radians(1.0))

_CAR = _Outer(
    (_Pane((0.088, 0.058), 1.4, out=5.5 * _DEGREE, down=2.5 * _DEGREE),),
    back=0.28,
    out=0.10,
    up=0.09,
    half=(0.105, 0.072),
    over_eye=False,
)

_VAN = _Outer(
    (
        _Pane((0.085, 0.095), 1.6, 0.05, 4.5 * _DEGREE, 4.0 * _DEGREE),
        _Pane((0.085, 0.04), 0.5, -0.1, 20.0 * _DEGREE, 14.0 * _DEGREE),
    ),
    back=0.2,
    out=0.14,
    up=-0.05,
    half=(0.1, 0.165),
    over_eye=True,
)

_LORRY = _Outer(
    (
        _Pane((0.1, 0.19), 1.8, 0.09, 4.5 * _DEGREE, 7.0 * _DEGREE),
        _Pane((0.1, 0.085), 0.5, -0.205, 20.0 * _DEGREE, 16.0 * _DEGREE),
    ),
    back=-0.14,
    out=0.17,
    up=0.08,
    half=(0.115, 0.31),
    over_eye=True,
)


def inner_mirror(eye: Floats) -> Iterator[MaterialMesh]:
    """Build the mirror under the windscreen's upper edge, on its stem.

    Args:
        eye: The driver's, (3,) [m].
    """
    side = float(np.sign(eye[1]) or 1.0)
    ahead, inwards, up = INNER_PLACE
    place = eye + np.array([ahead, -side * inwards, up])
    shell = superellipsoid((0.02, 0.115, 0.034), squareness=4.0, segments=36, rings=18)
    turned = aimed(place, eye, _looking(_INNER, side))
    yield "trim", turned.mesh(moved(shell, 0.021, 0.0, 0.0))
    yield "mirror", turned.mesh(_pane(_INNER))
    stem = place + np.array([[0.02, 0.0, 0.02], [0.07, 0.0, 0.16]])
    yield "trim", tube(stem, radius=0.011, sides=8)


def outer_mirrors(
    flank: float, *, front: float, belt: float, eye: Floats
) -> Iterator[MaterialMesh]:
    """Build the mirrors at both sides.

    Args:
        flank: y of the body's left side [m].
        front: x of the windscreen's foot [m].
        belt: Height of the dashboard [m].
        eye: The driver's, (3,) [m].
    """
    kind = _kind(flank, belt=belt, eye=eye)
    height = (float(eye[2]) if kind.over_eye else belt) + kind.up
    for side in (1.0, -1.0):
        place = np.array([front - kind.back, side * (flank + kind.out), height])
        yield from _outer(kind, place, side=side, eye=eye, flank=flank)


def aimed(place: Floats, eye: Floats, towards: Floats) -> Transform:
    """Return the placement of a mirror that shows an eye what lies in a direction.

    Args:
        place: The pane's middle, (3,) [m].
        eye: (3,) [m].
        towards: Unit vector from the pane, (3,).

    Returns:
        The pane faces -x in its own frame, z is up.
    """
    facing = unit(unit(eye - place) + towards)
    yaw = float(np.arctan2(-facing[1], -facing[0]))
    pitch = float(np.arcsin(-facing[2]))
    return Transform.from_pose(place, yaw=yaw, pitch=pitch)


def _kind(flank: float, *, belt: float, eye: Floats) -> _Outer:
    """Return the kind of mirrors that a vehicle has."""
    if 2.0 * flank > _HEAVY:
        return _LORRY
    return _CAR if eye[2] - belt < DEEP else _VAN


DEEP = 0.45
"""Dashboards that lie lower under the eye than this are those of vans, trucks and buses [m]."""


def _outer(
    kind: _Outer, place: Floats, *, side: float, eye: Floats, flank: float
) -> Iterator[MaterialMesh]:
    """Build the mirror at one side, its housing and what holds it."""
    turned = aimed(place, eye, _looking(kind.panes[0], side))
    behind = 0.0
    for pane in kind.panes:
        middle = turned.points(np.array([[0.0, 0.0, pane.above]]))[0]
        own = aimed(middle, eye, _looking(pane, side))
        backing = own.mesh(moved(_pane(pane, grown=0.004), 0.001, 0.0, 0.0))
        yield "gloss_black", backing
        yield "mirror", own.mesh(_pane(pane))
        # The housing lies behind the last of what bends away from the eye.
        facing = turned.directions(np.array([[1.0, 0.0, 0.0]]))[0]
        behind = max(behind, float(((backing.vertices - place) @ facing).max()))
    yield "trim", turned.mesh(moved(_housing(kind), behind, 0.0, 0.0))
    yield from _holder(kind, place, side=side, flank=flank)


def _housing(kind: _Outer) -> Mesh:
    """Return a housing behind the plane x = 0: flat before it, round where the wind comes from."""
    across, tall = kind.half
    shell = superellipsoid((0.75 * across, across, tall), squareness=3.6, segments=40, rings=24)
    assert shell.normals is not None
    vertices = shell.vertices.copy()
    pressed = vertices[:, 0] < 0.0
    vertices[pressed, 0] *= _PRESSED
    normals = shell.normals.copy()
    normals[pressed, 0] /= _PRESSED
    return moved(Mesh(vertices, shell.faces, unit(normals)), 0.75 * across * _PRESSED, 0.0, 0.0)


def _holder(kind: _Outer, place: Floats, *, side: float, flank: float) -> Iterator[MaterialMesh]:
    """Build the foot of a car's mirror, or the arm of a larger one."""
    if kind.over_eye:
        up = kind.half[1]
        path = [
            [place[0] - 0.1, side * (flank - 0.16), place[2] + up + 0.26],
            [place[0] + 0.09, place[1] - side * 0.03, place[2] + up + 0.07],
            [place[0] + 0.1, place[1], place[2] + 0.8 * up],
        ]
        yield "trim", tube(np.array(path), radius=0.016, sides=8)
        return
    root = [place[0] + 0.09, side * (flank - 0.09), place[2] - 0.075]
    hold = [place[0] + 0.075, place[1], place[2] - 0.04]
    yield "gloss_black", tube(np.array([root, hold]), radius=[0.03, 0.02], sides=8)


def _looking(pane: _Pane, side: float) -> Floats:
    """Return the unit direction that a pane's middle shows, at the left (1) or right (-1)."""
    flat = np.cos(pane.down)
    return np.array([-flat * np.cos(pane.out), side * flat * np.sin(pane.out), -np.sin(pane.down)])


def _pane(pane: _Pane, *, grown: float = 0.0) -> Mesh:
    """Return a pane around the origin that faces -x, with the exact normals of its sphere.

    Args:
        pane: Its size and radius.
        grown: How much larger it is on all sides [m].
    """
    turn = np.linspace(0.0, 2.0 * np.pi, _SECTORS, endpoint=False)
    power = 2.0 / _SQUARENESS
    rim = np.stack(
        [np.sign(wave) * np.abs(wave) ** power for wave in (np.cos(turn), np.sin(turn))], axis=1
    )
    shares = np.linspace(0.0, 1.0, _RINGS + 1)[1:]
    half = np.array(pane.half) + grown
    flat = np.concatenate([[[0.0, 0.0]], *(share * rim * half for share in shares)])
    bulge = pane.radius - np.sqrt(pane.radius**2 - (flat**2).sum(axis=1))
    points = np.column_stack([bulge, flat])
    normals = np.column_stack([bulge - pane.radius, flat]) / pane.radius
    return Mesh(points, _spokes(), normals)


def _spokes() -> Ints:
    """Return the faces of rings around a middle, (m, 3), that face -x."""
    ring = np.arange(_SECTORS)
    after = np.roll(ring, -1)
    faces = [np.stack([np.zeros_like(ring), 1 + after, 1 + ring], axis=1)]
    for number in range(_RINGS - 1):
        a, b = 1 + number * _SECTORS + ring, 1 + number * _SECTORS + after
        c, d = a + _SECTORS, b + _SECTORS
        faces += [np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)]
    return np.concatenate(faces)
