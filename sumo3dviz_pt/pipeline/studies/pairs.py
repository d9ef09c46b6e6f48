"""Pairs of stimuli that are compared, the factors in which they should differ, and their scenes.

Where films differ in one factor alone, all such pairs are compared. A fraction, a Latin square or a
choice table may have none: then pairs that differ in as few factors as can be tie all films
together, and every factor is judged twice at least, where the design allows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from sumo3dviz_pt.experiments.trials import Levels, Profile
from sumo3dviz_pt.pipeline.accounts.differences import differences
from sumo3dviz_pt.pipeline.accounts.provenance import short_names, with_files
from sumo3dviz_pt.pipeline.gaps import as_moved
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus

Places = Mapping[str, int]
"""Where factors stand in profiles, of those that change a picture."""

_TIMES = 2
"""How often each factor is judged at least, where the design has so many pairs."""


@dataclass(frozen=True, slots=True)
class StimulusPair:
    """Two films that should differ in their factors only.

    Attributes:
        factor: Name of the factor in which they differ; of several, with `and` between them.
        levels: Of the first and the second.
        one: The first film's name.
        other: The second's.
        changed: What differs in their scenes, key by key.
        acting: The same, rides under the id of the one that is moved for them.
        factors: Names of the factors in which they differ, one by one.
    """

    factor: str
    levels: tuple[str, str]
    one: str
    other: str
    changed: tuple[str, ...]
    acting: tuple[str, ...]
    factors: tuple[str, ...]


def pairs_of(
    levels: Levels, stimuli: Sequence[Stimulus], *, told: Collection[str] = ()
) -> tuple[StimulusPair, ...]:
    """Return the pairs of films that are compared, by factor and levels.

    Args:
        levels: Of each factor, in the order of the profiles.
        stimuli: All films.
        told: Factors that change no picture.
    """
    places = {name: n for n, name in enumerate(levels) if name not in told}
    film = {profile: stimulus for stimulus in stimuli for profile in stimulus.profiles}
    found: dict[tuple[str, str, str], StimulusPair] = {}
    for factor, place in places.items():
        order = {level: n for n, level in enumerate(levels[factor])}
        for pair in _neighbours(list(film), place):
            one, other = _in_order(pair, place, order)
            key = (factor, film[one].name, film[other].name)
            if film[one] is not film[other] and key not in found:
                found[key] = _pair(places, film, one, other)
    alone = tuple(found.values())
    return alone + tuple(_pair(places, film, *pair) for pair in _tying(places, film, alone))


def possible_pairs(stimuli: Sequence[Stimulus]) -> int:
    """Return how many pairs of films there are."""
    return len(stimuli) * (len(stimuli) - 1) // 2


def _pair(
    places: Places, film: Mapping[Profile, Stimulus], one: Profile, other: Profile
) -> StimulusPair:
    """Return the pair of two profiles' films."""
    factors = _differing(places, one, other)
    words = tuple(
        " and ".join(profile[place] for place in factors.values()) for profile in (one, other)
    )
    first, second = film[one], film[other]
    changed = changes(first, second)
    return StimulusPair(
        " and ".join(factors),
        (words[0], words[1]),
        first.name,
        second.name,
        tuple(changed),
        tuple(as_moved(change, (first.job, second.job)) for change in changed),
        tuple(factors),
    )


def _differing(places: Places, one: Profile, other: Profile) -> dict[str, int]:
    """Return in which factors two profiles differ, and their places."""
    return {name: n for name, n in places.items() if one[n] != other[n]}


def _tying(
    places: Places, film: Mapping[Profile, Stimulus], pairs: Sequence[StimulusPair]
) -> list[tuple[Profile, Profile]]:
    """Return pairs, the nearest first, that tie all films together and judge each factor twice.

    Args:
        places: Of factors in profiles.
        film: By profile.
        pairs: That are compared already.
    """
    groups = {each.name: each.name for each in film.values()}
    known, times = {frozenset((pair.one, pair.other)) for pair in pairs}, Counter[str]()
    for pair in pairs:
        times.update(pair.factors)
        groups[_root(groups, pair.one)] = _root(groups, pair.other)
    chosen = []
    for only_ties in (True, False):
        if all(times[name] >= _TIMES for name in places) and _is_one(groups):
            break
        for one, other in _by_distance(list(film), list(places.values())):
            names, own = (film[one].name, film[other].name), _differing(places, one, other)
            first, second = (_root(groups, name) for name in names)
            few = not only_ties and any(times[name] < _TIMES for name in own)
            if frozenset(names) not in known and (first != second or few):
                known.add(frozenset(names))
                times.update(list(own))
                groups[first] = second
                chosen.append((one, other))
    return chosen


def _root(groups: Mapping[str, str], name: str) -> str:
    """Return the film that stands for all that a film is tied to."""
    while groups[name] != name:
        name = groups[name]
    return name


def _is_one(groups: Mapping[str, str]) -> bool:
    """Return whether all films are tied together."""
    return len({_root(groups, name) for name in groups}) <= 1


def _by_distance(
    profiles: Sequence[Profile], places: Sequence[int]
) -> Iterator[tuple[Profile, Profile]]:
    """Yield all pairs of profiles, those that differ in the fewest factors first."""
    table = np.array(profiles)[:, places]
    far = [(table[n + 1 :] != table[n]).sum(axis=1) for n in range(len(table) - 1)]
    if not far:
        return
    ends = np.array(list(combinations(range(len(table)), 2)))
    for one, other in ends[np.argsort(np.concatenate(far), kind="stable")].tolist():
        yield profiles[one], profiles[other]


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
