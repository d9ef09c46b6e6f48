"""Reads tables that others wrote about a study's films: gaze, and presses of the page."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.studies.designs.cells import SEPARATORS, number, separator_of

Cells = Mapping[str, str]
"""Of a row, by column."""


def read_rows(path: Path, columns: Sequence[str], *, needs: str) -> Iterator[tuple[Cells, int]]:
    """Yield the rows of a table with the lines at which they end.

    Args:
        path: The table (.csv), in UTF-8; commas, semicolons or tabs stand between columns.
        columns: That it has to have; it may have others.
        needs: What it needs, for people.

    Raises:
        InputError: If a column is missing, or the file is no table.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            separator = SEPARATORS[separator_of(file.readline())]
            file.seek(0)
            table = csv.DictReader(file, delimiter=separator)
            missing = [name for name in columns if name not in (table.fieldnames or ())]
            if missing:
                raise InputError(f"has no column {missing[0]!r}; it needs {needs}", file=path)
            for row in table:
                yield {name: row[name] or "" for name in table.fieldnames or ()}, table.line_num
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot be read as a table ({error})", file=path) from error


def film_named(text: str, films: Mapping[str, str], *, path: Path, line: int) -> str:
    """Return a film by its name or file.

    Args:
        text: As a table has it.
        films: Files' names by the films'.
        path: The table.
        line: Where in it.

    Raises:
        InputError: If there is none of that name; suggests one.
    """
    name = text.strip().rpartition("/")[2]
    match = next((each for each, file in films.items() if name in (each, file)), None)
    if match is None:
        hint = did_you_mean(name, films)
        raise InputError(f"no film is called {cut(name)!r}{hint}", file=path, line=line)
    return match


def number_in(text: str, column: str, *, path: Path, line: int) -> float:
    """Return a cell's number, with a point or a decimal comma; NaN of an empty one.

    Args:
        text: The cell.
        column: What it is called.
        path: The table.
        line: Where in it.

    Raises:
        InputError: If it is no finite number.
    """
    text = text.strip()
    if text.lower() in ("", "na", "nan"):
        return math.nan
    value = number(text)
    if value is None or math.isinf(value):
        raise InputError(f"{column} should be a number, not {cut(text)!r}", file=path, line=line)
    return value
