"""Parts that two-wheelers share: wheels, bands, bent tubes, lofts, lamps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.mesh.solids import lathe, shaded, tube
from sumo3dviz_pt.library.people.skin import Stack, closed
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, Transform
from sumo3dviz_pt.model.scene import VehicleLamp

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Fineness:
    """How finely a two-wheeler is modelled.

    Attributes:
        segments: Facets around a large wheel.
        spokes: Of a spoked wheel.
        sides: Facets around a tube.
        small: Whether small things are there.
    """

    segments: int
    spokes: int
    sides: int
    small: bool


FULL = Fineness(48, 32, 10, True)
MIDDLE = Fineness(26, 18, 6, True)
FAR = Fineness(10, 0, 3, False)


@dataclass(frozen=True, slots=True)
class CycleWheel(RecipeValue):
    """A two-wheeler's wheel.

    Attributes:
        radius: Of the tyre [m].
        tyre: Half width of the tyre [m].
        spoked: Whether it has wire spokes; if not, it has cast ones.
        disc: Radius of a brake disc, 0 for none [m].
    """

    radius: float
    tyre: float
    spoked: bool = True
    disc: float = 0.0


def wheel(shape: CycleWheel, fine: Fineness) -> Iterator[MaterialMesh]:
    """Build a wheel around the y axis through the origin."""
    r, t = shape.radius, shape.tyre
    deep = min(2.0 * t, 0.36 * r)
    if not fine.small:
        wedge = [(r - deep, -0.8 * t), (r, 0.0), (r - deep, 0.8 * t)]
        yield "rubber", lathe(wedge, segments=fine.segments if r > 0.15 else 7)
        if not shape.spoked:
            yield (
                "rim",
                lathe([(r - deep, -0.3 * t), (r - deep, 0.3 * t), (0.0, 0.3 * t)], segments=6),
            )
        return
    segments = max(12, round(fine.segments * min(1.0, r / 0.25)))
    turn = np.radians([-128.0, -84.0, -45.0, 0.0, 45.0, 84.0, 128.0])
    half = 0.5 * deep
    ring = [(r - half + half * float(np.cos(a)), t * float(np.sin(a))) for a in turn]
    yield "rubber", lathe(ring, segments=segments, crease=1.2)
    inner = ring[0][0]
    w = abs(ring[0][1])
    well = 0.30 * deep + 0.006
    rim = [(inner - well, 0.55 * w), (inner - well, -0.55 * w), (inner, -w)]
    rim = [(inner + 0.002, w), (inner - 0.4 * well, 0.9 * w), *rim]
    yield "rim", lathe(rim[::-1], segments=segments, crease=0.6)
    yield "rim", lathe([(inner - well, -0.5 * w), (inner - well, 0.5 * w)][::-1], segments=segments)
    yield from _hub(shape, inner - well, fine)


def _hub(shape: CycleWheel, rim: float, fine: Fineness) -> Iterator[MaterialMesh]:
    """Hub, spokes and brake disc."""
    half, flange = (0.034, 0.022) if shape.spoked else (0.75 * shape.tyre, 0.042)
    hub = [(0.0, -half), (flange, -half), (flange, -0.8 * half), (0.6 * flange, -0.7 * half)]
    hub += [(r, -y) for r, y in hub[::-1]]
    yield "rim", lathe(hub, segments=10, crease=0.6)
    if shape.spoked:
        for k in range(fine.spokes):
            side = 1.0 if k % 2 else -1.0
            a = 2.0 * np.pi * k / fine.spokes
            # Wires leave the hub nearly along its rim and cross.
            lead = a + (0.9 if (k // 2) % 2 else -0.9)
            ends = [
                (flange * np.sin(lead), 0.85 * side * half, flange * np.cos(lead)),
                (rim * np.sin(a), 0.0, rim * np.cos(a)),
            ]
            yield "rim", tube(ends, radius=0.0011, sides=3)
    else:
        for a in 2.0 * np.pi * np.arange(5) / 5:
            ends = [
                (0.8 * flange * np.sin(a), 0.0, 0.8 * flange * np.cos(a)),
                (rim * np.sin(a + 0.1), 0.0, rim * np.cos(a + 0.1)),
            ]
            yield "trim", tube(ends, radius=(0.5 * shape.tyre, 0.32 * shape.tyre), sides=6)
    if shape.disc:
        y, r = 0.9 * half + 0.012, shape.disc
        disc = [(0.68 * r, y), (0.68 * r, y - 0.004), (r, y - 0.004), (r, y), (0.68 * r, y)]
        yield "rim", lathe(disc, segments=max(16, fine.segments * 2 // 3), crease=0.4)


def band(path: Floats, *, half: float, thick: float) -> Mesh:
    """Build a curved, closed strip along a path, whose outside looks away from the path's middle.

    Args:
        path: Points in a plane of constant y, (n, 3) [m].
        half: Half width along y [m].
        thick: Thickness [m].
    """
    middle = path.mean(axis=0)
    away = path - middle
    away[:, 1] = 0.0
    along = np.gradient(path, axis=0)
    normal = np.cross(along, [0.0, 1.0, 0.0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.sign((normal * away).sum(axis=1, keepdims=True))
    wide = np.array([0.0, half, 0.0])
    crown = 0.25 * half * normal
    ring = np.stack(
        [
            path - wide,
            path + crown,
            path + wide,
            path + wide - thick * normal,
            path + crown - thick * normal,
            path - wide - thick * normal,
        ],
        axis=1,
    )
    vertices, faces = closed(ring, bottom=True, top=True)
    if _volume(vertices, faces) < 0.0:
        faces = faces[:, ::-1]
    return shaded(vertices, faces, crease=0.6)


def _volume(vertices: Floats, faces: Ints) -> float:
    """Signed volume of a closed mesh [m3]."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def arc(middle: Point, radius: float, begin: float, end: float, count: int) -> Floats:
    """Return points of an arc in a plane of constant y, (count, 3) [m].

    Args:
        middle: Of the circle [m].
        radius: Of the circle [m].
        begin: Angle of the first point, from +x upwards [deg].
        end: Angle of the last point [deg].
        count: Number of points.
    """
    a = np.radians(np.linspace(begin, end, count))
    return np.array(middle) + radius * np.stack([np.cos(a), 0.0 * a, np.sin(a)], axis=1)


def loft(
    sections: Sequence[Sequence[float]], *, rings: int, sides: int, crease: float = 0.8
) -> Mesh:
    """Build a rounded body along x.

    Args:
        sections: From front to rear: distance behind x = 0, height of the middle, reach up,
            reach down, half width [m], exponent of the outline.
        rings: Rings along it.
        sides: Points of a ring.
        crease: Angle above which an edge stays sharp [rad].
    """
    rows = [(z, 0.0, up, down, half, d, d, power) for d, z, up, down, half, power in sections]
    grid = Stack(np.array(rows)).grid(rings, sides)
    turned = np.stack([-grid[..., 2], grid[..., 1], grid[..., 0]], axis=-1)
    vertices, faces = closed(turned, bottom=True, top=True)
    return shaded(vertices, faces, crease=crease)


def facing(mesh: Mesh, at: Point, *, yaw: float = 0.0, pitch: float = 0.0) -> Mesh:
    """Put something turned around y at a place, so that its +y end looks forward (+x).

    Args:
        mesh: Around the origin.
        at: The place [m].
        yaw: By how much it looks to the left instead [rad].
        pitch: By how much it looks up [rad].
    """
    quarter = Transform.from_pose((0.0, 0.0, 0.0), yaw=-np.pi / 2)
    return (Transform.from_pose(at, yaw=yaw, pitch=pitch) @ quarter).mesh(mesh)


def round_lamp(at: Point, radius: float) -> Iterator[MaterialMesh]:
    """Build a bowl with a mirror and a bulb that looks forward."""
    bowl = [(0.0, -1.1 * radius), (0.62 * radius, -0.9 * radius), (0.97 * radius, -0.15 * radius)]
    bowl += [(1.04 * radius, 0.0), (1.04 * radius, 0.06 * radius), (0.92 * radius, 0.07 * radius)]
    yield "trim", facing(lathe(bowl, segments=14, crease=0.7), at)
    mirror = [(0.93, 0.07), (0.78, -0.14), (0.52, -0.34), (0.24, -0.44)]
    bulb = [(0.24, -0.44), (0.24, -0.12), (0.14, 0.0), (0.0, 0.03)]
    for material, profile in (("lamp_bowl", mirror), ("lamp_white", bulb)):
        scaled = [(radius * r, radius * y) for r, y in profile]
        yield material, facing(lathe(scaled, segments=14, crease=1.2), at)


def lamp(role: str, at: Point, size: tuple[float, float], *, back: bool = False) -> VehicleLamp:
    """Return a lamp that can shine.

    Args:
        role: What lights it.
        at: Its middle [m].
        size: Width and height [m].
        back: Whether it shines backward instead of forward.
    """
    return VehicleLamp(role, at, size, float(np.pi) if back else 0.0)


def tubes(
    runs: Sequence[tuple[Sequence[Point], float]], material: str, fine: Fineness
) -> Iterator[MaterialMesh]:
    """Build bent tubes of one material.

    Args:
        runs: Path and radius of each [m].
        material: Of all of them.
        fine: How finely they are modelled.
    """
    for path, radius in runs:
        yield material, tube(path, radius=radius, sides=fine.sides)
