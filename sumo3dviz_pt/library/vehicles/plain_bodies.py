"""Plain bodies of the right size, for classes and sizes that no model of the catalogue serves."""

from __future__ import annotations

from collections.abc import Iterator

from sumo3dviz_pt.library.mesh.solids import (
    bevelled,
    by_material,
    fitted,
    lathe,
    moved,
    on_both_sides,
)
from sumo3dviz_pt.library.vehicles.parts import MaterialMesh
from sumo3dviz_pt.library.vehicles.plain_lamps import UNLIT
from sumo3dviz_pt.model.scene import Part, Prototype

BodySize = tuple[float, float, float]
"""Length, width, height [m]."""

_WITHOUT_WHEELS = UNLIT | {"ship", "cable_car"}
"""Classes that do not roll; a word that is no class does."""

_LARGEST_WHEEL = 0.5
"""Radius [m]."""


def plain_body(vclass: str, *, length: float, width: float, height: float) -> Prototype:
    """Build a body of a size: a bevelled box, on wheels where it rolls.

    Args:
        vclass: SUMO's vClass, or another word.
        length: [m], > 0.
        width: [m], > 0.
        height: [m], > 0.
    """
    levels = []
    for fine in (True, False):
        pieces = list(_pieces(vclass, (length, width, height), fine=fine))
        pieces = fitted(pieces, length=length, width=width, height=height)
        levels.append(tuple(Part(mesh, name) for name, mesh in by_material(pieces).items()))
    return Prototype(vclass, levels[0], levels[1])


def _pieces(vclass: str, size: BodySize, *, fine: bool) -> Iterator[MaterialMesh]:
    """The box with two axles."""
    length, width, height = size
    rolls = vclass not in _WITHOUT_WHEELS
    radius = min(_LARGEST_WHEEL, 0.2 * height, 0.15 * length) if rolls else 0.0
    low, high = (-length, -0.5 * width, radius), (0.0, 0.5 * width, height)
    yield "paint", bevelled(low, high, bevel=0.04 * min(size))
    if not rolls:
        return
    # Half of each wheel is inside the box, and its outer face a little within the box's width.
    tread = 0.3 * min(radius, width)
    wheel = lathe([(radius, -tread), (radius, tread), (0.0, tread)], segments=14 if fine else 6)
    for x in (-0.2 * length, -0.8 * length):
        yield from on_both_sides([("rubber", moved(wheel, x, 0.49 * width - tread, radius))])
