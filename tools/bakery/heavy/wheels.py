"""Wheels of heavy vehicles: steel rims with hand holes, hubs and nuts; twin tyres."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bakery.heavy.recipe import Axle, HeavyWheel
from sumo3dviz_pt.library.mesh.solids import lathe, mirrored, moved, on_both_sides
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Mesh, Transform, merge_meshes

_SEGMENTS = 24  # facets around a wheel
_HOLES = 8  # hand holes of a rim
_TWIN_GAP = 0.03  # between twin tyres [m]
_DEEP, _SHALLOW = 0.62, 0.30  # dish of reversed wheels, in half widths


def wheels_of(wheel: HeavyWheel, axle: Axle) -> Iterator[MaterialMesh]:
    """Build both wheels of an axle, or all four, in the frame (d, y, z)."""
    middle = axle.out - 0.5 * wheel.width
    for material, mesh in build_box_wheel(wheel, style=axle.style or wheel.style):
        yield from on_both_sides([(material, moved(mesh, axle.at, middle, wheel.radius))])
    yield from inner_tyres(wheel, axle)


def inner_tyres(wheel: HeavyWheel, axle: Axle) -> Iterator[MaterialMesh]:
    """Build the inner tyres of an axle with twin wheels, in the frame (d, y, z)."""
    if axle.twin:
        middle = axle.out - 1.5 * wheel.width - _TWIN_GAP
        tyre = moved(_tyre(wheel, segments=16), axle.at, middle, wheel.radius)
        yield from on_both_sides([("rubber", tyre)])


def is_reversed(wheel: HeavyWheel, axle: Axle) -> bool:
    """Return whether an axle's wheels are mounted the other way round, bulging inwards."""
    return wheel.style == "convex" and axle.style == "concave"


def full_wheel(wheel: HeavyWheel, axles: Sequence[Axle]) -> Iterator[MaterialMesh]:
    """Build one wheel that serves for all axles: where some are reversed, it has two faces."""
    yield from build_box_wheel(wheel, style=wheel.style)
    if any(is_reversed(wheel, axle) for axle in axles):
        for material, mesh in _rim(wheel, "concave", depth=_SHALLOW):
            yield material, mirrored(mesh)


def build_box_wheel(wheel: HeavyWheel, *, style: str) -> Iterator[MaterialMesh]:
    """Build a wheel around the y axis, outer face towards +y, in a style of `HeavyWheel`."""
    yield "rubber", _tyre(wheel, segments=_SEGMENTS)
    yield from _rim(wheel, style)


def _rim(wheel: HeavyWheel, style: str, *, depth: float = _DEEP) -> Iterator[MaterialMesh]:
    """Lip, dish, hub, hand holes and nuts, towards +y."""
    r, w = wheel.radius * wheel.rim, 0.5 * wheel.width
    shape = _rim_shape(style, depth)
    # The bead seat stands out from the tyre and runs in to the dish.
    lip = [(r + 0.012, 0.80 * w), (r + 0.008, 0.90 * w), (r - 0.016, 0.88 * w)]
    dish = [(r * radius, w * y) for radius, y in shape.dish]
    yield wheel.material, lathe([*lip, *dish], segments=_SEGMENTS, crease=0.55)
    turned = lathe([(r * radius, w * y) for radius, y in shape.hub], segments=14, crease=0.5)
    yield "trim" if style == "concave" else wheel.material, turned
    yield "trim", _around(_hole(dish[1], dish[2]), count=_HOLES)
    count = 5 if style == "cap" else 10
    yield "chrome", _around(_nut(r * shape.nuts[0], w * shape.nuts[1]), count=count)


Profile = list[tuple[float, float]]
"""(radius, y) as shares of the rim's radius and of half the tyre's width."""


@dataclass(frozen=True, slots=True)
class _RimShape:
    """Profiles of a rim.

    Attributes:
        dish: From the tyre inwards.
        hub: From the dish inwards.
        nuts: Where the nuts stand.
    """

    dish: Profile
    hub: Profile
    nuts: tuple[float, float]


def _rim_shape(style: str, depth: float) -> _RimShape:
    """The rim of a wheel's style, with the depth of a concave dish."""
    if style == "convex":
        return _RimShape(
            dish=[(0.90, 0.42), (0.78, 0.55), (0.63, 0.86), (0.46, 0.86)],
            hub=[(0.43, 0.86), (0.41, 1.10), (0.30, 1.16), (0.0, 1.18)],
            nuts=(0.585, 0.86),
        )
    if style == "concave":
        return _RimShape(
            dish=[(0.93, 0.1), (0.90, 0.2 - depth), (0.72, -depth), (0.48, -depth)],
            hub=[(0.42, -depth), (0.40, 0.35), (0.30, 0.52), (0.0, 0.54)],
            nuts=(0.60, -depth),
        )
    return _RimShape(
        dish=[(0.93, 0.52), (0.84, 0.56), (0.62, 0.70), (0.40, 0.66)],
        hub=[(0.34, 0.66), (0.32, 0.80), (0.0, 0.84)],
        nuts=(0.50, 0.68),
    )


def _tyre(wheel: HeavyWheel, *, segments: int) -> Mesh:
    """Tread with shoulders and side walls."""
    r, w, rim = wheel.radius, 0.5 * wheel.width, wheel.radius * wheel.rim
    wall = r - rim
    profile = [
        (rim - 0.03, -0.9 * w),
        (r - 0.03, -0.97 * w),
        (r, -0.78 * w),
        (r, 0.78 * w),
        (r - 0.018, 0.88 * w),
        (rim + 0.45 * wall, w),
        (rim + 0.008, 0.84 * w),
    ]
    return lathe(profile, segments=segments, crease=0.5)


def _hole(outer: tuple[float, float], inner: tuple[float, float]) -> Mesh:
    """A dark oval patch just before the dish between two points of its profile."""
    (r0, y0), (r1, y1) = outer, inner
    middle, half = 0.5 * (r0 + r1), 0.34 * abs(r0 - r1)
    turn = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    radius = middle + half * np.cos(turn)
    share = (radius - r0) / (r1 - r0)
    y = y0 + share * (y1 - y0) + 0.004
    x = 1.25 * half * np.sin(turn)
    vertices = np.column_stack([x, y, radius])
    faces = np.array([(0, k, k + 1) for k in range(1, 7)])
    a, b, c = vertices[faces[0]]
    if np.cross(b - a, c - a)[1] < 0.0:
        faces = faces[:, ::-1]
    normal = np.cross(
        vertices[faces[0, 1]] - vertices[faces[0, 0]], vertices[faces[0, 2]] - vertices[faces[0, 0]]
    )
    normal /= np.linalg.norm(normal)
    return Mesh(vertices, faces, np.tile(normal, (8, 1)))


def _nut(radius: float, seat: float) -> Mesh:
    """A wheel nut that stands on the dish."""
    nut = lathe([(0.020, seat - 0.004), (0.016, seat + 0.03), (0.0, seat + 0.036)], segments=4)
    return moved(nut, 0.0, 0.0, radius)


def _around(mesh: Mesh, *, count: int) -> Mesh:
    """Copies of a mesh around the y axis."""
    turns = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    return merge_meshes([_turned(mesh, float(turn)) for turn in turns])


def _turned(mesh: Mesh, turn: float) -> Mesh:
    """A mesh turned about the y axis [rad]."""
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.eye(4)
    matrix[0, 0], matrix[0, 2], matrix[2, 0], matrix[2, 2] = c, s, -s, c
    return Transform(matrix).mesh(mesh)


def far_box_wheels(wheel: HeavyWheel, axles: Sequence[Axle]) -> Iterator[MaterialMesh]:
    """Build wheels as short cylinders with discs, in the frame (d, y, z)."""
    r, w = wheel.radius, 0.5 * wheel.width
    rim = r * wheel.rim
    for axle in axles:
        depth = -0.5 * w if (axle.style or wheel.style) == "concave" else 0.8 * w
        back = -w if not axle.twin else -3.0 * w
        tyre = lathe([(r, back), (r, w), (rim, w)], segments=10, crease=0.8)
        disc = lathe([(rim, w), (0.7 * rim, depth), (0.0, depth)], segments=10, crease=0.4)
        for material, mesh in (("rubber", tyre), (wheel.material, disc)):
            yield from on_both_sides([(material, moved(mesh, axle.at, axle.out - w, r))])
