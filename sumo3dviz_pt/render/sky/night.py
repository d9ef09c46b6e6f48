"""The sky at night: airglow, stars, a city's glow, and the moon's light.

References:
    Kyba, Mohar and Posch, How bright is moonlight?, Astronomy & Geophysics 58(1), 2017
    (0.32 lx at most; usually less).
    Allen's Astrophysical Quantities, 4th ed., 2000 (magnitude 0 is 2.54e-6 lx).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.lamps import CANDELAS_PER_UNIT
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.render.sky.daylight import SUN_RADIUS, daylight
from sumo3dviz_pt.render.sky.panorama import angles, directions

MOON_PER_SUN = 0.32 / 128_000.0
"""Light of the full moon against that of the sun, both outside the air."""

STAR_GAIN = 10.0
"""Stars are this much brighter than real ones, and their range is compressed: a picture exposed
for street lamps would show only a handful."""

_STARS, _FAINTEST, _STEEPNESS = 5000, 6.2, 1.25  # 10^0.5 times more stars per magnitude
_BRIGHTEST, _RANGE = 0.0, 0.68
_LUX_OF_ZERO = 2.54e-6
# Glow around the moon: angle over which it falls [deg], radiance against the disc's.
_HALO = ((0.35, 0.006), (1.6, 0.0006), (7.0, 0.00006))
_COOL = np.array([0.80, 1.0, 1.36])  # colour of moonlight where white is a street lamp's light


def night_dome(sky: Sky, size: tuple[int, int]) -> tuple[Image, Floats]:
    """Return the upper half of the night sky without clouds, and the moon's irradiance.

    Args:
        sky: Its recipe.
        size: Rows and columns of the dome.

    Returns:
        Radiance, (h, w, 3), and irradiance facing the moon, (3,), in scene units.
    """
    dome = np.broadcast_to(np.asarray(sky.night, np.float32), (*size, 3)).copy()
    if max(sky.glow) > 0.0:
        dome += glow(sky.glow, size)
    if sky.stars is not None:
        _add_stars(dome, seed=sky.stars)
    if sky.moon_direction is None:
        return dome, np.zeros(3)
    moonlight = daylight(sky.moon_direction, sky.turbidity, size)
    dim = MOON_PER_SUN * _COOL
    dome += moonlight.dome * dim.astype(np.float32)
    _add_halo(dome, moonlight.sun * dim, sky.moon_direction)
    return dome, moonlight.sun * dim


def glow(horizon: tuple[float, float, float], size: tuple[int, int]) -> Image:
    """Return a city's light dome: brightest at the horizon and over two centres, (h, w, 3)."""
    high, around = angles(size, share=0.5)
    degrees = np.degrees(high)
    fall = 0.70 * np.exp(-degrees / 7.0) + 0.24 * np.exp(-degrees / 24.0) + 0.06
    lobes = 0.55 * np.exp(2.2 * (np.cos(around - 0.9) - 1.0))
    lobes += 0.40 * np.exp(5.0 * (np.cos(around - 3.9) - 1.0))
    reach = np.exp(-degrees / 30.0)[:, None]
    shape = fall[:, None] * (0.75 + lobes[None, :] * reach)
    return np.asarray(shape[..., None] * np.asarray(horizon), dtype=np.float32)


def _add_stars(dome: Image, *, seed: int) -> None:
    """Paint seeded stars: Pareto fluxes, colours from orange to blue, dimmed by thick air.

    Each lies on one texel's centre, so that it is shown one texel wide. Near the zenith, where
    texels are narrow, it is spread over several, so that it looks round.
    """
    rows, columns = dome.shape[:2]
    rng = np.random.default_rng(seed)
    sine, azimuth = rng.uniform(0.05, 1.0, _STARS), rng.uniform(0.0, 1.0, _STARS)
    magnitude = _FAINTEST - 2.5 * np.log10(1.0 + rng.pareto(_STEEPNESS, _STARS))
    magnitude = _RANGE * np.maximum(magnitude, _BRIGHTEST)
    warmth = np.clip(rng.normal(0.0, 0.16, (_STARS, 1)), -0.3, 0.4)
    colour = np.clip(1.0 + warmth * np.array([1.0, 0.0, -1.4]), 0.2, 2.0)
    lux = STAR_GAIN * _LUX_OF_ZERO * 10.0 ** (-0.4 * (magnitude + 0.25 / sine))
    row = np.minimum((1.0 - np.arcsin(sine) / (np.pi / 2)) * rows, rows - 1).astype(np.intp)
    level = np.sqrt(1.0 - sine**2)
    width = np.clip(np.round(1.0 / np.maximum(level, 1e-3)), 1, 16).astype(np.intp)
    texel = (np.pi / 2 / rows) * (2 * np.pi / columns) * np.maximum(level, 1e-3) * width
    radiance = (lux / texel / CANDELAS_PER_UNIT)[:, None] * colour / (colour @ LUMINANCE)[:, None]
    star: NDArray[np.intp] = np.repeat(np.arange(_STARS), width)
    step = np.arange(len(star)) - np.repeat(np.cumsum(width) - width, width)
    place = ((azimuth * columns).astype(np.intp)[star] + step) % columns
    np.add.at(dome, (row[star], place), radiance[star].astype(np.float32))


def _add_halo(dome: Image, irradiance: Floats, moon: Floats) -> None:
    """Add the glow that air and lens put around the moon's disc."""
    towards = directions((dome.shape[0] // 4, dome.shape[1] // 4), share=0.5)
    near = towards @ moon > np.cos(np.radians(30.0))
    rows = np.flatnonzero(near.any(axis=1))
    if not rows.size:
        return
    band = slice(4 * rows[0], 4 * rows[-1] + 4)
    high, around = angles(dome.shape[:2], share=0.5)
    level = np.hypot(moon[0], moon[1])
    turn = np.cos(around - np.arctan2(moon[0], moon[1]))
    cosine = np.sin(high[band])[:, None] * moon[2] + np.cos(high[band])[:, None] * level * turn
    away = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    disc = irradiance / (np.pi * SUN_RADIUS**2)
    rings = sum(share * np.exp(-away / width) for width, share in _HALO)
    dome[band] += (np.asarray(rings)[..., None] * disc).astype(np.float32)
