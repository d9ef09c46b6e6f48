"""How finely objects are drawn, by their distance from the cameras."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.world.objects.kinds import Kind
from sumo3dviz_pt.world.placement.surroundings import Surroundings


@dataclass(frozen=True, slots=True, eq=False)
class Staging:
    """What objects are built by beside their kind and settings.

    Attributes:
        around: Roads, ground, cameras and the seed.
        shrink: Factor of the distances at which a kind's levels of detail change, by its name; 1
            where it has none.
    """

    around: Surroundings
    shrink: Mapping[str, float] = field(default_factory=dict)

    def levels(self, kind: Kind, distances: Floats) -> Ints:
        """Return levels of detail of things at distances from the camera, (n,) [m], as (n,)."""
        return levels_of(kind, distances, shrink=self.shrink.get(kind.name, 1.0))

    def level(self, kind: Kind, distance: float) -> int:
        """Return the level of detail of a thing at a distance from the camera [m]."""
        return int(self.levels(kind, np.array([distance]))[0])


def levels_of(kind: Kind, distances: Floats, *, shrink: float) -> Ints:
    """Return levels of detail, (n,); 0 is the finest.

    Args:
        kind: Has the distances at which they change.
        distances: From the nearest camera, (n,) [m].
        shrink: Factor of those distances.
    """
    return np.searchsorted(np.array(kind.levels) * shrink, distances, side="right")
