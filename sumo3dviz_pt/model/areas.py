"""Rectangles of a picture, in pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools


@dataclass(frozen=True, slots=True)
class PixelArea:
    """A rectangle of a picture.

    Attributes:
        rows: Its first row and that after its last one [px].
        columns: The same of its columns [px].
    """

    rows: tuple[int, int]
    columns: tuple[int, int]

    @classmethod
    def around(cls, there: Bools) -> PixelArea | None:
        """Return the smallest one that holds all pixels of a mask, (h, w); None if it has none."""
        rows, columns = (np.flatnonzero(there.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return None
        return cls((int(rows[0]), int(rows[-1]) + 1), (int(columns[0]), int(columns[-1]) + 1))

    @property
    def size(self) -> tuple[int, int]:
        """Its rows and columns [px]."""
        return self.rows[1] - self.rows[0], self.columns[1] - self.columns[0]

    @property
    def pixels(self) -> int:
        """How many pixels it has."""
        rows, columns = self.size
        return rows * columns

    @property
    def slices(self) -> tuple[slice, slice]:
        """Where it lies in the arrays of a picture."""
        return slice(*self.rows), slice(*self.columns)

    def within(self, first: int, last: int) -> PixelArea | None:
        """Return the part of it that lies in some rows, up to that before `last`; None if none."""
        top, bottom = max(self.rows[0], first), min(self.rows[1], last)
        return PixelArea((top, bottom), self.columns) if top < bottom else None

    def below(self, row: int) -> PixelArea:
        """Return the same rectangle in a picture that begins at a row of this one."""
        return PixelArea((self.rows[0] - row, self.rows[1] - row), self.columns)
