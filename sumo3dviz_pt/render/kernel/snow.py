"""Snow that lies: where, how dirty, with what relief; on roads as traffic and salt left it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.kernel.lobes import Finish
from sumo3dviz_pt.render.kernel.ripples import bumps
from sumo3dviz_pt.render.kernel.rows import Kind

ALBEDO = (0.84, 0.85, 0.86)
"""Reflectance of clean snow."""

_SLUSH = (0.33, 0.315, 0.295)  # reflectance of snow that traffic has ground
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
        colour: Reflectance.
        slush: How much of it is slush, in [0, 1].
        wet: Wetness of what is not covered.
        grey: Share of salt's grey on what is not covered, in [0, 1].
        slopes: Of its relief, towards the east and the north.
    """

    cover: Any
    colour: Any
    slush: Any
    wet: Any
    grey: Any
    slopes: tuple[Any, Any]


def lying_snow(
    spot: Any,
    place: Any,
    roads: str,
    *,
    depth: Any,
    open_: Any,
    up: Any,
    low: Any,
    above: Any,
    leaf: Any,
    tracks: tuple[Any, Any, Any, Any] | None,
    pixel: Any,
) -> Lying:
    """Return the snow that lies at a place.

    Args:
        spot: The place; see `deposits.Spot`.
        place: In coordinates that repeat, for patterns [m].
        roads: `cleared`, `tracked` or `covered`.
        depth: Of the snow [m].
        open_: How far the place lies under the sky, in [0, 1].
        up: Vertical part of its normal; leaves have two sides.
        low: How low the ground lies.
        above: Height over what is seen from above, bare of leaves [m].
        leaf: Whether it is a leaf.
        tracks: How much of it wheels took away and made dirty, and slopes; or None.
        pixel: Angle of a pixel [rad].
    """
    # Patterns move with what moves.
    place = dr.select(spot.rigid, spot.own, place)
    broad = bumps(place.x, place.y, cells=1, per=4, salt=31)
    small = bumps(place.x, place.y, cells=2, per=1, salt=32)
    fine = bumps(place.x, place.y, cells=8, per=1, salt=33)
    uneven = 0.5 * broad.value + 0.35 * small.value + 0.2 * fine.value
    full = depth * (1.0 / _HIDDEN)
    # It holds on what is level enough, and thin snow lies in patches.
    holds = _smooth((up + 0.12 * uneven - _STEEPEST) * (1.0 / 0.3))
    # Blades that are shorter than the snow is deep are below it.
    buried = leaf & (above > 0.0) & (above < depth * (1.0 + 0.5 * uneven))
    holds = dr.select(leaf, dr.maximum(0.75 * holds, dr.select(buried, 1.0, 0.0)), holds)
    patchy = _smooth(0.5 + 1.6 * (full - 0.55) + 0.8 * uneven)
    cover = holds * patchy * _smooth(1.35 * open_ - 0.2)
    # Wind and warmth leave little on bodies that drive: some on what is level.
    rest = 0.9 * _smooth((up - 0.93) * 16.0) * _smooth(1.1 * uneven + 0.15 + 0.2 * full)
    cover = dr.select(spot.moves, dr.select(spot.rigid, rest * open_, 0.0), cover)

    near = dr.clip(2.0 - spot.away * pixel * (1.0 / _FINE), 0.0, 1.0)
    tall = dr.minimum(depth * 20.0, 1.0) * cover
    dx = tall * (0.14 * broad.dx + near * (0.035 * small.dx + 0.008 * fine.dx))
    dy = tall * (0.14 * broad.dy + near * (0.035 * small.dy + 0.008 * fine.dy))
    colour, slush = mi.Color3f(*ALBEDO), mi.Float(0.0)
    wet, grey = mi.Float(0.0), mi.Float(0.0)
    road = _has(spot.kind, Kind.ROAD) & (up > 0.8) & ~spot.moves
    slabs = _has(spot.kind, Kind.SLABS) & (up > 0.8) & ~spot.moves
    gone, dirty = tracks[:2] if tracks is not None else (mi.Float(0.0), mi.Float(0.0))
    if roads == "cleared":
        # Ploughs leave a ragged, dirty rim at kerbs, and salt the rest.
        rim = _smooth((1.5 * low + 0.4 * uneven - 0.42) * (1.0 / 0.3))
        cover = dr.select(road, cover * rim * 0.95, cover)
        slush = dr.select(road, dr.clip(0.55 - 0.5 * rim + 0.4 * uneven, 0.15, 0.9), slush)
        wet = dr.select(road, 0.72 + 0.2 * broad.value, wet)
        grey = dr.select(road, dr.clip(0.25 + 0.5 * broad.value, 0.0, 0.6), grey)
    elif roads == "tracked":
        # Wheels leave slush, in the end wet asphalt, and throw dirt over all of the lane.
        loose = 0.4 * small.value + 0.35 * fine.value + 0.3 * broad.value
        bare = 0.88 * _smooth((gone * (1.0 + 0.55 * loose) - 0.3) * (1.0 / 0.65))
        cover = dr.select(road, cover * (1.0 - bare), cover)
        mess = 0.62 * dirty + 0.45 * gone + 0.3 * loose * (dirty + 0.15)
        slush = dr.select(road, dr.clip(mess, 0.0, 0.95), slush)
        wet = dr.select(road, 0.85, wet)
        grey = dr.select(road, dr.clip(0.35 + 0.4 * small.value, 0.0, 0.6), grey)
    else:
        slush = dr.select(
            road, dr.clip(0.3 * gone + 0.16 * dirty + 0.05 * small.value, 0.0, 0.5), slush
        )
    if roads != "covered":
        # People have trodden slabs.
        slush = dr.select(slabs, dr.clip(0.3 - 0.35 * uneven, 0.0, 0.7), slush)
        trodden = _smooth((0.62 - 0.55 * broad.value - 0.2 * small.value + 0.5 * low) * 1.3)
        cover = dr.select(slabs, cover * (0.25 + 0.75 * trodden), cover)
        wet = dr.select(slabs, 0.7, wet)
    colour = dr.lerp(colour, mi.Color3f(*_SLUSH), slush)
    if tracks is not None:
        deep = dr.minimum(depth, 0.06) * dr.select(road, cover, 0.0)
        dx -= deep * tracks[2]
        dy -= deep * tracks[3]
    return Lying(cover, colour, slush, wet, grey, (dx, dy))


def snowed(finish: Finish, normal: Any, snow: Lying) -> tuple[Finish, Any]:
    """Return a material with snow on it, and its unit normal.

    Args:
        finish: Of what lies below.
        normal: Of what lies below, unit.
        snow: What lies on it.
    """
    cover = snow.cover
    bare = 1.0 - cover
    below = dr.lerp(finish.colour, mi.Color3f(*_SALT), snow.grey)
    matt = (cover > 0.5) & (snow.slush < 0.5)
    dressed = replace(
        finish,
        colour=dr.lerp(below, snow.colour, cover),
        roughness=dr.lerp(finish.roughness, dr.lerp(mi.Float(1.0), _GRIT, snow.slush), cover),
        metallic=finish.metallic * bare,
        coat=finish.coat * bare,
        through=finish.through * bare,
        glossy=finish.glossy * dr.maximum(bare, 0.6 * snow.slush),
        matt=finish.matt | matt,
    )
    side = dr.select(normal.z < 0.0, mi.Float(-1.0), 1.0)
    rounded = normal * side + mi.Vector3f(0.0, 0.0, 0.7 * cover)
    tilted = rounded + mi.Vector3f(-snow.slopes[0], -snow.slopes[1], 0.0)
    return dressed, side * dr.normalize(tilted)


def _smooth(value: Any) -> Any:
    """Return a value, cut to [0, 1], with soft ends."""
    share = dr.clip(value, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def _has(kind: Any, what: Kind) -> Any:
    """Return whether a material is any of some kinds."""
    return (kind & int(what)) != 0
