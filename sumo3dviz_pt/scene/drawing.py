"""How a body is put together at each level of detail: units, wheels, what they are scaled by."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.scene import Mover, Prototype
from sumo3dviz_pt.scene.crowd import Drawn
from sumo3dviz_pt.shapes.vehicle import WheelPlace


@dataclass(frozen=True, slots=True, eq=False)
class Unit:
    """One rigid piece of a road user: a car, or a tractor, or a carriage.

    Attributes:
        prototype: Its body.
        at: x of its front in the whole's unscaled frame [m].
        wheels: Where its wheels turn at full detail; empty where there is none.
        model: The catalogue's name, if the prototype's is another.
    """

    prototype: Prototype
    at: float = 0.0
    wheels: tuple[WheelPlace, ...] = ()
    model: str = ""

    @property
    def source(self) -> str:
        """The catalogue's name of it."""
        return self.model or self.prototype.name

    @property
    def hero(self) -> str:
        """Name of its body at full detail."""
        return f"{self.source}/hero"

    @property
    def wheel(self) -> str:
        """Name of its wheel at full detail."""
        return f"{self.source}/wheel"


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """All units of a road user.

    Attributes:
        model: What it is a copy of.
        units: From front to rear, at least one.
        drawn: Names of its prototypes at each level.
    """

    model: str
    units: tuple[Unit, ...]
    drawn: Drawn = field(init=False)

    def __post_init__(self) -> None:
        """List the prototypes."""
        names = tuple(unit.prototype.name for unit in self.units)
        posed = any(unit.prototype.poses is not None for unit in self.units)
        # Those that take poses have all their detail near by.
        full = not posed and all(unit.wheels for unit in self.units)
        hero = [name for unit in self.units for name in (unit.hero, *_wheels(unit))] if full else []
        object.__setattr__(self, "drawn", Drawn(self.model, names, names, tuple(hero), posed))

    @property
    def prototypes(self) -> Mapping[str, Prototype]:
        """Bodies of all units by name."""
        return {unit.prototype.name: unit.prototype for unit in self.units}

    def movers(self, whole: Mover, *, hero: bool = False) -> Iterator[Mover]:
        """The parts of a road user at its place.

        Args:
            whole: The road user; its prototype names what the first unit shows.
            hero: Whether it is drawn in full detail.
        """
        for number, unit in enumerate(self.units):
            part = f"unit{number}" if number else ""
            name = unit.prototype.name if number else whole.prototype
            placed = whole.world_from_body
            if unit.at:
                placed = placed @ Transform.from_pose((unit.at, 0.0, 0.0))
            own = replace(whole, prototype=name, part=part, world_from_body=placed)
            yield replace(own, prototype=unit.hero) if hero else own
            for wheel, place in enumerate(unit.wheels if hero else ()):
                matrix = _wheel_matrix(own.world_from_body.matrix, place)
                name = f"{part}wheel{wheel}"
                yield replace(
                    own, prototype=unit.wheel, part=name, world_from_body=Transform(matrix)
                )


def _wheels(unit: Unit) -> list[str]:
    """The wheel's name, once for each wheel."""
    return [unit.wheel] * len(unit.wheels)


def _wheel_matrix(body: Floats, place: WheelPlace) -> Floats:
    """Placement of a wheel on a stretched body: round, and on the ground, (4, 4)."""
    scale = np.linalg.norm(body[:3, :3], axis=0)
    turned = body[:3, :3] / scale
    if (place.at[1] < 0.0) != place.reversed:
        turned = turned * np.array([-1.0, -1.0, 1.0])
    matrix = np.eye(4)
    matrix[:3, :3] = turned * scale[2]
    matrix[:3, 3] = body[:3, :3] @ np.array(place.at) + body[:3, 3]
    return matrix
