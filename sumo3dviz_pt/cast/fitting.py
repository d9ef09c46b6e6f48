"""Vehicles of the catalogue, fitted to the sizes of vTypes.

Cars are stretched, cycles scaled, trains get more cars; bodies with a part that may give
keep all else in shape. Wheels stay round.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import (
    CAR_CLASSES,
    DEFAULT_CAR,
    TALLEST_CAR,
    BodySize,
    CouplingRow,
    ModelChoice,
    coupled,
    numbered,
    pitch_of,
    spare_units,
)
from sumo3dviz_pt.cast.drawing import Joint, Unit
from sumo3dviz_pt.cast.figures import Posed, cyclist
from sumo3dviz_pt.library.vehicles.cycles.pedalling import pedals
from sumo3dviz_pt.library.vehicles.glazing import glazed
from sumo3dviz_pt.library.vehicles.packed import BODIES, read_levels
from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.library.vehicles.stretching import (
    Bellows,
    BodyStretch,
    bellows,
    round_wheels,
    stretched,
    turned_round,
)
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Prototype, VehicleLamp

_LARGEST_STRETCH = 1.25
"""Width and height of a model are scaled by no more than this factor."""

_LARGEST_SCALE = 1.12
"""Bodies that may be longer or shorter are scaled as a whole by no more than this."""

_OF_NO_HEIGHT = frozenset(["aircraft", "drone", "cable_car"])
"""Classes for which SUMO's default height is that of a car; their models keep their shape."""

_OVAL = 0.04
"""Wheels that would be less oval than this are left alone."""

Prototypes = dict[str, Prototype]
"""Prototypes by name; each is made once."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A vehicle of the catalogue for a vType.

    Attributes:
        units: From front to rear.
        scale: Along x, y, z, (3,).
        size: As drawn: length, width, height [m].
        hinged: Whether the units' ends are kept together where it bends.
    """

    units: tuple[Unit, ...]
    scale: Floats
    size: BodySize
    hinged: bool = False


def fitted_model(entry: catalog.Entry, prototypes: Prototypes, choice: ModelChoice) -> Fitted:
    """Fit a vehicle to a vType's size.

    Args:
        entry: The vehicle.
        prototypes: Prototypes made before; new ones are added.
        choice: Says the size.
    """
    if "units" in entry.meta:
        units, length = _units(entry, prototypes, choice)
        own = (length, *choice.model.size[1:])
        scale = model_scale(own, wanted=choice.size, car=False)
        hinged = bool(entry.meta.get("hinged", False))
        return Fitted(units, scale, sizes(scale * own), hinged)
    if entry.meta.get("build") == "cycle":
        return _scaled(entry, prototypes, choice)
    if "stretch" in entry.meta:
        return _stretched(entry, prototypes, choice)
    size = choice.size
    if choice.vclass in _OF_NO_HEIGHT and size[2] == DEFAULT_CAR[2]:
        size = (*size[:2], choice.model.size[2] * size[0] / choice.model.size[0])
    scale = model_scale(choice.model.size, wanted=size, car=choice.vclass in CAR_CLASSES)
    unit = _rounded(_unit(entry, prototypes, at=0.0), prototypes, ratio=float(scale[0] / scale[2]))
    return Fitted((unit,), scale, sizes(scale * choice.model.size))


def _scaled(entry: catalog.Entry, prototypes: Prototypes, choice: ModelChoice) -> Fitted:
    """As a whole: SUMO's default height of a bicycle says nothing about its rider."""
    factor = choice.size[0] / choice.model.size[0]
    scale = np.full(3, np.clip(factor, 1.0 / _LARGEST_STRETCH, _LARGEST_STRETCH))
    return Fitted((_unit(entry, prototypes, at=0.0),), scale, sizes(scale * choice.model.size))


def _stretched(entry: catalog.Entry, prototypes: Prototypes, choice: ModelChoice) -> Fitted:
    """Where it may give, so that cab and wheels keep their shape; as wide as its vType."""
    length, width, height = choice.model.size
    across = float(np.sqrt(choice.size[1] / width * choice.size[2] / height))
    factor = float(np.clip(across, 1.0 / _LARGEST_SCALE, _LARGEST_SCALE))
    first, last = entry.meta["stretch"]
    # Half metres, so that vTypes of nearly one length share a body.
    wanted = round(2.0 * choice.size[0] / factor) / 2.0
    stretch = BodyStretch.to_length((float(first), float(last)), extra=wanted - length)
    name = f"{entry.name}@{length + stretch.gain:.1f}"
    plain = _unit(entry, prototypes, at=0.0)
    body = made_once(prototypes, name, lambda: stretched(plain.prototype, stretch, name=name))
    wheels = tuple(replace(place, at=stretch.moved_point(place.at)) for place in plain.wheels)
    unit = Unit(body, wheels=wheels, model=entry.name, given=stretch)
    along = choice.size[0] / (length + stretch.gain)
    aside = np.clip(choice.size[1] / width, factor / _LARGEST_SCALE, factor * _LARGEST_SCALE)
    scale = np.array([along, float(aside), factor])
    return Fitted((unit,), scale, sizes(scale * (length + stretch.gain, width, height)))


def _rounded(unit: Unit, prototypes: Prototypes, *, ratio: float) -> Unit:
    """A unit whose wheels stay round under a scale."""
    step = round(20.0 * ratio) / 20.0
    if abs(ratio - 1.0) < _OVAL or not unit.wheels:
        return unit
    name = f"{unit.prototype.name}~{step:.2f}"
    body = made_once(
        prototypes, name, lambda: round_wheels(unit.prototype, unit.wheels, ratio=step, name=name)
    )
    return replace(unit, prototype=body, model=unit.prototype.name)


def _units(
    entry: catalog.Entry, prototypes: Prototypes, choice: ModelChoice
) -> tuple[tuple[Unit, ...], float]:
    """The units of a vehicle and their length in all [m].

    A row of `units` may say where the unit is held to the path, `pivots: [first, second]`
    behind its own front, and what hangs behind it, `bellows: {from, to, half, low, high,
    folds}`: `from` behind its own front, `to` behind that of the next unit [m].
    """
    rows: list[CouplingRow] = list(entry.meta["units"])
    if choice.carriages is None:
        length, pitch = float(entry.meta["length"]), pitch_of(rows)
        more = spare_units(length, pitch, wanted=choice.size[0])
        placed = coupled(rows, more)
        units = [_coupled_unit(row, prototypes, at=x) for row, x in placed]
        return _joined(units, [row for row, _ in placed], prototypes), length + more * pitch
    spans = choice.carriages.split(choice.size[0])
    chosen = numbered(rows, len(spans))
    units = [
        _coupled_unit(row, prototypes, at=-behind, length=own)
        for row, (behind, own) in zip(chosen, spans, strict=True)
    ]
    return _joined(units, chosen, prototypes), choice.size[0]


def _coupled_unit(
    row: CouplingRow, prototypes: Prototypes, *, at: float, length: float | None = None
) -> Unit:
    """A unit of a whole; of another length than its model's where that is given [m]."""
    entry = catalog.find("vehicles", str(row["model"]))
    own = float(entry.meta["length"])
    pivots = None
    if "pivots" in row:
        first, second = (float(value) for value in row["pivots"])
        pivots = (first, second)
    unit = _unit(entry, prototypes, at=at)
    return replace(unit, length=own, pivots=pivots, stretch=(length or own) / own)


def _joined(units: list[Unit], rows: list[CouplingRow], prototypes: Prototypes) -> tuple[Unit, ...]:
    """Units with what hangs between them."""
    made = []
    for unit, after, row in zip(units, units[1:], rows, strict=False):
        joint = _joint(unit, after, row["bellows"], prototypes) if "bellows" in row else None
        made.append(replace(unit, joint=joint))
    return (*made, units[-1])


def _joint(unit: Unit, after: Unit, row: Mapping[str, Any], prototypes: Prototypes) -> Joint:
    """A bellows between two units."""
    ahead, behind = float(row["from"]), float(row["to"])
    length = unit.at - after.at + behind * after.stretch - ahead * unit.stretch
    half, low, high = (float(row[key]) for key in ("half", "low", "high"))
    shape = Bellows(round(length, 3), half, low, high, int(row["folds"]))
    name = f"bellows {shape.length:g}x{half:g}x{low:g}-{high:g}"

    def make() -> Prototype:
        near, poses = bellows(shape)
        far, far_poses = bellows(shape, far=True)
        return Prototype(name, (near,), (far,), poses=poses, far_poses=far_poses)

    return Joint(made_once(prototypes, name, make), shape.length, ahead, behind)


def _unit(entry: catalog.Entry, prototypes: Prototypes, *, at: float) -> Unit:
    """One baked model."""
    prototype = _baked_once(entry, prototypes)
    wheels = tuple(_wheel(row) for row in entry.meta.get("wheels", ()))
    return Unit(prototype, at, wheels if "full" in entry.meta else ())


def _baked_once(entry: catalog.Entry, prototypes: Prototypes) -> Prototype:
    """A baked model as it is; a process reads each once, for all its shots."""
    return made_once(prototypes, entry.name, lambda: _read_once(entry.folder))


@cache
def _read_once(folder: Path) -> Prototype:
    """The vehicle of a folder of the catalogue."""
    return read_vehicle(catalog.find("vehicles", folder.name))


def _wheel(row: Mapping[str, Any]) -> WheelPlace:
    """A wheel as `baked.yaml` lists it."""
    x, y, z = (float(value) for value in row["at"])
    turned = bool(row.get("reversed", False))
    return WheelPlace((x, y, z), float(row["radius"]), bool(row["steered"]), turned)


def model_scale(model: BodySize, *, wanted: BodySize, car: bool = True) -> Floats:
    """Return factors along x, y, z that fit a model to a vType, (3,).

    SUMO's default size is that of no car: the model keeps its proportions and is as
    wide as the default, or as long. Otherwise the length is exact, and so are width and
    height as long as that stretches the model by no more than a quarter. A height of
    1.5 m, SUMO's default, or one that no car has lets the height follow the others.

    Args:
        model: Size of the model [m].
        wanted: Size of the vType [m].
        car: Whether these rules for cars count.
    """
    if car and wanted == DEFAULT_CAR:
        return np.full(3, min(wanted[0] / model[0], wanted[1] / model[1]))
    factors = np.array(wanted) / model
    if car and (wanted[2] == DEFAULT_CAR[2] or wanted[2] > TALLEST_CAR):
        factors[2] = np.sqrt(factors[0] * factors[1])
    factors[1:] = np.clip(factors[1:], 1.0 / _LARGEST_STRETCH, _LARGEST_STRETCH)
    return factors


def made_once(prototypes: Prototypes, name: str, make: Callable[[], Prototype]) -> Prototype:
    """Return the prototype of a name; make it if it is not there.

    Args:
        prototypes: Those made before; a new one is added.
        name: Its name.
        make: Makes it.
    """
    if name not in prototypes:
        prototypes[name] = make()
    return prototypes[name]


def read_vehicle(
    entry: catalog.Entry, *, ridden: Callable[[catalog.Entry], Posed] = cyclist
) -> Prototype:
    """Read the baked meshes and lamps of a vehicle.

    Args:
        entry: The vehicle.
        ridden: Makes one whose rider pedals.
    """
    levels = read_levels(
        catalog.find("vehicles", entry.meta.get("turns", entry.name)).folder / BODIES
    )
    near, far = (
        tuple(
            glazed(
                ((name, _turned(levels[level][name], entry)) for name in entry.meta[level]),
                entry.meta,
            )
        )
        for level in ("parts", "far")
    )
    lamps = tuple(_lamp(row) for row in entry.meta["lamps"])
    if not pedals(entry.meta):
        return Prototype(entry.name, near, far, lamps)
    parts, poses = ridden(entry)
    return Prototype(entry.name, parts, far, lamps, poses=poses)


def _turned(mesh: Mesh, entry: catalog.Entry) -> Mesh:
    """A baked mesh; one of another vehicle that this one turns round is turned."""
    return turned_round(mesh, float(entry.meta["length"])) if "turns" in entry.meta else mesh


def _lamp(row: Mapping[str, Any]) -> VehicleLamp:
    """A lamp as `baked.yaml` lists it."""
    x, y, z = (float(value) for value in row["at"])
    width, height = (float(value) for value in row["size"])
    return VehicleLamp(str(row["role"]), (x, y, z), (width, height), float(row["yaw"]))


def sizes(sides: Floats) -> BodySize:
    """Return an array, (3,) [m], as a size."""
    length, width, height = (float(side) for side in sides)
    return length, width, height
