"""Read everything that a scenario's files say about a time window."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scenario import Scenario, ScenarioFiles
from sumo3dviz_pt.model.traffic import Trace, TrafficLog, VehicleType
from sumo3dviz_pt.sumo.additional import read_additional
from sumo3dviz_pt.sumo.classes import DEFAULT_TYPES, TYPE_OF_KIND
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.heights import with_heights
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.sumo.stops import read_stops
from sumo3dviz_pt.sumo.types import default_vehicle_type, read_vehicle_types

logger = logging.getLogger(__name__)

_MARGIN = 1000.0
"""How far off the network something may still be part of the scenario [m]."""


def read_scenario(
    files: ScenarioFiles,
    *,
    begin: float | None = None,
    end: float | None = None,
    margin: float = 0.0,
    allow_truncated: bool = False,
) -> Scenario:
    """Read a scenario.

    Every trace's type is in `vehicle_types`: types that no file defines get SUMO's
    defaults, and traces without a type get SUMO's default type of their kind. A log
    without z in a network that has hills is put onto the road.

    Args:
        files: As `find_scenario` gives them.
        begin: First time to keep [s].
        end: Last time to keep [s].
        margin: What to keep beyond both, for smoothing [s].
        allow_truncated: Use the complete steps of a log that breaks off.

    Returns:
        Everything in SI units and net coordinates.

    Raises:
        InputError: If a file is damaged or the log does not belong to the network.
    """
    network = read_network(files.network)
    log = read_trajectories(
        files.trajectories,
        begin=begin,
        end=end,
        margin=margin,
        allow_truncated=allow_truncated,
    )
    _check_place(log, network, files)
    traces = with_heights(tuple(_typed(trace) for trace in log.traces), network)
    types = read_vehicle_types(files.vehicle_types)
    pois, polygons = read_additional(files.additional)
    return Scenario(
        network=network,
        traffic=replace(log, traces=traces),
        vehicle_types=types | _defaults(traces, types),
        signals=read_signals(files.signals),
        pois=pois,
        polygons=polygons,
        stops=read_stops(files.additional),
    )


def _typed(trace: Trace) -> Trace:
    return trace if trace.type_id else replace(trace, type_id=TYPE_OF_KIND[trace.kind])


def _defaults(traces: Iterable[Trace], known: dict[str, VehicleType]) -> dict[str, VehicleType]:
    """SUMO's defaults for types that no file defines, with one warning for all."""
    kinds = {trace.type_id: trace.kind for trace in traces if trace.type_id not in known}
    undefined = sorted(set(kinds) - set(DEFAULT_TYPES))
    if undefined:
        logger.warning(
            "no file defines the vehicle types %s; SUMO's default sizes are used",
            ", ".join(undefined),
        )
    return {type_id: default_vehicle_type(type_id, kind) for type_id, kind in kinds.items()}


def _check_place(log: TrafficLog, network: Network, files: ScenarioFiles) -> None:
    """Refuse a log that does not lie on the network, or whose positions are degrees.

    SUMO shifts vehicles only for `--fcd-output.utm`, so each kind is judged by itself.
    """
    corners = np.concatenate([lane.shape[:, :2] for lane in network.lanes.values()])
    low, high = corners.min(axis=0) - _MARGIN, corners.max(axis=0) + _MARGIN
    for kind in TYPE_OF_KIND:
        traces = [trace for trace in log.traces if trace.kind == kind]
        near = any(
            ((t.positions[:, :2] >= low) & (t.positions[:, :2] <= high)).all(axis=1).any()
            for t in traces
        )
        if traces and (not near or _in_degrees(traces)):
            x, y = traces[0].positions[0, :2]
            raise InputError(
                f"the log does not lie on the network ({files.network.name}): the first {kind} "
                f"is at ({x:g}, {y:g}); use the log of this network, written without "
                "--fcd-output.geo and --fcd-output.utm",
                file=files.trajectories[0],
            )


def _in_degrees(traces: list[Trace]) -> bool:
    """Whether road users cover far less ground than their speeds say.

    A degree is about 1e5 m, so in longitudes and latitudes a way shrinks that much.
    """
    way = ground = 0.0
    for trace in traces:
        way += float(np.nansum(trace.speeds[1:] * np.diff(trace.times)))
        ground += float(np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1).sum())
    return way > 50.0 and ground < 1e-3 * way
