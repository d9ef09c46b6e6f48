"""Random numbers of places and numbers: the same on every machine, in any order.

References:
    Steele, G. L., Lea, D. and Flood, C. H., Fast splittable pseudorandom number generators,
    OOPSLA 2014, doi:10.1145/2660193.2660195: the finaliser of SplitMix64.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats, Ints

Keys = NDArray[np.uint64]
"""Whole numbers that stand for places or things."""

_ODD = np.array(
    [0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB, 0xD6E8FEB86659FD93],
    dtype=np.uint64,
)

_STEPS = np.arange(1, 65, dtype=np.uint64) * _ODD[0]


def keys_of(seed: int, *numbers: Ints | int) -> Keys:
    """Return a key for each row of whole numbers.

    Args:
        seed: The scene's, with what tells uses apart.
        numbers: Arrays that broadcast, such as rows, columns and layers of cells.
    """
    keys: NDArray[Any] = np.array([seed % 2**63], dtype=np.uint64)
    for number in numbers:
        words = np.atleast_1d(np.asarray(number, dtype=np.int64)).view(np.uint64)
        keys = _mixed(keys + _ODD[0] * (words + _ODD[3]))
    return np.asarray(keys)


def shares(keys: Keys, count: int) -> Floats:
    """Return numbers in [0, 1) for each key, (count, n)."""
    found = np.empty((count, len(keys)))
    for row in range(count):
        words = _mixed(keys + _STEPS[row])
        found[row] = (words >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return found


def _mixed(words: Keys) -> Keys:
    """Return words whose bits all depend on all bits of what is given."""
    words = (words ^ (words >> np.uint64(30))) * _ODD[1]
    words = (words ^ (words >> np.uint64(27))) * _ODD[2]
    return np.asarray(words ^ (words >> np.uint64(31)))
