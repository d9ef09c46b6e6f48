"""Take a sample of a log's rows by which it is judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.traffic import GAP_FACTOR, Trace, TrafficLog

_ROWS = 2500
"""Number of steps that are looked at, about."""

_USERS = 800
"""Largest number of vehicles that they are taken from."""

_MOVES = 0.3
"""Smallest distance in a step, and smallest speed, of a vehicle that drives [m], [m/s]."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What seems wrong with a log.

    Attributes:
        about: What it is about, in a word.
        text: What is wrong, how much, and what to do.
        hopeless: Whether a film of this log would be nonsense.
    """

    about: str
    text: str
    hopeless: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class LogSample:
    """Steps of driving vehicles from all over a log.

    Attributes:
        places: x, y and z at the end of each step, (n, 3) [m].
        moves: Way of the front from the row before, (n, 2) [m].
        spans: Duration of each step, (n,) [s].
        yaws: Logged direction at its end, counter-clockwise from east, (n,) [rad].
        speeds: Logged speed at its end; NaN where none is logged, (n,) [m/s].
        lanes: Index into the log's lane names; -1 where none is logged, (n,).
        offsets: Logged place along the lane; NaN where none is logged, (n,) [m].
    """

    places: Floats
    moves: Floats
    spans: Floats
    yaws: Floats
    speeds: Floats
    lanes: Ints
    offsets: Floats

    def __len__(self) -> int:
        return len(self.places)

    @property
    def lengths(self) -> Floats:
        """Distance of each step, (n,) [m]."""
        return np.asarray(np.hypot(self.moves[:, 0], self.moves[:, 1]))

    def where(self, rows: Bools | Ints) -> LogSample:
        """Return some of its steps."""
        return LogSample(*(getattr(self, name)[rows] for name in self.__slots__))


def sample_of(log: TrafficLog) -> LogSample:
    """Return steps of vehicles that drive, evenly spread over the log; always the same ones."""
    traces = [t for t in log.traces if t.kind == "vehicle" and len(t.times) > 1]
    traces = traces[:: max(1, -(-len(traces) // _USERS))]
    each = max(3, _ROWS // max(len(traces), 1))
    parts = [_steps_of(trace, each) for trace in traces]
    sample = _joined(parts)
    drives = (sample.lengths > _MOVES * np.minimum(sample.spans, 1.0)) | (sample.speeds > 1.0)
    return sample.where(drives)


def _steps_of(trace: Trace, most: int) -> LogSample:
    """Return some steps of a vehicle; those over gaps are left out."""
    spans = np.diff(trace.times)
    whole = np.flatnonzero(spans <= GAP_FACTOR * np.median(spans))
    # Every row is as likely as its neighbours, whatever the number of rows.
    chosen = whole[np.unique(np.linspace(0, len(whole) - 1, min(most, len(whole))).astype(int))]
    ends = chosen + 1
    offsets = trace.offsets[ends] if len(trace.offsets) else np.full(len(ends), np.nan)
    return LogSample(
        places=trace.positions[ends],
        moves=trace.positions[ends, :2] - trace.positions[chosen, :2],
        spans=spans[chosen],
        yaws=trace.yaws[ends],
        speeds=trace.speeds[ends],
        lanes=trace.lanes[ends],
        offsets=offsets,
    )


def _joined(parts: Sequence[LogSample]) -> LogSample:
    """Return the steps of all vehicles together."""
    if not parts:
        one, two = np.empty(0), np.empty((0, 2))
        return LogSample(np.empty((0, 3)), two, one, one, one, np.empty(0, np.int64), one)
    names = LogSample.__slots__
    return LogSample(*(np.concatenate([getattr(part, n) for part in parts]) for n in names))
