"""Says in figures where a scene's sun stands."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.pipeline.production import scenario_files


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
        from sumo3dviz_pt.world.sky.build import zone_name

        return None if self.when is None else zone_name(self.when)

    def __str__(self) -> str:
        height = f"{abs(self.elevation):.1f}° {'above' if self.elevation >= 0 else 'below'}"
        words = f"azimuth {self.azimuth:.1f}°, {height} the horizon"
        if self.when is None or self.place is None:
            return words
        from sumo3dviz_pt.world.sky.build import place_in_words

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
    from sumo3dviz_pt.world.sky.build import DEFAULT_PRESET, moment_of, place_of
    from sumo3dviz_pt.world.sky.sun import sun_position

    asked = job.sky.sun
    if job.sky.file is not None:
        return None
    if asked is None:
        preset = catalog.template("sky", job.sky.preset or DEFAULT_PRESET)
        angles = preset.get("sun") or catalog.find("skies", preset["clouds"]).meta["sun"]
        return SunReport(float(angles["azimuth"]), float(angles["elevation"]))
    if asked.azimuth is not None and asked.elevation is not None:
        return SunReport(asked.azimuth % 360.0, asked.elevation)
    if asked.place is None and location is None:
        location = location_of(job)
    when, place = moment_of(asked, location), place_of(asked, location)
    latitude, longitude = np.radians(place).tolist()
    sun = sun_position(when, latitude=latitude, longitude=longitude)
    return SunReport(float(np.degrees(sun.azimuth)), float(np.degrees(sun.elevation)), when, place)


def location_of(job: Job) -> Location:
    """Return where the network lies; no more of it is read than that."""
    from sumo3dviz_pt.sumo import read_location

    return read_location(scenario_files(job).network)
