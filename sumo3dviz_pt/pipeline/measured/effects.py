"""What factors do to measures: a measure that differs by levels is confounded with the factor.

For each factor and measure, eta squared is the share of the measure's variance over profiles that
lies between the factor's levels: 1 says that the measure tells the level, 0 that it knows nothing
of it. With two levels it is the square of Pearson's correlation. In a design in which factors are
not orthogonal, one factor's share holds some of another's.

References:
    Cohen, "Eta-squared and partial eta-squared in fixed factor ANOVA designs", Educational and
    Psychological Measurement 33, 1973, doi:10.1177/001316447303300111.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

_SAME = 1e-9
"""Measures that differ by less than this share of their size count as constant."""


@dataclass(frozen=True, slots=True)
class Effect:
    """What a factor does to a measure.

    Attributes:
        factor: Its name.
        measure: Its name.
        means: Of the measure, by level.
        eta_squared: Share of its variance between levels, [0, 1]; 0 for a constant.
    """

    factor: str
    measure: str
    means: Mapping[str, float]
    eta_squared: float


def effects(
    levels: Mapping[str, Sequence[str]],
    profiles: Sequence[Sequence[str]],
    measures: Sequence[Mapping[str, float]],
) -> list[Effect]:
    """Return what each factor does to each measure that all profiles have.

    Args:
        levels: Of each factor, in order.
        profiles: A level of each factor.
        measures: Values by name, of the same profiles; NaN where there is none.
    """
    names = [name for name in measures[0] if all(np.isfinite(row[name]) for row in measures)]
    return [
        _effect(
            (factor, name),
            [level for level in levels[factor] if any(p[place] == level for p in profiles)],
            [profile[place] for profile in profiles],
            [row[name] for row in measures],
        )
        for place, factor in enumerate(levels)
        for name in names
    ]


def _effect(
    names: tuple[str, str], order: Sequence[str], levels: Sequence[str], values: Sequence[float]
) -> Effect:
    """Return what a factor does to a measure, by their names, and levels in an order."""
    by_level = {
        level: [value for own, value in zip(levels, values, strict=True) if own == level]
        for level in order
    }
    means = {level: float(np.mean(own)) for level, own in by_level.items()}
    whole = float(np.mean(values))
    total = float(np.sum((np.array(values) - whole) ** 2))
    between = sum(len(own) * (means[level] - whole) ** 2 for level, own in by_level.items())
    size = len(values) * max(abs(whole), _SAME) ** 2
    constant = total <= _SAME**2 * size
    return Effect(*names, means, 0.0 if constant else min(between / total, 1.0))
