"""Grass, forest floor, gravel, sand and chess boards.

Grounds repeat up to the horizon, so their noise leaves out wavelengths near the
tile's own size: what has no broad blobs shows no grid from above.
"""

from __future__ import annotations

import numpy as np

from bakers.noise import cells, soft
from bakers.surfaces.maps import Maps, Recipe, mixed, tinted, with_mean
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep
from sumo3dviz_pt.model.geometry import Floats

LUSH = np.array([0.052, 0.105, 0.026])
"""Linear reflectance of dense meadow grass seen from above."""

DRY = np.array([0.165, 0.150, 0.068])
"""Linear reflectance of dead stalks."""

CLOVER = np.array([0.040, 0.098, 0.034])
"""Linear reflectance of broad-leaved weeds, cooler than grass."""

SOIL = np.array([0.080, 0.060, 0.040])
"""Linear reflectance of moist topsoil that shows between tufts."""


LITTER = np.array(
    [[0.16, 0.095, 0.045], [0.11, 0.068, 0.038], [0.21, 0.135, 0.062], [0.075, 0.05, 0.033]]
)
"""Linear reflectances of fallen leaves: beech, oak, fresh ones, rotten ones."""

EMBERS = np.array(
    [[0.34, 0.115, 0.018], [0.24, 0.07, 0.016], [0.30, 0.19, 0.035], [0.06, 0.04, 0.034]]
)
"""Linear reflectances of maple leaves in late October."""

MOSS = np.array([0.048, 0.075, 0.018])
"""Linear reflectance of moss."""


def _tufts(recipe: Recipe) -> Floats:
    """Draw light and shadow among tufts, from a metre down to the texel, (h, w), unit spread."""
    shape, seed = recipe.shape, recipe.seed
    fine = fractal(shape, Spectrum(0.45, recipe.waves(0.9)), seed=seed + 1)
    # Blades lie in all directions: two crossed sets of streaks.
    streaks = fractal(shape, Spectrum(0.5, recipe.waves(0.5), stretch=3.5), seed=seed + 6)
    crossed = fractal(shape, Spectrum(0.5, recipe.waves(0.5), stretch=0.3), seed=seed + 7)
    tuft = fractal(shape, Spectrum(1.1, recipe.waves(2.5)), seed=seed + 2)
    blades = np.maximum(soft(streaks, 2.2), soft(crossed, 2.2)) - 0.4
    return np.asarray(0.5 * soft(fine, 2.2) + 0.6 * blades + 0.55 * soft(tuft, 1.8))


def grass(recipe: Recipe) -> Maps:
    """Make a meadow; params `dryness`, `clover`, `bare` (shares), `contrast`."""
    shape, seed = recipe.shape, recipe.seed
    low = recipe.waves(4.0)
    patches = soft(fractal(shape, Spectrum(1.5, low), seed=seed + 3), 1.7)
    scatter = soft(fractal(shape, Spectrum(0.7, 4 * low), seed=seed + 4), 2.0)
    dry = smoothstep(-1.3, 3.0, patches + 0.9 * scatter) * recipe.params.get("dryness", 0.75)
    weeds = smoothstep(
        0.8, 1.6, fractal(shape, Spectrum(1.3, 2 * low), seed=seed + 5) + 0.5 * scatter
    )
    colour = mixed(tinted(np.ones(shape), LUSH), DRY, np.clip(dry, 0.0, 1.0))
    # Clover stands in round mats of small leaves.
    leaf = cells(recipe.pixels, round(recipe.waves(0.05)), jitter=0.9, seed=seed + 8)
    mats = 0.75 + 0.5 * smoothstep(0.05, 0.35, leaf.edge)
    share = recipe.params.get("clover", 0.6) * weeds
    colour = mixed(colour, CLOVER * mats[..., None], share)
    tufts = _tufts(recipe) * (1.0 - 0.5 * share)
    bare = smoothstep(1.0, 2.0, -patches - 0.7 * scatter) * recipe.params.get("bare", 0.4)
    colour = mixed(colour, SOIL, bare)
    colour = mixed(colour, SOIL * 0.6, 0.45 * smoothstep(1.1, 2.2, -tufts))
    colour = colour * np.exp(recipe.params.get("contrast", 0.26) * tufts)[..., None]
    return Maps(with_mean(colour, recipe.albedo))


def litter(recipe: Recipe) -> Maps:
    """Make leaves on soil; params `leaf` [m], `cover`, `moss` (shares), `embers` (0 or 1)."""
    shape, seed = recipe.shape, recipe.seed
    leaves = EMBERS if recipe.params.get("embers", 0) else LITTER
    damp = soft(fractal(shape, Spectrum(1.5, recipe.waves(3.0)), seed=seed + 3), 1.8)
    grain = soft(fractal(shape, Spectrum(0.5, recipe.waves(0.4)), seed=seed + 4), 2.2)
    colour = tinted(np.exp(0.22 * grain + 0.1 * damp), SOIL * 0.7)
    across = round(recipe.waves(recipe.params.get("leaf", 0.07)))
    cover = recipe.params.get("cover", 0.85)
    # Two layers: leaves lie on leaves and throw a thin shadow.
    for layer in (0, 1):
        mosaic = cells(recipe.pixels, across, jitter=1.0, seed=seed + 10 + layer)
        rng = np.random.default_rng(seed + 20 + layer)
        tone = leaves[rng.integers(0, len(leaves), across * across)]
        tone = tone * np.exp(0.3 * rng.standard_normal(across * across))[:, None]
        lies = rng.random(across * across) < (cover if layer == 0 else 0.45 * cover)
        inside = smoothstep(0.06, 0.14, mosaic.edge) * (mosaic.nearest < 0.52)
        vein = 0.85 + 0.3 * smoothstep(0.0, 0.45, mosaic.edge)
        colour = colour * (1.0 - 0.35 * lies[mosaic.owner] * (mosaic.edge < 0.1))[..., None]
        colour = mixed(colour, tone[mosaic.owner] * vein[..., None], lies[mosaic.owner] * inside)
    moss = smoothstep(0.5, 1.3, damp + 0.3 * grain) * recipe.params.get("moss", 0.5)
    colour = mixed(colour, MOSS * np.exp(0.35 * grain)[..., None], moss)
    return Maps(with_mean(colour, recipe.albedo))


def gravel(recipe: Recipe) -> Maps:
    """Make crushed stone; params `stone` [m] (typical size), `variety`."""
    across = round(recipe.waves(recipe.params.get("stone", 0.045)))
    stones = cells(recipe.pixels, across, jitter=0.95, seed=recipe.seed + 1)
    rng = np.random.default_rng(recipe.seed + 2)
    count = across * across
    tone = np.exp(recipe.params.get("variety", 0.28) * rng.standard_normal(count).clip(-2, 2))
    warmth = 0.05 * rng.standard_normal(count).clip(-2, 2)
    # Each stone is lit a little from one side of its own: a facet, not a ball.
    rise = smoothstep(0.0, 0.28, stones.edge)
    grain = 1 + 0.07 * fractal(recipe.shape, Spectrum(0.8, 20.0), seed=recipe.seed + 3)
    stains = 1 + 0.08 * soft(fractal(recipe.shape, Spectrum(1.5, 3.0), seed=recipe.seed + 4), 1.6)
    value = tone[stones.owner] * (0.30 + 0.70 * rise) * grain * stains
    hue = warmth[stones.owner]
    colour = np.stack([value * (1 + hue), value, value * (1 - 1.4 * hue)], axis=-1)
    return Maps(with_mean(colour, recipe.albedo))


def sand(recipe: Recipe) -> Maps:
    """Make sand with wind ripples; params `ripple` [m] (distance of crests), `relief`."""
    shape, seed = recipe.shape, recipe.seed
    waves = recipe.waves(recipe.params.get("ripple", 0.22))
    ripples = fractal(shape, Spectrum(0.0, 0.6 * waves, waves, stretch=3.0), seed=seed + 1)
    damp = soft(fractal(shape, Spectrum(1.7, 2.0), seed=seed + 2), 1.6)
    grains = soft(fractal(shape, Spectrum(0.25, 60.0), seed=seed + 3), 2.5)
    value = (
        1 + recipe.params.get("relief", 0.045) * soft(ripples, 1.8) + 0.05 * damp + 0.07 * grains
    )
    hue = 0.015 * damp
    colour = np.stack([value * (1 + hue), value, value * (1 - 2 * hue)], axis=-1)
    return Maps(with_mean(colour, recipe.albedo))


def chess(recipe: Recipe) -> Maps:
    """Make two by two squares; params `dark`, `light` (linear reflectance)."""
    rows, columns = np.indices(recipe.shape) * 2 // recipe.pixels
    dark, light = recipe.params.get("dark", 0.10), recipe.params.get("light", 0.50)
    value = np.where((rows + columns) % 2 == 0, light, dark)
    return Maps(with_mean(tinted(value, np.ones(3)), recipe.albedo))
