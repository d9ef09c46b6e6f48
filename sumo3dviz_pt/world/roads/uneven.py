"""Small pieces of areas that are not level, such as junctions; they follow their heights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.world.roads.cells import Cells, Polygons
from sumo3dviz_pt.world.roads.drops import cut_on_grid

_STEP = 2.1
"""Size of the pieces [m]; those that show stains are smaller."""

_LEVEL = 0.02
"""Areas whose heights differ by less than this [m] are level."""


def is_uneven(cells: Cells, index: int) -> bool:
    """Return whether a cell is an area whose inside has heights of its own."""
    knots = cells.knots.get(index)
    return knots is not None and float(np.ptp(knots[:, 2])) > _LEVEL


def pieces_of(
    cells: Cells, index: int, parts: Sequence[shapely.Geometry]
) -> list[shapely.Geometry]:
    """Return what a cell's triangles are cut from: small pieces of its parts if it is uneven.

    Args:
        cells: The surface.
        index: Number of the cell.
        parts: Of the cell's polygon.
    """
    if not is_uneven(cells, index):
        return list(parts)
    return [piece for part in parts for piece in cut_small(part)]


def cut_small(piece: shapely.Geometry) -> list[shapely.Geometry]:
    """Return a polygon in pieces on a grid that all polygons share."""
    low, high = _span(piece)
    if (high - low <= 1).all():
        return [piece]
    return cut_on_grid(piece, _squares(low, high))


def points_within(cells: Cells) -> tuple[Floats, Ints]:
    """Return the grid's points in all uneven cells, (m, 2) [m], and their cells, (m,)."""
    points, owners = [np.zeros((0, 2))], [np.zeros(0, np.int64)]
    for index in sorted(cells.knots):
        area = cells.polygons[index]
        if area.is_empty or not is_uneven(cells, index):
            continue
        low, high = _span(area)
        x, y = (_STEP * np.arange(a, b + 1) for a, b in zip(low, high, strict=True))
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        points.append(grid[shapely.intersects_xy(area, grid[:, 0], grid[:, 1])])
        owners.append(np.full(len(points[-1]), index))
    return np.concatenate(points), np.concatenate(owners)


def _span(piece: shapely.Geometry) -> tuple[Ints, Ints]:
    """Numbers of the grid's lines around a polygon, east and north, (2,) each."""
    low, high = np.array(piece.bounds).reshape(2, 2) / _STEP
    return np.floor(low).astype(np.int64), np.ceil(high).astype(np.int64)


def _squares(low: Ints, high: Ints) -> Polygons:
    """The grid's squares between lines, (n,)."""
    x, y = (_STEP * np.arange(a, b) for a, b in zip(low, high, strict=True))
    corners = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(shapely.box(*corners.T, *(corners + _STEP).T))
