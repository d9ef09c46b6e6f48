"""Heights of the road surface that meet without steps where cells meet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.world.roads.cells import STOREY, Cells


def surface_heights(cells: Cells, index: Ints, points: Floats) -> Floats:
    """Return heights as `Cells.heights` does, but areas meet the lanes beside them without a step.

    Args:
        cells: The surface.
        index: Which cell each point belongs to, (m,).
        points: (m, 2) [m].
    """
    if cells.is_flat:
        return np.full(len(points), _any_height(cells))
    heights = cells.heights(index, points)
    area = np.flatnonzero(np.isnan(cells.quads[index, 0, 0]))
    spots = shapely.points(points[area])
    near, lane = cells.lane_tree.query(spots, predicate="dwithin", distance=0.02)
    offered = cells.heights(cells.lanes[lane], points[area[near]])
    fits = np.abs(offered - heights[area[near]]) < STOREY
    # Written in reverse, so that the cell with the highest precedence wins.
    order = np.lexsort((-lane[fits], near[fits]))
    heights[area[near[fits][order]]] = offered[fits][order]
    return heights


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
