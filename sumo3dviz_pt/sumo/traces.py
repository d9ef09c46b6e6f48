"""Turn packed rows of the vehicle log into traces."""

from __future__ import annotations

import logging
from array import array
from collections.abc import Iterable

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, frozen
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.sumo.bounds import COORDINATE, SPEED, Range

logger = logging.getLogger(__name__)

Key = tuple[str, str, str]
"""Kind, id and first type: an id that comes back with another type is another road user."""

RowsOfUsers = dict[Key, "array[float]"]
"""Packed rows by road user: time, x, y, z, angle, speed, slope, lane, signals, offset on it."""

COLUMNS = 10
"""Number of values of a packed row."""

STEEPEST = np.radians(30.0)
"""Steepest slope that is kept [rad]; SUMO logs up to 90 degrees at kerbs and on walking areas."""

_TOUCH = 0.01
"""Largest distance of a rider from the logged position of the vehicle, due to rounding [m]."""


_SHIFTS = ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5))
"""Grids shifted by half a cell: two points nearer than that share a cell of one of them."""


def user_key(kind: str, name: str, type_id: str) -> Key:
    """Return the key of a road user, which keeps its type for as long as it drives.

    SUMO gives it a type of its own, `type@id`, from the moment when TraCI, a blue light or a
    split of a train changes something about it.

    Args:
        kind: `vehicle`, `person` or `container`.
        name: Its id.
        type_id: Its vType in a row of the log, may be empty.
    """
    return kind, name, type_id.removesuffix(f"@{name}") if "@" in type_id else type_id


def build_traces(rows: RowsOfUsers) -> tuple[Trace, ...]:
    """Make traces in order of first appearance; `rows` is emptied to save memory.

    Args:
        rows: Packed rows of each road user, in any order, perhaps repeated.

    Returns:
        Traces without the samples of riders.
    """
    riding = riding_rows(rows)
    traces: list[Trace] = []
    hidden = 0
    for key in list(rows):
        table = table_of(rows.pop(key))
        if key in riding:
            hidden += int(riding[key].sum())
            table = table[~riding[key]]
        if len(table):
            traces.append(_trace(key, in_order(table)))
    if hidden:
        logger.info("%d samples of riders coincide with their vehicle and are left out", hidden)
    traces.sort(key=lambda trace: trace.times[0])
    return tuple(traces)


def rows_of(traces: Iterable[Trace]) -> RowsOfUsers:
    """Return the packed rows that traces were made from, without what traces leave out."""
    rows: RowsOfUsers = {}
    for trace in traces:
        empty = np.full(len(trace.times), np.nan)
        columns = (
            trace.times,
            *trace.positions.T,
            90.0 - np.degrees(trace.yaws),
            trace.speeds,
            np.degrees(trace.slopes),
            trace.lanes,
            trace.signals,
            trace.offsets if len(trace.offsets) else empty,
        )
        buffer = rows.setdefault((trace.kind, trace.id, trace.type_id), array("d"))
        buffer.frombytes(np.column_stack(columns).tobytes())
    return rows


def table_of(buffer: array[float]) -> Floats:
    """Return packed rows as a table, (n, 10)."""
    return np.frombuffer(buffer, dtype=np.float64).reshape(-1, COLUMNS)


def in_order(table: Floats) -> Floats:
    """Return rows in time order; of several at one time, the first that was written."""
    times = table[:, 0]
    if (np.diff(times) > 0).all():
        return table
    _, first = np.unique(times, return_index=True)
    return table[first]


def _trace(key: Key, table: Floats) -> Trace:
    yaws = np.pi / 2 - np.radians(table[:, 4])
    return Trace(
        kind=key[0],
        id=key[1],
        type_id=key[2],
        times=frozen(table[:, 0]),
        positions=frozen(table[:, 1:4]),
        yaws=frozen(np.arctan2(np.sin(yaws), np.cos(yaws))),
        speeds=_possible(table[:, 5], SPEED),
        slopes=frozen(np.clip(np.radians(table[:, 6]), -STEEPEST, STEEPEST)),
        lanes=frozen(table[:, 7], np.int64),
        signals=frozen(table[:, 8], np.int64),
        offsets=_possible(table[:, 9], COORDINATE),
    )


def _possible(values: Floats, within: Range) -> Floats:
    """Return values with NaN, which stands for none, where they are out of range, (n,)."""
    return frozen(np.where(np.abs(values) <= within.high, values, np.nan))


def riding_rows(rows: RowsOfUsers) -> dict[Key, Bools]:
    """Return for each person and container which rows lie where a vehicle is at that time."""
    riding = {
        key: np.zeros(len(buffer) // COLUMNS, dtype=np.bool_)
        for key, buffer in rows.items()
        if key[0] != "vehicle"
    }
    if not riding or len(riding) == len(rows):
        return riding
    for shift in _SHIFTS:
        places = np.concatenate(
            [_place_keys(table_of(rows[key]), shift) for key in rows if key not in riding]
        )
        # A log that breaks off may name vehicles and give no complete row of any.
        if not len(places):
            break
        places.sort()
        for key, mask in riding.items():
            keys = _place_keys(table_of(rows[key]), shift)
            found = np.searchsorted(places, keys).clip(max=len(places) - 1)
            mask |= places[found] == keys
    return riding


def _place_keys(table: Floats, shift: tuple[float, float]) -> Ints:
    """Return a 64-bit key of each row's time and grid cell; different rows hardly ever collide."""
    time = np.ascontiguousarray(table[:, 0]).view(np.int64)
    x, y = (
        np.floor(table[:, 1 + axis] / (2 * _TOUCH) + shift[axis]).astype(np.int64)
        for axis in (0, 1)
    )
    # Multiply-xor mixing (Knuth's golden-ratio constant); overflow wraps on purpose.
    golden = np.int64(-7046029254386353131)
    mixed = time
    for part in (x, y):
        mixed = (mixed ^ (mixed >> np.int64(29))) * golden + part
    return (mixed ^ (mixed >> np.int64(32))) * golden
