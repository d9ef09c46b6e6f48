"""Cheap wheels and arches for plain bodies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sumo3dviz_pt.library.mesh.solids import lathe, mirrored, moved, prism
from sumo3dviz_pt.model.geometry import Mesh

Piece = tuple[str, Mesh]
"""Material and mesh."""

_MOST_ARCHES = 2


def road_wheels(
    axles: Sequence[float], *, radius: float, half: float, fine: bool
) -> Iterator[Piece]:
    """Pairs of wheels whose outer faces lie at |y| = half.

    Args:
        axles: x of the axles [m].
        radius: Of the tyres [m].
        half: Half width of the vehicle [m].
        fine: Whether to model rims and arches.
    """
    w = 0.32 * radius
    for material, mesh in _wheel(radius, w, segments=_segments(len(axles), fine=fine)):
        for x in axles:
            placed = moved(mesh, x, half - w, radius)
            yield material, placed
            yield material, mirrored(placed)
    if fine:
        turn = np.linspace(np.radians(-15.0), np.radians(195.0), 10)
        outline = 1.14 * radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        arch = prism(outline.tolist(), half_width=0.06)
        for x in axles[:_MOST_ARCHES]:
            placed = moved(arch, x, half - 0.066, radius)
            yield "trim", placed
            yield "trim", mirrored(placed)


def _segments(axles: int, *, fine: bool) -> int:
    """Facets around a wheel, fewer where there are many wheels."""
    if not fine:
        return 6
    return 14 if axles <= _MOST_ARCHES else 9


def _wheel(radius: float, w: float, *, segments: int) -> Iterator[Piece]:
    """A wheel around the y axis, outer face towards +y at y = w."""
    rim = 0.62 * radius
    if segments <= 6:
        yield "rubber", lathe([(radius, -w), (radius, w), (0.0, w)], segments=segments)
        return
    tyre = [(radius, -w), (radius, 0.7 * w), (0.92 * radius, w), (rim, 0.96 * w)]
    dish = [(rim, 0.96 * w), (0.9 * rim, 0.5 * w), (0.4 * rim, 0.8 * w), (0.0, 0.8 * w)]
    yield "rubber", lathe(tyre, segments=segments, crease=0.8)
    yield "rim", lathe(dish, segments=segments, crease=0.5)


def thin_wheel(x: float, *, radius: float, tyre: float, fine: bool) -> Iterator[Piece]:
    """A bicycle's or motorcycle's wheel in the plane y = 0.

    Args:
        x: Of the axle [m].
        radius: Outer radius [m].
        tyre: Radius of the tyre's cross section [m].
        fine: Whether to round the tyre and to add a hub.
    """
    inner = radius - 2.0 * tyre
    if not fine:
        wedge = [(inner, -tyre), (radius, 0.0), (inner, tyre)]
        yield "rubber", moved(lathe(wedge, segments=8 if radius > 0.2 else 6), x, 0.0, radius)
        return
    turn = np.radians([-150.0, -70.0, 0.0, 70.0, 150.0])
    ring = [(radius - tyre + tyre * float(np.cos(t)), tyre * float(np.sin(t))) for t in turn]
    rim = [(inner, 0.5 * tyre), (inner, -0.5 * tyre)]
    segments = 20 if radius > 0.2 else 12
    yield "rubber", moved(lathe(ring, segments=segments, crease=1.2), x, 0.0, radius)
    yield "rim", moved(lathe(rim, segments=segments), x, 0.0, radius)
    hub = [(0.0, -1.2 * tyre), (0.12 * radius, -tyre), (0.12 * radius, tyre), (0.0, 1.2 * tyre)]
    yield "rim", moved(lathe(hub, segments=6), x, 0.0, radius)
