"""Plain bodies of the right size, for classes and sizes that no model of the catalogue serves.

They have lamps, so that vehicles without a model are lit by night too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sumo3dviz_pt.library.mesh.solids import (
    bevelled,
    by_material,
    fitted,
    lathe,
    moved,
    on_both_sides,
)
from sumo3dviz_pt.library.vehicles.lamps import End, LampSpot, find_lamps
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype, VehicleLamp

NARROW = frozenset(["bicycle", "scooter", "motorcycle", "moped"])
"""Classes with one lamp at each end."""

UNBRAKED = frozenset(["bicycle", "scooter"])
"""Classes without a lamp that shows that they brake, as in the catalogue."""

UNLIT = frozenset(["pedestrian", "wheelchair", "container", "aircraft", "drone"])
"""Classes without lamps; a word that is no class has them."""

_NARROW_SIZE = (0.12, 0.12)

_LOWEST = {True: 0.25, False: 0.15}
"""Height of a lamp as a share of the body's, at most; by whether it is narrow."""


def plain_lamps(vclass: str, meshes: Sequence[Mesh]) -> tuple[VehicleLamp, ...]:
    """Return head, tail and brake lamps on the surface of a plain body; cycles have no brake lamp.

    Args:
        vclass: SUMO's vClass.
        meshes: The body in its own frame, at least one.
    """
    if vclass in UNLIT:
        return ()
    bounds = np.stack([mesh.bounds for mesh in meshes])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    width, height = float(high[1] - low[1]), float(high[2])
    return tuple(find_lamps(_spots(vclass, width, height), meshes))


def _spots(vclass: str, width: float, height: float) -> Iterator[LampSpot]:
    """Where lamps sit on a body of a width and height [m]."""
    narrow = vclass in NARROW
    size = _NARROW_SIZE if narrow else (0.12 * width, 0.05 * width)
    # However low a body is, the upper lamp lies on it.
    size = (min(size[0], width), min(size[1], _LOWEST[narrow] * height))
    across = 0.0 if narrow else 0.36 * width
    up = 0.5 * height if narrow else min(0.42 * height, 0.85)
    ends: tuple[tuple[str, End], ...] = (("head", "front"), ("tail", "rear"), ("brake", "rear"))
    for role, view in ends[:2] if vclass in UNBRAKED else ends:
        above = 1.6 * size[1] if role == "brake" else 0.0
        # Ships have lights, but none that throws a beam.
        shown = "sign" if (vclass, role) == ("ship", "head") else role
        yield LampSpot(shown, view, (across, up + above), size)


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
