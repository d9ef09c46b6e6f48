"""Outlines of what is paved and of raised footways, as polygons and as rings with heights."""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import (
    common,
    polygon_parts,
    subtract,
    union,
)
from sumo3dviz_pt.model.geometry import (
    Floats,
    Ints,
)
from sumo3dviz_pt.world.roads.cells import (
    Cells,
    Crossings,
    Polygons,
    heights_near,
    stacked,
)
from sumo3dviz_pt.world.roads.strips import PAVING

_LEAST_ISLAND = 2.0
"""Smaller pieces of footway that touch no other are no islands [m2]."""


def raised_area(cells: Cells) -> Polygons:
    """Return connected footways from above, (n,) polygons with holes; levels kept apart."""
    return np.concatenate([joined_areas(cells, some) for some in raised_levels(cells)])


def without_crumbs(cells: Cells) -> tuple[Cells, Polygons]:
    """Return cells in which small pieces of footway amid carriageways are part of these.

    Ways through junctions cut footways that cross them; kerbs around what little is left would
    stand where people drive.

    Returns:
        The cells, and what `raised_area` gives of them.
    """
    areas = raised_area(cells)
    tree = shapely.STRtree(areas)
    small = [k for k, area in enumerate(areas) if area.area < _LEAST_ISLAND]
    lone = [k for k in small if len(tree.query(areas[k], predicate="dwithin", distance=0.05)) == 1]
    if not lone:
        return cells, areas
    zone = union(areas[lone]).buffer(0.02)
    index = shapely.STRtree(cells.polygons).query(zone, predicate="intersects")
    cut = np.sort(index[cells.raised[index]])
    inside = np.array([common(cells.polygons[k], zone) for k in cut], dtype=object)
    polygons = cells.polygons.copy()
    polygons[cut] = [subtract(cells.polygons[k], [zone]) for k in cut]
    count = len(polygons)
    knots = {count + n: cells.knots[k] for n, k in enumerate(cut.tolist()) if k in cells.knots}
    around = np.flatnonzero(~cells.raised)
    freed = Cells(
        np.concatenate([polygons, inside]),
        np.concatenate([cells.quads, cells.quads[cut]]),
        {**cells.knots, **knots},
        (*cells.surfaces, *(_surface_around(cells, around, piece) for piece in inside)),
        np.append(cells.raised, np.zeros(len(cut), dtype=np.bool_)),
        (*cells.owners, *(cells.owners[k] for k in cut.tolist())),
        cells.cutters,
    )
    return freed, raised_area(freed)


def _surface_around(cells: Cells, among: Ints, piece: shapely.Geometry) -> str:
    """The surface of the cell that lies most around a piece; paving where none does."""
    beside = piece.buffer(0.5)
    near = among[shapely.STRtree(cells.polygons[among]).query(beside, predicate="intersects")]
    if not len(near):
        return PAVING
    shared = shapely.area(shapely.intersection(cells.polygons[near], beside))
    return cells.surfaces[int(near[np.argmax(np.round(shared, 3))])]


def raised_levels(cells: Cells) -> list[Ints]:
    """Return numbers of raised cells, one list for each level of footways above footways."""
    raised = np.flatnonzero(cells.raised)
    if cells.is_flat or not len(raised):
        return [raised]
    crossings = cells.crossings
    both = cells.raised[crossings.lower] & cells.raised[crossings.upper]
    lower, upper, shared, gap = crossings
    among = Crossings(lower[both], upper[both], shared[both], gap[both])
    levels = stacked(among, len(cells.polygons))[raised]
    return [raised[levels == level] for level in np.unique(levels)]


def joined_areas(cells: Cells, some: Ints) -> Polygons:
    """Return connected areas of some cells, (n,) polygons with holes."""
    shape = union(cells.polygons[some])
    # Closing by a centimetre joins neighbours that rounding has parted.
    closed = shape.buffer(0.01, join_style="mitre").buffer(-0.01, join_style="mitre")
    areas = np.empty(len(parts := polygon_parts(closed)), dtype=object)
    areas[:] = parts
    return areas


def outer_area(cells: Cells) -> Polygons:
    """Return everything that is paved, as connected polygons with holes, (n,)."""
    return np.array(polygon_parts(union(cells.polygons)), dtype=object)


def area_rings(areas: Polygons, cells: Cells, *, among: Ints | None = None) -> list[Floats]:
    """Return outlines of areas at the height of the surface near them.

    Args:
        areas: Polygons.
        cells: The surface that gives the height.
        among: Numbers of the cells that count; default all.

    Returns:
        Rings, each (n, 3) [m], counter-clockwise around the area, holes clockwise;
        the first vertex is not repeated.
    """
    flat = [
        shapely.get_coordinates(ring)[:-1]
        for area in areas
        for polygon in [shapely.orient_polygons(area)]
        for ring in [polygon.exterior, *polygon.interiors]
    ]
    if not flat:
        return []
    if not cells.is_flat:
        flat = _with_corners(flat, cells)
    heights = heights_near(cells, np.concatenate(flat), among=among)
    ends = np.cumsum([len(ring) for ring in flat])[:-1]
    pairs = zip(flat, np.split(heights, ends), strict=True)
    return [np.column_stack([ring, height]) for ring, height in pairs]


def _with_corners(rings: list[Floats], cells: Cells) -> list[Floats]:
    """Rings with all corners of cells that lie on them.

    Unions drop vertices on straight lines, but there the slope may change.
    """
    corners = shapely.points(np.unique(shapely.get_coordinates(cells.polygons), axis=0))
    tree = shapely.STRtree(corners)
    lines = np.array([shapely.LinearRing(ring) for ring in rings], dtype=object)
    ring, corner = tree.query(lines, predicate="dwithin", distance=0.02)
    dense = []
    for number, line in enumerate(lines):
        own = shapely.points(rings[number])
        points = np.concatenate([own, corners[corner[ring == number]]])
        along = np.concatenate([[0.0], shapely.line_locate_point(line, points[1:])])
        along = np.sort(along)
        apart = np.concatenate([[True], np.diff(along) > 0.005])
        dense.append(shapely.get_coordinates(shapely.line_interpolate_point(line, along[apart])))
    return dense
