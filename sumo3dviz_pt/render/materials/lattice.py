"""Hashes on a lattice of triangles that repeats after whole periods, and noise from them.

JIT variants only: everything is an array of Dr.Jit.

References:
    Hash: Wellons, "Prospecting for Hash Functions", 2018 (lowbias32). Simplex lattice:
    Perlin, "Noise hardware", SIGGRAPH course 2001.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

PERIOD = 1024
"""After so many tiles the hashes repeat, so that whole periods can be dropped."""


def mixed(value: Any) -> Any:
    """Scramble the bits of an integer (Wellons' lowbias32)."""
    value = (value ^ (value >> 16)) * 0x7FEB352D
    value = (value ^ (value >> 15)) * 0x846CA68B
    return value ^ (value >> 16)


def unit(bits: Any) -> Any:
    """Return bits as a number in [0, 1)."""
    return mi.Float(bits >> 8) * (1.0 / (1 << 24))


@dataclass(frozen=True, slots=True)
class Corners:
    """Three corners of the lattice around a point: hashes and linear weights."""

    hashes: tuple[Any, Any, Any]
    weights: tuple[Any, Any, Any]

    @property
    def unevenness(self) -> Any:
        """Smooth noise in [-1, 1]."""
        return self.noise(77)

    def noise(self, salt: int) -> Any:
        """Return smooth noise in [-1, 1], another one for each salt."""
        rows = zip(self.hashes, self.weights, strict=True)
        return sum(weight * (2.0 * unit(mixed(bits + salt)) - 1.0) for bits, weight in rows)


def hashed(a: Any, b: Any, mask: int) -> Any:
    """Return random bits of a cell.

    Args:
        a: Its column, an integer.
        b: Its row, an integer.
        mask: Cells after which rows and columns repeat, a power of two, less one.
    """
    return mixed((a & mask) * 0x9E3779B1 ^ mixed((b & mask) + 0x85EBCA6B))


def corners(uv: Any, *, cells: float, mask: int) -> Corners:
    """Return the corners of the triangle that a point lies in.

    The lattice is sheared by whole half cells, so that it repeats with the tile. One
    period up is half a period of cells to the left: columns repeat after half of them.

    Args:
        uv: Texture coordinates [tiles].
        cells: Cells along a tile.
        mask: Cells in a period, less one.
    """
    x, y = cells * (uv.x - 0.5 * uv.y), cells * uv.y
    column, row = dr.floor(x), dr.floor(y)
    fx, fy = x - column, y - row
    lower = fx + fy < 1.0
    i, j = mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row))
    step = dr.select(lower, mi.UInt32(0), mi.UInt32(1))
    half = mask >> 1
    return Corners(
        (
            hashed((i + step) & half, j + step, mask),
            hashed((i + 1) & half, j, mask),
            hashed(i & half, j + 1, mask),
        ),
        (
            dr.abs(1.0 - fx - fy),
            dr.select(lower, fx, 1.0 - fy),
            dr.select(lower, fy, 1.0 - fx),
        ),
    )
