"""Vehicles around a rider, made from what their recipes list: e-scooter, moped, rickshaw."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

from bakery.cycles.pieces import Item, shaped
from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.vehicles.cycles.parts import CycleWheel, Fineness, Point, lamp
from sumo3dviz_pt.library.vehicles.cycles.rider import Grasp, Machine
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh


@dataclass(frozen=True, slots=True)
class LampPlace(RecipeValue):
    """A lamp.

    Attributes:
        role: What lights it.
        at: Its middle [m].
        size: Width and height [m].
        back: Whether it shines backward.
    """

    role: str
    at: Point
    size: tuple[float, float]
    back: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorRecipe(RecipeValue):
    """A vehicle around a rider, in metres behind its front.

    Attributes:
        wheel: All wheels that roll.
        axles: x of the front and the rear axle, or of the rear one alone [m].
        grasp: Where the rider touches it.
        lamps: What can shine.
        pieces: Everything else that is there at every level.
        details: What only near levels have.
        outline: What only the far level has.
        rider: A recipe of `library/people`.
        half_track: |y| of two wheels on the rear axle [m]; 0 for a single one.
    """

    model: Literal["motor"]
    wheel: CycleWheel
    axles: tuple[float, ...]
    grasp: Grasp
    lamps: tuple[LampPlace, ...]
    pieces: tuple[Item, ...]
    details: tuple[Item, ...]
    outline: tuple[Item, ...] = ()
    rider: dict[str, Any]
    half_track: float = 0.0


def motor(recipe: MotorRecipe) -> Machine:
    """Make the two-wheeler of a recipe."""

    def frame(fine: Fineness) -> Iterator[MaterialMesh]:
        yield from shaped(recipe.pieces, fine)
        yield from shaped(recipe.details if fine.small else recipe.outline, fine)

    lamps = tuple(lamp(row.role, row.at, row.size, back=row.back) for row in recipe.lamps)
    return Machine(
        recipe.wheel,
        recipe.axles,
        frame,
        recipe.grasp,
        lamps,
        recipe.rider,
        recipe.half_track,
    )
