"""Vehicle classes and types (`vType`), with SUMO's defaults.

A class has default sizes and shapes; they fill in what a type does not say.

References:
    Sizes and shapes were read from Eclipse SUMO 1.28.0 over TraCI with one empty
    `<vType vClass="..."/>` per class. Obsolete names follow SUMO's
    `SumoVehicleClassStrings` (utils/common/SUMOVehicleClass.cpp).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, VehicleType
from sumo3dviz_pt.sumo import values
from sumo3dviz_pt.sumo.additional import colour_of
from sumo3dviz_pt.sumo.stream import Element, read_elements


@dataclass(frozen=True, slots=True)
class ClassDefaults:
    """What a vType has when only its vClass is known.

    Attributes:
        length: Length of the body [m].
        width: Width of the body [m].
        height: Height of the body [m].
        gui_shape: SUMO's guiShape; empty where SUMO has none.
    """

    length: float
    width: float
    height: float
    gui_shape: str


def _size_of(kind: str) -> tuple[float, float, float]:
    """Return length, width and height of a kind of road users without a type [m]."""
    default = UNKNOWN_TYPES[kind]
    return default.length, default.width, default.height


_CAR = _size_of("vehicle")

CLASS_DEFAULTS: dict[str, ClassDefaults] = {
    # vClass: length, width, height [m], guiShape
    "private": ClassDefaults(*_CAR, "passenger"),
    "emergency": ClassDefaults(6.5, 2.16, 2.86, "delivery"),
    "authority": ClassDefaults(*_CAR, ""),
    "army": ClassDefaults(*_CAR, ""),
    "vip": ClassDefaults(*_CAR, "passenger"),
    "pedestrian": ClassDefaults(*_size_of("person"), "pedestrian"),
    "passenger": ClassDefaults(*_CAR, "passenger"),
    "hov": ClassDefaults(*_CAR, "passenger"),
    "taxi": ClassDefaults(*_CAR, "taxi"),
    "bus": ClassDefaults(12.0, 2.5, 3.4, "bus"),
    "coach": ClassDefaults(14.0, 2.6, 4.0, "bus/coach"),
    "delivery": ClassDefaults(6.5, 2.16, 2.86, "delivery"),
    "truck": ClassDefaults(7.1, 2.4, 2.4, "truck"),
    "trailer": ClassDefaults(16.5, 2.55, 4.0, "truck/trailer"),
    "motorcycle": ClassDefaults(2.2, 0.9, 1.5, "motorcycle"),
    "moped": ClassDefaults(2.1, 0.78, 1.7, "moped"),
    "bicycle": ClassDefaults(1.6, 0.65, 1.7, "bicycle"),
    "evehicle": ClassDefaults(*_CAR, "evehicle"),
    "tram": ClassDefaults(22.0, 2.4, 3.2, "rail/railcar"),
    "rail_urban": ClassDefaults(109.5, 3.0, 3.6, "rail/railcar"),
    "rail": ClassDefaults(135.0, 2.84, 3.75, "rail"),
    "rail_electric": ClassDefaults(200.0, 2.95, 3.89, "rail"),
    "rail_fast": ClassDefaults(200.0, 2.95, 3.89, "rail"),
    "ship": ClassDefaults(17.0, 4.0, 4.0, "ship"),
    "container": ClassDefaults(*_size_of("container"), ""),
    "cable_car": ClassDefaults(*_CAR, ""),
    "subway": ClassDefaults(109.5, 3.0, 3.6, "rail/railcar"),
    "aircraft": ClassDefaults(72.7, 79.8, 1.5, "aircraft"),
    "wheelchair": ClassDefaults(1.2, 0.72, 1.2, "pedestrian"),
    "scooter": ClassDefaults(1.2, 0.5, 1.7, "scooter"),
    "drone": ClassDefaults(0.5, 0.5, 1.5, ""),
    "custom1": ClassDefaults(*_CAR, "passenger"),
    "custom2": ClassDefaults(*_CAR, "passenger"),
}

ALL_CLASSES = frozenset(CLASS_DEFAULTS)

OBSOLETE_CLASSES = {
    "public_emergency": "emergency",
    "public_authority": "authority",
    "public_army": "army",
    "public_transport": "bus",
    "transport": "truck",
    "lightrail": "tram",
    "cityrail": "rail_urban",
    "rail_slow": "rail",
}

DEFAULT_TYPES = {
    "DEFAULT_VEHTYPE": "passenger",
    "DEFAULT_PEDTYPE": "pedestrian",
    "DEFAULT_BIKETYPE": "bicycle",
    "DEFAULT_TAXITYPE": "taxi",
    "DEFAULT_RAILTYPE": "rail",
    "DEFAULT_CONTAINERTYPE": "container",
}

TYPE_OF_KIND = {
    "vehicle": "DEFAULT_VEHTYPE",
    "person": "DEFAULT_PEDTYPE",
    "container": "DEFAULT_CONTAINERTYPE",
}


def allowed_classes(allow: str, disallow: str) -> frozenset[str]:
    """Return the vClasses that may use a lane.

    Args:
        allow: The lane's `allow` list; wins where it is not empty.
        disallow: Its `disallow` list.

    Returns:
        vClasses; all of them where both lists are empty. Unknown names are ignored,
        so that nets of a later SUMO can be read.
    """
    if allow.strip():
        return _class_set(allow)
    return ALL_CLASSES - _class_set(disallow)


def _class_set(names: str) -> frozenset[str]:
    words = names.replace("|", " ").split()
    if "all" in words:
        return ALL_CLASSES
    return ALL_CLASSES & {OBSOLETE_CLASSES.get(word, word) for word in words}


_UNITS = {
    "locomotiveLength": values.UNIT_LENGTH,
    "carriageLength": values.UNIT_LENGTH,
    "carriageGap": values.UNIT_GAP,
}
"""Lengths that tell how a train is split, and their ranges; a negative one is not given."""

_DRAWN = (
    "locomotiveLength",
    "carriageLength",
    "carriageGap",
    "seatingWidth",
    "imgFile",
    "osgFile",
    "emissionClass",
)


def read_vehicle_types(paths: Iterable[Path]) -> dict[str, VehicleType]:
    """Read the vTypes of route and additional files, also those in distributions.

    Args:
        paths: Files, plain or gzipped; of two types with the same id the first counts.

    Returns:
        Types by id, with SUMO's defaults of their vClass filled in.

    Raises:
        InputError: If a file is damaged, or a type's vClass or size cannot be.
    """
    types: dict[str, VehicleType] = {}
    for path in paths:
        for element, params in _definitions(path):
            types.setdefault(element.text("id"), _vehicle_type(element, params))
    return types


def default_vehicle_type(type_id: str, kind: str, *, vclass: str | None = None) -> VehicleType:
    """Return the type that SUMO assumes where no file defines it.

    Args:
        type_id: SUMO's id; `DEFAULT_PEDTYPE` and similar ids have their own vClass.
        kind: `vehicle`, `person` or `container`.
        vclass: The vClass, if something tells it; else that of the id or of the kind.

    Returns:
        A type with this id and the sizes of its class.
    """
    vclass = vclass or DEFAULT_TYPES.get(type_id) or DEFAULT_TYPES[TYPE_OF_KIND[kind]]
    size = CLASS_DEFAULTS[vclass]
    return VehicleType(type_id, vclass, size.length, size.width, size.height, size.gui_shape)


def _definitions(path: Path) -> list[tuple[Element, dict[str, str]]]:
    """Return the vTypes of a file, each with its `<param>` children."""
    definitions: list[tuple[Element, dict[str, str]]] = []
    owner: Element | None = None
    for element in read_elements(path, root=(), what="a route or additional file of SUMO"):
        if element.tag == "vType":
            owner = element
            definitions.append((element, {}))
        elif owner is not None and element.depth <= owner.depth:
            owner = None
        elif owner is not None and element.tag == "param":
            definitions[-1][1][element.text("key")] = element.text("value", "")
    return definitions


def _vehicle_type(element: Element, params: dict[str, str]) -> VehicleType:
    type_id = element.text("id")
    vclass = _vclass(element, DEFAULT_TYPES.get(type_id, "passenger"))
    size = CLASS_DEFAULTS[vclass]
    drawn = {key: element.attributes[key] for key in _DRAWN if key in element.attributes} | params
    _check_units(replace(element, attributes=drawn))
    return VehicleType(
        id=type_id,
        vclass=vclass,
        length=element.number("length", size.length, within=values.BODY_LENGTH),
        width=element.number("width", size.width, within=values.BODY_WIDTH),
        height=element.number("height", size.height, within=values.BODY_WIDTH),
        gui_shape=element.text("guiShape", size.gui_shape),
        colour=colour_of(element),
        params=drawn,
    )


def _check_units(element: Element) -> None:
    """Refuse impossible lengths of carriages."""
    for key, within in _UNITS.items():
        if element.number(key, -1.0) > 0.0:
            element.number(key, within=within)


def _vclass(element: Element, default: str) -> str:
    name = element.text("vClass", default)
    vclass = OBSOLETE_CLASSES.get(name, name)
    if vclass == "ignoring":
        return default
    if vclass not in CLASS_DEFAULTS:
        known = ", ".join(sorted(CLASS_DEFAULTS))
        raise element.error(f'vClass="{cut(name)}" is unknown; SUMO has {known}')
    return vclass
