"""What a smoother knows besides the samples: the lanes, and what the logged speeds mean.

A log of SUMO's default integration (Euler) that is written at every step holds the speeds
v_k = (s_k - s_k-1) / dt. They say nothing that the positions do not say, and they are half a
step late as rates. Ballistic runs, runs with action steps, and logs that leave out steps hold
the rate itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import RAIL_CLASSES, UNKNOWN_TYPES, Trace, VehicleType
from sumo3dviz_pt.motion.lanes import LaneGraph, Tracks

_CHANGING = 0.2
"""The two meanings of speeds can be told apart only where speeds change by more than this [m/s]."""

_EXACT = 0.01
"""Positions and speeds of an Euler log agree within this distance, its rounding [m]."""

_ENOUGH = 20
"""Steps that are needed for a verdict on a single vehicle."""

_SHORTEST = 0.6
"""Shortest length over which a body follows its front [m]: SUMO's people are 0.2 m long."""


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What a smoother knows besides the samples of one road user.

    Attributes:
        tracks: Lines along the lanes; None where no network is given.
        lane_names: Lane ids; the lane numbers of samples index them.
        euler: Whether speeds are backward differences of positions instead of rates.
        kind: `vehicle`, `person` or `container`.
        length: Length over which the body follows its front [m].
        rests: Whether the samples begin, and whether they end, at rest whatever the speeds say.
        railed: Whether it runs on rails.
    """

    tracks: Tracks | None = None
    lane_names: tuple[str, ...] = ()
    euler: bool = False
    kind: str = "vehicle"
    length: float = 5.0
    rests: tuple[bool, bool] = (False, False)
    railed: bool = False

    @property
    def graph(self) -> LaneGraph | None:
        """The graph of the lanes; None where no network is given."""
        return None if self.tracks is None else self.tracks.graph


@dataclass(frozen=True, slots=True, eq=False)
class LogSettings:
    """What smoothers know about a whole log.

    Attributes:
        tracks: Lines along the lanes; None where no network is given.
        lane_names: Lane ids of the log.
        types: Vehicle types by id.
        euler: Whether the log's speeds are backward differences of positions.
    """

    tracks: Tracks | None = None
    lane_names: tuple[str, ...] = ()
    types: Mapping[str, VehicleType] = field(default_factory=dict)
    euler: bool = False

    def of(self, trace: Trace) -> Setting:
        """Return the setting of one trace."""
        verdict = is_euler([trace], least=_ENOUGH)
        return Setting(
            self.tracks if trace.kind == "vehicle" else None,
            self.lane_names,
            self.euler if verdict is None else verdict,
            trace.kind,
            body_length(trace, self.types),
            railed=is_railed(self.types.get(trace.type_id, UNKNOWN_TYPES[trace.kind])),
        )


def body_length(trace: Trace, types: Mapping[str, VehicleType]) -> float:
    """Return the length over which a body follows its front [m].

    For a train that is its locomotive's length, because SUMO logs the locomotive's angle.
    """
    vehicle_type = types.get(trace.type_id, UNKNOWN_TYPES[trace.kind])
    try:
        first = float(vehicle_type.params.get("locomotiveLength", ""))
    except ValueError:
        first = vehicle_type.length
    return max(min(first, vehicle_type.length) if first > 0.0 else vehicle_type.length, _SHORTEST)


def is_railed(kind: VehicleType) -> bool:
    """Return whether vehicles of a type run on rails, or are drawn as if they did."""
    return kind.vclass in RAIL_CLASSES or kind.gui_shape.startswith("rail")


def is_euler(traces: Iterable[Trace], *, least: int = 1) -> bool | None:
    """Return whether a logged speed is the mean of the step before it (SUMO's Euler method).

    Args:
        traces: Traces of one log.
        least: Number of steps with a clear change of speed that a verdict needs.

    Returns:
        The verdict, or None where there are fewer such steps.
    """
    backward, mean = [], []
    for trace in traces:
        moved, steps = _moved(trace), np.diff(trace.times)
        first, last = trace.speeds[:-1], trace.speeds[1:]
        telling = np.isfinite(moved) & (np.abs(last - first) > _CHANGING)
        backward.append(np.abs(moved - last * steps)[telling])
        mean.append(np.abs(moved - (first + last) / 2.0 * steps)[telling])
    if sum(map(len, backward)) < least:
        return None
    off, even = (float(np.median(np.concatenate(each))) for each in (backward, mean))
    return off < _EXACT and off < 0.3 * even


def _moved(trace: Trace) -> Floats:
    """Return the distances driven between samples, (n - 1,) [m]; NaN where they are unknown."""
    if len(trace.offsets) != len(trace.times):
        # Without offsets on lanes only straight steps tell: a bend is longer than its chord.
        straight = np.abs(np.diff(np.unwrap(trace.yaws))) < 1e-3
        lengths = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1)
        return np.where(straight, lengths, np.nan)
    same = (np.diff(trace.lanes) == 0) & (trace.lanes[1:] >= 0)
    return np.where(same, np.diff(trace.offsets), np.nan)
