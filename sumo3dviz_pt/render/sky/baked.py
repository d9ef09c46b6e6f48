"""Bakes a sky recipe into one radiance map and a sun or moon, and keeps skies of fine detail.

Skies with clouds or stars lie in the user's cache, as baking one takes a CPU-second. Clouds are
laid over the clear sky of `daylight` and `night`. The sun is a separate emitter: if it were painted
into the map, nine of ten light samples would go there, and what lies in the shade would be noisy.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
from dataclasses import dataclass, replace
from pathlib import Path

import mitsuba as mi
import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.atomic import Files, make_room, read_folder, write_folder
from sumo3dviz_pt.files.values import kinds_in, packed
from sumo3dviz_pt.model.falling import SkyLight
from sumo3dviz_pt.model.geometry import Colour, Floats, Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Sky
from sumo3dviz_pt.render.sky.daylight import (
    LOWEST,
    SUN_RADIUS,
    at,
    daylight,
    dome_irradiance,
    glow,
    night_dome,
    resampled,
    risen_share,
)

_SMOOTH, _SHARP = (1024, 2048), (2560, 5120)
_HAZY = np.radians(0.7)  # height of the band of sky whose light distant things fade into
_FAINT = 1e-6  # irradiance of a sun that is left out, scene units
_SIDES = 0.2  # how much of a cloud's light does not depend on the sun's height
_GREY = 0.3  # share of a cloud's ambient light that has no colour
_FROM_BELOW = 1.35  # light of a city on clouds over it, against its glow in clear air
_RELIEF = 0.35  # share of that light which their shape changes: it comes from all sides
_MAP_MOST = 1.1  # most light under broken clouds, against its mean for their cover
_EVERY = 8  # of how many rows and columns one tells a dome's mean
_MAP_LEAST = 0.04  # least share of their light that clouds keep when it is limited


@dataclass(frozen=True, slots=True, eq=False)
class Sun:
    """The sun's disc, or the moon's.

    Attributes:
        direction: Unit vector to its centre, (3,).
        irradiance: On a plane that faces it, of what stands above the horizon, (3,) in
            scene units.
        moon: Whether it is the moon.
    """

    direction: Floats
    irradiance: Floats
    moon: bool = False

    @property
    def risen(self) -> float:
        """Share of the disc above the horizon."""
        return risen_share(float(np.arcsin(self.direction[2])))

    @property
    def radiance(self) -> Floats:
        """Of the disc, (3,) in scene units."""
        disc = np.pi * np.sin(SUN_RADIUS) ** 2 * self.risen
        return np.asarray(self.irradiance / disc)


@dataclass(frozen=True, slots=True, eq=False)
class SkyMap:
    """A baked sky.

    Attributes:
        closed: Rows from zenith to nadir, columns clockwise from north, (h, w + 2, 3), without the
            sun; the last column stands before the first, too, and the first after the last.
        horizon: Radiance just above the horizon, columns clockwise from north, (w, 3).
        sun: The sun or moon, or None when both are down or hidden.
        illuminance: On a horizontal plane, sun included [lx].
    """

    closed: Image
    horizon: Image
    sun: Sun | None
    illuminance: float

    @property
    def radiance(self) -> Image:
        """Each direction once, rows and columns as in `closed`, (h, w, 3)."""
        return self.closed[:, 1:-1]


def _closed(upper: Image, lower: tuple[Image, Image]) -> Image:
    """Put two halves, (h, w, 3), under each other, closed around as in `SkyMap`.

    Written once, as Mitsuba keeps it: these maps are the largest arrays of a scene.

    Args:
        upper: The upper half.
        lower: Two factors of the lower one, which make its shape together.
    """
    rows, columns = upper.shape[:2]
    whole = np.empty((2 * rows, columns + 2, 3), np.float32)
    whole[:rows, 1:-1] = upper
    np.multiply(*lower, out=whole[rows:, 1:-1])
    whole[:, 0], whole[:, -1] = whole[:, -2], whole[:, 1]
    return whole


def map_size(sky: Sky) -> tuple[int, int]:
    """Return how many rows and columns a sky needs: clouds and stars need more than clear air."""
    fine = sky.clouds is not None or sky.stars is not None
    return _SHARP if fine else _SMOOTH


def bake_sky(sky: Sky, size: tuple[int, int] | None = None) -> SkyMap:
    """Turn a recipe into a map and a sun, in scene units.

    Args:
        sky: The recipe.
        size: Rows and columns of the map; default what the sky needs.
    """
    size = size or map_size(sky)
    rows, columns = size
    if sky.image is not None:
        whole = np.maximum(resampled(sky.image, size, sky.rotation) * sky.image_scale, 0.0)
        whole = np.asarray(whole + np.asarray(sky.night, np.float32), np.float32)
        upper, lower = whole[: rows // 2], whole[rows // 2 :]
        closed = _closed(upper, (lower, np.ones((1, 1, 1), np.float32)))
        return SkyMap(closed, horizon_of(upper), None, illuminance_of(upper, None))
    return sky_of_dome(*bake_dome(sky, (rows // 2, columns)))


def sky_of_dome(dome: Image, sun: Sun | None) -> SkyMap:
    """Return the sky of an upper half, (h, w, 3), and what stands in it."""
    horizon = horizon_of(dome)
    whole = _closed(dome, _lower_half(horizon, len(dome)))
    return SkyMap(whole, horizon, sun, illuminance_of(dome, sun))


def illuminance_of(dome: Image, sun: Sun | None) -> float:
    """Return the horizontal illuminance [lx]."""
    light = dome_irradiance(dome)
    if sun is not None:
        light = light + sun.irradiance * max(float(sun.direction[2]), 0.0)
    return float(light @ LUMINANCE) * CANDELAS_PER_UNIT


def sky_light(sky: SkyMap) -> SkyLight:
    """Return the light of a sky as what falls through the air sees it."""
    dome = sky.radiance[: len(sky.radiance) // 2 : _EVERY, ::_EVERY]
    even = _colour(dome_irradiance(dome) / np.pi)
    if sky.sun is None:
        return SkyLight(even)
    east, north, up = (float(part) for part in sky.sun.direction)
    return SkyLight(even, _colour(sky.sun.irradiance), (east, north, up))


def _colour(values: Floats) -> Colour:
    """Three numbers."""
    red, green, blue = (float(value) for value in values)
    return red, green, blue


def _lower_half(horizon: Image, rows: int) -> tuple[Image, Image]:
    """Return the lower half's factors, (h, 1, 1) and (1, w, 3).

    It is like the horizon at its edge, lest a dark line shows, then darker.
    """
    down = np.sin((np.arange(rows) + 0.5) / rows * np.pi / 2)
    share = np.clip(1.0 - 10.0 * down, 0.3, 1.0).astype(np.float32)
    return share[:, None, None], horizon[None]


@dataclass(frozen=True, slots=True, eq=False)
class _SkyLight:
    """What shines on clouds and ground, (3,) each in scene units.

    Attributes:
        towards: Unit vector to the sun or moon, (3,).
        ground: Irradiance facing it, on the ground.
        aloft: The same, on clouds.
        moon: Whether it is the moon.
    """

    towards: Floats
    ground: Floats
    aloft: Floats
    moon: bool


def bake_dome(sky: Sky, size: tuple[int, int]) -> tuple[Image, Sun | None]:
    """Bake the upper half of a sky that is no picture; return it and the sun or moon.

    Args:
        sky: The recipe.
        size: Rows and columns of the upper half.
    """
    dome, moonlight = night_dome(sky, size)
    light = None
    if sky.moon_direction is not None:
        light = _SkyLight(sky.moon_direction, moonlight, moonlight, True)
    if sky.sun_direction is not None and sky.sun_direction[2] > np.sin(LOWEST):
        day = daylight(sky.sun_direction, sky.turbidity, size)
        tint = np.asarray(sky.tint)
        dome = dome + day.dome * tint.astype(np.float32)
        if light is None or day.sun.max() > _FAINT:
            light = _SkyLight(sky.sun_direction, day.sun * tint, day.on_clouds * tint, False)
    through = 1.0
    if sky.clouds is not None:
        dome, cover = _clouded(sky, dome, light)
        if light is not None:
            through = 1.0 - float(at(cover, light.towards, share=0.5))
    if light is None or light.ground.max() * through <= (0.0 if light.moon else _FAINT):
        return dome, None
    return dome, Sun(light.towards, light.ground * through, light.moon)


def _clouded(sky: Sky, dome: Image, light: _SkyLight | None) -> tuple[Image, Image]:
    """Lay clouds over a dome; return the dome and the clouds' cover, (h, w)."""
    assert sky.clouds is not None
    size = (dome.shape[0], dome.shape[1])
    layer = np.stack([sky.clouds.cover, sky.clouds.sunlit, sky.clouds.skylit], axis=-1)
    layer = resampled(layer, size, sky.rotation)
    cover, air = layer[..., :1], dome_irradiance(dome)
    # Light from the ground reaches clouds, too, and it is not blue.
    grey = _GREY * (air @ LUMINANCE) + (1.0 - _GREY) * air
    lit = layer[..., 2:] * (grey / np.pi).astype(np.float32)
    if light is not None:
        aslant = _aslant(float(light.towards[2]), float(np.sin(sky.clouds.lit_from)))
        lit += layer[..., 1:2] * (light.aloft * aslant / np.pi).astype(np.float32)
    dome, lit = dome * (1 - cover), lit * cover
    direct = _direct(light)
    through = 0.0 if light is None else 1.0 - float(at(cover[..., 0], light.towards, share=0.5))
    most = _most(float(air @ LUMINANCE) + direct, cover) - direct * through
    lit *= np.float32(_room(most - float(dome_irradiance(dome) @ LUMINANCE), lit))
    if max(sky.glow) > 0.0:
        below = (1.0 - _RELIEF) + _RELIEF * layer[..., 2:]
        lit += cover * below * (_FROM_BELOW * glow(sky.glow, size))
    return dome + lit, cover[..., 0]


def _aslant(sine: float, baked: float) -> float:
    """Return the sun's light on a cloud against that which the cloud was baked for."""
    return min(1.0, (max(sine, 0.0) + _SIDES) / (baked + _SIDES))


def _direct(light: _SkyLight | None) -> float:
    """Return the horizontal luminous irradiance from the disc without clouds, scene units."""
    if light is None:
        return 0.0
    return float(light.ground @ LUMINANCE) * max(float(light.towards[2]), 0.0)


def _most(clear: float, cover: Image) -> float:
    """Return the most luminous irradiance that a cover leaves of a clear sky's.

    Kasten and Czeplak 1980, Solar Energy 24(2), doi:10.1016/0038-092X(80)90391-6: N of
    cloud leave 1 - 0.75 N^3.4 of the clear sky's light, on average.
    """
    share = float(dome_irradiance(cover)[0]) / np.pi
    return float(_MAP_MOST * clear * (1.0 - 0.75 * min(share, 1.0) ** 3.4))


def _room(left: float, lit: Image) -> float:
    """Return the factor that keeps clouds from adding more light than is left for them."""
    made = float(dome_irradiance(lit) @ LUMINANCE)
    return min(1.0, max(left, _MAP_LEAST * made) / max(made, 1e-30))


def horizon_of(dome: Image) -> Image:
    """Return the radiance in the lowest degrees of sky, without the sun, smooth around, (w, 3)."""
    rows = len(dome)
    band = max(2, round(rows * float(_HAZY) / (np.pi / 2)))
    ring = np.median(dome[-band:], axis=0).astype(np.float64)
    width = ring.shape[0] // 32
    wrapped = np.concatenate([ring[-width:], ring, ring[:width]])
    sums = np.cumsum(np.concatenate([np.zeros((1, 3)), wrapped]), axis=0)
    mean = (sums[2 * width + 1 :] - sums[: -2 * width - 1]) / (2 * width + 1)
    return np.asarray(mean, dtype=np.float32)


def horizon_towards(horizon: Image, towards: Floats | Image) -> Image:
    """Return the horizon's radiance below or above each direction, (..., 3) -> (..., 3).

    Single precision is enough; each channel lies for itself in memory.
    """
    columns = len(horizon)
    turn = np.arctan2(towards[..., 0], towards[..., 1])
    place = turn * (columns / (2 * np.pi)) - 0.5
    whole = np.floor(place)
    right = np.asarray(place - whole, dtype=np.float32)
    left = whole.astype(np.intp)
    colours = np.empty((3, *right.shape), dtype=np.float32)
    for one, channel in zip(colours, np.asarray(horizon.T, dtype=np.float32), strict=True):
        before = np.take(channel, left, mode="wrap")
        one[...] = before + (np.take(channel, left + 1, mode="wrap") - before) * right
    return np.moveaxis(colours, 0, -1)


_LOG = logging.getLogger(__name__)

_CACHED_LEAST = 8_000_000
"""Texels of a map that is worth keeping."""

_CACHED_MOST = 1_000_000_000
"""What all skies may take, a dozen [bytes]."""

_KINDS = kinds_in(Sky)

_DOME, _SUN = "dome.f32", "sun.json"


def cached_sky(sky: Sky, size: tuple[int, int] | None = None) -> SkyMap:
    """Return a baked sky: what was kept of it, or newly baked, and then kept if it is large.

    Args:
        sky: The recipe.
        size: Rows and columns of the map; default what the sky needs.
    """
    size = size or map_size(sky)
    if sky.image is not None or size[0] * size[1] < _CACHED_LEAST:
        return bake_sky(sky, size)
    folder, upper = _folder(sky, size), (size[0] // 2, size[1])
    dome = _cached_dome(folder, upper)
    if dome is None:
        dome = bake_dome(sky, upper)
        _cache_dome(folder, *dome)
    return sky_of_dome(*dome)


def _folder(sky: Sky, size: tuple[int, int]) -> Path:
    """Return where a sky is kept: its recipe, our code and Mitsuba are in the name.

    Clouds stand there by their key, so that they need not be read for it.
    """
    clouds = None if sky.clouds is None else sky.clouds.key
    plain = replace(sky, clouds=None, overcast=None)  # another recipe has `overcast` as its clouds
    recipe = packed((plain, clouds, size, mi.__version__, mi.variant()), _KINDS)
    digest = hashlib.blake2b(catalog.code_digest("render/sky"), digest_size=16)
    for content in recipe.values():
        digest.update(content)
    return catalog.cache_root() / "skies" / digest.hexdigest()


def _cached_dome(folder: Path, size: tuple[int, int]) -> tuple[Image, Sun | None] | None:
    """Return a cached upper half and what stands in it; None if it is not there or damaged."""
    files = read_folder(folder)
    if files is None:
        return None
    with contextlib.suppress(OSError):
        os.utime(folder)  # the oldest are removed first
    sun = json.loads(files[_SUN])
    return np.frombuffer(files[_DOME], np.float32).reshape(*size, 3), sun and Sun(
        np.array(sun["direction"]), np.array(sun["irradiance"]), sun["moon"]
    )


def _cache_dome(folder: Path, dome: Image, sun: Sun | None) -> None:
    """Keep an upper half, and remove the oldest ones if there are too many."""
    about = sun and {
        "direction": sun.direction.tolist(),
        "irradiance": sun.irradiance.tolist(),
        "moon": sun.moon,
    }
    files: Files = {
        _DOME: np.asarray(dome, np.float32).tobytes(),
        _SUN: json.dumps(about).encode(),
    }
    try:
        write_folder(folder, files)
        make_room(folder, _CACHED_MOST)
    except OSError as error:
        _LOG.info("%s: the sky is not kept (%s)", folder, error)
