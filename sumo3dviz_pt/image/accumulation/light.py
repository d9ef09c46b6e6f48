"""Tells changed light from noise: shadows, lamps and signals must not lag behind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.accumulation.windows import WIDEST, inner, window_sums
from sumo3dviz_pt.model.geometry import Bools, Image

_NARROW = (9, 5, 3)
"""Sides of the windows in which light is compared, beside the widest [px].

The wide one finds small changes of large areas; narrow ones find thin shadows of cyclists, and
those under far cars.
"""

MARGIN = WIDEST // 2
"""How far windows reach beyond the pixels that are asked for [px]."""

_OF_NINE = np.float32(9 / 8)
"""Variance of values over that of their differences from the mean of nine."""

_SURE, _CERTAIN = np.float32(2.0), np.float32(5.0)
"""Standard errors from which on light may have, and surely has, changed."""

_NEVER_EXACT = np.float32(1e-6)
"""Added to squared standard errors, so that none is zero."""


Counts = NDArray[np.int16]
"""Whole numbers take half the memory, and so half the time."""


def likeness(change: Image, known: Bools) -> Image:
    """Return how far the light of two pictures may be called the same, (h, w) in [0, 1].

    The difference of the logarithms of luminance is averaged around every pixel and compared
    with the standard error of that mean. Textures cancel out in the difference.

    Args:
        change: That difference, with `MARGIN` pixels more at each side, (h + 20, w + 20).
        known: Where it means anything, as large.
    """
    counts = None if known.all() else known.astype(np.int16)
    if counts is not None:
        change = change * known
    count = {window: _count(counts, window) for window in (WIDEST, *_NARROW)}
    mean = _mean(change, WIDEST, count[WIDEST])
    spread = _mean(change * change, WIDEST, count[WIDEST]) - mean * mean
    doubt = _doubt(mean, np.maximum(spread, 0.0, out=spread), count[WIDEST])

    # The spread within a narrow window would count a thin shadow as noise; what differs from the
    # next pixels does not.
    noise = _noise(change, counts, count[_NARROW[0]])
    for window in _NARROW:
        mean = _mean(inner(change, MARGIN - window // 2), window, count[window])
        np.maximum(doubt, _doubt(mean, noise, count[window]), out=doubt)

    np.sqrt(doubt, out=doubt)
    same = (_CERTAIN - doubt) * (1 / (_CERTAIN - _SURE))
    np.clip(same, 0.0, 1.0, out=same)
    return same if counts is None else same * inner(known, MARGIN)


def _doubt(mean: Image, variance: Image, count: Image | np.float32) -> Image:
    """Return the squares of means in units of their standard errors, (h, w).

    Args:
        mean: Of some values.
        variance: Of these values, not negative.
        count: How many values there are.
    """
    error: Image = variance / count
    error += _NEVER_EXACT
    np.multiply(mean, mean, out=mean)
    return np.asarray(np.divide(mean, error, out=mean))


def _mean(values: Image, window: int, count: Image | np.float32) -> Image:
    """Return the means of windows that have so many values, (h, w)."""
    return np.asarray(window_sums(values, window) / count, dtype=np.float32)


def _noise(change: Image, counts: Counts | None, around: Image | np.float32) -> Image:
    """Return the variance of a change's noise around every pixel, (h, w)."""
    wide, narrow = _NARROW[0], _NARROW[-1]
    margin = MARGIN - wide // 2
    count = _count(counts, narrow, more=wide // 2)
    mean = _mean(inner(change, margin - narrow // 2), narrow, count)
    rest = inner(change, margin) - mean
    if counts is not None:
        rest *= inner(counts, margin)
    np.multiply(rest, rest, out=rest)
    return _mean(rest, wide, around) * _OF_NINE


def _count(counts: Counts | None, window: int, *, more: int = 0) -> Image | np.float32:
    """Return how many pixels of each window mean anything; one number where all do.

    Args:
        counts: 1 where a pixel means something, else 0; None if all do.
        window: Side of the window [px].
        more: How many more pixels are asked for at each side [px].
    """
    if counts is None:
        return np.float32(window**2)
    sums = window_sums(inner(counts, MARGIN - window // 2 - more), window)
    # No mean is asked for where nothing is known.
    return np.maximum(sums, 1).astype(np.float32)
