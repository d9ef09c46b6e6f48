"""Says which factors of a design hide each other: how often their levels occur together.

References:
    S. Addelman (1962): Orthogonal main-effect plans for asymmetrical factorial experiments,
    Technometrics 4(1), 21-46; doi:10.1080/00401706.1962.10489997 (proportional frequencies)
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.int64]
"""A design: the number of each factor's level, row by row, (runs, factors)."""


def pair_counts(rows: Rows, counts: Sequence[int], one: int, other: int) -> Rows:
    """Return how often pairs of levels occur, (levels of one, levels of the other).

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
        one: A factor's number.
        other: Another one's.
    """
    flat = rows[:, one] * counts[other] + rows[:, other]
    found = np.bincount(flat, minlength=counts[one] * counts[other])
    return np.asarray(found.reshape(counts[one], counts[other]), dtype=np.int64)


def confounded_pairs(rows: Rows, counts: Sequence[int]) -> list[tuple[int, int]]:
    """Return all pairs of factors, by number, that tell about each other.

    They do not where each level of one occurs with the levels of the other in the same
    proportions; in an orthogonal array all pairs of levels occur equally often.

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
    """
    found = []
    for one, other in combinations(range(len(counts)), 2):
        times = pair_counts(rows, counts, one, other)
        expected = np.outer(times.sum(axis=1), times.sum(axis=0))
        if (times * len(rows) != expected).any():
            found.append((one, other))
    return found
