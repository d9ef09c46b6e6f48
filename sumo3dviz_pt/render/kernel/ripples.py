"""Smooth noise with slopes, and the rings that drops of rain make on water.

All of it depends on place and time alone. The place repeats after `REPEAT` metres, so that far
from the network's origin nothing is lost to single precision.

References:
    Hash: see `render/materials/lattice.py`. Quintic blending: Perlin, "Improving Noise", 2002.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.materials.lattice import hashed, mixed, unit

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
