"""Cloud layers over the upper hemisphere, marched through a field of billows.

Cumulus is a slab of density: a map of where clouds are, a height profile with flat
bases, and Worley billows that eat the edges. Along each direction the density is
integrated; at every step the sun's way through the cloud and the open sky above
give its light, with Wrenninge's octaves for multiple scattering. Cirrus is a thin
sheet far above.

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
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.scene import CloudLayer
from sumo3dviz_pt.shapes.noise import Band, blurred, fractal, smoothstep, soft

_SPAN, _BILLOW_SPAN, _DETAIL_SPAN = 40_000.0, 3_400.0, 760.0
_SUN_TAPS = np.array([25.0, 80.0, 170.0, 330.0, 600.0])
_TAP_LENGTHS = np.array([50.0, 70.0, 125.0, 215.0, 300.0])


@dataclass(frozen=True, slots=True)
class CloudRecipe:
    """How a cloud layer is made.

    Attributes:
        rows: Rows of the map; it has four times as many columns.
        seed: Of everything random in it.
        sun: Azimuth clockwise from north and elevation of the sun it is lit by [rad].
        cover: Share of the ground plane under cumulus, [0, 1].
        base: Height of the cloud bases [m].
        depth: Height from bases to the highest tops [m].
        extinction: Of the densest cloud [1/m].
        cell: Typical distance from cloud to cloud [m].
        cirrus: Opacity of the densest cirrus, [0, 1].
        at_sun: How cloudy it is where the sun stands, from the clearest place of the
            field, 0, to its thickest, 1.
        steps: Of the march through the slab.
        texels: Of the billows along each side; details have half as many.
    """

    rows: int
    seed: int
    sun: tuple[float, float]
    cover: float
    base: float = 1100.0
    depth: float = 950.0
    extinction: float = 0.030
    cell: float = 2900.0
    cirrus: float = 0.0
    at_sun: float = 0.0
    steps: int = 72
    texels: int = 128


@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """Noises that densities are read from; all periodic."""

    where: NDArray[np.float32]
    billows: NDArray[np.float32]
    detail: NDArray[np.float32]
    recipe: CloudRecipe
    sun: Floats


def _worley(size: int, across: int, *, rng: np.random.Generator) -> Floats:
    """Puffy periodic noise: 1 at random points, about 0 between them, (n, n, n)."""
    points = rng.uniform(0.0, across, (across**3, 3))
    axis = (np.arange(size) + 0.5) * across / size
    asked = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    distance, _ = cKDTree(points, boxsize=np.full(3, float(across))).query(asked)
    return np.clip(1.0 - np.asarray(distance).reshape(size, size, size), 0.0, 1.0)


def _billows(size: int, *, rng: np.random.Generator) -> NDArray[np.float32]:
    """Three octaves of puffs, (n, n, n) in [0, 1]."""
    octaves = [_worley(size, across, rng=rng) for across in (4, 8, 16)]
    return (0.55 * octaves[0] + 0.29 * octaves[1] + 0.16 * octaves[2]).astype(np.float32)


def _field(recipe: CloudRecipe) -> _Field:
    """Make the noises of a recipe."""
    rng = np.random.default_rng(recipe.seed)
    waves = _SPAN / recipe.cell
    wide = fractal((1024, 1024), Band(1.0, 0.35 * waves, 1.6 * waves), seed=recipe.seed + 1)
    broad = fractal((1024, 1024), Band(1.2, 1.0, 0.5 * waves), seed=recipe.seed + 2)
    where = wide + 0.55 * broad
    where = (where - np.quantile(where, 1.0 - recipe.cover)) / where.std()
    sun = np.array(_directions(*recipe.sun))
    where = _drifted(where, recipe, sun)
    coarse, fine = _billows(recipe.texels, rng=rng), _billows(recipe.texels // 2, rng=rng)
    return _Field(where.astype(np.float32), coarse, fine, recipe, sun)


def _drifted(where: Floats, recipe: CloudRecipe, sun: Floats) -> Floats:
    """Let the wind shift the map until the sun stands where `at_sun` says."""
    texel = _SPAN / len(where)
    # The sun needs room of its own: a few hundred metres and the slab seen aslant.
    around = blurred(where, 500.0 / texel)
    order = np.argsort(around, axis=None)
    found = np.unravel_index(order[round(recipe.at_sun * (order.size - 1))], where.shape)
    seen = sun[:2] / sun[2] * (recipe.base + 0.3 * recipe.depth) / texel
    shift = np.round(seen).astype(int) - np.array(found)
    return np.roll(where, tuple(shift), axis=(0, 1))


def _look_up(noise: NDArray[np.float32], points: Floats, span: float) -> NDArray[np.float32]:
    """Values of periodic noise at points, (n, 2 or 3) [m]."""
    places = (points * (np.array(noise.shape) / span)).T
    return np.asarray(map_coordinates(noise, places, order=1, mode="grid-wrap"))


def _density(clouds: _Field, points: Floats, *, fine: bool) -> Floats:
    """Share of the densest cloud at points, (n,) in [0, 1].

    Args:
        clouds: The noises.
        points: East, north and height above the ground, (n, 3) [m].
        fine: Whether to carve the small wisps, too.
    """
    recipe = clouds.recipe
    height = (points[:, 2] - recipe.base) / recipe.depth
    where = _look_up(clouds.where, points[:, :2], _SPAN)
    result = np.zeros(len(points))
    inside = np.flatnonzero((where > -0.35) & (height > 0.0) & (height < 1.0))
    if not inside.size:
        return result
    points, height, where = points[inside], height[inside], where[inside]
    strength = smoothstep(-0.35, 1.3, where.astype(np.float64))
    top = 0.18 + 0.82 * strength
    profile = smoothstep(0.0, 0.07, height) * (1.0 - smoothstep(0.25, 1.0, height / top))
    billows = _look_up(clouds.billows, points, _BILLOW_SPAN)
    shape = (0.62 * strength + 0.30) * profile + 1.25 * (billows - 0.52)
    if fine:
        wisps = _look_up(clouds.detail, points, _DETAIL_SPAN)
        shape = shape - 0.40 * (1.0 - wisps) * (1.0 - 0.6 * smoothstep(0.25, 0.7, shape))
    result[inside] = smoothstep(0.06, 0.5, shape)
    return result


def _phase(cosine: Floats, sharpness: float) -> Floats:
    """Forward and backward lobes of droplets, (n,); 1 on average."""

    def lobe(g: float) -> Floats:
        return np.asarray((1 - g * g) / (1 + g * g - 2 * g * cosine) ** 1.5)

    return 0.7 * lobe(0.75 * sharpness) + 0.3 * lobe(-0.25 * sharpness)


def _sunlight(clouds: _Field, points: Floats, cosine: Floats) -> Floats:
    """Source radiance x pi per sun irradiance inside the cloud, (n,)."""
    depth = np.zeros(len(points))
    for tap, length in zip(_SUN_TAPS, _TAP_LENGTHS, strict=True):
        ahead = points + tap * clouds.sun
        depth += _density(clouds, ahead, fine=tap < 100.0) * length
    depth *= clouds.recipe.extinction
    light = np.zeros(len(points))
    for octave in range(4):
        fade, share = 0.30**octave, 0.72**octave
        light += share * np.exp(-fade * depth) * _phase(cosine, 0.55**octave)
    return 0.07 + 0.44 * light


def _skylight(clouds: _Field, points: Floats, density: Floats) -> Floats:
    """Source radiance x pi per sky irradiance inside the cloud, (n,)."""
    height = np.clip((points[:, 2] - clouds.recipe.base) / clouds.recipe.depth, 0.0, 1.0)
    return np.asarray((0.70 + 0.45 * np.sqrt(height)) * (1.0 - 0.30 * density))


def _cumulus(clouds: _Field, towards: Floats) -> Floats:
    """Opacity, sunlit and skylit share in directions, (n, 3)."""
    recipe = clouds.recipe
    count = len(towards)
    clear, light = np.ones(count), np.zeros((count, 2))
    start, length = recipe.base / towards[:, 2], recipe.depth / towards[:, 2] / recipe.steps
    jitter = np.random.default_rng(recipe.seed + 9).uniform(size=count)
    cosine = towards @ clouds.sun
    for step in range(recipe.steps):
        alive = np.flatnonzero(clear > 0.01)
        points = towards[alive] * (start + (step + jitter) * length)[alive, None]
        density = _density(clouds, points, fine=True)
        hit = density > 0.0
        alive, points, density = alive[hit], points[hit], density[hit]
        passed = np.exp(-density * recipe.extinction * np.minimum(length[alive], 120.0))
        seen = clear[alive] * (1.0 - passed)
        light[alive, 0] += seen * _sunlight(clouds, points, cosine[alive])
        light[alive, 1] += seen * _skylight(clouds, points, density)
        clear[alive] *= passed
    cover = 1.0 - clear
    return np.column_stack([cover, light / np.maximum(cover, 1e-3)[:, None]])


def _cirrus(recipe: CloudRecipe, towards: Floats) -> Floats:
    """Opacity, sunlit and skylit share of the high sheet in directions, (n, 3)."""
    shape = (1024, 1024)
    streaks = fractal(shape, Band(1.55, 3.0, 220.0, stretch=4.0), seed=recipe.seed + 20)
    veil = fractal(shape, Band(1.8, 2.0, stretch=2.0), seed=recipe.seed + 21)
    sheet = smoothstep(-0.1, 2.4, soft(streaks, 2.5) + 0.9 * soft(veil, 2.0) - 0.5)
    places = towards[:, :2] / (towards[:, 2:] + 0.06)
    turn = 0.7
    turned = places @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    cover = recipe.cirrus * _look_up(sheet.astype(np.float32), turned, 7.0)
    cosine = towards @ np.array(_directions(*recipe.sun))
    sunlit = 0.42 + 0.10 * _phase(cosine, 0.9)
    return np.column_stack([cover, np.minimum(sunlit, 1.4), np.full(len(towards), 0.8)])


def make_clouds(recipe: CloudRecipe) -> CloudLayer:
    """March a cloud layer.

    Args:
        recipe: How it is made.

    Returns:
        Maps of (rows, 4 x rows), axes as in `CloudLayer`.
    """
    rows, columns = recipe.rows, 4 * recipe.rows
    elevation = (1.0 - (np.arange(rows) + 0.5) / rows) * np.pi / 2
    azimuth = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    high, around = np.meshgrid(elevation, azimuth, indexing="ij")
    towards = np.stack(_directions(around, high), axis=-1).reshape(-1, 3)
    far = _cirrus(recipe, towards)
    near = _cumulus(_field(recipe), towards)
    # Air hides what is low over the horizon.
    fade = smoothstep(np.radians(0.8), np.radians(7.0), high.reshape(-1))
    near[:, 0] *= fade
    far[:, 0] *= fade
    return _over(_smoothed(near, (rows, columns)), far, (rows, columns))


def _directions(
    azimuth: Floats | float, elevation: Floats | float
) -> tuple[Floats, Floats, Floats]:
    """East, north and up of angles of any shape."""
    level = np.cos(elevation)
    east, north = level * np.sin(azimuth), level * np.cos(azimuth)
    return np.asarray(east), np.asarray(north), np.asarray(np.sin(elevation))


def _smoothed(sheet: Floats, shape: tuple[int, int]) -> Floats:
    """Take the march's jitter out of a sheet, (n, 3), at the scale of a texel."""
    weighted = np.column_stack([sheet[:, :1], sheet[:, :1] * sheet[:, 1:]]).reshape(*shape, 3)
    across = gaussian_filter(weighted, (0.0, 0.7, 0.0), mode="wrap")
    calm = np.asarray(gaussian_filter(across, (0.7, 0.0, 0.0), mode="nearest")).reshape(-1, 3)
    return np.column_stack([calm[:, :1], calm[:, 1:] / np.maximum(calm[:, :1], 1e-4)])


def _over(near: Floats, far: Floats, shape: tuple[int, int]) -> CloudLayer:
    """Lay one sheet over another, both (n, 3), straight colours."""
    shown = far[:, :1] * (1.0 - near[:, :1])
    cover = near[:, :1] + shown
    light = (near[:, :1] * near[:, 1:] + shown * far[:, 1:]) / np.maximum(cover, 1e-4)

    def image(values: Floats) -> Image:
        return np.asarray(values.reshape(shape), dtype=np.float32)

    return CloudLayer(image(cover[:, 0]), image(light[:, 0]), image(light[:, 1]))
