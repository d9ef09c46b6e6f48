"""Colours of land as seen from a height: dry and lush patches, and fields of different crops.

Both are factors on the ground's reflectance with a mean of about one. They depend on the place
alone and repeat with the lattice's period. JIT variants only.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.materials.lattice import PERIOD, corners, hashed, unit

FIELD = (32.0, 16.0)
"""Length and width of fields by sqrt(5) [tiles]; world/plants/build.py has hedgerows there."""

_DRY = (0.88, 0.42, 0.66)  # change of reflectance where grass dries
_LUSH = (-0.46, -0.10, -0.22)  # where clover and nettles grow
_CROPS = (
    (1.0, 1.0, 1.0),
    (1.22, 1.13, 1.10),  # mown
    (0.66, 0.84, 0.70),  # a young crop
    (1.36, 1.12, 1.26),  # hay
    (1.75, 1.24, 1.52),  # stubble
    (0.86, 1.04, 0.74),
)
_SWATH = 7.2  # width of what a machine passes over at once [m]
_PIXEL = 8e-4  # angle of a pixel that is assumed [rad]


def patches(uv: Any, amount: float) -> Any:
    """Return the factor of dry and lush patches, from half a tile to four tiles wide.

    Args:
        uv: Texture coordinates [tiles].
        amount: 0 gives one everywhere.
    """
    askew = _turned(uv)
    broad = corners(uv, cells=0.25, mask=PERIOD // 4 - 1)
    middle = corners(askew, cells=0.25, mask=PERIOD // 4 - 1)
    small = corners(askew, cells=1.0, mask=PERIOD - 1)
    dry = 0.42 * broad.noise(5) + 0.42 * middle.noise(6) + 0.3 * small.noise(7)
    lush = 0.35 * broad.noise(8) + 0.45 * middle.noise(9) + 0.4 * small.noise(10)
    # Dry spots get an edge; without one they would look like the shadows of clouds.
    dry = 1.5 * dry / dr.sqrt(0.35 + dry * dry)
    change = mi.Color3f(*_DRY) * (0.3 * dry) + mi.Color3f(*_LUSH) * (0.9 * lush)
    return mi.Color3f(1.0) + amount * change


def fields(uv: Any, tile: float, away: Any) -> Any:
    """Return the factor of fields with strips of grass between them.

    Args:
        uv: Texture coordinates [tiles].
        tile: [m].
        away: Distance over the cosine of the ray's angle to the ground's normal [m].
    """
    askew = _turned(uv)
    wobble = 0.15 * corners(uv, cells=0.5, mask=PERIOD // 2 - 1).noise(21)
    a, b = (askew.x + wobble) / FIELD[0], (askew.y + wobble) / FIELD[1]
    column, row = dr.floor(a), dr.floor(b)
    bits = hashed(mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row)), PERIOD // 16 - 1)
    pick = mi.UInt32(unit(bits) * len(_CROPS))
    crop = mi.Color3f(1.0)
    for number, colour in enumerate(_CROPS):
        crop = dr.select(pick == number, mi.Color3f(*colour), crop)
    # Swaths differ in turn, because machines cut every other one in the opposite direction.
    turns = (b - row) * (FIELD[1] * tile / 5.0**0.5 / _SWATH)
    fade = dr.clip(1.5 - away * (2.0 * _PIXEL / _SWATH), 0.0, 1.0)
    stripes = 0.09 * fade * dr.clip(3.0 * dr.sin(3.14159 * turns), -1.0, 1.0)
    inside = dr.minimum(
        dr.minimum(a - column, 1.0 - (a - column)) * FIELD[0],
        dr.minimum(b - row, 1.0 - (b - row)) * FIELD[1],
    )
    share = dr.clip(inside * (tile / 5.0**0.5 / 3.0) - 0.5, 0.0, 1.0)
    return dr.lerp(mi.Color3f(1.0), crop * (1.0 + stripes), share)


def _turned(uv: Any) -> Any:
    """Turn coordinates by 27 degrees and enlarge them by sqrt(5); whole periods stay whole."""
    return mi.Vector2f(2.0 * uv.x + uv.y, 2.0 * uv.y - uv.x)
