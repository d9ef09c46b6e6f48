"""Pairs of stimuli that should differ in one factor, and what differs in their scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from sumo3dviz_pt.experiments.trials import Levels, Profile
from sumo3dviz_pt.pipeline.accounts.differences import differences
from sumo3dviz_pt.pipeline.accounts.provenance import short_names, with_files
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus


@dataclass(frozen=True, slots=True)
class StimulusPair:
    """Two films that should differ in one factor only.

    Attributes:
        factor: Its name.
        levels: Of the first and the second.
        one: The first film's name.
        other: The second's.
        changed: What differs in their scenes, key by key.
    """

    factor: str
    levels: tuple[str, str]
    one: str
    other: str
    changed: tuple[str, ...]


def pairs_of(levels: Levels, stimuli: Sequence[Stimulus]) -> tuple[StimulusPair, ...]:
    """Return all pairs of films whose profiles differ in one factor, by factor and levels.

    Args:
        levels: Of each factor, in the order of the profiles.
        stimuli: All films.
    """
    film = {profile: stimulus for stimulus in stimuli for profile in stimulus.profiles}
    found: dict[tuple[str, str, str], StimulusPair] = {}
    for place, factor in enumerate(levels):
        order = {level: n for n, level in enumerate(levels[factor])}
        for pair in _neighbours(list(film), place):
            one, other = _in_order(pair, place, order)
            first, second = film[one], film[other]
            key = (factor, first.name, second.name)
            if first is second or key in found:
                continue
            found[key] = StimulusPair(
                factor,
                (one[place], other[place]),
                first.name,
                second.name,
                tuple(changes(first, second)),
            )
    return tuple(found.values())


def changes(one: Stimulus, other: Stimulus) -> list[str]:
    """Return what differs in the scenes of two films, key by key."""
    files = short_names(path for each in (one, other) for path in _files(each))
    first, second = (
        {"scene": with_files(each.job.model_dump(by_alias=True), files.__getitem__)}
        for each in (one, other)
    )
    return differences(first, second)


def _files(stimulus: Stimulus) -> list[Path]:
    """Return the files that a scene names."""
    found: dict[Path, None] = {}
    with_files(stimulus.job.model_dump(by_alias=True), lambda path: found.setdefault(path))
    return list(found)


def _neighbours(profiles: Sequence[Profile], place: int) -> list[tuple[Profile, Profile]]:
    """Return all pairs of profiles that differ at one place and nowhere else."""
    alike: dict[Profile, list[Profile]] = {}
    for profile in profiles:
        alike.setdefault((*profile[:place], *profile[place + 1 :]), []).append(profile)
    return [pair for some in alike.values() for pair in combinations(some, 2)]


def _in_order(
    pair: tuple[Profile, Profile], place: int, order: Mapping[str, int]
) -> tuple[Profile, Profile]:
    """Return the profile with the earlier level first."""
    one, other = pair
    return pair if order[one[place]] < order[other[place]] else (other, one)
