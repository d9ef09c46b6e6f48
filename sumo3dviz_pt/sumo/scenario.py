"""Read everything that a scenario's files say about a time window."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scenario import Scenario, ScenarioFiles
from sumo3dviz_pt.model.traffic import SignalPhases, Trace, TrafficLog, VehicleType
from sumo3dviz_pt.sumo.additional import read_additional
from sumo3dviz_pt.sumo.belonging import LogRows, check_belonging, first_rows, misfit
from sumo3dviz_pt.sumo.classes import DEFAULT_TYPES, TYPE_OF_KIND
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.heights import with_heights
from sumo3dviz_pt.sumo.network import read_network
from sumo3dviz_pt.sumo.parking import read_parking
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.sumo.stops import read_stops
from sumo3dviz_pt.sumo.types import default_vehicle_type, read_vehicle_types

logger = logging.getLogger(__name__)

_TRACES = 700
"""Number of road users of each kind by which a log is compared with its network."""


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
        begin: First time to keep [s]; None keeps all from the start.
        end: Last time to keep [s]; None keeps all to the end.
        margin: Time to keep before and after these, for smoothing [s].
        allow_truncated: Whether to use the complete steps of a log that breaks off.

    Returns:
        Everything in SI units and net coordinates.

    Raises:
        InputError: If a file is damaged or the log does not belong to the network.
    """
    network = read_network(files.network)
    for path in files.trajectories:
        _check_rows(first_rows(path), network, files, path)
    log = read_trajectories(
        files.trajectories,
        begin=begin,
        end=end,
        margin=margin,
        allow_truncated=allow_truncated,
    )
    _check_log(log, network, files)
    traces = with_heights(tuple(_typed(trace) for trace in log.traces), network)
    types = read_vehicle_types(files.vehicle_types)
    pois, polygons = read_additional(files.additional)
    signals = read_signals(files.signals)
    _compare_lights(signals, network, files)
    return Scenario(
        network=network,
        traffic=replace(log, traces=traces),
        vehicle_types=types | _defaults(traces, types),
        signals=signals,
        pois=pois,
        polygons=polygons,
        stops=read_stops(files.additional),
        parking=read_parking(files.additional, network),
    )


def _typed(trace: Trace) -> Trace:
    return trace if trace.type_id else replace(trace, type_id=TYPE_OF_KIND[trace.kind])


def _defaults(traces: Iterable[Trace], known: dict[str, VehicleType]) -> dict[str, VehicleType]:
    """Return SUMO's defaults for types that no file defines, with one warning for all."""
    kinds = {trace.type_id: trace.kind for trace in traces if trace.type_id not in known}
    undefined = sorted(set(kinds) - set(DEFAULT_TYPES))
    if undefined:
        logger.warning(
            "no file defines the vehicle types %s: their vehicles are drawn as cars of SUMO's"
            " default size; name the files that define them in scenario.vehicle_types",
            ", ".join(undefined),
        )
    return {type_id: default_vehicle_type(type_id, kind) for type_id, kind in kinds.items()}


def _compare_lights(
    signals: Mapping[str, SignalPhases], network: Network, files: ScenarioFiles
) -> None:
    """Warn of a signal log of another network, with which all traffic lights stay dark."""
    known = {connection.tls for connection in network.connections}
    if signals and not known & set(signals):
        logger.warning(
            "%s: none of its traffic lights is in the network (it has %s); all stay dark",
            files.signals[0],
            ", ".join(sorted(signals)[:3]),
        )


def _check_rows(rows: LogRows, network: Network, files: ScenarioFiles, path: Path) -> None:
    """Refuse a log of another network by some of its rows.

    Args:
        rows: Some rows of the log.
        network: The network.
        files: The files of the scenario, for messages.
        path: File of the log, for messages.
    """
    check_belonging(rows, network, network_file=files.network, log=path)


def _check_log(log: TrafficLog, network: Network, files: ScenarioFiles) -> None:
    """Refuse a log of another network, or one whose positions are degrees."""
    path = files.trajectories[0]
    _check_rows(_some_rows(log), network, files, path)
    for kind in TYPE_OF_KIND:
        traces = [trace for trace in log.traces if trace.kind == kind]
        if _in_degrees(traces):
            x, y = traces[0].positions[0, :2]
            reason = f"the first {kind} is at ({x:g}, {y:g})"
            raise misfit(reason, network_file=files.network, log=path)


def _some_rows(log: TrafficLog) -> LogRows:
    """Return samples from all over a log, of each kind, as kinds may be shifted differently."""
    rows = LogRows()
    for kind in TYPE_OF_KIND:
        traces = [trace for trace in log.traces if trace.kind == kind]
        every = max(1, len(traces) // _TRACES)
        for trace in traces[::every]:
            for row in {0, len(trace.times) // 2, len(trace.times) - 1}:
                x, y = trace.positions[row, :2].tolist()
                lane = int(trace.lanes[row])
                name = log.lane_names[lane] if lane >= 0 else ""
                rows.add(kind, (x, y), name, float(trace.speeds[row]))
    return rows


def _in_degrees(traces: list[Trace]) -> bool:
    """Whether road users cover far less distance than their speeds say.

    A degree is about 1e5 m, so in longitudes and latitudes distances are that much smaller.
    """
    driven = ground = 0.0
    for trace in traces:
        driven += float(np.nansum(trace.speeds[1:] * np.diff(trace.times)))
        ground += float(np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1).sum())
    return driven > 50.0 and ground < 1e-3 * driven
