"""Finds everyone who comes near a camera, in its picture or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.reading import motion_of, read_files

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Production

_SLACK = 30.0
"""Distance between where somebody is and the line between two samples, at most [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """Who comes near a camera.

    Attributes:
        trajectories: The smoothed motion of each.
        types: Their vTypes.
        network: Where they are.
    """

    trajectories: tuple[Trajectory, ...]
    types: tuple[VehicleType, ...]
    network: Network


def nearby(production: Production, eyes: Floats, *, radius: float) -> Nearby:
    """Return everyone who may come as near to a shot's camera as a radius.

    Args:
        production: The shot.
        eyes: Where the camera is in each frame, (n, 3) [m].
        radius: On the plan [m].
    """
    times = production.times
    _, scenario = read_files(production.job, begin=float(times[0]), end=float(times[-1]))
    near = np.zeros(len(scenario.traffic.traces), dtype=np.bool_)
    for k, trace in enumerate(scenario.traffic.traces):
        there = [np.interp(times, trace.times, trace.positions[:, axis]) for axis in range(2)]
        away = np.hypot(there[0] - eyes[:, 0], there[1] - eyes[:, 1])
        near[k] = away.min() <= radius + _SLACK
    trajectories = motion_of(production.job, scenario).smooth(near)
    types = tuple(
        scenario.vehicle_types.get(each.type_id, UNKNOWN_TYPES[each.kind]) for each in trajectories
    )
    return Nearby(trajectories, types, scenario.network)
