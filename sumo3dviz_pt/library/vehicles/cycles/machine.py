"""What is known of every two-wheeler, whatever its recipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from sumo3dviz_pt.library.people.wardrobe import Recipe
from sumo3dviz_pt.library.vehicles.cycles.parts import CycleWheel, Fineness
from sumo3dviz_pt.library.vehicles.cycles.rider import Grasp
from sumo3dviz_pt.library.vehicles.parts import MaterialMesh
from sumo3dviz_pt.model.lamps import VehicleLamp


@dataclass(frozen=True, slots=True)
class Machine:
    """A two-wheeler, in metres behind the front of its front wheel.

    Attributes:
        wheel: Both wheels.
        axles: x of the front and the rear axle, or of the rear one alone [m].
        frame: Everything but wheels and rider, at a fineness.
        grasp: Where the rider touches it.
        lamps: What can shine.
        rider: A recipe of `library/people`.
        half_track: |y| of two wheels on the rear axle [m]; 0 for a single one.
    """

    wheel: CycleWheel
    axles: tuple[float, ...]
    frame: Callable[[Fineness], Iterator[MaterialMesh]]
    grasp: Grasp
    lamps: tuple[VehicleLamp, ...]
    rider: Recipe
    half_track: float = 0.0

    @property
    def wheel_places(self) -> tuple[tuple[float, float], ...]:
        """All wheels by x and y [m], the front one first."""
        if not self.half_track:
            return tuple((x, 0.0) for x in self.axles)
        *front, rear = self.axles
        return (*((x, 0.0) for x in front), (rear, self.half_track), (rear, -self.half_track))
