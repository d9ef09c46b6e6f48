"""Noise that repeats without a seam, the raw material of all surface maps.

Everything is periodic over its array, because it is filtered white noise made
by the FFT or a Voronoi diagram on a torus. Same seed, same noise.

References:
    Power spectra k^-2e of natural textures: Voss, "Random fractal forgeries"
    (1985), doi:10.1007/978-3-642-84574-1_34.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, Ints, settled


@dataclass(frozen=True, slots=True)
class Band:
    """Which wavelengths a noise has.

    Attributes:
        exponent: Amplitudes fall as frequency^-exponent; 0 is white noise,
            1 speckle, 2 clouds.
        low: Slowest frequency kept [waves per array]; larger values leave out
            the broad blobs that make a repeated tile visible.
        high: Fastest frequency kept [waves per array], with a soft end.
        stretch: Makes features this many times longer along rows (x); below 1
            along columns (y).
    """

    exponent: float = 1.8
    low: float = 1.0
    high: float = np.inf
    stretch: float = 1.0


def _frequencies(shape: tuple[int, int], stretch: float) -> Floats:
    """Frequency of each FFT coefficient, (h, w // 2 + 1) [waves per array]."""
    rows = np.fft.fftfreq(shape[0]) * shape[0]
    columns = np.fft.rfftfreq(shape[1]) * shape[1]
    aspect = np.sqrt(stretch)
    return np.asarray(np.hypot(rows[:, None] / aspect, columns[None, :] * aspect))


def fractal(shape: tuple[int, int], band: Band, *, seed: int) -> Floats:
    """Periodic noise with a power-law spectrum.

    Args:
        shape: Rows and columns.
        band: Its spectrum.
        seed: Of the random numbers.

    Returns:
        Noise of mean 0 and standard deviation 1, (h, w).
    """
    frequency = _frequencies(shape, band.stretch)
    gain = np.where(
        settled(frequency - band.low) >= 0.0, np.maximum(frequency, 1e-9) ** -band.exponent, 0.0
    )
    if np.isfinite(band.high):
        gain *= np.exp(-((frequency / band.high) ** 4))
    gain[0, 0] = 0.0
    white = np.random.default_rng(seed).standard_normal(shape)
    noise = np.fft.irfft2(np.fft.rfft2(white) * gain, s=shape)
    return np.asarray(noise / noise.std())


def blurred(image: Floats, sigma: float) -> Floats:
    """Periodic Gaussian blur, standard deviation in pixels, (h, w)."""
    rows = np.fft.fftfreq(image.shape[0])[:, None]
    columns = np.fft.rfftfreq(image.shape[1])[None, :]
    gain = np.exp(-2.0 * (np.pi * sigma) ** 2 * (rows**2 + columns**2))
    return np.asarray(np.fft.irfft2(np.fft.rfft2(image) * gain, s=image.shape))


def soft(values: Floats, limit: float) -> Floats:
    """Squeeze outliers into (-limit, limit) so that no single feature stands out."""
    return np.asarray(limit * np.tanh(values / limit))


def smoothstep(low: float, high: float, values: Floats) -> Floats:
    """0 below `low`, 1 above `high`, a smooth S between."""
    t = np.clip((values - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


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
    """Voronoi cells around a jittered grid.

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
