"""Cars that are parked in an invented town: which stand where, and what they are made of.

They are bodies of the catalogue, as they are baked: in detail near a camera, coarse farther away.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.paints import EUROPEAN, flop_of
from sumo3dviz_pt.library.vehicles.glazing import PANE, paned
from sumo3dviz_pt.library.vehicles.packed import BODIES, read_levels
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform, belonging, settled
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.traffic import ParkingArea
from sumo3dviz_pt.world.objects.objects import merged
from sumo3dviz_pt.world.placement.surroundings import Surroundings

FAMILY = "parked cars"
"""What users call them."""

CAR = 4.5
"""Length of a usual car [m]."""

REACH, MOST = 170.0, 70
"""Cars farther from every camera than this are left out [m]; the nearest are shown, at most."""

_CLOSE, _MOST_CLOSE = 24.0, 6  # the nearest are shown in detail
_TAKEN = 0.68  # share of bays in which a car stands

_MODELS = {
    "hatchback": 5.0,
    "city_car": 3.0,
    "estate": 3.0,
    "sedan": 2.0,
    "suv": 3.0,
    "people_carrier": 1.0,
    "van_compact": 1.0,
}
"""Models and how common they are."""


@dataclass(frozen=True, slots=True)
class ParkedCar:
    """A car that never moves.

    Attributes:
        name: Unique.
        front: Middle of its front end, x, y [m].
        yaw: Direction that it looks to [rad].
    """

    name: str
    front: tuple[float, float]
    yaw: float

    @property
    def way(self) -> Floats:
        """Direction that it looks to, (2,)."""
        return np.array([np.cos(self.yaw), np.sin(self.yaw)])

    @property
    def middle(self) -> Floats:
        """About, (2,) [m]."""
        return np.asarray(np.array(self.front) - 0.5 * CAR * self.way)


def in_bays(area: ParkingArea, seed: int) -> Iterator[ParkedCar]:
    """Yield the cars that stand in the bays of a parking area."""
    for bay in area.bays:
        name = f"{area.id}:{bay.front[0]:.0f}:{bay.front[1]:.0f}"
        if share_of(seed, name, "taken") > _TAKEN:
            continue
        way = np.array([np.cos(bay.yaw), np.sin(bay.yaw)])
        free = 0.25 + 0.7 * share_of(seed, name, "along")
        aside = 0.16 * (share_of(seed, name, "aside") - 0.5)
        front = np.array(bay.front) - free * way + aside * np.array([-way[1], way[0]])
        turn = 0.03 * (share_of(seed, name, "turn") - 0.5)
        yield ParkedCar(name, (float(front[0]), float(front[1])), bay.yaw + turn)


def parked_cars(cars: Sequence[ParkedCar], around: Surroundings) -> list[StaticPart]:
    """Build the parked cars that a shot shows.

    Args:
        cars: All of them.
        around: Cameras, ground and the seed.
    """
    if not cars:
        return []
    middles = settled([car.middle for car in cars])
    away = around.distances(middles)
    shown = (away < REACH) & (around.pictured(middles, radius=3.0) | (away < 15.0))
    order = np.flatnonzero(shown)
    order = order[np.argsort(away[order], kind="stable")][:MOST]
    if not len(order):
        return []
    fronts = settled([cars[k].front for k in order.tolist()])
    ways = np.array([cars[k].way for k in order.tolist()])
    high, low = (around.height_at(fronts - share * CAR * ways) for share in (0.2, 0.8))
    parts: list[Part] = []
    for rank, k in enumerate(order.tolist()):
        near = away[k] < _CLOSE and rank < _MOST_CLOSE
        pitch = float(np.arctan2(high[rank] - low[rank], 0.6 * CAR))
        z = float(high[rank] + (high[rank] - low[rank]) / 3.0)
        place = Transform.from_pose((*cars[k].front, z), yaw=cars[k].yaw, pitch=pitch)
        parts += _car(cars[k].name, place, around.seed, near=near)
    return merged(FAMILY, parts)


def _car(name: str, place: Transform, seed: int, *, near: bool) -> Iterator[Part]:
    """One car in the world."""
    names = list(_MODELS)
    model = names[pick(list(_MODELS.values()), share_of(seed, name, "model"))]
    paint = EUROPEAN.draw(seed, name)
    meta, chance = catalog.find("vehicles", model).meta, share_of(seed, name, "use")
    ahead = place.matrix[:2, 0]
    yaw = float(np.arctan2(ahead[1], ahead[0]))
    for material, mesh in _body(model)["parts" if near else "far"].items():
        placed = replace(belonging(place.mesh(mesh), f"parked:{name}"), uvs=None)
        if material == PANE:
            told = paned(mesh, meta, yaw=yaw, chance=chance)
            placed = replace(placed, uvs=told.uvs, wear=told.wear)
        tint = np.tile(paint, (len(mesh.faces), 1)) if material == "paint" else None
        glitters = material == "paint" and flop_of(paint) > 0.0
        yield Part(placed, "effect_paint" if glitters else material, tint)


@cache
def _body(model: str) -> Mapping[str, Mapping[str, Mesh]]:
    """The levels of a model."""
    return read_levels(catalog.find("vehicles", model).folder / BODIES)
