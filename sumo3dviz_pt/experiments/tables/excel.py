"""Reads a sheet of an .xlsx; that needs the package openpyxl."""

from __future__ import annotations

import datetime as dt
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import InputError, MissingExtraError
from sumo3dviz_pt.experiments.tables.cells import MOST_BYTES, Row, bounded
from sumo3dviz_pt.files.quiet import unwarned
from sumo3dviz_pt.files.whole import read_plain


def read_sheet(file: Path, sheet: str | None) -> list[Row]:
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


def _rows(book: Any, sheet: str | None, file: Path) -> Iterator[Row]:
    """Yield the rows of a sheet that hold anything."""
    if sheet is not None and sheet not in book.sheetnames:
        hint = did_you_mean(sheet, book.sheetnames)
        raise InputError(f"has no sheet {sheet!r}{hint}", file=file)
    found = book[sheet or book.sheetnames[0]]
    # The size that a sheet states is often that of an older one.
    found.reset_dimensions()
    for line, cells in enumerate(found.iter_rows(values_only=True), start=1):
        texts = tuple(map(_text, cells))
        if any(texts):
            yield Row(line, texts)


def _trimmed(rows: list[Row]) -> list[Row]:
    """Return rows without the empty columns at the end that Excel keeps."""
    width = max((n + 1 for row in rows for n, cell in enumerate(row.cells) if cell), default=0)
    return [Row(row.line, (*row.cells, *[""] * width)[:width]) for row in rows]


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
