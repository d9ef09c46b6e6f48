"""The sky in weather, and sky and sun as Mitsuba's objects.

The sky is closed by clouds, and seen through fog, as it reaches the ground. Clouds that rain and
snow fall from are laid over the clear sky and scaled to the light that such clouds let through. Fog
dims the sun along its slant way, hides the sky behind it, and shines by itself: with sunlight that
droplets scatter once, and with an even light that makes up the rest of what passes the layer. Over
a city by night its lamps light the fog, too, more than what they scatter once towards the eye: by
design, in proportion to the city's glow in clear air. The same light is that of the air between
things (`render/kernel/air.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.model.weather import (
    ASYMMETRY,
    Weather,
    WeatherCourse,
    cloud_depth,
    cover,
    echo,
    passed,
    passed_diffuse,
    straight,
)
from sumo3dviz_pt.render.kernels import aligned, load
from sumo3dviz_pt.render.sky.baked import (
    SkyMap,
    Sun,
    bake_sky,
    cached_sky,
    horizon_of,
    map_size,
    sky_of_dome,
)
from sumo3dviz_pt.render.sky.daylight import SUN_RADIUS, angles, dome_irradiance

_COARSE = (128, 256)
_THINNEST = 1e-3  # optical depth below which fog shines as at that depth
_LEAST = 0.05  # least share of the light from fog that is even
_CITY = 2.5  # light of a city on fog in its streets, against its glow at the horizon in clear air
_PALER = 0.75  # share of that light that has no colour: lamps are nearer than what glows far away
_AFLOAT = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class AirVeil:
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
        self.dry = cached_sky(sky, size)
        self._rows = size[0] // 2
        # A city's lamps shine from below: rain clouds show their light, and do not take it away.
        unlit = replace(sky, glow=(0.0, 0.0, 0.0))
        self._closed: Image | None = None
        self._from_below: Image | None = None
        if sky.overcast is not None:
            self._closed = _dome_of(cached_sky(replace(unlit, clouds=sky.overcast), size))
            if max(sky.glow) > 0.0:
                lit = _dome_of(cached_sky(replace(sky, clouds=sky.overcast), size))
                self._from_below = np.maximum(lit - self._closed, np.float32(0.0))
        # What weather acts on is the light of a clear sky, whatever clouds stand on it.
        clear = bake_sky(replace(unlit, clouds=None), _COARSE if sky.image is None else size)
        self._clear, self._clear_sun = _dome_of(clear), clear.sun
        glow = np.asarray(sky.glow, dtype=np.float64)
        self._glow = _CITY * (_PALER * (glow @ LUMINANCE) + (1.0 - _PALER) * glow)
        self._last: tuple[Weather, SkyMap, AirVeil] | None = None
        self._sunny = any(cover(moment) < 1.0 for moment in course.moments)

    def at(self, weather: Weather) -> tuple[SkyMap, AirVeil]:
        """Return the sky of a moment and the light of its air.

        The sun is None where clouds hide it in all moments of the course; else it may be dark.
        """
        if self._last is None or self._last[0] != weather:
            self._last = (weather, *self._made(weather))
        return self._last[1:]

    def _made(self, weather: Weather) -> tuple[SkyMap, AirVeil]:
        """Make the sky of a moment."""
        dome, sun = self._light(weather)
        horizon = horizon_of(dome)
        veil = AirVeil(np.asarray(horizon.mean(axis=0, dtype=np.float64)), np.zeros(3), _AFLOAT)
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
        light = float(dome_irradiance(self._closed) @ LUMINANCE)
        share = np.float32(hidden * wanted / max(light, 1e-30))
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
    veil: AirVeil

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
        return cls(np.asarray(fogged, np.float32), dimmed, AirVeil(diffuse, beam, towards))

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


def _mixed(fog: AirVeil, rest: AirVeil, share: float) -> AirVeil:
    """Light of air in which fog takes a share of what is taken."""
    diffuse = fog.diffuse * share + rest.diffuse * (1.0 - share)
    return AirVeil(diffuse, fog.direct * share, fog.towards)


def _dome_of(sky: SkyMap) -> Image:
    """Upper half of a baked sky."""
    return sky.radiance[: len(sky.radiance) // 2]


SUN_DISTANCE = 1e6
"""Distance of the sun's disc [m]; its direction changes by 0.06 degrees over a kilometre."""

_NIGHT_LUX, _MOST_SKY = 0.6, 30.0
"""Illuminance for which the sky's weight is 1 [lx], and its highest weight."""

_ARC = 49  # corners of a sun cut by the horizon

# The moon's maria, by eye: east, north, half width, half height [radii of the disc], depth.
_MARIA = (
    (-0.30, 0.50, 0.30, 0.24, 0.42),  # Imbrium
    (-0.62, 0.18, 0.22, 0.42, 0.36),  # Procellarum
    (0.24, 0.44, 0.19, 0.17, 0.44),  # Serenitatis
    (0.42, 0.12, 0.24, 0.19, 0.46),  # Tranquillitatis
    (0.70, 0.26, 0.10, 0.13, 0.48),  # Crisium
    (0.66, -0.10, 0.14, 0.20, 0.38),  # Fecunditatis
    (-0.22, -0.28, 0.26, 0.16, 0.34),  # Nubium
    (-0.52, -0.36, 0.12, 0.12, 0.40),  # Humorum
)


def sky_weight(sky: SkyMap, *, lamps: bool) -> float:
    """Return how often light paths aim at the sky (and at the sun), against 1 for a lamp set.

    Args:
        sky: What shines.
        lamps: Whether paths aim at lamps, too. The weight then follows the sky's light; 1 was
            measured to be best over a city at night.
    """
    return float(np.clip(sky.illuminance / _NIGHT_LUX, 1.0, _MOST_SKY)) if lamps else 1.0


def sky_entry(sky: SkyMap, weight: float = 1.0) -> Any:
    """Return the baked sky as an environment map; its columns already run clockwise from north.

    Mitsuba would copy a bitmap three times. So variants that compile get a tiny one, which the
    real map then replaces with one copy.
    """
    placed = {
        "type": "envmap",
        "sampling_weight": weight,
        # Mitsuba's maps are y-up and put their first column at -z.
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
    }
    if "scalar" in mi.variant():
        return load({**placed, "bitmap": mi.Bitmap(np.ascontiguousarray(sky.radiance))})
    entry = load({**placed, "bitmap": mi.Bitmap(np.zeros((2, 4, 3), np.float32))})
    parameters = mi.traverse(entry)
    parameters["data"] = mi.TensorXf(sky.closed)
    parameters.update()
    return entry


def update_sky(parameters: Any, entries: Mapping[str, Any]) -> None:
    """Let a loaded scene's sky and sun shine as others do that were made for it.

    Args:
        parameters: Of the scene; they still have to be updated.
        entries: From `sky_entry` and `sun_entry`.
    """
    for name, entry in entries.items():
        made = mi.traverse(entry)
        for key in ("data", "emitter.radiance.value", "emitter.radiance.data"):
            if key in made and f"{name}.{key}" in parameters:
                parameters[f"{name}.{key}"] = made[key]


def sun_entry(sky: SkyMap, weight: float = 1.0) -> dict[str, Any]:
    """Make the sun or moon as a disc, so distant that its direction is the same everywhere.

    At the horizon only what stands above it is there: from a high eye the rest would
    shine between the end of the ground and the horizon.
    """
    if sky.sun is None:
        return {}
    whole = sky.sun.risen >= 1.0
    return {"sun": _disc(sky.sun, weight) if whole else _segment(sky.sun, weight)}


def _facing(direction: Floats) -> Any:
    """Return the transform of a unit disc that faces +z to the sun's place, facing us, +y up."""
    place = direction * SUN_DISTANCE
    up = [0.0, 0.0, 1.0] if abs(direction[2]) < 0.9 else [0.0, 1.0, 0.0]
    towards_us = mi.ScalarTransform4f().look_at(
        origin=place.tolist(), target=[0.0, 0.0, 0.0], up=up
    )
    return towards_us @ mi.ScalarTransform4f().scale(float(SUN_DISTANCE * np.tan(SUN_RADIUS)))


def _disc(sun: Sun, weight: float) -> Any:
    """Make the whole disc; the moon's shows its dark plains."""
    radiance: dict[str, Any] = {"type": "rgb", "value": sun.radiance.tolist()}
    if sun.moon:
        face = (_moon_face()[..., None] * sun.radiance).astype(np.float32)
        radiance = {"type": "bitmap", "bitmap": mi.Bitmap(face), "raw": True}
    emitter = {"type": "area", "radiance": radiance, "sampling_weight": weight}
    return load({"type": "disk", "to_world": _facing(sun.direction), "emitter": emitter})


def _moon_face(rings: int = 24, around: int = 96) -> Floats:
    """Return the full moon's brightness by radius and angle, a disk's uv; 1 on average.

    Maria are dark ovals where they lie for northern eyes; there is no darkening to the limb.
    """
    radius, angle = (np.arange(rings) + 0.5) / rings, (np.arange(around) + 0.5) / around
    angle = angle[:, None] * 2 * np.pi
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    dark = np.zeros_like(x)
    for east, north, wide, high, depth in _MARIA:
        oval = ((x - east) / wide) ** 2 + ((y - north) / high) ** 2
        dark = np.maximum(dark, depth / (1.0 + np.exp(np.minimum(5.0 * (oval - 1.0), 50.0))))
    face = 1.0 - dark
    return np.asarray(face / ((face * radius).sum() / (np.ones_like(x) * radius).sum()))


def _segment(sun: Sun, weight: float) -> Any:
    """Make the part of the disc above the horizon, as a mesh."""
    height = float(np.arcsin(sun.direction[2]) / SUN_RADIUS)
    half = float(np.arccos(np.clip(height, -1.0, 1.0)))  # of the arc below the horizon
    turn = np.linspace(half, 2 * np.pi - half, _ARC) - np.pi / 2
    rim = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(_ARC)])
    matrix = np.array(_facing(sun.direction).matrix, dtype=np.float64)
    vertices = rim @ matrix[:3, :3].T + matrix[:3, 3]
    fan = np.arange(1, _ARC - 1)
    faces = np.column_stack([np.zeros_like(fan), fan, fan + 1])
    properties = mi.Properties()
    radiance = {"type": "rgb", "value": sun.radiance.tolist()}
    emitter = {"type": "area", "radiance": radiance, "sampling_weight": weight}
    properties["emitter"] = load(emitter)
    mesh = mi.Mesh("sun", _ARC, len(faces), props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = aligned(vertices, np.float32)
    parameters["faces"] = aligned(faces, np.uint32)
    parameters.update()
    return mesh
