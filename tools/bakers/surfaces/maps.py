"""Values that surface makers take and give, and the words they share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from sumo3dviz_pt.model.geometry import Floats

BRIGHTEST = 0.85
"""Highest reflectance of any texel: fresh snow and white paint stay below it."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a surface is made from.

    Attributes:
        pixels: Texels along each side.
        tile: Metres along each side.
        albedo: Mean linear reflectance (red, green, blue).
        seed: Of everything random in it.
        params: Numbers of the maker's own, by name.
    """

    pixels: int
    tile: float
    albedo: tuple[float, float, float]
    seed: int = 0
    params: Mapping[str, float] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.pixels, self.pixels

    def waves(self, wavelength: float) -> float:
        """Return the waves per tile of a wavelength [m]."""
        return self.tile / wavelength


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """A tile of a surface; row 0 lies at v = 0, the foot of a wall, as Mitsuba has it.

    Attributes:
        albedo: Linear reflectance, (h, w, 3) in [0, 0.85].
        roughness: Of the principled BSDF, (h, w) in [0, 1]; None if uniform.
    """

    albedo: Floats
    roughness: Floats | None = None


def tinted(value: Floats, colour: ArrayLike) -> Floats:
    """Spread a brightness map, (h, w), over a colour, (3,)."""
    return np.asarray(value[..., None] * np.asarray(colour, dtype=np.float64))


def mixed(first: Floats, second: ArrayLike, weight: Floats) -> Floats:
    """Blend two colour maps.

    Args:
        first: (h, w, 3).
        second: (h, w, 3) or one colour, (3,).
        weight: Of the second, (h, w) in [0, 1].
    """
    share = weight[..., None]
    return np.asarray(first * (1.0 - share) + np.asarray(second, dtype=np.float64) * share)


def with_mean(albedo: Floats, mean: ArrayLike) -> Floats:
    """Scale a colour map so that its channels have the given means, within [0, 0.85].

    Clipping moves the mean, hence a few rounds.
    """
    target = np.asarray(mean, dtype=np.float64)
    for _ in range(6):
        scaled = albedo * (target / np.maximum(albedo.mean(axis=(0, 1)), 1e-9))
        albedo = np.clip(scaled, 0.002, BRIGHTEST)
    return np.asarray(albedo)
