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
    """

    factor: str
    levels: Sequence[str]
    codes: Mapping[str, str]
    places: tuple[int, ...]
    numbered: bool = False

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
        if found == (0,) * last:
            return self.levels[0]
        if found == (-1,) * last:
            return self.levels[last]
        if set(found) <= {0, 1} and found.count(1) == 1:
            return self.levels[found.index(1) + (0 if self._effects(table) else 1)]
        text = ", ".join(row.cells[place] for place in self.places)
        raise InputError(
            f"{cut(text)} are no dummy or effects codes of {self.factor}",
            file=table.file,
            line=row.line,
            element=called(table, self.places[0]),
        )

    def _effects(self, table: Table) -> bool:
        """Return whether a table has effects codes: some row is all -1."""
        rows = ([number(row.cells[place]) for place in self.places] for row in table.rows)
        return any(set(values) == {-1} for values in rows)
