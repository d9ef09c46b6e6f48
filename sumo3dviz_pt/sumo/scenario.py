"""Reads everything that a scenario's files say about a time window.

Logs without z get the heights of the road in a network that has hills.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats, evenly_along, frozen
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import (
    LogChoices,
    Scenario,
    ScenarioFiles,
    SignalPhases,
    Trace,
    TrafficLog,
)
from sumo3dviz_pt.sumo.additional import (
    read_additional,
    read_detectors,
    read_parking,
    read_stops,
)
from sumo3dviz_pt.sumo.belonging import (
    OVERRIDE,
    LogRows,
    check_belonging,
    first_rows,
    misfit,
    rows_in_net,
)
from sumo3dviz_pt.sumo.coupling import coupled
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.guesses import TypesOfUsers
from sumo3dviz_pt.sumo.land.heights import lifted, on_land
from sumo3dviz_pt.sumo.land.pictures import picture_of
from sumo3dviz_pt.sumo.network import network_of
from sumo3dviz_pt.sumo.plausibility.log import findings
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.sumo.types import TYPE_OF_KIND, read_vehicle_types

_SPACING = 2.0
"""Distance between the points that stand for a lane [m]."""


def on_land_of(traces: tuple[Trace, ...], network: Network) -> tuple[Trace, ...]:
    """Put traces as they were read onto roads that may have been raised onto the land.

    Args:
        traces: Their heights, if they have any, are those of the network's file.
        network: The roads.
    """
    if network.raised_by is None or not any(trace.positions[:, 2].any() for trace in traces):
        return with_heights(traces, network)
    land = network.raised_by
    return tuple(replace(trace, positions=lifted(trace.positions, land)) for trace in traces)


def with_heights(traces: tuple[Trace, ...], network: Network) -> tuple[Trace, ...]:
    """Put traces onto the road if the log has no z but the network has.

    Args:
        traces: Traces as read.
        network: The roads.

    Returns:
        The same traces if the network is flat or any sample has a height, else traces
        with the z of the nearest lane [m].
    """
    hilly = any(lane.shape[:, 2].any() for lane in network.lanes.values())
    if not hilly or any(trace.positions[:, 2].any() for trace in traces):
        return traces
    points = _lane_points(network)
    tree = cKDTree(points[:, :2])
    return tuple(
        replace(trace, positions=_lifted(trace.positions, points[:, 2], tree)) for trace in traces
    )


def _lifted(positions: Floats, heights: Floats, tree: cKDTree) -> Floats:
    """Return positions at the heights of their nearest points, weighted by inverse distance."""
    # A lane has at least two points, so there always is a second one.
    distances, nearest = tree.query(positions[:, :2], k=[1, 2])
    weights = 1.0 / (np.asarray(distances) + 1e-6)
    z = (weights * heights[nearest]).sum(axis=1) / weights.sum(axis=1)
    return frozen(np.column_stack([positions[:, :2], z]))


def _lane_points(network: Network) -> Floats:
    """Return points along all lanes, at most `_SPACING` apart, (n, 3) [m]."""
    shapes = [lane.shape for lane in network.lanes.values()]
    return evenly_along(shapes, lambda long: np.maximum(np.ceil(long / _SPACING) + 1, 2)).points


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
    choices: LogChoices | None = None,
) -> Scenario:
    """Read a scenario.

    Every trace's type is in `vehicle_types`: types that no file defines get SUMO's
    defaults of the class that `choices` or the words of their ids tell, else of their kind.
    A log without z in a network that has hills is put onto the road.

    Args:
        files: As `find_scenario` gives them.
        begin: First time to keep [s]; None keeps all from the start.
        end: Last time to keep [s]; None keeps all to the end.
        margin: Time to keep before and after these, for smoothing [s].
        allow_truncated: Whether to use the complete steps of a log that breaks off.
        choices: How to understand what the files leave open.

    Returns:
        Everything in SI units and net coordinates.

    Raises:
        InputError: If a file is damaged, or the log does not belong to the network or would
            make a film of nonsense.
    """
    choices = choices or LogChoices()
    network = network_of(files.network)
    if choices.land.heights is not None:
        network = on_land(network, choices.land.heights)
    if choices.land.picture is not None:
        network = replace(network, picture=picture_of(choices.land, network))
    paved = files.network in {file for each in files.tables for file in each.files}
    doubted = not choices.allow_misfit
    with _doubts(allow=not doubted):
        for path in () if paved else files.trajectories:
            rows = rows_in_net(first_rows(path), path, network.location)
            _check_rows(rows, network, files, path)
    log = read_trajectories(
        files.trajectories,
        begin=begin,
        end=end,
        margin=margin,
        allow_truncated=allow_truncated,
        location=network.location,
    )
    if network.heights is not None:
        log = replace(log, traces=on_land_of(log.traces, network))
    if not paved:  # a network that was made of the log fits it
        with _doubts(allow=not doubted):
            _check_log(log, network, files)
        # A window may be odd where the log as a whole is not, so it is never refused.
        _judge(
            log, network, files.trajectories[0], refuse=doubted and begin is None and end is None
        )
    known = TypesOfUsers(read_vehicle_types(files.vehicle_types), choices.classes)
    traces, types = known.typed(log.traces)
    traces, lengths = coupled(replace(log, traces=traces), types)
    types |= lengths
    traces = with_heights(traces, network)
    pois, polygons = read_additional(files.additional, network)
    signals = read_signals(files.signals, network)
    loops, unseen = read_detectors(files.additional)
    _compare_lights(signals, network, files)
    return Scenario(
        network=network,
        traffic=replace(log, traces=traces),
        vehicle_types=dict(known.defined) | types,
        signals=signals,
        pois=pois,
        polygons=polygons,
        stops=read_stops(files.additional),
        guesses=known.guesses(log.traces),
        parking=read_parking(files.additional, network),
        loops=loops,
        unseen=unseen,
    )


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
            x, y = network.location.outside(traces[0].positions[0, :2])
            reason = f"the first {kind} is at ({x:g}, {y:g})"
            raise misfit(reason, network_file=files.network, log=path)


def _judge(log: TrafficLog, network: Network, path: Path, *, refuse: bool) -> None:
    """Note what seems wrong with a log.

    Args:
        log: The log, or a window of it.
        network: The network.
        path: File of the log, for messages.
        refuse: Whether to refuse it if a film of it would be nonsense.

    Raises:
        InputError: If it is refused.
    """
    for finding in findings(log, network):
        if finding.hopeless and refuse:
            raise InputError(f"{finding.text}, {OVERRIDE}", file=path)
        once = {"once": f"{finding.about} of {path}"}
        logger.warning("%s: %s", path, finding.text, extra=once)


@contextmanager
def _doubts(*, allow: bool) -> Iterator[None]:
    """Turn the refusal of a log into a note where that is allowed."""
    try:
        yield
    except InputError as error:
        if not allow:
            raise
        logger.warning("%s", error, extra={"once": f"misfit of {error.file}"})


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
                offset = float(trace.offsets[row]) if len(trace.offsets) else math.nan
                rows.add(kind, (x, y), name, float(trace.speeds[row]), offset)
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
