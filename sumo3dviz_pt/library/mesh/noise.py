"""Noise that repeats without a seam.

It is periodic over its array, because it is white noise filtered by the FFT. The same seed
gives the same noise.

References:
    Power spectra k^-2e of natural textures: Voss, "Random fractal forgeries"
    (1985), doi:10.1007/978-3-642-84574-1_34.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, settled
from sumo3dviz_pt.model.numbers import eased


@dataclass(frozen=True, slots=True)
class Spectrum:
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
    """Return the frequency of each FFT coefficient, (h, w // 2 + 1) [waves per array]."""
    rows = np.fft.fftfreq(shape[0]) * shape[0]
    columns = np.fft.rfftfreq(shape[1]) * shape[1]
    aspect = np.sqrt(stretch)
    return np.asarray(np.hypot(rows[:, None] / aspect, columns[None, :] * aspect))


def fractal(shape: tuple[int, int], band: Spectrum, *, seed: int) -> Floats:
    """Make periodic noise with a power-law spectrum.

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


def smoothstep(low: float, high: float, values: Floats) -> Floats:
    """Rise from 0 to 1 in a smooth S, same shape as `values`.

    Args:
        low: Value up to which the result is 0; may be the larger of the two.
        high: Value from which on it is 1.
        values: Any shape.
    """
    t = np.clip((values - low) / (high - low), 0.0, 1.0)
    return np.asarray(eased(t))
