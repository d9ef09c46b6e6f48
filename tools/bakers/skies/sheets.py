"""Thin and closed cloud: cirrus, fields of altocumulus, stratus; sheets without depth.

Each is a periodic picture on a shell above the round Earth, seen from below.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates

from bakers.noise import soft
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep
from sumo3dviz_pt.model.geometry import Floats

_EARTH = 6.371e6
_TEXELS = (2048, 2048)


def _places(towards: Floats, height: float) -> Floats:
    """Return where rays meet a shell, (n, 2) [m]; `towards` holds unit vectors, (n, 3)."""
    up = _EARTH * towards[:, 2]
    way = np.sqrt(up**2 + 2 * _EARTH * height + height**2) - up
    return np.asarray(towards[:, :2] * way[:, None])


def _look_up(picture: Floats, places: Floats, span: float) -> Floats:
    """Look up a periodic picture, (h, w), at places, (n, 2) [m]."""
    at = (places * (picture.shape[0] / span)).T
    found = map_coordinates(picture.astype(np.float32), at, order=1, mode="grid-wrap")
    return np.asarray(found, dtype=np.float64)


def _turned(places: Floats, angle: float) -> Floats:
    """Turn the frame of places, (n, 2), by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(places @ np.array([[c, s], [-s, c]]))


def _forward(towards: Floats, sun: Floats) -> Floats:
    """Return how much brighter ice is around the sun, (n,)."""
    away = np.degrees(np.arccos(np.clip(towards @ sun, -1.0, 1.0)))
    return np.asarray(np.exp(-away / 9.0) + 0.35 * np.exp(-away / 28.0))


def _backlight(towards: Floats, sun: Floats, share: float) -> Floats:
    """Return the light that thin cloud before a low sun throws forward, (n,): the silver lining.

    A narrow and a wide lobe, as droplets and ice crystals have.
    """
    away = np.degrees(np.arccos(np.clip(towards @ sun, -1.0, 1.0)))
    return np.asarray(share * (2.6 * np.exp(-away / 7.0) + 0.9 * np.exp(-away / 26.0)))


def cirrus(
    towards: Floats, *, seed: int, opacity: float, sun: Floats, backlit: float = 0.0
) -> Floats:
    """Make hair of ice, combed and curled by the wind.

    Args:
        towards: Unit vectors above the horizon, (n, 3).
        seed: Of its pattern.
        opacity: Of its densest strands, [0, 1].
        sun: Unit vector to the sun, (3,).
        backlit: How strongly it shines around a low sun.

    Returns:
        Opacity, sunlit and skylit share, (n, 3).
    """
    streaks = fractal(_TEXELS, Spectrum(1.75, 5.0, 260.0, stretch=7.0), seed=seed)
    strands = fractal(_TEXELS, Spectrum(1.2, 40.0, 420.0, stretch=20.0), seed=seed + 1)
    patches = fractal(_TEXELS, Spectrum(1.9, 1.0, 12.0, stretch=1.6), seed=seed + 2)
    bend = fractal(_TEXELS, Spectrum(2.4, 1.0, 7.0), seed=seed + 3)
    sheet = soft(streaks, 2.2) + 0.12 * strands
    there = smoothstep(-0.4, 1.6, patches)
    span = 70_000.0
    places = _turned(_places(towards, 9_000.0), 0.7)
    places[:, 0] += 2_200.0 * _look_up(bend, places, span)
    hair = smoothstep(-1.4, 2.6, _look_up(sheet, places, span)) ** 1.3
    cover = opacity * hair * _look_up(there, places, span)
    lit = 0.40 + 0.9 * _forward(towards, sun)
    lit = np.minimum(lit, 1.3) + _backlight(towards, sun, backlit)
    return np.column_stack([cover, lit, np.full(len(towards), 0.75)])


def altocumulus(towards: Floats, *, seed: int, opacity: float, sun: Floats) -> Floats:
    """Make fields of small flakes in rows.

    Args:
        towards: Unit vectors above the horizon, (n, 3).
        seed: Of its pattern.
        opacity: Of its densest parts, [0, 1].
        sun: Unit vector to the sun, (3,).

    Returns:
        Opacity, sunlit and skylit share, (n, 3).
    """
    flakes = fractal(_TEXELS, Spectrum(0.3, 60.0, 170.0, stretch=0.6), seed=seed)
    ragged = fractal(_TEXELS, Spectrum(1.4, 120.0, 700.0), seed=seed + 1)
    fields = fractal(_TEXELS, Spectrum(1.7, 1.5, 24.0, stretch=1.8), seed=seed + 2)
    body = soft(flakes, 2.0) + 0.45 * ragged
    where = np.minimum(1.3 * fields - 1.2, 0.25)
    span, height = 60_000.0, 4_200.0
    places = _turned(_places(towards, height), -0.4)
    there = _look_up(where, places, span)
    thick = np.clip(_look_up(body, places, span) + there, 0.0, 3.0)
    veil = smoothstep(-0.6, 0.7, there)
    cover = opacity * np.maximum(smoothstep(0.0, 1.9, thick), 0.30 * veil)
    ahead = _turned(sun[None, :2], -0.4) * 130.0
    shade = np.clip(_look_up(body, places + ahead, span) + there, 0.0, 3.0)
    lit = 0.16 + 0.50 * np.exp(-0.45 * thick - 0.55 * shade) + 0.55 * _forward(towards, sun)
    return np.column_stack([cover, np.minimum(lit, 1.2), 0.95 - 0.16 * np.minimum(thick, 2.5)])


def mackerel(
    towards: Floats, *, seed: int, opacity: float, sun: Floats, backlit: float = 0.0
) -> Floats:
    """Make altocumulus of a fair evening: cells grow, merge and fray from place to place.

    Args:
        towards: Unit vectors above the horizon, (n, 3).
        seed: Of its pattern.
        opacity: Of its densest parts, [0, 1].
        sun: Unit vector to the sun, (3,).
        backlit: How strongly it shines around a low sun.

    Returns:
        Opacity, sunlit and skylit share, (n, 3).
    """
    small = soft(fractal(_TEXELS, Spectrum(0.5, 110.0, 340.0, stretch=0.7), seed=seed), 2.0)
    large = soft(fractal(_TEXELS, Spectrum(0.7, 34.0, 150.0, stretch=0.55), seed=seed + 1), 2.0)
    ragged = fractal(_TEXELS, Spectrum(1.5, 60.0, 800.0), seed=seed + 2)
    fields = fractal(_TEXELS, Spectrum(1.8, 1.2, 26.0, stretch=1.7), seed=seed + 3)
    mixed = smoothstep(-0.8, 0.8, fractal(_TEXELS, Spectrum(1.6, 1.0, 9.0), seed=seed + 4))
    bend = fractal(_TEXELS, Spectrum(2.2, 1.0, 14.0), seed=seed + 5)
    body = (1.0 - mixed) * small + mixed * large + 0.5 * ragged
    # Broad: how closed the field is; cells hardly matter where it is dense.
    where = np.minimum(1.3 * fields - 0.85, 0.8)
    span, height = 60_000.0, 4_200.0
    places = _turned(_places(towards, height), -0.4)
    places[:, 1] += 1_500.0 * _look_up(bend, places, span)
    there = _look_up(where, places, span)
    thick = np.clip(0.6 * _look_up(body, places, span) + 1.2 * there + 0.5, 0.0, 3.0)
    veil = smoothstep(-1.1, 0.8, there)
    # Cells thin out into a veil, and the veil into nothing.
    cover = opacity * veil * np.maximum(smoothstep(-0.2, 2.4, thick), 0.30)
    ahead = _turned(sun[None, :2], -0.4) * 150.0
    shade = np.clip(0.6 * _look_up(body, places + ahead, span) + 1.2 * there + 0.5, 0.0, 3.0)
    lit = 0.22 + 0.62 * np.exp(-0.40 * thick - 0.45 * shade)
    lit += _backlight(towards, sun, backlit) * np.exp(-0.9 * thick)
    return np.column_stack([cover, lit, 0.95 - 0.14 * np.minimum(thick, 2.5)])


def stratus(towards: Floats, *, seed: int) -> Floats:
    """Make a closed deck of soft darker patches that hides sun and sky; (n, 3) as in `cirrus`.

    Three times brighter at the zenith than at the horizon, the CIE's overcast sky.
    """
    broad = fractal(_TEXELS, Spectrum(1.7, 1.0, 40.0, stretch=0.8), seed=seed)
    lumps = soft(fractal(_TEXELS, Spectrum(1.6, 9.0, 260.0, stretch=0.7), seed=seed + 1), 2.0)
    bend = fractal(_TEXELS, Spectrum(2.0, 1.0, 20.0), seed=seed + 2)
    deck = soft(0.85 * broad + 0.42 * lumps, 2.0)
    span, height = 36_000.0, 1_500.0
    places = _turned(_places(towards, height), 0.3)
    places += 900.0 * _look_up(bend, places, span)[:, None]
    thick = _look_up(deck, places, span)
    # Far lumps lie behind one another and grow even.
    seen = smoothstep(0.0, 0.45, towards[:, 2]) * 0.88 + 0.12
    glow = np.exp(-0.23 * seen * thick) * (1.0 + 2.0 * towards[:, 2]) / 3.0 * 1.3
    return np.column_stack([np.ones(len(towards)), 0.17 * glow, 0.50 * glow])
