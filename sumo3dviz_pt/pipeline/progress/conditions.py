"""What nights and weathers cost beside a dry day, by what a bench measured.

The figures lie in `weathers.json`; they are those of the manual's page on weather.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from sumo3dviz_pt.job.settings import Job, Lights, OutputSettings, Quality, SkySettings
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.pipeline.progress.costs import Cost, Stages, cost_of, stages_of
from sumo3dviz_pt.pipeline.sun_report import location_of

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


def film_stages(job: Job, quality: Quality, *, frames: int) -> Stages:
    """Forecast what the stages of a film cost, by day or night and in its weather.

    Args:
        job: The scene file, with the command's choices.
        quality: Samples and denoiser.
        frames: Of the film.
    """
    dry, factor = stages_of(quality, size=job.output.size, frames=frames), forecast_factor(job)
    return Stages(dry.start, factor * dry.trace, factor * dry.develop, factor * dry.encode)


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


def forecast_factor(job: Job) -> float:
    """Return the same for a scene of which nothing was built."""
    from sumo3dviz_pt.world.weather.course import weather_course

    dark = _is_dark(job.sky, job.lights, location_of(job))
    return conditions_factor(job.output.size, dark=dark, weather=weather_course(job.weather))


@lru_cache(maxsize=64)
def _is_dark(sky: SkySettings, lights: Lights, location: Location) -> bool:
    """Whether lamps are lit; many films of a study share that."""
    from sumo3dviz_pt.world.sky.build import build_sky
    from sumo3dviz_pt.world.sky.darkness import is_dark

    return is_dark(build_sky(sky, location=location), lights)


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
