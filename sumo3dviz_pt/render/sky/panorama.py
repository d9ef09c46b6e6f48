"""Equirectangular maps: directions, light on the ground, resampling.

Rows go from the zenith downwards, columns clockwise from north. A *dome* is the upper
half of such a map.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats, Image


def angles(size: tuple[int, int], *, share: float = 1.0) -> tuple[Floats, Floats]:
    """Return the elevations of the rows and azimuths of the columns [rad].

    Args:
        size: Rows and columns.
        share: Of the way from zenith to nadir that the rows cover; a dome covers 0.5.
    """
    rows, columns = size
    elevation = np.pi / 2 - (np.arange(rows) + 0.5) / rows * np.pi * share
    return elevation, (np.arange(columns) + 0.5) / columns * 2 * np.pi


def directions(size: tuple[int, int], *, share: float = 1.0) -> Floats:
    """Return the world direction of every texel's centre, (h, w, 3); arguments as in `angles`."""
    high, around = angles(size, share=share)
    level = np.cos(high)[:, None]
    up = np.broadcast_to(np.sin(high)[:, None], size)
    return np.stack([level * np.sin(around), level * np.cos(around), up], axis=-1)


def dome_irradiance(dome: Floats | Image) -> Floats:
    """Return the light of a dome, (h, w, 3), on a horizontal plane, (3,) in the dome's unit."""
    rows = len(dome)
    high, _ = angles((rows, 1), share=0.5)
    weights = np.sin(high) * np.cos(high) * (np.pi / 2 / rows) * 2 * np.pi
    return np.asarray(weights @ dome.mean(axis=1, dtype=np.float64))


def _neighbours(count: int, known: int) -> tuple[NDArray[np.intp], Floats]:
    """Return the nearest known texel before each of `count`, and the share of the next one."""
    place = (np.arange(count) + 0.5) / count * known - 0.5
    first = np.floor(place).astype(np.intp)
    return first, place - first


def resampled(image: Floats | Image, size: tuple[int, int], rotation: float = 0.0) -> Image:
    """Bring a map or dome, (h, w, c), to a size, turned clockwise, linear in between.

    Args:
        image: Maps are periodic along their columns and end with their rows.
        size: Rows and columns wanted.
        rotation: Rounded to whole texels where the map has the columns wanted [rad].
    """
    rows, columns = size
    height, width = image.shape[:2]
    result = np.asarray(image, dtype=np.float32)
    if width == columns:
        result = np.roll(result, round(rotation / (2 * np.pi) * width), axis=1)
    if height != rows:
        top, share = _neighbours(rows, height)
        down = share[:, None, None].astype(np.float32)
        low, high = np.clip(top, 0, height - 1), np.clip(top + 1, 0, height - 1)
        result = result[low] * (1 - down) + result[high] * down
    if width != columns:
        turned = np.arange(columns) + 0.5 - rotation / (2 * np.pi) * columns
        place = turned / columns * width - 0.5
        left = np.floor(place).astype(np.intp)
        right = (place - left)[None, :, None].astype(np.float32)
        result = result[:, left % width] * (1 - right) + result[:, (left + 1) % width] * right
    return np.asarray(result)


def at(values: Floats | Image, direction: Floats, *, share: float = 1.0) -> Floats:
    """Return a map's value in one direction.

    Args:
        values: The map, (h, w, ...).
        direction: Unit vector, (3,).
        share: Of the way from zenith to nadir that the rows cover.
    """
    rows, columns = values.shape[:2]
    row = np.arccos(np.clip(direction[2], -1, 1)) / (np.pi * share) * rows
    column = (np.arctan2(direction[0], direction[1]) / (2 * np.pi)) % 1.0 * columns
    return np.asarray(values[min(int(row), rows - 1), int(column) % columns])
