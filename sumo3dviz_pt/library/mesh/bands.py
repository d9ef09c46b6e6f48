"""Polylines and what runs along them: offsets, painted bands, walls of quads.

Offsets are mitred. Vertices that repeat are dropped, and sharp bends are split.

References:
    Mitred joins: the offset vector at a bend is (n1 + n2) / (1 + n1 . n2), the
    intersection of both offset lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, arc_length, merge_meshes, settled, unit

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
    apart = [0]
    for index in range(1, len(points)):
        if np.hypot(*(points[index, :2] - points[apart[-1], :2])) > tolerance:
            apart.append(index)
    last = len(points) - 1
    if apart[-1] != last and len(apart) > 1:
        apart[-1] = last
    return points[apart]


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


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """A strip of constant width beside a polyline.

    Attributes:
        right: Right edge, (n, 3) [m].
        left: Left edge, (n, 3) [m].
        stations: Where each vertex lies along a reference line, (n,) [m], increasing.
    """

    right: Floats
    left: Floats
    stations: Floats

    def quads(self, start: float, end: float) -> Floats:
        """Cut quads between two stations.

        Args:
            start: [m], clamped.
            end: [m], clamped.

        Returns:
            Corners counter-clockwise from the right edge's start, (k, 4, 3) [m];
            k is 0 where nothing lies between.
        """
        low, high = max(start, self.stations[0]), min(end, self.stations[-1])
        if high - low < 0.02:
            return np.zeros((0, 4, 3))
        inner = self.stations[(self.stations > low + 1e-6) & (self.stations < high - 1e-6)]
        at = np.concatenate([[low], inner, [high]])
        quads = np.empty((len(at) - 1, 4, 3))
        for line, first, second in ((self.right, 0, 1), (self.left, 3, 2)):
            for axis in range(3):
                values = np.interp(at, self.stations, line[:, axis])
                quads[:, first, axis], quads[:, second, axis] = values[:-1], values[1:]
        return quads

    def dashes(self, *, dash: float, gap: float) -> Floats:
        """Cut the quads of a dashed line, (k, 4, 3) [m]; it starts with half a gap.

        Args:
            dash: [m], > 0.
            gap: [m], > 0.
        """
        starts = np.arange(self.stations[0] + 0.5 * gap, self.stations[-1], dash + gap)
        pieces = [self.quads(start, start + dash) for start in starts]
        return np.concatenate([np.zeros((0, 4, 3)), *pieces])

    def whole(self) -> Floats:
        """Cut the quads of the whole band, (k, 4, 3) [m]."""
        return self.quads(self.stations[0], self.stations[-1])


def band_along(line: Floats, *, right: float, left: float, reference: Floats | None = None) -> Band:
    """Lay a band beside a line.

    Args:
        line: Vertices without repeats, (n, 3) [m], n >= 2.
        right: Lateral place of its right edge, positive to the left [m].
        left: Lateral place of its left edge, > right [m].
        reference: A line with as many vertices along which stations are measured,
            so that dashes on several lines stay side by side; None is the line itself.
    """
    across = np.column_stack([mitres(line), np.zeros(len(line))])
    measured = line if reference is None or len(reference) != len(line) else reference
    stations = np.maximum.accumulate(arc_length(measured[:, :2]) + np.arange(len(line)) * 1e-9)
    return Band(line + right * across, line + left * across, stations)


def on_lane(points: Floats, middle: Floats) -> Floats:
    """Carry points from a lane's own plane onto it.

    Args:
        points: Station along it and offset to the left, (..., 2) [m].
        middle: Its middle line, (n, 3) [m], n >= 2.

    Returns:
        (..., 3) [m].
    """
    band = band_along(middle, right=0.0, left=1.0)
    foot, unit = (
        np.stack([np.interp(points[..., 0], band.stations, c) for c in line.T], axis=-1)
        for line in (band.right, band.left - band.right)
    )
    return np.asarray(foot + points[..., 1:] * unit)


def between(top: Floats, bottom: Floats, *, closed: bool = False) -> Mesh:
    """Build quads from one polyline to another.

    Seen with the polyline running to the right and `top` above `bottom`, the quads
    face the viewer.

    Args:
        top: (n, 3) [m].
        bottom: (n, 3) [m].
        closed: Whether the last vertices join the first ones.
    """
    count = len(top)
    start = np.arange(count if closed else count - 1)
    end = (start + 1) % count
    faces = np.concatenate(
        [
            np.stack([start + count, end + count, end], axis=1),
            np.stack([start + count, end, start], axis=1),
        ]
    )
    return Mesh(np.concatenate([top, bottom]), faces)


def walls(rings: Sequence[Floats], bottoms: Sequence[Floats]) -> Mesh:
    """Build walls around rings that run counter-clockwise around what they enclose.

    Args:
        rings: Upper edges, each (n, 3) [m], first vertex not repeated.
        bottoms: Lower edges, as many vertices [m].
    """
    pairs = zip(rings, bottoms, strict=True)
    return merge_meshes([between(top, bottom, closed=True) for top, bottom in pairs])
