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
    sky = replace(sky, exposure=sky.exposure + _MADE_UP * float(np.mean(stops)))
    if sky.image is not None or not any(cover(moment) > 0.0 for moment in course.moments):
        return sky
    return replace(sky, overcast=read_clouds(CLOUDS)[0])


def _stops(sky: Sky, weather: Weather) -> float:
    """Stops of light that a weather takes from a sky."""
    sine = 0.0 if sky.sun_direction is None else float(sky.sun_direction[2])
    share = left(weather, sine)
    if cover(weather) > 0.0 and sky.clouds is not None:
        share /= _under_own_clouds(sky)
    return -math.log2(min(share, 1.0))


def _under_own_clouds(sky: Sky) -> float:
    """Share of a clear sky's light under the sky's own clouds (Kasten and Czeplak 1980)."""
    assert sky.clouds is not None
    covered = float(sky.clouds.cover.mean())
    return 1.0 - 0.75 * math.pow(min(covered, 1.0), 3.4)
