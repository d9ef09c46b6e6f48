"""Latin squares as designs, and balanced Latin squares as orders of presentation.

References:
    E. J. Williams (1949): Experimental designs balanced for the estimation of residual effects of
    treatments, Australian Journal of Scientific Research A 2(2), 149-168; doi:10.1071/CH9490149
    R. C. Bose (1938): On the application of the properties of Galois fields to the problem of
    construction of hyper-Graeco-Latin squares, Sankhya 3, 323-338
    G. Tarry (1900): Le probleme de 36 officiers (no two orthogonal squares of order 6)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.designs.balance import Rows
from sumo3dviz_pt.experiments.designs.linear import linear_array


def latin_square(counts: Sequence[int]) -> Rows:
    """Return the n x n combinations of a Latin square, (runs, factors).

    Each level of a factor meets each level of every other factor once. Four factors and more need
    Latin squares that are orthogonal to each other, which are made for powers of a prime.

    Args:
        counts: How many levels each factor has: three or more factors with n levels each.

    Raises:
        ConfigError: If there is no such square, or none is known here.
    """
    size, text = counts[0], " x ".join(map(str, counts))
    if len(counts) < 3 or set(counts) != {size}:
        raise ConfigError(
            "a Latin square takes three or more factors with equally many levels, not"
            f" {text}; write design: full, or design: fraction",
            key="design",
        )
    if len(counts) > size + 1:
        raise ConfigError(
            f"a Latin square of {size} levels takes at most {size + 1} factors,"
            f" not {len(counts)}; write design: fraction",
            key="design",
        )
    rows = linear_array(counts, size * size)
    if rows is not None:
        return rows
    if len(counts) > 3:
        none = "exist" if size == 6 else "are known here"
        raise ConfigError(
            f"no orthogonal Latin squares of {size} levels {none}, which {len(counts)} factors"
            " need; write design: fraction, or take three factors",
            key="design",
        )
    first, second = np.divmod(np.arange(size * size), size)
    return np.stack([first, second, (first + second) % size], axis=1)


def balanced_orders(count: int) -> list[list[int]]:
    """Return orders in which each thing stands at each place, and after each other, equally often.

    Args:
        count: How many things; at least 1.

    Returns:
        As many orders as things, or twice as many where their number is odd and more than 1.
    """
    first = [0]
    low, high = 1, count - 1
    while low <= high:
        first += [low] if low == high else [low, high]
        low, high = low + 1, high - 1
    orders = [[(place + shift) % count for place in first] for shift in range(count)]
    if count > 1 and count % 2:
        orders += [order[::-1] for order in orders]
    return orders
