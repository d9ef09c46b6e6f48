"""Colours of filtered sunlight, from a few wavelengths.

References:
    C. Wyman, P.-P. Sloan, P. Shirley, Simple analytic approximations to the CIE XYZ color
    matching functions, JCGT 2(2), 2013.
    IAU 2015 resolution B3 (the sun's effective temperature, 5772 K).
    IEC 61966-2-1 (sRGB primaries).
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats

WAVELENGTHS = np.arange(415.0, 700.0, 30.0)
"""Wavelengths at which light is computed: middles of ten bands of 400 to 700 nm, (10,)."""

_XYZ_TO_SRGB = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
_SOLAR_KELVIN = 5772.0
_LEAST = 0.02  # of the strongest primary: sRGB cannot show purer colours


def _lobe(peak: float, below: float, above: float) -> Floats:
    """Return a Gaussian with two widths [nm], (10,)."""
    width = np.where(peak > WAVELENGTHS, below, above)
    return np.asarray(np.exp(-0.5 * ((WAVELENGTHS - peak) / width) ** 2))


def _observer() -> Floats:
    """Return the CIE 1931 observer's x, y, z at the wavelengths, (10, 3)."""
    x = 1.056 * _lobe(599.8, 37.9, 31.0) + 0.362 * _lobe(442.0, 16.0, 26.7)
    x = x - 0.065 * _lobe(501.1, 20.4, 26.2)
    y = 0.821 * _lobe(568.8, 46.9, 40.5) + 0.286 * _lobe(530.9, 16.3, 31.1)
    z = 1.217 * _lobe(437.0, 11.8, 36.0) + 0.681 * _lobe(459.0, 26.0, 13.8)
    return np.stack([x, y, z], axis=-1)


def _sunlight() -> Floats:
    """Return the sun's spectrum by Planck's law, relative, (10,)."""
    metres = WAVELENGTHS * 1e-9
    return np.asarray(metres**-5.0 / np.expm1(1.4387769e-2 / (metres * _SOLAR_KELVIN)))


def _matrix() -> Floats:
    """Return linear sRGB of sunlight in each band, (10, 3); their sum is white."""
    bands = (_observer() * _sunlight()[:, None]) @ _XYZ_TO_SRGB.T
    return np.asarray(bands / bands.sum(axis=0))


_BANDS = _matrix()


def to_rgb(share: Floats) -> Floats:
    """Return linear sRGB of sunlight of which a share is left at each wavelength.

    Args:
        share: Of the sun's light outside the air, (..., 10).

    Returns:
        (..., 3); 1 where all is left. Colours outside the primaries' triangle are brought
        to its edge.
    """
    rgb = share @ _BANDS
    return np.asarray(np.maximum(rgb, _LEAST * rgb.max(axis=-1, keepdims=True)))
