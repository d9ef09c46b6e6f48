"""Glare of bright lights in a lens, which makes lamps look bright in a picture.

A share of all light is spread over three discs of growing size. Together they fall off roughly
with the cube of the distance, like light that a lens scatters. Light is neither added nor
lost, except what leaves the picture.

References:
    G. Spencer, P. Shirley, K. Zimmerman, D. Greenberg, Physically-based glare effects for
    digital images, SIGGRAPH 1995 (scattered light falls with the angle to the power of 2 to 3).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sumo3dviz_pt.model.geometry import Image

_DISCS = ((1.0 / 180.0, 0.55), (1.0 / 60.0, 0.3), (1.0 / 20.0, 0.15))
"""Standard deviation, in picture heights, and share of what is spread; chosen by eye."""

_BRIGHTEST = 2000.0
"""Limit of the light that glares [x white], because brighter lights are often tiny."""

_COARSE = 3.0
"""Wider discs are computed at a lower resolution [px]."""


def bloom(exposed: Image, share: float) -> Image:
    """Spread a share of the light.

    Args:
        exposed: Linear light, 1 is white, (h, w, 3).
        share: Of all light, in [0, 1]; 0 changes nothing.
    """
    if share <= 0.0:
        return exposed
    bright = np.minimum(exposed, np.float32(_BRIGHTEST))
    spread = np.zeros_like(bright)
    for size, part in _DISCS:
        spread += np.float32(part) * _blurred(bright, size * exposed.shape[0])
    return np.asarray(exposed + np.float32(share) * (spread - bright), dtype=np.float32)


def _blurred(image: Image, sigma: float) -> Image:
    """Return a picture blurred by a Gaussian [px]; edges fade into what is just inside."""
    step = max(int(sigma / _COARSE), 1)
    coarse = _shrunk(image, step) if step > 1 else image
    for axis in (0, 1):
        coarse = gaussian_filter1d(coarse, sigma / step, axis=axis, mode="nearest", truncate=3.5)
    if step == 1:
        return np.asarray(coarse, dtype=np.float32)
    height, width = image.shape[:2]
    return _stretched(_stretched(coarse, step, width, axis=1), step, height, axis=0)


def _stretched(coarse: Image, step: int, length: int, *, axis: int) -> Image:
    """Return a picture of so many pixels along an axis, linear between the means of blocks."""
    place = np.clip((np.arange(length) + 0.5) / step - 0.5, 0.0, coarse.shape[axis] - 1)
    before = place.astype(np.intp)
    after = np.minimum(before + 1, coarse.shape[axis] - 1)
    share = np.expand_dims((place - before).astype(np.float32), (1 - axis, 2))
    left, right = (np.take(coarse, which, axis=axis) for which in (before, after))
    right -= left
    right *= share
    left += right
    return np.asarray(left, dtype=np.float32)


def _shrunk(image: Image, step: int) -> Image:
    """Return the means of square blocks; the last blocks repeat the edge."""
    height, width = image.shape[:2]
    pad = ((0, -height % step), (0, -width % step), (0, 0))
    whole = np.pad(image, pad, mode="edge")
    rows, columns = whole.shape[0] // step, whole.shape[1] // step
    return np.asarray(whole.reshape(rows, step, columns, step, 3).mean(axis=(1, 3)))
