"""What weather leaves on surfaces: water, puddles and snow; only scenes that have it compile it.

A material is changed where rain and snow reach it: under the sky, and from above. Water darkens
what is porous and smooths it, fills low places of paved ground and is a mirror there. Snow is a
bright, matt layer without thickness; its relief is one of normals.

References:
    Lagarde, "Water drop 3b: physically based wet surfaces", 2013: `wetted`. Reflectance of snow
    at visible wavelengths: Warren, Reviews of Geophysics 20, 1982: .8 to .97 when fresh. Index of
    refraction of water, 1.333: Hale and Querry, Applied Optics 12, 1973.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.render.kernel.exposure import Exposure, Spot, number, soft
from sumo3dviz_pt.render.kernel.grounds import Grounds
from sumo3dviz_pt.render.kernel.lobes import Finish
from sumo3dviz_pt.render.kernel.ripples import REPEAT, bumps, rings
from sumo3dviz_pt.render.kernel.rows import Kind
from sumo3dviz_pt.render.kernel.snow import Lying, lying, snowed

WATER = 1.333
"""Index of refraction of water."""

SMOOTH = 0.045
"""Roughness of water; smoother, single paths would catch the sun."""

POROUS = 0.75
"""Porosity of paved ground and soil, whose roughness as it looks says too little."""

_DARKEST = 0.2  # what is left of the light that the most porous things reflect when dry
_FILM = 0.55  # what a film of water leaves of the roughness of paved ground
_RIPPLED = 0.11  # roughness of water by rings that are too small to be seen
_LYING = 0.7  # cosine against the vertical of what is ground and no wall
_RUT = 0.3  # how much sooner ruts are flooded
_SEEN = 0.02  # rings are seen while a pixel is smaller than this [m]


def porosity(roughness: Any) -> Any:
    """Return how porous a surface is, in [0, 1], by Lagarde: rough things are."""
    return dr.clip((roughness - 0.5) / 0.4, 0.0, 1.0)


def wetted(colour: Any, roughness: Any, porous: Any, wet: Any) -> tuple[Any, Any]:
    """Return the reflectance and roughness of a wet surface, by Lagarde.

    Args:
        colour: Reflectance when it is dry.
        roughness: When it is dry; his gloss is 1 less it.
        porous: Porosity, in [0, 1]; of metals 0.
        wet: [0, 1].
    """
    factor = dr.lerp(mi.Float(1.0), _DARKEST, porous)
    gloss = dr.lerp(mi.Float(1.0), 1.0 - roughness, dr.lerp(mi.Float(1.0), factor, 0.5 * wet))
    return colour * dr.lerp(mi.Float(1.0), factor, wet), 1.0 - gloss


class Deposits:
    """What lies on the surfaces of a scene.

    Args:
        course: The weather over time.
        grounds: Maps of the ground.
        pixel: Angle of a pixel [rad].
    """

    def __init__(self, course: WeatherCourse, grounds: Grounds, pixel: float) -> None:
        self._wet = course.is_wet or course.is_snowy
        self._flooded = any(moment.puddles > 0.0 for moment in course.moments)
        self._rains, self.snowy = course.rains, course.is_snowy
        self._roads = course.first.snow.roads if course.first.snow is not None else ""
        self._grounds, self._pixel = grounds, dr.opaque(mi.Float, pixel)

    def follow(self, weather: Weather, time: float, origin: Floats) -> None:
        """Take on the weather of a frame.

        Args:
            weather: Of its moment.
            time: SUMO's [s].
            origin: The renderer's in the network's coordinates, (3,) [m].
        """
        self._grounds.follow(origin)
        snow, rain = weather.snow, weather.rain
        self._wetness = number(weather.wetness)
        self._puddles = number(weather.puddles)
        self._rate = number(rain.rate if rain is not None else 0.0)
        self._depth = number(snow.depth if snow is not None else 0.0)
        # Rings live half a second, so whole hours may be dropped.
        self._time = number(time % 3600.0)
        shift = np.mod(origin, REPEAT)
        self._shift = mi.Vector3f(*(number(value) for value in shift))

    def covered(self, finish: Finish, spot: Spot) -> tuple[Finish, Any]:
        """Return a material with what lies on it, and its unit normal.

        Args:
            finish: When it is dry and bare.
            spot: Where.
        """
        reach = self._exposure(spot)
        found, normal, snow = finish, spot.normal, None
        if self.snowy:
            snow = lying(spot, reach, self._roads, self._depth)
        if self._wet:
            found, normal = self._wetted(found, spot, reach, snow)
        if snow is not None:
            found, normal = snowed(found, normal, snow)
        # A normal that faces away from the eye would be black.
        faces = dr.dot(normal, spot.wi) * dr.sign(dr.dot(spot.normal, spot.wi)) > 0.02
        return found, dr.select(faces, normal, spot.normal)

    def _exposure(self, spot: Spot) -> Exposure:
        """Return how far rain and snow reach a place."""
        leaf = spot.has(Kind.LEAF)
        # Walls are asked a little before them, so that their own eaves count.
        before = dr.select(leaf, 0.0, 0.35) * spot.normal
        under, above = self._grounds.openness(spot.p + before, spot.active)
        place = spot.p + self._shift
        return Exposure(
            place=place,
            open=dr.select(spot.inside, 0.0, under),
            up=dr.select(leaf, dr.abs(spot.normal.z), spot.normal.z),
            low=self._grounds.low(spot.p, spot.active),
            rut=self._rut(spot),
            above=above,
            leaf=leaf,
            pixel=self._pixel,
            tracks=self._tracks(spot, place) if self._grounds.tracked else None,
        )

    def _rut(self, spot: Spot) -> Any:
        """Return how deep in a rut a place lies; only puddles ask."""
        if not (self._flooded and self._grounds.rutted):
            return mi.Float(0.0)
        return dr.select(spot.has(Kind.ROAD), self._grounds.sunk(spot.p, spot.active), 0.0)

    def _tracks(self, spot: Spot, place: Any) -> tuple[Any, Any, Any, Any]:
        """Return the tracks at a place: drivers meander, and edges are ragged."""
        bend = bumps(place.x, place.y, cells=1, per=8, salt=21)
        aside = bumps(place.y, place.x, cells=1, per=8, salt=23)
        edge = bumps(place.x, place.y, cells=4, per=1, salt=22)
        return self._grounds.tracks(
            spot.p.x + 0.32 * bend.value + 0.06 * edge.value,
            spot.p.y + 0.32 * aside.value - 0.06 * edge.value,
            spot.active,
        )

    def _wetted(
        self, finish: Finish, spot: Spot, reach: Exposure, snow: Lying | None
    ) -> tuple[Finish, Any]:
        """Return a wet material, and its normal where water lies on it."""
        level = spot.has(Kind.PAVED) & (reach.up > 0.95) & ~spot.moves
        broad = bumps(reach.place.x, reach.place.y, cells=1, per=2, salt=3).value
        damp = self._damp(spot, reach, broad, snow)
        rough = finish.roughness
        porous = porosity(rough) * (1.0 - finish.metallic)
        porous = dr.select(spot.has(Kind.UNTILED), dr.maximum(porous, POROUS), porous)
        colour, smoother = wetted(finish.colour, rough, porous, damp)
        # Between blades of grass and crumbs of soil water runs off, and no film of it stays.
        soft = spot.has(Kind.UNTILED) & ~spot.has(Kind.PAVED) & (reach.up > _LYING)
        rough = dr.select(soft, rough, smoother)
        # Rain leaves a film on paved ground, which has no other way to go.
        film = dr.select(level, dr.clip(2.0 * damp - 1.0, 0.0, 1.0), 0.0)
        rough *= dr.lerp(mi.Float(1.0), _FILM, film)
        if not self._flooded:
            return replace(finish, colour=colour, roughness=rough), spot.normal
        flood = self._flood(reach, broad) * dr.select(level, reach.open, 0.0)
        colour *= dr.lerp(mi.Float(1.0), 0.8, flood)
        smooth, tilt = self._water(spot, reach.place)
        rough = dr.lerp(rough, dr.minimum(smooth, rough), flood)
        still = mi.Vector3f(-tilt[0], -tilt[1], 1.0)
        normal = dr.normalize(dr.lerp(spot.normal, still, flood))
        eta = dr.lerp(finish.eta, WATER, flood)
        return replace(finish, colour=colour, roughness=rough, eta=eta), normal

    def _damp(self, spot: Spot, reach: Exposure, broad: Any, snow: Lying | None) -> Any:
        """Return how wet a place is: drying surfaces dry in patches, low ones last."""
        wetness = self._wetness
        if snow is not None:
            wetness = dr.maximum(wetness, snow.wet)
        rest = wetness * (1.0 - wetness)
        damp = dr.clip(wetness + 2.2 * rest * (0.7 * broad + 0.5 * reach.low), 0.0, 1.0)
        facing = dr.clip(0.45 + 1.1 * reach.up, 0.0, 1.0)
        return dr.select(spot.moves, wetness, damp) * facing * reach.open

    def _flood(self, reach: Exposure, broad: Any) -> Any:
        """Return how much of a place is under water, in [0, 1]."""
        x, y = reach.place.x, reach.place.y
        middle = bumps(x, y, cells=2, per=1, salt=4)
        wide = bumps(y, x, cells=1, per=4, salt=5)
        deep = 0.45 * wide.value + 0.35 * broad + 0.15 * middle.value
        level = deep + 0.8 * dr.clip(reach.low, -0.5, 0.7) - (0.72 - 1.1 * self._puddles)
        # What wheels have worn down fills first.
        level += _RUT * reach.rut
        return dr.clip(20.0 * self._puddles, 0.0, 1.0) * soft(level * (1.0 / 0.16))

    def _water(self, spot: Spot, place: Any) -> tuple[Any, tuple[Any, Any]]:
        """Return the roughness of standing water and its slopes."""
        if not self._rains:
            return mi.Float(SMOOTH), (mi.Float(0.0), mi.Float(0.0))
        near = dr.clip(2.0 - spot.away * self._pixel * (1.0 / _SEEN), 0.0, 1.0)
        dx, dy = rings(place.x, place.y, time=self._time, rate=self._rate)
        busy = 1.0 - dr.exp(-0.12 * self._rate)
        return SMOOTH + _RIPPLED * busy * (1.0 - near), (near * dx, near * dy)
