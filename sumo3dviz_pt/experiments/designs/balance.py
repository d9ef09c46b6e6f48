"""Says which factors of a design hide each other: how often their levels occur together.

References:
    S. Addelman (1962): Orthogonal main-effect plans for asymmetrical factorial experiments,
    Technometrics 4(1), 21-46; doi:10.1080/00401706.1962.10489997 (proportional frequencies)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

_MOST = 6
"""Most pairs of factors that a sentence names."""

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


def aliases(rows: Rows, counts: Sequence[int]) -> dict[int, list[tuple[int, int]]]:
    """Return by factor the pairs of others whose effect together cannot be told from its own.

    It can where each level of the factor occurs with each pair of their levels in proportion.
    Factors that already tell about each other are left to `confounded_pairs`.

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
    """
    known = set(confounded_pairs(rows, counts))
    found: dict[int, list[tuple[int, int]]] = {}
    for one, other in combinations(range(len(counts)), 2):
        both = np.column_stack([rows, rows[:, one] * counts[other] + rows[:, other]])
        sizes = (*counts, counts[one] * counts[other])
        for factor in range(len(counts)):
            apart = {(min(factor, n), max(factor, n)) for n in (one, other)}
            if factor in (one, other) or apart & known:
                continue
            times = pair_counts(both, sizes, factor, len(counts))
            expected = np.outer(times.sum(axis=1), times.sum(axis=0))
            if (times * len(rows) != expected).any():
                found.setdefault(factor, []).append((one, other))
    return found


def told_by(rows: Rows, counts: Sequence[int]) -> list[tuple[int, int]]:
    """Return pairs of factors of which one's level always says the other's.

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
    """
    found = []
    for one, other in combinations(range(len(counts)), 2):
        met = pair_counts(rows, counts, one, other) > 0
        varied = all(len(set(rows[:, n].tolist())) > 1 for n in (one, other))
        if varied and min(met.sum(axis=0).max(), met.sum(axis=1).max()) == 1:
            found.append((one, other))
    return found


def hidden_in_words(rows: Rows, levels: Mapping[str, Sequence[str]]) -> list[str]:
    """Return which factor's effect a design confounds with what, a sentence each.

    Args:
        rows: The design, (runs, factors).
        levels: Of each factor, by its name.
    """
    names, counts = list(levels), [len(some) for some in levels.values()]
    found = same_in_words(rows, levels)
    for factor, pairs in sorted(aliases(rows, counts).items()):
        words = ", ".join(f"{names[one]} with {names[other]}" for one, other in pairs[:_MOST])
        more = f" and {len(pairs) - _MOST} more" if len(pairs) > _MOST else ""
        found.append(
            f"{names[factor]} is confounded with what two factors do together: {words}{more}; its"
            " effect is its own only if they do nothing together"
        )
    return found


def same_in_words(rows: Rows, levels: Mapping[str, Sequence[str]]) -> list[str]:
    """Return which factors always change together, a sentence each; arguments as above."""
    names, counts = list(levels), [len(some) for some in levels.values()]
    return [
        f"{names[one]} and {names[other]} cannot be told apart: the level of one always says that"
        " of the other"
        for one, other in told_by(rows, counts)
    ]
