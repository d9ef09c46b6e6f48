"""What is known of every two-wheeler, whatever its recipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from sumo3dviz_pt.library.people.wardrobe import Recipe
from sumo3dviz_pt.library.vehicles.build import MaterialMesh
from sumo3dviz_pt.library.vehicles.cycles.parts import CycleWheel, Fineness
from sumo3dviz_pt.library.vehicles.cycles.rider import Grasp
from sumo3dviz_pt.model.lamps import VehicleLamp


@dataclass(frozen=True, slots=True)
class Machine:
    """A two-wheeler, in metres behind the front of its front wheel.

    Attributes:
        wheel: Both wheels.
        axles: x of the front and the rear axle [m].
        frame: Everything but wheels and rider, at a fineness.
        grasp: Where the rider touches it.
        lamps: What can shine.
        rider: A recipe of `library/people`.
    """

    wheel: CycleWheel
    axles: tuple[float, float]
    frame: Callable[[Fineness], Iterator[MaterialMesh]]
    grasp: Grasp
    lamps: tuple[VehicleLamp, ...]
    rider: Recipe
