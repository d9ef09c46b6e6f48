"""Plain road vehicles: car, bus, van, truck, articulated truck."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, slab
from sumo3dviz_pt.library.mesh.stacks import Level, stack
from sumo3dviz_pt.library.vehicles.plain_wheels import road_wheels
from sumo3dviz_pt.model.geometry import Mesh

Piece = tuple[str, Mesh]
"""Material and mesh."""

Size = tuple[float, float, float]
"""Length, width, height [m]."""


def car(size: Size, fine: bool) -> Iterator[Piece]:
    """A car with a bonnet and a steep rear."""
    length, width, height = size
    half, rear = width / 2 - 0.01, -length
    levels = [
        Level(0.13 * height, -0.06, rear + 0.05, half - 0.02, side="trim"),
        Level(0.22 * height, 0.0, rear, half),
        Level(0.48 * height, -0.02, rear, half),
        Level(
            0.64 * height, -0.26 * length, rear + 0.03, half - 0.03, side="glass", pillar="paint"
        ),
        Level(0.92 * height, -0.43 * length, rear + 0.07 * length, half - 0.2),
        Level(height, -0.50 * length, rear + 0.14 * length, half - 0.35),
    ]
    yield from stack(
        levels, radius=0.2, segments=3 if fine else 1, windows=(0.42, 0.72) if fine else ()
    )
    axles = [-0.2 * length, -0.79 * length]
    yield from road_wheels(axles, radius=0.21 * height, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=0.42 * height, fine=fine)


def bus(size: Size, fine: bool) -> Iterator[Piece]:
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
    yield from stack(levels, radius=0.16, segments=3 if fine else 1, windows=windows[:8])
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


def _cab(span: tuple[float, float], half: float, height: float, *, fine: bool) -> Iterator[Piece]:
    """A cab over the engine between two x [m]."""
    front, rear = span
    levels = [
        Level(0.13 * height, front - 0.03, rear, half - 0.01, side="trim"),
        Level(0.24 * height, front, rear, half),
        Level(0.50 * height, front, rear, half, ends="glass", rear_end="paint"),
        Level(
            0.56 * height,
            front - 0.02,
            rear,
            half,
            side="glass",
            ends="glass",
            rear_end="paint",
            pillar="paint",
        ),
        Level(0.84 * height, front - 0.14, rear, half - 0.03),
        Level(0.94 * height, front - 0.24, rear, half - 0.05),
        Level(height, front - 0.55, rear + 0.05, half - 0.25),
    ]
    if fine:
        yield from stack(levels, radius=0.1, segments=2, windows=(0.62,))
    else:
        yield from stack([levels[k] for k in (0, 2, 3, 4, 6)], radius=0.1, segments=1)


def _cargo(
    span: tuple[float, float], half: float, heights: tuple[float, float], *, fine: bool
) -> Iterator[Piece]:
    """A box body between two x and two heights [m]."""
    (front, rear), (low, high) = span, heights
    levels = [Level(low, front, rear, half, side="frame")]
    if fine:
        levels.append(Level(high - 0.03, front, rear, half, side="frame"))
    levels.append(Level(high, front - 0.03, rear + 0.03, half - 0.03, side="frame"))
    yield from stack(levels, radius=0.03, segments=1)


def truck(size: Size, fine: bool) -> Iterator[Piece]:
    """A rigid truck: cab, box and frame."""
    length, width, height = size
    half, radius = width / 2 - 0.01, min(0.48, 0.17 * height, 0.1 * length)
    cab_rear = -min(2.0, 0.3 * length)
    yield from _cab((0.0, cab_rear), half, 0.92 * height, fine=fine)
    yield from _cargo((cab_rear - 0.12, -length), half, (2.2 * radius, height), fine=fine)
    yield "trim", box((-length, -0.4 * width, 1.1 * radius), (cab_rear, 0.4 * width, 2.2 * radius))
    axles = [0.55 * cab_rear, -0.78 * length]
    yield from road_wheels(axles, radius=radius, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=1.2 * radius, fine=fine)


def trailer(size: Size, fine: bool) -> Iterator[Piece]:
    """An articulated truck: tractor and box trailer."""
    length, width, height = size
    half, radius = width / 2 - 0.01, min(0.5, 0.16 * height)
    cab_rear = -min(2.3, 0.22 * length)
    yield from _cab((0.0, cab_rear), half, 0.94 * height, fine=fine)
    yield from _cargo((cab_rear - 0.5, -length), half, (2.4 * radius, height), fine=fine)
    frames = ((cab_rear, -0.42 * length), (-0.62 * length, -length))
    for front, rear in frames if fine else ((cab_rear, -length),):
        yield "trim", box((rear, -0.38 * width, 1.1 * radius), (front, 0.38 * width, 2.4 * radius))
    axles = [0.6 * cab_rear, -0.34 * length, *(-np.array([0.74, 0.82, 0.90]) * length)]
    keep = axles if fine else [axles[0], axles[3]]
    yield from road_wheels(keep, radius=radius, half=width / 2, fine=fine)
    yield from _end_lamps(size, low=1.2 * radius, fine=fine)


def delivery(size: Size, fine: bool) -> Iterator[Piece]:
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
    corners = [
        (begin, low.z + 0.04, low.half - 0.005),
        (end, low.z + 0.04, low.half - 0.005),
        (end, high.z - 0.05, high.half + 0.008),
        (high.front - 0.12, high.z - 0.05, high.half + 0.008),
    ]
    for s in (1.0, -1.0):
        outer = np.array([(x, s * (y + 0.006), z) for x, z, y in corners])
        inner = outer - [0.0, s * 0.05, 0.0]
        yield "glass", slab(outer[::-1] if s > 0 else outer, inner[::-1] if s > 0 else inner)
