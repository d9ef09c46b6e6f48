"""The sky in weather: the clouds that rain and snow fall from, and the exposure for less light."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.daylight import cover, left
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.world.sky.build import read_clouds

CLOUDS = "sky_overcast"
"""Clouds that rain and snow fall from, an asset's name."""

_MADE_UP = 0.8
"""Share of the stops that weather takes which the exposure makes up for; dull days look dull."""

_PALE = 0.45
"""How bright dense fog is shown by day, against white."""

_CLOSE = 100.0
"""Distance by which fog is judged as dense [m]."""

_ON_SNOW = 0.6
"""Stops that the exposure loses where snow lies by day; the rule of thumb for snow all over, f/22
where it would be f/16, is one."""

_WHITE_FROM = 0.025
"""Depth from which snow hides what it lies on [m]."""

_LAMPLIT, _SUNLIT = -12.0, 0.0
"""Elevations of the sun between which lamps take over, whatever the weather [deg]; the first is
the end of nautical twilight."""


def in_weather(sky: Sky, course: WeatherCourse | None) -> Sky:
    """Return a sky with the clouds and the exposure of its weather; unchanged without.

    Exposure is one for all times, that of the course's moments on average.

    Args:
        sky: Of the scene file.
        course: The weather over time, or None.

    Raises:
        ConfigError: If the clouds' asset is missing.
    """
    if course is None:
        return sky
    stops = [_stops(sky, moment) for moment in course.moments]
    sky = replace(sky, exposure=sky.exposure + float(np.mean(stops)))
    if sky.image is not None or not any(cover(moment) > 0.0 for moment in course.moments):
        return sky
    clouds = read_clouds(CLOUDS)[0]
    # Through the least gap a bright evening would sparkle.
    return replace(sky, overcast=replace(clouds, cover=np.ones_like(clouds.cover)))


def _stops(sky: Sky, weather: Weather) -> float:
    """Stops that the exposure gains in a weather.

    They make up for most of the light that is missing, and take some where snow gives it back.
    Fog is bright where everything else is pale, and photographs show it as light grey.
    """
    sine = 0.0 if sky.sun_direction is None else float(sky.sun_direction[2])
    share = left(weather, sine)
    if cover(weather) > 0.0 and sky.clouds is not None:
        share /= _under_own_clouds(sky)
    share = min(share, 1.0)
    dense = 0.0 if weather.fog is None else -math.expm1(-weather.fog.extinction * _CLOSE)
    stops = (1.0 - dense) * _MADE_UP * -math.log2(share) + dense * math.log2(_PALE / share)
    day = _by_day(sine)
    return day * (stops - _ON_SNOW * _whiteness(weather))


def _whiteness(weather: Weather) -> float:
    """How far snow makes the ground white, in [0, 1]."""
    if weather.snow is None:
        return 0.0
    return min(weather.snow.depth / _WHITE_FROM, 1.0)


def _by_day(sine: float) -> float:
    """How far daylight counts beside lamps, in [0, 1]."""
    elevation = math.degrees(math.asin(sine))
    return min(1.0, max(0.0, (elevation - _LAMPLIT) / (_SUNLIT - _LAMPLIT)))


def _under_own_clouds(sky: Sky) -> float:
    """Share of a clear sky's light under the sky's own clouds (Kasten and Czeplak 1980)."""
    assert sky.clouds is not None
    covered = float(sky.clouds.cover.mean())
    return 1.0 - 0.75 * math.pow(min(covered, 1.0), 3.4)
