"""Bakes a sky recipe into one radiance map and a sun.

Mitsuba's `sunsky` gives the clear sky (its sun by date is mirrored, so we pass a
direction); clouds are laid over it. The sun is an emitter of its own: painted into the
map it would draw nine of ten light samples, and what lies in the shade would be noisy.
Below 2 degrees of elevation
`sunsky` turns negative and black, so lower suns dim the sky of 2 degrees along the
measured course of twilight.

References:
    Wilkie et al., A fitted radiance and attenuation model for realistic atmospheres,
    ACM TOG 40(4), 2021, behind `sunsky`.
    Seidelmann (ed.), Explanatory Supplement to the Astronomical Almanac, 1992, table
    of horizontal illuminance from the sun and twilight.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.scene import CloudLayer, Sky

CANDELAS_PER_UNIT = 32_000.0
"""Luminance of one scene unit [cd/m^2]: a sunlit white wall is about 1."""

UNITS_PER_SUNSKY = 2.29
"""Scene units per `sunsky` unit; gives about 100 klx at 60 degrees, turbidity 3."""

SIZE = (1024, 2048)
"""Rows and columns of the baked map."""

SUN_RADIUS = np.radians(0.2666)
"""Angular radius of the sun's disc [rad]."""

_LOWEST_SUN = np.radians(2.0)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# Sun elevation [deg] and horizontal illuminance [lx] of sky and sun together.
_TWILIGHT = np.array(
    [[-18, 6.5e-4], [-12, 8.3e-3], [-6, 3.4], [-4, 27.0], [-2, 154.0], [0, 732.0], [2, 2270.0]]
)


@dataclass(frozen=True, slots=True, eq=False)
class Sun:
    """The sun's disc.

    Attributes:
        direction: Unit vector to its centre, (3,).
        irradiance: On a plane that faces it, (3,) in scene units.
    """

    direction: Floats
    irradiance: Floats

    @property
    def radiance(self) -> Floats:
        """Of the disc, (3,) in scene units."""
        return np.asarray(self.irradiance / (np.pi * np.sin(SUN_RADIUS) ** 2))


@dataclass(frozen=True, slots=True, eq=False)
class SkyMap:
    """A baked sky.

    Attributes:
        radiance: Rows from zenith to nadir, columns clockwise from north, (h, w, 3);
            without the sun.
        horizon: Radiance just above the horizon, columns as above, (w, 3).
        sun: The sun, or None when it is down or hidden.
        illuminance: On a horizontal plane, sun included [lx].
    """

    radiance: Image
    horizon: Image
    sun: Sun | None
    illuminance: float


def directions(size: tuple[int, int] = SIZE) -> Floats:
    """World direction of every texel's centre, (h, w, 3)."""
    rows, columns = size
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    azimuth = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    theta, azimuth = np.meshgrid(theta, azimuth, indexing="ij")
    east, north = np.sin(theta) * np.sin(azimuth), np.sin(theta) * np.cos(azimuth)
    return np.stack([east, north, np.cos(theta)], axis=-1)


def bake_sky(sky: Sky, size: tuple[int, int] = SIZE) -> SkyMap:
    """Turn a recipe into a map and a sun, in scene units."""
    towards = directions(size)
    sun = None
    if sky.image is not None:
        radiance = _resample(sky.image, size, sky.rotation) * sky.image_scale
    elif sky.sun_direction is None:
        radiance = np.zeros((*size, 3))
    else:
        radiance, sun = _day(sky, towards)
    radiance = np.maximum(radiance, 0.0) + np.asarray(sky.night)
    horizon = _horizon(radiance, towards)
    if sky.image is None:
        radiance = _with_ground(radiance, horizon, towards)
    light = _irradiance(radiance, towards)
    if sun is not None:
        light = light + sun.irradiance * max(float(sun.direction[2]), 0.0)
    return SkyMap(
        radiance.astype(np.float32),
        horizon.astype(np.float32),
        sun,
        float(light @ _LUMINANCE) * CANDELAS_PER_UNIT,
    )


def _with_ground(radiance: Floats, horizon: Floats, towards: Floats) -> Floats:
    """Fill the lower half: as the horizon at its edge, so that no dark line shows, then darker."""
    down = -towards[..., 2:]
    share = np.clip(1.0 - 10.0 * down, 0.3, 1.0)
    return np.where(down > 0, horizon[None] * share, radiance)


def _weights(towards: Floats) -> Floats:
    """Solid angle x cosine to the zenith of every texel, (h, w) [sr]."""
    rows, columns = towards.shape[:2]
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    solid_angle = np.sin(theta)[:, None] * (np.pi / rows) * (2 * np.pi / columns)
    return np.asarray(solid_angle * np.maximum(towards[..., 2], 0.0))


def _irradiance(radiance: Floats, towards: Floats) -> Floats:
    """On a horizontal plane, (3,) in scene units."""
    return np.asarray(np.einsum("hwc,hw->c", radiance, _weights(towards)))


def _evaluate(plugin: mi.Emitter, towards: Floats) -> Floats:
    """Radiance of an environment emitter in given directions, (..., 3)."""
    flat = np.ascontiguousarray(towards.reshape(-1, 3), dtype=np.float32)
    if "scalar" in mi.variant():
        result = np.empty(flat.shape)
        si = mi.SurfaceInteraction3f()
        for index, direction in enumerate(flat):
            si.wi = mi.Vector3f(*(-direction).tolist())
            result[index] = np.array(plugin.eval(si))
        return result.reshape(towards.shape)
    si = dr.zeros(mi.SurfaceInteraction3f, len(flat))
    si.wi = mi.Vector3f(*(mi.Float(np.ascontiguousarray(-flat[:, axis])) for axis in range(3)))
    values = np.array(plugin.eval(si), dtype=np.float64)
    return np.ascontiguousarray(values.T).reshape(towards.shape)


def _sunsky(sky: Sky, *, sun: float, air: float) -> mi.Emitter:
    """Mitsuba's plugin for a sun at least 2 degrees up."""
    assert sky.sun_direction is not None
    return mi.load_dict(
        {
            "type": "sunsky",
            "sun_direction": [float(value) for value in _lifted(sky.sun_direction)],
            "turbidity": float(sky.turbidity),
            "sun_scale": sun,
            "sky_scale": air,
            "albedo": {"type": "rgb", "value": 0.2},
        }
    )


def _lifted(direction: Floats) -> Floats:
    """The same azimuth, but at least as high as the model reaches."""
    elevation = max(float(np.arcsin(np.clip(direction[2], -1.0, 1.0))), _LOWEST_SUN)
    level = np.hypot(direction[0], direction[1])
    azimuth = np.array([0.0, 1.0]) if level < 1e-9 else direction[:2] / level
    return np.array([*(azimuth * np.cos(elevation)), np.sin(elevation)])


def twilight_factor(elevation: float) -> float:
    """Light left of that at 2 degrees of elevation, for a sun at `elevation` [rad]."""
    degrees = np.degrees(elevation)
    log_lux = np.interp(degrees, _TWILIGHT[:, 0], np.log(_TWILIGHT[:, 1]))
    return float(np.exp(log_lux) / _TWILIGHT[-1, 1])


def _clear_sky(sky: Sky, towards: Floats) -> Floats:
    """The sky without sun or clouds, in scene units."""
    assert sky.sun_direction is not None
    # The model is smooth, so a quarter of the rows and columns carries it.
    coarse = towards[2::4, 2::4].copy()
    coarse[..., 2] = np.maximum(coarse[..., 2], 0.012)
    coarse /= np.linalg.norm(coarse, axis=-1, keepdims=True)
    radiance = _evaluate(_sunsky(sky, sun=0.0, air=1.0), coarse)
    scale = UNITS_PER_SUNSKY * twilight_factor(float(np.arcsin(sky.sun_direction[2])))
    return _resample(np.maximum(radiance, 0.0), towards.shape[:2], 0.0) * scale


def _sun_irradiance(sky: Sky) -> Floats:
    """On a plane facing the sun, before clouds, (3,) in scene units."""
    assert sky.sun_direction is not None
    elevation = float(np.arcsin(sky.sun_direction[2]))
    risen = np.clip((elevation + SUN_RADIUS) / (2 * SUN_RADIUS), 0.0, 1.0)
    if risen == 0.0:
        return np.zeros(3)
    centre = _lifted(sky.sun_direction)
    side = np.cross(centre, [0.0, 0.0, 1.0] if centre[2] < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    grid = (np.arange(24) + 0.5) / 12 - 1
    across, along = np.meshgrid(grid, grid)
    tilt = np.tan(SUN_RADIUS) * (
        across[..., None] * side + along[..., None] * np.cross(centre, side)
    )
    rays = centre + tilt
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    radiance = np.maximum(_evaluate(_sunsky(sky, sun=1.0, air=0.0), rays), 0.0)
    square = (2 * np.tan(SUN_RADIUS)) ** 2
    scale = UNITS_PER_SUNSKY * risen * twilight_factor(elevation)
    return np.asarray(radiance.mean(axis=(0, 1)) * square * scale)


def _day(sky: Sky, towards: Floats) -> tuple[Floats, Sun | None]:
    """The clear sky with clouds laid over it, and the sun as far as it shines through."""
    assert sky.sun_direction is not None
    radiance = _clear_sky(sky, towards)
    irradiance = _sun_irradiance(sky)
    if sky.clouds is not None:
        layer = _resample_clouds(sky.clouds, towards, sky.rotation)
        air = _irradiance(radiance, towards)
        cover = layer[..., :1]
        lit = (layer[..., 1:2] * irradiance + layer[..., 2:3] * air) / np.pi
        radiance = radiance * (1 - cover) + lit * cover
        irradiance = irradiance * (1 - _at(cover[..., 0], sky.sun_direction))
    shines = irradiance.max() > 1e-6
    return radiance, Sun(sky.sun_direction, irradiance) if shines else None


def _at(values: Floats, direction: Floats) -> float:
    """Value of a map, (h, w), in one direction."""
    rows, columns = values.shape
    row = np.arccos(np.clip(direction[2], -1, 1)) / np.pi * rows
    column = (np.arctan2(direction[0], direction[1]) / (2 * np.pi)) % 1.0 * columns
    return float(values[min(int(row), rows - 1), int(column) % columns])


def _resample(image: Floats | Image, size: tuple[int, int], rotation: float) -> Floats:
    """Bring an equirectangular map, (h, w, c), to a size, turned clockwise [rad]."""
    rows, columns = size
    height, width = image.shape[:2]
    row = np.clip((np.arange(rows) + 0.5) / rows * height - 0.5, 0, height - 1)
    column = ((np.arange(columns) + 0.5) / columns - rotation / (2 * np.pi)) * width - 0.5
    top, left = np.floor(row).astype(int), np.floor(column).astype(int)
    down, right = (row - top)[:, None, None], (column - left)[None, :, None]
    bottom = np.minimum(top + 1, height - 1)
    upper = image[top][:, left % width] * (1 - right) + image[top][:, (left + 1) % width] * right
    lower = (
        image[bottom][:, left % width] * (1 - right) + image[bottom][:, (left + 1) % width] * right
    )
    return np.asarray(upper * (1 - down) + lower * down, dtype=np.float64)


def _resample_clouds(clouds: CloudLayer, towards: Floats, rotation: float) -> Floats:
    """Cover, sunlit and skylit over the whole map, (h, w, 3); nothing below the horizon."""
    rows, columns = towards.shape[:2]
    layer = np.stack([clouds.cover, clouds.sunlit, clouds.skylit], axis=-1)
    whole = np.zeros((rows, columns, 3))
    whole[: rows // 2] = _resample(layer, (rows // 2, columns), rotation)
    return whole


def _horizon(radiance: Floats, towards: Floats) -> Floats:
    """Radiance in the lowest 3 degrees of sky, without the sun, smooth around, (w, 3)."""
    elevation = np.arcsin(np.clip(towards[:, 0, 2], -1, 1))
    band = (elevation > 0) & (elevation < np.radians(3))
    ring = np.median(radiance[band], axis=0)
    width = ring.shape[0] // 32
    wrapped = np.concatenate([ring[-width:], ring, ring[:width]])
    sums = np.cumsum(np.concatenate([np.zeros((1, 3)), wrapped]), axis=0)
    return np.asarray((sums[2 * width + 1 :] - sums[: -2 * width - 1]) / (2 * width + 1))


def horizon_towards(horizon: Image, towards: Floats) -> Floats:
    """Horizon radiance below or above each direction, (..., 3) -> (..., 3)."""
    columns = len(horizon)
    place = np.arctan2(towards[..., 0], towards[..., 1]) / (2 * np.pi) * columns - 0.5
    left = np.floor(place).astype(int)
    right = (place - left)[..., None]
    return np.asarray(horizon[left % columns] * (1 - right) + horizon[(left + 1) % columns] * right)
