"""Asphalt, concrete and paving.

Amplitudes follow what made prototype frames read as photographs: several scales
of mild stains, visible aggregate, and no single strong feature that would show
where the tile repeats.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bakers.noise import blurred, soft
from bakers.surfaces.maps import Maps, Recipe, mixed, tinted, with_mean
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep
from sumo3dviz_pt.model.geometry import Floats, Ints

BITUMEN = (0.028, 0.027, 0.026)
"""Linear reflectance of sealing and of the inside of cracks."""


def _aggregate(recipe: Recipe) -> Floats:
    """Draw stones in the binder: dark grain with some light chips, (h, w), about unit spread."""
    rng = np.random.default_rng(recipe.seed + 100)
    stones = blurred(rng.standard_normal(recipe.shape), 0.62)
    stones /= stones.std()
    return np.clip(stones, -1.6, 2.8) + 0.35 * np.maximum(stones - 1.3, 0.0) ** 2


def _stains(recipe: Recipe) -> Floats:
    """Draw the relative brightness of patches and stains from 4 m down to centimetres, (h, w)."""
    seed, low = recipe.seed, recipe.waves(recipe.params.get("broadest", 3.0))
    broad = soft(fractal(recipe.shape, Spectrum(2.0, low), seed=seed + 1), 1.6)
    middle = soft(fractal(recipe.shape, Spectrum(1.4, 2 * low), seed=seed + 2), 1.8)
    speckle = soft(fractal(recipe.shape, Spectrum(1.0, 4 * low), seed=seed + 3), 2.2)
    return np.asarray(0.045 * broad + 0.05 * middle + 0.07 * speckle)


def _cracks(recipe: Recipe) -> Floats:
    """Make a mask of cracks from level lines of noise inside weak zones, (h, w) in [0, 1]."""
    amount = recipe.params.get("cracks", 0.0)
    if amount <= 0:
        return np.zeros(recipe.shape)
    paths = fractal(recipe.shape, Spectrum(1.75, 2.0), seed=recipe.seed + 4)
    slope = np.hypot(*np.gradient(paths)) + 1e-4
    line = np.clip(1.15 - np.abs(paths) / slope, 0.0, 1.0)
    zones = fractal(recipe.shape, Spectrum(2.2, 2.0), seed=recipe.seed + 5)
    return np.asarray(amount * line * smoothstep(0.3, 1.1, zones))


def asphalt(recipe: Recipe) -> Maps:
    """Make asphalt concrete; params `grain`, `mottle`, `stains`, `cracks`, `broadest` [m]."""
    grain = recipe.params.get("grain", 0.19)
    value = 1.0 + recipe.params.get("stains", 1.0) * _stains(recipe) + grain * _aggregate(recipe)
    # Clusters of stones: what the eye sees of the aggregate from a few metres.
    clusters = fractal(
        recipe.shape, Spectrum(0.35, recipe.waves(0.14), recipe.waves(0.02)), seed=recipe.seed + 8
    )
    value += recipe.params.get("mottle", 0.0) * soft(clusters, 2.0)
    # Chips of different rock: a little warmer or cooler than the binder.
    hue = 0.02 * fractal(recipe.shape, Spectrum(1.2, recipe.waves(1.0)), seed=recipe.seed + 6)
    colour = np.stack([value * (1 + hue), value, value * (1 - hue)], axis=-1)
    cracks = _cracks(recipe)
    colour = mixed(with_mean(colour, recipe.albedo), BITUMEN, cracks)
    # Polish varies slowly: a quarter of the texels is enough.
    coarse = (recipe.pixels // 4, recipe.pixels // 4)
    polish = fractal(coarse, Spectrum(1.2, recipe.waves(2.0)), seed=recipe.seed + 7)
    rough = np.clip(0.66 + 0.03 * soft(polish, 2.0), 0.3, 1.0)
    return Maps(with_mean(colour, recipe.albedo), rough)


def concrete(recipe: Recipe) -> Maps:
    """Make cast concrete with pores and water marks; params `pores`, `marks`."""
    shape, seed = recipe.shape, recipe.seed
    marks = soft(fractal(shape, Spectrum(1.7, 2.0), seed=seed + 1), 1.8)
    fine = soft(fractal(shape, Spectrum(0.9, 8.0), seed=seed + 2), 2.5)
    pores = smoothstep(2.3, 3.0, fractal(shape, Spectrum(0.5, 60.0, 300.0), seed=seed + 3))
    value = 1.0 + recipe.params.get("marks", 0.06) * marks + 0.055 * fine
    value = value * (1.0 - recipe.params.get("pores", 0.45) * pores)
    warm = 0.012 * soft(fractal(shape, Spectrum(1.6, 2.0), seed=seed + 4), 1.8)
    colour = np.stack([value * (1 + warm), value, value * (1 - warm)], axis=-1)
    return Maps(with_mean(colour, recipe.albedo))


def paving(recipe: Recipe) -> Maps:
    """Make slabs of all lengths in courses, with joints, dirt and gum.

    Params `slab` (mean length) [m], `joint` [m], `variety`, `gum` (spots on a square
    metre).
    """
    texel = recipe.tile / recipe.pixels
    y, x = (np.indices(recipe.shape) + 0.5) * texel
    gap, slab, count = _courses(recipe, x, y)
    joint = recipe.params.get("joint", 0.008)
    # Anti-aliased: joints are about as wide as a texel.
    joints = np.clip((joint / 2 - gap) / texel + 0.5, 0.0, 1.0)
    edge = np.exp(-np.maximum(gap - joint / 2, 0.0) / 0.012)
    rng = np.random.default_rng(recipe.seed + 50)
    tones = 1 + recipe.params.get("variety", 0.07) * rng.standard_normal(count).clip(-2, 2)
    hues = 0.02 * rng.standard_normal((count, 1)).clip(-2, 2) * [1.0, 0.0, -1.0]
    base = concrete(recipe).albedo * tones[slab][..., None] * (1.0 + hues[slab])
    dirt = 0.07 * soft(fractal(recipe.shape, Spectrum(1.2, 4.0), seed=recipe.seed + 8), 1.6)
    blots = smoothstep(1.2, 2.6, fractal(recipe.shape, Spectrum(1.6, 5.0), seed=recipe.seed + 9))
    colour = base * (1.0 - dirt - 0.10 * edge - 0.16 * blots - 0.34 * _gum(recipe, x, y))[..., None]
    sand = tinted(np.full(recipe.shape, 0.42), np.asarray(recipe.albedo) * (1.05, 0.97, 0.86))
    return Maps(with_mean(mixed(colour, sand, joints), recipe.albedo))


class _Slabs(NamedTuple):
    """Slabs in courses: distance from the nearest joint [m], (h, w), and which slab, (h, w)."""

    gap: Floats
    number: Ints
    total: int


def _courses(recipe: Recipe, x: Floats, y: Floats) -> _Slabs:
    """Lay slabs at places [m], (h, w) each."""
    length = recipe.params.get("slab", 0.5)
    rng = np.random.default_rng(recipe.seed + 51)
    rows = _splits(recipe.tile, 0.8 * length, 0.25, rng)
    row = np.searchsorted(rows, y[:, 0], side="right") - 1
    gap = np.minimum(y - rows[row][:, None], rows[row + 1][:, None] - y)
    slab = np.zeros(recipe.shape, dtype=np.int64)
    first = 0
    for number in range(len(rows) - 1):
        ends = _splits(recipe.tile, length, 0.42, rng)
        shift = rng.uniform(0.0, recipe.tile)
        own = row == number
        at = (x[own] + shift) % recipe.tile
        column = np.searchsorted(ends, at, side="right") - 1
        gap[own] = np.minimum(gap[own], np.minimum(at - ends[column], ends[column + 1] - at))
        slab[own] = first + column
        first += len(ends) - 1
    return _Slabs(gap, slab, first)


def _splits(whole: float, mean: float, spread: float, rng: np.random.Generator) -> Floats:
    """Return the places that part a length [m] into pieces of about a mean."""
    sizes = 1.0 + spread * rng.uniform(-1.0, 1.0, round(whole / mean))
    ends = np.append(0.0, np.cumsum(sizes))
    return np.asarray(ends * (whole / ends[-1]))


def _gum(recipe: Recipe, x: Floats, y: Floats) -> Floats:
    """Draw trodden chewing gum, dark round spots, (h, w) in [0, 1]."""
    rng = np.random.default_rng(recipe.seed + 52)
    spots = np.zeros(recipe.shape)
    texel = recipe.tile / recipe.pixels
    for _ in range(round(recipe.params.get("gum", 0.0) * recipe.tile**2)):
        (u, v), radius, tone = rng.uniform(0.1, recipe.tile - 0.1, 2), *rng.uniform(0.4, 1.0, 2)
        box = tuple(slice(int((c - 0.04) / texel), int((c + 0.04) / texel) + 1) for c in (v, u))
        away = np.hypot(x[box] - u, y[box] - v)
        spots[box] = np.maximum(spots[box], tone * smoothstep(0.03 * radius, 0.012 * radius, away))
    return spots
