"""The sky of a scene: where the sun stands, whether it is dark, and what is above.

The sun stands where date, time and place say. Azimuths are clockwise from true north. Networks are
drawn in grid north, which differs by the meridian convergence of their projection, up to 3 degrees
in UTM. Where it is dark, lamps are lit.

There are three kinds of sky, registered in `KINDS` by the setting that asks for them: a user's
radiance map (`file`), a preset of ours with or without clouds (`preset`), and the clear sky of a
date, time and place (`sun`).

References:
    J. Meeus, Astronomical Algorithms, 2nd ed., 1998, chapters 7, 12, 13, 22 and 25
    (low accuracy: 0.01 degrees between 1900 and 2100).
    T. Saemundsson, "Astronomical refraction", Sky and Telescope 72, 1986, in the form
    of Meeus (16.4).
"""

from __future__ import annotations

import datetime as dt
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.job.settings import Lights, SkySettings, SunSettings
from sumo3dviz_pt.library.pictures import read_radiance_map, stored_clouds
from sumo3dviz_pt.model.geometry import Colour, Floats, Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.numbers import SOLAR, zone_named
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.model.weather import StoredClouds


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
    zone = known_zone(latitude=latitude, longitude=longitude)
    if not zone:
        raise ConfigError("no time zone is known there; give one", key="sky.sun.zone")
    return zone


def known_zone(*, latitude: float, longitude: float) -> str:
    """Return the same; empty where no zone is known, as at sea.

    Raises:
        ConfigError: If the package that knows zones is missing.
    """
    try:
        import tzfpy
    except ImportError as error:
        message = "zones of places need the package tzfpy; install it, or give the zone"
        raise ConfigError(message, key="sky.sun.zone") from error
    return str(tzfpy.get_tz(longitude, latitude))


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


LIGHTING_UP = float(np.radians(-1.0))
"""Elevation of the sun below which lamps are lit [rad]: about 300 lx are left."""


def is_dark(sky: Sky, lights: Lights = "auto") -> bool:
    """Return whether lamps are lit and light something.

    Args:
        sky: The environment; one from a file has no sun and counts as day.
        lights: The scene file's word: `auto` goes by the sun.
    """
    if lights != "auto":
        return lights == "on"
    return sky.sun_direction is not None and bool(sky.sun_direction[2] < np.sin(LIGHTING_UP))


logger = logging.getLogger(__name__)

DEFAULT_PRESET = "sky_blue"
"""Used where a scene file has no sky."""

NIGHT = (4.0e-7, 5.0e-7, 8.0e-7)
"""Radiance of a moonless sky over a city, about 0.016 cd/m^2 [scene units]."""

NOON_IRRADIANCE = 3.1
"""On the ground at clear noon [scene units]: 100 klx, 32 kcd/m^2 per unit."""

DARK = float(np.radians(-7.0))
"""Sun below which stars, moon and city glow are there [rad]."""

STARS = 17
"""Seed of the stars of a sky that has no preset."""

# Elevation of the sun [deg] and stops that make up for 0.8 of the light that the mean
# of ground and sunlit wall lacks against noon: dusk stays darker than noon. Below
# -6 degrees lamps take over: at night a street lit by 15 to 20 lx shows its asphalt at a
# tenth of white, 8 cd/m^2. Noon itself lies a little above 0, because a picture with
# asphalt and sky at their true place beside a white wall looks dim.
_EXPOSURE = np.array(
    [
        # elevation [deg], exposure [EV]
        (-14.0, 12.0),
        (-10.0, 11.8),
        (-6.0, 10.9),
        (-4.0, 9.3),
        (-2.0, 7.3),
        (0.0, 5.5),
        (2.0, 4.4),
        (5.0, 3.4),
        (10.0, 2.4),
        (20.0, 1.3),
        (30.0, 0.85),
        (45.0, 0.5),
        (60.0, 0.4),
        (90.0, 0.4),
    ]
)


@dataclass(frozen=True, slots=True)
class SkyPreset:
    """Content of a file in `scene_templates/sky`.

    Attributes:
        sun: `azimuth` clockwise from north and `elevation` [deg]; default: the one
            that the clouds were baked for.
        turbidity: Of the clear sky behind the clouds, [1, 10].
        clouds: A sky asset's name, or None.
        exposure: Added to the exposure for the height of the sun [EV].
        tint: What the sun's light and sky are multiplied with.
        night: Radiance of the sky without sun and moon, scene units.
        moon: `azimuth` and `elevation` of a full moon [deg], or None.
        stars: Their seed, or None for none.
        glow: Radiance of a city's light at the horizon, scene units.
        purpose: What it is for.
    """

    sun: Mapping[str, float] | None = None
    turbidity: float = 3.0
    clouds: str | None = None
    exposure: float = 0.0
    tint: Sequence[float] = (1.0, 1.0, 1.0)
    night: Sequence[float] = NIGHT
    moon: Mapping[str, float] | None = None
    stars: int | None = None
    glow: Sequence[float] = (0.0, 0.0, 0.0)
    purpose: str = ""


def base_exposure(elevation: float) -> float:
    """Return the exposure at which a clear sky and its ground look right.

    Depends on nothing but the sun, so that all frames and all variants of a study
    share it.

    Args:
        elevation: Of the sun [rad].

    Returns:
        EV; falls smoothly with the sun's elevation from 12 at night to 0.4.
    """
    from scipy.interpolate import PchipInterpolator

    curve = PchipInterpolator(_EXPOSURE[:, 0], _EXPOSURE[:, 1])
    lowest, highest = _EXPOSURE[0, 0], _EXPOSURE[-1, 0]
    return float(curve(np.clip(np.degrees(elevation), lowest, highest)))


def sun_of(settings: SunSettings, *, location: Location | None) -> SunPosition:
    """Return where the sun stands in the network's north, by angles or by clock and place.

    Args:
        settings: The scene file's.
        location: The network's, for scenes that give no place.

    Raises:
        ConfigError: If the place is needed and unknown.
    """
    if settings.azimuth is not None and settings.elevation is not None:
        return _angles({"azimuth": settings.azimuth, "elevation": settings.elevation})
    latitude, longitude = place_of(settings, location)
    where, when = np.radians((latitude, longitude)), moment_of(settings, location)
    sun = sun_position(when, latitude=where[0], longitude=where[1])
    if settings.place is None:
        logger.warning(
            "the sun is seen from the network's middle, %s: %s at %s, %.1f degrees high,"
            " %.0f degrees clockwise from north",
            place_in_words(latitude, longitude),
            f"{when:%Y-%m-%d %H:%M}",
            zone_name(when),
            np.degrees(sun.elevation),
            np.degrees(sun.azimuth),
            extra={"once": "the sun's place"},
        )
    turned = 0.0 if location is None else location.convergence
    return SunPosition((sun.azimuth - turned) % (2 * np.pi), sun.elevation)


def moment_of(settings: SunSettings, location: Location | None) -> dt.datetime:
    """Return the moment that date and time mean, with its zone.

    Raises:
        ConfigError: If place or zone are needed and unknown.
    """
    assert settings.date is not None and settings.time is not None
    latitude, longitude = place_of(settings, location)
    return local_time(
        settings.date,
        settings.time,
        zone=settings.zone,
        latitude=latitude,
        longitude=longitude,
    )


def place_of(settings: SunSettings, location: Location | None) -> tuple[float, float]:
    """Return the latitude and longitude from which the sun is seen [deg].

    Raises:
        ConfigError: If the scene gives none and the network has none.
    """
    return settings.place or _place(location)


def place_in_words(latitude: float, longitude: float) -> str:
    """Return a place on the Earth [deg] as people write it."""
    north, east = "N" if latitude >= 0 else "S", "E" if longitude >= 0 else "W"
    return f"{abs(latitude):.3f}° {north} {abs(longitude):.3f}° {east}"


def zone_name(when: dt.datetime) -> str:
    """Return the name of a moment's time zone."""
    return str(getattr(when.tzinfo, "key", None) or when.tzname())


def _place(location: Location | None) -> tuple[float, float]:
    """Latitude and longitude of the network's middle [deg]."""
    if location is not None and location.place is not None:
        return location.place
    reason = "the network does not lie on the Earth"
    if location is not None and location.projection != "!":
        shown = cut(location.projection)
        reason = f"the network's projection ({shown}) does not tell where on the Earth it lies"
    raise ConfigError(f"{reason}; give latitude and longitude", key="sky.sun.place")


def _angles(angles: Mapping[str, float]) -> SunPosition:
    """A sun by `azimuth` and `elevation` [deg]."""
    return SunPosition(
        float(np.radians(angles["azimuth"])) % (2 * np.pi), float(np.radians(angles["elevation"]))
    )


def read_clouds(name: str) -> tuple[StoredClouds, SunPosition]:
    """Find a baked cloud layer, and read the sun that lights it.

    Raises:
        ConfigError: If there is no such sky asset.
    """
    entry = catalog.find("skies", name)
    lit_by = _angles(entry.meta["sun"])
    return stored_clouds(entry.folder / entry.meta["map"], lit_from=lit_by.elevation), lit_by


def preset_sky(settings: SkySettings, location: Location | None) -> Sky:
    """Build a preset, perhaps with the sun moved.

    Clouds turn with the sun or moon, so that they stay lit from its side.

    Raises:
        ConfigError: If the preset or its clouds do not exist, or are wrong.
    """
    name = settings.preset or DEFAULT_PRESET
    preset = _preset(name)
    clouds, lit_by = read_clouds(preset.clouds) if preset.clouds else (None, None)
    own = lit_by if preset.sun is None else _angles(preset.sun)
    if own is None:
        raise ConfigError(f"sky preset {name!r} has neither sun nor clouds")
    # By night the moon lights the clouds; they turn with what lights them.
    sun = own if settings.sun is None else sun_of(settings.sun, location=location)
    dark = sun.elevation < DARK
    light = _angles(preset.moon) if dark and preset.moon is not None else sun
    turned = 0.0 if lit_by is None else light.azimuth - lit_by.azimuth
    sky = Sky(
        sun.direction,
        turbidity=preset.turbidity if settings.turbidity is None else settings.turbidity,
        clouds=clouds,
        rotation=float(np.radians(settings.rotation)) + turned,
        night=_colour(preset.night),
        tint=_colour(preset.tint),
        exposure=base_exposure(sun.elevation) + preset.exposure,
    )
    return _by_night(sky, preset) if dark else sky


def _preset(name: str) -> SkyPreset:
    """A preset by its name."""
    try:
        return SkyPreset(**catalog.template("sky", name))
    except TypeError as error:
        raise ConfigError(f"sky preset {name!r}: {error}") from error


def _by_night(sky: Sky, preset: SkyPreset) -> Sky:
    """Add what only shows when the sun is far down; by day nothing of it is built."""
    moon = None if preset.moon is None else _angles(preset.moon).direction
    return replace(sky, moon_direction=moon, stars=preset.stars, glow=_colour(preset.glow))


def _colour(values: Sequence[float]) -> Colour:
    """Three numbers of a preset."""
    red, green, blue = (float(value) for value in values)
    return red, green, blue


def sun_sky(settings: SkySettings, location: Location | None) -> Sky:
    """Build a clear sky by the sun alone.

    Raises:
        ConfigError: If the place is needed and unknown.
    """
    assert settings.sun is not None
    sun = sun_of(settings.sun, location=location)
    return Sky(
        sun.direction,
        turbidity=3.0 if settings.turbidity is None else settings.turbidity,
        night=NIGHT,
        stars=STARS if sun.elevation < DARK else None,
        exposure=base_exposure(sun.elevation),
    )


def file_sky(settings: SkySettings, location: Location | None) -> Sky:
    """Build a user's radiance map, whatever its unit.

    Its exposure brings the map's own light on the ground to that of noon, so
    `scale` makes the picture brighter.

    Raises:
        InputError: If the file cannot be used.
    """
    del location
    assert settings.file is not None
    image = read_radiance_map(settings.file)
    light = max(_irradiance(image), 1e-9)
    return Sky(
        None,
        image=image,
        image_scale=settings.scale,
        rotation=float(np.radians(settings.rotation)),
        exposure=base_exposure(np.pi / 2) + float(np.log2(NOON_IRRADIANCE / light)),
    )


def _irradiance(image: Image) -> float:
    """Luminance-weighted light on the ground under a map, in the map's units."""
    rows = len(image)
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    weight = np.sin(theta) * np.maximum(np.cos(theta), 0.0) * (np.pi / rows)
    luminance = image.mean(axis=1, dtype=np.float64) @ LUMINANCE
    return float((luminance * weight).sum() * 2 * np.pi)


Kind = Callable[[SkySettings, Location | None], Sky]

KINDS: Mapping[str, Kind] = MappingProxyType(
    {"file": file_sky, "preset": preset_sky, "sun": sun_sky}
)
"""Ways to make a sky, by the setting that asks for them; the first one given wins."""


def build_sky(settings: SkySettings, *, location: Location | None = None) -> Sky:
    """Build the sky of a scene file; `sky_blue` if it has none.

    Args:
        settings: The scene file's.
        location: The network's, for suns by clock without a place.

    Raises:
        ConfigError: If settings contradict each other or name what is unknown.
        InputError: If a radiance map cannot be used.
    """
    check_sky(settings)
    kind = next((name for name in KINDS if getattr(settings, name) is not None), "preset")
    return KINDS[kind](settings, location)


def check_sky(settings: SkySettings) -> None:
    """Refuse settings that contradict each other.

    Raises:
        ConfigError: Names one of them.
    """
    if settings.file is not None and settings.preset is not None:
        raise ConfigError("give either preset or file", key="sky.file")
    if settings.scale != 1.0 and settings.file is None:
        raise ConfigError("only a sky from a file has a scale", key="sky.scale")
    own = settings.sun is not None or settings.turbidity is not None
    if settings.file is not None and own:
        raise ConfigError("a sky from a file has its own sun and haze", key="sky.file")
