"""Rounded bodies as stacks of rings, the shape of every limb, head, shoe and garment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from sumo3dviz_pt.library.mesh.grids import grid_faces
from sumo3dviz_pt.model.geometry import Floats, Ints, frozen
from sumo3dviz_pt.model.vectors import unit

_COLUMNS = 8


class Counts(NamedTuple):
    """How finely a surface of rings is modelled.

    Attributes:
        rings: How many rings it has.
        points: How many points each ring has.
    """

    rings: int
    points: int

    def with_rings(self, rings: int) -> Counts:
        """Return counts of as many points on another number of rings, at least two."""
        return Counts(max(2, rings), self.points)


@dataclass(frozen=True, slots=True, eq=False)
class Stack:
    """Rings over one another, interpolated smoothly from row to row.

    Attributes:
        rows: x and y of the ring's middle, reach to the front, reach to the back, half
            width, height of the front, height of the back [m], and the exponent of the
            superellipse, (n, 8).
    """

    rows: Floats

    def __post_init__(self) -> None:
        """Freeze the rows and check their width."""
        object.__setattr__(self, "rows", frozen(self.rows).reshape(-1, _COLUMNS))

    @property
    def last(self) -> float:
        """Level of the top row; the bottom row has level 0."""
        return float(len(self.rows) - 1)

    def points(self, levels: Floats, angles: Floats) -> Floats:
        """Return points on the surface.

        Args:
            levels: Positions between rows, any shape; 1.5 is midway from row 1 to row 2.
            angles: From the front to the left, same shape [rad].

        Returns:
            Points, (..., 3) [m].
        """
        rows = PchipInterpolator(np.arange(len(self.rows)), self.rows, axis=0)(
            np.clip(levels, 0.0, self.last)
        )
        x, y, front, back, half, low, high, power = np.moveaxis(rows, -1, 0)
        c, s = np.cos(angles), np.sin(angles)
        along = np.sign(c) * np.abs(c) ** (2.0 / power)
        across = np.sign(s) * np.abs(s) ** (2.0 / power)
        height = high + (low - high) * 0.5 * (1.0 + c)
        return np.stack(
            [x + np.where(c > 0, front, back) * along, y + half * across, height], axis=-1
        )

    def grid(self, levels: Floats | int, angles: Floats | int) -> Floats:
        """Return rings of points, (k, m, 3) [m].

        Args:
            levels: Of the rings, or how many from bottom to top.
            angles: Of each ring's points, or how many [rad].
        """
        if isinstance(levels, int):
            levels = np.linspace(0.0, self.last, levels)
        if isinstance(angles, int):
            angles = turns(angles)
        return self.points(*np.meshgrid(levels, angles, indexing="ij"))


def turns(count: int, *, offset: float = 0.0) -> Floats:
    """Return equal angles around a ring, (count,) [rad]; `offset` counts steps."""
    return 2.0 * np.pi * (np.arange(count) + offset) / count


def swollen(rings: Floats) -> Floats:
    """Widen coarse rings, (k, m, 3), until they enclose what the curves through them do."""
    count = rings.shape[1]
    if count > 6:
        return rings
    middle = rings.mean(axis=1, keepdims=True)
    factor = np.sqrt(2.0 * np.pi / (count * np.sin(2.0 * np.pi / count)))
    return np.asarray(middle + (rings - middle) * [factor, factor, 1.0])


def _ring_faces(rows: int, columns: int) -> Ints:
    """Return the outward triangles of rings that run counter-clockwise seen from above, (m, 3)."""
    halves = np.split(grid_faces(rows, columns, closed=True), 2)
    # The two triangles of a quad follow each other, so that colours can be given by quad.
    return np.stack(halves, axis=1).reshape(-1, 3)


def closed(rings: Floats, *, bottom: bool, top: bool) -> tuple[Floats, Ints]:
    """Join rings and close their ends; triangles of lids come last, the bottom's first.

    Args:
        rings: From bottom to top, counter-clockwise seen from above, (k, m, 3) [m].
        bottom: Whether the first ring gets a lid.
        top: Whether the last ring gets a lid.

    Returns:
        Vertices, (n, 3) [m], and outward triangles, (m, 3).
    """
    rows, columns = rings.shape[:2]
    vertices, faces = [rings.reshape(-1, 3)], [_ring_faces(rows, columns)]
    here = np.arange(columns)
    after = (here + 1) % columns
    count = rows * columns
    if bottom:
        vertices.append(rings[0].mean(axis=0, keepdims=True))
        faces.append(np.stack([after, here, np.full(columns, count)], axis=1))
        count += 1
    if top:
        vertices.append(rings[-1].mean(axis=0, keepdims=True))
        base = (rows - 1) * columns
        faces.append(np.stack([base + here, base + after, np.full(columns, count)], axis=1))
    return np.concatenate(vertices), np.concatenate(faces)


def interpolated(values: Floats | float, table: Sequence[tuple[float, float]]) -> Floats:
    """Interpolate a table (argument, value) smoothly; it is constant beyond its ends."""
    nodes = np.array(table)
    clipped = np.clip(values, nodes[0, 0], nodes[-1, 0])
    return np.asarray(PchipInterpolator(nodes[:, 0], nodes[:, 1])(clipped))


def rope(path: Floats, radii: Floats, count: int, *, flat: Floats | None = None) -> Floats:
    """Lay rings around a bent line, from its first point on, (k, count, 3) [m].

    Args:
        path: (k, 3) [m].
        radii: (k,) [m].
        count: Points of a ring.
        flat: Direction in which the rings are a third as thick, (k, 3) or (3,), or None.
    """
    along = unit(np.gradient(path, axis=0))
    helper = np.array([1.0, 0.0, 0.0]) if flat is None else np.asarray(flat)
    first = unit(helper - (along * helper).sum(axis=1, keepdims=True) * along)
    second = np.cross(along, first)
    turn = turns(count, offset=0.5)[None, :, None]
    thin = 1.0 if flat is None else 0.34
    ring = thin * np.cos(turn) * first[:, None] + np.sin(turn) * second[:, None]
    return np.asarray(path[:, None] + radii[:, None, None] * ring)
