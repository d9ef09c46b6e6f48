"""Gives leaves back that a denoiser smears, from what guides know of them.

A denoiser takes small leaves in the shade for noise, for their raw pixels look like it. Yet the
first surfaces that the camera sees have little noise: their normals, reflectance and coverage. In
windows of about twenty pixels, what the denoiser took is therefore fitted by these guides, and the
fitted part, which follows surfaces and no noise, is added again. Where normals do not vary or what
was taken does not follow them, nothing is added; a window's mean hardly changes. Pixel by pixel
such a crown is no nearer to the truth, but it is made of leaves and not of brush strokes.

References:
    Bitterli et al., "Nonlinearly Weighted First-order Regression for Denoising Monte Carlo
    Renderings", EGSR 2016. He and Sun, "Fast Guided Filter", arXiv:1505.00996 (2015), for fitting
    on a coarse grid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import LUMINANCE

_BLOCK = 4
"""Side of the squares over which products are averaged first [px]."""

_WINDOW = 5
"""Side of a window, in such squares."""

_RIDGE = 3e-3
"""Variance of a guide that counts as none."""

_CALM, _RUFFLED = 0.03, 0.08
"""Variances of normals in a window below which nothing is added, and above which all is."""

_BRIGHTEST = 4.0
"""How much brighter than the smooth pixel a raw one may be; brighter ones are cut to that."""

_LEAST, _MOST = -0.8, 1.5
"""The fitted part is kept between these, as shares of the smooth pixel."""

_LUMINANCE = LUMINANCE.astype(np.float32)


def regressed(smooth: Image, raw: Image, *, albedo: Image, normal: Image, hit: Image) -> Image:
    """Add what guides tell of the difference between a raw and a denoised picture.

    Args:
        smooth: The denoised picture, (h, w, 3).
        raw: The picture before, (h, w, 3).
        albedo: Reflectance of what is seen first, (h, w, 3).
        normal: Its normals, (h, w, 3).
        hit: Share of samples that hit something, (h, w) in [0, 1].

    Returns:
        The picture, (h, w, 3), non-negative.
    """
    light = smooth @ _LUMINANCE
    floor = np.float32(1e-4) * light.mean() + np.float32(1e-12)
    taken = np.minimum(raw @ _LUMINANCE, _BRIGHTEST * light) / (light + floor) - 1
    guides = [*np.moveaxis(normal, -1, 0), albedo @ _LUMINANCE, hit]
    fit = _fitted(guides, taken)
    return np.asarray(smooth * (1 + np.clip(fit, _LEAST, _MOST))[..., None], np.float32)


def _fitted(guides: Sequence[Image], taken: Image) -> Image:
    """Return the part of a picture that guides explain; the first three are normals."""
    shape = taken.shape
    means = [_windowed(guide) for guide in guides]
    mean = _windowed(taken)
    covariance = [
        [_windowed(guides[i] * guides[j]) - means[i] * means[j] for j in range(i + 1)]
        for i in range(len(guides))
    ]
    # Only crowns and hedges have normals at all angles within a window.
    ruffled = sum((covariance[i][i] for i in range(3)), np.zeros_like(mean))
    share = np.clip((ruffled - _CALM) / (_RUFFLED - _CALM), 0, 1).astype(np.float32)
    for i in range(len(guides)):
        covariance[i][i] = covariance[i][i] + np.float32(_RIDGE)
    shared = [
        _windowed(guide * taken) - own * mean for guide, own in zip(guides, means, strict=True)
    ]
    slopes = [share * slope for slope in _solved(covariance, shared)]
    offset = np.zeros_like(mean)
    for slope, own in zip(slopes, means, strict=True):
        offset -= slope * own
    fit = _spread(offset, shape)
    for slope, guide in zip(slopes, guides, strict=True):
        fit += _spread(slope, shape) * guide
    return fit


def _windowed(values: Image) -> Image:
    """Return the means of values over windows about squares of pixels, (rows, columns)."""
    height, width = values.shape
    padded = np.pad(values, ((0, -height % _BLOCK), (0, -width % _BLOCK)), mode="edge")
    rows, columns = padded.shape[0] // _BLOCK, padded.shape[1] // _BLOCK
    squares = padded.reshape(rows, _BLOCK, columns, _BLOCK).mean(axis=(1, 3))
    return np.asarray(uniform_filter(squares, _WINDOW, mode="nearest"))


def _solved(matrix: Sequence[Sequence[Image]], right: Sequence[Image]) -> list[Image]:
    """Solve symmetric positive definite systems of which every entry is a picture.

    In plain arithmetic, as libraries give other last digits on other processors.

    Args:
        matrix: The lower triangle, row by row.
        right: The right sides.
    """
    lower, pivots = _factored(matrix)
    count = len(right)
    found = list(right)
    for i in range(count):
        for k in range(i):
            found[i] = found[i] - lower[i][k] * found[k]
    found = [value / pivot for value, pivot in zip(found, pivots, strict=True)]
    for i in reversed(range(count)):
        for k in range(i + 1, count):
            found[i] = found[i] - lower[k][i] * found[k]
    return found


def _factored(matrix: Sequence[Sequence[Image]]) -> tuple[list[list[Image]], list[Image]]:
    """Take a matrix apart by Cholesky's way without roots: below the diagonal, and pivots."""
    lower: list[list[Image]] = []
    pivots: list[Image] = []
    for given in matrix:
        row: list[Image] = []
        # What is left of this row after those above it, times their pivots.
        for j, rest in enumerate(given):
            left = rest
            for k in range(j):
                other = lower[j] if j < len(lower) else row
                left = left - row[k] * other[k] * pivots[k]
            row.append(left / pivots[j] if j < len(lower) else left)
        # Rounding may leave less than the ridge that is there.
        pivots.append(np.maximum(row.pop(), np.float32(0.5 * _RIDGE)))
        lower.append(row)
    return lower, pivots


def _spread(coarse: Image, shape: tuple[int, ...]) -> Image:
    """Return values of squares at all pixels, straight in between."""
    for axis, length in enumerate(shape):
        last = coarse.shape[axis] - 1
        at = np.clip((np.arange(length) + 0.5) / _BLOCK - 0.5, 0.0, last)
        low = np.minimum(at.astype(np.int64), max(last - 1, 0))
        share = (at - low).astype(np.float32)
        share = share[:, None] if axis == 0 else share
        first = np.take(coarse, low, axis=axis)
        after = np.take(coarse, np.minimum(low + 1, last), axis=axis)
        coarse = first + share * (after - first)
    return coarse
