"""Vehicle logs that are tables: a row of the table is a road user at one time.

SUMO writes persons and containers into the columns of vehicles. They have an edge and no lane. If
the log has a `tag`, it stands in a column that the first vehicle gave another name, because
SUMO fills the columns of a person one after the other. So only the columns that all kinds share are
read of persons and containers.
"""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from sumo3dviz_pt.sumo.formats.format import (
    ATTRIBUTES,
    KINDS,
    STEP,
    Cells,
    ElementSink,
    LogFormat,
    Rows,
)
from sumo3dviz_pt.sumo.stream import Element

_PREFIX = re.compile(r"^(?:timestep_)?(?:(vehicle|person|container)_)?(?=\w)")

_OWN_TYPES = {"DEFAULT_PEDTYPE": "person", "DEFAULT_CONTAINERTYPE": "container"}
"""SUMO's types that tell a row's kind."""

_SHARED = frozenset({"id", "x", "y", "z", "angle", "type", "speed", "pos", "edge", "slope"})
"""Columns that hold the same for all kinds."""

_WORDS = frozenset({"time", "id", "x", "y", "z", "angle", "type", "speed", "pos", "lane", "edge"})
"""Columns in which a tag is never found."""


@dataclass(frozen=True, slots=True)
class Header:
    """The columns of a table.

    Attributes:
        names: SUMO's names of attributes, (n,); the time of a step is `time`.
        kind: What rows are that nothing tells apart: `vehicle`, `person` or `container`.
    """

    names: tuple[str, ...]
    kind: str = "vehicle"

    @property
    def is_log(self) -> bool:
        """Whether these may be the columns of a vehicle log."""
        return {"time", "id", "x", "y"} <= set(self.names) or self.names == ("time",)


def header_of(columns: Iterable[str]) -> Header:
    """Return what a table's columns mean; SUMO puts the names of elements before some or all."""
    columns = list(columns)
    kinds = [match[1] for name in columns if (match := _PREFIX.match(name)) and match[1]]
    names = tuple(_PREFIX.sub("", name) for name in columns)
    if names == ("time",) and columns == ["time"]:
        names = ()  # a single column of this name is nothing of SUMO's
    return Header(names, kinds[0] if kinds else "vehicle")


@dataclass(frozen=True, slots=True)
class Block:
    """Successive rows of a table, by columns.

    Attributes:
        columns: Values by SUMO's names of attributes, (n,) each.
        line: Line of the first row in the file, or its number, from 1.
    """

    columns: Mapping[str, Cells]
    line: int

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.columns["time"])


@dataclass(frozen=True, slots=True)
class Run:
    """Successive rows of one time and one kind.

    Attributes:
        time: Time of the step as text.
        begins: Whether a step begins here.
        rows: The rows; None where nobody is there.
        line: Line of the first row in the file.
    """

    time: str
    begins: bool
    rows: Rows | None
    line: int


class TableFormat(LogFormat):
    """A format whose rows hold the time and the road user; derived formats give its blocks."""

    @abstractmethod
    def header(self, file: Path) -> Header:
        """Return the columns of a file that is recognised."""

    @abstractmethod
    def has_lanes(self, file: Path) -> bool:
        """Whether rows near the beginning name a lane; those of mesoscopic runs never do."""

    @abstractmethod
    def blocks(self, file: Path) -> Iterator[Block]:
        """Yield the table; errors are those of `elements`."""

    def read(self, file: Path, sink: ElementSink) -> None:
        """Pass steps and rows to a sink."""
        line = 1
        sink.line = lambda: line
        for run in self._runs(file):
            line = run.line
            if run.begins:
                sink.take(STEP, {"time": run.time})
            if run.rows is not None:
                sink.take_rows(run.rows)

    def elements(self, file: Path) -> Iterator[Element]:
        """Yield steps and rows as elements."""
        for run in self._runs(file):
            if run.begins:
                yield Element(STEP, {"time": run.time}, 1, file, run.line)
            for row in range(run.rows.count if run.rows else 0):
                rows = cast(Rows, run.rows)
                yield Element(rows.kind, rows.attributes(row), 2, file, rows.line_of(row))

    def _runs(self, file: Path) -> Iterator[Run]:
        """Yield the rows by step and kind."""
        kind, lanes = self.header(file).kind, self.has_lanes(file)
        last: str | float | None = None
        for block in self.blocks(file):
            times = block.columns["time"]
            kinds = _kinds(block, kind, lanes=lanes)
            for start, end in _spans(times, kinds):
                begins = times[start] != last
                last = times[start]
                rows = _rows(block, start, end, kinds[start])
                yield Run(str(last), begins, rows, block.line + start)


def _rows(block: Block, start: int, end: int, kind: str) -> Rows | None:
    """Return some rows of a block, or None if there is nobody in them.

    Args:
        block: Where they are.
        start: The first one.
        end: After the last one.
        kind: Their kind; empty for steps without anybody.
    """
    if not kind:
        return None
    tagged = "lane" not in block.columns and "stage" in block.columns
    names = ATTRIBUTES if kind == "vehicle" or tagged else _SHARED
    columns = {name: cells[start:end] for name, cells in block.columns.items() if name in names}
    return Rows(kind, end - start, columns, block.line + start)


def _spans(times: Sequence[str | float], kinds: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Yield where rows of one time and kind begin and end."""
    start = 0
    before = (times[0], kinds[0]) if times else None
    for at, now in enumerate(zip(times, kinds, strict=True)):
        if now != before:
            yield start, at
            start, before = at, now
    if times:
        yield start, len(times)


def _kinds(block: Block, kind: str, *, lanes: bool) -> list[str]:
    """Return the kind of every row, empty where a row holds only the time of a step, (n,).

    Args:
        block: The rows.
        kind: What rows are that nothing tells apart.
        lanes: Whether vehicles of this log name a lane.
    """
    columns = block.columns
    if "id" not in columns:
        return [""] * block.count
    lane_of = columns.get("lane") or [""] * block.count
    kinds = ["vehicle"] * block.count
    if "" not in cast(list[str], lane_of):
        return kinds
    telling = [
        cells
        for name, cells in columns.items()
        if name not in _WORDS and not KINDS.isdisjoint(cast(list[str], cells))
    ]
    ids, types, edges = (columns.get(name) or lane_of for name in ("id", "type", "edge"))
    for row, lane in enumerate(lane_of):
        if lane:
            continue
        found = [cells[row] for cells in telling if cells[row] in KINDS]
        walks = "person" if lanes and edges[row] else kind
        kinds[row] = str(found[0]) if found else _OWN_TYPES.get(str(types[row]), walks)
        if not ids[row]:
            kinds[row] = ""
    return kinds
