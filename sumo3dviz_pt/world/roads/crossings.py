"""Where cells of the road surface lie above others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import GRID
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.world.roads.cells import STOREY, Cells, Polygons

_SMALLEST = 0.01
"""Overlaps below this area [m2] are no crossings."""

_MOST = 12
"""Levels that are told apart."""


class Crossings(NamedTuple):
    """Where cells lie above others.

    Attributes:
        lower: Cells below, (m,).
        upper: The cells above them, (m,).
        shared: What both cover from above, (m,) geometries.
        gap: Heights between them, (m,) [m].
    """

    lower: Ints
    upper: Ints
    shared: Polygons
    gap: Floats


def crossings_of(cells: Cells) -> Crossings:
    """Return the pairs of cells that overlap from above, a storey apart or more."""
    none = np.zeros(0, np.int64)
    if cells.is_flat:
        return Crossings(none, none, np.zeros(0, dtype=object), np.zeros(0))
    one, other = shapely.STRtree(cells.polygons).query(cells.polygons, predicate="intersects")
    one, other = one[one < other], other[one < other]
    # Most neighbours lie at one height; only the others can be a storey apart.
    low, high = _spans(cells)
    apart = np.maximum(high[one] - low[other], high[other] - low[one]) >= STOREY
    one, other = one[apart], other[apart]
    shared = shapely.intersection(cells.polygons[one], cells.polygons[other], grid_size=GRID)
    real = shapely.area(shared) > _SMALLEST
    one, other, shared = one[real], other[real], shared[real]
    middle = shapely.get_coordinates(shapely.point_on_surface(shared)).reshape(-1, 2)
    gap = cells.heights(other, middle) - cells.heights(one, middle)
    apart = np.abs(gap) >= STOREY
    above = gap > 0
    lower, upper = np.where(above, one, other), np.where(above, other, one)
    return Crossings(lower[apart], upper[apart], shared[apart], np.abs(gap[apart]))


def _spans(cells: Cells) -> tuple[Floats, Floats]:
    """The lowest and the highest height of each cell, (n,) each [m]."""
    low, high = cells.quads[..., 2].min(axis=1), cells.quads[..., 2].max(axis=1)
    for cell, knots in cells.knots.items():
        low[cell], high[cell] = knots[:, 2].min(), knots[:, 2].max()
    return low, high


def stacked(crossings: Crossings, count: int) -> Ints:
    """Return the level of each of `count` cells, (n,): one more than of the highest below it."""
    levels = np.zeros(count, dtype=np.int64)
    for _ in range(_MOST):
        raised = levels.copy()
        np.maximum.at(raised, crossings.upper, levels[crossings.lower] + 1)
        if (raised == levels).all():
            break
        levels = raised
    return np.minimum(levels, _MOST)
