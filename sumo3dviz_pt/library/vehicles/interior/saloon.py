"""The passengers' room of a bus behind its driver: walls with windows, ceiling, seats, poles.

Glass is left out, as before a driver. Rows of seats stand on a platform, two on either side of
a gangway; heights are measured down from the eyes, so that who sits there looks out over the sill.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.solids import (
    bevelled,
    box,
    moved,
    on_both_sides,
    superellipsoid,
    tube,
)
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform

_LOWER = 0.2
"""From the driver's eye down to those of passengers [m]."""

_FLOOR = 1.22
"""From a seated passenger's eye down to the platform [m]."""

_SILL, _HEAD = 0.34, 0.56
"""From the eye down to a window's lower edge, and up to its upper one [m]."""

_BAY = 1.45
"""From the middle of a window's post to the next [m]."""

_POST = 0.05
"""Half the width of a post [m]."""

_WALL = 0.05
"""How thick a wall is [m]."""

_PITCH = 0.76
"""From a row of seats to the next [m]."""

_SEAT = 0.44
"""How wide a seat is [m]."""

_LEAN = 0.16
"""By how much its back leans [rad]."""


def saloon(
    half: float, *, front: float, rear: float, eye: Floats, top: float
) -> Iterator[MaterialMesh]:
    """Build the room.

    Args:
        half: Half the vehicle's width inside [m].
        front: x where it begins, behind the driver [m].
        rear: x where it ends [m].
        eye: The driver's, (3,) [m].
        top: Of the body [m].
    """
    seated, roof = float(eye[2]) - _LOWER, top - 0.12
    floor, sill = seated - _FLOOR, seated - _SILL
    head = min(seated + _HEAD, roof - 0.12)
    span = (rear + 0.1, front)
    yield from on_both_sides(_wall(half, span, floor=floor, sill=sill, head=head, roof=roof))
    yield "headliner", box((span[0], -half, roof), (span[1], half, roof + 0.03))
    yield "trim", box((span[0], -half, floor - 0.04), (span[1], half, floor))
    low, high = (span[0] - 0.04, -half, floor), (span[0], half, roof)
    yield "saloon_panel", box(low, high)
    for x in np.arange(span[1] - 0.62, span[0] + 0.7, -_PITCH):
        yield from on_both_sides(_row(half, float(x), floor=floor))
    yield from on_both_sides(_rails(half, span, floor=floor, roof=roof))


def _wall(
    half: float, span: tuple[float, float], *, floor: float, sill: float, head: float, roof: float
) -> Iterator[MaterialMesh]:
    """The left wall: a panel under the windows, posts, and the bent panel over them."""
    back, front = span
    inner, outer = half - _WALL, half
    yield "saloon_panel", bevelled((back, inner, floor), (front, outer, sill), bevel=0.012)
    ledge = [(back, inner + 0.01, sill), (front, inner + 0.01, sill)]
    yield "rubber", tube(np.array(ledge), radius=0.013, sides=8)
    duct = bevelled((back, inner - 0.14, head + 0.05), (front, outer, roof), bevel=0.05)
    yield "headliner", duct
    yield "saloon_panel", bevelled((back, inner, head), (front, outer, head + 0.06), bevel=0.012)
    # Windows open in their upper part.
    bar = head - 0.26
    yield "gloss_black", box((back, inner + 0.02, bar), (front, outer, bar + 0.026))
    for x in np.arange(front - 0.5 * _BAY, back, -_BAY):
        post = bevelled(
            (x - _POST, inner, sill - 0.01), (x + _POST, outer, head + 0.01), bevel=0.015
        )
        yield "saloon_panel", post
        for edge in (x - _POST - 0.012, x + _POST + 0.012):
            seal = [(edge, outer - 0.02, sill), (edge, outer - 0.02, head)]
            yield "rubber", tube(np.array(seal), radius=0.012, sides=6)


def _row(half: float, x: float, *, floor: float) -> Iterator[MaterialMesh]:
    """Two seats of a row, left of the gangway; `x` is where their backs begin."""
    for place in (0, 1):
        middle = half - _WALL - 0.02 - (place + 0.5) * (_SEAT + 0.02)
        wide = 0.5 * _SEAT
        yield "saloon_seat", moved(_pad(0.23, wide, 0.055), x + 0.22, middle, floor + 0.42)
        # A back leans; its shell is of plastic, its front of cloth.
        for material, behind, thick, up in (
            ("saloon_seat", 0.03, 0.04, 0.36),
            ("saloon_panel", -0.02, 0.03, 0.345),
        ):
            placed = Transform.from_pose((x + behind, middle, floor + 0.42), pitch=_LEAN)
            yield material, placed.mesh(moved(_pad(thick, wide, up), 0.0, 0.0, up - 0.04))
        foot = floor + 0.37
        yield "trim", box((x + 0.1, middle - 0.1, floor), (x + 0.3, middle + 0.1, foot))
    # A grip on the corner beside the gangway.
    turn = np.linspace(0.0, np.pi, 9)
    edge = half - _WALL - 2.0 * _SEAT - 0.06
    bow = np.column_stack(
        [
            np.full(9, x - 0.12),
            edge + 0.08 * (1.0 - np.cos(turn)),
            floor + 1.05 + 0.09 * np.sin(turn),
        ]
    )
    yield "coat_yellow", tube(bow, radius=0.014, sides=8)


def _pad(thick: float, wide: float, tall: float) -> Mesh:
    """A cushion by its half sizes [m]."""
    return superellipsoid((thick, wide, tall), squareness=3.2, segments=30, rings=28)


def _rails(
    half: float, span: tuple[float, float], *, floor: float, roof: float
) -> Iterator[MaterialMesh]:
    """Poles beside the gangway at every other row, and the rail along the ceiling."""
    y = half - _WALL - 2 * _SEAT - 0.03
    for x in np.arange(span[1] - 0.74, span[0] + 0.7, -2.0 * _PITCH):
        yield "coat_yellow", tube(np.array([(x, y, floor), (x, y, roof)]), radius=0.017, sides=10)
    long = [(span[0], y, roof - 0.11), (span[1], y, roof - 0.11)]
    yield "coat_yellow", tube(np.array(long), radius=0.016, sides=8)
