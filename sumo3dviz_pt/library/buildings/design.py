"""What is said of a building before it is raised: its design, its plan, what its walls look at."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.buildings.balconies import Balconies
from sumo3dviz_pt.library.buildings.facade import Facade
from sumo3dviz_pt.model.geometry import Floats


@dataclass(frozen=True, slots=True)
class Design(RecipeValue):
    """How a building looks, whatever its plan and height.

    Attributes:
        upper: Windows above the ground floor of walls at a street, and of those behind.
        low: Windows of the ground floor; None for the same as above it.
        sides: Windows of the other walls; None for the same as on fronts.
        ground: Height of the ground floor [m]; 0 for that of the other storeys.
        storey: Height of the other storeys, about [m].
        plinth: Height of the dark foot, and of the floor behind it [m].
        foot: What fronts have at the street: doors, shops, shops under one band, or gates.
        unit: Distance between two doors [m].
        roof: Its kind.
        pitch: Of gabled and hipped roofs [rad].
        parapet: Of flat roofs [m].
        courses: How far bands between storeys reach out [m]; 0 for none.
        cornice: How far the uppermost band reaches out [m]; 0 for none.
        balconies: Kind of the balconies on fronts and backs.
        dormers: Whether slopes have windows.
        lift: Whether flat roofs carry a lift house.
    """

    upper: Facade
    low: Facade | None = None
    sides: Facade | None = None
    ground: float = 0.0
    storey: float = 3.0
    plinth: float = 0.3
    foot: Literal["door", "shops", "band", "gates"] = "door"
    unit: float = 14.0
    roof: Literal["flat", "gable", "hip", "mansard"] = "flat"
    pitch: float = 0.7
    parapet: float = 0.6
    courses: float = 0.0
    cornice: float = 0.0
    balconies: Balconies = "none"
    dormers: bool = False
    lift: bool = False

    def floors(self, height: float) -> Floats:
        """Divide walls of a height [m] into storeys.

        Returns:
            Where the ground floor ends, and where each storey above it does, (n,) [m].
        """
        first = self.ground or self.plinth + self.storey
        if height < first + 0.6 * self.storey:
            return np.array([height])
        count = max(round((height - first) / self.storey), 1)
        return np.linspace(first, height, count + 1)

    @property
    def foot_height(self) -> float:
        """Where walls begin [m]."""
        return self.plinth if self.foot == "door" else 0.0


@dataclass(frozen=True, slots=True)
class Walls:
    """What the walls of a building look at; wall i begins at corner i of the plan.

    Attributes:
        fronts: Numbers of those at a street.
        blind: Numbers of those that a neighbour shares.
    """

    fronts: Collection[int] = (0,)
    blind: Collection[int] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Building:
    """A building to be raised over a plan.

    Attributes:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        design: How it looks.
        height: Of the walls up to the roof [m].
        level: Level of detail.
        seed: Of all chance.
        walls: What they look at.
    """

    plan: Floats
    design: Design
    height: float
    level: int
    seed: int
    walls: Walls
