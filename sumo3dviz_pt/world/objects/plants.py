"""Trees and shrubs at their places, and which levels of detail objects get.

Near plants are built whole, and of others in detail what cameras see. Levels depend on how many
triangles objects ask for where they stand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.plants.leaves import Direction, directions
from sumo3dviz_pt.model.camera import in_picture
from sumo3dviz_pt.model.geometry import Floats, Transform, belonging
from sumo3dviz_pt.model.scene import LeftOut, Part
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.kinds import PLANTS, Kind, Plant, body_of, levels_of, seen_body
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_of
from sumo3dviz_pt.world.plants.near import near_leaves
from sumo3dviz_pt.world.plants.trees import BEHIND

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
    leaves = (*near_leaves(parts, around=around), *clumps)
    pairs = zip(leaves, (*owners, *rear), strict=True)
    return [replace(part, mesh=belonging(part.mesh, thing)) for part, thing in pairs]


def _placed(part: Part, spot: PlantSpot) -> Part:
    """Return a part of a plant where it stands."""
    return Part(spot.world_from_body.mesh(part.mesh), part.material, part.tint)


def middles_of(kind: Kind, spots: Sequence[PlantSpot]) -> Floats:
    """Return about where the middles of crowns are, (n, 3) [m]."""
    feet = np.array([spot.world_from_body.matrix[:3, 3] for spot in spots]).reshape(-1, 3)
    return np.asarray(feet + np.array([0.0, 0.0, _MIDDLE[kind.name]]))


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
    middles = middles_of(kind, spots)
    pictured = in_picture(path, middles, radius=CROWN)
    far = around.distances(middles) > WHOLE
    chosen = {}
    for number in np.flatnonzero(far & [spot.level > 0 for spot in spots]).tolist():
        towards = (eyes[pictured[number]] - middles[number]) @ matrices[number, :3, :3]
        some = directions(towards)
        chosen[number] = some[:: max(1, -(-len(some) // _MOST_EYES))]
    return chosen


_MOST_STRETCH = 1.6  # how far the limits of levels move out in sparse scenes
_REAR = 0.4  # by how much each row before a plant makes it count as farther away
_UNSEEN = 75.0  # plants out of the picture count as at least this far [m]

Item = Poi | Polygon


@dataclass(frozen=True, slots=True)
class ObjectGroup:
    """The objects of a kind that are drawn, and the settings of that kind."""

    kind: Kind
    settings: ObjectSettings
    items: list[Item]


@dataclass(frozen=True, slots=True, eq=False)
class Gone:
    """Objects of a kind that are not drawn, and why."""

    left_out: LeftOut
    kind: Kind
    items: Sequence[Item]

    def weighed(self, around: Surroundings, shrinks: Mapping[str, float]) -> LeftOut:
        """Return what was left out, with the triangles that it would have had.

        Args:
            around: Roads, ground, cameras and the seed.
            shrinks: How much level limits move, by kind; those of a kind that is not drawn at all
                would move as far as the nearest.
        """
        if not self.items:
            return self.left_out
        demand = _Demand.of(self.kind, self.items, around)
        others = min(shrinks.values(), default=_MOST_STRETCH)
        shrink = shrinks.get(self.kind.name, others)
        return replace(self.left_out, triangles=round(demand.triangles(shrink)))


def shrunk_levels(
    groups: Sequence[ObjectGroup], around: Surroundings, budget: int, *, each: int | None
) -> dict[str, float]:
    """By how much level limits move, by kind: out where triangles leave room, else in.

    All kinds share a budget, unless `each` has its own: then none hangs on what else stands.
    """
    measured = [_Demand.of(group.kind, group.items, around) for group in groups]
    if each is None:
        common = _shrink(measured, budget)
        return {demand.kind.name: common for demand in measured}
    return {demand.kind.name: _shrink([demand], each) for demand in measured}


@dataclass(frozen=True, slots=True, eq=False)
class _Demand:
    """What the objects of a kind ask for.

    Attributes:
        kind: Of all of them.
        distances: That count for their levels of detail, (n,) [m].
        pieces: How many of the kind's unit each of them is, (n,).
    """

    kind: Kind
    distances: Floats
    pieces: Floats

    @classmethod
    def of(cls, kind: Kind, items: Sequence[Item], around: Surroundings) -> _Demand:
        """Measure the objects of a kind."""
        pieces = np.ones(len(items))
        if kind.form != "point":  # walls and fences by their length
            steps = [np.diff(i.shape[:, :2], axis=0) for i in items if isinstance(i, Polygon)]
            pieces = np.array([np.linalg.norm(s, axis=1).sum() / 40.0 for s in steps])
        return cls(kind, level_distances(kind, items, around), pieces)

    def triangles(self, shrink: float) -> float:
        """Return about how many triangles they take, where level limits are multiplied."""
        levels = levels_of(self.kind, self.distances, shrink=shrink)
        return float((np.array(self.kind.cost)[levels] * self.pieces).sum())


def _shrink(demands: Sequence[_Demand], budget: int) -> float:
    """The factor of level limits by which some kinds keep a budget."""
    shrink = _MOST_STRETCH
    while shrink > 0.05 and sum(demand.triangles(shrink) for demand in demands) > budget:
        shrink *= 0.85
    return shrink


def level_distances(kind: Kind, items: Sequence[Item], around: Surroundings) -> Floats:
    """Distances that choose levels of detail, (n,) [m].

    Plants beside or behind the camera show only shadows and reflections, and those in the
    rear of a belt only their tops, so they count as far ones.
    """
    places = places_of(items)
    distances = around.distances(places)
    if kind.name not in PLANTS:
        return distances
    rows = [_row(item) for item in items]
    distances = distances * (1.0 + _REAR * np.array(rows))
    unseen = ~around.pictured(places, radius=CROWN)
    return np.where(unseen, np.maximum(distances, _UNSEEN), distances)


def places_of(items: Sequence[Item]) -> Floats:
    """One place per object, (n, 2) [m]."""
    places = [
        np.array(item.position) if isinstance(item, Poi) else item.shape[:, :2].mean(axis=0)
        for item in items
    ]
    return np.array(places, dtype=np.float64).reshape(-1, 2)


def _row(item: Item) -> float:
    """How far in the rear of a belt a plant stands; users' own ones stand in no belt."""
    behind = item.params.get(BEHIND, "") if isinstance(item, Poi) else ""
    return float(behind) if behind.isdecimal() and len(behind) < 3 else 0.0
