"""Rows of the vehicle log: packed by columns, many at a time, and turned into traces."""

from __future__ import annotations

import logging
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import compress, repeat
from math import nan
from typing import Any, cast

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, frozen
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.sumo.formats.format import Cells, Rows
from sumo3dviz_pt.sumo.values import ANGLE, COORDINATE, HEIGHT, SIGNAL_BITS, SPEED, Range, is_plain

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
        speeds=_traces_possible(table[:, 5], SPEED),
        slopes=frozen(np.clip(np.radians(table[:, 6]), -STEEPEST, STEEPEST)),
        lanes=frozen(table[:, 7], np.int64),
        signals=frozen(table[:, 8], np.int64),
        offsets=_traces_possible(table[:, 9], COORDINATE),
    )


def _traces_possible(values: Floats, within: Range) -> Floats:
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
            index = np.searchsorted(places, keys).clip(max=len(places) - 1)
            mask |= places[index] == keys
    return riding


def taken_times(rows: RowsOfUsers) -> dict[str, list[float]]:
    """Return at which times a person's row lies where a vehicle is, by the vehicle's id [s]."""
    riders = [
        table_of(rows[key])[mask]
        for key, mask in riding_rows(rows).items()
        if key[0] == "person" and mask.any()
    ]
    if not riders:
        return {}
    riding = np.concatenate(riders)
    times: dict[str, list[float]] = {}
    places = [np.unique(_place_keys(riding, shift)) for shift in _SHIFTS]
    for key, buffer in rows.items():
        if key[0] != "vehicle":
            continue
        table = table_of(buffer)
        table = table[np.isin(table[:, 0], riding[:, 0])]
        on = np.zeros(len(table), dtype=np.bool_)
        for shift, own in zip(_SHIFTS, places, strict=True):
            on |= np.isin(_place_keys(table, shift), own)
        if on.any():
            times.setdefault(key[1], []).extend(table[on, 0].tolist())
    return times


def rides_of(times: Iterable[float], *, step: float) -> tuple[tuple[float, float], ...]:
    """Return first and last time of each run of times.

    Args:
        times: In any order, perhaps repeated [s].
        step: Of the log; a longer gap ends a run [s].
    """
    known = np.unique(np.fromiter(times, np.float64))
    cuts = np.flatnonzero(np.diff(known) > 1.5 * step) + 1
    return tuple((float(run[0]), float(run[-1])) for run in np.split(known, cuts) if len(run))


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


NEEDED = ("id", "x", "y", "angle")
"""Attributes that every row must have."""

_NUMBERS = {
    "x": nan,
    "y": nan,
    "z": 0.0,
    "angle": nan,
    "speed": nan,
    "slope": 0.0,
    "pos": nan,
}
"""Numbers of a row and what stands for one that is not logged."""

_PLACES = {"x": 1, "y": 2, "z": 3, "angle": 4, "speed": 5, "slope": 6, "pos": 9}
"""Where a packed row holds them."""

_SOME = 512
"""Number of rows whose text is read at once, while the processor still has it at hand."""

_MANY = 16_384
"""Number of rows that are packed at once."""


class BadRowsError(Exception):
    """A row holds something that cannot be.

    Args:
        runs: All rows that were not packed, with the times of their steps [s].
    """

    def __init__(self, runs: Sequence[tuple[float, Rows]]) -> None:
        super().__init__("a row cannot be packed")
        self.runs = runs


class RowPacker:
    """Collects rows by columns and packs them.

    Args:
        rows: Packed rows by road user; it is filled.
        lanes: Indices of lanes and edges; new ones are added.

    Attributes:
        changed: When a road user first had a type of its own, by kind and id [s].
        taken: Times of rows of people that name the vehicle they ride in, by its id [s].
    """

    def __init__(self, rows: RowsOfUsers, lanes: dict[str, int]) -> None:
        self.changed: dict[tuple[str, str], float] = {}
        self.taken: dict[str, list[float]] = {}
        self._rows = rows
        self._lanes = lanes
        self._lane_places: dict[Any, int] = {"": -1}
        self._users: dict[Key, int] = {}
        self._keys: list[Key] = []
        self._tables: list[Floats] = []
        self._read = 0
        self._nameless = False
        self._clear()

    def _clear(self) -> None:
        self._added: list[tuple[float, Rows]] = []
        self._runs: list[Rows] = []
        self._owners: list[int] = []
        self._places: list[int] = []
        self._times: list[float] = []

    @property
    def collected(self) -> int:
        """Number of rows that were added and not packed yet."""
        return len(self._times) + self._read

    def add(self, time: float, rows: Rows) -> None:
        """Add rows of a step at a time [s]; people who ride in a vehicle are left out.

        Raises:
            BadRowsError: If a row that was added holds an impossible number.
        """
        self._added.append((time, rows))
        if rows.kind != "vehicle" and "vehicle" in rows.columns:
            rows, vehicles = _afoot(rows)
            for vehicle in vehicles:
                self.taken.setdefault(vehicle, []).append(time)
        columns = rows.columns
        keys = zip(
            repeat(rows.kind), columns["id"], columns.get("type") or repeat(""), strict=False
        )
        self._owners += self._indices(cast(list[Key], list(keys)), time)
        self._places += self._lane_indices(rows)
        self._times += [time] * rows.count
        self._runs.append(rows)
        if len(self._times) >= _SOME:
            self._read_numbers()
        if self._read >= _MANY:
            self._pack()

    def flush(self) -> None:
        """Pack all rows that were added.

        Raises:
            BadRowsError: If one holds an impossible number; those before it are packed.
        """
        try:
            self._read_numbers()
        finally:
            self._pack()

    def _read_numbers(self) -> None:
        """Make a table of the rows that were added."""
        if not self._times:
            return
        table = np.empty((COLUMNS + 1, len(self._times))).T
        table[:, 0], table[:, 7], table[:, -1] = self._times, self._places, self._owners
        try:
            for name, place in _PLACES.items():
                table[:, place] = self._column(name, float, _NUMBERS[name])
            table[:, 8] = self._column("signals", int, -1)
            good = bool(_packing_possible(table).all()) and not self._nameless
        except (ValueError, OverflowError):
            good = False
        added = self._added
        self._clear()
        if not good:
            raise BadRowsError(added)
        self._tables.append(table)
        self._read += len(table)

    def forget_users(self) -> None:
        """Begin anew with empty rows, after someone else has taken them."""
        self._users.clear()
        self._keys.clear()

    def _indices(self, keys: list[Key], time: float) -> list[int]:
        """Return the indices of road users, under whichever type a row at a time [s] names them."""
        try:
            return list(map(self._users.__getitem__, keys))
        except KeyError:
            for key in keys:
                if key not in self._users:
                    self._users[key] = self._index(user_key(*key))
                    self.note(key, time)
            return list(map(self._users.__getitem__, keys))

    def note(self, key: Key, time: float) -> None:
        """Note that a row at a time [s] names a road user by a type, which may be its own."""
        if key[2].endswith(f"@{key[1]}"):
            self.changed.setdefault(key[:2], time)

    def rides(self, kind: str, attributes: Mapping[str, str], time: float) -> bool:
        """Note what a row tells beside its numbers; return whether it is of somebody who rides.

        Args:
            kind: `vehicle`, `person` or `container`.
            attributes: Of the row; it has an id.
            time: [s].
        """
        get = attributes.get
        self.note((kind, attributes["id"], get("type", "")), time)
        vehicle = get("vehicle")
        if kind == "vehicle" or not vehicle or get("stage", "driving") != "driving":
            return False
        if kind == "person":
            self.taken.setdefault(vehicle, []).append(time)
        return True

    def _index(self, key: Key) -> int:
        """Return the index of a road user, who may be new."""
        if key not in self._users:
            self._nameless = self._nameless or not key[1]
            self._users[key] = len(self._keys)
            self._keys.append(key)
            self._rows.setdefault(key, array("d"))
        return self._users[key]

    def _lane_indices(self, rows: Rows) -> list[int]:
        """Return the indices of lanes, or else of edges; -1 where a row has neither."""
        lanes, edges = rows.columns.get("lane"), rows.columns.get("edge")
        if lanes is None or edges is None:
            names: list[Any] = lanes or edges or [""] * rows.count
        else:
            names = [lane or edge for lane, edge in zip(lanes, edges, strict=True)]
        try:
            return list(map(self._lane_places.__getitem__, names))
        except KeyError:
            for name in names:
                if name not in self._lane_places:
                    self._lane_places[name] = self._lanes.setdefault(name, len(self._lanes))
            return list(map(self._lane_places.__getitem__, names))

    def _column(self, name: str, read: Callable[[Any], float], missing: float) -> Floats:
        """Return the numbers of all rows, (n,).

        Args:
            name: The attribute.
            read: Makes a number of what is in a row.
            missing: What stands for a number that is not logged.
        """
        every = len(self._times)
        if not any(name in rows.columns for rows in self._runs):
            return np.full(every, missing)
        cells: list[Any] = []
        for rows in self._runs:
            own = rows.columns.get(name)
            if own and isinstance(own[0], str) and not is_plain("".join(own)):
                raise ValueError(f"{name} is not written in digits")
            cells += own or [missing] * rows.count
        if cells[0] == cells[-1] and cells.count(cells[0]) == every:
            return np.full(every, read(cells[0]))
        return np.fromiter(map(read, cells), np.float64, every)

    def _pack(self) -> None:
        """Add rows to those of their road users."""
        if not self._tables:
            return
        table = np.concatenate(self._tables)
        self._tables.clear()
        self._read = 0
        owners = table[:, -1].astype(np.int64)
        order = np.argsort(owners, kind="stable")
        owners, table = owners[order], table[order, :COLUMNS]
        starts = [0, *(np.flatnonzero(np.diff(owners)) + 1).tolist()]
        for start, end in zip(starts, [*starts[1:], len(owners)], strict=True):
            self._rows[self._keys[owners[start]]].frombytes(table[start:end].tobytes())


def _packing_possible(table: Floats) -> Bools:
    """Return which rows hold only possible numbers, (n,); NaN is impossible where it counts."""
    x, y, z, angle, slope, signals = table[:, [1, 2, 3, 4, 6, 8]].T
    far, high, turn = COORDINATE.high, HEIGHT.high, ANGLE.high
    good = (np.abs(x) <= far) & (np.abs(y) <= far) & (np.abs(z) <= high)
    good &= (np.abs(angle) <= turn) & (np.abs(slope) <= turn)
    return np.asarray(good & (signals >= -1) & (signals <= SIGNAL_BITS.high))


def _afoot(rows: Rows) -> tuple[Rows, frozenset[str]]:
    """Return rows without those of people and containers that ride, and in which vehicles."""
    stages = rows.columns.get("stage") or repeat("driving")
    keep = [
        not (vehicle and stage == "driving")
        for vehicle, stage in zip(rows.columns["vehicle"], stages, strict=False)
    ]
    if all(keep):
        return rows, frozenset()
    ridden = (str(name) for name, on in zip(rows.columns["vehicle"], keep, strict=True) if not on)
    columns = {
        name: cast(Cells, list(compress(cells, keep))) for name, cells in rows.columns.items()
    }
    afoot = Rows(rows.kind, sum(keep), columns, rows.line, rows.lines)
    return afoot, frozenset(ridden) if rows.kind == "person" else frozenset()
