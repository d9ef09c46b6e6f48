"""The bodies that road users show, scaled to their vTypes.

Cars show the catalogue's models, other classes plain bodies of their size, and users
can bring their own files.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import singledispatch

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Bsdf, Colour, Part, Prototype
from sumo3dviz_pt.scene.body_choice import (
    DEFAULT_CAR,
    TALLEST_CAR,
    CarChoice,
    Choice,
    PlainChoice,
    Size,
    UserChoice,
)
from sumo3dviz_pt.scene.materials import principled, two_sided
from sumo3dviz_pt.scene.seats import Seat, car_seat, class_seat
from sumo3dviz_pt.shapes.plain_bodies import plain_body
from sumo3dviz_pt.shapes.ply import read_ply
from sumo3dviz_pt.shapes.user_mesh import read_user_mesh

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


Shelf = dict[str, Prototype]
"""Prototypes by name; each is made once."""


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
    height as long as that stretches the model by no more than a quarter. A height of
    1.5 m, SUMO's default, or one that no car has lets the height follow the others.
    """
    if wanted == DEFAULT_CAR:
        return np.full(3, min(wanted[0] / model[0], wanted[1] / model[1]))
    factors = np.array(wanted) / model
    if wanted[2] == DEFAULT_CAR[2] or wanted[2] > TALLEST_CAR:
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
            materials[material] = two_sided(principled(colour, roughness=0.35))
        parts.append(Part(mesh, material))
    return tuple(parts), materials


def _size(sides: Floats) -> Size:
    """Three numbers."""
    length, width, height = (float(side) for side in sides)
    return length, width, height
