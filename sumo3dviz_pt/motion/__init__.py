"""Samples to continuous motion.

Gaps and teleports split a trajectory and are never interpolated across; a piece of
one sample exists for exactly that time. (The reader already left out persons who ride
in a vehicle.) A smoother moves the front; the body follows it. A new smoother is one new
module of this folder that registers itself.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Trace, TrafficLog, VehicleType, unique_ids
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.motion.body import make_piece
from sumo3dviz_pt.motion.headings import Heading
from sumo3dviz_pt.motion.pieces import breaks, split
from sumo3dviz_pt.motion.registry import SMOOTHERS, Smoother
from sumo3dviz_pt.motion.setting import LogSettings, is_euler
from sumo3dviz_pt.motion.track import Tracks
from sumo3dviz_pt.motion.ways import Ways

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
"""What a reader must load beyond both ends of the asked window, so that the window
changes nothing that can be seen: a change of lanes reaches 8 s, the spline of a log of 1 s
forgets 3/4 of an influence with every sample, and a body is one length behind its front [s]."""

for _module in pkgutil.iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")


def smoother_names() -> tuple[str, ...]:
    """Names that `smooth` knows, sorted."""
    return tuple(sorted(SMOOTHERS))


def check_smoother(name: str) -> None:
    """Refuse a name that no smoother has.

    Raises:
        ConfigError: Suggests one.
    """
    _find(name)


def settings_of(
    log: TrafficLog,
    *,
    network: Network | None = None,
    types: Mapping[str, VehicleType] | None = None,
) -> LogSettings:
    """What smoothers know of a log beside its samples.

    Args:
        log: The log.
        network: Its lanes; None leaves them unknown.
        types: Say how long bodies are, by id.
    """
    return LogSettings(
        tracks=None if network is None else Tracks(Ways(network)),
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
        step: Median step of the whole log [s]; default the trace's own.
        settings: Of the whole log; default knows no lanes and no types.
        heading: How bodies follow their fronts, `chord` or `tractrix`; smoothers with a
            rule of their own ignore it.

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
        network: Its lanes; None leaves them unknown.
        types: Say how long bodies are, by id.
        heading: `chord` or `tractrix`.

    Returns:
        One trajectory for each trace, in the log's order. Keys are
        unique: where an id comes back with another type, `#2` (and so on) is appended
        to the later one's id.

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
    """A smoother by name."""
    if name not in SMOOTHERS:
        message = f"no smoother is called {name!r}{did_you_mean(name, SMOOTHERS)}"
        raise ConfigError(message, key="motion.smoother")
    return SMOOTHERS[name]
