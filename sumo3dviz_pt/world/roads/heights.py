"""Heights of the road surface that meet without steps where cells meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.world.roads.cells import STOREY, Cells

_BESIDE = 0.02
"""Cells whose borders lie this close [m] to a point meet there."""

_CONTRADICTION = 1.0
"""Heights of a walking area and of the roads beside it differ by up to this [m]."""

_KNOTS_APART = 0.5
"""Distance of points of known height along borders [m]."""


def surface_heights(cells: Cells, index: Ints, points: Floats) -> Floats:
    """Return heights as `Cells.heights` does, but areas meet the cells beside them without a step.

    On their borders they take the heights of lanes, or else those of other areas of a higher
    precedence; but walking areas follow the roads, not roads them.

    Args:
        cells: The surface.
        index: Which cell each point belongs to, (m,).
        points: (m, 2) [m].
    """
    if cells.is_flat:
        return np.full(len(points), _any_height(cells))
    heights = cells.heights(index, points)
    area = np.flatnonzero(np.isnan(cells.quads[index, 0, 0]))
    heights[area] = _met(cells, index[area], points[area], heights[area])
    return heights


def with_border_knots(cells: Cells) -> Cells:
    """Return cells whose walking areas have the heights of the roads beside them on their border.

    SUMO gives walking areas heights of their own, up to a metre off those roads. Without these
    points, all of the difference would lie within the kerb stones.
    """
    if cells.is_flat:
        return cells
    knots = dict(cells.knots)
    walks = cells.areas[cells.raised[cells.areas]]
    for index, polygon in zip(walks.tolist(), cells.polygons[walks], strict=True):
        points = shapely.get_coordinates(shapely.segmentize(polygon, _KNOTS_APART))
        own = np.full(len(points), index)
        before = cells.heights(own, points)
        met = _met(cells, own, points, before)
        change = np.abs(met - before)
        known = np.column_stack([points, met])[(change > 0.0) & (change < _CONTRADICTION)]
        knots[index] = np.concatenate([knots[index], known])
    return replace(cells, knots=knots)


def _met(cells: Cells, index: Ints, points: Floats, heights: Floats) -> Floats:
    """Heights at points of areas, (m,) [m], that meet what lies beside them.

    Args:
        cells: The surface.
        index: Which area each point belongs to, (m,).
        points: (m, 2) [m].
        heights: Of the areas by themselves, (m,) [m].
    """
    met, spots = heights.copy(), shapely.points(points)
    near, area = cells.area_tree.query(spots, predicate="dwithin", distance=_BESIDE)
    area, own = cells.areas[area], index[near]
    leads = ~cells.raised[area] & (cells.raised[own] | (area < own))
    near, area = near[leads], area[leads]
    _take(met, near, cells.heights(area, points[near]), area)
    near, lane = cells.lane_tree.query(spots, predicate="dwithin", distance=_BESIDE)
    _take(met, near, cells.heights(cells.lanes[lane], points[near]), lane)
    return met


def _take(heights: Floats, which: Ints, offered: Floats, rank: Ints) -> None:
    """Put offered heights, (k,) [m], in the place of some, unless another level offers them.

    Args:
        heights: (m,) [m]; changed.
        which: Numbers of the heights, (k,).
        offered: (k,) [m].
        rank: Of several offers, the one with the lowest rank is taken, (k,).
    """
    fits = np.abs(offered - heights[which]) < STOREY
    # Written in reverse, so that the cell with the highest precedence wins.
    order = np.lexsort((-rank[fits], which[fits]))
    heights[which[fits][order]] = offered[fits][order]


def _any_height(cells: Cells) -> float:
    """The one height of a flat surface [m]."""
    if len(cells.quads) and np.isfinite(cells.quads[0, 0, 2]):
        return float(cells.quads[0, 0, 2])
    return float(next(iter(cells.knots.values()))[0, 2]) if cells.knots else 0.0


def heights_near(cells: Cells, points: Floats, *, among: Ints | None = None) -> Floats:
    """Return the height of the cells nearest to points.

    Args:
        cells: The surface; at least one cell.
        points: (m, 2) [m].
        among: Numbers of the cells that count; default all.

    Returns:
        (m,) [m].
    """
    if cells.is_flat:
        return np.full(len(points), _any_height(cells))
    tree = cells.tree if among is None else shapely.STRtree(cells.polygons[among])
    asked, cell = tree.query_nearest(shapely.points(points), all_matches=False)
    heights = np.zeros(len(points))
    number = cell if among is None else among[cell]
    heights[asked] = surface_heights(cells, number, points[asked])
    return heights


def draped(points: Floats, meshes: Sequence[Mesh]) -> Floats:
    """Return points moved up or down onto the nearest triangle above or below them.

    Args:
        points: (n, 3) [m]; their height tells which level they belong to.
        meshes: The surface.

    Returns:
        (n, 3) [m]; points without a triangle within a storey stay.
    """
    corners = np.concatenate([np.zeros((0, 3, 3)), *(m.vertices[m.faces] for m in meshes)])
    tree = shapely.STRtree(shapely.polygons(corners[..., :2]))
    asked, face = tree.query(shapely.points(points[:, :2]), predicate="intersects")
    a, b, c = (corners[face, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    away = points[asked, :2] - a[:, :2]
    found = a[:, 2] - (away * normal[:, :2]).sum(axis=1) / np.maximum(normal[:, 2], 1e-9)
    miss = np.abs(found - points[asked, 2])
    # The nearest triangle is written last and so stays.
    order = np.argsort(-miss, kind="stable")
    order = order[miss[order] < STOREY]
    moved = points.copy()
    moved[asked[order], 2] = found[order]
    return moved
