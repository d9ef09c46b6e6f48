"""What nights and weathers cost beside a dry day, by what a bench measured.

The figures lie in `weathers.json`; they are those of the manual's page on weather.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from sumo3dviz_pt.job.settings import Job, OutputSettings, Quality
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.pipeline.progress.costs import Cost, cost_of

MEASURED = Path(__file__).with_name("weathers.json")
"""What the bench measured: rows of a picture's size, the hour, and CPU-seconds by weather."""


def film_cost(
    quality: Quality, output: OutputSettings, *, triangles: int, frames: int, factor: float
) -> Cost:
    """Forecast what a film costs, by day or night and in its weather.

    Args:
        quality: Samples and denoiser.
        output: Size, and how frames are stored.
        triangles: That the shot holds.
        frames: How many.
        factor: From `conditions_factor`.
    """
    start, dry = (
        cost_of(quality, size=output.size, triangles=triangles, frames=count, half=output.half)
        for count in (0, frames)
    )
    more = factor - 1.0
    return replace(
        dry,
        cpu_seconds_per_frame=factor * dry.cpu_seconds_per_frame,
        cpu_hours=dry.cpu_hours + more * (dry.cpu_hours - start.cpu_hours),
        wall_seconds=dry.wall_seconds + more * (dry.wall_seconds - start.wall_seconds),
    )


def conditions_factor(size: tuple[int, int], *, dark: bool, weather: WeatherCourse | None) -> float:
    """Return how many times as much a frame costs as a dry one by day.

    Args:
        size: Width, height [px]; what was measured at the size nearest to it counts.
        dark: Whether lamps are lit.
        weather: Over time; None is dry.
    """
    pixels = size[0] * size[1]
    usual = _row("day", pixels)
    return float(_row("night" if dark else "day", pixels)[_kind(weather)] / usual["dry"])


def forecast_factor(job: Job, location: Location) -> float:
    """Return the same for a scene of which nothing was built.

    Args:
        job: The scene file.
        location: Of its network, for the sun.
    """
    from sumo3dviz_pt.world.sky.build import build_sky
    from sumo3dviz_pt.world.sky.darkness import is_dark
    from sumo3dviz_pt.world.weather.course import weather_course

    dark = is_dark(build_sky(job.sky, location=location), job.lights)
    return conditions_factor(job.output.size, dark=dark, weather=weather_course(job.weather))


def _kind(weather: WeatherCourse | None) -> str:
    """The weather of the bench that costs as much."""
    if weather is None:
        return "dry"
    if weather.rains:
        return "rain"
    if weather.snows:
        return "snowfall"
    if weather.is_snowy:
        return "snow"
    return "fog" if weather.is_foggy else "dry"


def _row(hour: str, pixels: int) -> dict[str, Any]:
    """What was measured at an hour, at the size nearest to a number of pixels."""
    rows = [row for row in _rows() if row["hour"] == hour]
    return min(rows, key=lambda row: abs(row["size"][0] * row["size"][1] - pixels))


@cache
def _rows() -> list[dict[str, Any]]:
    """All that was measured."""
    found: list[dict[str, Any]] = json.loads(MEASURED.read_text(encoding="utf-8"))["rows"]
    return found
