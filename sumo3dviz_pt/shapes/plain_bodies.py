"""Plain bodies of the right size for every class that has no models yet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype
from sumo3dviz_pt.shapes import plain_people
from sumo3dviz_pt.shapes.plain_wheels import road_wheels
from sumo3dviz_pt.shapes.solids import box, by_material, fitted
from sumo3dviz_pt.shapes.stacks import Level, stack

Piece = tuple[str, Mesh]
"""Material and mesh."""

Size = tuple[float, float, float]
"""Length, width, height [m]."""

Builder = Callable[[Size, bool], Iterator[Piece]]
"""Makes the pieces of a size; the flag asks for the detailed level."""

_CAR_LENGTH = 24.0
"""Trains are made of cars of about this length [m]."""


def plain_body(vclass: str, *, length: float, width: float, height: float) -> Prototype:
    """Build a recognisable body of a size.

    Args:
        vclass: SUMO's vClass; unknown ones get a bevelled box.
        length: [m], > 0.
        width: [m], > 0.
        height: [m], > 0.
    """
    build = _BUILDERS.get(vclass, _container)
    levels = []
    for fine in (True, False):
        pieces = list(build((length, width, height), fine))
        pieces = fitted(pieces, length=length, width=width, height=height)
        levels.append(tuple(Part(mesh, name) for name, mesh in by_material(pieces).items()))
    return Prototype(vclass, levels[0], levels[1])


def _bus(size: Size, fine: bool) -> Iterator[Piece]:
    """A city bus: large windows all around, doors on the right are left out."""
    length, width, height = size
    half, rear = width / 2 - 0.01, -length
    belt, sill, head = 0.36 * height, 0.28 * height, 0.80 * height
    levels = [
        Level(0.09 * height, -0.03, rear, half, side="trim"),
        Level(0.14 * height, 0.0, rear, half),
        Level(sill, 0.0, rear, half, ends="glass", rear_end="paint"),
        Level(belt, -0.01, rear, half, side="glass", ends="glass", pillar="trim"),
        Level(head, -0.12, rear, half - 0.03, ends="trim"),
        Level(0.94 * height, -0.18, rear + 0.05, half - 0.06),
        Level(height, -0.55, rear + 0.35, half - 0.35),
    ]
    count = max(2, round(length / 1.6)) if fine else 0
    windows = tuple((k + 0.9) / (count + 0.8) for k in range(count))
    yield from stack(levels, radius=0.16, segments=3 if fine else 1, windows=windows[:9])
    axles = [-0.22 * length, -0.72 * length]
    yield from road_wheels(axles, radius=0.145 * height, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=0.19 * height, fine=fine)


def _end_lamps(size: Size, *, low: float, fine: bool) -> Iterator[Piece]:
    """White lamps in front and red ones behind."""
    length, width, height = size
    if not fine:
        return
    for s in (-1.0, 1.0):
        y = sorted((s * 0.32 * width, s * 0.42 * width))
        top = low + 0.05 * height
        yield "lamp_white", box((-0.05, y[0], low), (0.006, y[1], top))
        yield "lamp_red", box((-length - 0.006, y[0], low), (0.05 - length, y[1], top + 0.03))


def _cab(front: float, rear: float, half: float, height: float) -> list[Level]:
    """Levels of a cab over the engine."""
    return [
        Level(0.13 * height, front - 0.03, rear, half - 0.01, side="trim"),
        Level(0.24 * height, front, rear, half),
        Level(0.50 * height, front, rear, half, ends="glass", rear_end="paint"),
        Level(0.56 * height, front - 0.02, rear, half, side="glass", ends="glass",
              rear_end="paint", pillar="paint"),
        Level(0.84 * height, front - 0.14, rear, half - 0.03),
        Level(0.94 * height, front - 0.24, rear, half - 0.05),
        Level(height, front - 0.55, rear + 0.05, half - 0.25),
    ]


def _cargo(front: float, rear: float, half: float, span: tuple[float, float]) -> list[Level]:
    """Levels of a box body between two heights."""
    low, high = span
    return [
        Level(low, front, rear, half, side="frame"),
        Level(high - 0.03, front, rear, half, side="frame"),
        Level(high, front - 0.03, rear + 0.03, half - 0.03, side="frame"),
    ]


def _truck(size: Size, fine: bool) -> Iterator[Piece]:
    """A rigid truck: cab, box and frame."""
    length, width, height = size
    half, radius = width / 2 - 0.01, min(0.48, 0.17 * height, 0.1 * length)
    cab_rear = -min(2.0, 0.3 * length)
    segments = 2 if fine else 1
    yield from stack(_cab(0.0, cab_rear, half, 0.92 * height), radius=0.1, segments=segments,
                     windows=(0.62,) if fine else ())
    yield from stack(_cargo(cab_rear - 0.12, -length, half, (2.2 * radius, height)), radius=0.03,
                     segments=1)
    yield "trim", box((-length, -0.4 * width, 1.1 * radius), (cab_rear, 0.4 * width, 2.2 * radius))
    axles = [0.55 * cab_rear, -0.78 * length]
    yield from road_wheels(axles, radius=radius, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=1.2 * radius, fine=fine)


def _trailer(size: Size, fine: bool) -> Iterator[Piece]:
    """An articulated truck: tractor and box trailer."""
    length, width, height = size
    half, radius = width / 2 - 0.01, min(0.5, 0.16 * height)
    cab_rear = -min(2.3, 0.22 * length)
    segments = 2 if fine else 1
    yield from stack(_cab(0.0, cab_rear, half, 0.94 * height), radius=0.12, segments=segments,
                     windows=(0.62,) if fine else ())
    yield from stack(_cargo(cab_rear - 0.5, -length, half, (2.4 * radius, height)), radius=0.03,
                     segments=1)
    for front, rear in ((cab_rear, -0.42 * length), (-0.62 * length, -length)):
        yield "trim", box((rear, -0.38 * width, 1.1 * radius), (front, 0.38 * width, 2.4 * radius))
    axles = [0.6 * cab_rear, -0.34 * length, *(-np.array([0.74, 0.82, 0.90]) * length)]
    keep = axles if fine else [axles[0], axles[1], axles[3]]
    yield from road_wheels(keep, radius=radius, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=1.2 * radius, fine=fine)


def _delivery(size: Size, fine: bool) -> Iterator[Piece]:
    """A panel van with a short bonnet."""
    length, width, height = size
    half, rear = width / 2 - 0.01, -length
    nose, screen = -0.13 * length, -0.26 * length
    levels = [
        Level(0.09 * height, -0.04, rear, half, side="trim"),
        Level(0.15 * height, 0.0, rear, half),
        Level(0.34 * height, -0.03, rear, half),
        Level(0.43 * height, nose, rear, half, pillar="glass", ends="glass", rear_end="paint"),
        Level(0.78 * height, screen, rear + 0.03, half - 0.08),
        Level(0.93 * height, screen - 0.12, rear + 0.06, half - 0.12),
        Level(height, screen - 0.5, rear + 0.3, half - 0.35),
    ]
    yield from stack(levels, radius=0.14, segments=3 if fine else 1)
    yield from _van_windows(levels, fine=fine)
    axles = [-0.165 * length, -0.76 * length]
    yield from road_wheels(axles, radius=0.125 * height, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=0.25 * height, fine=fine)


def _van_windows(levels: Sequence[Level], *, fine: bool) -> Iterator[Piece]:
    """Cab windows as thin slabs in the sides' slope."""
    if not fine:
        return
    low, high = levels[3], levels[4]
    begin, end = low.front - 0.22, high.front - 0.75
    corners = [(begin, low.z + 0.04, low.half - 0.005), (end, low.z + 0.04, low.half - 0.005),
               (end, high.z - 0.05, high.half + 0.008), (high.front - 0.12, high.z - 0.05,
                                                         high.half + 0.008)]
    for s in (1.0, -1.0):
        outer = np.array([(x, s * (y + 0.006), z) for x, z, y in corners])
        inner = outer - [0.0, s * 0.05, 0.0]
        yield "glass", _slab(outer[::-1] if s > 0 else outer, inner[::-1] if s > 0 else inner)


def _slab(outer: np.ndarray, inner: np.ndarray) -> Mesh:
    """A thin piece between two quads, seen from the outer one, (4, 3) each [m]."""
    from sumo3dviz_pt.shapes.solids import shaded

    vertices = np.concatenate([outer, inner])
    quads = [(0, 1, 2, 3), (7, 6, 5, 4), *((k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4)
                                           for k in range(4))]
    faces = [(q[0], q[i], q[i + 1]) for q in quads for i in (1, 2)]
    return shaded(vertices, np.array(faces), crease=0.3)


def _rail(size: Size, fine: bool) -> Iterator[Piece]:
    """A train of coupled cars on low bogies; both ends are sloped."""
    length, width, height = size
    count = max(1, min(9, round(length / _CAR_LENGTH))) if fine else 1
    pitch = length / count
    for k in range(count):
        front, rear = -k * pitch - (0.15 if k else 0.0), -(k + 1) * pitch
        rear += 0.15 if k + 1 < count else 0.0
        yield from _rail_car((front, rear), size, ends=(k == 0, k + 1 == count), fine=fine)
        if k:
            gap = (front + 0.35, -0.4 * width, 0.2 * height)
            yield "trim", box((front - 0.05, *gap[1:]), (gap[0], 0.4 * width, 0.85 * height))
        for share in (0.18, 0.82):
            x = front + share * (rear - front)
            reach = min(1.3, 0.1 * pitch)
            yield "trim", box((x - reach, -0.36 * width, 0.0), (x + reach, 0.36 * width, 0.2 * height))


def _rail_car(
    span: tuple[float, float], size: Size, *, ends: tuple[bool, bool], fine: bool
) -> Iterator[Piece]:
    """One car; outer ends lean and carry glass."""
    _, width, height = size
    lean = [0.1 * height if end else 0.0 for end in ends]
    half = width / 2
    glass = [("glass" if end else "trim") for end in ends]

    def level(z: float, inset: float, slope: float, side: str = "paint", lit: bool = False) -> Level:
        front, rear = span[0] - slope * lean[0], span[1] + slope * lean[1]
        names = glass if lit else ["paint", "paint"]
        return Level(z * height, front, rear, half - inset, side, names[0], names[1], "paint")

    levels = [
        level(0.11, 0.06, 0.6, "trim"), level(0.17, 0.0, 0.0),
        level(0.42, 0.0, 0.6, "glass", True), level(0.72, 0.03, 2.2),
        level(0.90, 0.09, 3.6), level(1.0, 0.22 * width, 6.0),
    ]
    length = span[0] - span[1]
    count = min(4, round(length / 4.0)) if fine else 0
    windows = [(k + 1) / (count + 1) for k in range(count)]
    yield from stack(levels, radius=0.12, segments=1, windows=windows)


def _container(size: Size, fine: bool) -> Iterator[Piece]:
    """A box with bevelled edges."""
    length, width, height = size
    bevel = 0.04 * min(size)
    half = width / 2
    levels = [
        Level(0.0, -bevel, bevel - length, half - bevel),
        Level(bevel, 0.0, -length, half),
        Level(height - bevel, 0.0, -length, half),
        Level(height, -bevel, bevel - length, half - bevel),
    ]
    yield from stack(levels, radius=bevel, segments=2 if fine else 1)


def _ship(size: Size, fine: bool) -> Iterator[Piece]:
    """A hull with a pointed bow and a deckhouse."""
    length, width, height = size
    half = width / 2
    bow = min(1.2 * half, 0.3 * length)
    hull = [
        Level(0.0, -0.12 * length, -0.97 * length, 0.75 * half),
        Level(0.40 * height, -0.02 * length, -length, half),
        Level(0.45 * height, 0.0, -length, half, side="frame"),
    ]
    yield from stack(hull, radius=min(bow, 0.7 * half), segments=4 if fine else 2)
    house = [
        Level(0.44 * height, -0.55 * length, -0.92 * length, 0.62 * half, side="frame"),
        Level(0.66 * height, -0.55 * length, -0.92 * length, 0.62 * half, side="glass"),
        Level(0.84 * height, -0.57 * length, -0.91 * length, 0.60 * half, side="frame"),
        Level(height, -0.58 * length, -0.90 * length, 0.58 * half, side="frame"),
    ]
    yield from stack(house, radius=0.1 * half, segments=1)


_BUILDERS: Mapping[str, Builder] = {
    **dict.fromkeys(("bus", "coach"), _bus),
    **dict.fromkeys(("delivery", "emergency", "army", "authority"), _delivery),
    "truck": _truck,
    "trailer": _trailer,
    **dict.fromkeys(
        ("tram", "rail_urban", "rail", "rail_electric", "rail_fast", "subway", "cable_car"), _rail
    ),
    "ship": _ship,
    "bicycle": lambda size, fine: plain_people.bicycle(fine=fine),
    "scooter": lambda size, fine: plain_people.scooter(fine=fine),
    "motorcycle": lambda size, fine: plain_people.motorcycle(fine=fine),
    "moped": lambda size, fine: plain_people.motorcycle(fine=fine),
    "pedestrian": lambda size, fine: plain_people.pedestrian(fine=fine),
    "wheelchair": lambda size, fine: plain_people.wheelchair(fine=fine),
}
"""What stands for each class; all others get `_container`."""
