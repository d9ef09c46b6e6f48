"""Where the sun stands, by date, time and place.

Azimuths are clockwise from true north. Networks are drawn in grid north, which
differs by the meridian convergence of their projection, up to 3 degrees in UTM.

References:
    J. Meeus, Astronomical Algorithms, 2nd ed., 1998, chapters 7, 12, 13, 22 and 25
    (low accuracy: 0.01 degrees between 1900 and 2100).
    T. Saemundsson, "Astronomical refraction", Sky and Telescope 72, 1986, in the form
    of Meeus (16.4).
"""

from __future__ import annotations

import datetime as dt
import math
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.zones import SOLAR, zone_named


@dataclass(frozen=True, slots=True)
class SunPosition:
    """A place on the sky.

    Attributes:
        azimuth: Clockwise from true north, [0, 2 pi) [rad].
        elevation: Above the horizon [rad].
    """

    azimuth: float
    elevation: float

    @property
    def direction(self) -> Floats:
        """Unit vector (east, north, up), (3,)."""
        return direction_of(self.azimuth, self.elevation)


def direction_of(azimuth: float, elevation: float) -> Floats:
    """Return the unit vector (east, north, up) of an azimuth clockwise from north [rad]."""
    level = math.cos(elevation)
    east, north = level * math.sin(azimuth), level * math.cos(azimuth)
    return np.array([east, north, math.sin(elevation)])


def sun_position(
    when: dt.datetime, *, latitude: float, longitude: float, refraction: bool = True
) -> SunPosition:
    """Return where the sun stands.

    Args:
        when: With time zone.
        latitude: North positive [rad].
        longitude: East positive [rad].
        refraction: Lift the sun as air does, half a degree at the horizon.
    """
    days = _julian_days(when)
    right_ascension, declination = _equatorial(days / 36525.0)
    hour_angle = _sidereal_time(days) + longitude - right_ascension
    south = math.cos(hour_angle) * math.sin(latitude) - math.tan(declination) * math.cos(latitude)
    azimuth = (math.atan2(math.sin(hour_angle), south) + math.pi) % (2 * math.pi)
    sine = math.sin(latitude) * math.sin(declination)
    sine += math.cos(latitude) * math.cos(declination) * math.cos(hour_angle)
    elevation = math.asin(max(-1.0, min(1.0, sine)))
    return SunPosition(azimuth, elevation + (_refraction(elevation) if refraction else 0.0))


def local_time(
    date: dt.date, time: dt.time, *, zone: str | None, latitude: float, longitude: float
) -> dt.datetime:
    """Return a clock's reading as a moment.

    Args:
        date: Calendar date.
        time: Clock time without time zone.
        zone: A name, an offset or `solar`; None is the place's own.
        latitude: North positive [deg].
        longitude: East positive [deg].

    Raises:
        ConfigError: If the place's zone is not known.
    """
    where = {"latitude": latitude, "longitude": longitude}
    name = zone_at(**where) if zone is None else zone
    if name != SOLAR:
        return dt.datetime.combine(date, time, tzinfo=zone_named(name))
    ahead = dt.timezone(dt.timedelta(hours=longitude / 15.0), "mean solar time")
    return dt.datetime.combine(date, time, tzinfo=ahead)


def zone_at(*, latitude: float, longitude: float) -> str:
    """Return the time zone in which a place lies [deg], by the borders of OpenStreetMap.

    Raises:
        ConfigError: If it is not known.
    """
    try:
        import tzfpy
    except ImportError as error:
        message = "zones of places need the package tzfpy; install it, or give the zone"
        raise ConfigError(message, key="sky.sun.zone") from error
    found = str(tzfpy.get_tz(longitude, latitude))
    if not found:
        raise ConfigError("no time zone is known there; give one", key="sky.sun.zone")
    return found


def _julian_days(when: dt.datetime) -> float:
    """Days since J2000.0 in universal time; the 70 s to dynamical time move it by 0.001 deg."""
    start = dt.datetime(2000, 1, 1, 12, tzinfo=dt.UTC)
    return (when - start).total_seconds() / 86400.0


def _equatorial(centuries: float) -> tuple[float, float]:
    """Apparent right ascension and declination [rad], Meeus chapter 25."""
    t = centuries
    mean_longitude = 280.46646 + t * (36000.76983 + t * 0.0003032)
    anomaly = math.radians(357.52911 + t * (35999.05029 - t * 0.0001537))
    centre = (1.914602 - t * (0.004817 + t * 0.000014)) * math.sin(anomaly)
    centre += (0.019993 - 0.000101 * t) * math.sin(2 * anomaly) + 0.000289 * math.sin(3 * anomaly)
    node = math.radians(125.04 - 1934.136 * t)
    longitude = math.radians(mean_longitude + centre - 0.00569 - 0.00478 * math.sin(node))
    tilt = 23.4392911 - t * (0.0130042 + t * (1.64e-7 - t * 5.04e-7))
    obliquity = math.radians(tilt + 0.00256 * math.cos(node))
    rise = math.cos(obliquity) * math.sin(longitude)
    return (
        math.atan2(rise, math.cos(longitude)),
        math.asin(math.sin(obliquity) * math.sin(longitude)),
    )


def _sidereal_time(days: float) -> float:
    """Mean sidereal time at Greenwich [rad], Meeus (12.4)."""
    t = days / 36525.0
    return math.radians(280.46061837 + 360.98564736629 * days + t * t * 0.000387933) % (2 * math.pi)


def _refraction(elevation: float) -> float:
    """Lift at 10 C and 1010 hPa [rad]; fades out where the sun is far below the horizon."""
    degrees = math.degrees(elevation)
    lowest = max(degrees, -1.0)
    minutes = 1.02 / math.tan(math.radians(lowest + 10.3 / (lowest + 5.11)))
    fade = min(1.0, max(0.0, (degrees + 3.0) / 2.0))
    return math.radians(max(minutes, 0.0) / 60.0) * fade
