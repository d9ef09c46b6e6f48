"""Shares trials out to parts such that parts are confounded with as little as can be.

Who sees one part never sees the others. So a level that stands more often in one part is confounded
with whoever saw that part. Where parts and levels are powers of one prime, parts are the classes of
linear forms (confounding with the highest interactions: two parts of 2 x 2 x 2 are those with an
even and an odd number of high levels). Elsewhere trials are exchanged between parts as long as that
makes the counts of levels, and then those of pairs of levels, more even. All numbers are whole, so
that every processor finds the same parts.

References:
    R. A. Fisher (1942): The theory of confounding in factorial experiments in relation to the
    theory of groups, Annals of Eugenics 11, 341-353; doi:10.1111/j.1469-1809.1941.tb02298.x
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.experiments.designs.linear import prime_power
from sumo3dviz_pt.experiments.shuffles import permutation
from sumo3dviz_pt.experiments.trials import Trial

Whole = NDArray[np.int64]

_MOST_FORMS = 4096
"""Linear forms of a factorial beyond which none is looked for."""

_MOST_STARTS, _STARTED = 40, 3000
"""Beginnings of an exchange; and trials that these may have together."""

_MOST_EXCHANGED = 600
"""Most trials of a block between whose parts trials are exchanged; more are dealt out in order."""

_SINGLE = 16
"""What a level of a single factor weighs, against one for a pair of levels, before squares."""


def shared_out(trials: Sequence[Trial], parts: int, *, seed: int, block: str) -> list[list[Trial]]:
    """Return the trials of each part, in the order of the design.

    Args:
        trials: Of one block.
        parts: How many; no more than trials.
        seed: The study's: it chooses among parts of equal worth, and their order.
        block: Its name.
    """
    marks = _marks(trials)
    best, least = np.zeros(len(trials), dtype=np.int64), -1
    for part in _ways(trials, marks, parts, seed=seed, block=block):
        worth = int((_apart(part, marks, parts) ** 2).sum())
        if least < 0 or worth < least:
            best, least = part, worth
        if not worth:
            break
    names = permutation(parts, seed, "parts", block)
    of = best.tolist()
    return [[trials[n] for n, part in enumerate(of) if part == name] for name in names]


def uneven(parts: Sequence[Sequence[Trial]], factors: Sequence[str]) -> list[str]:
    """Return the factors, or else the pairs of factors, whose levels parts do not share evenly.

    Args:
        parts: The trials of each part of a block.
        factors: Names, in the order of profiles.
    """
    whole = [trial for part in parts for trial in part]
    of = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    for size in (1, 2):
        found = [
            " x ".join(factors[place] for place in some)
            for some in combinations(range(len(factors)), size)
            if _apart(of, _marked(whole, some), len(parts)).any()
        ]
        if found:
            return found
    return []


# What is counted ---------------------------------------------------------------------------


def _marks(trials: Sequence[Trial]) -> Whole:
    """Return how often each trial shows each level, and each pair of levels, by their weight."""
    width = len(next(p for trial in trials for p in trial.alternatives if p is not None))
    ones = [_SINGLE * _marked(trials, (place,)) for place in range(width)]
    return np.hstack([*ones, *(_marked(trials, pair) for pair in combinations(range(width), 2))])


def _marked(trials: Sequence[Trial], factors: Sequence[int]) -> Whole:
    """Return how often each trial shows each combination of some factors' levels."""
    shown = [
        [tuple(p[place] for place in factors) for p in trial.alternatives if p is not None]
        for trial in trials
    ]
    column = {some: n for n, some in enumerate(dict.fromkeys(x for own in shown for x in own))}
    marks = np.zeros((len(trials), len(column)), dtype=np.int64)
    for row, own in enumerate(shown):
        for some in own:
            marks[row, column[some]] += 1
    return marks


def _apart(part: Whole, marks: Whole, parts: int) -> Whole:
    """Return by how much counts are off those of even parts, times the number of trials.

    Args:
        part: Of each trial, (trials,).
        marks: What each trial shows, (trials, kinds).
        parts: How many there are.

    Returns:
        (parts, kinds); whole numbers, as they are 0 where parts are even.
    """
    own = (part == np.arange(parts)[:, None]).astype(np.int64)
    even = np.outer(own.sum(axis=1), marks.sum(axis=0))
    return np.asarray(len(part) * (own @ marks) - even, dtype=np.int64)


# Ways to share out -------------------------------------------------------------------------


def _ways(
    trials: Sequence[Trial], marks: Whole, parts: int, *, seed: int, block: str
) -> Iterator[Whole]:
    """Yield ways to share trials out: of each trial, its part."""
    if all(len(trial.alternatives) == 1 for trial in trials):
        yield from _classes([p for trial in trials for p in trial.alternatives if p], parts)
    for start in range(min(_MOST_STARTS, max(1, _STARTED // len(trials)))):
        order = permutation(len(trials), seed, "parts", block, str(start))
        if len(trials) > _MOST_EXCHANGED:
            order.sort(key=lambda n: str(trials[n].alternatives))
        part = np.empty(len(trials), dtype=np.int64)
        part[order] = np.arange(len(trials)) % parts
        yield part if len(trials) > _MOST_EXCHANGED else _exchanged(part, marks, parts)


def _exchanged(part: Whole, marks: Whole, parts: int) -> Whole:
    """Return parts after trials were exchanged between them as long as that made them more even."""
    part, count = part.copy(), len(part)
    like = marks @ marks.T
    unlike = np.diagonal(like)[:, None] + np.diagonal(like)[None, :] - 2 * like
    for _ in range(4 * count):
        near = (_apart(part, marks, parts) @ marks.T)[part]
        here = np.diagonal(near)
        change = near - here[:, None] + near.T - here[None, :] + count * unlike
        change = np.where(part[:, None] == part[None, :], 0, change)
        first, second = divmod(int(change.argmin()), count)
        if change[first, second] >= 0:
            break
        part[[first, second]] = part[[second, first]]
    return part


def _classes(profiles: Sequence[tuple[str, ...]], parts: int) -> Iterator[Whole]:
    """Yield parts that are classes of linear forms of levels, as digits over a field of primes.

    Args:
        profiles: Of the trials.
        parts: How many; nothing is yielded unless that is a power of a prime.
    """
    power = prime_power(parts)
    if power is None:
        return
    prime, size = power
    digits, owners = _digits(profiles, prime)
    if not owners or prime ** len(owners) > _MOST_FORMS:
        return
    forms = np.array(list(product(range(prime), repeat=len(owners)))[1:], dtype=np.int64)
    weights = _weights(forms, owners)
    for weight in sorted({*weights.tolist()}, reverse=True):
        chosen = _basis(forms, forms[weights == weight][0], prime, size, owners)
        if chosen is not None:
            yield (digits @ chosen.T % prime) @ prime ** np.arange(size)


def _digits(profiles: Sequence[tuple[str, ...]], prime: int) -> tuple[Whole, list[int]]:
    """Return levels as digits, of factors that have a power of a prime of them; and whose."""
    found, owners = [np.zeros((len(profiles), 0), dtype=np.int64)], []
    for factor, column in enumerate(zip(*profiles, strict=True)):
        names = list(dict.fromkeys(column))
        power = prime_power(len(names))
        if power is None or power[0] != prime:
            continue
        numbers = np.array([names.index(name) for name in column], dtype=np.int64)
        found.append(numbers[:, None] // prime ** np.arange(power[1]) % prime)
        owners += [factor] * power[1]
    return np.hstack(found), owners


def _weights(forms: Whole, owners: Sequence[int]) -> Whole:
    """Return how many factors act in each form, (...,)."""
    acts = [(forms[..., [n for n, o in enumerate(owners) if o == f]] > 0) for f in {*owners}]
    return np.asarray(sum(each.any(axis=-1).astype(np.int64) for each in acts), dtype=np.int64)


def _basis(
    forms: Whole, first: Whole, prime: int, size: int, owners: Sequence[int]
) -> Whole | None:
    """Return forms whose combinations have as many factors as can be; None if there are not enough.

    Args:
        forms: All of them, (forms, digits).
        first: One that is taken.
        prime: Elements of the field.
        size: How many are wanted.
        owners: The factor of each digit.
    """
    chosen = first[None, :]
    while len(chosen) < size:
        scales = np.array(list(product(range(prime), repeat=len(chosen))), dtype=np.int64)
        sums = (forms[:, None, :] + (scales @ chosen)[None, :, :]) % prime
        fewest = _weights(sums, owners).min(axis=1)
        if not fewest.max():
            return None
        chosen = np.vstack([chosen, forms[int(fewest.argmax())]])
    return chosen
