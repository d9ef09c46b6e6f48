"""Builds two-wheelers with their riders: bicycle, e-scooter, moped, motorcycle.

The key `recipe` of an `asset.yaml` holds `model` (one of `MODELS`), what that model asks
for, `frame` (a material) and `rider` (a recipe of `people`). What is made of `paint` or
`cloth` takes the road user's colour.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.mesh.solids import by_material, moved
from sumo3dviz_pt.library.vehicles.build import (
    BakedVehicle,
    Builder,
    FullVehicle,
    Recipe,
    WheelPlace,
)
from sumo3dviz_pt.library.vehicles.cycles.bicycle import bicycle, e_scooter
from sumo3dviz_pt.library.vehicles.cycles.machine import Machine
from sumo3dviz_pt.library.vehicles.cycles.moped import moped
from sumo3dviz_pt.library.vehicles.cycles.motorcycle import motorcycle
from sumo3dviz_pt.library.vehicles.cycles.parts import FAR, FULL, MIDDLE, Fineness, Piece, wheel
from sumo3dviz_pt.library.vehicles.cycles.rider import rider

MODELS: Mapping[str, Callable[[Mapping[str, Any]], Machine]] = {
    "bicycle": bicycle,
    "e_scooter": e_scooter,
    "moped": moped,
    "motorcycle": motorcycle,
}
"""By the word that a recipe has under `model`."""


def machine_of(recipe: Recipe) -> Machine:
    """The two-wheeler of a recipe.

    Raises:
        ConfigError: If its model is unknown.
    """
    own = recipe["recipe"]
    if own["model"] not in MODELS:
        raise ConfigError(f"no two-wheeler is called {own['model']!r}; known: {', '.join(MODELS)}")
    return MODELS[own["model"]](own)


def bake(recipe: Recipe) -> BakedVehicle:
    """The levels that travel with the package."""
    machine = machine_of(recipe)
    places = tuple(
        WheelPlace((x, 0.0, machine.wheel.radius), machine.wheel.radius, steered=number == 0)
        for number, x in enumerate(machine.axles)
    )
    near, far = (
        by_material(
            [
                *_body(recipe, machine, fine, level),
                *(
                    (material, moved(mesh, *place.at))
                    for place in places
                    for material, mesh in wheel(machine.wheel, fine)
                ),
            ]
        )
        for fine, level in ((MIDDLE, "middle"), (FAR, "far"))
    )
    return BakedVehicle(near, far, machine.lamps, places)


def full(recipe: Recipe) -> FullVehicle:
    """The level for close views."""
    machine = machine_of(recipe)
    body = by_material(list(_body(recipe, machine, FULL, "middle")))
    return FullVehicle(body, by_material(list(wheel(machine.wheel, FULL))))


def _body(recipe: Recipe, machine: Machine, fine: Fineness, level: str) -> Iterator[Piece]:
    """Frame and rider."""
    yield from machine.frame(fine)
    yield from rider(recipe["recipe"]["rider"], machine.grasp, level)


CYCLE = Builder(bake, full)
"""Two-wheelers with riders."""
