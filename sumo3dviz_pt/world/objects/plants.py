"""Trees and shrubs at their places: near ones whole, of others in detail what cameras see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.plants.clumps import Direction, directions
from sumo3dviz_pt.model.camera_path import in_picture
from sumo3dviz_pt.model.geometry import Transform, belonging
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.world.objects.kinds import Kind, Plant, body_of, seen_body
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.placement.things import thing_of
from sumo3dviz_pt.world.plants.near_leaves import near_leaves

WHOLE = 20.0
"""Crowns that a camera comes nearer to than this keep all their leaves [m]."""

CROWN = 14.0
"""Radius within which a plant lies [m]."""

_MIDDLE = {"trees": 5.0, "shrubs": 1.0}  # height of a usual crown's middle [m]
_MOST_EYES = 6  # directions that tell which leaves of a plant are seen


@dataclass(frozen=True, slots=True, eq=False)
class PlantSpot:
    """A plant that is to be built.

    Attributes:
        name: Unique among all objects.
        settings: Its kind's, with its own model.
        level: Of detail.
        world_from_body: Where it stands.
    """

    name: str
    settings: ObjectSettings
    level: int
    world_from_body: Transform

    @property
    def thing(self) -> str:
        """What its faces belong to."""
        return thing_of(self.name)


def plant_parts(kind: Kind, spots: Sequence[PlantSpot], around: Surroundings) -> list[Part]:
    """Build plants of a kind, in the world.

    Args:
        kind: One of `PLANTS`.
        spots: Which, and where.
        around: Cameras, chance and ground.
    """
    eyes = _eyes(kind, spots, around)
    parts: list[Part] = []
    clumps: list[Part] = []
    owners: list[str] = []
    rear: list[str] = []
    for number, spot in enumerate(spots):
        plant = Plant(kind, spot.settings, around.seed, spot.name, spot.level, around.season)
        # Twigs hide nothing, so bare crowns stay whole.
        whole = number not in eyes or plant.bare
        seen, rest = (body_of(plant), ()) if whole else seen_body(plant, eyes[number])
        parts += [_placed(part, spot) for part in seen]
        clumps += [_placed(part, spot) for part in rest]
        owners += [spot.thing] * len(seen)
        rear += [spot.thing] * len(rest)
    # Clumps stay as they are: no camera sees them.
    found = (*near_leaves(parts, around=around), *clumps)
    pairs = zip(found, (*owners, *rear), strict=True)
    return [replace(part, mesh=belonging(part.mesh, thing)) for part, thing in pairs]


def _placed(part: Part, spot: PlantSpot) -> Part:
    """Return a part of a plant where it stands."""
    return Part(spot.world_from_body.mesh(part.mesh), part.material, part.tint)


def _eyes(
    kind: Kind, spots: Sequence[PlantSpot], around: Surroundings
) -> Mapping[int, Sequence[Direction]]:
    """Return the directions of the cameras that picture each plant, in its own frame.

    Near plants and the finest ones are not among them, and none are where cameras may go
    anywhere: they stay whole.
    """
    path, eyes = around.camera_path, around.eyes
    if path is None or eyes is None or not spots:
        return {}
    matrices = np.stack([spot.world_from_body.matrix for spot in spots])
    middles = matrices[:, :3, 3] + [0.0, 0.0, _MIDDLE[kind.name]]
    pictured = in_picture(path, middles, radius=CROWN)
    far = around.distances(middles) > WHOLE
    found = {}
    for number in np.flatnonzero(far & [spot.level > 0 for spot in spots]).tolist():
        towards = (eyes[pictured[number]] - middles[number]) @ matrices[number, :3, :3]
        some = directions(towards)
        found[number] = some[:: max(1, -(-len(some) // _MOST_EYES))]
    return found
