"""Bodies in full detail as reports need them: how much there is of each material, without shape.

A report on a scene says how many triangles a shot holds and of what. Building a body for that
takes seconds; `full_counts.json` beside this module has the numbers, written by
`tools/count_full_bodies.py`. A vehicle whose recipe was changed since then, or that is not
listed, is built.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.cast.full_detail import full_bodies
from sumo3dviz_pt.library.vehicles.bake import digest_of
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype

COUNTS = Path(__file__).with_name("full_counts.json")
"""By vehicle: its recipe's digest, and triangles by material of its levels `full` and `wheel`."""


def recipe_digest(name: str) -> str:
    """Return the digest of all that a vehicle of the catalogue is built from."""
    return digest_of(catalog.find("vehicles", name).meta)


def counted(prototype: Prototype) -> dict[str, int]:
    """Return the triangles of a body by material."""
    found: dict[str, int] = {}
    for part in prototype.parts:
        found[part.material] = found.get(part.material, 0) + len(part.mesh.faces)
    return found


def counted_bodies(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Return bodies and wheels by the names of `full_bodies`, without shape where it is counted.

    Args:
        units: Of models that have full detail.
    """
    found, unknown = {}, []
    for unit in units:
        levels = _known().get(unit.source)
        if levels is None or levels["made_from"] != recipe_digest(unit.source):
            unknown.append(unit)
            continue
        found[unit.full] = _shapeless(unit.full, levels["full"], unit.prototype)
        found[unit.wheel] = _shapeless(unit.wheel, levels["wheel"])
    return {**found, **full_bodies(unknown)}


def _shapeless(name: str, parts: Mapping[str, int], like: Prototype | None = None) -> Prototype:
    """A body of as many triangles of each material, all of which lie in one point."""
    point = np.zeros((1, 3))
    return Prototype(
        name,
        tuple(Part(Mesh(point, np.zeros((n, 3), np.int64)), m) for m, n in parts.items()),
        (),
        lamps=() if like is None else like.lamps,
    )


@cache
def _known() -> Mapping[str, Any]:
    """What the file says."""
    known: dict[str, Any] = json.loads(COUNTS.read_text(encoding="utf-8"))
    return known
