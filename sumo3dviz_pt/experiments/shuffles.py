"""Puts things into a random order that depends on a seed and words only, on every machine."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TypeVar

_T = TypeVar("_T")


def shuffled(items: Sequence[_T], seed: int, *words: str) -> list[_T]:
    """Return items in a random order, each order as likely as the others.

    Args:
        items: Of any kind.
        seed: The study's.
        words: What is shuffled; others give another order.
    """
    return [items[place] for place in permutation(len(items), seed, *words)]


def permutation(count: int, seed: int, *words: str) -> list[int]:
    """Return the numbers below `count` in a random order."""
    text = ":".join([str(seed), *words])
    return sorted(range(count), key=lambda place: (_digest(f"{text}:{place}"), place))


def _digest(text: str) -> bytes:
    """Return bytes that look random."""
    return hashlib.blake2b(text.encode(), digest_size=8).digest()
