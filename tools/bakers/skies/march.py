"""Cumulus, marched as a cloud of droplets.

Density rises softly from the surface of `heaps`, which billows push out and in, down to the lumps
of a cauliflower; the finest noise frays edges most. Along each direction the density is integrated;
at every step the sun's way through the cloud and the open sky above give its light, with
Wrenninge's octaves for multiple scattering. Air hides what is far.

References:
    A. Schneider, "The real-time volumetric cloudscapes of Horizon Zero Dawn",
    SIGGRAPH 2015 (billows, erosion).
    M. Wrenninge et al., "Oz: the great and volumetric", SIGGRAPH 2013 talks,
    doi:10.1145/2504459.2504518 (octaves of scattering).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from drjit.llvm import PCG32, Array2f, Array3f, Float, TensorXf, Texture3f, UInt32
from scipy.spatial import cKDTree

from bakers.skies.heaps import OUTSIDE, VOXEL, Heaps, make_heaps
from bakers.skies.recipe import CloudRecipe, towards_of
from sumo3dviz_pt.model.geometry import Floats, Image

_BILLOW_SPAN, _DETAIL_SPAN, _FRAY_SPAN, _AGE_SPAN = 1_370.0, 233.0, 910.0, 9_700.0
_PUSH, _CARVE, _FRAY = 260.0, 95.0, 110.0  # by how much noises move the surface [m]
_SUN_TAPS = (12.0, 38.0, 90.0, 190.0, 390.0, 800.0)
_SKY_TAPS = (40.0, 130.0, 330.0)
_BRIGHTEST = 1.1  # source radiance x pi per sun irradiance
_AIR = 32_000.0  # way through air after which 1/e of a cloud is seen [m]
_AT_ONCE = 1 << 20
_STEPS = 700


@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """What densities are read from, all periodic, and the sun's direction."""

    inside: Any
    billows: Any
    detail: Any
    fray: Any
    levels: int
    shift: tuple[float, float]
    recipe: CloudRecipe
    sun: Floats


def _worley(size: int, across: int, *, rng: np.random.Generator) -> Image:
    """Make puffy periodic noise: 1 at random points, about 0 between them, (n, n, n)."""
    points = rng.uniform(0.0, across, (across**3, 3))
    axis = (np.arange(size) + 0.5) * across / size
    asked = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    distance, _ = cKDTree(points, boxsize=np.full(3, float(across))).query(asked)
    puffs = np.clip(1.0 - np.asarray(distance) ** 2 * 1.35, 0.0, 1.0)
    return puffs.reshape(size, size, size).astype(np.float32)


def _billows(size: int, shares: tuple[float, ...], *, rng: np.random.Generator) -> Image:
    """Sum octaves of puffs, the first with four across, (n, n, n); 0 on average."""
    total = np.zeros((size, size, size), np.float32)
    for octave, share in enumerate(shares):
        total += np.float32(share) * _worley(size, 4 << octave, rng=rng)
    return np.asarray(total - total.mean(), np.float32)


def _smoke(size: int, exponent: float, *, rng: np.random.Generator) -> Image:
    """Make periodic noise of three kinds with a power-law spectrum, (n, n, n, 3); deviation 1."""
    waves = np.fft.fftfreq(size) * size
    fast = np.fft.rfftfreq(size) * size
    frequency = np.sqrt(waves[:, None, None] ** 2 + waves[:, None] ** 2 + fast**2)
    gain = np.where(frequency >= 2.0, np.maximum(frequency, 1.0) ** -exponent, 0.0)
    white = np.fft.rfftn(rng.standard_normal((3, size, size, size)), axes=(1, 2, 3))
    noise = np.fft.irfftn(white * gain, s=(size,) * 3, axes=(1, 2, 3))
    return np.asarray(np.moveaxis(noise / noise.std(), 0, -1), np.float32)


def _texture(values: Image) -> Any:
    """Put a volume, (up, north, east) or with channels, where it is read from between texels."""
    whole = values if values.ndim == 4 else values[..., None]
    return Texture3f(TensorXf(np.ascontiguousarray(whole)), wrap_mode=dr.WrapMode.Repeat)


def _field(recipe: CloudRecipe) -> _Field:
    """Make the noises of a recipe."""
    rng = np.random.default_rng(recipe.seed + 3)
    heaps = make_heaps(recipe)
    sun = towards_of(*recipe.sun)
    return _Field(
        _texture(heaps.inside),
        _texture(_billows(recipe.texels, (0.50, 0.32, 0.18), rng=rng)),
        _texture(_billows(recipe.texels // 2, (0.45, 0.33, 0.22), rng=rng)),
        _texture(_smoke(recipe.texels, 1.9, rng=rng)),
        len(heaps.inside),
        _drift(heaps, recipe, sun),
        recipe,
        sun,
    )


def _drift(heaps: Heaps, recipe: CloudRecipe, sun: Floats) -> tuple[float, float]:
    """Return the place over us, (east, north) [m], so that the sun stands where `at_sun` says."""
    from scipy.ndimage import gaussian_filter

    # The sun needs room of its own: a few hundred metres and the slab seen aslant.
    around = gaussian_filter(heaps.column, 450.0 / VOXEL, mode="wrap")
    order = np.argsort(around, axis=None, kind="stable")
    chosen = order[round(recipe.at_sun * (order.size - 1))]
    north, east = np.unravel_index(chosen, around.shape)
    seen = sun[:2] / sun[2] * (recipe.base + 0.3 * recipe.depth)
    return float(east * VOXEL - seen[0]), float(north * VOXEL - seen[1])


def _smooth(low: float, high: float, values: Any) -> Any:
    """Rise from 0 at `low` to 1 at `high` in a smooth S."""
    t = dr.clip((values - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _inside(clouds: _Field, at: Any) -> Any:
    """Return how far points lie inside a heap [m]."""
    span = clouds.recipe.span
    up = (at.z - clouds.recipe.base) / VOXEL + 2.0
    place = Array3f(
        (at.x + clouds.shift[0]) / span, (at.y + clouds.shift[1]) / span, up / clouds.levels
    )
    level = (up > 0.5) & (up < clouds.levels - 0.5)
    return dr.select(level, clouds.inside.eval(place)[0], -OUTSIDE)


def _density(clouds: _Field, at: Any, inside: Any, *, fine: bool = True) -> Any:
    """Return the share of the densest cloud at points, in [0, 1].

    Args:
        clouds: The noises.
        at: Points over the ground [m].
        inside: How far they lie inside a heap [m].
        fine: Whether to carve the small lumps, too.
    """
    recipe = clouds.recipe
    height = at.z - recipe.base
    rises = _smooth(40.0, 380.0, height)
    # Some clouds boil up, others dissolve.
    age = _smooth(-0.9, 1.3, clouds.fray.eval(at / _AGE_SPAN)[0])
    smoke = clouds.fray.eval(at / _FRAY_SPAN)
    # Wind between the lumps draws them out.
    moved = at + (30.0 + 40.0 * age) * Array3f(smoke[0], smoke[1], smoke[2])
    push = _PUSH * dr.lerp(0.6, 1.0, rises) * _smooth(-130.0, 60.0, inside)
    surface = dr.select(inside < 0.0, 1.6 * inside, inside) + 8.0
    surface += push * clouds.billows.eval(moved / _BILLOW_SPAN)[0]
    # What rises is lumpy, feet and flanks fray; both fade inwards.
    edge = 1.0 - _smooth(20.0, 260.0, surface)
    frays = _FRAY * smoke[1] * dr.lerp(0.7, 0.25, rises) * (0.6 + age)
    lumps = Float(0.0)
    if fine:
        lumps = _CARVE * clouds.detail.eval(moved / _DETAIL_SPAN)[0]
    surface += edge * (frays + lumps * dr.lerp(0.6, 1.0, rises))
    wide = dr.lerp(230.0, 135.0, rises) * (0.7 + 0.9 * age)
    body = dr.clip(surface / wide, 0.0, 1.0)
    foot = _smooth(0.0, 55.0, height - 12.0 * (1.0 + smoke[2]))
    return body * body * foot


def _lobe(cosine: Any, g: float) -> Any:
    """Return Henyey and Greenstein's phase function; 1 on average."""
    return (1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5


def _sunlight(clouds: _Field, at: Any, cosine: Any) -> Any:
    """Return source radiance x pi per sun irradiance inside the cloud."""
    depth, before = Float(0.0), 0.0
    sun = Array3f(*(float(part) for part in clouds.sun))
    for number, tap in enumerate(_SUN_TAPS):
        ahead = at + tap * sun
        inside = _inside(clouds, ahead)
        length = 1.5 * tap - 0.5 * before if number < 5 else tap
        depth += _density(clouds, ahead, inside, fine=number < 3) * (length - before)
        before = length
    depth *= clouds.recipe.extinction
    light = Float(0.0)
    for octave in range(5):
        fade, share = 0.38**octave, 0.56**octave
        phase = 0.64 * _lobe(cosine, 0.78 * 0.5**octave) + 0.36 * _lobe(cosine, -0.2 * 0.5**octave)
        light += share * dr.exp(-fade * depth) * phase
    lit = 0.72 * light
    return 0.03 + lit / (1.0 + 0.30 * lit)


def _skylight(clouds: _Field, at: Any) -> Any:
    """Return source radiance x pi per sky irradiance inside the cloud."""
    depth, before = Float(0.0), 0.0
    for tap in _SKY_TAPS:
        above = at + Array3f(0.0, 0.0, tap)
        inside = _inside(clouds, above)
        depth += _density(clouds, above, inside, fine=False) * (tap - before)
        before = tap
    depth *= clouds.recipe.extinction
    return 0.34 + 0.66 * (0.5 * dr.exp(-0.08 * depth) + 0.5 * dr.exp(-0.35 * depth))


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
        part = np.ascontiguousarray(towards[first : first + _AT_ONCE].T, np.float32)
        parts.append(_through(clouds, Array3f(part), seed=recipe.seed + 9 + first))
    return np.concatenate(parts).astype(np.float64)


def _through(clouds: _Field, towards: Any, *, seed: int) -> Image:
    """March rays from the bases to the tops; (n, 3) as in `march`."""
    recipe = clouds.recipe
    cosine = dr.dot(towards, Array3f(*(float(part) for part in clouds.sun)))
    count = dr.width(towards)
    start, end = recipe.base / towards.z, (recipe.base + recipe.depth + 120.0) / towards.z
    least = dr.maximum((end - start) / (2.0 * recipe.steps), 0.0028 * start)
    chance = PCG32(count, seed).next_float32()

    def some(at: Any, inside: Any) -> Any:
        return _density(clouds, at, inside)

    def shaded(at: Any, cosine: Any) -> Any:
        return Array2f(_sunlight(clouds, at, cosine), _skylight(clouds, at))

    def goes_on(way: Any, clear: Any, light: Any, cover: Any, step: Any) -> Any:
        return (way < end) & (clear > 0.01) & (step < _STEPS)

    def advance(way: Any, clear: Any, light: Any, cover: Any, step: Any) -> Any:
        at = towards * way
        inside = _inside(clouds, at)
        # Far from every heap one may walk as far as the nearest, billows included.
        length = dr.maximum(least, -inside - 150.0)
        near = inside > -130.0
        density = dr.if_stmt((at, inside), near, some, lambda at, inside: Float(0.0))
        hit = density > 1e-3
        passed = dr.exp(-density * recipe.extinction * length)
        seen = dr.select(hit, clear * (1.0 - passed) * dr.exp(-way / _AIR), 0.0)

        glow = dr.if_stmt((at, cosine), hit, shaded, lambda at, cosine: Array2f(0.0))
        clear = dr.select(hit, clear * passed, clear)
        return way + length, clear, light + seen * glow, cover + seen, step + 1

    state = (start + chance * least, Float(1.0), Array2f(0.0), Float(0.0), UInt32(0))
    _, _, light, cover, _ = dr.while_loop(state, goes_on, advance)
    light /= dr.maximum(cover, 1e-3)
    # What thin cloud throws forward is spread by the next: rims shine, but no core does.
    light.x *= (1.0 + (light.x / _BRIGHTEST) ** 4) ** -0.25
    return np.stack([np.array(part) for part in (cover, light.x, light.y)], axis=-1)
