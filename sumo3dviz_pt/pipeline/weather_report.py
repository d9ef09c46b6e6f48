"""Says in figures what weather a scene has, and what of weather it leaves out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.weather import WeatherSettings
from sumo3dviz_pt.model.weather import CONTRAST, Fog, Snow, Weather, WeatherCourse, Wind

_CLEAR = "dry and clear summer"


def preset_weather(name: str) -> WeatherSettings:
    """Return a preset of weather.

    Raises:
        ConfigError: If there is no such preset.
    """
    return WeatherSettings.model_validate({"preset": name, **catalog.template("weather", name)})


@dataclass(frozen=True, slots=True)
class WeatherReport:
    """The weather of a scene.

    Attributes:
        course: Over time; None for none.
    """

    course: WeatherCourse | None

    @property
    def left_out(self) -> tuple[str, ...]:
        """Kinds of weather that nothing is built, compiled or sampled for."""
        course = self.course
        kinds = {
            "fog": course is not None and any(each.fog is not None for each in course.moments),
            "rain": course is not None and course.rains,
            "wet roads": course is not None and course.is_wet,
            "snow on the ground": course is not None and course.is_snowy,
            "falling snow": course is not None and course.snows,
            "wind": course is not None and course.first.wind is not None,
        }
        return tuple(kind for kind, there in kinds.items() if not there)

    def __str__(self) -> str:
        if self.course is None:
            return _CLEAR
        told = [in_words(moment) for moment in self.course.moments]
        if not self.course.changes:
            return told[0]
        times = self.course.times
        return "; ".join(f"{time:.12g} s: {words}" for time, words in zip(times, told, strict=True))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        course = self.course
        moments = [] if course is None else list(zip(course.times, course.moments, strict=True))
        return {
            "text": str(self),
            "moments": [{"time": time, **weather_account(each)} for time, each in moments],
            "left_out": list(self.left_out),
        }


def weather_report(job: Job) -> WeatherReport:
    """Return what weather a scene has."""
    from sumo3dviz_pt.world.weather.course import weather_course

    return WeatherReport(weather_course(job.weather))


def in_words(weather: Weather) -> str:
    """Return a weather in one line."""
    words = []
    if weather.fog is not None:
        words.append(_fog_words(weather.fog))
    if weather.rain is not None:
        words.append(f"rain of {weather.rain.rate:g} mm/h")
    if weather.falls > 0.0:
        words.append(f"seen through what falls {CONTRAST / weather.falls / 1000:.1f} km")
    if weather.wetness > 0.0 or weather.puddles > 0.0:
        words.append(f"wetness {weather.wetness:.2g}, puddles {weather.puddles:.2g}")
    if weather.snow is not None:
        words += _snow_words(weather.snow)
    if weather.wind is not None:
        speed, bearing = _blowing(weather.wind)
        words.append(f"wind of {speed:.1f} m/s from {bearing:.0f}\u00b0")
    return ", ".join([*words, weather.season])


def _fog_words(fog: Fog) -> str:
    """Fog in words."""
    if fog.extinction <= 0.0:
        return "no fog"
    high = "" if math.isinf(fog.height) else f", thinner above {fog.height:.0f} m"
    return f"fog, visibility {fog.visibility:.0f} m{high}"


def _snow_words(snow: Snow) -> list[str]:
    """Snow in words."""
    words = []
    if snow.depth > 0.0:
        words.append(f"{100 * snow.depth:.1f} cm of snow, roads {snow.roads}")
    if snow.falling > 0.0:
        words.append(f"snowfall of {snow.falling:g} mm/h")
    return words


def _blowing(wind: Wind) -> tuple[float, float]:
    """Speed [m/s] and where a wind comes from, clockwise from north [deg]."""
    return wind.speed, math.degrees(math.atan2(-wind.east, -wind.north)) % 360.0


def weather_account(weather: Weather) -> dict[str, Any]:
    """Return a weather for JSON, with units in its keys; only what there is."""
    found: dict[str, Any] = {
        "extinction_per_km": round(1000.0 * weather.extinction, 4),
        "wetness": round(weather.wetness, 4),
        "puddles": round(weather.puddles, 4),
        "season": weather.season,
    }
    if weather.fog is not None and weather.fog.extinction > 0.0:
        found["fog"] = {"visibility_m": round(weather.fog.visibility, 1)}
        if not math.isinf(weather.fog.height):
            found["fog"]["height_m"] = round(weather.fog.height, 2)
    if weather.rain is not None:
        found["rain"] = {"rate_mm_per_h": round(weather.rain.rate, 3)}
    if weather.snow is not None:
        snow = weather.snow
        found["snow"] = {
            "depth_cm": round(100.0 * snow.depth, 2),
            "roads": snow.roads,
            "falling_mm_per_h": round(snow.falling, 3),
        }
    if weather.wind is not None:
        speed, bearing = _blowing(weather.wind)
        found["wind"] = {"speed_m_per_s": round(speed, 2), "from_deg": round(bearing, 1)}
    return found
