"""The bodies that road users show, scaled to their vTypes, and vehicles opened for cameras inside.

Vehicles show the catalogue's models. Classes without any have plain bodies of their size, and users
can bring their own files. An opened vehicle may have needles on its dashboard.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import singledispatch
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import (
    CAR_CLASSES,
    BodySize,
    Choice,
    FigureChoice,
    ModelChoice,
    PlainChoice,
    UserChoice,
)
from sumo3dviz_pt.cast.drawing import Assembly, Unit
from sumo3dviz_pt.cast.figures import Seat, car_seat, class_seat, person
from sumo3dviz_pt.cast.fitting import Prototypes, fitted_model, made_once, sizes
from sumo3dviz_pt.library.materials import MATERIALS, principled, two_sided
from sumo3dviz_pt.library.people.people import stride_length
from sumo3dviz_pt.library.vehicles.cycles.pedalling import DEVELOPMENT, pedals
from sumo3dviz_pt.library.vehicles.interior.controls import (
    NEEDLE,
    dial_middles,
    needle,
    needle_angles,
)
from sumo3dviz_pt.library.vehicles.interior.cutaway import CutawayCabin, cutaway, has_dashboard
from sumo3dviz_pt.library.vehicles.plain_bodies import plain_body, plain_lamps
from sumo3dviz_pt.library.vehicles.user_mesh import UserVehicle, read_user_vehicle
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.scene import Bsdf, Mover, Part, Prototype
from sumo3dviz_pt.model.traffic import RAIL_CLASSES

_LARGEST_STRETCH = 1.25
"""Width and height of a model are scaled by no more than this factor."""

_HEAVY = 7.0
"""Longer vehicles roll and dive as lorries and buses do [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """What a road user shows.

    Attributes:
        assembly: Its units, unscaled.
        scale: Along x, y, z, (3,).
        size: As drawn: length, width, height [m].
        seat: As drawn.
        materials: What the prototypes need beside `MATERIALS`.
        stride: Length of a walker's two steps, or of a cyclist's way during a turn of the
            cranks [m]; or None.
        ride: What it does when it is accelerated: a name in `cast/poses.py`'s `SPRINGS`,
            `lean`, or nothing.
        vclass: What it is drawn as.
    """

    assembly: Assembly
    scale: Floats
    size: BodySize
    seat: Seat
    materials: Mapping[str, Bsdf] = field(default_factory=dict)
    stride: float | None = None
    ride: str = ""
    vclass: str = ""

    @property
    def prototype(self) -> Prototype:
        """What the first unit shows."""
        return self.assembly.units[0].prototype


@singledispatch
def build_body(choice: Choice, prototypes: Prototypes) -> Body:
    """Make the body of a choice.

    Args:
        choice: From `choose`.
        prototypes: Prototypes made before; new ones are added.

    Raises:
        ConfigError: If a user's file cannot be read.
    """
    raise TypeError(type(choice).__name__)


@build_body.register
def _(choice: ModelChoice, prototypes: Prototypes) -> Body:
    """A vehicle of the catalogue, from its baked meshes."""
    entry = catalog.find("vehicles", choice.model.name)
    fitted = fitted_model(entry, prototypes, choice)
    seat = _model_seat(entry, choice.vclass, fitted.scale, fitted.size)
    stride = DEVELOPMENT * float(fitted.scale[0]) if pedals(entry.meta) else None
    first = fitted.units[0]
    # Lengths count as models: each has full detail of its own.
    model = entry.name if first.given is None else first.prototype.name
    assembly = Assembly(model, fitted.units, fitted.hinged)
    ride = _ride(entry.meta, choice.vclass)
    return Body(
        assembly, fitted.scale, fitted.size, seat, stride=stride, ride=ride, vclass=choice.vclass
    )


def _ride(meta: Mapping[str, Any], vclass: str) -> str:
    """What a model does when it is accelerated."""
    build = str(meta.get("build", "car"))
    if build == "cycle":
        return "" if meta.get("half_track") else "lean"
    if vclass in RAIL_CLASSES or vclass == "ship" or build == "hull":
        return ""
    return "car" if float(meta["length"]) < _HEAVY else "heavy"


def _model_seat(entry: catalog.Entry, vclass: str, scale: Floats, size: BodySize) -> Seat:
    """Where people sit: as the model says, else as its class does."""
    meta = entry.meta
    if vclass not in CAR_CLASSES:
        seat = class_seat(vclass, np.array(size))
        eye = scale * np.array(meta["eye"]) if "eye" in meta else seat.eye
        foot = scale[0] * float(meta["cowl"]) if "cowl" in meta else seat.cowl[0]
        return Seat(eye, np.array([foot, *seat.cowl[1:]]))
    dash = meta.get("dash", 0.64 * float(meta["height"]))
    cowl = scale * np.array([float(meta["cowl"]), 0.0, float(dash)])
    return car_seat(scale * np.array(meta["eye"]), cowl=cowl)


@build_body.register
def _(choice: PlainChoice, prototypes: Prototypes) -> Body:
    """A plain body; near sizes share one, scaled by the little that they differ."""
    near = [
        round(2 * side) / 2 if side >= 2.0 else max(round(side, 1), 0.1) for side in choice.size
    ]
    length, width, height = near
    name = f"{choice.vclass} {length:g}x{width:g}x{height:g}"

    def make() -> Prototype:
        made = plain_body(choice.vclass, length=length, width=width, height=height)
        lamps = plain_lamps(choice.vclass, [part.mesh for part in made.parts])
        return Prototype(name, made.parts, made.far, lamps)

    scale = np.array(choice.size) / near
    seat = class_seat(choice.vclass, np.array(choice.size))
    unit = Unit(made_once(prototypes, name, make))
    return Body(Assembly(name, (unit,)), scale, choice.size, seat, vclass=choice.vclass)


@build_body.register
def _(choice: FigureChoice, prototypes: Prototypes) -> Body:
    """A person on foot, in all poses."""
    meta = catalog.find("people", choice.look).meta
    prototype = made_once(prototypes, choice.look, lambda: person(choice.look))
    scale = choice.height / float(meta["height"])
    bounds = np.stack([part.mesh.bounds for part in prototype.parts])
    size = sizes(scale * (bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)))
    stride = scale * stride_length(meta["recipe"])
    seat = class_seat("pedestrian", np.array(size))
    unit = Unit(prototype)
    return Body(Assembly(choice.look, (unit,)), np.full(3, scale), size, seat, stride=stride)


@build_body.register
def _(choice: UserChoice, prototypes: Prototypes) -> Body:
    """A user's own model, as large as it is or as long as its vType."""
    digest = hashlib.blake2b(str(choice.path).encode("utf-8"), digest_size=3).hexdigest()
    name = f"{choice.path.stem}-{digest}"
    made = read_user_vehicle(choice.path, materials=MATERIALS)
    bounds = np.stack([mesh.bounds for mesh, _ in made.pieces])
    size = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
    factor = choice.length / float(size[0]) if made.fitted else 1.0
    parts, materials = _user_parts(made, name)
    unit = Unit(made_once(prototypes, name, lambda: Prototype(name, parts, parts, made.lamps)))
    drawn = sizes(factor * size)
    seat = class_seat(choice.vclass, np.array(drawn))
    return Body(
        Assembly(name, (unit,)), np.full(3, factor), drawn, seat, materials, vclass=choice.vclass
    )


def _user_parts(made: UserVehicle, name: str) -> tuple[tuple[Part, ...], dict[str, Bsdf]]:
    """Parts and the materials that are not ours; open surfaces are seen from both sides."""
    parts, materials = [], {}
    for number, (mesh, finish) in enumerate(made.pieces):
        material = finish.named or f"{name}/{number}"
        if not finish.named:
            look = principled(finish.colour, roughness=finish.roughness, metallic=finish.metallic)
            materials[material] = two_sided(look)
        parts.append(Part(mesh, material))
    return tuple(parts), materials


_UNSTEERED = frozenset({"ship", "aircraft", "drone"})
"""What has neither a dashboard nor mirrors like those of cars and lorries, nor a wiped pane."""

_BOXES = frozenset({"container", "cable_car"})
"""The same, without a deck or nose before the eye."""

_BARS = frozenset({"rickshaw"})
"""What is steered with a handlebar of its own behind a windscreen."""

_WITH_ROWS = frozenset({"bus", "coach"})
"""What has rows of seats behind its driver."""


@dataclass(frozen=True, slots=True, eq=False)
class Cockpit:
    """A body that a camera sits in.

    Attributes:
        body: What is left of it.
        axes: Of the needles on its dashboard, in its frame, unscaled, (n, 3) [m].
    """

    body: Prototype
    axes: Floats

    @property
    def prototypes(self) -> dict[str, Prototype]:
        """What it is drawn with, by name."""
        made = needle() if len(self.axes) else None
        return {self.body.name: self.body, **({} if made is None else {made.name: made})}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the prototypes that it is drawn with, one for each part."""
        return (self.body.name, *[NEEDLE] * len(self.axes))

    def needles(self, cabin: Mover, *, speed: float) -> Iterator[Mover]:
        """Yield the needles, turned as a speed turns them.

        Args:
            cabin: The opened body at its place.
            speed: Of the vehicle [m/s].
        """
        for number, (axis, angle) in enumerate(zip(self.axes, needle_angles(speed), strict=False)):
            placed = cabin.world_from_body @ Transform.from_pose(axis, roll=angle)
            part = f"needle{number}"
            yield replace(cabin, prototype=NEEDLE, part=part, world_from_body=placed)


def cabin_of(body: Body) -> CutawayCabin:
    """Return what stands before the driver of a body."""
    if body.vclass in _UNSTEERED:
        return CutawayCabin.NONE
    if body.vclass in _BOXES:
        return CutawayCabin.BOX
    if body.vclass in _BARS:
        return CutawayCabin.BARS
    if body.vclass in _WITH_ROWS:
        return CutawayCabin.BUS
    return CutawayCabin.RAIL if body.vclass in RAIL_CLASSES else CutawayCabin.ROAD


def has_windscreen(body: Body) -> bool:
    """Return whether the driver of a body looks through a pane with wipers."""
    cabin = cabin_of(body)
    return cabin is CutawayCabin.BARS or has_dashboard(float(body.size[1]), cabin)


def open_cockpit(body: Body, *, left_hand: bool, wipers: bool) -> Cockpit:
    """Open a vehicle for a camera.

    Args:
        body: What it shows.
        left_hand: Whether traffic keeps left and drivers sit on the right.
        wipers: Whether wipers rest on its windscreen.
    """
    cowl, eye = body.seat.cowl / body.scale, body.seat.eye / body.scale
    eye = eye * [1.0, -1.0 if left_hand else 1.0, 1.0]
    cowl_x, belt = float(cowl[0]), float(cowl[2])
    opened = cutaway(
        body.prototype, cowl=cowl_x, belt=belt, eye=eye, wipers=wipers, cabin=cabin_of(body)
    )
    has_dials = any(lamp.role == "dials" for lamp in opened.lamps)
    return Cockpit(opened, dial_middles(eye) if has_dials else np.zeros((0, 3)))
