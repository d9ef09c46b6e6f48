"""The clear sky by day, in twilight and at night, what shines in it, and maps of it.

Maps are equirectangular: rows go from the zenith downwards, columns clockwise from north. A *dome*
is the upper half of such a map.

Mitsuba's `sunsky` gives the sky where the sun stands above 16 degrees. We pass a direction, because
its sun by date is mirrored. Below 7 degrees, where `sunsky` lacks the glow around the sun and turns
green, and black below 2 degrees, the sky comes from `air`. In between both are blended. Low suns
are dimmed to the mean of two published curves, because `sunsky` is up to two thirds brighter than
both; twilight follows the almanac. At night there are airglow, stars, a city's glow, and the moon's
light.

References:
    Wilkie et al., A fitted radiance and attenuation model for realistic atmospheres,
    ACM TOG 40(4), 2021, behind `sunsky`.
    IES, Recommended practice for the calculation of daylight availability, J. IES
    13(4), 1984, doi:10.1080/00994480.1984.10748791.
    Janiczek and DeYoung, US Naval Observatory Circular 171, 1987.
    Seidelmann (ed.), Explanatory Supplement to the Astronomical Almanac, 1992, table
    of horizontal illuminance from the sun and twilight.
    Kyba, Mohar and Posch, How bright is moonlight?, Astronomy & Geophysics 58(1), 2017
    (0.32 lx at most; usually less).
    Allen's Astrophysical Quantities, 4th ed., 2000 (magnitude 0 is 2.54e-6 lx).
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Sky
from sumo3dviz_pt.render.kernels import aligned, load
from sumo3dviz_pt.render.sky.air import clear_dome, sunlight


def angles(size: tuple[int, int], *, share: float = 1.0) -> tuple[Floats, Floats]:
    """Return the elevations of the rows and azimuths of the columns [rad].

    Args:
        size: Rows and columns.
        share: Of the way from zenith to nadir that the rows cover; a dome covers 0.5.
    """
    rows, columns = size
    elevation = np.pi / 2 - (np.arange(rows) + 0.5) / rows * np.pi * share
    return elevation, (np.arange(columns) + 0.5) / columns * 2 * np.pi


def directions(size: tuple[int, int], *, share: float = 1.0) -> Floats:
    """Return the world direction of every texel's centre, (h, w, 3); arguments as in `angles`."""
    high, around = angles(size, share=share)
    level = np.cos(high)[:, None]
    up = np.broadcast_to(np.sin(high)[:, None], size)
    return np.stack([level * np.sin(around), level * np.cos(around), up], axis=-1)


def dome_irradiance(dome: Floats | Image) -> Floats:
    """Return the light of a dome, (h, w, 3), on a horizontal plane, (3,) in the dome's unit."""
    rows = len(dome)
    high, _ = angles((rows, 1), share=0.5)
    weights = np.sin(high) * np.cos(high) * (np.pi / 2 / rows) * 2 * np.pi
    return np.asarray(weights @ dome.mean(axis=1, dtype=np.float64))


def _neighbours(count: int, known: int) -> tuple[NDArray[np.intp], Floats]:
    """Return the nearest known texel before each of `count`, and the share of the next one."""
    place = (np.arange(count) + 0.5) / count * known - 0.5
    first = np.floor(place).astype(np.intp)
    return first, place - first


def resampled(image: Floats | Image, size: tuple[int, int], rotation: float = 0.0) -> Image:
    """Bring a map or dome, (h, w, c), to a size, turned clockwise, linear in between.

    Args:
        image: Maps are periodic along their columns and end with their rows.
        size: Rows and columns wanted.
        rotation: Rounded to whole texels where the map has the columns wanted [rad].
    """
    rows, columns = size
    height, width = image.shape[:2]
    result = np.asarray(image, dtype=np.float32)
    if width == columns:
        result = np.roll(result, round(rotation / (2 * np.pi) * width), axis=1)
    if height != rows:
        top, share = _neighbours(rows, height)
        down = share[:, None, None].astype(np.float32)
        low, high = np.clip(top, 0, height - 1), np.clip(top + 1, 0, height - 1)
        result = result[low] * (1 - down) + result[high] * down
    if width != columns:
        turned = np.arange(columns) + 0.5 - rotation / (2 * np.pi) * columns
        place = turned / columns * width - 0.5
        left = np.floor(place).astype(np.intp)
        right = (place - left)[None, :, None].astype(np.float32)
        result = result[:, left % width] * (1 - right) + result[:, (left + 1) % width] * right
    return np.asarray(result)


def at(values: Floats | Image, direction: Floats, *, share: float = 1.0) -> Floats:
    """Return a map's value in one direction.

    Args:
        values: The map, (h, w, ...).
        direction: Unit vector, (3,).
        share: Of the way from zenith to nadir that the rows cover.
    """
    rows, columns = values.shape[:2]
    row = np.arccos(np.clip(direction[2], -1, 1)) / (np.pi * share) * rows
    column = (np.arctan2(direction[0], direction[1]) / (2 * np.pi)) % 1.0 * columns
    return np.asarray(values[min(int(row), rows - 1), int(column) % columns])


UNITS_PER_SUNSKY = np.array([2.134, 2.324, 2.446])
"""Scene units per `sunsky` unit: about 100 klx at 60 degrees, turbidity 3, and of the
camera's daylight balance: sun and sky together are white there."""

SUN_RADIUS = np.radians(0.2666)
"""Angular radius of the sun's disc [rad]."""

LOWEST = np.radians(-24.0)
"""Elevation of the sun below which nothing of its light is left [rad]."""

_MODEL_ENDS = np.radians(2.0)
_OWN_ENDS, _MODEL_ALONE = np.radians(7.0), np.radians(16.0)
_COARSE = (128, 256)
_PALE = np.array([0.98, 0.996, 1.10])
_CLOUD_HEIGHT = 6_000.0  # from where clouds see the sun for a while after it has set [m]

# Sun's elevation [deg], factor on the sky and factor on the sun of `sunsky`, at turbidity 3.
_AGREEMENT = np.array(
    [
        [2.0, 0.505, 0.24],
        [3.0, 0.573, 0.26],
        [5.0, 0.595, 0.51],
        [8.0, 0.595, 0.725],
        [10.0, 0.600, 0.81],
        [15.0, 0.650, 0.92],
        [20.0, 0.760, 0.97],
        [30.0, 0.930, 1.0],
        [40.0, 1.0, 1.0],
        [90.0, 1.0, 1.0],
    ]
)

# Sun's elevation [deg], horizontal illuminance of sky and sun [lx]; extrapolated below -18 deg.
_TWILIGHT = np.array(
    [
        [-24.0, 1e-6],
        [-18.0, 6.5e-4],
        [-12.0, 8.3e-3],
        [-6.0, 3.4],
        [-5.0, 10.8],
        [-4.0, 27.0],
        [-2.0, 154.0],
        [-0.8, 453.0],
        [0.0, 732.0],
        [2.0, 2270.0],
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class Daylight:
    """What the sun does, in scene units.

    Attributes:
        dome: Radiance of the clear sky, upper half, (h, w, 3).
        sun: Irradiance on a plane that faces the sun's disc, as far as it has risen, (3,).
        on_clouds: The same high above, where the sun sets later, (3,).
    """

    dome: Image
    sun: Floats
    on_clouds: Floats


def twilight_factor(elevation: float) -> float:
    """Return a sun's light against that of one at 2 degrees, by its elevation [rad]."""
    from scipy.interpolate import PchipInterpolator

    degrees = np.clip(np.degrees(elevation), _TWILIGHT[0, 0], _TWILIGHT[-1, 0])
    course = PchipInterpolator(_TWILIGHT[:, 0], np.log(_TWILIGHT[:, 1]))
    return float(np.exp(course(degrees)) / _TWILIGHT[-1, 1])


def agreement(elevation: float) -> tuple[float, float]:
    """Return the factors that bring `sunsky`'s sky and sun to the published curves."""
    from scipy.interpolate import PchipInterpolator

    degrees = np.clip(np.degrees(elevation), _AGREEMENT[0, 0], 90.0)
    sky, sun = PchipInterpolator(_AGREEMENT[:, 0], _AGREEMENT[:, 1:])(degrees)
    return float(sky), float(sun)


def daylight(direction: Floats, turbidity: float, size: tuple[int, int]) -> Daylight:
    """Compute the clear sky and the sun's light, wherever the sun stands.

    Args:
        direction: Unit vector to the sun, (3,).
        turbidity: Of the air, [1, 10].
        size: Rows and columns of the dome.
    """
    elevation = float(np.arcsin(np.clip(direction[2], -1.0, 1.0)))
    if elevation < LOWEST:
        return Daylight(np.zeros((*size, 3), np.float32), np.zeros(3), np.zeros(3))
    model = _SunskyModel(direction, turbidity)
    fade = twilight_factor(elevation)
    share = eased(min(max((elevation - _OWN_ENDS) / (_MODEL_ALONE - _OWN_ENDS), 0.0), 1.0))
    sky, sun = agreement(elevation)
    coarse = model.sky() * (sky * fade)
    direct = model.sun() * sun
    if share < 1.0:
        light = float(dome_irradiance(coarse) @ LUMINANCE)
        own = _own_dome(elevation, direction, turbidity, light)
        coarse = share * coarse + (1.0 - share) * own
        direct = _own_sun(elevation, direct, turbidity, share)
    high = direct if share == 1.0 else _sun_aloft(elevation, direct, turbidity, share)
    return Daylight(resampled(coarse, size), direct * risen_share(elevation), high)


def risen_share(elevation: float) -> float:
    """Return the share of the sun's disc above the horizon, by its middle's elevation [rad]."""
    x = float(np.clip(elevation / SUN_RADIUS, -1.0, 1.0))
    return float(0.5 + (np.arcsin(x) + x * np.sqrt(1.0 - x * x)) / np.pi)


def _own_dome(elevation: float, direction: Floats, turbidity: float, light: float) -> Floats:
    """Return the sky of `air`, coarse, brought to a luminous irradiance in scene units."""
    rows, columns = _COARSE
    azimuth = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    high = np.pi / 2 * (1.0 - (np.arange(rows) + 0.5) / rows)
    away = azimuth - np.arctan2(direction[0], direction[1])
    dome = clear_dome(elevation, turbidity).towards(high, away)
    return dome * (light / max(float(dome_irradiance(dome) @ LUMINANCE), 1e-30))


def _own_sun(elevation: float, model: Floats, turbidity: float, share: float) -> Floats:
    """Return the low sun's light in the colour of `air`, dimmed like it where it is lowest."""
    suns = np.sin([elevation, max(elevation, float(_MODEL_ENDS))])
    lit = sunlight(np.full(2, 200.0), suns, turbidity)
    tint = lit[0] / max(float(lit[0] @ LUMINANCE), 1e-12)
    fade = float(lit[0] @ LUMINANCE) / float(lit[1] @ LUMINANCE)
    power = float(model @ LUMINANCE)
    return np.asarray((share * model / max(power, 1e-12) + (1.0 - share) * tint) * power * fade)


def _sun_aloft(elevation: float, direct: Floats, turbidity: float, share: float) -> Floats:
    """Return the sun's light on clouds: that on the ground times the ratio which `air` gives."""
    outside = 4.0  # scene units: 128 klx
    lit = sunlight(np.array([_CLOUD_HEIGHT]), np.sin([elevation]), turbidity)[0] * outside
    return np.asarray(share * direct + (1.0 - share) * lit)


class _SunskyModel:
    """Mitsuba's `sunsky` for one sun, in scene units."""

    def __init__(self, direction: Floats, turbidity: float) -> None:
        self._towards, self._turbidity = _lifted(direction), turbidity

    def sky(self) -> Floats:
        """Return the coarse dome without the sun."""
        towards = directions(_COARSE, share=0.5)
        towards[..., 2] = np.maximum(towards[..., 2], 0.012)
        towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
        radiance = _evaluate(self._plugin(sun=0.0, air=1.0), towards)
        radiance = np.maximum(radiance, 0.0) * UNITS_PER_SUNSKY
        # At the horizon the model is turquoise; aerosol makes the real one whitish.
        high = np.arcsin(towards[:, :1, 2:])
        pale = 0.42 * np.exp(-((high / np.radians(5.0)) ** 2))
        grey = (radiance @ LUMINANCE)[..., None] * _PALE
        return np.asarray(radiance * (1.0 - pale) + grey * pale)

    def sun(self) -> Floats:
        """Return the irradiance of the whole disc on a plane that faces it, (3,)."""
        centre = self._towards
        side = np.cross(centre, [0.0, 0.0, 1.0] if centre[2] < 0.9 else [1.0, 0.0, 0.0])
        side /= np.linalg.norm(side)
        grid = (np.arange(24) + 0.5) / 12 - 1
        across, along = np.meshgrid(grid, grid)
        tilt = np.tan(SUN_RADIUS) * (
            across[..., None] * side + along[..., None] * np.cross(centre, side)
        )
        rays = centre + tilt
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        radiance = np.maximum(_evaluate(self._plugin(sun=1.0, air=0.0), rays), 0.0)
        square = (2 * np.tan(SUN_RADIUS)) ** 2
        return np.asarray(radiance.mean(axis=(0, 1)) * square * UNITS_PER_SUNSKY)

    def _plugin(self, *, sun: float, air: float) -> mi.Emitter:
        """Load Mitsuba's emitter with its sun and sky scaled."""
        return load(
            {
                "type": "sunsky",
                "sun_direction": [float(value) for value in self._towards],
                "turbidity": float(self._turbidity),
                "sun_scale": sun,
                "sky_scale": air,
                "albedo": {"type": "rgb", "value": 0.2},
            }
        )


def _lifted(direction: Floats) -> Floats:
    """Return a direction of the same azimuth that is not below the model's lowest sun."""
    elevation = max(float(np.arcsin(np.clip(direction[2], -1.0, 1.0))), float(_MODEL_ENDS))
    level = np.hypot(direction[0], direction[1])
    azimuth = np.array([0.0, 1.0]) if level < 1e-9 else direction[:2] / level
    return np.array([*(azimuth * np.cos(elevation)), np.sin(elevation)])


def _evaluate(plugin: mi.Emitter, towards: Floats) -> Floats:
    """Return the radiance of an environment emitter in given directions, (..., 3)."""
    flat = np.ascontiguousarray(towards.reshape(-1, 3), dtype=np.float32)
    if "scalar" in mi.variant():
        result = np.empty(flat.shape)
        si = mi.SurfaceInteraction3f()
        for index, direction in enumerate(flat):
            si.wi = mi.Vector3f(*(-direction).tolist())
            result[index] = np.array(plugin.eval(si))
        return result.reshape(towards.shape)
    si = dr.zeros(mi.SurfaceInteraction3f, len(flat))
    si.wi = mi.Vector3f(*(mi.Float(aligned(-flat[:, axis], np.float32)) for axis in range(3)))
    values = np.array(plugin.eval(si), dtype=np.float64)
    return np.ascontiguousarray(values.T).reshape(towards.shape)


MOON_PER_SUN = 0.32 / 128_000.0
"""Light of the full moon against that of the sun, both outside the air."""

STAR_GAIN = 10.0
"""Stars are this much brighter than real ones, and their range is compressed: a picture exposed
for street lamps would show only a handful."""

_STARS, _FAINTEST, _STEEPNESS = 5000, 6.2, 1.25  # 10^0.5 times more stars per magnitude
_BRIGHTEST, _RANGE = 0.0, 0.68
_DROWNS = 1e-6  # glow that takes three quarters of a magnitude of the faintest [scene units]
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
        _add_stars(dome, seed=sky.stars, glow=float(np.asarray(sky.glow) @ LUMINANCE))
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


def _add_stars(dome: Image, *, seed: int, glow: float) -> None:
    """Paint seeded stars: Pareto fluxes, colours from orange to blue, dimmed by thick air.

    A city's glow at the horizon, in scene units, hides faint ones. Each lies on one texel's
    centre, so that it is shown one texel wide. Near the zenith, where texels are narrow, it is
    spread over several, so that it looks round.
    """
    rows, columns = dome.shape[:2]
    rng = np.random.default_rng(seed)
    sine, azimuth = rng.uniform(0.05, 1.0, _STARS), rng.uniform(0.0, 1.0, _STARS)
    magnitude = _FAINTEST - 2.5 * np.log10(1.0 + rng.pareto(_STEEPNESS, _STARS))
    shown = magnitude <= _FAINTEST - 2.5 * np.log10(1.0 + glow / _DROWNS)
    magnitude = _RANGE * np.maximum(magnitude, _BRIGHTEST)
    warmth = np.clip(rng.normal(0.0, 0.16, (_STARS, 1)), -0.3, 0.4)
    colour = np.clip(1.0 + warmth * np.array([1.0, 0.0, -1.4]), 0.2, 2.0)
    lux = shown * STAR_GAIN * _LUX_OF_ZERO * 10.0 ** (-0.4 * (magnitude + 0.25 / sine))
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
