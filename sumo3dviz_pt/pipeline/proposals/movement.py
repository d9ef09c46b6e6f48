"""Who moves where and when, in rows of about a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.traffic import FASTEST, Trace

STEP = 1.0
"""Time between rows, unless the log's own steps are longer [s]."""

_MOST_ROWS = 4_000_000
"""Of longer logs only some road users are looked at, so that a city takes seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """Rows of road users, in order of users and time.

    Attributes:
        traces: The road users.
        users: Index into `traces`, (n,).
        times: (n,) [s].
        places: (n, 3) [m].
        yaws: (n,) [rad].
        driven: Distance since the user's row before, (n,) [m]; 0 at its first row, and where it
            was moved rather than drove.
    """

    traces: Sequence[Trace]
    users: Ints
    times: Floats
    places: Floats
    yaws: Floats
    driven: Floats

    def during(self, start: float, end: float) -> Movement:
        """Return the rows of a span of time [s], both ends included."""
        return self.where((self.times >= start - 1e-6) & (self.times <= end + 1e-6))

    def near(self, place: Floats, radius: float) -> Movement:
        """Return the rows within a distance in plan [m] of a place, (2,) or (3,) [m]."""
        return self.where(np.hypot(*(self.places[:, :2] - place[:2]).T) <= radius)

    def where(self, kept: Bools) -> Movement:
        """Return some of the rows; distances stay those to the row before in the log."""
        return Movement(
            self.traces,
            self.users[kept],
            self.times[kept],
            self.places[kept],
            self.yaws[kept],
            self.driven[kept],
        )

    def distances(self) -> tuple[Ints, Floats]:
        """Return the users of these rows, (m,), and how far each drives in them, (m,) [m]."""
        users, row = np.unique(self.users, return_inverse=True)
        sums = np.zeros(len(users))
        np.add.at(sums, row.ravel(), self.driven)
        return users, sums


def movement_of(traces: Sequence[Trace]) -> Movement:
    """Return the rows of road users, thinned to about one a second."""
    rows = sum(len(trace.times) for trace in traces)
    traces = tuple(traces[:: max(1, -(-rows // _MOST_ROWS))])
    if not traces:
        empty = np.zeros(0)
        return Movement((), np.zeros(0, np.int64), empty, np.zeros((0, 3)), empty, empty)
    users = np.repeat(np.arange(len(traces)), [len(trace.times) for trace in traces])
    times = np.concatenate([trace.times for trace in traces])
    # Keep the first row of each user in each second.
    second = np.floor(times / STEP + 1e-6)
    first = np.append(True, np.diff(users) != 0)
    kept = np.flatnonzero(first | np.append(True, np.diff(second) != 0))
    users, times, first = users[kept], times[kept], first[kept]
    places = np.concatenate([trace.positions for trace in traces])[kept]
    yaws = np.concatenate([trace.yaws for trace in traces])[kept]
    # What was moved faster than anything drives was teleported.
    steps = np.linalg.norm(np.diff(places[:, :2], axis=0, prepend=places[:1, :2]), axis=1)
    gaps = np.diff(times, prepend=times[0])
    drove = ~first & (steps <= FASTEST * np.maximum(gaps, 1e-9))
    return Movement(traces, users, times, places, yaws, np.where(drove, steps, 0.0))
