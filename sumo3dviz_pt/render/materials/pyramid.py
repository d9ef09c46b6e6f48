"""A bitmap at many sizes, each half of the one before, for pixels of all sizes on a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Pyramid:
    """A bitmap at many sizes, each half of the one before.

    Attributes:
        texels: All levels one after the other, (k, 4), in single precision; the last channel pads.
        size: Texels along the finest level, a power of two.
        levels: How many there are.
        mean: Of each channel, (3,).
        spread: Standard deviation of the finest level's brightness, above 0.
    """

    texels: Image
    size: int
    levels: int
    mean: Floats
    spread: float


def make_pyramid(image: Floats | Image) -> Pyramid:
    """Halve an image down to eight texels.

    Args:
        image: Linear values, (n, n, 3); n is a power of two, at least 8.

    Raises:
        ValueError: If it is not square or n is no power of two.
    """
    size = len(image)
    if image.shape[:2] != (size, size) or size < 8 or size & (size - 1):
        raise ValueError("an untiled bitmap is square and its side a power of two")
    grey = (image[..., 0] + image[..., 1] + image[..., 2]) / 3.0
    spread = max(float(grey.std(dtype=np.float64)), 1e-6)
    mean = image.reshape(-1, 3).mean(axis=0, dtype=np.float64)
    levels = []
    while len(image) >= 8:
        levels.append(image.reshape(-1, 3))
        rows = image[::2] + image[1::2]
        image = (rows[:, ::2] + rows[:, 1::2]) / 4.0
    texels = np.concatenate(levels)
    padded = np.zeros((len(texels), 4), dtype=np.float32)
    padded[:, :3] = texels
    return Pyramid(padded, size, len(levels), mean, spread)
