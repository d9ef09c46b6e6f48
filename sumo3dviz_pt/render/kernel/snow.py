"""Snow that lies: where, how dirty, with what relief; on roads as traffic and salt left it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.kernel.exposure import Exposure, Spot, soft
from sumo3dviz_pt.render.kernel.lobes import Finish
from sumo3dviz_pt.render.kernel.ripples import Bumps, bumps
from sumo3dviz_pt.render.kernel.rows import Kind

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


def lying(spot: Spot, reach: Exposure, roads: str, depth: Any) -> Lying:
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
    snow = _on_roads(snow, reach, noise, reach.paved(spot, Kind.ROAD), roads)
    if roads != "covered":
        snow = _trodden(snow, reach, noise, reach.paved(spot, Kind.SLABS))
    return replace(snow, slopes=_relief(snow.cover, spot, reach, noise, depth))


def _held(spot: Spot, reach: Exposure, uneven: Any, depth: Any) -> Any:
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


def _on_roads(snow: Lying, reach: Exposure, noise: _Uneven, road: Any, roads: str) -> Lying:
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


def _trodden(snow: Lying, reach: Exposure, noise: _Uneven, slabs: Any) -> Lying:
    """Return the snow as people left it on sidewalks."""
    left = soft((0.62 - 0.55 * noise.broad.value - 0.2 * noise.small.value + 0.3 * reach.low) * 1.3)
    slush = dr.clip(0.3 - 0.35 * noise.mixed, 0.0, 0.7)
    return replace(
        snow,
        cover=dr.select(slabs, snow.cover * (0.25 + 0.75 * left), snow.cover),
        slush=dr.select(slabs, slush, snow.slush),
        wet=dr.select(slabs, 0.7, snow.wet),
    )


def _relief(cover: Any, spot: Spot, reach: Exposure, noise: _Uneven, depth: Any) -> tuple[Any, Any]:
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
        deep = dr.minimum(depth, 0.06) * dr.select(reach.paved(spot, Kind.ROAD), cover, 0.0)
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
