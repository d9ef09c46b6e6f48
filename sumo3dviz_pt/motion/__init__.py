"""Turn logged samples into continuous motion.

A trace is cut at gaps and teleports, and nothing is interpolated across a cut. Each stretch
between two cuts becomes a motion piece; a piece made of one sample exists at exactly that time.
Inside a piece, a smoother moves the front of the road user and the body follows the front.
(The reader has already left out persons who ride in a vehicle.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Bools
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Trace, TrafficLog, VehicleType, unique_ids
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.motion.body import make_piece
from sumo3dviz_pt.motion.driven import Heading
from sumo3dviz_pt.motion.lanes import LaneGraph, Tracks
from sumo3dviz_pt.motion.samples import breaks, split
from sumo3dviz_pt.motion.setting import LogSettings, is_euler
from sumo3dviz_pt.motion.smoothers.registry import SMOOTHERS, Smoother

__all__ = [
    "MARGIN",
    "LogMotion",
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
    euler = log.euler
    if euler is None:
        euler = bool(is_euler(trace for trace in log.traces if trace.kind == "vehicle"))
    return LogSettings(
        tracks=None if network is None else Tracks(LaneGraph(network)),
        lane_names=log.lane_names,
        types=types or {},
        euler=euler,
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


@dataclass(frozen=True, slots=True, eq=False)
class LogMotion:
    """Makes continuous motion of the traces of a log, of all or of some.

    Attributes:
        log: Logged samples.
        smoother: One of `smoother_names()`.
        heading: How bodies follow their fronts, `chord` or `tractrix`.
        settings: What smoothers need to know about the log.
        ids: Of all traces, unique: where an id comes back with another type, the later one
            ends in `#2` (and so on).
        made: Trajectories by their traces' `id()`, with the traces, whose names may differ.
        lawful: The `id()` of those traces whose motion was found to break no law at any time.
    """

    log: TrafficLog
    smoother: str
    heading: Heading
    settings: LogSettings
    ids: tuple[str, ...]
    made: dict[int, tuple[Trace, Trajectory]] = field(default_factory=dict)
    lawful: set[int] = field(default_factory=set)

    @classmethod
    def of(
        cls,
        log: TrafficLog,
        *,
        smoother: str,
        network: Network | None = None,
        types: Mapping[str, VehicleType] | None = None,
        heading: Heading = "chord",
    ) -> LogMotion:
        """Prepare the smoothing of a log.

        Args:
            log: Logged samples.
            smoother: One of `smoother_names()`.
            network: The road network; None leaves the lanes unknown.
            types: Vehicle types by id, which say how long bodies are.
            heading: How bodies follow their fronts, `chord` or `tractrix`.

        Raises:
            ConfigError: If there is no such smoother; the message suggests one.
        """
        _find(smoother)
        settings = settings_of(log, network=network, types=types)
        return cls(log, smoother, heading, settings, tuple(unique_ids(log.traces)))

    def named(self, name: str) -> Bools:
        """Return which traces, (n,), have an id or a key such as `vehicle:flow_0.3`."""
        pairs = zip(self.ids, self.log.traces, strict=True)
        return np.array([name in (each, f"{trace.kind}:{each}") for each, trace in pairs], bool)

    def smooth(self, which: Bools | None = None) -> tuple[Trajectory, ...]:
        """Return one trajectory for each trace, or for each of some, (n,), in the log's order."""
        chosen = range(len(self.ids)) if which is None else np.flatnonzero(which).tolist()
        return tuple(replace(self._smooth(k), id=self.ids[k]) for k in chosen)

    def sharing(self, other: LogMotion) -> LogMotion:
        """Return the same; it shares what another one makes, if that goes by the same rules."""
        if self._rules != other._rules:
            return self
        return replace(self, settings=other.settings, made=other.made, lawful=other.lawful)

    @property
    def _rules(self) -> tuple[object, ...]:
        """What a trajectory hangs on beside its trace; networks and types by identity."""
        own = self.settings
        network = None if own.tracks is None else id(own.tracks.graph.network)
        rules = (self.smoother, self.heading, self.log.step, own.lane_names, own.euler)
        return (*rules, network, id(own.types))

    def _smooth(self, number: int) -> Trajectory:
        """The trajectory of one trace; it is made once."""
        trace = self.log.traces[number]
        if id(trace) not in self.made:
            made = smooth(
                trace,
                smoother=self.smoother,
                step=self.log.step,
                settings=self.settings,
                heading=self.heading,
            )
            self.made[id(trace)] = (trace, made)
        return self.made[id(trace)][1]


def smooth_log(
    log: TrafficLog,
    *,
    smoother: str,
    network: Network | None = None,
    types: Mapping[str, VehicleType] | None = None,
    heading: Heading = "chord",
) -> tuple[Trajectory, ...]:
    """Make continuous motion of all traces of a log; see `LogMotion.of`.

    Args:
        log: Logged samples.
        smoother: One of `smoother_names()`.
        network: The road network; None leaves the lanes unknown.
        types: Vehicle types by id, which say how long bodies are.
        heading: How bodies follow their fronts, `chord` or `tractrix`.
    """
    return LogMotion.of(
        log, smoother=smoother, network=network, types=types, heading=heading
    ).smooth()


def _find(name: str) -> Smoother:
    """Return the smoother of a name."""
    if name not in SMOOTHERS:
        message = f"no smoother is called {name!r}{did_you_mean(name, SMOOTHERS)}"
        raise ConfigError(message, key="motion.smoother")
    return SMOOTHERS[name]
