"""Choose the place from which a scenario is counted, so that pictures do not hang on its offset.

Networks lie anywhere: at 0, at the northings of UTM, or where a larger network was cut. Houses,
plants, surfaces and rounding follow coordinates, so all that is read is counted from one point near
the network, a whole number of kilometres from SUMO's own 0: `Location.origin`. A scenario and its
shift by whole kilometres are the same then, bit by bit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.sumo.places.projection import convergence_at, middle_of
from sumo3dviz_pt.sumo.stream import Element
from sumo3dviz_pt.sumo.values import parse_number

_KILOMETRE = 1000.0
_BELOW = 250.0
"""Networks whose low corner lies down to this far below a whole kilometre belong to it [m].

Outlines of junctions and hand-written coordinates often reach a little below 0.
"""

_FARTHEST = 1e6
"""A box whose low corner is farther than this from the network's first point is not its own [m]."""

Place = tuple[float, float]


def first_place(element: Element) -> Place | None:
    """Return where an element of a network is, x and y [m]; None if it does not say or is wrong."""
    known = element.attributes
    if element.tag not in ("lane", "junction"):
        return None
    words = known.get("shape", "").split()
    numbers = words[0].split(",")[:2] if words else [known.get("x", ""), known.get("y", "")]
    try:
        x, y = map(parse_number, numbers)
    except ValueError:
        return None  # whoever reads the element says what is wrong with it
    return x, y


def counted_from(location: Location, first: Place | None) -> Location:
    """Return a location that is counted from a whole kilometre near the network.

    Args:
        location: As it stands in the file.
        first: The first place that the file gives [m]; None where it gives none.
    """
    box, origin = np.reshape(location.boundary, (2, 2)), np.zeros(2)
    if first is not None:
        low = box[0] if any(location.boundary) and _near(box[0], first) else np.array(first)
        origin = _KILOMETRE * np.floor((low + _BELOW) / _KILOMETRE)
    x, y = origin.tolist()
    return settled(replace(location, origin=(x, y)))


def settled(location: Location) -> Location:
    """Return what stands in a file counted from a location's origin, with its place on Earth."""
    west, south, east, north = location.boundary
    if any(location.boundary):
        corners = location.inside(np.array([[west, south], [east, north]]))
        west, south, east, north = corners.ravel().tolist()
    x, y = location.inside(np.array(location.net_offset)).tolist()
    moved = replace(location, net_offset=(x, y), boundary=(west, south, east, north))
    place = middle_of(moved)
    turned = 0.0 if place is None else convergence_at(place, moved)
    return replace(moved, place=place, convergence=turned)


def _near(corner: np.ndarray, first: Place) -> bool:
    """Return whether a box's low corner may be that of a network with a point."""
    away = np.array(first) - corner
    return bool((away >= -_KILOMETRE).all() and (away <= _FARTHEST).all())
