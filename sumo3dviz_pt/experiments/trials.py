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


def single_trials(profiles: Iterable[Profile]) -> tuple[Trial, ...]:
    """Return a trial for each profile, in one block."""
    return tuple(
        Trial("1", str(number), (profile,)) for number, profile in enumerate(profiles, start=1)
    )


def profiles_of(trials: Iterable[Trial]) -> tuple[Profile, ...]:
    """Return all profiles that trials show, each once, in the order of their first showing."""
    shown = (profile for trial in trials for profile in trial.alternatives)
    return tuple(dict.fromkeys(profile for profile in shown if profile is not None))
