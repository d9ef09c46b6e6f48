"""Samples to continuous motion.

Gaps and teleports split a trajectory and are never interpolated across; a piece of
one sample exists for exactly that time. (The reader already left out persons who ride
in a vehicle.) A new smoother is one new module of this folder that registers itself.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from importlib import import_module

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.traffic import Trace, TrafficLog
from sumo3dviz_pt.model.trajectory import Piece, Trajectory
from sumo3dviz_pt.motion.pieces import split
from sumo3dviz_pt.motion.registry import SMOOTHERS, Smoother
from sumo3dviz_pt.motion.samples import Samples, StandingPiece

__all__ = ["MARGIN", "smooth", "smooth_log", "smoother_names"]

MARGIN = 6.0
"""What a reader must load beyond both ends of the asked window, so that the window
changes nothing: 0.42 + 0.82 s of averaging and two steps of the log, of up to 2.3 s [s]."""

for _module in pkgutil.iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")


def smoother_names() -> tuple[str, ...]:
    """Names that `smooth` knows, sorted."""
    return tuple(sorted(SMOOTHERS))


def smooth(trace: Trace, *, smoother: str, step: float | None = None) -> Trajectory:
    """Make continuous motion of a trace.

    Args:
        trace: Logged samples.
        smoother: One of `smoother_names()`.
        step: Median step of the whole log [s]; default the trace's own.

    Raises:
        ConfigError: If there is no such smoother; the message suggests one.
    """
    chosen = _find(smoother)
    if step is None:
        step = float(np.median(np.diff(trace.times))) if len(trace.times) > 1 else 0.0
    pieces = tuple(_piece(samples, chosen) for samples in split(trace, step=step))
    return Trajectory(trace.id, trace.kind, trace.type_id, pieces)


def smooth_log(log: TrafficLog, *, smoother: str) -> tuple[Trajectory, ...]:
    """Make continuous motion of all traces of a log.

    Returns:
        One trajectory for each trace, in the log's order. Keys are
        unique: where an id comes back with another type, `#2` (and so on) is appended
        to the later one's id.

    Raises:
        ConfigError: If there is no such smoother; the message suggests one.
    """
    _find(smoother)
    return tuple(_unique(smooth(each, smoother=smoother, step=log.step) for each in log.traces))


def _unique(trajectories: Iterator[Trajectory]) -> Iterator[Trajectory]:
    """Number the later ones of trajectories that share a key."""
    seen: set[str] = set()
    for trajectory in trajectories:
        found, number = trajectory, 1
        while found.key in seen:
            number += 1
            name = f"{trajectory.id}#{number}"
            found = Trajectory(name, trajectory.kind, trajectory.type_id, trajectory.pieces)
        seen.add(found.key)
        yield found


def _piece(samples: Samples, smoother: Smoother) -> Piece:
    """Motion of one stretch of samples."""
    return StandingPiece(samples) if len(samples.times) == 1 else smoother(samples)


def _find(name: str) -> Smoother:
    """A smoother by name."""
    if name not in SMOOTHERS:
        message = f"no smoother is called {name!r}{did_you_mean(name, SMOOTHERS)}"
        raise ConfigError(message, key="motion.smoother")
    return SMOOTHERS[name]
