"""Plain bodies of the right size, for classes and sizes that no model of the catalogue serves."""

from __future__ import annotations

from collections.abc import Iterator

from sumo3dviz_pt.library.mesh.solids import by_material, fitted, lathe, moved
from sumo3dviz_pt.library.mesh.stacks import Level, stack
from sumo3dviz_pt.library.vehicles.build import Piece
from sumo3dviz_pt.library.vehicles.halves import on_both_sides
from sumo3dviz_pt.library.vehicles.plain_lamps import UNLIT
from sumo3dviz_pt.library.vehicles.wheelchair import wheelchair
from sumo3dviz_pt.model.scene import Part, Prototype

Size = tuple[float, float, float]
"""Length, width, height [m]."""

_WITHOUT_WHEELS = UNLIT | {"ship", "cable_car"}
"""Classes that do not roll; a word that is no class does."""

_LARGEST_WHEEL = 0.5
"""Radius [m]."""


def plain_body(vclass: str, *, length: float, width: float, height: float) -> Prototype:
    """Build a body of a size: a bevelled box, on wheels where it rolls.

    Args:
        vclass: SUMO's vClass, or another word; a `wheelchair` is one with a person in it.
        length: [m], > 0.
        width: [m], > 0.
        height: [m], > 0.
    """
    levels = []
    for fine in (True, False):
        if vclass == "wheelchair":
            pieces = list(wheelchair(fine=fine))
        else:
            pieces = list(_box((length, width, height), vclass not in _WITHOUT_WHEELS, fine=fine))
        pieces = fitted(pieces, length=length, width=width, height=height)
        levels.append(tuple(Part(mesh, name) for name, mesh in by_material(pieces).items()))
    return Prototype(vclass, levels[0], levels[1])


def _box(size: Size, rolling: bool, *, fine: bool) -> Iterator[Piece]:
    """A box with bevelled edges; one that rolls stands on two axles."""
    length, width, height = size
    bevel = 0.04 * min(size)
    half = width / 2
    radius = min(_LARGEST_WHEEL, 0.2 * height, 0.15 * length) if rolling else 0.0
    levels = [
        Level(radius, -bevel, bevel - length, half - bevel),
        Level(radius + bevel, 0.0, -length, half),
        Level(height - bevel, 0.0, -length, half),
        Level(height, -bevel, bevel - length, half - bevel),
    ]
    yield from stack(levels, radius=bevel, segments=2 if fine else 1)
    if rolling:
        yield from _wheels(size, radius, fine=fine)


def _wheels(size: Size, radius: float, *, fine: bool) -> Iterator[Piece]:
    """Two pairs of wheels, half of each inside the box and their outer faces within its width."""
    length, width, _ = size
    tread = 0.3 * min(radius, width)
    profile = [(radius, -tread), (radius, tread), (0.0, tread)]
    wheel = lathe(profile, segments=14 if fine else 6)
    for x in (-0.2 * length, -0.8 * length):
        yield from on_both_sides([("rubber", moved(wheel, x, 0.49 * width - tread, radius))])
