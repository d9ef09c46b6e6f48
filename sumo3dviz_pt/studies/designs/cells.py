"""Reads tables as text cells by line, of text files and of .xlsx, and finds columns in them.

Text files are separated by commas, semicolons or tabs. A sheet of an .xlsx needs the package
openpyxl.

References:
    RFC 4180 (comma-separated values)
    R Core Team: R Data Import/Export, 2.1 (a header may lack the column of row names)
"""

from __future__ import annotations

import csv
import datetime as dt
import io
import zipfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import InputError, MissingExtraError, cut
from sumo3dviz_pt.files.atomic import read_plain
from sumo3dviz_pt.files.quiet import unwarned

SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t"}

MOST_BYTES = 50_000_000
"""Largest table that is read."""

MOST_ROWS = 20_000
"""Most rows of a table."""

MOST_CELLS = 1_000_000
"""Most cells of a table; those that are empty count, too."""

_EXCEL = {".xlsx", ".xlsm"}
_MARKS = ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig"))


@dataclass(frozen=True, slots=True)
class TableRow:
    """A row of a table.

    Attributes:
        line: Where it stands in the file, from 1.
        cells: Text, as many as the header has; without blanks at the ends.
    """

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """A table with a header.

    Attributes:
        file: Where it was read.
        header: Names of the columns, each once.
        rows: At least one.
    """

    file: Path
    header: tuple[str, ...]
    rows: tuple[TableRow, ...]


def read_table(file: Path, *, separator: str = "auto", sheet: str | None = None) -> Table:
    """Read a table.

    Args:
        file: .xlsx, or text with any other ending.
        separator: `comma`, `semicolon`, `tab`, or `auto`: the one that the header has most of.
        sheet: Of an .xlsx; None is the first.

    Raises:
        InputError: If the file is missing, no table, or its rows do not fit its header.
        MissingExtraError: If it is an .xlsx and openpyxl is not installed.
    """
    if file.suffix.lower() in _EXCEL:
        rows, named = read_sheet(file, sheet), ""
    else:
        text = _text_of(file)
        if not text.strip():
            raise InputError("holds no table, it is empty", file=file)
        named = separator_of(text) if separator == "auto" else separator
        rows = list(bounded(_text_rows(text, SEPARATORS[named], file), file))
    if not rows:
        raise InputError("holds no table, it is empty", file=file)
    return _table(file, rows, named)


def bounded(rows: Iterable[TableRow], file: Path) -> Iterator[TableRow]:
    """Yield rows while they are no more than any table has.

    Raises:
        InputError: If they are.
    """
    cells = 0
    for number, row in enumerate(rows):
        cells += len(row.cells)
        if number > MOST_ROWS or cells > MOST_CELLS:
            message = f"has more than {MOST_ROWS:,} rows or {MOST_CELLS:,} cells; no design has"
            raise InputError(message, file=file, line=row.line)
        yield row


def _text_of(file: Path) -> str:
    """Return a file's text."""
    try:
        data = read_plain(file, most=MOST_BYTES)
    except FileNotFoundError as error:
        raise InputError("there is no such table", file=file) from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=file) from error
    if data[:2] == b"PK":
        raise InputError("is a packed file, no text; is it an .xlsx by another name?", file=file)
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), "utf-8")
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(
            "is no text in UTF-8 (Excel: save as CSV UTF-8)", file=file, line=line
        ) from error
    if "\0" in text:
        raise InputError("is no text: it holds null characters", file=file)
    return text


def separator_of(text: str) -> str:
    """Return the separator that a table's first line has most of, outside of quotes."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    bare = "".join(first.split('"')[::2])
    return max(SEPARATORS, key=lambda name: bare.count(SEPARATORS[name]))


def _text_rows(text: str, separator: str, file: Path) -> Iterator[TableRow]:
    """Yield the rows of a text that hold anything."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    line = 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield TableRow(line, tuple(cell.strip() for cell in cells))
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(
            f"a quote is opened here and not closed, or text follows one ({error})",
            file=file,
            line=line,
        ) from error


def _table(file: Path, rows: Sequence[TableRow], separator: str) -> Table:
    """Return a table from its rows, the first of which is the header."""
    header, body = list(rows[0].cells), rows[1:]
    if not body:
        raise InputError("holds a header and no rows", file=file)
    if all(len(row.cells) == len(header) + 1 for row in body):
        header.insert(0, "")  # R leaves the header of row names out
    for row in body:
        if len(row.cells) != len(header):
            raise InputError(
                f"this row has {len(row.cells)} cells and the header {len(header)}"
                + _why(row, len(header), separator),
                file=file,
                line=row.line,
            )
    twice = [name for name, times in Counter(header).items() if times > 1]
    if twice:
        raise InputError(
            f"two columns are called {cut(twice[0])!r}; rename one", file=file, line=rows[0].line
        )
    return Table(file, tuple(header), tuple(body))


def _why(row: TableRow, wanted: int, separator: str) -> str:
    """Return what may have gone wrong with a row."""
    if separator == "comma" and len(row.cells) > wanted:
        return "; decimal commas need quotes around them, or semicolons between columns"
    if any(sign in cell for cell in row.cells for sign in ";\t") and wanted == 1:
        return "; is the separator another one?"
    return ""


def read_sheet(file: Path, sheet: str | None) -> list[TableRow]:
    """Return the rows of a sheet that hold anything, as text.

    Args:
        file: The .xlsx.
        sheet: The sheet's name; None is the first.

    Raises:
        InputError: If the file cannot be read or has no such sheet.
        MissingExtraError: If openpyxl is not installed.
    """
    try:
        import openpyxl
    except ImportError as error:
        raise MissingExtraError(f"{file}: .xlsx tables need openpyxl", extra="studies") from error
    data = _packed(file)
    try:
        with unwarned():
            book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
            return _trimmed(list(bounded(_rows(book, sheet, file), file)))
    except InputError:
        raise
    except Exception as error:  # openpyxl raises anything
        raise InputError("is damaged, or no .xlsx; save it again", file=file) from error


def _packed(file: Path) -> bytes:
    """Return what a file holds, if it does not unpack to more than any table."""
    try:
        data = read_plain(file, most=MOST_BYTES)
        with zipfile.ZipFile(io.BytesIO(data)) as parts:
            unpacked = sum(part.file_size for part in parts.infolist())
    except FileNotFoundError as error:
        raise InputError("there is no such table", file=file) from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=file) from error
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise InputError("is damaged, or no .xlsx; save it again", file=file) from error
    if unpacked > 4 * MOST_BYTES:
        message = f"unpacks to {unpacked:,} bytes, more than any table; is it an .xlsx?"
        raise InputError(message, file=file)
    return data


def _rows(book: Any, sheet: str | None, file: Path) -> Iterator[TableRow]:
    """Yield the rows of a sheet that hold anything."""
    if sheet is not None and sheet not in book.sheetnames:
        hint = did_you_mean(sheet, book.sheetnames)
        raise InputError(f"has no sheet {sheet!r}{hint}", file=file)
    page = book[sheet or book.sheetnames[0]]
    # The size that a sheet states is often that of an older one.
    page.reset_dimensions()
    for line, cells in enumerate(page.iter_rows(values_only=True), start=1):
        texts = tuple(map(_text, cells))
        if any(texts):
            yield TableRow(line, texts)


def _trimmed(rows: list[TableRow]) -> list[TableRow]:
    """Return rows without the empty columns at the end that Excel keeps."""
    width = max((n + 1 for row in rows for n, cell in enumerate(row.cells) if cell), default=0)
    return [TableRow(row.line, (*row.cells, *[""] * width)[:width]) for row in rows]


def _text(value: Any) -> str:
    """Return a cell as text: whole numbers without decimals, times without their date."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"{value:.12g}"
    if isinstance(value, dt.datetime) and value.time() == dt.time():
        return value.date().isoformat()
    return str(value).strip()


def find_column(table: Table, name: str) -> int | None:
    """Return where a column is; capitals and blanks count only where they tell columns apart."""
    if name in table.header:
        return table.header.index(name)
    alike = [n for n, other in enumerate(table.header) if _plain(other) == _plain(name)]
    return alike[0] if len(alike) == 1 else None


def column(table: Table, name: str, what: str) -> int:
    """Return where a column is.

    Args:
        table: The table.
        name: The column's name.
        what: What is looked for, for messages.

    Raises:
        InputError: If there is none; names those that there are.
    """
    place = find_column(table, name)
    if place is None:
        one = len(table.header) == 1
        hint = "; is the separator another one?" if one else did_you_mean(name, table.header)
        raise InputError(f"no column is called {name!r}, for {what}{hint}", file=table.file)
    return place


def cell(table: Table, row: TableRow, place: int) -> str:
    """Return what a cell holds.

    Raises:
        InputError: If it is empty.
    """
    text = row.cells[place]
    if text.upper() in ("", "NA", "N/A", "NAN", "#N/A"):
        raise InputError(
            "this cell is empty", file=table.file, line=row.line, element=called(table, place)
        )
    return text


def called(table: Table, place: int) -> str:
    """Return a column as messages name it."""
    return f"column {cut(table.header[place])!r}"


def number(text: str) -> float | None:
    """Return a number with a point or a decimal comma; None if the text is none."""
    try:
        return float(text.replace(",", ".") if text.count(",") == 1 else text)
    except ValueError:
        return None


def same(one: str, other: str) -> bool:
    """Return whether two cells say the same: as text, or as numbers."""
    first, second = number(one), number(other)
    return one == other or (first is not None and first == second)


def listed(names: Sequence[str]) -> str:
    """Return names in words, at most five of them."""
    shown = ", ".join(names[:5])
    return shown if len(names) <= 5 else f"{shown}, ..."


def _plain(name: str) -> str:
    """Return a name without capitals and blanks."""
    return "".join(name.lower().split())
