"""Orthogonal arrays and Latin squares: the fewest combinations in which no factor hides another.

Every pair of levels of any two factors occurs equally often, so each factor's own effect can be
told from every other factor's own effect. Effects of two factors together (interactions) cannot be
told from them, unless all combinations of any three factors occur equally often (strength 3). How
often levels occur together says of any design which factors hide each other.

Where numbers of levels are powers of one prime, the runs are all vectors x over the field of p
elements. A factor of p^d levels is d linear forms of x, read as one number. Two factors are
orthogonal if their forms share no combination but zero: each factor takes a subspace of forms, and
the subspaces meet in zero only.

Arrays of any levels and few runs are made column by column. A column begins in a random order in
which each level occurs equally often. The two rows whose exchange makes the counts of pairs with
earlier columns most even are exchanged, again and again, until all counts are equal or nothing gets
better; then it begins anew. All numbers are whole, so that every processor finds the same array.

Latin squares serve as designs, and balanced ones as orders of presentation.

References:
    S. Addelman (1962): Orthogonal main-effect plans for asymmetrical factorial experiments,
    Technometrics 4(1), 21-46; doi:10.1080/00401706.1962.10489997 (proportional frequencies)
    A. S. Hedayat, N. J. A. Sloane, J. Stufken (1999): Orthogonal Arrays, chapters 2.2 (Rao's
    bound), 3.4 and 5; doi:10.1007/978-1-4612-1478-6
    R. C. Bose (1947): Mathematical theory of the symmetrical factorial design, Sankhya 8, 107-166
    H. Xu (2002): An algorithm for constructing orthogonal and nearly-orthogonal arrays with mixed
    levels and small runs, Technometrics 44(4), 356-368; doi:10.1198/004017002188618554
    E. J. Williams (1949): Experimental designs balanced for the estimation of residual effects of
    treatments, Australian Journal of Scientific Research A 2(2), 149-168; doi:10.1071/CH9490149
    R. C. Bose (1938): On the application of the properties of Galois fields to the problem of
    construction of hyper-Graeco-Latin squares, Sankhya 3, 323-338
    G. Tarry (1900): Le probleme de 36 officiers (no two orthogonal squares of order 6)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import combinations, product
from math import lcm, prod

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError

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
    frequencies = np.bincount(flat, minlength=counts[one] * counts[other])
    return np.asarray(frequencies.reshape(counts[one], counts[other]), dtype=np.int64)


def confounded_pairs(rows: Rows, counts: Sequence[int]) -> list[tuple[int, int]]:
    """Return all pairs of factors, by number, that tell about each other.

    They do not where each level of one occurs with the levels of the other in the same
    proportions; in an orthogonal array all pairs of levels occur equally often.

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
    """
    pairs = []
    for one, other in combinations(range(len(counts)), 2):
        times = pair_counts(rows, counts, one, other)
        expected = np.outer(times.sum(axis=1), times.sum(axis=0))
        if (times * len(rows) != expected).any():
            pairs.append((one, other))
    return pairs


def aliases(rows: Rows, counts: Sequence[int]) -> dict[int, list[tuple[int, int]]]:
    """Return by factor the pairs of others whose effect together cannot be told from its own.

    It can where each level of the factor occurs with each pair of their levels in proportion.
    Factors that already tell about each other are left to `confounded_pairs`.

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
    """
    known = set(confounded_pairs(rows, counts))
    pairs: dict[int, list[tuple[int, int]]] = {}
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
                pairs.setdefault(factor, []).append((one, other))
    return pairs


def told_by(rows: Rows, counts: Sequence[int]) -> list[tuple[int, int]]:
    """Return pairs of factors of which one's level always says the other's.

    Args:
        rows: The design, (runs, factors).
        counts: How many levels each factor has.
    """
    pairs = []
    for one, other in combinations(range(len(counts)), 2):
        met = pair_counts(rows, counts, one, other) > 0
        varied = all(len(set(rows[:, n].tolist())) > 1 for n in (one, other))
        if varied and min(met.sum(axis=0).max(), met.sum(axis=1).max()) == 1:
            pairs.append((one, other))
    return pairs


def hidden_in_words(rows: Rows, levels: Mapping[str, Sequence[str]]) -> list[str]:
    """Return which factor's effect a design confounds with what, a sentence each.

    Args:
        rows: The design, (runs, factors).
        levels: Of each factor, by its name.
    """
    names, counts = list(levels), [len(some) for some in levels.values()]
    sentences = same_in_words(rows, levels)
    for factor, pairs in sorted(aliases(rows, counts).items()):
        words = ", ".join(f"{names[one]} with {names[other]}" for one, other in pairs[:_MOST])
        more = f" and {len(pairs) - _MOST} more" if len(pairs) > _MOST else ""
        sentences.append(
            f"{names[factor]} is confounded with what two factors do together: {words}{more}; its"
            " effect is its own only if they do nothing together"
        )
    return sentences


def same_in_words(rows: Rows, levels: Mapping[str, Sequence[str]]) -> list[str]:
    """Return which factors always change together, a sentence each; arguments as above."""
    names, counts = list(levels), [len(some) for some in levels.values()]
    return [
        f"{names[one]} and {names[other]} cannot be told apart: the level of one always says that"
        " of the other"
        for one, other in told_by(rows, counts)
    ]


_MOST_STEPS = 20_000
"""Subspaces that a search looks at before it gives up."""

Form = tuple[int, ...]
"""Coefficients of a linear form over the field of p elements."""


def prime_power(count: int) -> tuple[int, int] | None:
    """Return p and d of a number p^d with p prime; None if it is none."""
    prime = next((n for n in range(2, count + 1) if count % n == 0), None)
    power = 0
    while prime is not None and count % prime == 0:
        count, power = count // prime, power + 1
    return None if prime is None or count != 1 else (prime, power)


def linear_array(counts: Sequence[int], runs: int, *, strength: int = 2) -> Rows | None:
    """Return an orthogonal array, (runs, factors); None if none was found.

    Args:
        counts: How many levels each factor has.
        runs: How many rows it is to have.
        strength: 2 or 3.
    """
    powers = [prime_power(count) for count in (*counts, runs)]
    if None in powers or len({power[0] for power in powers if power}) != 1:
        return None
    prime_powers = [power for power in powers if power]
    prime, size = prime_powers[-1]
    order = sorted(range(len(counts)), key=lambda factor: -prime_powers[factor][1])
    search = _Search(prime, size, [prime_powers[factor][1] for factor in order], strength)
    bases = search.bases()
    if bases is None:
        return None
    vectors = np.array(list(product(range(prime), repeat=size)), dtype=np.int64)
    rows = np.empty((runs, len(counts)), dtype=np.int64)
    for factor, basis in zip(order, bases, strict=True):
        digits = vectors @ np.array(basis, dtype=np.int64).T % prime
        rows[:, factor] = digits @ prime ** np.arange(len(basis) - 1, -1, -1)
    return rows


class _Search:
    """A search for subspaces that meet in zero only, the largest first.

    For strength 3, each meets the sum of any two others in zero only.
    """

    def __init__(self, prime: int, size: int, dimensions: Sequence[int], strength: int) -> None:
        self._prime, self._dimensions, self._steps = prime, dimensions, 0
        self._strength = strength
        vectors = product(range(prime), repeat=size)
        # Of each line through zero, the vector whose first coefficient is 1 stands for all.
        self._lines = [v for v in vectors if next((x for x in v if x), 0) == 1]
        self._lines.sort(key=lambda form: (sum(map(bool, form)), [-x for x in form]))

    def bases(self) -> list[list[Form]] | None:
        """Return a basis of each subspace; None if there is no room or none was found."""
        needed = sum((self._prime**d - 1) // (self._prime - 1) for d in self._dimensions)
        return None if needed > len(self._lines) else self._rest(0, frozenset(), ())

    def _rest(
        self, place: int, taken: frozenset[Form], before: tuple[frozenset[Form], ...]
    ) -> list[list[Form]] | None:
        """Return bases of the subspaces from one on, beside lines that are taken.

        Args:
            place: Of the first one.
            taken: Lines that none may have.
            before: The lines of earlier ones.
        """
        if place == len(self._dimensions):
            return []
        for basis, lines in self._subspaces(self._dimensions[place], taken):
            self._steps += 1
            if self._steps > _MOST_STEPS:
                return None
            sums = before if self._strength > 2 else ()
            added = (self._spanned(basis, other) for other in sums)
            later = self._rest(place + 1, taken.union(lines, *added), (*before, lines))
            if later is not None:
                return [basis, *later]
        return None

    def _subspaces(
        self, dimension: int, taken: frozenset[Form]
    ) -> Iterator[tuple[list[Form], frozenset[Form]]]:
        """Yield bases of subspaces that keep off some lines, with the lines in each."""
        if dimension == 0:
            yield [], frozenset()
            return
        for basis, lines in self._subspaces(dimension - 1, taken):
            for line in self._lines:
                if line in taken or line in lines or (basis and line < basis[-1]):
                    continue
                added = self._joined(line, lines)
                if not added & taken:
                    yield [*basis, line], added

    def _spanned(self, basis: Sequence[Form], lines: frozenset[Form]) -> frozenset[Form]:
        """Return the lines of the sum of two subspaces that meet in zero only."""
        for line in basis:
            lines = self._joined(line, lines)
        return lines

    def _joined(self, line: Form, lines: frozenset[Form]) -> frozenset[Form]:
        """Return the lines of the subspace that a further one spans with those of another."""
        prime = self._prime
        sums = (
            tuple((a + k * b) % prime for a, b in zip(other, line, strict=True))
            for other in lines
            for k in range(prime)
        )
        return frozenset([line, *map(self._normal, sums)])

    def _normal(self, form: Form) -> Form:
        """Return the vector of a line whose first coefficient is 1."""
        first = next(x for x in form if x)
        inverse = pow(first, -1, self._prime)
        return tuple(x * inverse % self._prime for x in form)


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
    rows = _smallest(tuple(counts), strength)
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
def _smallest(counts: tuple[int, ...], strength: int) -> Rows | None:
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
