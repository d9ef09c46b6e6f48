"""Bakes the picture of small waves that water shows: their normals, as Mitsuba reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal

_FILE = "waves.png"
_PIXELS = 512
_STEEP = 0.055
"""Standard deviation of the slope of waves in a light wind."""


def waves_pixels() -> NDArray[np.uint8]:
    """Return a tile of normals, (h, w, 3), each component from -1 to 1 as 0 to 255.

    References:
        Cox and Munk, "Measurement of the roughness of the sea surface from photographs of the
        sun's glitter", JOSA 44 (1954): slopes of about 0.05 without much wind.
    """
    shape = (_PIXELS, _PIXELS)
    swell = fractal(shape, Spectrum(1.6, 3.0, 26.0, stretch=1.8), seed=41)
    ripples = fractal(shape, Spectrum(1.0, 12.0, 70.0), seed=42)
    height = swell + 0.28 * ripples
    along = np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)
    up = np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0)
    slope = np.stack([along, up], axis=-1)
    slope *= _STEEP / slope.std()
    normal = np.concatenate([-slope, np.ones((*shape, 1))], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.round(255.0 * (0.5 + 0.5 * normal)).astype(np.uint8)


def bake_waves(folder: Path) -> tuple[Path, ...]:
    """Make the picture in a folder again, the same pixels every time; return what was written."""
    write_png(folder / _FILE, waves_pixels())
    return (folder / _FILE,)
