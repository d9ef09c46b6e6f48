"""Points along many polylines, found for all of them at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Floats, Ints


class AlongLines(NamedTuple):
    """Points along polylines, line by line.

    Attributes:
        points: (n, 3) [m].
        sides: The side of its line that each point lies on, from vertex to vertex, (n, 3) [m].
    """

    points: Floats
    sides: Floats


def evenly_along(lines: Sequence[Floats], count: Callable[[Floats], Ints]) -> AlongLines:
    """Return points that divide each polyline evenly, from its first vertex to its last.

    Args:
        lines: Vertices of each, (k, 3) [m], k >= 2.
        count: Gives how many points lines of some lengths from above, (m,) [m], get, (m,) >= 2.
    """
    sizes = np.array([len(line) for line in lines])
    numbers, pieces = [np.zeros(0, np.int64)], [np.zeros((0, 6))]
    # Lines with as many vertices make one array.
    for size in np.unique(sizes):
        chosen = np.flatnonzero(sizes == size)
        found, line = _divided(np.stack([lines[k] for k in chosen.tolist()]), count)
        numbers.append(chosen[line])
        pieces.append(found)
    order = np.argsort(np.concatenate(numbers), kind="stable")
    both = np.concatenate(pieces)[order]
    return AlongLines(both[:, :3], both[:, 3:])


def _divided(lines: Floats, count: Callable[[Floats], Ints]) -> tuple[Floats, Ints]:
    """Points along lines of one size, (m, k, 3), and their sides, (n, 6); and lines, (n,)."""
    sides = np.diff(lines, axis=1)
    lengths = np.linalg.norm(sides[..., :2], axis=2)
    known = np.concatenate([np.zeros((len(lines), 1)), np.cumsum(lengths, axis=1)], axis=1)
    many = np.asarray(count(known[:, -1]), dtype=np.int64)
    line = np.repeat(np.arange(len(lines)), many)
    step = np.arange(len(line)) - np.repeat(np.cumsum(many) - many, many)
    last = step == many[line] - 1
    at = np.where(last, known[line, -1], step * (known[:, -1] / (many - 1))[line])
    # Interpolate between the two vertices around each.
    vertex = (known[line] <= at[:, None]).sum(axis=1) - 1
    side = np.minimum(vertex, sides.shape[1] - 1)
    start, low = lines[line, side], known[line, side]
    span = known[line, side + 1] - low
    slope = sides[line, side] / np.where(span > 0.0, span, 1.0)[:, None]
    points = np.where((at == low)[:, None], start, slope * (at - low)[:, None] + start)
    points[last] = lines[line[last], -1]
    return np.concatenate([points, sides[line, side]], axis=1), line


def from_above(lines: Sequence[Floats]) -> NDArray[shapely.Geometry]:
    """Return polylines, (k, 2 or 3) [m] each, as geometries in the plan, (n,)."""
    if not len(lines):
        return np.zeros(0, dtype=object)
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    flat = np.concatenate([line[:, :2] for line in lines])
    return np.asarray(shapely.linestrings(flat, indices=owner))
