"""The weather of a scene file, moment by moment, and the sky in it.

What a moment does not say follows from what is said. The sky gets the clouds that rain and snow
fall from, and the exposure for less light.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial
from typing import Any

import numpy as np

from sumo3dviz_pt.job.surroundings import CLEAREST, FogSettings, WeatherMoment, WeatherSettings
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.model.weather import (
    CONTRAST,
    FALLING_KINDS,
    Fog,
    Weather,
    WeatherCourse,
    WeatherKind,
    Wind,
    cover,
    left,
)
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.sky import read_clouds

_Stated = WeatherMoment | WeatherSettings

_NEARLY_ALL = 95.0
"""Share of roads on which fog is as dense as said; a viaduct may rise above [%]."""

_WEST = 270.0
"""Where wind comes from, where that is not said [deg]."""

_POOLS = 0.5
"""Puddles for each wetness, where nothing is said of them."""


def weather_course(settings: WeatherSettings | None, *, base: float = 0.0) -> WeatherCourse | None:
    """Return the weather over time; None for a scene without.

    A key that no moment of the course gives keeps its value; one that some give is interpolated
    between them, and keeps the first one's value before and the last one's after.

    Args:
        settings: The scene file's; its preset is laid under it already.
        base: Height above which fog gets thinner [m].
    """
    if settings is None or not says_anything(settings):
        return None
    times = tuple(moment.time for moment in settings.course) or (0.0,)
    moments = tuple(_weather_at(settings, time, base) for time in times)
    return WeatherCourse(times, moments)


def weather_over(
    settings: WeatherSettings | None, network: Network, memory: Memory
) -> WeatherCourse | None:
    """Return the weather of a network over time; fog gets thinner above its highest roads.

    Args:
        settings: The scene file's.
        network: The roads.
        memory: What was built of the same world before.
    """
    if settings is None:
        return None
    base = memory.of(("highest road",), partial(highest_road, network))
    return weather_course(settings, base=base)


def highest_road(network: Network) -> float:
    """Return the height under which nearly all of a network's roads lie [m]."""
    heights = [lane.shape[:, 2].max() for lane in network.lanes.values()]
    return float(np.percentile(heights, _NEARLY_ALL)) if heights else 0.0


def says_anything(settings: WeatherSettings) -> bool:
    """Return whether there is any weather but a summer's dry and clear air."""
    plain = WeatherSettings(preset=settings.preset)
    return settings != plain


def _weather_at(settings: WeatherSettings, time: float, base: float) -> Weather:
    """The weather of a moment that the course names."""
    numbers = _Numbers(settings, time)
    wetness = numbers.of(lambda state: state.wetness)
    falling: dict[str, Any] = {name: _part(numbers, name) for name in FALLING_KINDS}
    if wetness is None:
        wetness = min(1.0, (0.0 if falling["rain"] is None else falling["rain"].rate) / _SOAKING)
    puddles = numbers.of(lambda state: state.puddles)
    return Weather(
        fog=_fog(numbers, base),
        wetness=wetness,
        puddles=_POOLS * wetness if puddles is None else puddles,
        wind=_wind(numbers),
        season=settings.season,
        **falling,
    )


_SOAKING = 0.2
"""Rain that keeps everything wet; in less, surfaces dry between the drops [mm/h]."""


class _Numbers:
    """Answers what a number of the weather is at a time.

    Attributes:
        settings: The scene file's.
        time: [s].
    """

    def __init__(self, settings: WeatherSettings, time: float) -> None:
        self.settings, self.time = settings, time

    def of(self, read: Callable[[_Stated], float | None]) -> float | None:
        """Return a number by those who say it: moments, or else the scene file; None if nobody."""
        moments = [(moment.time, read(moment)) for moment in self.settings.course]
        known = [(time, value) for time, value in moments if value is not None]
        if not known:
            return read(self.settings)
        times, values = zip(*known, strict=True)
        return float(np.interp(self.time, times, values))

    def anyone(self, read: Callable[[_Stated], object | None]) -> bool:
        """Return whether the scene file or a moment says something."""
        moments = self.settings.course
        return read(self.settings) is not None or any(read(each) is not None for each in moments)

    def word(self, read: Callable[[_Stated], str | None]) -> str | None:
        """Return a word: that of the last moment that says it and has come."""
        value = read(self.settings)
        for moment in self.settings.course:
            word = read(moment)
            if word is not None and (value is None or moment.time <= self.time):
                value = word
        return value


def _fog(numbers: _Numbers, base: float) -> Fog | None:
    """The fog of a moment; its extinction is interpolated, not its visibility."""
    extinction = numbers.of(lambda state: None if state.fog is None else _extinction(state.fog))
    fall = numbers.of(lambda state: None if state.fog is None else _fall(state.fog))
    if extinction is None:
        return None
    return Fog(extinction, 1.0 / fall if fall else math.inf, base)


def _extinction(fog: FogSettings) -> float:
    """Extinction by visibility [1/m]; none where one sees as far as can be asked for."""
    return 0.0 if fog.visibility >= CLEAREST else CONTRAST / fog.visibility


def _fall(fog: FogSettings) -> float | None:
    """How fast density falls with height [1/m]; None where that is not said."""
    return None if fog.height is None else 1.0 / fog.height


def _part(numbers: _Numbers, name: str) -> WeatherKind | None:
    """A kind of weather whose numbers and words have the same names in the scene file."""

    def reader(field: str) -> Callable[[_Stated], Any]:
        return lambda state: getattr(getattr(state, name), field, None)

    if not numbers.anyone(lambda state: getattr(state, name)):
        return None
    kind = FALLING_KINDS[name]
    values: dict[str, Any] = {}
    for each in fields(kind):
        ask = numbers.word if isinstance(each.default, str) else numbers.of
        value = ask(reader(each.name))
        if value is not None:
            values[each.name] = value
    return kind(**values)


def _wind(numbers: _Numbers) -> Wind | None:
    """The wind of a moment; its velocity is interpolated, not its speed and where it comes from."""
    whole = numbers.settings.wind
    usual = _WEST if whole is None or whole.bearing is None else whole.bearing

    def blowing(state: _Stated) -> Wind | None:
        if state.wind is None:
            return None
        bearing = usual if state.wind.bearing is None else state.wind.bearing
        return Wind.coming(state.wind.speed, math.radians(bearing))

    def part(of: str) -> float | None:
        return numbers.of(lambda state: getattr(blowing(state), of, None))

    east, north = part("east"), part("north")
    return None if east is None or north is None else Wind(east, north)


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
    clouds = read_clouds(CLOUDS)[0].layer
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
