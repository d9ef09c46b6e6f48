"""Orthogonal arrays for factors whose numbers of levels are powers of one prime.

The runs are all vectors x over the field of p elements. A factor of p^d levels is d linear forms
of x, read as one number. Two factors are orthogonal if their forms share no combination but zero:
each factor takes a subspace of forms, and the subspaces meet in zero only.

References:
    A. S. Hedayat, N. J. A. Sloane, J. Stufken (1999): Orthogonal Arrays, chapters 3.4 and 5;
    doi:10.1007/978-1-4612-1478-6
    R. C. Bose (1947): Mathematical theory of the symmetrical factorial design, Sankhya 8, 107-166
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from sumo3dviz_pt.experiments.designs.balance import Rows

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
    found = [power for power in powers if power]
    prime, size = found[-1]
    order = sorted(range(len(counts)), key=lambda factor: -found[factor][1])
    search = _Search(prime, size, [found[factor][1] for factor in order], strength)
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
