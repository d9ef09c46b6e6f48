"""Between longitude and latitude and net coordinates; where a scenario is counted from.

POIs and polygons that do not give net coordinates are placed, too.

Pictures must not hang on a network's offset. Networks lie anywhere: at 0, at the northings of UTM,
or where a larger network was cut. Houses, plants, surfaces and rounding follow coordinates, so all
that is read is counted from one point near the network, a whole number of kilometres from SUMO's
own 0: `Location.origin`. A scenario and its shift by whole kilometres are the same then, bit by
bit.

References:
    SUMO's simple projection (`projParameter="-"`) was checked against Eclipse SUMO 1.28.0.
    L. Krueger, "Konforme Abbildung des Erdellipsoids in der Ebene", 1912, with the series
    to the third order of C. F. F. Karney, "Transverse Mercator with an accuracy of a few
    nanometers", Journal of Geodesy 85, 2011: a millimetre within 4000 km of the meridian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError, MissingExtraError, cut
from sumo3dviz_pt.model.geometry import Floats, arc_length
from sumo3dviz_pt.model.network import Lane, Location, Network
from sumo3dviz_pt.sumo import values
from sumo3dviz_pt.sumo.stream import Element
from sumo3dviz_pt.sumo.values import parse_flag, parse_number

_NONE, _SIMPLE = ("!", ""), "-"
_PER_DEGREE = np.array([111_320.0, 111_136.0])  # along a parallel at the equator, a meridian [m]

_RADIUS, _FLATTENING = 6_378_137.0, 1.0 / 298.257223563
"""Of the ellipsoid of WGS84, from which that of GRS80 differs by less than a millimetre [m]."""

_N = _FLATTENING / (2.0 - _FLATTENING)
_RECTIFYING = _RADIUS / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_FORWARD = (
    _N / 2 - 2 * _N**2 / 3 + 5 * _N**3 / 16,
    13 * _N**2 / 48 - 3 * _N**3 / 5,
    61 * _N**3 / 240,
)
_BACK = (
    _N / 2 - 2 * _N**2 / 3 + 37 * _N**3 / 96,
    _N**2 / 48 + _N**3 / 15,
    17 * _N**3 / 480,
)
_LATITUDE = (
    2 * _N - 2 * _N**2 / 3 - 2 * _N**3,
    7 * _N**2 / 3 - 8 * _N**3 / 5,
    56 * _N**3 / 15,
)
"""Karney's alpha, beta and (from Krueger) delta, for the sines of 2, 4 and 6 times an angle."""

_ELLIPSOIDS = frozenset({"WGS84", "GRS80"})


@dataclass(frozen=True, slots=True)
class _TransverseMercator:
    """A transverse Mercator projection of the usual ellipsoid.

    Attributes:
        latitude: Of its origin [deg].
        longitude: Of its meridian [deg].
        scale: On the meridian.
        shift: What it adds, (x, y) [m].
    """

    latitude: float
    longitude: float
    scale: float
    shift: tuple[float, float]

    def place(self, x: float, y: float) -> tuple[float, float] | None:
        """Return latitude and longitude [deg]; None where the projection does not reach.

        Args:
            x: Easting [m].
            y: Northing [m].
        """
        start = _rectified(math.radians(self.latitude))
        xi = start + (y - self.shift[1]) / (self.scale * _RECTIFYING)
        eta = (x - self.shift[0]) / (self.scale * _RECTIFYING)
        if abs(xi) > math.pi / 2 or abs(eta) > math.pi / 5:
            return None
        twice = [2.0 * (k + 1) for k in range(len(_BACK))]
        up = xi - sum(
            b * math.sin(k * xi) * math.cosh(k * eta) for b, k in zip(_BACK, twice, strict=True)
        )
        aside = eta - sum(
            b * math.cos(k * xi) * math.sinh(k * eta) for b, k in zip(_BACK, twice, strict=True)
        )
        conformal = math.asin(math.sin(up) / math.cosh(aside))
        latitude = conformal + sum(
            d * math.sin(k * conformal) for d, k in zip(_LATITUDE, twice, strict=True)
        )
        east = math.degrees(math.atan2(math.sinh(aside), math.cos(up)))
        return math.degrees(latitude), (self.longitude + east + 180.0) % 360.0 - 180.0


def is_projected(location: Location) -> bool:
    """Whether places on the Earth have net coordinates."""
    return location.projection not in _NONE


def middle_of(location: Location) -> tuple[float, float] | None:
    """Return the latitude and longitude of the middle of a network's box [deg].

    Returns:
        None if there is no projection or no box, if the projection cannot be used, needs a package
        that is not installed or does not reach so far.
    """
    if not is_projected(location) or not any(location.boundary):
        return None
    west, south, east, north = location.boundary
    x = (west + east) / 2 - location.net_offset[0]
    y = (south + north) / 2 - location.net_offset[1]
    if location.projection == _SIMPLE:
        return _on_the_earth(_simple_place(x, y))
    known = _transverse(location.projection)
    return _on_the_earth(
        _place_by_proj(location.projection, x, y) if known is None else known.place(x, y)
    )


def convergence_at(place: tuple[float, float], location: Location) -> float:
    """Return how far a network's y axis points clockwise from true north [rad].

    Args:
        place: Latitude and longitude at which this is asked [deg].
        location: Of the network; its projection reaches there.
    """
    known = _transverse(location.projection)
    if known is not None:
        # On the sphere, which is within 0.01 degrees of the ellipsoid in a UTM zone.
        east = math.radians((place[1] - known.longitude + 180.0) % 360.0 - 180.0)
        return math.atan(math.tan(east) * math.sin(math.radians(place[0])))
    toward = 1e-4 if place[0] < 0.0 else -1e-4
    x, y = np.diff(net_from_geo(np.array([place[::-1], (place[1], place[0] + toward)]), location).T)
    north = math.atan2(float(x[0]) * toward, float(y[0]) * toward)
    return -north


def net_from_geo(degrees: Floats, location: Location) -> Floats:
    """Return net coordinates.

    Args:
        degrees: Longitudes and latitudes, (n, 2) [deg].
        location: Of the network; it must be projected.

    Returns:
        x and y, (n, 2) [m]; infinite where the projection does not reach.

    Raises:
        ConfigError: If the projection is none, or if the package for projections is not installed.
    """
    if location.projection == _SIMPLE:
        metres = degrees * _PER_DEGREE
        metres[:, 0] *= np.cos(np.radians(degrees[:, 1]))
    else:
        projection = _projection(location.projection)
        metres = np.column_stack(projection(degrees[:, 0], degrees[:, 1]))
    return np.asarray(metres + np.array(location.net_offset))


def _projection(parameters: str) -> Any:
    """Return a projection by its PROJ string."""
    try:
        from pyproj import Proj
        from pyproj.exceptions import ProjError
    except ImportError as error:
        raise MissingExtraError("longitudes and latitudes need pyproj", extra="geo") from error
    try:
        return Proj(parameters)
    except ProjError as error:
        raise ConfigError(
            f'the network\'s projParameter="{cut(parameters)}" is no projection that exists;'
            " write the network again with netconvert"
        ) from error


def _place_by_proj(parameters: str, x: float, y: float) -> tuple[float, float] | None:
    """Return the latitude and longitude of projected coordinates [deg] by pyproj, if it can."""
    try:
        longitude, latitude = _projection(parameters)(x, y, inverse=True)
    except ConfigError:
        return None
    return float(latitude), float(longitude)


def _simple_place(x: float, y: float) -> tuple[float, float]:
    """Return the latitude and longitude of SUMO's simple projection [deg]."""
    latitude = y / float(_PER_DEGREE[1])
    along = float(_PER_DEGREE[0]) * math.cos(math.radians(latitude))
    return latitude, x / along if along else math.inf


def _on_the_earth(place: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return a latitude and longitude that exist, or None."""
    if place is None or not (abs(place[0]) <= 90.0 and abs(place[1]) <= 180.0):
        return None
    return place


def _transverse(parameters: str) -> _TransverseMercator | None:
    """Return the transverse Mercator projection of a PROJ string, or None if it is another."""
    words = dict(word.lstrip("+").partition("=")[::2] for word in parameters.split())
    if words.keys() & {"a", "b", "rf", "towgs84"} or words.get("units", "m") != "m":
        return None
    if words.get("ellps", words.get("datum", "WGS84")) not in _ELLIPSOIDS:
        return None
    try:
        return _by_words(words)
    except (KeyError, ValueError):
        return None


def _by_words(words: dict[str, str]) -> _TransverseMercator | None:
    """Return the projection of PROJ's words.

    Raises:
        KeyError: If a word is missing.
        ValueError: If one is no number.
    """
    if words["proj"] == "utm":
        zone = int(words["zone"])
        if not 1 <= zone <= 60:
            return None
        north = 1e7 if "south" in words else 0.0
        return _TransverseMercator(0.0, 6.0 * zone - 183.0, 0.9996, (5e5, north))
    if words["proj"] not in ("tmerc", "etmerc"):
        return None
    return _TransverseMercator(
        float(words.get("lat_0", "0")),
        float(words.get("lon_0", "0")),
        float(words.get("k") or words.get("k_0", "1")),
        (float(words.get("x_0", "0")), float(words.get("y_0", "0"))),
    )


def _rectified(latitude: float) -> float:
    """Return the angle that grows as the way along a meridian does [rad]."""
    eccentricity = math.sqrt(_FLATTENING * (2.0 - _FLATTENING))
    sine = math.sin(latitude)
    conformal = math.atan(
        math.sinh(math.atanh(sine) - eccentricity * math.atanh(eccentricity * sine))
    )
    return conformal + sum(a * math.sin(2.0 * (k + 1) * conformal) for k, a in enumerate(_FORWARD))


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
        x, y = (poi.number(axis, within=values.COORDINATE) for axis in ("x", "y"))
        return (x, y) if network is None else placed(x, y, network)
    if "lane" in known:
        along = poi.number("pos", 0.0, within=values.COORDINATE)
        aside = poi.number("posLat", 0.0, within=values.COORDINATE)
        return _beside(network.lanes[known["lane"]], along, aside)
    degrees = np.array([[poi.number("lon", within=values.ANGLE), poi.number("lat")]])
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
    if not (np.abs(places) <= values.COORDINATE.high).all():
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
