"""Smooth noise over the ground plane: where stains, dirt and worn spots lie."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints


def patchy(points: Floats, scale: float, *, salt: int) -> Floats:
    """Return the value noise on a square lattice, smoothly interpolated.

    Args:
        points: (..., 2 or more) [m]; only x and y count.
        scale: Distance of the lattice's points [m], > 0.
        salt: Another noise for each.

    Returns:
        (...) in [-1, 1].

    References:
        Hash of the lattice: Steele et al., "Fast splittable pseudorandom number
        generators", OOPSLA 2014 (the finaliser of SplitMix64).
    """
    # Lattices of different noises must not share their corners.
    x, y = (points[..., k] / scale + 0.37 * salt for k in range(2))
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    u, v = (f * f * (3.0 - 2.0 * f) for f in (x - i, y - j))
    below = _hashed(i, j, salt) * (1.0 - u) + _hashed(i + 1, j, salt) * u
    above = _hashed(i, j + 1, salt) * (1.0 - u) + _hashed(i + 1, j + 1, salt) * u
    return np.asarray(below * (1.0 - v) + above * v)


def _hashed(i: Ints, j: Ints, salt: int) -> Floats:
    """Numbers in [-1, 1) for cells of the lattice."""
    bits = i.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    bits = (bits ^ (j.astype(np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F))) + np.uint64(salt)
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray((bits >> np.uint64(11)) * (2.0 / (1 << 53)) - 1.0)
