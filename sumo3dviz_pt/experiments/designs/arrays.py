"""Orthogonal arrays: the fewest combinations in which no factor hides another.

Every pair of levels of any two factors occurs equally often, so each factor's own effect can be
told from every other factor's own effect. Effects of two factors together (interactions) cannot
be told from them, unless all combinations of any three factors occur equally often (strength 3).

References:
    A. S. Hedayat, N. J. A. Sloane, J. Stufken (1999): Orthogonal Arrays; Rao's bound is 2.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations
from math import lcm, prod

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.designs.balance import Rows, confounded_pairs
from sumo3dviz_pt.experiments.designs.interchange import interchange_array
from sumo3dviz_pt.experiments.designs.linear import linear_array

MOST_RUNS = 144
"""Largest array that is searched for, unless it is a linear one."""

_LARGEST_LINEAR = 2048


def orthogonal_array(counts: Sequence[int], *, strength: int = 2) -> Rows:
    """Return an orthogonal array with as few rows as were found, (runs, factors).

    Args:
        counts: How many levels each factor has, each at least 2.
        strength: Of how many factors, 2 or 3, all combinations of levels occur equally often.

    Raises:
        ConfigError: If none is smaller than all combinations, or none was found.
    """
    rows = _found(tuple(counts), strength)
    if rows is not None:
        return rows.copy()
    whole, text = prod(counts), " x ".join(map(str, counts))
    of = f" of strength {strength}" if strength > 2 else ""
    if next(_sizes(counts, strength), None) is None:
        why = f"no orthogonal fraction{of} exists"
    else:
        why = f"no orthogonal fraction{of} was found"
    raise ConfigError(
        f"{why} that is smaller than all {whole:,} combinations of {text} levels; write"
        " design: full, or give factors numbers of levels that divide each other",
        key="design",
    )


@cache
def _found(counts: tuple[int, ...], strength: int) -> Rows | None:
    """Return the smallest array that is found, or None."""
    for runs in _sizes(counts, strength):
        rows = linear_array(counts, runs, strength=strength) if runs <= _LARGEST_LINEAR else None
        if rows is None and runs <= MOST_RUNS:
            rows = interchange_array(counts, runs, strength=strength)
        if rows is not None:
            assert not confounded_pairs(rows, counts)
            return rows
    return None


def _sizes(counts: Sequence[int], strength: int) -> Iterator[int]:
    """Yield numbers of runs that an array may have, below that of all combinations.

    Each pair, or triple, of levels occurs equally often, so the number is a multiple of every
    product of two, or three, factors' levels. By Rao it is at least 1 + sum of (levels - 1); for
    strength 3, that of all factors but one, for each of its levels.
    """
    whole = prod(counts)
    if len(counts) <= strength:
        return
    step = lcm(*map(prod, combinations(counts, strength)))
    least = 1 + sum(count - 1 for count in counts)
    if strength > 2:
        least = max(count * (least - count + 1) for count in counts)
    least = max(least, step)
    yield from range(-(-least // step) * step, min(whole, _LARGEST_LINEAR + 1), step)
