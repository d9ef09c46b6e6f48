"""Turn logged samples into continuous motion.

A trace is cut at gaps and teleports, and nothing is interpolated across a cut. Each stretch
between two cuts becomes a motion piece; a piece made of one sample exists at exactly that time.
Inside a piece, a smoother moves the front of the road user and the body follows the front.
(The reader has already left out persons who ride in a vehicle.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Trace, TrafficLog, VehicleType, unique_ids
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.motion.body import make_piece
from sumo3dviz_pt.motion.headings import Heading
from sumo3dviz_pt.motion.lanes.graph import LaneGraph
from sumo3dviz_pt.motion.lanes.track import Tracks
from sumo3dviz_pt.motion.setting import LogSettings, is_euler
from sumo3dviz_pt.motion.smoothers.registry import SMOOTHERS, Smoother
from sumo3dviz_pt.motion.splitting import breaks, split

__all__ = [
    "MARGIN",
    "LogSettings",
    "check_smoother",
    "settings_of",
    "smooth",
    "smooth_log",
    "smoother_names",
]

MARGIN = 12.0
"""Time that a reader must load before and after the window that is shown [s].

With this margin the choice of the window changes nothing that can be seen: a change of lanes
reaches 8 s; the spline through samples 1 s apart forgets 3/4 of an influence with every sample;
and a body lies one length behind its front.
"""


def smoother_names() -> tuple[str, ...]:
    """Return the names that `smooth` accepts, sorted."""
    return tuple(sorted(SMOOTHERS))


def check_smoother(name: str) -> None:
    """Refuse a name that no smoother has.

    Raises:
        ConfigError: If there is no such smoother; the message suggests one.
    """
    _find(name)


def settings_of(
    log: TrafficLog,
    *,
    network: Network | None = None,
    types: Mapping[str, VehicleType] | None = None,
) -> LogSettings:
    """Return what smoothers need to know about a log besides its samples.

    Args:
        log: The log.
        network: The road network; None leaves the lanes unknown.
        types: Vehicle types by id, which say how long bodies are.
    """
    return LogSettings(
        tracks=None if network is None else Tracks(LaneGraph(network)),
        lane_names=log.lane_names,
        types=types or {},
        euler=bool(is_euler(trace for trace in log.traces if trace.kind == "vehicle")),
    )


def smooth(
    trace: Trace,
    *,
    smoother: str,
    step: float | None = None,
    settings: LogSettings | None = None,
    heading: Heading = "chord",
) -> Trajectory:
    """Make continuous motion of a trace.

    Args:
        trace: Logged samples.
        smoother: One of `smoother_names()`.
        step: Median step of the whole log [s]; by default the trace's own.
        settings: Settings of the whole log; by default no lanes and no types are known.
        heading: How bodies follow their fronts, `chord` or `tractrix`; a smoother with a
            rule of its own ignores it.

    Raises:
        ConfigError: If there is no such smoother; the message suggests one.
    """
    chosen = _find(smoother)
    if step is None:
        step = float(np.median(np.diff(trace.times))) if len(trace.times) > 1 else 0.0
    setting = (settings or LogSettings()).of(trace)
    made = [
        make_piece(samples, chosen, setting, heading=heading) for samples in split(trace, step=step)
    ]
    remarks = [*breaks(trace, step=step), *(remark for _, some in made for remark in some)]
    return Trajectory(
        trace.id,
        trace.kind,
        trace.type_id,
        tuple(piece for piece, _ in made),
        tuple(sorted(remarks, key=lambda remark: (remark.begin, remark.kind))),
    )


def smooth_log(
    log: TrafficLog,
    *,
    smoother: str,
    network: Network | None = None,
    types: Mapping[str, VehicleType] | None = None,
    heading: Heading = "chord",
) -> tuple[Trajectory, ...]:
    """Make continuous motion of all traces of a log.

    Args:
        log: Logged samples.
        smoother: One of `smoother_names()`.
        network: The road network; None leaves the lanes unknown.
        types: Vehicle types by id, which say how long bodies are.
        heading: How bodies follow their fronts, `chord` or `tractrix`.

    Returns:
        One trajectory for each trace, in the log's order. Ids are unique: where an id
        comes back with another type, the later trajectory's id ends in `#2` (and so on).

    Raises:
        ConfigError: If there is no such smoother; the message suggests one.
    """
    _find(smoother)
    settings = settings_of(log, network=network, types=types)
    ids = unique_ids(log.traces)
    made = (
        smooth(each, smoother=smoother, step=log.step, settings=settings, heading=heading)
        for each in log.traces
    )
    return tuple(replace(trajectory, id=name) for trajectory, name in zip(made, ids, strict=True))


def _find(name: str) -> Smoother:
    """Return the smoother of a name."""
    if name not in SMOOTHERS:
        message = f"no smoother is called {name!r}{did_you_mean(name, SMOOTHERS)}"
        raise ConfigError(message, key="motion.smoother")
    return SMOOTHERS[name]
