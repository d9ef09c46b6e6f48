"""Read vehicle types (`vType`) and fill in SUMO's class defaults."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.sumo import bounds
from sumo3dviz_pt.sumo.additional import colour_of
from sumo3dviz_pt.sumo.classes import (
    CLASS_DEFAULTS,
    DEFAULT_TYPES,
    OBSOLETE_CLASSES,
    TYPE_OF_KIND,
)
from sumo3dviz_pt.sumo.stream import Element, read_elements

_UNITS = {
    "locomotiveLength": bounds.UNIT_LENGTH,
    "carriageLength": bounds.UNIT_LENGTH,
    "carriageGap": bounds.UNIT_GAP,
}
"""Lengths that tell how a train is split, and their ranges; a negative one is not given."""

_DRAWN = ("locomotiveLength", "carriageLength", "carriageGap", "seatingWidth", "imgFile", "osgFile")


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
    found: list[tuple[Element, dict[str, str]]] = []
    owner: Element | None = None
    for element in read_elements(path, root=(), what="a route or additional file of SUMO"):
        if element.tag == "vType":
            owner = element
            found.append((element, {}))
        elif owner is not None and element.depth <= owner.depth:
            owner = None
        elif owner is not None and element.tag == "param":
            found[-1][1][element.text("key")] = element.text("value", "")
    return found


def _vehicle_type(element: Element, params: dict[str, str]) -> VehicleType:
    type_id = element.text("id")
    vclass = _vclass(element, DEFAULT_TYPES.get(type_id, "passenger"))
    size = CLASS_DEFAULTS[vclass]
    drawn = {key: element.attributes[key] for key in _DRAWN if key in element.attributes} | params
    _check_units(replace(element, attributes=drawn))
    return VehicleType(
        id=type_id,
        vclass=vclass,
        length=element.number("length", size.length, within=bounds.BODY_LENGTH),
        width=element.number("width", size.width, within=bounds.BODY_WIDTH),
        height=element.number("height", size.height, within=bounds.BODY_WIDTH),
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
