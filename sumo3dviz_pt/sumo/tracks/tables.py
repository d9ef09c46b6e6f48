"""Reads tables of trajectories: text with any separator, plain or gzipped, or Parquet.

The line that names the columns is the first that makes a table of trajectories; files of Vissim
have remarks before it. Only columns that something is made from are kept, numbers as numbers.
Text is UTF-8; what is not is read as old Windows programs write it.
"""

from __future__ import annotations

import codecs
import csv
import datetime as dt
import gzip
import io
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import Any, TextIO, cast

import numpy as np

from sumo3dviz_pt.errors import ConfigError, InputError, MissingExtraError, cut
from sumo3dviz_pt.files.atomic import open_plain
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.traffic import TableChoices
from sumo3dviz_pt.sumo.tracks.columns import Form, form_of, missing_in
from sumo3dviz_pt.sumo.tracks.headless import names_without_header
from sumo3dviz_pt.sumo.values import is_plain, parse_time

_HEAD = 16_384
"""Number of characters in which the columns must be named."""

_BLOCK = 50_000
_LONGEST = 1 << 16  # characters of a row
_SHOWN = 8  # columns that a message names
_PACKED, _PARQUET = b"\x1f\x8b", b"PAR1"
_SEPARATORS = (";", "\t", ",", "|")
_MARK = re.compile(r"\$\w+:")  # before the columns of Vissim's records, in any language
_WINDOWS = "windows-1252 where it is no UTF-8"
_WORDS = frozenset({"id", "class"})
_NOTHING = frozenset({"", "nan", "na", "n/a", "null", "none", "-"})
_RATE = re.compile(r"frame\s*rate\D{1,6}(\d+(?:\.\d+)?)", re.IGNORECASE)
_COMMA = re.compile(r"[+-]?\d+,\d+")


@dataclass(frozen=True, slots=True, eq=False)
class Words:
    """A column of text in which few words come often.

    Attributes:
        codes: Index of each row's word, (n,).
        texts: All words, in order of first appearance.
    """

    codes: Ints
    texts: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """What a table holds, by one of `model.numbers.TableRole`; units are the table's.

    Attributes:
        numbers: NaN where a cell is empty, (n,) each; a time that is a date or a clock's is in
            seconds since the first day's midnight.
        words: Ids and classes.
        clock: Whether times are dates or a clock's.
    """

    numbers: Mapping[str, Floats]
    words: Mapping[str, Words]
    clock: bool = False


@dataclass(frozen=True, slots=True)
class Table:
    """A file that is a table of trajectories.

    Attributes:
        file: The file.
        names: Of its columns.
        form: What these mean.
        separator: What stands between cells; empty for Parquet, a blank for any white space.
        line: Of the names, from 1; 0 where no line names them.
    """

    file: Path
    names: tuple[str, ...]
    form: Form
    separator: str
    line: int


def table_in(file: Path, choices: TableChoices) -> Table | None:
    """Return how a file is to be read as a table of trajectories; None if it is none.

    Args:
        file: Any file.
        choices: What a user says of it.

    Raises:
        ConfigError: If a user names a column that it has not.
        MissingExtraError: If it is Parquet, and pyarrow is not installed.
    """
    try:
        with open_plain(file) as stream:
            head = stream.read(4)
        if head == _PARQUET:
            names = tuple(_parquet(file).schema_arrow.names)
            form = form_of(names, choices)
            return None if form is None else Table(file, names, form, "", 1)
        if head.startswith(b"<"):
            return None
        with _text_of(file) as text:
            lines = text.read(_HEAD).splitlines()
    except (OSError, EOFError, zlib.error, InputError):
        return None
    return _table(file, lines, choices)


def _table(file: Path, lines: list[str], choices: TableChoices) -> Table | None:
    """Return the table whose columns one of the first lines names."""
    wrong: ConfigError | None = None
    if known := names_without_header(lines[:-1]):
        form = form_of(known, choices)
        return None if form is None else Table(file, known, form, " ", 0)
    for number, line in enumerate(lines, start=1):
        names, separator = _split(_MARK.sub("", line, count=1).lstrip("#\ufeff "))
        if len(names) < 4 or not any(name[:1].isalpha() for name in names):
            continue
        try:
            form = form_of(names, choices)
        except ConfigError as error:
            wrong = wrong or error
            continue
        if form is not None:
            rate = next((float(m[1]) for m in map(_RATE.search, lines[:number]) if m), None)
            if rate and not choices.rate:
                form = replace(form, rate=rate)
            return Table(file, tuple(names), form, separator, number)
    if wrong is not None:
        raise wrong
    return None


def why_no_table(file: Path, choices: TableChoices) -> str:
    """Return what a file lacks that looks like a table; empty for anything else."""
    try:
        with _text_of(file) as text:
            lines = text.read(_HEAD).splitlines()
    except (OSError, EOFError, zlib.error, InputError):
        return ""
    if any("\0" in line for line in lines):
        return ""
    marked = next((line for line in lines if _MARK.match(line)), "")
    texts = [_MARK.sub("", marked)] if marked else lines
    rows = [_split(line.lstrip("#\ufeff "))[0] for line in texts]
    named = next((row for row in rows if len(row) > 2 and all(c[:1].isalpha() for c in row)), [])
    values = [row for row in rows if len(row) >= len(named) and any(c[:1].isdigit() for c in row)]
    if not named or any("<" in name for name in named) or not (values or marked):
        return ""
    columns = ", ".join(map(cut, named[:_SHOWN])) + (", ..." if len(named) > _SHOWN else "")
    missing = missing_in(named, choices)
    if marked and {"x", "y"} & set(missing):
        why = "these records have no COORDFRONT and COORDREAR"
        why += "; add them in Vissim's list of attributes"
        return f"is a table with the columns {columns}: {why}"
    why = f"none tells {' or '.join(missing) or 'anything'}"
    why += "; rename the one that does, or name it in a scene's scenario.trajectories.columns"
    return f"is a table with the columns {columns}: {why}"


def _split(line: str) -> tuple[list[str], str]:
    """Return the cells of a line and what separates them."""
    separator = max(_SEPARATORS, key=line.count)
    if not line.count(separator):
        return line.split(), " "
    names = next(csv.reader([line], delimiter=separator), [])
    return [name.strip() for name in names], separator


def cells_of(table: Table) -> Cells:
    """Read a table.

    Raises:
        InputError: If a row has too few cells, a number or a time is none, or nothing is there.
    """
    parquet = not table.separator
    blocks = _parquet_blocks(table) if parquet else _text_blocks(table)
    collected = _Collected(table)
    for first, rows in blocks:
        collected.add(first, rows)
    return collected.cells()


class _Collected:
    """Cells block by block."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self._roles = list(table.form.columns)
        self._numbers: dict[str, list[Floats]] = {}
        self._codes: dict[str, list[Ints]] = {}
        self._known: dict[str, dict[str, int]] = {role: {} for role in _WORDS}
        self._clock: _Clock | None = None
        self._step = 0 if table.form.repeated else 1

    def add(self, first: int, columns: Sequence[Sequence[Any]]) -> None:
        """Add the columns of some rows, the first of which stands in a line of the file."""
        for role, cells in zip(self._roles, columns, strict=True):
            if role in _WORDS:
                known = self._known[role]
                codes = [known.setdefault(str(cell).strip(), len(known)) for cell in cells]
                self._codes.setdefault(role, []).append(np.array(codes, dtype=np.int64))
            elif role == "time" and self._is_clock(cells):
                self._add_clock(first, cells)
            else:
                self._numbers.setdefault(role, []).append(self._numbers_of(role, cells, first))

    def _is_clock(self, cells: Sequence[Any]) -> bool:
        """Whether times are dates or a clock's, by the first."""
        if self._clock is None and not self._numbers.get("time"):
            start = next(iter(cells), "")
            if not isinstance(start, str) or ":" in start or start.strip().count("-") == 2:
                self._clock = None if isinstance(start, int | float) else _Clock()
        return self._clock is not None

    def _add_clock(self, first: int, cells: Sequence[Any]) -> None:
        clock = self._clock or _Clock()
        seconds = []
        for row, cell in enumerate(cells):
            try:
                seconds.append(clock.seconds(cell))
            except ValueError:
                raise self._wrong("time", cell, first + self._step * row, "a time") from None
        self._numbers.setdefault("time", []).append(np.array(seconds))

    def _numbers_of(self, role: str, cells: Sequence[Any], first: int) -> Floats:
        """Return cells as numbers; NaN where they are empty."""
        if not isinstance(next(iter(cells), ""), str):
            return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
        if is_plain("".join(cells)):
            try:
                return np.array([*map(float, cells)])
            except ValueError:
                pass  # one by one, to name the line
        return np.array(
            [self._number(role, cell, first + self._step * n) for n, cell in enumerate(cells)]
        )

    def _number(self, role: str, cell: str, line: int) -> float:
        text = cell.strip()
        if text.lower() in _NOTHING:
            return np.nan
        if self._table.separator != "," and _COMMA.fullmatch(text):
            text = text.replace(",", ".")
        try:
            return float(text if is_plain(text) else "")
        except ValueError:
            raise self._wrong(role, cell, line, "a number") from None

    def _wrong(self, role: str, cell: object, line: int, what: str) -> InputError:
        name = self._table.form.columns[role].name
        message = (
            f"{cut(str(cell))!r} in the column {name!r} is not {what}; correct it, or say in"
            f" scenario.trajectories.columns which column holds {role!r}"
        )
        return InputError(message, file=self._table.file, line=line)

    def cells(self) -> Cells:
        """Return all that was added."""
        if not self._codes.get("id"):
            raise InputError("the table has no rows; write it again", file=self._table.file)
        return Cells(
            {role: np.concatenate(parts) for role, parts in self._numbers.items()},
            {
                role: Words(np.concatenate(parts), tuple(self._known[role]))
                for role, parts in self._codes.items()
            },
            self._clock is not None,
        )


class _Clock:
    """Turns dates and times of a clock into seconds since the first day's midnight."""

    def __init__(self) -> None:
        self._midnight: dt.datetime | None = None

    def seconds(self, cell: object) -> float:
        """Return a cell's seconds; ValueError if it is no time."""
        if isinstance(cell, str) and not re.search(r"\d-\d|T", cell):
            return parse_time(cell)
        moment = cell if isinstance(cell, dt.datetime) else dt.datetime.fromisoformat(str(cell))
        if self._midnight is None:
            self._midnight = moment.replace(hour=0, minute=0, second=0, microsecond=0)
        try:
            return (moment - self._midnight).total_seconds()
        except TypeError:  # one has a zone, the other none
            raise ValueError(str(cell)) from None


def _as_windows(error: UnicodeError) -> tuple[str, int]:
    """Decode bytes that are no UTF-8."""
    if not isinstance(error, UnicodeDecodeError):
        raise error
    return error.object[error.start : error.end].decode("cp1252", errors="replace"), error.end


codecs.register_error(_WINDOWS, _as_windows)


@contextmanager
def _text_of(file: Path) -> Iterator[TextIO]:
    """Open a text, plain or gzipped: UTF-16 by its mark, all else as well as can be."""
    with open_plain(file) as raw:
        packed = raw.read(2) == _PACKED
    opened = gzip.open if packed else io.open
    with opened(file, "rb") as plain:
        stream = cast(io.BufferedReader, plain)
        is_wide = stream.peek(2)[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        encoding = "utf-16" if is_wide else "utf-8-sig"
        yield io.TextIOWrapper(stream, encoding=encoding, errors=_WINDOWS, newline="")


def _lines(text: TextIO, table: Table) -> Iterator[str]:
    """Yield lines; a small file that is packed may hold one that would fill the memory."""
    longest, number = _LONGEST << (8 if table.form.repeated else 0), 0
    while line := text.readline(longest):
        number += 1
        if len(line) == longest:
            message = f"the row is longer than {longest >> 10} kB; write the table again"
            raise InputError(message, file=table.file, line=number)
        yield line


def _text_blocks(table: Table) -> Iterator[tuple[int, list[tuple[str, ...]]]]:
    """Yield blocks of rows by columns, each with the line of its first row."""
    wanted = _wanted(table)
    take, width = itemgetter(*(at for at, _ in wanted)), len(table.names)
    try:
        with _text_of(table.file) as text:
            line = table.line + 1
            lines = islice(_lines(text, table), table.line, None)
            # One row that holds all of a road user is as much as a block of others.
            size = 1 if table.form.repeated else _BLOCK
            while block := list(islice(lines, size)):
                rows = list(_rows(block, table.separator))
                short = next((n for n, row in enumerate(rows) if 0 < len(row) < width), None)
                if short is not None:
                    raise InputError(
                        f"the row has {len(rows[short])} cells, and the header {width}; complete"
                        " it, or take it out",
                        file=table.file,
                        line=line + short,
                    )
                if table.form.repeated:
                    rows = [each for row in rows for each in _unfolded(row, table)]
                columns = list(zip(*(take(row) for row in rows if row), strict=True))
                if columns:
                    yield line, _parts_taken(columns, wanted)
                line += len(block)
    except (OSError, EOFError, zlib.error, csv.Error) as error:
        raise InputError(f"cannot be read ({error}); copy it again", file=table.file) from error


def _rows(lines: Iterable[str], separator: str) -> Iterator[list[str]]:
    """Yield the cells of lines, none for empty ones."""
    if separator == " ":
        return (line.split() for line in lines)
    return (row if any(row) else [] for row in csv.reader(lines, delimiter=separator, strict=False))


def _unfolded(row: list[str], table: Table) -> Iterator[list[str]]:
    """Yield the rows of one road user whose last columns come again and again."""
    again = table.form.repeated
    head = len(table.names) - again
    for at in range(head, len(row) - again + 1, again):
        yield row[:head] + row[at : at + again]


def _wanted(table: Table) -> list[tuple[int, str]]:
    """Return which columns are read, and which part of them: x, y or z, or all."""
    found = []
    for column in table.form.columns.values():
        if column.name in table.names:
            found.append((table.names.index(column.name), ""))
        else:
            base, _, part = column.name.rpartition(" ")
            found.append((table.names.index(base), part))
    return found


def _parts_taken(
    columns: list[tuple[str, ...]], wanted: list[tuple[int, str]]
) -> list[tuple[str, ...]]:
    """Return columns with only x, y or z of those whose cells hold all three."""
    taken = []
    for cells, (_, part) in zip(columns, wanted, strict=True):
        if not part:
            taken.append(cells)
            continue
        at = "xyz".index(part)
        split = (cell.split() for cell in cells)
        taken.append(tuple(each[at] if at < len(each) else "" for each in split))
    return taken


def _parquet(file: Path) -> Any:
    """Return a Parquet file, open."""
    try:
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise MissingExtraError("trajectories in Parquet need pyarrow", extra="parquet") from error
    try:
        return parquet.ParquetFile(file)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read ({error}); write it again", file=file) from error


def _parquet_blocks(table: Table) -> Iterator[tuple[int, list[tuple[Any, ...]]]]:
    """Yield blocks of rows by columns, each with the number of its first row."""
    names = [column.name for column in table.form.columns.values()]
    row = 1
    for batch in _parquet(table.file).iter_batches(_BLOCK, columns=[*dict.fromkeys(names)]):
        yield row, [tuple(batch.column(name).to_pylist()) for name in names]
        row += batch.num_rows
