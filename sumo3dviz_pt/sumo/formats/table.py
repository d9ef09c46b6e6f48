"""Vehicle logs that are tables: text with any separator, or Parquet.

A row of the table is a road user at one time. Text may be plain or gzipped; reading Parquet needs
the package pyarrow.

SUMO writes persons and containers into the columns of vehicles. They have an edge and no lane. If
the log has a `tag`, it stands in a column that the first vehicle gave another name, because SUMO
fills the columns of a person one after the other. So only the columns that all kinds share are read
of persons and containers.
"""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from sumo3dviz_pt.errors import InputError, MissingExtraError, cut
from sumo3dviz_pt.files.atomic import open_plain
from sumo3dviz_pt.sumo.formats.format import (
    ATTRIBUTES,
    KINDS,
    STEP,
    Cells,
    ElementSink,
    LogFormat,
    Rows,
)
from sumo3dviz_pt.sumo.stream import Element, TruncatedError, unpacked

_PREFIX = re.compile(r"^(?:timestep_)?(?:(vehicle|person|container)_)?(?=\w)")

_OWN_TYPES = {"DEFAULT_PEDTYPE": "person", "DEFAULT_CONTAINERTYPE": "container"}
"""SUMO's types that tell a row's kind."""

_SHARED = frozenset({"id", "x", "y", "z", "angle", "type", "speed", "pos", "edge", "slope"})
"""Columns that hold the same for all kinds."""

_FOREIGN = frozenset({"length", "width", "height", "class", "vx", "vy", "heading", "yaw"})
"""Columns that no log of SUMO has: a table with them is one of another tool."""

_WORDS = frozenset({"time", "id", "x", "y", "z", "angle", "type", "speed", "pos", "lane", "edge"})
"""Columns in which a tag is never found."""


@dataclass(frozen=True, slots=True)
class Header:
    """The columns of a table.

    Attributes:
        names: SUMO's names of attributes, (n,); the time of a step is `time`.
        kind: What rows are that nothing tells apart: `vehicle`, `person` or `container`.
        prefixed: Whether names of elements stand before some of them, as SUMO puts them.
    """

    names: tuple[str, ...]
    kind: str = "vehicle"
    prefixed: bool = False

    @property
    def is_log(self) -> bool:
        """Whether these may be the columns of a vehicle log."""
        names = set(self.names)
        plain = "angle" in names and not names & _FOREIGN
        return ({"time", "id", "x", "y"} <= names and (self.prefixed or plain)) or names == {"time"}


def header_of(columns: Iterable[str]) -> Header:
    """Return what a table's columns mean; SUMO puts the names of elements before some or all."""
    columns = list(columns)
    kinds = [match[1] for name in columns if (match := _PREFIX.match(name)) and match[1]]
    names = tuple(_PREFIX.sub("", name) for name in columns)
    if names == ("time",) and columns == ["time"]:
        names = ()  # a single column of this name is nothing of SUMO's
    prefixed = "timestep_time" in columns or bool(kinds)
    return Header(names, kinds[0] if kinds else "vehicle", prefixed)


@dataclass(frozen=True, slots=True)
class RowBlock:
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
class RowRun:
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
    def blocks(self, file: Path) -> Iterator[RowBlock]:
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

    def _runs(self, file: Path) -> Iterator[RowRun]:
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
                yield RowRun(str(last), begins, rows, block.line + start)


def _rows(block: RowBlock, start: int, end: int, kind: str) -> Rows | None:
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


def _kinds(block: RowBlock, kind: str, *, lanes: bool) -> list[str]:
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
        stated = [cells[row] for cells in telling if cells[row] in KINDS]
        walks = "person" if lanes and edges[row] else kind
        kinds[row] = str(stated[0]) if stated else _OWN_TYPES.get(str(types[row]), walks)
        if not ids[row]:
            kinds[row] = ""
    return kinds


_HEAD = 8192
"""Number of bytes in which the first line must end."""

_MARK = "\ufeff"
_SEPARATOR = re.compile(r'[^\w"]+')
_FIRST = re.compile(rb'[^\w<]{0,6}"?[A-Za-z]')

_CSV_NUMBERS = {"z": "0", "slope": "0", "speed": "nan", "pos": "nan", "signals": "-1"}
"""What stands for an empty cell, as such a number need not be logged."""

_PART = 1 << 16
"""Number of bytes that are cut into cells at once."""

_LONGEST = 1 << 20
"""Longest line that is read [bytes]."""

_PEEK = 20
"""Number of blocks in which a lane must be named."""


@dataclass(frozen=True, slots=True)
class _Way:
    """How a table is written.

    Attributes:
        header: Its columns.
        separator: What stands between cells.
    """

    header: Header
    separator: str


class CsvFormat(TableFormat):
    """Text with a header line, as SUMO writes it for names that end in `.csv`."""

    def recognises(self, file: Path) -> bool:
        """Whether the first line names the columns of a vehicle log."""
        way = _way(file)
        return way is not None and way.header.is_log

    def header(self, file: Path) -> Header:
        """Return the columns of a file that is recognised."""
        return _known(file).header

    def has_lanes(self, file: Path) -> bool:
        """Whether rows near the beginning name a lane."""
        try:
            return any(
                any(block.columns.get("lane", ())) for block in islice(self.blocks(file), _PEEK)
            )
        except InputError:
            return False

    def blocks(self, file: Path) -> Iterator[RowBlock]:
        """Yield the rows of the table in order."""
        way = _known(file)
        rest, line = b"", 1
        try:
            for chunk in unpacked(file):
                data = rest + chunk
                whole = data.rfind(b"\n") + 1
                rest = data[whole:]
                if len(rest) > _LONGEST:
                    message = "the line is longer than 1 MB; no vehicle log has such lines"
                    raise InputError(message, file=file, line=line + data.count(b"\n", 0, whole))
                for part in _parts(data, whole):
                    yield from _blocks(part, way, file, line)
                    line += part.count(b"\n")
        except EOFError:
            raise _broken(file, line) from None
        except (OSError, zlib.error) as error:
            raise InputError(f"cannot be read ({error}); copy it again", file=file) from error
        if rest:
            raise _broken(file, line)


def _way(file: Path) -> _Way | None:
    """Return how a file is written, or None if it is no table with a header."""
    try:
        with open_plain(file) as stream:
            head = stream.read(_HEAD)
        if head.startswith(b"\x1f\x8b"):
            with gzip.open(file, "rb") as packed:
                head = packed.read1(_HEAD)
        if not _FIRST.match(head) or b"\0" in head:
            return None
        line = head.split(b"\n")[0].decode().rstrip("\r")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError, InputError):
        return None
    match = _SEPARATOR.search(line.removeprefix(_MARK))
    separator = match[0] if match else ";"
    names = line.removeprefix(_MARK).split(separator)
    return _Way(header_of(name.strip('"') for name in names), separator)


def _known(file: Path) -> _Way:
    """Return how a file is written that must be a log."""
    way = _way(file)
    if way is None or not way.header.is_log:
        raise InputError(
            "its first line does not name the columns of a vehicle log (time, id, x, y, ...); give"
            " what sumo writes for --fcd-output (with --output.column-header plain), and none of"
            " its other outputs",
            file=file,
        )
    return way


def _broken(file: Path, line: int) -> TruncatedError:
    return TruncatedError(
        "the file ends in the middle; copy or write it again", file=file, line=line
    )


def _parts(data: bytes, end: int) -> Iterator[bytes]:
    """Yield the lines up to a place in parts that stay in a processor's cache."""
    start = 0
    while start < end:
        cut = data.rfind(b"\n", start, start + _PART) + 1 or data.find(b"\n", start) + 1
        yield data[start:cut]
        start = cut


def _blocks(data: bytes, way: _Way, file: Path, line: int) -> Iterator[RowBlock]:
    """Yield the rows of some whole lines.

    Args:
        data: The lines, the header among them if they are the first.
        way: How the table is written.
        file: For messages.
        line: Number of the first line.
    """
    try:
        text = data.decode()
    except UnicodeDecodeError:
        raise InputError("is not written in UTF-8; write it again", file=file, line=line) from None
    if line == 1:
        _, _, text = text.partition("\n")
        line = 2
    if "\r" in text:
        text = text.replace("\r\n", "\n")
    if text:
        cells = _csv_cells(text, way) or _cells_one_by_one(text, way, file, line)
        names = way.header.names
        columns = {name: _filled(name, cells[at :: len(names)]) for at, name in enumerate(names)}
        yield RowBlock(columns, line)


def _csv_cells(text: str, way: _Way) -> list[str] | None:
    """Return the cells of all rows one after the other; None where a row is irregular."""
    width, count = len(way.header.names), text.count("\n")
    if '"' in text:
        return None
    if width == 1:
        return text.splitlines()
    # A mark at the end of each line shows whether all lines have the same number of cells.
    cells = text.replace("\n", f"\n{way.separator}").split(way.separator)
    cells.pop()
    lasts = "".join(cells[width - 1 :: width])
    if len(cells) != width * count or lasts.count("\n") != count:
        return None
    cells[width - 1 :: width] = lasts.split("\n")[:-1]
    return cells


def _cells_one_by_one(text: str, way: _Way, file: Path, line: int) -> list[str]:
    """Return the cells of all rows, which may be quoted.

    Args:
        text: Whole lines.
        way: How the table is written.
        file: For messages.
        line: Number of the first line.

    Raises:
        InputError: If a row has too many or too few cells.
    """
    cells: list[str] = []
    width = len(way.header.names)
    plain = partial(csv.reader, delimiter=way.separator) if len(way.separator) == 1 else None
    for number, each in enumerate(text.splitlines(), start=line):
        row = next(plain([each]), []) if plain else each.split(way.separator)
        if len(row) != width:
            shown = cut(each)
            raise InputError(
                f"the row {shown!r} has {len(row)} cells, and the header {width};"
                " run the simulation again",
                file=file,
                line=number,
            )
        cells += row
    return cells


def _filled(name: str, cells: list[str]) -> Cells:
    """Return a column in which numbers stand for empty cells that need not be logged."""
    missing = _CSV_NUMBERS.get(name)
    if missing is None or "" not in cells:
        return cells
    return [cell or missing for cell in cells]


_MAGIC = b"PAR1"
_TAIL = 8  # bytes: the length of the footer and the magic number again
_BATCH = 65_536
_NAMES = (b"\x04time", b"\x02id", b"\x01x", b"\x01y", b"\x05angle")
"""SUMO's plain names of columns as they stand in a footer, each behind its length."""

_PARQUET_NUMBERS: dict[str, float] = {
    "z": 0.0,
    "slope": 0.0,
    "signals": -1,
    **dict.fromkeys(("x", "y", "angle", "speed", "pos"), float("nan")),
}
"""What stands for a number that a row does not have."""


class ParquetFormat(TableFormat):
    """A table by columns, as SUMO writes it for names that end in `.parquet`."""

    def recognises(self, file: Path) -> bool:
        """Whether a file is Parquet with the columns of a log, judging without pyarrow."""
        try:
            footer = _footer(file)
        except (OSError, InputError):
            return False
        if footer is None:
            return False
        if not footer or b"timestep_time" in footer:
            return True
        return all(name in footer for name in _NAMES)

    def header(self, file: Path) -> Header:
        """Return the columns of a file that is recognised."""
        return header_of(_opened(file).schema_arrow.names)

    def has_lanes(self, file: Path) -> bool:
        """Whether any row names a lane."""
        parquet = _opened(file)
        places = [n for n, name in enumerate(self.header(file).names) if name == "lane"]
        groups = range(parquet.metadata.num_row_groups)
        for column in (parquet.metadata.row_group(g).column(n) for g in groups for n in places):
            known = column.statistics
            if known is None or not known.has_null_count or known.null_count < column.num_values:
                return True
        return False

    def blocks(self, file: Path) -> Iterator[RowBlock]:
        """Yield the rows of the table in order."""
        parquet = _opened(file)
        names = self.header(file).names
        if not self.header(file).is_log:
            raise InputError(
                "is a Parquet file without the columns of a vehicle log (time, id, x, y);"
                " name the right file",
                file=file,
            )
        wanted = [
            own
            for own, name in zip(parquet.schema_arrow.names, names, strict=True)
            if name in ATTRIBUTES or name in ("time", "tag")
        ]
        line = 1
        arrow: Any = _arrow()
        _check_types(parquet.schema_arrow, wanted, file)
        try:
            for batch in parquet.iter_batches(_BATCH, columns=wanted):
                own = header_of(batch.schema.names).names
                columns = {
                    name: _parquet_cells(name, column)
                    for name, column in zip(own, batch.columns, strict=True)
                }
                yield RowBlock(columns, line)
                line += batch.num_rows
        except (OSError, arrow.ArrowException) as error:
            raise InputError(
                f"cannot be read ({error}); write it again", file=file, line=line
            ) from error


def _check_types(schema: Any, wanted: list[str], file: Path) -> None:
    """Refuse columns of lists and other things within things."""
    for name in wanted:
        kind = schema.field(name).type
        if _arrow().types.is_nested(kind):
            message = f"the column {name} holds {kind}, and should hold numbers or text"
            raise InputError(message, file=file)


def _parquet_cells(name: str, column: Any) -> Cells:
    """Return a column as a list without nulls."""
    missing = _PARQUET_NUMBERS.get(name)
    if name == "time":
        cells: Cells = column.to_numpy(zero_copy_only=False).tolist()
        return cells
    if missing is not None:
        if column.null_count == len(column):
            return [missing] * len(column)
        filled = column.fill_null(missing) if column.null_count else column
        numbers: list[float] = filled.to_numpy(zero_copy_only=False).tolist()
        return numbers
    # Few texts repeat many times; each is made once.
    coded = column.cast("string").fill_null("").dictionary_encode()
    texts: list[str] = coded.dictionary.to_pylist()
    return [texts[code] for code in coded.indices.to_numpy().tolist()]


def _footer(file: Path) -> bytes | None:
    """Return the description of a Parquet file, empty if it is broken; None for other files."""
    with open_plain(file) as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            return None
        size = stream.seek(0, 2)
        if size < 2 * len(_MAGIC) + _TAIL:
            return b""
        stream.seek(size - _TAIL)
        tail = stream.read(_TAIL)
        length = int.from_bytes(tail[:4], "little")
        if tail[4:] != _MAGIC or length + _TAIL > size:
            return b""
        stream.seek(size - _TAIL - length)
        return stream.read(length)


def _arrow() -> ModuleType:
    """Return pyarrow.

    Raises:
        MissingExtraError: If it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError("vehicle logs in Parquet need pyarrow", extra="parquet") from error
    module: ModuleType = pyarrow
    return module


def _opened(file: Path) -> Any:
    """Return a Parquet file, open."""
    arrow: Any = _arrow()
    if not _footer(file):
        raise TruncatedError("the file ends in the middle; copy or write it again", file=file)
    try:
        return arrow.parquet.ParquetFile(file)
    except (OSError, arrow.ArrowException) as error:
        raise InputError(f"cannot be read ({error}); write it again", file=file) from error
