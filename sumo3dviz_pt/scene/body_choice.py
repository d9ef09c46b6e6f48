"""Which body a road user gets: seeded by its id, so that it keeps it for its whole life."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.scene.chance import pick, share_of
from sumo3dviz_pt.scene.seats import PLAIN_CLASSES

Size = tuple[float, float, float]
"""Length, width, height [m]."""

CAR_CLASSES = frozenset(
    [
        *("passenger", "taxi", "evehicle", "hov", "private", "authority", "army", "vip", "police"),
        *("custom1", "custom2", "ignoring"),
    ]
)
"""vClasses that cars show, if they have a car's size."""

DEFAULT_CAR: Size = (5.0, 1.8, 1.5)
"""SUMO's size of the class passenger: says nothing about the real car."""

_CAR_LENGTHS = (2.2, 6.6)
_CAR_WIDTHS = (1.2, 2.5)
TALLEST_CAR = 2.3

_COARSE_SHAPES = frozenset(
    ["coach", "trailer", "emergency", "tram", "rail_urban", "subway", "wheelchair"]
)
"""Classes whose default guiShape is that of another class."""

_LENGTH_SPREAD = 0.08
"""Relative difference in length at which a model becomes 1/e as likely."""


@dataclass(frozen=True, slots=True)
class CarModel:
    """A car of the catalogue.

    Attributes:
        name: In `assets/vehicles`.
        size: Of the unscaled model [m].
        share: How common it is, against 1 for most.
        gui_shapes: SUMO's guiShapes that mean it, such as `passenger/wagon`.
    """

    name: str
    size: Size
    share: float = 1.0
    gui_shapes: tuple[str, ...] = ()

    @classmethod
    def of(cls, entry: catalog.Entry) -> CarModel:
        """Read a model's measures from its catalogue entry."""
        meta = entry.meta
        size = (float(meta["length"]), float(meta["width"]), float(meta["height"]))
        shapes = tuple(meta.get("gui_shapes", [f"passenger/{entry.name}"]))
        return cls(entry.name, size, float(meta.get("share", 1.0)), shapes)


@dataclass(frozen=True, slots=True)
class CarChoice:
    """A car of the catalogue, for a vType of this size [m]."""

    model: CarModel
    size: Size


@dataclass(frozen=True, slots=True)
class PlainChoice:
    """A plain body of a class and size [m]."""

    vclass: str
    size: Size


@dataclass(frozen=True, slots=True)
class UserChoice:
    """A user's own file, in its own size."""

    path: Path
    vclass: str


Choice = CarChoice | PlainChoice | UserChoice


def car_models(wanted: Sequence[str]) -> tuple[CarModel, ...]:
    """Cars to draw from.

    Args:
        wanted: Names; none stands for all.

    Raises:
        ConfigError: If a name is unknown; the message suggests one.
    """
    entries = [catalog.find("vehicles", name) for name in catalog.names("vehicles")]
    known = {
        entry.name: CarModel.of(entry)
        for entry in entries
        if entry.meta.get("vclass", "passenger") in CAR_CLASSES
    }
    for name in wanted:
        if name not in known:
            message = f"no car is called {name!r}{catalog.did_you_mean(name, known)}"
            raise ConfigError(message, key="vehicles.passenger")
    return tuple(known[name] for name in (wanted or sorted(known)))


def drawn_class(kind: VehicleType) -> str:
    """What a vType is drawn as: `passenger`, or a class of plain bodies.

    The guiShape wins over the vClass, which says first of all which lanes a vehicle may
    use; but some classes have a guiShape that is too coarse for them.
    """
    shape = kind.gui_shape.split("/")[0]
    known = shape in CAR_CLASSES | PLAIN_CLASSES
    vclass = shape if known and kind.vclass not in _COARSE_SHAPES else kind.vclass
    if vclass == "delivery" and kind.length < _CAR_LENGTHS[1] and kind.height < TALLEST_CAR:
        return "passenger"
    if vclass not in CAR_CLASSES:
        return vclass
    if kind.length > _CAR_LENGTHS[1] or kind.width > _CAR_WIDTHS[1]:
        return "truck"
    if kind.length < _CAR_LENGTHS[0] or kind.width < _CAR_WIDTHS[0]:
        return "motorcycle"
    return "passenger"


def choose(
    kind: VehicleType, *, name: str, cars: Sequence[CarModel], own: Mapping[str, Path], seed: int
) -> Choice:
    """Choose a body.

    Args:
        kind: The vType.
        name: SUMO's id of the road user.
        cars: Models to draw from; none gives cars plain bodies.
        own: Users' files by pattern of an id or a vType's id; the first that fits wins.
        seed: The job's.
    """
    vclass = drawn_class(kind)
    for pattern, path in own.items():
        if fnmatchcase(name, pattern) or fnmatchcase(kind.id, pattern):
            return UserChoice(path, vclass)
    size = (kind.length, kind.width, kind.height)
    if vclass != "passenger" or not cars:
        return PlainChoice(vclass, size)
    cars = [car for car in cars if kind.gui_shape in car.gui_shapes] or cars
    weights = [car.share * _likelihood(car.size[0], wanted=kind.length) for car in cars]
    return CarChoice(cars[pick(weights, share_of(seed, name, "body"))], size)


def _likelihood(length: float, *, wanted: float) -> float:
    """How likely a model is drawn for a vType of a length [m]."""
    if wanted == DEFAULT_CAR[0]:
        return 1.0
    return float(np.exp(-(((length / wanted - 1.0) / _LENGTH_SPREAD) ** 2))) + 1e-6
