"""What films offer to people who stand and wait: arrivals and gaps, known without any pixel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.job.sessions import ReportSettings
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.studies.measured.observer import (
    HORIZON,
    STEP,
    Arrival,
    Observer,
    arrival_rows,
    arrivals,
    camera_observer,
    named_observer,
    sight_of,
)
from sumo3dviz_pt.studies.measured.traffic import Row, Simulated, Traffic, traffic_at

Camera = Mapping[str, Any]
"""`position`, `forward` and `fov` [deg] of a frame's camera, as an account has them."""


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """An observer, and the vehicles that come to it.

    Attributes:
        observer: At the film's times.
        came: Passages over its way across, in order, also before the film and after it.
        rows: Of those that come in the film or soon after, for tables.
        shown: Of those, by number: in which frames they lie within the picture's width, (t,);
            of the film's camera only.
    """

    observer: Observer
    came: tuple[Arrival, ...]
    rows: tuple[Row, ...]
    shown: Mapping[int, Bools]


def watched_by(
    simulation: Simulated,
    cameras: Sequence[Camera],
    settings: ReportSettings,
    *,
    near: Floats,
    speed: float,
) -> tuple[Traffic, list[Watched]]:
    """Return everyone before, in and after a film, and its observers; its camera is the first.

    Args:
        simulation: The film's.
        cameras: Of each frame.
        settings: Name further observers.
        near: Where observers are, (k, 2) [m].
        speed: SUMO's seconds per second of film.
    """
    scenario, traffic = simulation.scenario, simulation.traffic
    begin, end = float(traffic.times[0]), float(traffic.times[-1])
    grid = np.arange(begin - HORIZON, end + HORIZON + STEP, STEP)
    around = traffic_at(simulation.motion, scenario, grid, near=near)
    network = scenario.network
    named = (named_observer(*each, traffic, network) for each in settings.observers.items())
    watched: list[Watched] = []
    for observer in (camera_observer(cameras, traffic, network), *filter(None, named)):
        came = arrivals(observer, around)
        rows = list(arrival_rows(observer, came, traffic.keys, begin=begin, speed=speed))
        shown: Mapping[int, Bools] = {}
        if not watched:
            coming = [each for each in came if each.time >= begin]
            shown = _in_picture(observer, traffic, cameras, {each.k for each in coming})
            for row, each in zip(rows, coming, strict=True):
                before = shown[each.k] & (traffic.times <= each.time)
                step = (end - begin) / max(len(traffic.times) - 1, 1) / speed
                longest = float(row["arrives_in_film"])
                row["in_picture"] = round(min(float(before.sum()) * step, longest), 3)
        watched.append(Watched(observer, tuple(came), tuple(rows), shown))
    return around, watched


def _in_picture(
    observer: Observer, traffic: Traffic, cameras: Sequence[Camera], which: set[int]
) -> dict[int, Bools]:
    """Return in which frames a vehicle's middle lies within the picture's width, (t,), by number.

    What stands before it, and how far away it is, does not count.
    """
    half = np.array([float(camera["fov"]) for camera in cameras]) / 2.0
    framed = {}
    for k in which:
        bearing = np.degrees(sight_of(observer, traffic, k).bearing)
        framed[k] = np.nan_to_num(np.abs(bearing), nan=np.inf) <= half
    return framed
