"""Which pieces of road lie above others, and where each level ends.

Seen from above, a bridge and the road below it overlap. So every cell gets a level, the
number of cells that lie below it one above the other, and the borders of the surface are
found level by level.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, union
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.world.roads.cells import STOREY, Cells
from sumo3dviz_pt.world.roads.crossings import Crossings, crossings_of, stacked
from sumo3dviz_pt.world.roads.heights import heights_near
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.mesh import area_rings

_MEETS = 0.02
"""Cells whose borders lie this close [m] touch each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """A stretch of the border of the road surface; the surface lies to its left.

    Attributes:
        line: (n, 3) [m]; a closed one does not repeat its first point.
        closed: Whether its end leads back to its start.
        level: Of the cells that it bounds.
    """

    line: Floats
    closed: bool
    level: int


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Levels of a road surface.

    Attributes:
        crossings: Where cells lie above others.
        of_cell: Level of each cell, 0 where none lies below it, (n,).
        borders: Where the surface ends.
    """

    crossings: Crossings
    of_cell: Ints
    borders: tuple[Border, ...]


def levels_of(layout: RoadLayout) -> Levels:
    """Return the levels of a layout, which are kept in its memory."""

    def found() -> Levels:
        crossings = crossings_of(layout.cells)
        of_cell = stacked(crossings, len(layout.cells.polygons))
        return Levels(crossings, of_cell, _borders(layout, of_cell))

    return layout.memory.of(("levels",), found)


def _borders(layout: RoadLayout, levels: Ints) -> tuple[Border, ...]:
    """The surface's borders, level by level."""
    if not levels.any():
        rings = area_rings(layout.outline, layout.cells)
        return tuple(Border(ring, closed=True, level=0) for ring in rings)
    cells, found = layout.cells, []
    for level in np.unique(levels):
        among, rest = np.flatnonzero(levels == level), np.flatnonzero(levels != level)
        areas = np.array(polygon_parts(union(cells.polygons[among])), dtype=object)
        for ring in area_rings(areas, cells, among=among):
            free = ~_continued(ring, cells, rest)
            found += [Border(line, closed, int(level)) for line, closed in _runs(ring, free)]
    return tuple(found)


def _continued(ring: Floats, cells: Cells, rest: Ints) -> Bools:
    """On which sides of a ring, (n,), the surface goes on in cells of another level."""
    middles = 0.5 * (ring + np.roll(ring, -1, axis=0))
    tree = shapely.STRtree(cells.polygons[rest])
    points = shapely.points(middles[:, :2])
    side, cell = tree.query(points, predicate="dwithin", distance=_MEETS)
    offered = cells.heights(rest[cell], middles[side, :2])
    goes_on = np.zeros(len(ring), dtype=np.bool_)
    goes_on[side[np.abs(offered - middles[side, 2]) < 0.5 * STOREY]] = True
    return goes_on


def _runs(ring: Floats, free: Bools) -> list[tuple[Floats, bool]]:
    """Lines along the free sides of a ring, and whether each is the whole ring."""
    if free.all():
        return [(ring, True)]
    if not free.any():
        return []
    # Begin with a side that is free after one that is not.
    first = int(np.flatnonzero(free & ~np.roll(free, 1))[0])
    ring, free = np.roll(ring, -first, axis=0), np.roll(free, -first)
    lines = []
    starts = np.flatnonzero(free & ~np.roll(free, 1))
    for start in starts:
        after = np.flatnonzero(~free[start:])
        end = start + int(after[0]) if len(after) else len(free)
        lines.append((ring[np.arange(start, end + 1) % len(ring)], False))
    return lines


def lowest_surface(layout: RoadLayout, points: Floats) -> Floats:
    """Return the height of the lowest road at points, (m, 2) [m], as (m,) [m]; NaN off the road."""
    cells = layout.cells
    tree = layout.memory.of(("tree of cells",), lambda: shapely.STRtree(cells.polygons))
    at, cell = tree.query(shapely.points(points), predicate="intersects")
    found = np.full(len(points), np.inf)
    np.minimum.at(found, at, cells.heights(cell, points[at]))
    return np.where(np.isfinite(found), found, np.nan)


def heights_on(layout: RoadLayout, level: int, points: Floats) -> Floats:
    """Return the height of a level's cells nearest to points.

    Args:
        layout: The roads.
        level: Of the cells; at least one has it.
        points: (m, 2) [m].

    Returns:
        (m,) [m].
    """
    among = np.flatnonzero(levels_of(layout).of_cell == level)
    return heights_near(layout.cells, points, among=among)
