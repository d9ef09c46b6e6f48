"""The sky in weather: closed by clouds, and seen through fog, as it reaches the ground.

Clouds that rain and snow fall from are laid over the clear sky and scaled to the light that such
clouds let through. Fog dims the sun along its slant way, hides the sky behind it, and shines by
itself: with sunlight that droplets scatter once, and with an even light that makes up the rest of
what passes the layer. Over a city by night its lamps light the fog, too, more than what they
scatter once towards the eye: by design, in proportion to the city's glow in clear air. The same
light is that of the air between things (`render/kernel/air.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.colour import LUMINANCE
from sumo3dviz_pt.model.daylight import (
    cloud_depth,
    cover,
    echo,
    passed,
    passed_diffuse,
    straight,
)
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.model.weather import ASYMMETRY, Weather, WeatherCourse
from sumo3dviz_pt.render.sky.kept import kept_sky
from sumo3dviz_pt.render.sky.map import (
    SkyMap,
    Sun,
    bake_sky,
    horizon_of,
    map_size,
    sky_of_dome,
)
from sumo3dviz_pt.render.sky.panorama import angles, dome_irradiance

_COARSE = (128, 256)
_THINNEST = 1e-3  # optical depth below which fog shines as at that depth
_LEAST = 0.05  # least share of the light from fog that is even
_CITY = 2.5  # light of a city on fog in its streets, against its glow at the horizon in clear air
_PALER = 0.5  # share of that light that has no colour: lamps are nearer than what glows far away
_AFLOAT = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Veil:
    """Light of air that nothing is seen through: `diffuse` + `direct` x phase function.

    Attributes:
        diffuse: Radiance in all directions, (3,) in scene units.
        direct: Irradiance by the sun or moon that droplets scatter, (3,) in scene units.
        towards: Unit vector to it, (3,).
    """

    diffuse: Floats
    direct: Floats
    towards: Floats


class WeatheredSky:
    """A sky over time.

    Args:
        sky: Its recipe.
        course: The weather.
        size: Rows and columns of its maps; default what the sky needs.
    """

    def __init__(
        self, sky: Sky, course: WeatherCourse, size: tuple[int, int] | None = None
    ) -> None:
        size = size or map_size(sky)
        self.dry = kept_sky(sky, size)
        self._rows = size[0] // 2
        # A city's lamps shine from below: rain clouds show their light, and do not take it away.
        unlit = replace(sky, glow=(0.0, 0.0, 0.0))
        self._closed: Image | None = None
        self._from_below: Image | None = None
        if sky.overcast is not None:
            self._closed = _dome_of(kept_sky(replace(unlit, clouds=sky.overcast), size))
            if max(sky.glow) > 0.0:
                lit = _dome_of(kept_sky(replace(sky, clouds=sky.overcast), size))
                self._from_below = np.maximum(lit - self._closed, np.float32(0.0))
        # What weather acts on is the light of a clear sky, whatever clouds stand on it.
        clear = bake_sky(replace(unlit, clouds=None), _COARSE if sky.image is None else size)
        self._clear, self._clear_sun = _dome_of(clear), clear.sun
        glow = np.asarray(sky.glow, dtype=np.float64)
        self._glow = _CITY * (_PALER * (glow @ LUMINANCE) + (1.0 - _PALER) * glow)
        self._last: tuple[Weather, SkyMap, Veil] | None = None
        self._sunny = any(cover(moment) < 1.0 for moment in course.moments)

    def at(self, weather: Weather) -> tuple[SkyMap, Veil]:
        """Return the sky of a moment and the light of its air.

        The sun is None where clouds hide it in all moments of the course; else it may be dark.
        """
        if self._last is None or self._last[0] != weather:
            self._last = (weather, *self._made(weather))
        return self._last[1:]

    def _made(self, weather: Weather) -> tuple[SkyMap, Veil]:
        """Make the sky of a moment."""
        dome, sun = self._light(weather)
        horizon = horizon_of(dome)
        veil = Veil(np.asarray(horizon.mean(axis=0, dtype=np.float64)), np.zeros(3), _AFLOAT)
        fog = weather.fog
        if fog is not None and fog.extinction > 0.0:
            lit = _Fogged.of(dome, sun, fog.overhead, weather).within(self._glow, fog.overhead)
            dome, sun = lit.dome, lit.sun
            veil = _mixed(lit.veil, veil, fog.extinction / weather.extinction)
        # What is compiled hangs on the course alone, so a sun that is hidden now stays there.
        return sky_of_dome(dome, sun if self._sunny else None), veil

    def _light(self, weather: Weather) -> tuple[Image, Sun | None]:
        """Dome and sun under the clouds of a moment, above its fog."""
        dome, sun, hidden = _dome_of(self.dry), self.dry.sun, cover(weather)
        if hidden <= 0.0 or self._closed is None:
            return dome, sun
        wanted = self._under_cloud(weather)
        given = float(dome_irradiance(self._closed) @ LUMINANCE)
        share = np.float32(hidden * wanted / max(given, 1e-30))
        dome = dome * np.float32(1.0 - hidden) + self._closed * share
        if self._from_below is not None:
            dome = dome + self._from_below * np.float32(hidden)
        if sun is not None:
            sun = replace(sun, irradiance=sun.irradiance * (1.0 - hidden))
        return dome, sun

    def _under_cloud(self, weather: Weather) -> float:
        """Luminous irradiance on the ground under closed clouds, scene units."""
        depth, sun = cloud_depth(weather), self._clear_sun
        light = float(dome_irradiance(self._clear) @ LUMINANCE) * passed_diffuse(depth)
        if sun is not None and sun.direction[2] > 0.0:
            sine = float(sun.direction[2])
            light += float(sun.irradiance @ LUMINANCE) * sine * passed(depth, sine)
        return light * echo(depth, weather)


@dataclass(frozen=True, slots=True, eq=False)
class _Fogged:
    """Dome and sun under fog, and the light of the fog itself."""

    dome: Image
    sun: Sun | None
    veil: Veil

    @classmethod
    def of(cls, dome: Image, sun: Sun | None, depth: float, weather: Weather) -> _Fogged:
        """Lay fog of an optical depth under a dome and a sun."""
        towards = _AFLOAT if sun is None else sun.direction
        sine = max(float(towards[2]), 0.0)
        beam = np.zeros(3) if sun is None else sun.irradiance * straight(depth, sine)
        high, around = angles((len(dome), dome.shape[1]), share=0.5)
        hides = -np.expm1(-max(depth, _THINNEST) / np.sin(high))
        shape = _phases(towards, high, around)
        # What passes the layer, without what comes straight through it, is the fog's own light.
        light = dome_irradiance(dome) * passed_diffuse(depth)
        if sun is not None:
            light = light + sun.irradiance * sine * passed(depth, sine)
        shown = dome * np.exp(-depth / np.sin(high)).astype(np.float32)[:, None, None]
        own = light * echo(depth, weather) - beam * sine - dome_irradiance(shown)
        once = float(dome_irradiance((shape * hides[:, None])[..., None])[0])
        even = float(dome_irradiance(hides[:, None, None])[0])
        diffuse = np.maximum(own - beam * once, _LEAST * np.maximum(own, 0.0)) / even
        # The layer shows no more of its light than it hides of what lies behind.
        glow = diffuse.astype(np.float32) + shape[..., None] * beam.astype(np.float32)
        veiled = -np.expm1(-depth / np.sin(high)).astype(np.float32)
        fogged = shown + glow * veiled[:, None, None]
        dimmed = None if sun is None else replace(sun, irradiance=beam)
        return cls(np.asarray(fogged, np.float32), dimmed, Veil(diffuse, beam, towards))

    def within(self, glow: Floats, depth: float) -> _Fogged:
        """Add the light of a city's lamps that fog scatters more than once, (3,)."""
        if not glow.any():
            return self
        high, _ = angles((len(self.dome), 1), share=0.5)
        hides = -np.expm1(-depth / np.sin(high))
        dome = self.dome + (hides[:, None, None] * glow).astype(np.float32)
        return _Fogged(dome, self.sun, replace(self.veil, diffuse=self.veil.diffuse + glow))


def _phases(towards: Floats, high: Floats, around: Floats) -> Image:
    """How droplets scatter towards the ground from each texel of a dome, (h, w) [1/sr]."""
    flat = np.hypot(towards[0], towards[1])
    azimuth = np.arctan2(towards[0], towards[1])
    cosine = np.outer(np.cos(high) * flat, np.cos(around - azimuth)).astype(np.float32)
    cosine += (np.sin(high) * towards[2]).astype(np.float32)[:, None]
    g = np.float32(ASYMMETRY)
    below = 1 + g * g - 2 * g * cosine
    return np.asarray((1 - g * g) / np.float32(4 * np.pi) / (below * np.sqrt(below)))


def _mixed(fog: Veil, rest: Veil, share: float) -> Veil:
    """Light of air in which fog takes a share of what is taken."""
    diffuse = fog.diffuse * share + rest.diffuse * (1.0 - share)
    return Veil(diffuse, fog.direct * share, fog.towards)


def _dome_of(sky: SkyMap) -> Image:
    """Upper half of a baked sky."""
    return sky.radiance[: len(sky.radiance) // 2]
