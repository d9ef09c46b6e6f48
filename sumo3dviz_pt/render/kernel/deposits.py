"""What weather leaves on surfaces: water, puddles and snow; only scenes that have it compile it.

A material is changed where rain and snow reach it: under the sky, and from above. Water darkens
what is porous and smooths it; it fills low places of paved ground and is a mirror there. Snow is a
bright, matt layer without thickness; its relief is one of normals. On roads, traffic and salt say
where it lies and how dirty it is.

Noise and the rings that drops make on water depend on place and time alone. The place repeats after
`REPEAT` metres, so that far from the network's origin nothing is lost to single precision.

References:
    Lagarde, "Water drop 3b: physically based wet surfaces", 2013: `wetted`. Reflectance of snow
    at visible wavelengths: Warren, Reviews of Geophysics 20, 1982: .8 to .97 when fresh. Index of
    refraction of water, 1.333: Hale and Querry, Applied Optics 12, 1973.
    Hash: see `render/textures.py`. Quintic blending: Perlin, "Improving Noise", 2002.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.render.kernel.grounds import Grounds, SkyExposure, Spot, number, soft
from sumo3dviz_pt.render.kernel.lobes import Finish
from sumo3dviz_pt.render.kernel.rows import MaterialKind
from sumo3dviz_pt.render.textures import hashed, mixed, unit

REPEAT = 1024
"""After so many metres noise repeats; a power of two."""

_RINGS = 2  # layers of cells in which drops fall
_CELL = 0.25  # side of a cell of rings [m]
_LIFE = 0.6  # of a ring [s]
_WAVE = 0.035  # length of a ring's wave [m]
_STEEP = 0.35  # slope of a new ring


class Bumps(NamedTuple):
    """Noise at a place.

    Attributes:
        value: In [-1, 1].
        dx: Slope towards the east [1/m].
        dy: Slope towards the north [1/m].
    """

    value: Any
    dx: Any
    dy: Any


def bumps(x: Any, y: Any, *, cells: int, per: int, salt: int) -> Bumps:
    """Return smooth noise.

    Args:
        x: East [m].
        y: North [m].
        cells: Cells of the noise in `per` metres; a power of two.
        per: [m]; a power of two.
        salt: Another noise for each.
    """
    scale = cells / per
    a, b = x * scale, y * scale
    column, row = dr.floor(a), dr.floor(b)
    u, v = a - column, b - row
    i, j = mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row))
    mask = REPEAT * cells // per - 1
    corners = [_height(i + k, j + m, mask, salt) for m in (0, 1) for k in (0, 1)]
    blend = [w * w * w * (w * (6.0 * w - 15.0) + 10.0) for w in (u, v)]
    steep = [30.0 * w * w * (w * (w - 2.0) + 1.0) for w in (u, v)]
    east, north = corners[1] - corners[0], corners[2] - corners[0]
    both = corners[3] - corners[2] - east
    value = corners[0] + blend[0] * east + blend[1] * (north + blend[0] * both)
    dx = steep[0] * (east + blend[1] * both) * scale
    dy = steep[1] * (north + blend[0] * both) * scale
    return Bumps(value, dx, dy)


def _height(i: Any, j: Any, mask: int, salt: int) -> Any:
    """Return the noise at a corner of the lattice, in [-1, 1]."""
    return 2.0 * unit(mixed(hashed(i, j, mask) + salt)) - 1.0


def rings(x: Any, y: Any, *, time: Any, rate: Any) -> tuple[Any, Any]:
    """Return the slope of water that rain falls on, towards the east and the north.

    Every cell of a lattice has one drop at a time; which of them fall follows the rate. Rings
    stay within their cells, so that each place asks two cells only.

    Args:
        x: East [m].
        y: North [m].
        time: [s].
        rate: [mm/h].
    """
    dx, dy = mi.Float(0.0), mi.Float(0.0)
    full = 1.0 - dr.exp(-0.12 * rate)
    mask = int(REPEAT / _CELL) - 1
    for layer in range(_RINGS):
        a, b = x / _CELL + 0.5 * layer, y / _CELL + 0.5 * layer
        column, row = dr.floor(a), dr.floor(b)
        cell = hashed(mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row)), mask)
        turn = time / _LIFE + unit(mixed(cell + 11 * layer + 1))
        number = dr.floor(turn)
        age = turn - number
        bits = mixed(cell ^ mixed(mi.UInt32(mi.Int32(number)) + 31 * layer))
        there = unit(bits) < full
        again = mixed(bits + 1)
        place = mi.Vector2f(unit(again << 16), unit(again & 0xFFFF0000)) * 0.4 + 0.3
        out = (mi.Vector2f(a - column, b - row) - place) * _CELL
        away = dr.norm(out)
        front = age * 0.3 * _CELL
        off = (away - front) * (1.0 / _WAVE)
        # Three waves around the front, lower as the ring grows.
        shape = dr.sin(6.2831853 * off) * dr.exp(-2.0 * off * off)
        slope = dr.select(there, _STEEP * dr.square(1.0 - age) * shape, 0.0)
        toward = slope * dr.rcp(dr.maximum(away, 1e-4))
        dx += toward * out.x
        dy += toward * out.y
    return dx, dy


ALBEDO = (0.84, 0.85, 0.86)
"""Reflectance of clean snow."""

_SLUSH = (0.30, 0.287, 0.27)  # reflectance of snow that traffic has ground
_SALT = (0.25, 0.248, 0.242)  # of a road that was salted, where the film has dried
_HIDDEN = 0.025  # depth at which snow hides what it lies on [m]
_STEEPEST = 0.45  # vertical part of the normals of surfaces from which it slides
_FINE = 0.02  # relief is seen while a pixel is smaller than this [m]
_GRIT = 0.35  # roughness of slush, which is wet


@dataclass(frozen=True, slots=True, eq=False)
class Lying:
    """The snow at a place, as arrays of Dr.Jit.

    Attributes:
        cover: How much of what is below it hides, in [0, 1].
        slush: How much of it is slush, in [0, 1].
        wet: Wetness of what is not covered.
        grey: Share of salt's grey on what is not covered, in [0, 1].
        slopes: Of its relief, towards the east and the north.
    """

    cover: Any
    slush: Any
    wet: Any
    grey: Any
    slopes: tuple[Any, Any]


@dataclass(frozen=True, slots=True, eq=False)
class _Uneven:
    """Noise of three sizes."""

    broad: Bumps
    small: Bumps
    fine: Bumps

    @property
    def mixed(self) -> Any:
        """All of it, in about [-1, 1]."""
        return 0.5 * self.broad.value + 0.35 * self.small.value + 0.2 * self.fine.value


def lying(spot: Spot, reach: SkyExposure, roads: str, depth: Any) -> Lying:
    """Return the snow that lies at a place.

    Args:
        spot: The place.
        reach: How far snow reaches it.
        roads: `cleared`, `tracked` or `covered`.
        depth: Of the snow [m].
    """
    # Patterns move with what moves.
    at = dr.select(spot.rigid, spot.own, reach.place)
    noise = _Uneven(
        bumps(at.x, at.y, cells=1, per=4, salt=31),
        bumps(at.x, at.y, cells=2, per=1, salt=32),
        bumps(at.x, at.y, cells=8, per=1, salt=33),
    )
    cover = _held(spot, reach, noise.mixed, depth)
    snow = Lying(cover, mi.Float(0.0), mi.Float(0.0), mi.Float(0.0), ())  # type: ignore[arg-type]
    snow = _on_roads(snow, reach, noise, reach.paved(spot, MaterialKind.ROAD), roads)
    if roads != "covered":
        snow = _trodden(snow, reach, noise, reach.paved(spot, MaterialKind.SLABS))
    return replace(snow, slopes=_relief(snow.cover, spot, reach, noise, depth))


def _held(spot: Spot, reach: SkyExposure, uneven: Any, depth: Any) -> Any:
    """Return how much of a place snow covers where nobody passes."""
    full = depth * (1.0 / _HIDDEN)
    # It holds on what is level enough, and thin snow lies in patches.
    holds = soft((reach.up + 0.12 * uneven - _STEEPEST) * (1.0 / 0.3))
    # Blades that are shorter than the snow is deep are below it.
    buried = reach.leaf & (reach.above > 0.0) & (reach.above < depth * (1.0 + 0.5 * uneven))
    holds = dr.select(reach.leaf, dr.maximum(0.75 * holds, dr.select(buried, 1.0, 0.0)), holds)
    cover = holds * soft(0.5 + 1.6 * (full - 0.55) + 0.8 * uneven) * soft(1.35 * reach.open - 0.2)
    # Wind and warmth leave little on bodies that drive: some on what is level and high.
    rest = 0.9 * soft((reach.up - 0.93) * 16.0) * soft(4.0 * (spot.own.z - 1.2)) * reach.open
    rest *= soft(1.3 * uneven + 0.1 * dr.minimum(full, 1.0) - 0.08)
    return dr.select(spot.moves & ~spot.parked, dr.select(spot.rigid, rest, 0.0), cover)


def _on_roads(snow: Lying, reach: SkyExposure, noise: _Uneven, road: Any, roads: str) -> Lying:
    """Return the snow as ploughs, salt and wheels left it on roads."""
    broad, small, fine = noise.broad.value, noise.small.value, noise.fine.value
    gone, dirty = reach.tracks[:2] if reach.tracks is not None else (mi.Float(0.0), mi.Float(0.0))
    cover, wet, grey = snow.cover, mi.Float(0.0), mi.Float(0.0)
    if roads == "cleared":
        # Ploughs leave a ragged, dirty rim at kerbs, and salt the rest.
        rim = soft((0.8 * reach.low + 0.4 * noise.mixed - 0.36) * (1.0 / 0.3))
        cover = cover * rim * 0.95
        slush = dr.clip(0.55 - 0.5 * rim + 0.4 * noise.mixed, 0.15, 0.9)
        wet, grey = 0.62 + 0.25 * broad, dr.clip(0.42 + 0.5 * broad, 0.1, 0.8)
    elif roads == "tracked":
        # Wheels leave slush, in the end wet asphalt, and throw dirt over all of the lane.
        loose = 0.4 * small + 0.35 * fine + 0.3 * broad
        bare = 0.88 * soft((gone * (1.0 + 0.55 * loose) - 0.3) * (1.0 / 0.65))
        cover = cover * (1.0 - bare)
        slush = dr.clip(0.62 * dirty + 0.45 * gone + 0.3 * loose * (dirty + 0.15), 0.0, 0.95)
        wet, grey = mi.Float(0.85), dr.clip(0.35 + 0.4 * small, 0.0, 0.6)
    else:
        slush = dr.clip(0.3 * gone + 0.16 * dirty + 0.05 * small, 0.0, 0.5)
    return replace(
        snow,
        cover=dr.select(road, cover, snow.cover),
        slush=dr.select(road, slush, snow.slush),
        wet=dr.select(road, wet, snow.wet),
        grey=dr.select(road, grey, snow.grey),
    )


def _trodden(snow: Lying, reach: SkyExposure, noise: _Uneven, slabs: Any) -> Lying:
    """Return the snow as people left it on sidewalks."""
    left = soft((0.62 - 0.55 * noise.broad.value - 0.2 * noise.small.value + 0.3 * reach.low) * 1.3)
    slush = dr.clip(0.3 - 0.35 * noise.mixed, 0.0, 0.7)
    return replace(
        snow,
        cover=dr.select(slabs, snow.cover * (0.25 + 0.75 * left), snow.cover),
        slush=dr.select(slabs, slush, snow.slush),
        wet=dr.select(slabs, 0.7, snow.wet),
    )


def _relief(
    cover: Any, spot: Spot, reach: SkyExposure, noise: _Uneven, depth: Any
) -> tuple[Any, Any]:
    """Return the slopes of the snow: those of its unevenness, and of what wheels took away."""
    near = dr.clip(2.0 - spot.away * reach.pixel * (1.0 / _FINE), 0.0, 1.0)
    tall = dr.minimum(depth * 20.0, 1.0) * cover
    slopes = [
        tall * (0.14 * broad + near * (0.035 * small + 0.008 * fine))
        for broad, small, fine in (
            (noise.broad.dx, noise.small.dx, noise.fine.dx),
            (noise.broad.dy, noise.small.dy, noise.fine.dy),
        )
    ]
    if reach.tracks is not None:
        deep = dr.minimum(depth, 0.06) * dr.select(reach.paved(spot, MaterialKind.ROAD), cover, 0.0)
        slopes = [slope - deep * of for slope, of in zip(slopes, reach.tracks[2:], strict=True)]
    return slopes[0], slopes[1]


def snowed(finish: Finish, normal: Any, snow: Lying) -> tuple[Finish, Any]:
    """Return a material with snow on it, and its unit normal.

    Args:
        finish: Of what lies below.
        normal: Of what lies below, unit.
        snow: What lies on it.
    """
    cover = snow.cover
    bare = 1.0 - cover
    colour = dr.lerp(mi.Color3f(*ALBEDO), mi.Color3f(*_SLUSH), snow.slush)
    below = dr.lerp(finish.colour, mi.Color3f(*_SALT), snow.grey)
    dressed = replace(
        finish,
        colour=dr.lerp(below, colour, cover),
        roughness=dr.lerp(finish.roughness, dr.lerp(mi.Float(1.0), _GRIT, snow.slush), cover),
        metallic=finish.metallic * bare,
        coat=finish.coat * bare,
        through=finish.through * bare,
        glossy=finish.glossy * dr.maximum(bare, 0.6 * snow.slush),
        matt=finish.matt | ((cover > 0.5) & (snow.slush < 0.5)),
    )
    side = dr.select(normal.z < 0.0, mi.Float(-1.0), 1.0)
    rounded = normal * side + mi.Vector3f(0.0, 0.0, 0.7 * cover)
    tilted = rounded + mi.Vector3f(-snow.slopes[0], -snow.slopes[1], 0.0)
    return dressed, side * dr.normalize(tilted)


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
        covered, normal, snow = finish, spot.normal, None
        if self.snowy:
            snow = lying(spot, reach, self._roads, self._depth)
        if self._wet:
            covered, normal = self._wetted(covered, spot, reach, snow)
        if snow is not None:
            covered, normal = snowed(covered, normal, snow)
        # A normal that faces away from the eye would be black.
        faces = dr.dot(normal, spot.wi) * dr.sign(dr.dot(spot.normal, spot.wi)) > 0.02
        return covered, dr.select(faces, normal, spot.normal)

    def _exposure(self, spot: Spot) -> SkyExposure:
        """Return how far rain and snow reach a place."""
        leaf = spot.has(MaterialKind.LEAF)
        # Walls are asked a little before them, so that their own eaves count.
        before = dr.select(leaf, 0.0, 0.35) * spot.normal
        under, above = self._grounds.openness(spot.p + before, spot.active)
        place = spot.p + self._shift
        return SkyExposure(
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
        return dr.select(spot.has(MaterialKind.ROAD), self._grounds.sunk(spot.p, spot.active), 0.0)

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
        self, finish: Finish, spot: Spot, reach: SkyExposure, snow: Lying | None
    ) -> tuple[Finish, Any]:
        """Return a wet material, and its normal where water lies on it."""
        level = spot.has(MaterialKind.PAVED) & (reach.up > 0.95) & ~spot.moves
        broad = bumps(reach.place.x, reach.place.y, cells=1, per=2, salt=3).value
        damp = self._damp(spot, reach, broad, snow)
        rough = finish.roughness
        porous = porosity(rough) * (1.0 - finish.metallic)
        porous = dr.select(spot.has(MaterialKind.UNTILED), dr.maximum(porous, POROUS), porous)
        colour, smoother = wetted(finish.colour, rough, porous, damp)
        # Between blades of grass and crumbs of soil water runs off, and no film of it stays.
        soft = spot.has(MaterialKind.UNTILED) & ~spot.has(MaterialKind.PAVED) & (reach.up > _LYING)
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

    def _damp(self, spot: Spot, reach: SkyExposure, broad: Any, snow: Lying | None) -> Any:
        """Return how wet a place is: drying surfaces dry in patches, low ones last."""
        wetness = self._wetness
        if snow is not None:
            wetness = dr.maximum(wetness, snow.wet)
        rest = wetness * (1.0 - wetness)
        damp = dr.clip(wetness + 2.2 * rest * (0.7 * broad + 0.5 * reach.low), 0.0, 1.0)
        facing = dr.clip(0.45 + 1.1 * reach.up, 0.0, 1.0)
        return dr.select(spot.moves, wetness, damp) * facing * reach.open

    def _flood(self, reach: SkyExposure, broad: Any) -> Any:
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
