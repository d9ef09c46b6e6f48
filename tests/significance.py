"""How far chance may carry a mean: z-limits for many comparisons at once."""

import numpy as np
from scipy.stats import norm

LEVEL = 1e-3
"""Chance that a family of correct comparisons fails."""


def sidak_z(comparisons, *, level=LEVEL, sides=2):
    """Largest z-score that `comparisons` independent ones may show.

    References:
        Sidak 1967, Rectangular confidence regions for the means of multivariate normal
        distributions, doi:10.1080/01621459.1967.10482935.
    """
    each = 1.0 - (1.0 - level) ** (1.0 / comparisons)
    return float(norm.isf(each / sides))


def standard_error(samples, axis=None):
    """Of the mean of independent samples."""
    samples = np.asarray(samples, dtype=np.float64)
    count = samples.size if axis is None else samples.shape[axis]
    return samples.std(axis=axis, ddof=1) / np.sqrt(count)
