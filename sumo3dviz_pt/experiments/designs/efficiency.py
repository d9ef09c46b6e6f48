"""Says how well a design tells effects apart: associations of factors, and the D-error of choices.

References:
    H. Cramer (1946): Mathematical Methods of Statistics, chapter 21 (V)
    D. McFadden (1974): Conditional logit analysis of qualitative choice behavior
    J. Huber, K. Zwerina (1996): The importance of utility balance in efficient choice designs,
    Journal of Marketing Research 33(3), 307-317; doi:10.1177/002224379603300305 (D-error)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.experiments.designs.balance import pair_counts
from sumo3dviz_pt.experiments.trials import Levels, Profile, Trial

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
    found = np.eye(len(counts))
    for one, other in combinations(range(len(counts)), 2):
        times = pair_counts(numbers, counts, one, other).astype(float)
        times = times[times.sum(axis=1) > 0][:, times.sum(axis=0) > 0]
        even = np.outer(times.sum(axis=1), times.sum(axis=0)) / times.sum()
        least = min(times.shape) - 1
        chi = float(((times - even) ** 2 / even).sum())
        found[one, other] = found[other, one] = np.sqrt(chi / times.sum() / least) if least else 0.0
    return found


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
    found = associations(levels, trials)
    lines = ["association of factors (Cramer's V: 0 none, 1 the same)"]
    if (found - np.eye(len(found)) < _SEEN).all():
        lines.append("  0 for any two of them")
    else:
        names = [name[:14] for name in levels]
        lines.append(f"  {'':<14} " + " ".join(f"{name:>14}" for name in names))
        for name, row in zip(names, found, strict=True):
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
    told = "the priors" if priors else "utilities of 0"
    said = "not all effects can be told" if np.isinf(error) else f"D-error {error:.4g}"
    return f"{said}, for {told}, by one who sees all {len(choices)} tasks"


def _numbers(levels: Levels, profiles: Sequence[Profile]) -> NDArray[np.int64]:
    """Return the number of each factor's level, (profiles, factors)."""
    places = [{name: n for n, name in enumerate(names)} for names in levels.values()]
    found = [[own[level] for own, level in zip(places, p, strict=True)] for p in profiles]
    return np.array(found, dtype=np.int64)
