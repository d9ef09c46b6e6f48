"""Cumulus, marched through a field of billows.

A slab of density: a map of where clouds are, a height profile with flat bases, and
Worley billows that eat the edges, down to the lumps of a cauliflower. Along each
direction the density is integrated; at every step the sun's way through the cloud and
the open sky above give its light, with Wrenninge's octaves for multiple scattering.

References:
    A. Schneider, "The real-time volumetric cloudscapes of Horizon Zero Dawn",
    SIGGRAPH 2015 (billows, erosion, height profile).
    M. Wrenninge et al., "Oz: the great and volumetric", SIGGRAPH 2013 talks,
    doi:10.1145/2504459.2504518 (octaves of scattering).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bakers.noise import blurred
from bakers.skies.recipe import CloudRecipe, towards_of
from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.numbers import eased

Singles = NDArray[np.float32]

_SPAN, _BILLOW_SPAN, _DETAIL_SPAN = 40_000.0, 3_400.0, 620.0
_SUN_TAPS = (18.0, 55.0, 130.0, 280.0, 560.0)
_TAP_LENGTHS = (36.0, 55.0, 110.0, 210.0, 330.0)
_COARSE = 4  # fine steps between two looks at the map
_AT_ONCE = 1 << 18
_OUTSIDE = -0.35


@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """Noises that densities are read from, all periodic, and the sun's direction."""

    where: Singles
    billows: Singles
    detail: Singles
    recipe: CloudRecipe
    sun: Singles


def _worley(size: int, across: int, *, rng: np.random.Generator) -> Singles:
    """Make puffy periodic noise: 1 at random points, about 0 between them, (n, n, n)."""
    points = rng.uniform(0.0, across, (across**3, 3))
    axis = (np.arange(size) + 0.5) * across / size
    asked = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    distance, _ = cKDTree(points, boxsize=np.full(3, float(across))).query(asked)
    puffs = np.clip(1.0 - np.asarray(distance) ** 2 * 1.35, 0.0, 1.0)
    return puffs.reshape(size, size, size).astype(np.float32)


def _billows(size: int, shares: tuple[float, ...], *, rng: np.random.Generator) -> Singles:
    """Sum octaves of puffs, the first with four across, (n, n, n) in [0, 1]."""
    total = np.zeros((size, size, size), np.float32)
    for octave, share in enumerate(shares):
        total += np.float32(share) * _worley(size, 4 << octave, rng=rng)
    return total


def _field(recipe: CloudRecipe) -> _Field:
    """Make the noises of a recipe."""
    rng = np.random.default_rng(recipe.seed)
    waves = _SPAN / recipe.cell
    wide = fractal((1024, 1024), Spectrum(1.0, 0.35 * waves, 1.6 * waves), seed=recipe.seed + 1)
    broad = fractal((1024, 1024), Spectrum(1.2, 1.0, 0.5 * waves), seed=recipe.seed + 2)
    where = wide + 0.55 * broad
    where = (where - np.quantile(where, 1.0 - recipe.cover)) / where.std()
    sun = towards_of(*recipe.sun)
    drifted = _drifted(where, recipe, sun).astype(np.float32)
    coarse = _billows(recipe.texels, (0.50, 0.30, 0.20), rng=rng)
    fine = _billows(recipe.texels // 2, (0.46, 0.32, 0.22), rng=rng)
    return _Field(drifted, coarse, fine, recipe, sun.astype(np.float32))


def _drifted(where: Floats, recipe: CloudRecipe, sun: Floats) -> Floats:
    """Let the wind shift the map until the sun stands where `at_sun` says."""
    texel = _SPAN / len(where)
    # The sun needs room of its own: a few hundred metres and the slab seen aslant.
    around = blurred(where, 500.0 / texel)
    order = np.argsort(around, axis=None, kind="stable")
    found = np.unravel_index(order[round(recipe.at_sun * (order.size - 1))], where.shape)
    seen = sun[:2] / sun[2] * (recipe.base + 0.3 * recipe.depth) / texel
    shift = np.round(seen).astype(int) - np.array(found)
    return np.roll(where, tuple(shift), axis=(0, 1))


def _look_up(noise: Singles, points: Singles, span: float, chance: Singles) -> Singles:
    """Look up periodic noise near points: one neighbour, drawn by its linear weight.

    Many steps average what one lookup of eight neighbours would cost.
    """
    size = noise.shape[0]
    flat = np.zeros(len(points), np.intp)
    for axis in range(noise.ndim):
        shifted = (chance * (1.0 + 7.31 * axis)) % 1.0
        place = np.floor(points[:, axis] * np.float32(size / span) - 0.5 + shifted)
        flat = flat * size + place.astype(np.intp) % size
    return np.asarray(noise.ravel()[flat])


def _smooth(low: float, high: float, values: Singles) -> Singles:
    """Rise from 0 at `low` to 1 at `high` in a smooth S, in single precision."""
    t = np.clip((values - np.float32(low)) * np.float32(1.0 / (high - low)), 0.0, 1.0)
    return np.asarray(eased(t))


def _density(clouds: _Field, points: Singles, chance: Singles, *, fine: bool) -> Singles:
    """Return the share of the densest cloud at points, (n,) in [0, 1].

    Args:
        clouds: The noises.
        points: East, north and height above the ground, (n, 3) [m].
        chance: Random numbers in [0, 1), (n,).
        fine: Whether to carve the small lumps, too.
    """
    recipe = clouds.recipe
    height = (points[:, 2] - np.float32(recipe.base)) / np.float32(recipe.depth)
    where = _look_up(clouds.where, points, _SPAN, chance)
    result = np.zeros(len(points), np.float32)
    inside = np.flatnonzero((where > _OUTSIDE) & (height > 0.0) & (height < 1.0))
    if not inside.size:
        return result
    points, height, where, chance = points[inside], height[inside], where[inside], chance[inside]
    strength = _smooth(_OUTSIDE, 1.3, where)
    top = 0.16 + 0.84 * strength
    puffs = _look_up(clouds.billows, points, _BILLOW_SPAN, chance)
    # Bases hang a little lower under their billows, else they would be ironed flat.
    low = height - 0.11 * (1.0 - puffs)
    profile = _smooth(0.0, 0.07, low) * (1.0 - _smooth(0.30, 1.0, height / top))
    # Nothing may be left where the map ends, or clouds would have walls.
    shape = (0.66 * strength + 0.26) * profile - 0.6 * (1.0 - _smooth(0.0, 0.25, strength))
    shape += 1.30 * (puffs - 0.56)
    if fine:
        lumps = _look_up(clouds.detail, points, _DETAIL_SPAN, chance)
        # Tops boil in lumps; bases fray.
        shape -= 0.46 * (1.0 - lumps) * (1.0 - 0.75 * _smooth(0.30, 0.75, shape))
    else:
        shape -= np.float32(0.46 * 0.42)
    result[inside] = _smooth(0.04, 0.26, shape) * (0.55 + 0.45 * _smooth(0.0, 0.5, height))
    return result


def _phase(cosine: Singles, sharpness: float) -> Singles:
    """Return the forward and backward lobes of droplets, (n,); 1 on average."""

    def lobe(g: float) -> Singles:
        return np.asarray((1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5)

    return np.asarray(0.7 * lobe(0.75 * sharpness) + 0.3 * lobe(-0.25 * sharpness))


def _sunlight(clouds: _Field, points: Singles, cosine: Singles, chance: Singles) -> Singles:
    """Return source radiance x pi per sun irradiance inside the cloud, (n,)."""
    depth = np.zeros(len(points), np.float32)
    for tap, length in zip(_SUN_TAPS, _TAP_LENGTHS, strict=True):
        ahead = points + np.float32(tap) * clouds.sun
        depth += _density(clouds, ahead, chance, fine=tap < 100.0) * np.float32(length)
    depth *= np.float32(clouds.recipe.extinction)
    light = np.zeros(len(points), np.float32)
    for octave in range(4):
        fade, share = 0.26**octave, 0.62**octave
        light += (
            np.float32(share) * np.exp(-np.float32(fade) * depth) * _phase(cosine, 0.55**octave)
        )
    # Powder: light needs some depth to turn round (Schneider 2015).
    powder = 1.0 - 0.45 * np.exp(-2.2 * depth) * np.clip(0.5 - 0.5 * cosine, 0.0, 1.0)
    lit = 0.43 * light * powder
    return np.asarray(0.035 + lit / (1.0 + 0.28 * lit))


def _skylight(clouds: _Field, points: Singles, density: Singles) -> Singles:
    """Return source radiance x pi per sky irradiance inside the cloud, (n,)."""
    recipe = clouds.recipe
    height = np.clip((points[:, 2] - recipe.base) / recipe.depth, 0.0, 1.0)
    chance = np.full(len(points), 0.5, np.float32)
    above = points + np.array([0.0, 0.0, 0.12 * recipe.depth], np.float32)
    over = _density(clouds, above, chance, fine=False)
    open_sky = (0.60 + 0.55 * np.sqrt(height)) * (1.0 - 0.22 * density)
    lumps = _look_up(clouds.detail, points, _DETAIL_SPAN, chance)
    return np.asarray(open_sky * (1.0 - 0.20 * over) * (0.78 + 0.45 * lumps))


def march(recipe: CloudRecipe, towards: Floats) -> Floats:
    """Look at cumulus in directions.

    Args:
        recipe: How it is made.
        towards: Unit vectors above the horizon, (n, 3).

    Returns:
        Opacity, sunlit and skylit share, (n, 3).
    """
    clouds = _field(recipe)
    parts = []
    for first in range(0, len(towards), _AT_ONCE):
        part = np.ascontiguousarray(towards[first : first + _AT_ONCE], np.float32)
        rng = np.random.default_rng([recipe.seed + 9, first])
        parts.append(_through(clouds, part, rng=rng))
    return np.concatenate(parts).astype(np.float64)


def _through(clouds: _Field, towards: Singles, *, rng: np.random.Generator) -> Singles:
    """March rays, (n, 3), from the bases to the tops."""
    recipe = clouds.recipe
    rays = _CloudRays(
        towards,
        recipe.base / towards[:, 2],
        np.asarray(recipe.depth / towards[:, 2] / recipe.steps, np.float32),
        np.asarray(towards @ clouds.sun, np.float32),
        np.ones(len(towards), np.float32),
        np.zeros((len(towards), 2), np.float32),
    )
    offset = rng.random(len(towards), np.float32)
    for step in range(0, recipe.steps, _COARSE):
        alive = np.flatnonzero(rays.clear > 0.01)
        middle = rays.start[alive] + (step + 0.5 * _COARSE) * rays.length[alive]
        points = towards[alive, :2] * middle[:, None]
        near = _look_up(clouds.where, points, _SPAN, offset[alive]) > _OUTSIDE - 0.05
        alive = alive[near]
        for fine in range(step, step + _COARSE):
            _advance(clouds, rays, alive, fine + offset[alive], rng=rng)
    cover = 1.0 - rays.clear
    return np.column_stack([cover, rays.light / np.maximum(cover, 1e-3)[:, None]])


@dataclass(frozen=True, slots=True, eq=False)
class _CloudRays:
    """Rays on their way: `clear` is what still shines through, `light` what was gathered."""

    towards: Singles
    start: Singles
    length: Singles
    cosine: Singles
    clear: Singles
    light: Singles


def _advance(
    clouds: _Field,
    rays: _CloudRays,
    alive: NDArray[np.intp],
    step: Singles,
    *,
    rng: np.random.Generator,
) -> None:
    """Add one step's light and opacity to some rays."""
    points = rays.towards[alive] * (rays.start[alive] + step * rays.length[alive])[:, None]
    chance = rng.random(len(alive), np.float32)
    density = _density(clouds, points, chance, fine=True)
    hit = density > 0.0
    alive, points, density, chance = alive[hit], points[hit], density[hit], chance[hit]
    thick = density * np.float32(clouds.recipe.extinction) * np.minimum(rays.length[alive], 120.0)
    passed = np.exp(-thick)
    seen = rays.clear[alive] * (1.0 - passed)
    rays.light[alive, 0] += seen * _sunlight(clouds, points, rays.cosine[alive], chance)
    rays.light[alive, 1] += seen * _skylight(clouds, points, density)
    rays.clear[alive] *= passed
