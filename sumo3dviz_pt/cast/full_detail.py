"""Bodies in full detail, for close views, and how much there is of each material in them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.library.vehicles.packed import FULL, read_levels
from sumo3dviz_pt.library.vehicles.stretching import stretched
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.lamps import VehicleLamp
from sumo3dviz_pt.model.scene import Part, Prototype


def full_prototypes(names: Iterable[str]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail of vehicles of the catalogue.

    Args:
        names: Of vehicles that have them.

    Returns:
        `<name>/full` and `<name>/wheel` by their names.
    """
    found = {}
    for name in sorted(names):
        levels = read_levels(catalog.find("vehicles", name).folder / FULL)
        for level, meshes in levels.items():
            parts = tuple(Part(mesh, material) for material, mesh in meshes.items())
            found[f"{name}/{level}"] = Prototype(f"{name}/{level}", parts, ())
    return found


def full_bodies(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail by the names that units give them, lamps included.

    Args:
        units: Of models that have full detail.
    """
    wanted = {unit.full: unit for unit in units}
    made = full_prototypes({unit.source for unit in wanted.values()})
    found = {}
    for name, unit in wanted.items():
        body = made[f"{unit.source}/full"]
        if unit.given is not None:
            body = stretched(body, unit.given, name=name)
        found[name] = replace(body, lamps=unit.prototype.lamps)
        found[unit.wheel] = made[unit.wheel]
    return found


def counted(prototype: Prototype) -> dict[str, int]:
    """Return the triangles of a body by material."""
    found: dict[str, int] = {}
    for part in prototype.parts:
        found[part.material] = found.get(part.material, 0) + len(part.mesh.faces)
    return found


def counted_bodies(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Return bodies and wheels by the names of `full_bodies`, without shape: reports only count.

    Args:
        units: Of models that have full detail.
    """
    found = {}
    for unit in units:
        meta = catalog.find("vehicles", unit.source).meta
        found[unit.full] = _shapeless(unit.full, meta["full"], unit.prototype.lamps)
        found[unit.wheel] = _shapeless(unit.wheel, meta["wheel"])
    return found


def _shapeless(
    name: str, counts: Mapping[str, int], lamps: tuple[VehicleLamp, ...] = ()
) -> Prototype:
    """A body of as many triangles of each material, all of which lie in one point."""
    point = np.zeros((1, 3))
    parts = (Part(Mesh(point, np.zeros((n, 3), np.int64)), kind) for kind, n in counts.items())
    return Prototype(name, tuple(parts), (), lamps=lamps)
