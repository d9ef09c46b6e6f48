"""Trials of an experiment, and who sees which of them, in which parts and in which order.

A trial shows profiles. A random order depends on a seed and words only, and is the same on every
machine.

Trials are shared out to parts such that parts are confounded with as little as can be. Who sees one
part never sees the others. So a level that stands more often in one part is confounded with whoever
saw that part. Where parts and levels are powers of one prime, parts are the classes of linear forms
(confounding with the highest interactions: two parts of 2 x 2 x 2 are those with an even and an odd
number of high levels). Elsewhere trials are exchanged between parts as long as that makes the
counts of levels, and then those of pairs of levels, more even. All numbers are whole, so that every
processor finds the same parts.

References:
    R. A. Fisher (1942): The theory of confounding in factorial experiments in relation to the
    theory of groups, Annals of Eugenics 11, 341-353; doi:10.1111/j.1469-1809.1941.tb02298.x
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.designs.arrays import balanced_orders, prime_power

Levels = Mapping[str, Sequence[str]]
"""The levels of each factor, by its name, in the order of the study file."""

Profile = tuple[str, ...]
"""A level of each factor, in the order of the factors."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What is seen together.

    Attributes:
        block: Who sees it: a block, version or respondent of the design; "1" if there is one.
        task: The name of the choice task within its block.
        alternatives: The profiles to look at, in order; None offers to choose nothing.
    """

    block: str
    task: str
    alternatives: tuple[Profile | None, ...]


Ranks = Sequence[Mapping[str, int] | None]
"""How good each level of each factor is; None where people differ."""


def dominated(trial: Trial, ranks: Ranks) -> tuple[int, ...]:
    """Return the places, from 1, of alternatives that nobody would choose: another one is better.

    Args:
        trial: The alternatives.
        ranks: In the order of the factors; where people differ, the levels must be the same.
    """
    shown = [(n, each) for n, each in enumerate(trial.alternatives, 1) if each is not None]
    return tuple(
        place for place, one in shown if any(_is_better(other, one, ranks) for _, other in shown)
    )


def _is_better(one: Profile, other: Profile, ranks: Ranks) -> bool:
    """Return whether a profile is better in something and worse in nothing."""
    gains = []
    for here, there, rank in zip(one, other, ranks, strict=True):
        if rank is None and here != there:
            return False
        gains.append(0 if rank is None else rank[here] - rank[there])
    return min(gains) >= 0 and max(gains) > 0


def single_trials(profiles: Iterable[Profile]) -> tuple[Trial, ...]:
    """Return a trial for each profile, in one block."""
    return tuple(
        Trial("1", str(number), (profile,)) for number, profile in enumerate(profiles, start=1)
    )


def profiles_of(trials: Iterable[Trial]) -> tuple[Profile, ...]:
    """Return all profiles that trials show, each once, in the order of their first showing."""
    shown = (profile for trial in trials for profile in trial.alternatives)
    return tuple(dict.fromkeys(profile for profile in shown if profile is not None))


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
        groups = [
            " x ".join(factors[place] for place in some)
            for some in combinations(range(len(factors)), size)
            if _apart(of, _marked(whole, some), len(parts)).any()
        ]
        if groups:
            return groups
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
    digits, owners = [np.zeros((len(profiles), 0), dtype=np.int64)], []
    for factor, column in enumerate(zip(*profiles, strict=True)):
        names = list(dict.fromkeys(column))
        power = prime_power(len(names))
        if power is None or power[0] != prime:
            continue
        numbers = np.array([names.index(name) for name in column], dtype=np.int64)
        digits.append(numbers[:, None] // prime ** np.arange(power[1]) % prime)
        owners += [factor] * power[1]
    return np.hstack(digits), owners


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


Order = Literal["latin", "random", "as_written"]

MOST_PLAYLISTS = 10_000
"""Most playlists of a study."""

MOST_BALANCED = 1000
"""Most trials of a block whose orders are balanced: the square has as many rows, or twice."""

MOST_SHOWN = 2_000_000
"""Most trials that all playlists show together."""


TURNED = "~"
"""Stands between a task's name and by how many places its films were turned."""


@dataclass(frozen=True, slots=True)
class Playlist:
    """What one participant, or one group of them, sees.

    Attributes:
        name: From "1" on.
        block: Of its trials; with several parts, the block and the part, such as "1.2".
        trials: In order; a trial may come again.
    """

    name: str
    block: str
    trials: tuple[Trial, ...]


def build_playlists(
    trials: Sequence[Trial],
    *,
    order: Order,
    count: int | None,
    parts: int,
    repeat: int,
    seed: int,
) -> tuple[Playlist, ...]:
    """Return playlists in which orders are counterbalanced.

    Args:
        trials: Of all blocks.
        order: `latin` shows every trial at every position, and after every other, equally often;
            `random` shuffles each playlist; `as_written` keeps the design's order.
        count: How many; None is what the order needs.
        parts: Into how many groups each block's trials are shared out, as evenly as can be.
        repeat: How often each trial is shown; all of them once before any again.
        seed: The study's.

    Raises:
        ConfigError: If there are fewer playlists than groups, fewer trials than parts, or too many.
    """
    groups = _groups(trials, parts, seed)
    _check_balanced(groups, order)
    turns = _turns(groups, order, count)
    _check_shown(sum(repeat * len(groups[block]) for block, _ in turns))
    orders = {
        block: _Orders(order, tuple(own), block=block, seed=seed) for block, own in groups.items()
    }
    return tuple(
        Playlist(str(number), block, orders[block].rounds(turn, repeat))
        for number, (block, turn) in enumerate(turns, start=1)
    )


def with_even_places(
    playlists: Sequence[Playlist], *, count: int | None, seed: int
) -> tuple[Playlist, ...]:
    """Return playlists in which every film of a task stands at every place equally often.

    Each order comes as often as a task has films. Half of a playlist's tasks of two films are
    turned, and in its twin the other half; so no place goes with a position, a level or a person.

    Args:
        playlists: In which tasks are as the design has them.
        count: How many are wanted; None is all.
        seed: The study's.

    Raises:
        ConfigError: If these are too many.
    """
    times = most_placed([trial for playlist in playlists for trial in playlist.trials])
    wanted = len(playlists) * times if count is None else count
    if wanted > MOST_PLAYLISTS:
        raise ConfigError(
            f"balanced places need {wanted:,} playlists, and at most {MOST_PLAYLISTS:,} are made;"
            " say how many",
            key="playlists.count",
        )
    even: list[Playlist] = []
    for playlist in playlists:
        own = list(dict.fromkeys(playlist.trials))
        mixed = permutation(len(own), seed, "places", playlist.name)
        steps = {own[n]: place for place, n in enumerate(mixed)}
        for turn in range(times):
            trials = tuple(_turned(trial, steps[trial] + turn) for trial in playlist.trials)
            even.append(Playlist(str(len(even) + 1), playlist.block, trials))
    return tuple(even[:wanted])


def most_placed(trials: Sequence[Trial]) -> int:
    """Return the most films that a trial has side by side; to choose nothing stays last."""
    return max(sum(profile is not None for profile in trial.alternatives) for trial in trials)


def _turned(trial: Trial, steps: int) -> Trial:
    """Return a trial whose films have changed places; it has a name of its own.

    Args:
        trial: As the design has it.
        steps: By how many places each film moves to the front, round and round.
    """
    films = [profile for profile in trial.alternatives if profile is not None]
    steps %= len(films)
    if not steps:
        return trial
    moved = iter([*films[steps:], *films[:steps]])
    places = tuple(None if each is None else next(moved) for each in trial.alternatives)
    return Trial(trial.block, f"{trial.task}{TURNED}{steps}", places)


def uneven_groups(playlists: Sequence[Playlist]) -> list[str]:
    """Return the groups in which trials do not stand at all positions equally often.

    A trial whose films have changed places is the same.
    """
    counts: dict[str, Counter[tuple[int, str]]] = {}
    for playlist in playlists:
        tasks = [trial.task.rpartition(TURNED)[0] or trial.task for trial in playlist.trials]
        counts.setdefault(playlist.block, Counter()).update(enumerate(tasks))
    groups = []
    for block, times in counts.items():
        positions, there = ({*each} for each in zip(*times, strict=True))
        if len(times) != len(positions) * len(there) or len({*times.values()}) > 1:
            groups.append(block)
    return groups


_Groups = dict[str, list[Trial]]
"""Trials by the name of who sees them."""


def _turns(groups: _Groups, order: Order, count: int | None) -> list[tuple[str, int]]:
    """Return for each playlist its group, and how many playlists that group had before."""
    if count is None:
        needed = {block: _needed(order, len(own)) for block, own in groups.items()}
        if sum(needed.values()) > MOST_PLAYLISTS:
            raise ConfigError(
                f"the order needs {sum(needed.values()):,} playlists, and at most"
                f" {MOST_PLAYLISTS:,} are made; say how many",
                key="playlists.count",
            )
        return [(block, turn) for block, turns in needed.items() for turn in range(turns)]
    if count < len(groups):
        raise ConfigError(
            f"the design has {len(groups)} blocks, and each needs a playlist, not {count} in all",
            key="playlists.count",
        )
    names = list(groups)
    return [(names[n % len(names)], n // len(names)) for n in range(count)]


def _check_balanced(groups: _Groups, order: Order) -> None:
    """Refuse squares that no study could show."""
    block, most = max(((name, len(own)) for name, own in groups.items()), key=lambda each: each[1])
    if order == "latin" and most > MOST_BALANCED:
        raise ConfigError(
            f"block {block} has {most:,} trials, and orders of at most {MOST_BALANCED:,} are"
            " balanced; share them out by playlists.parts, or write order: random and count",
            key="playlists.order",
        )


def _check_shown(count: int) -> None:
    """Refuse more trials than any study shows."""
    if count > MOST_SHOWN:
        raise ConfigError(
            f"all playlists together show {count:,} trials, and at most {MOST_SHOWN:,} are"
            " written; write a smaller playlists.count or repeat, or more parts",
            key="playlists.count",
        )


def _needed(order: Order, count: int) -> int:
    """Return how many playlists an order of some trials takes."""
    if order == "as_written":
        return 1
    return len(balanced_orders(count)) if order == "latin" else count


def _groups(trials: Sequence[Trial], parts: int, seed: int) -> _Groups:
    """Return the trials of each block, shared out into parts."""
    blocks: _Groups = {}
    for trial in trials:
        blocks.setdefault(trial.block, []).append(trial)
    if parts == 1:
        return blocks
    groups: _Groups = {}
    for name, own in blocks.items():
        if len(own) < parts:
            raise ConfigError(
                f"block {name} has {len(own)} trials, fewer than parts ({parts})",
                key="playlists.parts",
            )
        some = shared_out(own, parts, seed=seed, block=name)
        groups |= {f"{name}.{number}": part for number, part in enumerate(some, start=1)}
    return groups


class _Orders:
    """The orders in which one group's trials are shown."""

    def __init__(self, order: Order, own: tuple[Trial, ...], *, block: str, seed: int) -> None:
        self._order, self._own, self._block, self._seed = order, own, block, seed
        # Which trial is which in the square is left to chance.
        self._names = permutation(len(own), seed, "square", block)
        self._square = balanced_orders(len(own)) if order == "latin" else []

    def rounds(self, turn: int, repeat: int) -> tuple[Trial, ...]:
        """Return all trials of a playlist, each as often as it is repeated."""
        return tuple(trial for again in range(repeat) for trial in self._round(turn, again))

    def _round(self, turn: int, again: int) -> Sequence[Trial]:
        """Return all trials once."""
        if self._order == "as_written":
            return self._own
        if self._order == "random":
            words = ("playlist", self._block, str(turn), str(again))
            return shuffled(self._own, self._seed, *words)
        row = self._square[(turn + again) % len(self._square)]
        return [self._own[self._names[place]] for place in row]
