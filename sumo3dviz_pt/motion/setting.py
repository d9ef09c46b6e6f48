"""What a smoother knows beside the samples: the lanes, and how the log means its speeds.

References:
    shared facts on motion, section 2. A log of SUMO's default integration (Euler) that is
    written at every step holds v_k = (s_k - s_k-1) / dt: nothing that the places do not
    say, and wrong as a rate. Ballistic runs, action steps and logs thinner than the steps
    hold the rate itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import Trace, VehicleType
from sumo3dviz_pt.motion.track import Tracks
from sumo3dviz_pt.motion.ways import Ways

_CHANGING = 0.2
"""Only where speeds differ by more do the two meanings differ [m/s]."""

_EXACT = 0.01
"""An Euler log's places and speeds agree to its rounding [m]."""

_ENOUGH = 20
"""So many steps make a verdict on one vehicle."""

_LENGTHS: Mapping[str, float] = {"vehicle": 5.0, "person": 0.6, "container": 6.1}
"""Where the type is not known [m]."""

_SHORTEST = 0.6
"""A body follows its front over at least this length [m]: SUMO's people are 0.2 m long."""


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """What a smoother knows beside the samples.

    Attributes:
        tracks: Lines along the lanes; None where no network is given.
        lane_names: That the samples' lanes index.
        euler: Whether speeds are backward differences, and so no rates.
        kind: `vehicle`, `person` or `container`.
        length: Over which the body follows its front [m].
        rests: Whether the samples begin and end at rest, whatever their speeds.
    """

    tracks: Tracks | None = None
    lane_names: tuple[str, ...] = ()
    euler: bool = False
    kind: str = "vehicle"
    length: float = 5.0
    rests: tuple[bool, bool] = (False, False)

    @property
    def ways(self) -> Ways | None:
        """The lanes; None where no network is given."""
        return None if self.tracks is None else self.tracks.ways


@dataclass(frozen=True, slots=True, eq=False)
class LogSettings:
    """The settings of a whole log.

    Attributes:
        tracks: Lines along the lanes; None where no network is given.
        lane_names: Of the log.
        types: By id.
        euler: Whether the log's speeds are backward differences.
    """

    tracks: Tracks | None = None
    lane_names: tuple[str, ...] = ()
    types: Mapping[str, VehicleType] = field(default_factory=dict)
    euler: bool = False

    def of(self, trace: Trace) -> Setting:
        """The setting of one trace."""
        verdict = is_euler([trace], least=_ENOUGH)
        return Setting(
            self.tracks if trace.kind == "vehicle" else None,
            self.lane_names,
            self.euler if verdict is None else verdict,
            trace.kind,
            body_length(trace, self.types),
        )


def body_length(trace: Trace, types: Mapping[str, VehicleType]) -> float:
    """The length over which a body follows its front [m].

    SUMO's angle of a train is that of its locomotive.
    """
    if trace.type_id not in types:
        return _LENGTHS[trace.kind]
    found = types[trace.type_id]
    try:
        first = float(found.params.get("locomotiveLength", ""))
    except ValueError:
        first = found.length
    return max(min(first, found.length) if first > 0.0 else found.length, _SHORTEST)


def is_euler(traces: Iterable[Trace], *, least: int = 1) -> bool | None:
    """Whether speeds are backward differences of places.

    Args:
        traces: Of one log.
        least: So many telling steps are needed.

    Returns:
        None where too few steps tell.
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
    """Way along one lane between samples, (n - 1,) [m]; NaN where it is not known."""
    if len(trace.offsets) != len(trace.times):
        # Without places on lanes: straight ways, which bends shorten.
        straight = np.abs(np.diff(np.unwrap(trace.yaws))) < 1e-3
        ways = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1)
        return np.where(straight, ways, np.nan)
    same = (np.diff(trace.lanes) == 0) & (trace.lanes[1:] >= 0)
    return np.where(same, np.diff(trace.offsets), np.nan)
