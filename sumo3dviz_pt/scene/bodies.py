"""Which body a road user shows, and how it is scaled to its vType.

Cars draw from the catalogue's models, seeded by their id, so that a vehicle keeps its
body for its whole life; other classes get plain bodies of their size; users can name
own files by pattern.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import singledispatch
from pathlib import Path

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Bsdf, Colour, Part, Prototype
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.scene.chance import pick, share_of
from sumo3dviz_pt.scene.materials import principled
from sumo3dviz_pt.scene.seats import PLAIN_CLASSES, Seat, car_seat, class_seat
from sumo3dviz_pt.shapes.ply import read_ply
from sumo3dviz_pt.shapes.user_mesh import read_user_mesh

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

_LENGTH_SPREAD = 0.08
"""Relative difference in length at which a model becomes 1/e as likely."""

_LARGEST_STRETCH = 1.25
"""Width and height of a car are scaled by no more than this factor."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """What a road user shows.

    Attributes:
        prototype: Unscaled.
        scale: Along x, y, z, (3,).
        size: As drawn: length, width, height [m].
        seat: As drawn.
        materials: What the prototype needs beside `MATERIALS`.
    """

    prototype: Prototype
    scale: Floats
    size: Size
    seat: Seat
    materials: Mapping[str, Bsdf] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CarModel:
    """A car of the catalogue.

    Attributes:
        name: In `assets/vehicles`.
        size: Of the unscaled model [m].
    """

    name: str
    size: Size


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
Shelf = dict[str, Prototype]
"""Prototypes by name; each is made once."""


def car_models(wanted: Sequence[str]) -> tuple[CarModel, ...]:
    """Cars to draw from.

    Args:
        wanted: Names; none stands for all.

    Raises:
        ConfigError: If a name is unknown; the message suggests one.
    """
    found = [catalog.find("vehicles", name).meta for name in catalog.names("vehicles")]
    known = {
        name: CarModel(name, (float(meta["length"]), float(meta["width"]), float(meta["height"])))
        for name, meta in zip(catalog.names("vehicles"), found, strict=True)
        if meta.get("vclass", "passenger") in CAR_CLASSES
    }
    for name in wanted:
        if name not in known:
            message = f"no car is called {name!r}{catalog.did_you_mean(name, known)}"
            raise ConfigError(message, key="vehicles.passenger")
    return tuple(known[name] for name in (wanted or sorted(known)))


def drawn_class(kind: VehicleType) -> str:
    """What a vType is drawn as: `passenger`, or a class of plain bodies.

    Scenarios often leave everything in a class of cars and tell trucks by their
    guiShape or size only.
    """
    if kind.vclass not in CAR_CLASSES:
        return kind.vclass
    shape = kind.gui_shape.split("/")[0]
    if shape in PLAIN_CLASSES:
        return shape
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
    shape = kind.gui_shape.removeprefix("passenger/")
    cars = [car for car in cars if car.name == shape] or cars
    weights = [_likelihood(car.size[0], wanted=kind.length) for car in cars]
    return CarChoice(cars[pick(weights, share_of(seed, name, "body"))], size)


def _likelihood(length: float, *, wanted: float) -> float:
    """How likely a model is drawn for a vType of a length [m]."""
    if wanted == DEFAULT_CAR[0]:
        return 1.0
    return float(np.exp(-(((length / wanted - 1.0) / _LENGTH_SPREAD) ** 2))) + 1e-6


@singledispatch
def build_body(choice: Choice, shelf: Shelf) -> Body:
    """Make the body of a choice.

    Args:
        choice: From `choose`.
        shelf: Prototypes made so far; new ones are added.

    Raises:
        ConfigError: If a user's file cannot be read.
    """
    raise TypeError(type(choice).__name__)


@build_body.register
def _(choice: CarChoice, shelf: Shelf) -> Body:
    """A car, from its baked meshes."""
    entry = catalog.find("vehicles", choice.model.name)
    prototype = _shelved(shelf, choice.model.name, lambda: _read_car(entry))
    scale = car_scale(choice.model.size, wanted=choice.size)
    eye, dash = np.array(entry.meta["eye"]), entry.meta["recipe"]["cowl"][1]
    seat = car_seat(scale * eye, cowl=scale * [float(entry.meta["cowl"]), 0.0, float(dash)])
    return Body(prototype, scale, _size(scale * choice.model.size), seat)


@build_body.register
def _(choice: PlainChoice, shelf: Shelf) -> Body:
    """A plain body; near sizes share one, scaled by the little that they differ."""
    near = [
        round(2 * side) / 2 if side >= 2.0 else max(round(side, 1), 0.1) for side in choice.size
    ]
    length, width, height = near
    name = f"{choice.vclass} {length:g}x{width:g}x{height:g}"

    def make() -> Prototype:
        from sumo3dviz_pt.shapes.plain_bodies import plain_body

        made = plain_body(choice.vclass, length=length, width=width, height=height)
        return Prototype(name, made.parts, made.far)

    scale = np.array(choice.size) / near
    seat = class_seat(choice.vclass, np.array(choice.size))
    return Body(_shelved(shelf, name, make), scale, choice.size, seat)


@build_body.register
def _(choice: UserChoice, shelf: Shelf) -> Body:
    """A user's own mesh, as large as it is."""
    digest = hashlib.blake2b(str(choice.path).encode("utf-8"), digest_size=3).hexdigest()
    name = f"{choice.path.stem}-{digest}"
    meshes = read_user_mesh(choice.path)
    bounds = np.stack([mesh.bounds for mesh, _ in meshes])
    size = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
    parts, materials = _user_parts(meshes, name)
    prototype = _shelved(shelf, name, lambda: Prototype(name, parts, parts))
    return Body(prototype, np.ones(3), _size(size), class_seat(choice.vclass, size), materials)


def car_scale(model: Size, *, wanted: Size) -> Floats:
    """Factors along x, y, z that fit a car model to a vType, (3,).

    SUMO's default size is that of no car: the model keeps its proportions and is as
    wide as the default, or as long. Otherwise the length is exact, and so are width and
    height as long as that stretches the model by no more than a quarter; a height of
    1.5 m is SUMO's default too and leaves the height to follow the others.
    """
    if wanted == DEFAULT_CAR:
        return np.full(3, min(wanted[0] / model[0], wanted[1] / model[1]))
    factors = np.array(wanted) / model
    if wanted[2] == DEFAULT_CAR[2]:
        factors[2] = np.sqrt(factors[0] * factors[1])
    factors[1:] = np.clip(factors[1:], 1.0 / _LARGEST_STRETCH, _LARGEST_STRETCH)
    return factors


def _shelved(shelf: Shelf, name: str, make: Callable[[], Prototype]) -> Prototype:
    """A prototype from the shelf, made if it is not there."""
    if name not in shelf:
        shelf[name] = make()
    return shelf[name]


def _read_car(entry: catalog.Entry) -> Prototype:
    """Read the baked meshes of a car: `<material>.ply` and `far_<material>.ply`."""
    near: list[Part] = []
    far: list[Part] = []
    for path in sorted(entry.folder.glob("*.ply")):
        material = path.stem.removeprefix("far_")
        (near if material == path.stem else far).append(Part(read_ply(path), material))
    return Prototype(entry.name, tuple(near), tuple(far))


def _user_parts(
    meshes: Sequence[tuple[Mesh, Colour | None]], name: str
) -> tuple[tuple[Part, ...], dict[str, Bsdf]]:
    """Parts and their materials; what has no colour is painted."""
    parts, materials = [], {}
    for number, (mesh, colour) in enumerate(meshes):
        material = "paint" if colour is None else f"{name}/{number}"
        if colour is not None:
            materials[material] = principled(colour, roughness=0.35)
        parts.append(Part(mesh, material))
    return tuple(parts), materials


def _size(sides: Floats) -> Size:
    """Three numbers."""
    length, width, height = (float(side) for side in sides)
    return length, width, height
