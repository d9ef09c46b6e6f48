"""Pack rows of a vehicle log that come by columns, many at a time."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from itertools import compress, repeat
from math import nan
from typing import Any, cast

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.sumo.bounds import ANGLE, COORDINATE, HEIGHT, SIGNAL_BITS
from sumo3dviz_pt.sumo.formats.format import Cells, Rows
from sumo3dviz_pt.sumo.traces import COLUMNS, Key, RowsOfUsers, user_key
from sumo3dviz_pt.sumo.values import is_plain

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
    """

    def __init__(self, rows: RowsOfUsers, lanes: dict[str, int]) -> None:
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
            rows = _afoot(rows)
        columns = rows.columns
        keys = zip(
            repeat(rows.kind), columns["id"], columns.get("type") or repeat(""), strict=False
        )
        self._owners += self._indices(cast(list[Key], list(keys)))
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
            good = bool(_possible(table).all()) and not self._nameless
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

    def _indices(self, keys: list[Key]) -> list[int]:
        """Return the indices of road users, under whichever type a row names them."""
        try:
            return list(map(self._users.__getitem__, keys))
        except KeyError:
            for key in keys:
                if key not in self._users:
                    self._users[key] = self._index(user_key(*key))
            return list(map(self._users.__getitem__, keys))

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


def _possible(table: Floats) -> Bools:
    """Return which rows hold only possible numbers, (n,); NaN is impossible where it counts."""
    x, y, z, angle, slope, signals = table[:, [1, 2, 3, 4, 6, 8]].T
    far, high, turn = COORDINATE.high, HEIGHT.high, ANGLE.high
    good = (np.abs(x) <= far) & (np.abs(y) <= far) & (np.abs(z) <= high)
    good &= (np.abs(angle) <= turn) & (np.abs(slope) <= turn)
    return np.asarray(good & (signals >= -1) & (signals <= SIGNAL_BITS.high))


def _afoot(rows: Rows) -> Rows:
    """Return rows without those of people and containers that ride in a vehicle."""
    stages = rows.columns.get("stage") or repeat("driving")
    keep = [
        not (vehicle and stage == "driving")
        for vehicle, stage in zip(rows.columns["vehicle"], stages, strict=False)
    ]
    if all(keep):
        return rows
    columns = {
        name: cast(Cells, list(compress(cells, keep))) for name, cells in rows.columns.items()
    }
    return Rows(rows.kind, sum(keep), columns, rows.line, rows.lines)
