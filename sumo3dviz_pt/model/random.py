"""Random numbers that depend on a seed and names only, never on order or process."""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

import numpy as np

_SHARES = 2**48
"""How many shares there are, as many as a float tells apart with room to spare."""


def share_of(seed: int, *words: str) -> float:
    """Return a number in [0, 1) that is always the same for the same seed and words."""
    text = ":".join([str(seed), *words]).encode("utf-8")
    return int.from_bytes(hashlib.blake2b(text, digest_size=6).digest(), "big") / _SHARES


def seed_of(seed: int, *words: str) -> int:
    """Return a whole number that is always the same for the same seed and words, [0, 2^48)."""
    return int(share_of(seed, *words) * _SHARES)


def dice_of(seed: int, *words: str) -> np.random.Generator:
    """Return random numbers that are always the same for the same seed and words."""
    return np.random.default_rng(seed_of(seed, *words))


def pick(weights: Sequence[float], share: float) -> int:
    """Return the index that a share in [0, 1) falls on, each as likely as its weight.

    Args:
        weights: Weights of the indices, not negative, with a positive sum.
        share: A number in [0, 1).
    """
    sums = list(accumulate(weights))
    return min(bisect_right(sums, share * sums[-1]), len(sums) - 1)


def frame_seed(seed: int, time: float) -> int:
    """Return a frame's own seed from the film's seed and its time [s], in [0, 2^32)."""
    microseconds = round(time * 1e6)
    words = [seed, microseconds % 2**32, abs(microseconds) // 2**32, int(microseconds < 0)]
    return int(np.random.SeedSequence(words).generate_state(1)[0])
