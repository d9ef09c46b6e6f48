"""Chooses where to look closely: windows with detail in which pictures differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image

_DETAIL = 0.25
"""Weight of detail against error: a window without edges shows blur badly."""


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of a picture [px].

    Attributes:
        row: Of its top left corner.
        column: Of its top left corner.
        height: Of the rectangle.
        width: Of the rectangle.
    """

    row: int
    column: int
    height: int
    width: int

    def of(self, picture: Image) -> Image:
        """Return what lies inside it."""
        rows = slice(self.row, self.row + self.height)
        return picture[rows, self.column : self.column + self.width]

    def apart(self, other: Window) -> bool:
        """Return whether half a window or more lies between two windows of one size."""
        rows, columns = abs(self.row - other.row), abs(self.column - other.column)
        return rows >= 1.5 * self.height or columns >= 1.5 * self.width


def choose_windows(
    reference: Image, errors: Sequence[Image], *, count: int = 3, share: float = 0.16
) -> list[Window]:
    """Return windows with space between them, the most telling first.

    Args:
        reference: Display-encoded picture, (h, w, 3) in [0, 1].
        errors: Error maps of the pictures to compare, each (h, w), >= 0; may be none.
        count: How many windows are wanted; small pictures may hold fewer.
        share: Width of a window over that of the picture, (0, 1].

    Returns:
        At most `count` windows of one size, at least one.
    """
    height, width = reference.shape[:2]
    wide = max(1, min(width, round(share * width)))
    tall = max(1, min(height, round(0.75 * wide)))
    scores = _box_means(_interest(reference, errors), tall, wide)
    chosen: list[Window] = []
    for place in np.argsort(-scores, axis=None, kind="stable"):
        row, column = np.unravel_index(place, scores.shape)
        window = Window(int(row), int(column), tall, wide)
        if all(window.apart(other) for other in chosen):
            chosen.append(window)
        if len(chosen) == count:
            break
    return chosen


def _interest(reference: Image, errors: Sequence[Image]) -> Floats:
    """Return what a window gains by each pixel, (h, w): error, and edges that error could hide."""
    grey = reference.astype(np.float64).mean(axis=-1)
    edges = sum(np.abs(np.diff(grey, axis=axis, append=_last(grey, axis))) for axis in (0, 1))
    edges = np.minimum(np.asarray(edges), 0.3)
    wrong = sum((np.asarray(error, dtype=np.float64) for error in errors), np.zeros(grey.shape))
    return np.asarray(_levelled(wrong) + _DETAIL * _levelled(edges))


def _last(values: Floats, axis: int) -> Floats:
    """Return the last line along an axis, kept as an axis."""
    return np.asarray(np.take(values, [-1], axis=axis))


def _levelled(values: Floats) -> Floats:
    """Return values whose mean is 1, or 0 if there is nothing."""
    mean = float(values.mean())
    return values / mean if mean > 0 else values


def _box_means(values: Floats, tall: int, wide: int) -> Floats:
    """Return the mean of every window that fits, (h - tall + 1, w - wide + 1).

    A summed-area table gives all of them at once.
    """
    table = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    sums = table[tall:, wide:] - table[:-tall, wide:] - table[tall:, :-wide] + table[:-tall, :-wide]
    return np.asarray(sums / (tall * wide))
