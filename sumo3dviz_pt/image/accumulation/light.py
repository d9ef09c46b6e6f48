"""Tells changed light from noise: shadows, lamps and signals must not lag behind."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter

from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.geometry import Bools, Image

_LUMINANCE = LUMINANCE.astype(np.float32)
_WINDOW = 7  # side of the window in which light is compared [px]
_SURE, _CERTAIN = 2.0, 5.0  # standard errors from which on light may have, and has, changed
_DARK = 0.02  # share of white that is added before logarithms, so that black has one
_FEWEST = 0.2  # share of a window that must be known


def likeness(now: Image, then: Image, *, known: Bools, white: float) -> Image:
    """Return how far the light of two pictures may be called the same, (h, w) in [0, 1].

    The difference of the logarithms of luminance is averaged around every pixel and compared
    with the standard error of that mean. Textures cancel out in the difference.

    Args:
        now: Radiance, (h, w, 3).
        then: Of the same things in another frame.
        known: Where `then` holds something, (h, w).
        white: Radiance that is shown as white.
    """
    change = np.where(known, _levels(now, white) - _levels(then, white), np.float32(0.0))
    share = uniform_filter(known.astype(np.float32), _WINDOW, mode="nearest")
    mean, power = (
        uniform_filter(values, _WINDOW, mode="nearest") / np.maximum(share, 1e-3)
        for values in (change, change * change)
    )
    count = np.maximum(share * _WINDOW**2, 1.0)
    error = np.sqrt((np.maximum(power - mean * mean, 0.0)) / count + 1e-6)
    sure = 1.0 - np.clip((np.abs(mean) / error - _SURE) / (_CERTAIN - _SURE), 0.0, 1.0)
    return np.where(known & (share >= _FEWEST), sure, 0.0).astype(np.float32)


def _levels(radiance: Image, white: float) -> Image:
    """Return the logarithm of luminance, (h, w)."""
    light = np.maximum(radiance @ _LUMINANCE, 0.0) / np.float32(white)
    return np.asarray(np.log(light + np.float32(_DARK)))
