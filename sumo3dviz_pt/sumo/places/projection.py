"""Between longitude and latitude and net coordinates.

References:
    SUMO's simple projection (`projParameter="-"`) was checked against Eclipse SUMO 1.28.0.
    L. Krueger, "Konforme Abbildung des Erdellipsoids in der Ebene", 1912, with the series
    to the third order of C. F. F. Karney, "Transverse Mercator with an accuracy of a few
    nanometers", Journal of Geodesy 85, 2011: a millimetre within 4000 km of the meridian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError, MissingExtraError, cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location

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
