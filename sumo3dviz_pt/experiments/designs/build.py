"""Makes a design: profiles in an order, without those that cannot be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import prod
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.designs.arrays import orthogonal_array
from sumo3dviz_pt.experiments.designs.balance import Rows, confounded_pairs, hidden_in_words
from sumo3dviz_pt.experiments.designs.latin import latin_square
from sumo3dviz_pt.experiments.shuffles import permutation
from sumo3dviz_pt.experiments.trials import Levels, Profile

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
