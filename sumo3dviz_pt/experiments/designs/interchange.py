"""Orthogonal arrays of any levels and few runs, column by column by exchanging levels.

A column begins in a random order in which each level occurs equally often. The two rows whose
exchange makes the counts of pairs with earlier columns most even are exchanged, again and again,
until all counts are equal or nothing gets better; then it begins anew. All numbers are whole, so
that every processor finds the same array.

References:
    H. Xu (2002): An algorithm for constructing orthogonal and nearly-orthogonal arrays with mixed
    levels and small runs, Technometrics 44(4), 356-368; doi:10.1198/004017002188618554
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.experiments.designs.balance import Rows

_STARTS, _COLUMN_STARTS = 40, 60
"""Beginnings of a whole array, and of each of its columns."""

Whole = NDArray[np.int64]


def interchange_array(counts: Sequence[int], runs: int, *, strength: int = 2) -> Rows | None:
    """Return an orthogonal array, (runs, factors); None if none was found.

    Args:
        counts: How many levels each factor has; the product of any `strength` divides `runs`.
        runs: How many rows it is to have.
        strength: 2 or 3.
    """
    order = sorted(range(len(counts)), key=lambda factor: -counts[factor])
    # Raw bits, which are the same in all versions of NumPy; methods that use them are not.
    bits = np.random.PCG64([runs, *(counts[factor] for factor in order)])
    for _ in range(_STARTS):
        columns = _columns([counts[factor] for factor in order], runs, bits, strength)
        if columns is not None:
            rows = np.empty((runs, len(counts)), dtype=np.int64)
            rows[:, order] = np.stack(columns, axis=1)
            return rows
    return None


def _columns(
    counts: Sequence[int], runs: int, bits: np.random.PCG64, strength: int
) -> list[Whole] | None:
    """Return columns that are orthogonal to each other; None if one was not found.

    For strength 3, each is orthogonal to every pair of earlier ones, taken as a column.
    """
    columns = [np.repeat(np.arange(counts[0]), runs // counts[0])]
    marks, earlier = _marks(columns[0], counts[0]), 1
    for place, count in enumerate(counts[1:], start=1):
        column = _column(count, marks, earlier, bits)
        if column is None:
            return None
        added = [_marks(column, count)]
        if strength > 2:
            added += [
                _marks(other * count + column, own * count)
                for other, own in zip(columns, counts[:place], strict=True)
            ]
        columns.append(column)
        marks, earlier = np.concatenate([marks, *added], axis=1), earlier + len(added)
    return columns


def _marks(column: Whole, count: int) -> Whole:
    """Return which level each row has, as ones among zeros, (runs, levels)."""
    marks: Whole = (column[:, None] == np.arange(count)).astype(np.int64)
    return marks


def _column(count: int, marks: Whole, earlier: int, bits: np.random.PCG64) -> Whole | None:
    """Return a column that is orthogonal to earlier ones; None if none was found.

    Args:
        count: Its levels.
        marks: Of the earlier columns, (runs, all their levels).
        earlier: How many these are.
        bits: Random ones.
    """
    runs = len(marks)
    # Of two rows, how often earlier columns tell them apart.
    apart = earlier - marks @ marks.T
    goal = int((marks.sum(axis=0) ** 2).sum())
    for _ in range(_COLUMN_STARTS):
        column = np.argsort(bits.random_raw(runs), kind="stable") % count
        times = _marks(column, count).T @ marks
        while count * int((times**2).sum()) > goal:
            gain, first, second = _best_exchange(column, times @ marks.T, apart)
            if gain >= 0:
                break
            column[[first, second]] = column[[second, first]]
            times = _marks(column, count).T @ marks
        else:
            return column.astype(np.int64)
    return None


def _best_exchange(column: Whole, near: Whole, apart: Whole) -> tuple[int, int, int]:
    """Return the change of the sum of squared counts by the best exchange, and its two rows.

    Args:
        column: A row's level, (runs,).
        near: Sum of the counts of a level with what each row has, (levels, runs).
        apart: How often earlier columns tell two rows apart, (runs, runs).
    """
    own = near[column]  # (runs, runs): level of the first, what the second has
    here = np.diagonal(own)
    change = 2 * (own - here[:, None] + own.T - here[None, :]) + 4 * apart
    change = np.where(column[:, None] == column[None, :], 0, change)
    best = int(change.argmin())
    first, second = divmod(best, len(column))
    return int(change[first, second]), first, second
