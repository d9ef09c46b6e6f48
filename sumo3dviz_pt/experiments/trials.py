"""Values of an experiment: profiles, and the trials in which people see them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

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
