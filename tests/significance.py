"""How far chance may carry a mean: limits for many comparisons at once."""

import numpy as np
from scipy.stats import norm, t

LEVEL = 1e-3
"""Chance that a family of correct comparisons fails."""


def sidak_z(comparisons, *, level=LEVEL, sides=2):
    """Largest z-score that `comparisons` independent ones may show.

    References:
        Sidak 1967, Rectangular confidence regions for the means of multivariate normal
        distributions, doi:10.1080/01621459.1967.10482935.
    """
    return float(norm.isf(_chance_of_each(comparisons, level) / sides))


def sidak_t(comparisons, *, freedom, level=LEVEL):
    """The same on both sides of 0, where the spread itself is known from a sample.

    Args:
        comparisons: How many there are.
        freedom: Degrees of freedom of each comparison's variance.
        level: Chance that one of them fails.
    """
    return float(t.isf(_chance_of_each(comparisons, level) / 2, freedom))


def _chance_of_each(comparisons, level):
    """Chance that one of several independent comparisons fails, if `level` is that of all."""
    return 1.0 - (1.0 - level) ** (1.0 / comparisons)


def standard_error(samples, axis=None):
    """Of the mean of independent samples."""
    samples = np.asarray(samples, dtype=np.float64)
    count = samples.size if axis is None else samples.shape[axis]
    return samples.std(axis=axis, ddof=1) / np.sqrt(count)
