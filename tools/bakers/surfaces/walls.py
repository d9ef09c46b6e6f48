"""Plaster, brick and roof tiles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bakers.noise import soft
from bakers.surfaces.maps import Maps, Recipe, mixed, tinted, with_mean
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep
from sumo3dviz_pt.model.geometry import Floats, Ints


def plaster(recipe: Recipe) -> Maps:
    """Make painted render; params `stains`, `streaks` (rain marks run down), `grain`."""
    shape, seed = recipe.shape, recipe.seed
    stains = soft(fractal(shape, Spectrum(1.8, 2.0), seed=seed + 1), 1.6)
    streaks = soft(fractal(shape, Spectrum(1.4, 4.0, stretch=1 / 12), seed=seed + 2), 1.6)
    grain = soft(fractal(shape, Spectrum(0.35, 60.0), seed=seed + 3), 2.2)
    value = 1 + recipe.params.get("stains", 0.022) * stains
    value = value - recipe.params.get("streaks", 0.020) * np.maximum(streaks, 0.0)
    value = value + recipe.params.get("grain", 0.030) * grain
    return Maps(with_mean(tinted(value, np.ones(3)), recipe.albedo))


class _Bond(NamedTuple):
    """Which brick texels lie in, and where from its lower left corner [m], (h, w) each."""

    row: Ints
    column: Ints
    x: Floats
    y: Floats


def _courses(recipe: Recipe, size: tuple[float, float]) -> _Bond:
    """Lay a running bond of bricks of a length and height [m]."""
    length, height = size
    y, x = (np.indices(recipe.shape) + 0.5) * recipe.tile / recipe.pixels
    row = np.floor(y / height).astype(np.int64)
    along = (x + (row % 2) * length / 2) % recipe.tile
    column = np.floor(along / length).astype(np.int64)
    return _Bond(row, column, along % length, y % height)


def _per_unit(recipe: Recipe, size: tuple[float, float], *, spread: float, salt: int) -> Floats:
    """Draw a random factor for each brick or tile, (rows, columns), around 1."""
    shape = (round(recipe.tile / size[1]), round(recipe.tile / size[0]))
    noise = np.random.default_rng(recipe.seed + salt).standard_normal(shape).clip(-2.2, 2.2)
    return np.exp(spread * noise)


def brick(recipe: Recipe) -> Maps:
    """Make a stretcher bond, 250 x 75 mm with 10 mm joints; params `joint` [m], `variety`."""
    size, texel = (0.25, 0.075), recipe.tile / recipe.pixels
    row, column, x, y = _courses(recipe, size)
    gap = np.minimum(np.minimum(x, size[0] - x), np.minimum(y, size[1] - y))
    wobble = 0.0012 * fractal(recipe.shape, Spectrum(0.9, 20.0), seed=recipe.seed + 5)
    half = recipe.params.get("joint", 0.010) / 2
    joints = np.clip((half + wobble - gap) / texel + 0.5, 0.0, 1.0)
    spread = recipe.params.get("variety", 0.17)
    tone = _per_unit(recipe, size, spread=spread, salt=1)[row, column]
    burnt = _per_unit(recipe, size, spread=0.10, salt=2)[row, column]
    grain = 1 + 0.10 * soft(fractal(recipe.shape, Spectrum(0.9, 20.0), seed=recipe.seed + 3), 2.2)
    clay = np.stack([tone * grain, tone * grain * burnt, tone * grain * burnt**1.3], axis=-1)
    mortar_grain = 1 + 0.08 * soft(
        fractal(recipe.shape, Spectrum(0.5, 40.0), seed=recipe.seed + 6), 2
    )
    mortar = tinted(0.30 * mortar_grain, (1.0, 0.95, 0.87))
    grime = 1 + 0.06 * soft(fractal(recipe.shape, Spectrum(1.8, 2.0), seed=recipe.seed + 4), 1.6)
    colour = mixed(with_mean(clay, recipe.albedo), mortar, joints) * grime[..., None]
    return Maps(with_mean(colour, recipe.albedo))


def roof_tiles(recipe: Recipe) -> Maps:
    """Make interlocking clay pantiles, 300 x 300 mm visible; params `variety`, `moss`.

    Shading of the wave and the shadow under each lower edge are painted in: roofs
    are seen from afar, where geometry of their own would only alias.
    """
    side = 0.30
    y, x = (np.indices(recipe.shape) + 0.5) * recipe.tile / recipe.pixels
    row, column = np.floor(y / side).astype(np.int64), np.floor(x / side).astype(np.int64)
    across, down = (x % side) / side, 1.0 - (y % side) / side
    size = (side, side)
    spread = recipe.params.get("variety", 0.13)
    tone = _per_unit(recipe, size, spread=spread, salt=1)[row, column]
    burnt = _per_unit(recipe, size, spread=0.07, salt=2)[row, column]
    wave = (
        0.80 + 0.20 * np.cos(2 * np.pi * (across - 0.30)) - 0.45 * np.exp(-((across / 0.06) ** 2))
    )
    # Each tile's lower edge throws a shadow on the next one's upper end.
    shade = 1.0 - 0.60 * np.exp(-down / 0.07) + 0.10 * smoothstep(0.85, 1.0, down)
    weather = 1 + 0.09 * soft(fractal(recipe.shape, Spectrum(1.2, 3.0), seed=recipe.seed + 3), 2.0)
    value = tone * wave * shade * weather
    clay = np.stack([value, value * burnt, value * burnt**1.2], axis=-1)
    growth = fractal(recipe.shape, Spectrum(1.1, 4.0), seed=recipe.seed + 4)
    moss = smoothstep(1.0, 2.4, growth) * recipe.params.get("moss", 0.35)
    colour = mixed(with_mean(clay, recipe.albedo), np.array([0.10, 0.10, 0.07]), moss)
    return Maps(with_mean(colour, recipe.albedo))
