"""Choice tasks that tell effects apart as well as can be, none with an alternative that is best.

A design begins by chance; then each film of each task is exchanged for the one that makes the
D-error least, again and again, until nothing gets better. An exchange counts only if it makes the
design better by far more than processors differ in, so that all of them find the same tasks.

References:
    R. D. Cook, C. J. Nachtsheim (1980): A comparison of algorithms for constructing exact D-optimal
    designs, Technometrics 22(3), 315-324; doi:10.1080/00401706.1980.10486162
    K. Zwerina, J. Huber, W. Kuhfeld (1996): A general method for constructing efficient choice
    designs
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice, product
from math import comb

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.designs.build import Exclusions, is_excluded
from sumo3dviz_pt.experiments.designs.efficiency import Priors, coded, information, utilities
from sumo3dviz_pt.experiments.shuffles import permutation
from sumo3dviz_pt.experiments.trials import Levels, Profile, Trial

Floats = NDArray[np.float64]
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
    search = _Search(levels, profiles, request)
    search.check()
    found = [search.found(seed, start) for start in range(_STARTS)]
    best = max(range(_STARTS), key=lambda n: (round(found[n][0], 5), -n))
    if not np.isfinite(found[best][0]):
        raise ConfigError(
            f"{request.tasks} tasks of {request.alternatives} films cannot tell all effects apart;"
            " ask for more tasks",
            key="choices.tasks",
        )
    order = permutation(request.tasks, seed, "order of tasks")
    none = (None,) if request.none else ()
    tasks = ([profiles[n] for n in found[best][1][place]] for place in order)
    return tuple(Trial("1", str(n), (*own, *none)) for n, own in enumerate(tasks, start=1))


def _candidates(levels: Levels, exclude: Exclusions, seed: int) -> list[Profile]:
    """Return profiles that tasks may be made of."""
    every = islice(product(*levels.values()), _MOST_PROFILES)
    kept = [own for own in every if not is_excluded(own, levels, exclude)]
    if not kept:
        raise ConfigError("nothing is left: every profile is excluded", key="exclude")
    drawn = sorted(permutation(len(kept), seed, "candidates")[:_MOST_CANDIDATES])
    return [kept[n] for n in drawn]


class _Search:
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

    def found(self, seed: int, start: int) -> tuple[float, list[list[int]]]:
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
