"""What a film needs of a machine, and what nights and weathers cost beside a dry day.

Memory and disk are compared with what there is. Where a scene's sun stands is told in figures. What
nights and weathers cost was measured by a bench; the figures lie in `weathers.json`, and are those
of the manual's page on weather.
"""

from __future__ import annotations

import datetime as dt
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.installation.doctor import physical_memory
from sumo3dviz_pt.job.settings import Job, OutputSettings, Quality
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.weather import WeatherCourse
from sumo3dviz_pt.pipeline.costs import (
    PROCESSOR,
    TYPICAL_TRIANGLES,
    Cost,
    Rates,
    Stages,
    cost_of,
    memory_forecast,
    space_in_words,
    stages_of,
)
from sumo3dviz_pt.pipeline.production import Request, scenario_files
from sumo3dviz_pt.pipeline.worlds import lamps_are_lit

_HOPELESS = 1.5
"""A film that needs so many times the memory of this machine is not begun: forecasts may be off."""


def lacking(cost: Cost, path: Path) -> Iterator[str]:
    """Yield a sentence for each of memory and disk of which there is too little.

    Args:
        cost: Of the film.
        path: Where it will lie.
    """
    memory, disk = physical_memory() / 1e6, _free_disk(path)
    if memory and cost.memory_mb > memory:
        yield (
            f"needs about {space_in_words(cost.memory_mb)} of memory, and this machine has"
            f" {space_in_words(memory)}: ask for a smaller --size"
        )
    stored = cost.frames_mb + cost.film_mb
    if disk < stored:
        yield (
            f"needs about {space_in_words(stored)} of disk, and {space_in_words(disk)} are free"
            f" where {path.name} will lie: take another folder, or --discard-frames"
        )


def check_memory(job: Job, request: Request) -> None:
    """Refuse pictures that need far more memory than there is, before any work is done.

    Args:
        job: The scene file.
        request: The command's choices.

    Raises:
        ConfigError: If they do.
    """
    width, height = request.applied(job).output.size
    needed, memory = memory_forecast(width * height / 1e6, TYPICAL_TRIANGLES), physical_memory()
    if memory and needed > _HOPELESS * memory / 1e6:
        raise ConfigError(
            f"pictures of {width}x{height} need about {space_in_words(needed)} of memory, and this"
            f" machine has {space_in_words(memory / 1e6)}; ask for a smaller --size",
            key="output.size",
        )


def _free_disk(path: Path) -> float:
    """Return what is free where a file will lie [MB]."""
    whole = path.absolute()
    there = next(place for place in (whole, *whole.parents) if place.exists())
    return shutil.disk_usage(there).free / 1e6


@dataclass(frozen=True, slots=True)
class SunReport:
    """A sun in the sky.

    Attributes:
        azimuth: Clockwise from north, true north where the sun was asked for by clock [deg].
        elevation: Above the horizon, as seen through air [deg].
        when: The moment, with its zone; None where the sun was asked for by angles.
        place: Latitude and longitude from which it is seen [deg]; None as before.
    """

    azimuth: float
    elevation: float
    when: dt.datetime | None = None
    place: tuple[float, float] | None = None

    @property
    def zone(self) -> str | None:
        """Name of the moment's time zone."""
        from sumo3dviz_pt.world.sky import zone_name

        return None if self.when is None else zone_name(self.when)

    def __str__(self) -> str:
        height = f"{abs(self.elevation):.1f}° {'above' if self.elevation >= 0 else 'below'}"
        words = f"azimuth {self.azimuth:.1f}°, {height} the horizon"
        if self.when is None or self.place is None:
            return words
        from sumo3dviz_pt.world.sky import place_in_words

        utc = self.when.astimezone(dt.UTC)
        moment = f"{self.when:%Y-%m-%d %H:%M} {self.zone} ({utc:%H:%M} UTC)"
        return f"{words}: {moment} at {place_in_words(*self.place)}"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "azimuth": round(self.azimuth, 3),
            "elevation": round(self.elevation, 3),
            "time": None if self.when is None else self.when.isoformat(),
            "zone": self.zone,
            "place": None if self.place is None else [round(angle, 5) for angle in self.place],
            "text": str(self),
        }


def sun_report(job: Job, *, location: Location | None = None) -> SunReport | None:
    """Return where a scene's sun stands; None for a user's radiance map, which has its own.

    Args:
        job: The scene file.
        location: The network's; None reads it where it is needed.

    Raises:
        ConfigError: If place or zone are needed and unknown.
        InputError: If the network is missing or damaged.
    """
    from sumo3dviz_pt.world.sky import DEFAULT_PRESET, moment_of, place_of, sun_position

    settings = job.sky.sun
    if job.sky.file is not None:
        return None
    if settings is None:
        preset = catalog.template("sky", job.sky.preset or DEFAULT_PRESET)
        angles = preset.get("sun") or catalog.find("skies", preset["clouds"]).meta["sun"]
        return SunReport(float(angles["azimuth"]), float(angles["elevation"]))
    if settings.azimuth is not None and settings.elevation is not None:
        return SunReport(settings.azimuth % 360.0, settings.elevation)
    if settings.place is None and location is None:
        location = location_of(job)
    when, place = moment_of(settings, location), place_of(settings, location)
    latitude, longitude = np.radians(place).tolist()
    sun = sun_position(when, latitude=latitude, longitude=longitude)
    return SunReport(float(np.degrees(sun.azimuth)), float(np.degrees(sun.elevation)), when, place)


def location_of(job: Job) -> Location:
    """Return where the network lies; no more of it is read than that."""
    from sumo3dviz_pt.sumo import read_location

    return read_location(scenario_files(job).network)


MEASURED = Path(__file__).with_name("weathers.json")
"""What the bench measured: rows of a picture's size, the hour, and CPU-seconds by weather."""


def film_cost(
    quality: Quality,
    output: OutputSettings,
    *,
    triangles: int,
    frames: int,
    factor: float,
    rates: Rates = PROCESSOR,
) -> Cost:
    """Forecast what a film costs, by day or night and in its weather.

    Args:
        quality: Samples and denoiser.
        output: Size, and how frames are stored.
        triangles: That the shot holds.
        frames: How many.
        factor: From `conditions_factor`.
        rates: Of what traces.
    """
    start, dry = (
        cost_of(quality, size=output.size, triangles=triangles, frames=count, rates=rates)
        for count in (0, frames)
    )
    more = factor - 1.0
    return replace(
        dry,
        cpu_seconds_per_frame=factor * dry.cpu_seconds_per_frame,
        cpu_hours=dry.cpu_hours + more * (dry.cpu_hours - start.cpu_hours),
        wall_seconds=dry.wall_seconds + more * (dry.wall_seconds - start.wall_seconds),
        frames_mb=dry.frames_mb * (1 if output.half else 2),
    )


def film_stages(job: Job, quality: Quality, *, frames: int, rates: Rates = PROCESSOR) -> Stages:
    """Forecast what the stages of a film cost, by day or night and in its weather.

    Args:
        job: The scene file, with the command's choices.
        quality: Samples and denoiser.
        frames: Of the film.
        rates: Of what traces.
    """
    dry = stages_of(quality, size=job.output.size, frames=frames, rates=rates)
    factor = forecast_factor(job)
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
    from sumo3dviz_pt.world.weather import weather_course

    dark = lamps_are_lit(job.sky, job.lights, location_of(job))
    return conditions_factor(job.output.size, dark=dark, weather=weather_course(job.weather))


def _kind(weather: WeatherCourse | None) -> str:
    """The weather of the bench that costs as much."""
    if weather is None:
        return "dry"
    if weather.has_falling():
        return "snowfall" if weather.snows and not weather.rains else "rain"
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
    rows: list[dict[str, Any]] = json.loads(MEASURED.read_text(encoding="utf-8"))["rows"]
    return rows
