"""Reads what a row says about one factor: a level's name, number, value or codes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.experiments.tables.cells import Row, Table
from sumo3dviz_pt.experiments.tables.columns import called, cell, number, same


@dataclass(frozen=True, slots=True)
class FactorColumns:
    """Where a factor stands in a table.

    Attributes:
        factor: Its name.
        levels: Names of its levels.
        codes: Levels by what cells hold.
        places: Of its column, or of all columns of its codes.
        numbered: Whether cells are the numbers of levels, from 1.
        effects: Whether several columns hold effects codes, and not dummy codes.
    """

    factor: str
    levels: Sequence[str]
    codes: Mapping[str, str]
    places: tuple[int, ...]
    numbered: bool = False
    effects: bool = False

    def level(self, table: Table, row: Row) -> str:
        """Return the level of a row.

        Raises:
            InputError: If it is none.
        """
        if len(self.places) == 1:
            return self._named(table, row)
        return self._coded(table, row)

    def _named(self, table: Table, row: Row) -> str:
        """Return the level that a single cell names."""
        place = self.places[0]
        text = cell(table, row, place)
        for code, level in self.codes.items():
            if same(text, code):
                return level
        if self.numbered:
            at = number(text)
            if at is not None and at.is_integer() and 1 <= at <= len(self.levels):
                return self.levels[int(at) - 1]
            known = f"; levels are numbered from 1 to {len(self.levels)}"
        else:
            for level in self.levels:
                if same(text, level):
                    return level
            known = did_you_mean(text, self.levels)
        raise InputError(
            f"{cut(text)!r} is no level of {self.factor}{known} (design.codes says what others"
            " mean)",
            file=table.file,
            line=row.line,
            element=called(table, place),
        )

    def _coded(self, table: Table, row: Row) -> str:
        """Return the level that dummy or effects codes give.

        In dummy codes (0, 1) the first level has no column and is all zeros; in effects codes
        (-1, 0, 1) the last level has none and is all -1.
        """
        found = tuple(number(cell(table, row, place)) for place in self.places)
        last = len(self.levels) - 1
        if found == (-1 if self.effects else 0,) * last:
            return self.levels[last if self.effects else 0]
        if set(found) <= {0, 1} and found.count(1) == 1:
            return self.levels[found.index(1) + (0 if self.effects else 1)]
        text = ", ".join(row.cells[place] for place in self.places)
        raise InputError(
            f"{cut(text)} are no {'effects' if self.effects else 'dummy'} codes of {self.factor}"
            f" (design.coding says which they are)",
            file=table.file,
            line=row.line,
            element=called(table, self.places[0]),
        )


def has_effects_codes(table: Table, factor: str, places: Sequence[tuple[int, ...]]) -> bool:
    """Return whether columns hold effects codes, and not dummy codes.

    A row of nothing but -1 is the last level in effects codes, one of nothing but 0 the first in
    dummy codes. Where a table has neither, its names tell: R counts the columns of dummy codes from
    2 on, as the first level has none, and those of effects codes from 1 on.

    Args:
        table: The table.
        factor: The factor's name.
        places: Of its columns; several times in a row for each task.

    Raises:
        InputError: If nothing tells, or a table has both.
    """
    kinds = {
        tuple(number(row.cells[place]) for place in own) for row in table.rows for own in places
    }
    minus, zero = ((value,) * len(places[0]) in kinds for value in (-1, 0))
    if minus != zero:
        return minus
    names = [table.header[place] for place in places[0]]
    shared = next((n for n, signs in enumerate(zip(*names, strict=False)) if len({*signs}) > 1), 0)
    ends = [name[shared:] for name in names]
    for first in (1, 2):
        if not minus and ends == [str(first + n) for n in range(len(ends))]:
            return first == 1
    why = "rows of -1 and rows of 0" if minus else "neither rows of -1 nor rows of 0"
    raise InputError(
        f"the columns of {factor} hold {why}, so they may be dummy or effects codes; say which:"
        f" design.coding: {{{factor}: dummy}}, or effects",
        file=table.file,
    )
