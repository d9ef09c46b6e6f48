"""Makes designs: profiles in an order, and choice tasks that tell effects apart.

Profiles that cannot be are left out. How well a design tells effects apart is said by associations
of factors, and by the D-error of choices.

Choice tasks tell effects apart as well as can be, and in none is one alternative best. A design
begins by chance; then each film of each task is exchanged for the one that makes the D-error least,
again and again, until nothing gets better. An exchange counts only if it makes the design better by
far more than processors differ in, so that all of them find the same tasks.

References:
    H. Cramer (1946): Mathematical Methods of Statistics, chapter 21 (V)
    D. McFadden (1974): Conditional logit analysis of qualitative choice behavior
    J. Huber, K. Zwerina (1996): The importance of utility balance in efficient choice designs,
    Journal of Marketing Research 33(3), 307-317; doi:10.1177/002224379603300305 (D-error)
    R. D. Cook, C. J. Nachtsheim (1980): A comparison of algorithms for constructing exact D-optimal
    designs, Technometrics 22(3), 315-324; doi:10.1080/00401706.1980.10486162
    K. Zwerina, J. Huber, W. Kuhfeld (1996): A general method for constructing efficient choice
    designs
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, islice, product
from math import comb, prod
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.designs.arrays import (
    Rows,
    confounded_pairs,
    hidden_in_words,
    latin_square,
    orthogonal_array,
    pair_counts,
)
from sumo3dviz_pt.studies.designs.trials import Levels, Profile, Trial, permutation

MOST_PROFILES = 1000
"""Most profiles of a design."""

Exclusions = Sequence[Mapping[str, Sequence[str]]]
"""Combinations that cannot be: of each factor that is named, one of the levels."""


@dataclass(frozen=True, slots=True)
class Design:
    """Which profiles are shown.

    Attributes:
        profiles: In the order in which the design was shuffled.
        excluded: How many were left out as they cannot be.
        notes: What a reader of the data should know of it, in sentences.
    """

    profiles: tuple[Profile, ...]
    excluded: int = 0
    notes: tuple[str, ...] = ()


def _full(counts: Sequence[int]) -> Rows:
    """Return all combinations, (runs, factors)."""
    return np.array(list(product(*map(range, counts))), dtype=np.int64)


KINDS: Mapping[str, Callable[[Sequence[int]], Rows]] = MappingProxyType(
    {
        "full": _full,
        "fraction": orthogonal_array,
        "fraction_3": partial(orthogonal_array, strength=3),
        "latin": latin_square,
    }
)
"""Designs that are made here, by their names in study files."""


def build_design(kind: str, levels: Levels, *, exclude: Exclusions, seed: int) -> Design:
    """Return a design of some factors.

    The seed chooses which fraction or square of equal worth is taken, and the order.

    Args:
        kind: A name from `KINDS`.
        levels: Of each factor.
        exclude: What cannot be.
        seed: The study's.

    Raises:
        ConfigError: If there is no such design, it is too large or nothing is left of it.
    """
    counts = [len(names) for names in levels.values()]
    if kind == "full" and prod(counts) > MOST_PROFILES:
        raise ConfigError(
            f"all combinations are {prod(counts):,} profiles, and a design has at most"
            f" {MOST_PROFILES:,}; write design: fraction",
            key="design",
        )
    rows = _relabelled(KINDS[kind](counts), levels, seed)
    whole = len(rows)
    out = [is_excluded(_profile(row, levels), levels, exclude) for row in rows]
    if all(out):
        raise ConfigError("nothing is left: every profile is excluded", key="exclude")
    rows = rows[~np.array(out)]
    ordered = rows[permutation(len(rows), seed, "order of profiles")]
    profiles = tuple(_profile(row, levels) for row in ordered)
    return Design(profiles, whole - len(rows), tuple(_notes(rows, levels, whole - len(rows))))


def is_excluded(profile: Profile, levels: Levels, exclude: Exclusions) -> bool:
    """Return whether a profile cannot be.

    Args:
        profile: A level of each factor.
        levels: Of each factor.
        exclude: What cannot be.
    """
    named = dict(zip(levels, profile, strict=True))
    return any(
        all(named[factor] in some for factor, some in combination.items())
        for combination in exclude
    )


def _relabelled(rows: Rows, levels: Levels, seed: int) -> Rows:
    """Return rows in which each factor's levels changed places, as the seed says."""
    columns = [
        np.array(permutation(len(names), seed, "levels", factor))[rows[:, place]]
        for place, (factor, names) in enumerate(levels.items())
    ]
    return np.stack(columns, axis=1)


def _profile(row: Rows, levels: Levels) -> Profile:
    """Return a row's levels by name."""
    return tuple(names[int(n)] for n, names in zip(row, levels.values(), strict=True))


def _notes(rows: Rows, levels: Levels, gone: int) -> list[str]:
    """Return what a design confounds, by itself or by its exclusions."""
    if not gone:
        return hidden_in_words(rows, levels)
    names = list(levels)
    notes = []
    for factor, some in zip(names, rows.T, strict=True):
        missing = [name for n, name in enumerate(levels[factor]) if n not in some]
        notes += [f"no profile that is left has {factor} {name}" for name in missing]
    pairs = confounded_pairs(rows, [len(some) for some in levels.values()])
    if pairs:
        words = ", ".join(f"{names[one]} with {names[other]}" for one, other in pairs[:3])
        more = f" and {len(pairs) - 3} more pairs" if len(pairs) > 3 else ""
        notes.append(f"with the exclusions the design confounds {words}{more}")
    return notes + hidden_in_words(rows, levels)


_SEEN = 0.005
"""Least association that two digits show."""

Floats = NDArray[np.float64]
Priors = Mapping[str, Mapping[str, float]]
"""Utility of levels by factor; 0 where nothing is said."""


def associations(levels: Levels, trials: Sequence[Trial]) -> Floats:
    """Return Cramer's V of any two factors, (factors, factors): 0 for none, 1 for the same.

    Args:
        levels: Of each factor.
        trials: Each alternative of each counts once.
    """
    counts = [len(names) for names in levels.values()]
    numbers = _numbers(levels, [p for trial in trials for p in trial.alternatives if p is not None])
    table = np.eye(len(counts))
    for one, other in combinations(range(len(counts)), 2):
        times = pair_counts(numbers, counts, one, other).astype(float)
        times = times[times.sum(axis=1) > 0][:, times.sum(axis=0) > 0]
        even = np.outer(times.sum(axis=1), times.sum(axis=0)) / times.sum()
        least = min(times.shape) - 1
        chi = float(((times - even) ** 2 / even).sum())
        table[one, other] = table[other, one] = np.sqrt(chi / times.sum() / least) if least else 0.0
    return table


def coded(levels: Levels, profiles: Sequence[Profile]) -> Floats:
    """Return profiles in effects codes, (profiles, sum of levels - 1): the last level is all -1."""
    numbers = _numbers(levels, profiles)
    columns = [
        np.vstack([np.eye(len(names) - 1), -np.ones(len(names) - 1)])[numbers[:, place]]
        for place, names in enumerate(levels.values())
    ]
    return np.hstack(columns)


def utilities(levels: Levels, profiles: Sequence[Profile], priors: Priors) -> Floats:
    """Return the utility of each factor's level in each profile, (profiles, factors)."""
    return np.array(
        [
            [priors.get(name, {}).get(level, 0.0) for name, level in zip(levels, own, strict=True)]
            for own in profiles
        ]
    )


def information(codes: Floats, worth: Floats, *, none: bool) -> Floats:
    """Return Fisher's information of choice tasks in a conditional logit model, (..., K, K).

    Args:
        codes: Of the films of each task, (..., alternatives, K).
        worth: Their utilities, (..., alternatives).
        none: Whether nothing may be chosen, too: of utility 0, and with a constant of its own.
    """
    if none:
        ones = np.ones((*codes.shape[:-1], 1))
        codes = np.concatenate([codes, ones], axis=-1)
    odds = np.exp(worth - worth.max(axis=-1, keepdims=True))
    nothing = np.exp(-worth.max(axis=-1)) if none else 0.0
    shares = odds / (odds.sum(axis=-1) + nothing)[..., None]
    mean = np.einsum("...j,...jk->...k", shares, codes)
    whole = np.einsum("...j,...jk,...jl->...kl", shares, codes, codes)
    return np.asarray(whole - mean[..., :, None] * mean[..., None, :])


def d_error(levels: Levels, trials: Sequence[Trial], priors: Priors | None = None) -> float:
    """Return the D-error of choice tasks for one person who sees all of them; less is better.

    It is the K-th root of the determinant of the estimates' covariance, in effects codes; infinite
    where some effect cannot be told.

    Args:
        levels: Of each factor.
        trials: With two alternatives or more, one of which may be to choose nothing.
        priors: Utilities that are assumed.
    """
    whole: Floats | float = 0.0
    for trial in trials:
        films = [profile for profile in trial.alternatives if profile is not None]
        worth = utilities(levels, films, priors or {}).sum(axis=1)
        none = None in trial.alternatives
        whole = whole + information(coded(levels, films), worth, none=none)
    matrix = np.asarray(whole)
    sign, log = np.linalg.slogdet(matrix)
    if sign <= 0 or np.linalg.cond(matrix) > 1e12:
        return float("inf")
    return float(np.exp(-log / len(matrix)))


def in_words(levels: Levels, trials: Sequence[Trial], priors: Priors | None = None) -> list[str]:
    """Return lines about a design: the associations of its factors, and its D-error.

    Args:
        levels: Of each factor.
        trials: All of them.
        priors: Utilities that are assumed.
    """
    table = associations(levels, trials)
    lines = ["association of factors (Cramer's V: 0 none, 1 the same)"]
    if (table - np.eye(len(table)) < _SEEN).all():
        lines.append("  0 for any two of them")
    else:
        names = [name[:14] for name in levels]
        lines.append(f"  {'':<14} " + " ".join(f"{name:>14}" for name in names))
        for name, row in zip(names, table, strict=True):
            lines.append(f"  {name:<14} " + " ".join(f"{value:>14.2f}" for value in row))
    error = error_in_words(levels, trials, priors)
    return [*lines, *([f"  {error}"] if error else [])]


def error_in_words(levels: Levels, trials: Sequence[Trial], priors: Priors | None = None) -> str:
    """Return the D-error of a design's choice tasks in words; empty if it has none.

    Args:
        levels: Of each factor.
        trials: All of them.
        priors: Utilities that are assumed.
    """
    choices = [trial for trial in trials if len(trial.alternatives) > 1]
    if not choices or len({None in trial.alternatives for trial in choices}) > 1:
        return ""
    error = d_error(levels, choices, priors)
    basis = "the priors" if priors else "utilities of 0"
    efficiency = "not all effects can be told" if np.isinf(error) else f"D-error {error:.4g}"
    return f"{efficiency}, for {basis}, by one who sees all {len(choices)} tasks"


def _numbers(levels: Levels, profiles: Sequence[Profile]) -> NDArray[np.int64]:
    """Return the number of each factor's level, (profiles, factors)."""
    places = [{name: n for n, name in enumerate(names)} for names in levels.values()]
    ranks = [[own[level] for own, level in zip(places, p, strict=True)] for p in profiles]
    return np.array(ranks, dtype=np.int64)


Pairs = NDArray[np.bool_]

_MOST_CANDIDATES = 400
"""Profiles that tasks are made of; of more, as many are drawn."""

_MOST_PROFILES = 200_000
_GAIN = 1.0e-6
"""Least gain of the determinant's logarithm; processors differ by less than a billionth of that."""

_STARTS, _SWEEPS = 6, 20


@dataclass(frozen=True, slots=True)
class ChoiceRequest:
    """Which choice tasks are wanted.

    Attributes:
        tasks: How many.
        alternatives: Films in each.
        none: Whether nothing may be chosen, too.
        priors: Utilities of levels.
        ranks: How good levels are, where there are no priors; they count for what is best alone.
    """

    tasks: int
    alternatives: int = 2
    none: bool = False
    priors: Priors = field(default_factory=dict)
    ranks: Priors = field(default_factory=dict)


def choice_tasks(
    levels: Levels, request: ChoiceRequest, *, exclude: Exclusions, seed: int
) -> tuple[Trial, ...]:
    """Return choice tasks; no film is in one twice, and none is better than another in all factors.

    Args:
        levels: Of each factor.
        request: Which tasks are wanted.
        exclude: What cannot be.
        seed: The study's: it chooses where the search begins, and the order.

    Raises:
        ConfigError: If there are too few different tasks, or some effect cannot be told by any.
    """
    profiles = _candidates(levels, exclude, seed)
    search = _TaskSearch(levels, profiles, request)
    search.check()
    designs = [search.improved(seed, start) for start in range(_STARTS)]
    best = max(range(_STARTS), key=lambda n: (round(designs[n][0], 5), -n))
    if not np.isfinite(designs[best][0]):
        raise ConfigError(
            f"{request.tasks} tasks of {request.alternatives} films cannot tell all effects apart;"
            " ask for more tasks",
            key="choices.tasks",
        )
    order = permutation(request.tasks, seed, "order of tasks")
    none = (None,) if request.none else ()
    tasks = ([profiles[n] for n in designs[best][1][place]] for place in order)
    return tuple(Trial("1", str(n), (*own, *none)) for n, own in enumerate(tasks, start=1))


def _candidates(levels: Levels, exclude: Exclusions, seed: int) -> list[Profile]:
    """Return profiles that tasks may be made of."""
    every = islice(product(*levels.values()), _MOST_PROFILES)
    allowed = [own for own in every if not is_excluded(own, levels, exclude)]
    if not allowed:
        raise ConfigError("nothing is left: every profile is excluded", key="exclude")
    drawn = sorted(permutation(len(allowed), seed, "candidates")[:_MOST_CANDIDATES])
    return [allowed[n] for n in drawn]


class _TaskSearch:
    """A search for tasks with the largest determinant of their information."""

    def __init__(self, levels: Levels, profiles: Sequence[Profile], request: ChoiceRequest) -> None:
        self._request = request
        worth = utilities(levels, profiles, request.priors)
        self._codes, self._worth = coded(levels, profiles), worth.sum(axis=1)
        known = {**request.ranks, **{name: own for name, own in request.priors.items() if own}}
        self._clash = _dominated(levels, profiles, utilities(levels, profiles, known))
        np.fill_diagonal(self._clash, val=True)

    def check(self) -> None:
        """Refuse what has too few different tasks."""
        pairs = int((~self._clash).sum()) // 2
        films = self._request.alternatives
        most = pairs if films == 2 else comb(len(self._worth), films)
        if most < self._request.tasks:
            raise ConfigError(
                f"only {most} different tasks of {films} films have no film that is best in all"
                f" factors, and {self._request.tasks} are asked for",
                key="choices.tasks",
            )

    def improved(self, seed: int, start: int) -> tuple[float, list[list[int]]]:
        """Return the logarithm of the determinant, and the profiles of each task."""
        tasks = self._begun(seed, start)
        worth = -np.inf
        for _ in range(_SWEEPS):
            before = worth
            for place in range(len(tasks)):
                for film in range(self._request.alternatives):
                    worth = self._exchanged(tasks, place, film)
            if worth <= before + _GAIN:
                break
        return worth, tasks

    def _begun(self, seed: int, start: int) -> list[list[int]]:
        """Return tasks by chance."""
        tasks: list[list[int]] = []
        for turn in range(50 * self._request.tasks):
            own: list[int] = []
            for n in permutation(len(self._worth), seed, "choices", str(start), str(turn)):
                if len(own) < self._request.alternatives and not self._clash[n, own].any():
                    own.append(n)
            if len(own) == self._request.alternatives and {*own} not in map(set, tasks):
                tasks.append(own)
            if len(tasks) == self._request.tasks:
                return tasks
        raise ConfigError(
            f"no {self._request.tasks} different tasks were found in which no film is best in all"
            " factors; ask for fewer, or for fewer films in each",
            key="choices.tasks",
        )

    def _exchanged(self, tasks: list[list[int]], place: int, film: int) -> float:
        """Exchange a film for the best one, if that gains; return the determinant's logarithm."""
        every = np.arange(len(self._worth))
        own = np.tile(tasks[place], (len(every), 1))
        own[:, film] = every
        rest = [task for n, task in enumerate(tasks) if n != place]
        whole = self._information(own)
        if rest:
            whole = whole + self._information(np.array(rest)).sum(axis=0)
        signs, logs = np.linalg.slogdet(whole)
        worth = np.where((signs > 0) & (logs > -50.0), logs, -np.inf)
        now = float(worth[tasks[place][film]])
        others = np.delete(np.array(tasks[place]), film)
        worth = np.where(self._clash[:, others].any(axis=1), -np.inf, worth)
        known = [{*task} for task in rest]
        for n in np.argsort(-np.round(worth, 5), kind="stable")[: len(tasks) + 1].tolist():
            if worth[n] <= now + _GAIN or not np.isfinite(worth[n]):
                break
            if {*others.tolist(), n} not in known:
                tasks[place][film] = n
                return float(worth[n])
        return now

    def _information(self, tasks: NDArray[np.int64]) -> Floats:
        """Return the information of tasks, each for itself, (tasks, K, K)."""
        return information(self._codes[tasks], self._worth[tasks], none=self._request.none)


def _dominated(levels: Levels, profiles: Sequence[Profile], worth: Floats) -> Pairs:
    """Return of which two profiles one is as good as the other in all factors, and better in some.

    Factors of which nothing is known tell nothing: two films that differ in one are a choice.

    Args:
        levels: Of each factor.
        profiles: Of which tasks are made.
        worth: How good their levels are, (profiles, factors).
    """
    shape = (len(profiles), len(profiles))
    least, more, silent = np.ones(shape, bool), np.zeros(shape, bool), np.ones(shape, bool)
    for place, names in enumerate(levels.values()):
        own = worth[:, place]
        if own.any():
            least &= own[:, None] >= own[None, :]
            more |= own[:, None] > own[None, :]
        else:
            numbers = np.array([list(names).index(profile[place]) for profile in profiles])
            silent &= numbers[:, None] == numbers[None, :]
    better = least & more & silent
    return np.asarray(better | better.T)
