"""Builds vehicles around a rider: bicycle, e-scooter, moped, motorcycle, rickshaw, wheelchair.

A recipe holds `model`, `bicycle` or `motor`, and the fields of
`BicycleRecipe` or `MotorRecipe`. What is made of `paint` or `cloth` takes the road user's colour.
"""

from __future__ import annotations

from collections.abc import Iterator

from bakery.build import BakedVehicle, Builder, FullVehicle, Recipe
from bakery.cycles.motor import MotorRecipe, motor
from sumo3dviz_pt.library.mesh.solids import by_material, moved
from sumo3dviz_pt.library.vehicles.cycles.bicycle import BicycleRecipe, bicycle
from sumo3dviz_pt.library.vehicles.cycles.parts import FAR, FULL, MIDDLE, Fineness, wheel
from sumo3dviz_pt.library.vehicles.cycles.rider import Machine, rider
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh, WheelPlace, read_value


def machine_of(recipe: Recipe) -> Machine:
    """Make the two-wheeler of a completed recipe.

    Raises:
        ConfigError: If its model or a key is unknown, or a value missing or of the wrong kind.
    """
    own = recipe["recipe"]
    if own.get("model") == "motor":
        return motor(read_value(MotorRecipe, own))
    return bicycle(read_value(BicycleRecipe, own))


def bake(recipe: Recipe) -> BakedVehicle:
    """Build the levels that travel with the package."""
    machine = machine_of(recipe)
    places = tuple(
        WheelPlace(
            (x, y, machine.wheel.radius),
            machine.wheel.radius,
            steered=number == 0 and len(machine.axles) > 1,
        )
        for number, (x, y) in enumerate(machine.wheel_places)
    )
    near, far = (
        by_material(
            [
                *_body(machine, fine, level),
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
    """Build the level for close views."""
    machine = machine_of(recipe)
    body = by_material(list(_body(machine, FULL, "middle")))
    return FullVehicle(body, by_material(list(wheel(machine.wheel, FULL))))


def _body(machine: Machine, fine: Fineness, level: str) -> Iterator[MaterialMesh]:
    """Frame and rider."""
    yield from machine.frame(fine)
    yield from rider(machine.rider, machine.grasp, level)


CYCLE = Builder(bake, full)
"""Two-wheelers with riders."""
