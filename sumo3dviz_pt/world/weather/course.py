"""Reads the weather of a scene file: what each moment says, and what follows where it does not."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from sumo3dviz_pt.job.weather import CLEAREST, FogSettings, WeatherMoment, WeatherSettings
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.weather import (
    CONTRAST,
    Fog,
    Rain,
    Snow,
    Weather,
    WeatherCourse,
    Wind,
)
from sumo3dviz_pt.world.memory import Memory

_Said = WeatherMoment | WeatherSettings

_NEARLY_ALL = 95.0
"""Share of roads on which fog is as dense as said; a viaduct may rise above [%]."""

_ROADS = "tracked"
"""What roads are like under snow, where nothing is said of them."""

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
    wetness = numbers.of(lambda said: said.wetness)
    rate = numbers.of(lambda said: None if said.rain is None else said.rain.rate)
    if wetness is None:
        wetness = min(1.0, (rate or 0.0) / _SOAKING)
    puddles = numbers.of(lambda said: said.puddles)
    return Weather(
        fog=_fog(numbers, base),
        rain=None if rate is None else Rain(rate),
        wetness=wetness,
        puddles=_POOLS * wetness if puddles is None else puddles,
        snow=_snow(numbers),
        wind=_wind(numbers),
        season=settings.season,
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

    def of(self, read: Callable[[_Said], float | None]) -> float | None:
        """Return a number by those who say it: moments, or else the scene file; None if nobody."""
        said = [(moment.time, read(moment)) for moment in self.settings.course]
        known = [(time, value) for time, value in said if value is not None]
        if not known:
            return read(self.settings)
        times, values = zip(*known, strict=True)
        return float(np.interp(self.time, times, values))

    def anyone(self, read: Callable[[_Said], object | None]) -> bool:
        """Return whether the scene file or a moment says something."""
        moments = self.settings.course
        return read(self.settings) is not None or any(read(each) is not None for each in moments)

    def word(self, read: Callable[[_Said], str | None]) -> str | None:
        """Return a word: that of the last moment that says it and has come."""
        found = read(self.settings)
        for moment in self.settings.course:
            word = read(moment)
            if word is not None and (found is None or moment.time <= self.time):
                found = word
        return found


def _fog(numbers: _Numbers, base: float) -> Fog | None:
    """The fog of a moment; its extinction is interpolated, not its visibility."""
    extinction = numbers.of(lambda said: None if said.fog is None else _extinction(said.fog))
    fall = numbers.of(lambda said: None if said.fog is None else _fall(said.fog))
    if extinction is None:
        return None
    return Fog(extinction, 1.0 / fall if fall else math.inf, base)


def _extinction(fog: FogSettings) -> float:
    """Extinction by visibility [1/m]; none where one sees as far as can be asked for."""
    return 0.0 if fog.visibility >= CLEAREST else CONTRAST / fog.visibility


def _fall(fog: FogSettings) -> float | None:
    """How fast density falls with height [1/m]; None where that is not said."""
    return None if fog.height is None else 1.0 / fog.height


def _snow(numbers: _Numbers) -> Snow | None:
    """The snow of a moment."""
    if not numbers.anyone(lambda said: said.snow):
        return None
    depth = numbers.of(lambda said: None if said.snow is None else said.snow.depth)
    falling = numbers.of(lambda said: None if said.snow is None else said.snow.falling)
    roads = numbers.word(lambda said: None if said.snow is None else said.snow.roads)
    return Snow(depth or 0.0, roads or _ROADS, falling or 0.0)


def _wind(numbers: _Numbers) -> Wind | None:
    """The wind of a moment; its velocity is interpolated, not its speed and where it comes from."""
    whole = numbers.settings.wind
    usual = _WEST if whole is None or whole.bearing is None else whole.bearing

    def blowing(said: _Said) -> Wind | None:
        if said.wind is None:
            return None
        bearing = usual if said.wind.bearing is None else said.wind.bearing
        return Wind.coming(said.wind.speed, math.radians(bearing))

    def part(of: str) -> float | None:
        return numbers.of(lambda said: getattr(blowing(said), of, None))

    east, north = part("east"), part("north")
    return None if east is None or north is None else Wind(east, north)
