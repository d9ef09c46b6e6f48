"""Plants of which many are alike: a few models with small leaves, each at many places.

A leaf that is longer than a few pixels looks like a shard. Crowns of small leaves take too many
triangles to be built one by one for a whole drive, so near plants share a few models. How small
leaves are depends on how large a pixel is where the plant stands, and not on how long a shot is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.plants.tree import fine_leaves, fine_tree
from sumo3dviz_pt.model.camera import CameraPath, in_picture
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, Transform, settled
from sumo3dviz_pt.model.random import seed_of, share_of
from sumo3dviz_pt.model.scene import Mover, Prototype
from sumo3dviz_pt.model.swaying import Sway, Swaying
from sumo3dviz_pt.model.weather import Weather
from sumo3dviz_pt.world.objects.kinds import Kind, Plant, leaf_tint
from sumo3dviz_pt.world.objects.plants import CROWN, PlantSpot, middles_of
from sumo3dviz_pt.world.placement.surroundings import Surroundings

FINEST = 0.04
"""Length of the smallest leaves [m]: those of a tree 15 m away, in a usual picture."""

PIXELS = 3.0
"""Leaves are about as long, in a picture of usual size [px]."""

SIZES = 10
"""How many sizes of leaves there are, in steps that double their area: much smaller than wanted
they are noise, which a denoiser smears."""

MOST = {"trees": 320, "shrubs": 320}
"""Plants of a kind that share models, at most."""

TRIANGLES = {"trees": 800_000, "shrubs": 80_000}
"""Of all models of a kind, at most (about)."""

_DIAGONAL = 1468.0  # of a picture of 1280 x 720 [px]
_WIDEST = 0.60  # half the angle of a usual picture's diagonal [rad]; wider ones count as such
_VARIANTS = (1, 1, 1, 1, 2, 2, 2, 2, 2, 2)  # crowns of a species, by the size of their leaves
_MOST_VIEWS = 60  # that tell how near plants are
_HALF = {"trees": 2.5, "shrubs": 0.8}  # half width of a usual crown [m]
_GREY: Colour = (0.5, 0.5, 0.5)


@dataclass(frozen=True, eq=False)
class Stands:
    """Plants that share models.

    Attributes:
        prototypes: The models, by name.
        movers: Where each stands when no wind blows.
        seeds: Of how wind moves each.
    """

    prototypes: Mapping[str, Prototype] = field(default_factory=dict)
    movers: tuple[Mover, ...] = ()
    seeds: tuple[int, ...] = ()

    @property
    def slots(self) -> Mapping[str, int]:
        """How many there are of each model."""
        return dict(sorted(Counter(mover.prototype for mover in self.movers).items()))

    @property
    def triangles(self) -> int:
        """Of all models."""
        return sum(prototype.triangles for prototype in self.prototypes.values())

    def joined(self, other: Stands) -> Stands:
        """Return both together."""
        return Stands(
            {**self.prototypes, **other.prototypes},
            (*self.movers, *other.movers),
            (*self.seeds, *other.seeds),
        )

    def movers_at(self, time: float, weather: Weather | None) -> tuple[Mover, ...]:
        """Return the plants at a time [s]: they lean as their stems do, and keep their shape."""
        wind = None if weather is None else weather.wind
        if wind is None or not wind.speed or not self.movers:
            return self.movers
        tips = self._sway.mesh.vertices
        moved = self._sway.at(time, wind)[0] - tips
        return tuple(map(_leant, self.movers, moved, tips[:, 2]))

    @cached_property
    def _sway(self) -> Sway:
        """How the plants' tips move."""
        tops = {
            name: max(float(part.mesh.bounds[1, 2]) for part in body.parts)
            for name, body in self.prototypes.items()
        }
        matrices = np.stack([mover.world_from_body.matrix for mover in self.movers])
        feet = matrices[:, :3, 3]
        tips = feet + matrices[:, :3, 2] * np.array([[tops[k.prototype]] for k in self.movers])
        plants = Swaying(
            feet,
            np.maximum(tips[:, 2] - feet[:, 2], 0.3),
            np.array(self.seeds),
            np.ones(len(feet)),
            np.ones(len(feet), np.int64),
            leaves=False,
        )
        return Sway(Mesh(tips, np.zeros((0, 3), np.int64)), plants)


def _leant(mover: Mover, moved: Floats, top: float) -> Mover:
    """Return a plant whose tip, so high [m], has moved, (3,) [m], and whose foot has not."""
    matrix = mover.world_from_body.matrix
    up = matrix[2] - np.array([0.0, 0.0, 0.0, matrix[2, 3]])
    leant = matrix + np.outer([*(moved / (top - matrix[2, 3])), 0.0], up)
    return replace(mover, world_from_body=Transform(leant))


@dataclass(frozen=True, slots=True)
class _Model:
    """Which crown, with which leaves.

    Attributes:
        species: Its name.
        variant: Of the species' crowns.
        size: Of its leaves, a number below `SIZES`.
        season: What they look like.
        colour: What the scene file wants instead of their own, `#rrggbb`.
    """

    species: str
    variant: int
    size: int
    season: str
    colour: str | None

    @property
    def name(self) -> str:
        """Unique among all bodies."""
        return f"plant/{self.species}/{self.variant}/{self.size}{self.colour or ''}"

    @property
    def size_of_leaves(self) -> float:
        """How much longer than the finest its leaves are."""
        return float(2.0 ** (0.5 * self.size))

    def plant(self, kind: Kind, seed: int) -> Plant:
        """Return what a plant of that name would be."""
        settings = ObjectSettings(model=(self.species,), colour=self.colour)
        return Plant(kind, settings, seed, self.name, 0, self.season)


def shared(
    kind: Kind, spots: Sequence[PlantSpot], around: Surroundings
) -> tuple[Stands, list[PlantSpot]]:
    """Let near plants share models; return those, and the plants that are left.

    Args:
        kind: One of `PLANTS`.
        spots: All of that kind.
        around: Cameras, chance and season; where cameras may go anywhere, none share models.
    """
    path = around.camera_path
    if path is None or around.eyes is None or not spots:
        return Stands(), list(spots)
    wanted = _sizes(kind, spots, path)
    models: dict[int, _Model] = {}
    for number in np.argsort(wanted, kind="stable").tolist():
        if wanted[number] >= SIZES or len(models) >= MOST[kind.name]:
            break
        spot = spots[number]
        plant = Plant(kind, spot.settings, around.seed, spot.name, spot.level, around.season)
        if not plant.bare:
            size = int(max(wanted[number], 0.0))
            variant = int(_VARIANTS[size] * share_of(around.seed, spot.name, "variant"))
            own = spot.settings.colour
            models[number] = _Model(plant.crown[0], variant, size, around.season, own)
    finest = _affordable(models.values(), TRIANGLES[kind.name])
    bodies = [
        _body(model, finest, model.plant(kind, around.seed), rooted=not around.windy)
        for model in dict.fromkeys(models.values())
    ]
    movers = [_mover(spots[number], model) for number, model in sorted(models.items())]
    rest = [spot for number, spot in enumerate(spots) if number not in models]
    seeds = tuple(seed_of(around.seed, mover.id, "wind") for mover in movers)
    return Stands({body.name: body for body in bodies}, tuple(movers), seeds), rest


def _mover(spot: PlantSpot, model: _Model) -> Mover:
    """Return a plant where it stands."""
    place = spot.world_from_body
    return Mover(spot.thing, model.name, place, _GREY, part="plant", parked=True)


def _sizes(kind: Kind, spots: Sequence[PlantSpot], path: CameraPath) -> Floats:
    """Return which size of leaves each plant wants, (n,); infinite where no picture shows it."""
    every = max(1, -(-len(path.positions) // _MOST_VIEWS))
    some = path.slice(slice(None, None, every))
    middles = middles_of(kind, spots)
    seen = in_picture(some, middles, radius=CROWN)
    points = np.broadcast_to(middles[:, None], (len(middles), len(some.positions), 3))
    away = np.maximum(some.away(points) - _HALF[kind.name], 0.1)
    # A leaf of a length takes up PIXELS at the narrowest and nearest; a young tree's model is
    # drawn smaller, and its leaves with it.
    pixel = 2.0 * np.minimum(some.half_angles, _WIDEST) / _DIAGONAL
    scale = np.array([np.linalg.norm(spot.world_from_body.matrix[:3, 2]) for spot in spots])
    leaf = np.where(seen, PIXELS * pixel * away, np.inf).min(axis=1) / scale
    return settled(2.0 * np.log2(np.maximum(leaf / FINEST, 1e-3)))


def _affordable(models: Iterable[_Model], budget: int) -> float:
    """Return the length of the smallest leaves with which models keep a budget [m]."""
    distinct, finest = set(models), FINEST
    while sum(_triangles(model, finest) for model in distinct) > budget:
        finest *= 1.1
    return finest


def _triangles(model: _Model, finest: float) -> int:
    """Return about how many triangles a model has."""
    return fine_leaves(model.species, leaf=finest * model.size_of_leaves, season=model.season)


def _body(model: _Model, finest: float, plant: Plant, *, rooted: bool) -> Prototype:
    """Build a model."""
    leaf = finest * model.size_of_leaves
    bark, leaves = fine_tree(model.species, seed=model.variant, leaf=leaf, season=model.season)
    parts = (bark, replace(leaves, tint=leaf_tint(leaves, plant)))
    return Prototype(model.name, parts, parts, rooted=rooted)
