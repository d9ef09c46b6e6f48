"""Where POIs and polygons are that do not give net coordinates."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Location, Network
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.sumo import bounds
from sumo3dviz_pt.sumo.places.projection import is_projected, net_from_geo
from sumo3dviz_pt.sumo.stream import Element
from sumo3dviz_pt.sumo.values import parse_flag

_UNPROJECTED = "their places are in longitude and latitude, and the network has no projection"


def unplaced(element: Element, network: Network | None) -> str:
    """Return why a POI or a polygon has no place in the network, or nothing."""
    known = element.attributes
    projected = network is not None and is_projected(network.location)
    if element.tag == "poly":
        return _UNPROJECTED if is_geo(element) and not projected else ""
    if {"x", "y"} <= known.keys():
        return ""
    if "lane" in known:
        there = network is not None and known["lane"] in network.lanes
        return "" if there else "the network does not have their lanes"
    if {"lon", "lat"} <= known.keys():
        return "" if projected else _UNPROJECTED
    return "they have neither x and y, nor lon and lat, nor a lane"


def is_geo(polygon: Element) -> bool:
    """Whether a polygon's shape is in longitude and latitude."""
    return parse_flag(polygon.text("geo", "false"))


def poi_position(poi: Element, network: Network | None) -> tuple[float, float]:
    """Return where a POI is that has a place in the network [m].

    Raises:
        InputError: If a number is missing or out of range.
    """
    known = poi.attributes
    if network is None or {"x", "y"} <= known.keys():
        x, y = (poi.number(axis, within=bounds.COORDINATE) for axis in ("x", "y"))
        return (x, y) if network is None else placed(x, y, network)
    if "lane" in known:
        along = poi.number("pos", 0.0, within=bounds.COORDINATE)
        aside = poi.number("posLat", 0.0, within=bounds.COORDINATE)
        return _beside(network.lanes[known["lane"]], along, aside)
    degrees = np.array([[poi.number("lon", within=bounds.ANGLE), poi.number("lat")]])
    return _checked(poi, net_from_geo(degrees, network.location))


def placed(x: float, y: float, network: Network) -> tuple[float, float]:
    """Return our coordinates of SUMO's [m]."""
    x, y = network.location.inside([x, y]).tolist()
    return x, y


def shape_in_net(polygon: Element, degrees: Floats, location: Location) -> Floats:
    """Return a polygon's shape in net coordinates, (n, 2) [m].

    Args:
        polygon: The polygon, for messages.
        degrees: Longitudes and latitudes, (n, 2) [deg].
        location: Of the network.

    Raises:
        InputError: If a point is nowhere in the projection.
    """
    shape = net_from_geo(degrees, location)
    _checked(polygon, shape)
    return shape


def _checked(element: Element, places: Floats) -> tuple[float, float]:
    """Return the first of some places; all of them must be on the Earth."""
    if not (np.abs(places) <= bounds.COORDINATE.high).all():
        raise element.error("the network's projection does not reach its longitude and latitude")
    return float(places[0, 0]), float(places[0, 1])


def _beside(lane: Lane, along: float, aside: float) -> tuple[float, float]:
    """Return a place beside a lane [m].

    Args:
        lane: The lane.
        along: Distance from its begin, or from its end if negative [m].
        aside: Distance from its centre line to the left [m].
    """
    line = lane.shape[:, :2]
    stations = arc_length(line)
    place = along + lane.length if along < 0.0 else along
    at = float(np.clip(place * stations[-1] / max(lane.length, 1e-9), 0.0, stations[-1]))
    number = int(np.clip(np.searchsorted(stations, at, side="right") - 1, 0, len(line) - 2))
    step = line[number + 1] - line[number]
    length = max(float(np.linalg.norm(step)), 1e-9)
    point = line[number] + step * ((at - stations[number]) / length)
    left = np.array([-step[1], step[0]]) / length
    x, y = point + aside * left
    return float(x), float(y)
