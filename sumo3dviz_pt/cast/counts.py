"""Bodies as reports need them: how much there is of each material, without shape.

Building a person in all poses takes a tenth of a second to a few, so `people_counts.json` beside
this module has the numbers, written by `tools/count_people.py`. Those whose recipe was changed
since then, or that are not listed, are built.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import Choice, FigureChoice, ModelChoice
from sumo3dviz_pt.cast.figures import Posed, person
from sumo3dviz_pt.cast.fitting import Prototypes, read_vehicle
from sumo3dviz_pt.catalog import digest_of
from sumo3dviz_pt.library.vehicles.cycles.pedalling import pedals
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Poses, Prototype

PEOPLE_COUNTS = Path(__file__).with_name("people_counts.json")
"""By family and name: the recipe's digest, materials with their triangles, bounds in detail."""


def counted_people(choices: Iterable[Choice], *, shaped: Collection[Choice] = ()) -> Prototypes:
    """Return people and riders without shape, by the names of their prototypes.

    Args:
        choices: Of bodies; those that are no people, or are not counted, are left out.
        shaped: Bodies whose shape is needed, and so that of all who look the same.
    """
    wanted = sorted({*_people(choices)} - {*_people(shaped)})
    made = {name: _shapeless(family, name) for family, name in wanted}
    return {name: prototype for name, prototype in made.items() if prototype is not None}


def count_people() -> dict[str, dict[str, Any]]:
    """Build all people and riders, and return what the file is to say of them."""
    riders = [n for n in catalog.names("vehicles") if pedals(catalog.find("vehicles", n).meta)]
    listed = {"people": catalog.names("people"), "vehicles": riders}
    return {family: {name: _count(family, name) for name in listed[family]} for family in listed}


def _people(choices: Iterable[Choice]) -> Iterator[tuple[str, str]]:
    """Family and name of all who walk or pedal."""
    for choice in choices:
        if isinstance(choice, FigureChoice):
            yield "people", choice.look
        elif isinstance(choice, ModelChoice):
            name = choice.model.name
            if pedals(catalog.find("vehicles", name).meta):
                yield "vehicles", name


def _count(family: str, name: str) -> dict[str, Any]:
    """What the file is to say of one."""
    entry = catalog.find(family, name)
    built = person(name) if family == "people" else read_vehicle(entry)
    levels = {"near": built.parts, **({"far": built.far} if family == "people" else {})}
    bounds = np.stack([part.mesh.bounds for part in built.parts])
    return {
        "made_from": digest_of(entry.meta),
        "bounds": [bounds[:, 0].min(axis=0).tolist(), bounds[:, 1].max(axis=0).tolist()],
        **{key: [[p.material, len(p.mesh.faces)] for p in some] for key, some in levels.items()},
    }


@cache
def _shapeless(family: str, name: str) -> Prototype | None:
    """A body that fills the same bounds with as many triangles; None if it was not counted."""
    entry, known = catalog.find(family, name), _known()[family].get(name)
    if known is None or known["made_from"] != digest_of(entry.meta):
        return None
    near = _posed(known["near"], known["bounds"])
    if family == "vehicles":
        return read_vehicle(entry, ridden=lambda _: near)
    far = _posed(known["far"], known["bounds"])
    return Prototype(name, near[0], far[0], poses=near[1], far_poses=far[1])


def _posed(listed: list[tuple[str, int]], bounds: list[list[float]]) -> Posed:
    """Parts of so many triangles, each of which spans the bounds, in one pose."""
    corners = np.array(bounds)
    parts = tuple(Part(Mesh(corners, np.zeros((n, 3), np.int64)), m) for m, n in listed)
    points = np.tile(corners, (len(parts), 1))[None]
    return parts, Poses(points, np.zeros_like(points))


@cache
def _known() -> Mapping[str, Any]:
    """What the file says."""
    known: dict[str, Any] = json.loads(PEOPLE_COUNTS.read_text(encoding="utf-8"))
    return known
