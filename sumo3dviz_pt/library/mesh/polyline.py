"""Polylines: mitred offsets, vertices without repeats, sharp bends.

References:
    Mitred joins: the offset vector at a bend is (n1 + n2) / (1 + n1 . n2), the
    intersection of both offset lines.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, settled
from sumo3dviz_pt.model.vectors import unit

MITRE_LIMIT = 2.0
"""Longest mitre per unit of offset; sharper bends are cut there."""

_SHARP = 0.35
"""Cosine of the turn from which on a bend is sharp; 70 degrees."""


def without_repeats(points: Floats, *, tolerance: float = 0.01) -> Floats:
    """Drop vertices closer than a tolerance [m] to the one kept before them.

    The last vertex always stays, so that ends do not move.

    Args:
        points: Vertices, (n, 3) [m], n >= 1.
        tolerance: [m].

    Returns:
        Vertices, (k, 3) [m], k <= n.
    """
    kept = [0]
    for index in range(1, len(points)):
        if np.hypot(*(points[index, :2] - points[kept[-1], :2])) > tolerance:
            kept.append(index)
    last = len(points) - 1
    if kept[-1] != last and len(kept) > 1:
        kept[-1] = last
    return points[kept]


def with_split_bends(points: Floats) -> Floats:
    """Double the vertices of sharp bends.

    A mitre there would be long, or, cut off, would pinch the strip along both its
    neighbours. `mitres` gives the two copies the normals of their own segments.

    Args:
        points: Vertices without repeats, (n, 3) [m], n >= 2.

    Returns:
        Vertices, (k, 3) [m], k >= n.
    """
    steps = unit(np.diff(points[:, :2], axis=0))
    sharp = np.flatnonzero((steps[1:] * steps[:-1]).sum(axis=1) < _SHARP) + 1
    return np.insert(points, sharp, points[sharp], axis=0)


def mitres(points: Floats, *, closed: bool = False) -> Floats:
    """Return vectors that carry each vertex one metre to the left, mitred at bends.

    Args:
        points: Vertices, (n, 2) or (n, 3) [m], n >= 2; a closed polyline does not
            repeat its first vertex. Doubled vertices are not mitred.
        closed: Whether the last vertex leads back to the first.

    Returns:
        Horizontal vectors, (n, 2); their length is at most `MITRE_LIMIT`.
    """
    flat = points[:, :2]
    ahead = np.roll(flat, -1, axis=0) - flat
    length = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead /= np.maximum(length, 1e-12)
    behind = np.roll(ahead, 1, axis=0)
    if not closed:
        ahead[-1], behind[0] = ahead[-2], ahead[0]
    doubled = length[:, 0] < 1e-9
    ahead[doubled] = behind[doubled]
    after = np.roll(doubled, 1)
    behind[after] = ahead[after]
    total = ahead + behind
    total = np.stack([-total[:, 1], total[:, 0]], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    # |n1 + n2|^2 = 2 (1 + n1 . n2), so dividing twice by the length gives the mitre.
    reach = np.minimum(2.0 / np.maximum(length, 1e-9), MITRE_LIMIT)
    turned = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    return np.where(length > 1e-6, total / np.maximum(length, 1e-9) * reach, turned)


def offset(points: Floats, distance: float) -> Floats:
    """Move a polyline sideways.

    Args:
        points: Vertices, (n, 3) [m], n >= 2.
        distance: To the left [m]; negative is to the right.

    Returns:
        As many vertices, (n, 3) [m], at the same heights.
    """
    moved = np.array(points, dtype=np.float64)
    moved[:, :2] += distance * mitres(points)
    return moved


def densified(line: Floats, step: float) -> Floats:
    """Return a line with more points, so that none is farther than `step` [m] from the next.

    Args:
        line: (n, 3) [m].
        step: [m].
    """
    length = np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1)
    count = np.maximum(np.ceil(settled(length / step)), 1).astype(np.int64)
    index = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)) / count[index]
    dense = line[index] + share[:, None] * (line[index + 1] - line[index])
    return np.concatenate([dense, line[-1:]])
