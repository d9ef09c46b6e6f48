"""Tells changed light from noise: shadows, lamps and signals must not lag behind."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter

from sumo3dviz_pt.model.geometry import Bools, Image

_WINDOWS = (21, 3)
"""Sides of the windows in which light is compared [px].

The large one finds small changes of wide areas, the small one the thin shadows under far cars.
"""

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
    power, sure = change * change, counts
    whole = bool(known.all())
    for window in _WINDOWS:
        share: Image | np.float32 = np.float32(1.0)
        if not whole:
            share = np.maximum(_around(counts, window), np.float32(1e-3))
        mean = _around(change, window) / share
        spread = np.maximum(_around(power, window) / share - mean * mean, 0.0)
        error = np.sqrt(spread / (share * np.float32(window**2)) + np.float32(1e-6))
        same = (_CERTAIN - np.abs(mean) / error) / (_CERTAIN - _SURE)
        sure = np.minimum(sure, np.clip(same, 0.0, 1.0))
    return sure


def _around(values: Image, window: int) -> Image:
    """Return the mean of each pixel's window, (h, w)."""
    return np.asarray(uniform_filter(values, window, mode="nearest"))
