"""Sums in square windows around every pixel, by few additions of whole rows and columns.

A window of 9 pixels is three of 3 side by side; one of 21 is one of 9, one of 3 and one of 9. So
wide windows cost hardly more than narrow ones, and no running sum loses digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Values = NDArray[Any]
"""A picture of floats, or of whole numbers."""

WIDEST = 21
"""Side of the widest window [px]."""


def window_sums(values: Values, window: int) -> Values:
    """Return the sum of every square that lies in a picture, (h - side + 1, w - side + 1).

    Args:
        values: (h, w), each side as long as the window or longer.
        window: Side of the squares [px]: 3, 5, 9 or 21.

    Raises:
        ValueError: If the window has another side.
    """
    return _in_rows(_in_rows(values, window).T, window).T


def _in_rows(values: Values, window: int) -> Values:
    """Return the sums of so many rows from each row on, (h - window + 1, w)."""
    three = values[:-2] + values[1:-1]
    three += values[2:]
    if window == 3:
        return three
    if window == 5:
        return _all_of(values[:-4], three[1:-1], values[4:])
    nine = _all_of(three[:-6], three[3:-3], three[6:])
    if window == 9:
        return nine
    if window == WIDEST:
        return _all_of(nine[:-12], three[9:-9], nine[12:])
    raise ValueError(f"no window of {window} pixels")


def _all_of(first: Values, second: Values, third: Values) -> Values:
    """Return the sum of three pictures, with one new array."""
    total = first + second
    total += third
    return np.asarray(total)


def inner(values: Values, margin: int) -> Values:
    """Return a picture without so many pixels at each side."""
    return values[margin:-margin, margin:-margin] if margin else values
