"""Blur, soft limits and Voronoi cells on arrays that repeat without a seam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, Ints


def blurred(image: Floats, sigma: float) -> Floats:
    """Blur a periodic image, (h, w), by a Gaussian with a standard deviation in pixels."""
    rows = np.fft.fftfreq(image.shape[0])[:, None]
    columns = np.fft.rfftfreq(image.shape[1])[None, :]
    gain = np.exp(-2.0 * (np.pi * sigma) ** 2 * (rows**2 + columns**2))
    return np.asarray(np.fft.irfft2(np.fft.rfft2(image) * gain, s=image.shape))


def soft(values: Floats, limit: float) -> Floats:
    """Squeeze outliers into (-limit, limit) so that no single feature stands out."""
    return np.asarray(limit * np.tanh(values / limit))


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """A Voronoi diagram on a torus.

    Attributes:
        owner: Index of the cell that each pixel lies in, (h, w).
        nearest: Distance to its own seed point, (h, w) [cell widths].
        edge: Distance to the border between two cells, (h, w) [cell widths].
    """

    owner: Ints
    nearest: Floats
    edge: Floats


def cells(size: int, across: int, *, jitter: float, seed: int) -> Cells:
    """Make Voronoi cells around a jittered grid.

    Args:
        size: Pixels along each side.
        across: Cells along each side.
        jitter: How far seed points leave their grid, [0, 1] cell widths.
        seed: Of the random numbers.
    """
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(across) + 0.5] * 2, indexing="ij"), -1).reshape(-1, 2)
    points = (grid + jitter * rng.uniform(-0.5, 0.5, grid.shape)) % across
    pixel = (np.arange(size) + 0.5) * across / size
    asked = np.stack(np.meshgrid(pixel, pixel, indexing="ij"), -1).reshape(-1, 2)
    found = cKDTree(points, boxsize=np.full(2, float(across))).query(asked, k=2)
    distance, index = np.asarray(found[0]), np.asarray(found[1], dtype=np.int64)
    first, second = points[index[:, 0]], points[index[:, 1]]
    apart = (second - first + across / 2) % across - across / 2
    # Distance to the perpendicular bisector of the two nearest points.
    edge = (distance[:, 1] ** 2 - distance[:, 0] ** 2) / (2 * np.linalg.norm(apart, axis=1))
    shape = (size, size)
    return Cells(
        index[:, 0].reshape(shape), distance[:, 0].reshape(shape), np.asarray(edge).reshape(shape)
    )
