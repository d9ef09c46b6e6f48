"""Plain bodies of the right size for every class that has no models yet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from sumo3dviz_pt.library.mesh.solids import box, by_material, fitted
from sumo3dviz_pt.library.mesh.stacks import Level, stack
from sumo3dviz_pt.library.vehicles import plain_people, plain_road
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype

Piece = tuple[str, Mesh]
"""Material and mesh."""

Size = tuple[float, float, float]
"""Length, width, height [m]."""

Builder = Callable[[Size, bool], Iterator[Piece]]
"""Makes the pieces of a size; the flag asks for the detailed level."""

_CAR_LENGTH = 24.0
"""Trains are made of cars of about this length [m]."""

_MOST_CARS = 9


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


def _rail(size: Size, fine: bool) -> Iterator[Piece]:
    """A train of coupled cars on low bogies; both ends are sloped."""
    length, width, height = size
    count = max(1, min(_MOST_CARS, round(length / _CAR_LENGTH))) if fine else 1
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
            low, high = (x - reach, -0.36 * width, 0.0), (x + reach, 0.36 * width, 0.2 * height)
            yield "trim", box(low, high)


def _rail_car(
    span: tuple[float, float], size: Size, *, ends: tuple[bool, bool], fine: bool
) -> Iterator[Piece]:
    """One car; outer ends lean and carry glass."""
    _, width, height = size
    lean = [0.1 * height if end else 0.0 for end in ends]
    half = width / 2
    glass = [("glass" if end else "trim") for end in ends]

    def level(z: float, inset: float, slope: float, side: str = "paint") -> Level:
        front, rear = span[0] - slope * lean[0], span[1] + slope * lean[1]
        names = glass if side == "glass" else ["paint", "paint"]
        return Level(z * height, front, rear, half - inset, side, names[0], names[1], "paint")

    levels = [
        level(0.11, 0.06, 0.6, "trim"),
        level(0.17, 0.0, 0.0),
        level(0.42, 0.0, 0.6, "glass"),
        level(0.72, 0.03, 2.2),
        level(0.90, 0.09, 3.6),
        level(1.0, 0.22 * width, 6.0),
    ]
    length = span[0] - span[1]
    count = min(4, round(length / 4.0), _spare_windows(size[0])) if fine else 0
    windows = [(k + 1) / (count + 1) for k in range(count)]
    yield from stack(levels, radius=0.12, segments=1, windows=windows)


def _spare_windows(length: float) -> int:
    """How many pillars each car of a train can have within 1,500 triangles."""
    cars = max(1, min(_MOST_CARS, round(length / _CAR_LENGTH)))
    return max(0, int((1450.0 / cars - 150.0) / 40.0))


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
    **dict.fromkeys(
        (
            "passenger",
            "private",
            "vip",
            "hov",
            "taxi",
            "evehicle",
            "authority",
            "army",
            "custom1",
            "custom2",
        ),
        plain_road.car,
    ),
    **dict.fromkeys(("bus", "coach"), plain_road.bus),
    **dict.fromkeys(("delivery", "emergency"), plain_road.delivery),
    "truck": plain_road.truck,
    "trailer": plain_road.trailer,
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
