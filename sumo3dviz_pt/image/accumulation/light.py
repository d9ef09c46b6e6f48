"""Tells changed light from noise: shadows, lamps and signals must not lag behind."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter

from sumo3dviz_pt.model.geometry import Bools, Image

_WIDE, _NARROW = 21, (9, 5, 3)
"""Sides of the windows in which light is compared [px].

The wide one finds small changes of large areas; narrow ones find thin shadows of cyclists, and
those under far cars.
"""

_OF_NINE = np.float32(9 / 8)
"""Variance of values over that of their differences from the mean of nine."""

_SURE, _CERTAIN = np.float32(2.0), np.float32(5.0)
"""Standard errors from which on light may have, and surely has, changed."""


def likeness(change: Image, known: Bools) -> Image:
    """Return how far the light of two pictures may be called the same, (h, w) in [0, 1].

    The difference of the logarithms of luminance is averaged around every pixel and compared
    with the standard error of that mean. Textures cancel out in the difference.

    Args:
        change: That difference, (h, w).
        known: Where it means anything, (h, w).
    """
    counts = known.astype(np.float32)
    change = change * counts
    share = {window: _share(known, counts, window) for window in (_WIDE, *_NARROW)}
    means = {window: _around(change, window) / share[window] for window in share}
    spread = _around(change * change, _WIDE) / share[_WIDE] - means[_WIDE] ** 2
    sure = counts * _same(means[_WIDE], spread, share[_WIDE] * np.float32(_WIDE**2))

    # The spread within a narrow window would count a thin shadow as noise; what differs from the
    # next pixels does not.
    rest = (change - means[_NARROW[-1]]) * counts
    noise = _around(rest * rest, _NARROW[0]) / share[_NARROW[0]] * _OF_NINE
    for window in _NARROW:
        same = _same(means[window], noise, share[window] * np.float32(window**2))
        sure = np.minimum(sure, same)
    return sure


def _same(mean: Image, spread: Image, count: Image) -> Image:
    """Return 1 where a mean may be zero, 0 where it cannot be, and values between, (h, w).

    Args:
        mean: Of some values.
        spread: Their variance.
        count: How many values there are.
    """
    error = np.sqrt(np.maximum(spread, 0.0) / count + np.float32(1e-6))
    return np.clip((_CERTAIN - np.abs(mean) / error) / (_CERTAIN - _SURE), 0.0, 1.0)


def _share(known: Bools, counts: Image, window: int) -> Image:
    """Return the share of each pixel's window that counts; one number where all does."""
    if known.all():
        return np.ones((1, 1), dtype=np.float32)
    return np.maximum(_around(counts, window), np.float32(1e-3))


def _around(values: Image, window: int) -> Image:
    """Return the mean of each pixel's window, (h, w)."""
    return np.asarray(uniform_filter(values, window, mode="nearest"), dtype=np.float32)
