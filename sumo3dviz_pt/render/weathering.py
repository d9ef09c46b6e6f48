"""How walls of houses have weathered: stains, streaks, repairs, dirt at the foot.

A factor on a wall's reflectance, from texture coordinates and from three numbers in [0, 1] that its
corners tell: height above the foot and depth below the top, both over `WALL_REACH`, and how near
it is to a sill above, from which dirty water runs.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.geometry import WALL_REACH
from sumo3dviz_pt.render.textures import PERIOD, corners, hashed, mixed, unit

CONTRAST = 1.25
"""How much more one brick differs from another than in the bitmap."""

_SOOT = (0.5, 0.48, 0.45)  # what is left of a reflectance under most dirt
_SPLASH = (0.66, 0.61, 0.53)  # the same at the foot, where the street's dirt is


def weathering(uv: Any, place: Any) -> tuple[Any]:
    """Return the factor of a wall's reflectance, three channels.

    Args:
        uv: Texture coordinates [tiles].
        place: Three numbers of the wall's corners.
    """
    broad = corners(uv, cells=0.25, mask=PERIOD // 4 - 1)
    small = corners(uv, cells=1.0, mask=PERIOD - 1)
    thin = corners(mi.Vector2f(8.0 * uv.x, 0.4 * uv.y), cells=1.0, mask=PERIOD - 1)
    height, below, drip = place.x * WALL_REACH, place.y * WALL_REACH, place.z
    wide, narrow = broad.noise(3), small.noise(4)
    mottle, warm = 0.55 * wide + 0.4 * narrow, 0.05 * (wide - narrow)
    factor = mi.Color3f(1.0 + warm, 1.0, 1.0 - warm) * (1.0 + 0.3 * mottle)
    factor *= _repairs(uv)
    streak = dr.clip(0.25 + 1.3 * thin.noise(5), 0.0, 1.0)
    soot = 0.85 * dr.exp(-below * 0.8) * (0.3 + 0.7 * streak)
    soot = dr.maximum(soot, 1.1 * drip * drip * (0.25 + 0.75 * streak))
    soot = dr.maximum(soot, 0.3 * streak * dr.clip(0.4 + mottle, 0.0, 1.0))
    factor = dr.lerp(factor, factor * mi.Color3f(*_SOOT), soot)
    splash = dr.exp(-height * (1.5 + 0.8 * narrow)) * (0.75 + 0.25 * streak)
    return (dr.lerp(factor, factor * mi.Color3f(*_SPLASH), dr.clip(splash, 0.0, 1.0)),)


def _repairs(uv: Any) -> Any:
    """Return the factor of patches that were mended with paler or darker stuff."""
    a, b = 0.8 * uv.x + 0.3, 1.1 * uv.y
    column, row = dr.floor(a), dr.floor(b)
    bits = hashed(mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row)), PERIOD - 1)
    wide, tall = 0.12 + 0.3 * unit(mixed(bits + 1)), 0.1 + 0.34 * unit(mixed(bits + 2))
    inside = (dr.abs(a - column - 0.5) < wide) & (dr.abs(b - row - 0.5) < tall)
    mended = 0.86 + 0.3 * unit(mixed(bits + 3))
    return dr.select(inside & (unit(bits) < 0.07), mended, 1.0)
