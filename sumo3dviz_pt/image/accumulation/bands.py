"""A picture's rows in bands, so that what is computed of each stays in the processor's cache."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_PIXELS = 150_000
"""About as many has a band: a plane of them takes a third of a processor's second cache."""


@dataclass(frozen=True, slots=True)
class Band:
    """Some rows of a picture, and those around them that windows reach.

    Attributes:
        first: Of its own rows.
        after: The row after its last one.
        height: Of the picture [px].
        margin: How far windows reach [px].
    """

    first: int
    after: int
    height: int
    margin: int

    @property
    def own(self) -> slice:
        """Its own rows in the picture."""
        return slice(self.first, self.after)

    @property
    def rows(self) -> slice:
        """All of its rows in the picture."""
        return slice(max(self.first - self.margin, 0), min(self.after + self.margin, self.height))

    @property
    def core(self) -> slice:
        """Its own rows among all of its rows."""
        return slice(self.first - self.rows.start, self.after - self.rows.start)

    def of(self, picture: NDArray[Any]) -> NDArray[Any]:
        """Return its rows of a picture, (h, w), as a flat view."""
        rows: NDArray[Any] = picture[self.rows].reshape(-1)
        return rows

    def among(self, pixels: NDArray[np.intp], width: int) -> NDArray[np.intp]:
        """Return which flat indices of the picture, ascending, lie in its rows, as its own."""
        rows = self.rows
        ends = np.searchsorted(pixels, (rows.start * width, rows.stop * width))
        return np.asarray(pixels[slice(*ends)] - rows.start * width)

    def padded(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values of its rows as if the picture went on beyond its edges as at its edges."""
        above = self.margin - (self.first - self.rows.start)
        below = self.margin - (self.rows.stop - self.after)
        return np.pad(values, ((above, below), (self.margin, self.margin)), mode="edge")


def bands_of(size: tuple[int, int], margin: int) -> Iterator[Band]:
    """Yield a picture's bands from above.

    Args:
        size: Of the picture, width and height [px].
        margin: How far windows reach [px].
    """
    width, height = size
    rows = max(_PIXELS // width, 2 * margin)
    for first in range(0, height, rows):
        yield Band(first, min(first + rows, height), height, margin)
