"""Clutter of a picture by its edge density: the share of its pixels that are edges.

Edges are found as Canny did: smooth, take the gradient, keep ridges of it, and follow them from
strong edges to weaker ones. The thresholds are fixed steps of encoded luma and not shares of a
picture's strongest edge, so that pictures can be compared.

References:
    Mack & Oliva, "Computational estimation of visual complexity", Object Perception, Attention and
    Memory 2004 (edge density); Rosenholtz, Li & Nakano, "Measuring visual clutter", Journal of
    Vision 7(2):17, 2007, doi:10.1167/7.2.17 (against other measures of clutter).
    Canny, "A computational approach to edge detection", IEEE TPAMI 8, 1986,
    doi:10.1109/TPAMI.1986.4767851.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, label

from sumo3dviz_pt.model.geometry import Bools, Floats

_SIGMA = 1.0
"""Of the smoothing [px]."""

_WEAK, _STRONG = 0.02, 0.05
"""Steps of luma per pixel from which an edge goes on, and from which it begins."""


def edge_density(luma: Floats) -> float:
    """Return the share of pixels that are edges, [0, 1].

    Args:
        luma: Encoded, (h, w) in [0, 1].
    """
    return float(edges(luma).mean())


def edges(luma: Floats) -> Bools:
    """Return which pixels are edges, (h, w).

    Args:
        luma: Encoded, (h, w) in [0, 1].
    """
    smooth = gaussian_filter(np.asarray(luma, dtype=np.float64), _SIGMA, mode="nearest")
    down, right = _slope(smooth, 0), _slope(smooth, 1)
    steep = np.hypot(down, right)
    ridges = steep * _is_ridge(steep, down, right)
    regions, count = label(ridges > _WEAK, structure=np.ones((3, 3)))
    begun = np.zeros(count + 1, dtype=np.bool_)
    begun[regions[ridges > _STRONG]] = True
    begun[0] = False
    return np.asarray(begun[regions])


def _slope(values: Floats, axis: int) -> Floats:
    """Return the gradient along an axis, (h, w); 0 where there is but one pixel."""
    if values.shape[axis] < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values, axis=axis), dtype=np.float64)


def _is_ridge(steep: Floats, down: Floats, right: Floats) -> Bools:
    """Return where the gradient is largest along its own direction, (h, w)."""
    wide = np.pad(steep, 1)
    eighth = np.round(np.arctan2(down, right) / (np.pi / 4)).astype(int) % 4
    found = np.zeros(steep.shape, dtype=np.bool_)
    height, width = steep.shape
    for turn, (rows, columns) in enumerate(((0, 1), (1, 1), (1, 0), (1, -1))):
        ahead = wide[1 + rows : 1 + rows + height, 1 + columns : 1 + columns + width]
        behind = wide[1 - rows : 1 - rows + height, 1 - columns : 1 - columns + width]
        found |= (eighth == turn) & (steep >= ahead) & (steep > behind)
    return found
