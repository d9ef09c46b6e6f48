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

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.render.kernel.grounds import Grounds
from sumo3dviz_pt.render.kernel.lobes import Finish
from sumo3dviz_pt.render.kernel.ripples import REPEAT, bumps, rings
from sumo3dviz_pt.render.kernel.rows import Kind
from sumo3dviz_pt.render.kernel.snow import Lying, lying_snow, snowed

WATER = 1.333
"""Index of refraction of water."""

SMOOTH = 0.045
"""Roughness of water; smoother, single paths would catch the sun."""

POROUS = 0.75
"""Porosity of paved ground and soil, whose roughness as it looks says too little."""

_DARKEST = 0.2  # what is left of the light that the most porous things reflect when dry
_FILM = 0.55  # what a film of water leaves of the roughness of paved ground
_RIPPLED = 0.11  # roughness of water by rings that are too small to be seen
_SEEN = 0.02  # rings are seen while a pixel is smaller than this [m]


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """A place on a surface, as arrays of Dr.Jit.

    Attributes:
        p: Relative to the renderer's origin [m].
        own: Where patterns are read that move with the surface [m].
        normal: Unit shading normal.
        wi: Unit direction to where the ray came from, in the world.
        away: Distance along the ray [m].
        kind: What is special about the material.
        moves: Whether the surface moves.
        rigid: Whether it moves without changing its shape.
        active: Which lanes count.
    """

    p: Any
    own: Any
    normal: Any
    wi: Any
    away: Any
    kind: Any
    moves: Any
    rigid: Any
    active: Any


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
        self._wetness = _number(weather.wetness)
        self._puddles = _number(weather.puddles)
        self._rate = _number(rain.rate if rain is not None else 0.0)
        self._depth = _number(snow.depth if snow is not None else 0.0)
        # Rings live half a second, so whole hours may be dropped.
        self._time = _number(time % 3600.0)
        shift = np.mod(origin, REPEAT)
        self._shift = mi.Vector3f(*(_number(value) for value in shift))

    def covered(self, finish: Finish, spot: Spot) -> tuple[Finish, Any]:
        """Return a material with what lies on it, and its unit normal.

        Args:
            finish: When it is dry and bare.
            spot: Where.
        """
        place = spot.p + self._shift
        leaf = (spot.kind & int(Kind.LEAF)) != 0
        # Walls are asked a little before them, so that their own eaves count.
        before = dr.select(leaf, 0.0, 0.35) * spot.normal
        open_, above = self._grounds.openness(spot.p + before, spot.active)
        up = dr.select(leaf, dr.abs(spot.normal.z), spot.normal.z)
        low = self._grounds.low(spot.p, spot.active)
        found, normal = finish, spot.normal
        lying = None
        if self.snowy:
            lying = self._lying(spot, place, open_=open_, up=up, low=low, above=above, leaf=leaf)
        if self._wet:
            found, normal = self._wetted(
                found, spot, place, open_=open_, up=up, low=low, lying=lying
            )
        if lying is not None:
            found, normal = snowed(found, normal, lying)
        # A normal that faces away from the eye would be black.
        faces = dr.dot(normal, spot.wi) * dr.sign(dr.dot(spot.normal, spot.wi)) > 0.02
        return found, dr.select(faces, normal, spot.normal)

    def _wetted(
        self, finish: Finish, spot: Spot, place: Any, *, open_: Any, up: Any, low: Any, lying: Any
    ) -> tuple[Finish, Any]:
        """Return a wet material, and its normal where water lies on it."""
        ground = (spot.kind & int(Kind.PAVED)) != 0
        level = ground & (up > 0.95) & ~spot.moves
        broad = bumps(place.x, place.y, cells=1, per=2, salt=3)
        patchy = 0.7 * broad.value + 0.8 * low
        # Drying surfaces dry in patches, low ones last.
        wetness = self._wetness
        if lying is not None:
            wetness = dr.maximum(wetness, lying.wet)
        rest = wetness * (1.0 - wetness)
        damp = dr.clip(wetness + 2.2 * rest * patchy, 0.0, 1.0)
        facing = dr.clip(0.45 + 1.1 * up, 0.0, 1.0)
        damp = dr.select(spot.moves, wetness, damp) * facing * open_
        rough = finish.roughness
        porous = porosity(rough) * (1.0 - finish.metallic)
        porous = dr.select(_has(spot.kind, Kind.UNTILED), dr.maximum(porous, POROUS), porous)
        colour, rough = wetted(finish.colour, rough, porous, damp)
        # Rain leaves a film on paved ground, which has no other way to go.
        film = dr.select(level, dr.clip(2.0 * damp - 1.0, 0.0, 1.0), 0.0)
        rough *= dr.lerp(mi.Float(1.0), _FILM, film)
        eta, normal = finish.eta, spot.normal
        if self._flooded:
            flood = self._flood(place, broad.value, low) * dr.select(level, open_, 0.0)
            colour *= dr.lerp(mi.Float(1.0), 0.8, flood)
            smooth, tilt = self._water(spot, place)
            rough = dr.lerp(rough, dr.minimum(smooth, rough), flood)
            eta = dr.lerp(eta, WATER, flood)
            still = mi.Vector3f(-tilt[0], -tilt[1], 1.0)
            normal = dr.normalize(dr.lerp(normal, still, flood))
        return replace(finish, colour=colour, roughness=rough, eta=eta), normal

    def _flood(self, place: Any, broad: Any, low: Any) -> Any:
        """Return how much of a place is under water, in [0, 1]."""
        middle = bumps(place.x, place.y, cells=2, per=1, salt=4)
        wide = bumps(place.y, place.x, cells=1, per=4, salt=5)
        deep = 0.45 * wide.value + 0.35 * broad + 0.15 * middle.value
        level = deep + 1.3 * dr.clip(low, -0.4, 0.5) - (0.72 - 1.1 * self._puddles)
        share = dr.clip(level * (1.0 / 0.16), 0.0, 1.0)
        there = dr.clip(20.0 * self._puddles, 0.0, 1.0)
        return there * share * share * (3.0 - 2.0 * share)

    def _water(self, spot: Spot, place: Any) -> tuple[Any, tuple[Any, Any]]:
        """Return the roughness of standing water and its slopes."""
        if not self._rains:
            return mi.Float(SMOOTH), (mi.Float(0.0), mi.Float(0.0))
        near = dr.clip(2.0 - spot.away * self._pixel * (1.0 / _SEEN), 0.0, 1.0)
        dx, dy = rings(place.x, place.y, time=self._time, rate=self._rate)
        busy = 1.0 - dr.exp(-0.12 * self._rate)
        return SMOOTH + _RIPPLED * busy * (1.0 - near), (near * dx, near * dy)

    def _lying(
        self,
        spot: Spot,
        place: Any,
        *,
        open_: Any,
        up: Any,
        low: Any,
        above: Any,
        leaf: Any,
    ) -> Lying:
        """Return the snow that lies at a place."""
        tracks = None
        if self._grounds.tracked:
            # Drivers do not keep to a line: tracks meander, and their edges are ragged.
            bend = bumps(place.x, place.y, cells=1, per=8, salt=21)
            aside = bumps(place.y, place.x, cells=1, per=8, salt=23)
            edge = bumps(place.x, place.y, cells=4, per=1, salt=22)
            tracks = self._grounds.tracks(
                spot.p.x + 0.32 * bend.value + 0.06 * edge.value,
                spot.p.y + 0.32 * aside.value - 0.06 * edge.value,
                spot.active,
            )
        return lying_snow(
            spot,
            place,
            self._roads,
            depth=self._depth,
            open_=open_,
            up=up,
            low=low,
            above=above,
            leaf=leaf,
            tracks=tracks,
            pixel=self._pixel,
        )


def _has(kind: Any, what: Kind) -> Any:
    """Return whether a material is any of some kinds."""
    return (kind & int(what)) != 0


def _number(value: float) -> Any:
    """Return a number that is no part of the kernel's code."""
    return dr.opaque(mi.Float, float(value))
