"""SUMO's vehicle log as a table of text, plain or gzipped, with any separator."""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.files.whole import open_plain
from sumo3dviz_pt.sumo.formats.format import Cells
from sumo3dviz_pt.sumo.formats.table import Block, Header, TableFormat, header_of
from sumo3dviz_pt.sumo.stream import TruncatedError, unpacked

_HEAD = 8192
"""Number of bytes in which the first line must end."""

_MARK = "\ufeff"
_SEPARATOR = re.compile(r'[^\w"]+')
_FIRST = re.compile(rb'[^\w<]{0,6}"?[A-Za-z]')

_NUMBERS = {"z": "0", "slope": "0", "speed": "nan", "pos": "nan", "signals": "-1"}
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

    def blocks(self, file: Path) -> Iterator[Block]:
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
    found = _SEPARATOR.search(line.removeprefix(_MARK))
    separator = found[0] if found else ";"
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


def _blocks(data: bytes, way: _Way, file: Path, line: int) -> Iterator[Block]:
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
        cells = _cells(text, way) or _cells_one_by_one(text, way, file, line)
        names = way.header.names
        columns = {name: _filled(name, cells[at :: len(names)]) for at, name in enumerate(names)}
        yield Block(columns, line)


def _cells(text: str, way: _Way) -> list[str] | None:
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
    missing = _NUMBERS.get(name)
    if missing is None or "" not in cells:
        return cells
    return [cell or missing for cell in cells]
