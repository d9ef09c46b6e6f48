"""Say where rows of a log are out of order; `build_traces` puts them in order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.sumo.traces import RowsOfUsers, table_of

_SAME = 0.02
"""Distance of two places from which on they are not one place, rounded twice [m]."""


def backward_steps(steps: Sequence[float]) -> str:
    """Say where time goes backward in a log, or nothing.

    Args:
        steps: Times of the log's steps as they are written [s].
    """
    times = np.array(steps)
    back = np.flatnonzero(np.diff(times) < 0.0)
    if not len(back):
        return ""
    first = int(back[0])
    return (
        f"time goes backward {_times(len(back))}, at first from {times[first]:.12g} s to"
        f" {times[first + 1]:.12g} s; the steps are sorted, and the first of repeated ones counts"
    )


def row_twice(rows: RowsOfUsers) -> str:
    """Say which road user is at two places at one time, or nothing.

    Args:
        rows: Packed rows of one log.
    """
    count, first = 0, ""
    for key, buffer in rows.items():
        table = table_of(buffer)
        steps = np.diff(table[:, 0])
        if (steps > 0.0).all():
            continue
        table = table[np.argsort(table[:, 0], kind="stable")]
        apart = np.abs(np.diff(table[:, 1:3], axis=0)).max(axis=1) > _SAME
        twice = np.flatnonzero((np.diff(table[:, 0]) == 0.0) & apart)
        if len(twice):
            first = first or f"`{cut(key[1])}` at {table[twice[0], 0]:g} s"
            count += len(twice)
    if not count:
        return ""
    return (
        f"a road user is at two places at one time, {_times(count)} (first: {first}); the first"
        " row counts; give each its own id"
    )


def _times(count: int) -> str:
    """Return a number of times in words."""
    return "once" if count == 1 else f"{count} times"
