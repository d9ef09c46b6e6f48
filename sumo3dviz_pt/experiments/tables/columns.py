"""Finds columns of a table by name, and cells in them."""

from __future__ import annotations

from collections.abc import Sequence

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.experiments.tables.cells import Row, Table


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


def cell(table: Table, row: Row, place: int) -> str:
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
