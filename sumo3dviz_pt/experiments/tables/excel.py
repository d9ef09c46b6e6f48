"""Reads a sheet of an .xlsx; that needs the package openpyxl."""

from __future__ import annotations

import datetime as dt
import zipfile
from pathlib import Path
from typing import Any

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import InputError, MissingExtraError
from sumo3dviz_pt.experiments.tables.cells import Row


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
        from openpyxl.utils.exceptions import InvalidFileException
    except ImportError as error:
        raise MissingExtraError(f"{file}: .xlsx tables need openpyxl", extra="studies") from error
    if not file.is_file():
        raise InputError("there is no such table", file=file)
    try:
        book = openpyxl.load_workbook(file, read_only=True, data_only=True)
    except (InvalidFileException, zipfile.BadZipFile, KeyError, ValueError, OSError) as error:
        raise InputError("is damaged, or no .xlsx", file=file) from error
    try:
        if sheet is not None and sheet not in book.sheetnames:
            hint = did_you_mean(sheet, book.sheetnames)
            raise InputError(f"has no sheet {sheet!r}{hint}", file=file)
        rows = book[sheet or book.sheetnames[0]].iter_rows(values_only=True)
        texts = [Row(line, tuple(map(_text, cells))) for line, cells in enumerate(rows, start=1)]
    finally:
        book.close()
    return _trimmed([row for row in texts if any(row.cells)])


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
