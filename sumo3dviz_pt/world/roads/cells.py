"""The road surface as cells: small polygons of known height that never overlap.

Lanes become quads between their borders; walking areas and junctions become whole polygons. Where
two overlap, the later one is cut, so lanes win over footways, footways over walking areas and those
over junctions. Heights meet without steps where cells meet. Cells more than a storey apart are a
bridge and the road below it and leave each other alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from sumo3dviz_pt.library.mesh.planar import GRID, areal, common, subtract, union
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh
from sumo3dviz_pt.world.roads.strips import Strip

STOREY = 2.5
"""Surfaces further apart than this [m] are on different levels."""

_CRUMB = 2e-5
"""Overlaps below this area [m2] are left alone."""

_SQUARE = 0.5
"""Side of the squares in which cells that climb away from each other are cut [m]."""

_BLUR, _RIDGE = 0.5, 0.02
"""Known heights closer than this [m] are evened out; how much slopes across rows of known points
are held back."""

_ROWS = 500
"""Places whose heights are found at once."""

Polygons = NDArray[Any]
"""Shapely geometries, (n,)."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Pieces of surface in order of precedence.

    Attributes:
        polygons: Their outlines from above, (n,).
        quads: Corners of lane cells, counter-clockwise from the right border's
            start, (n, 4, 3) [m]; NaN for areas.
        knots: Points of known height of area cells, by cell, each (k, 3) [m].
        surfaces: Surface keys, (n,).
        raised: Which lie on the height of a kerb, (n,).
        owners: Edge or junction ids, (n,).
        cutters: Cells that were cut away from a cell, by cell.
    """

    polygons: Polygons
    quads: Floats
    knots: Mapping[int, Floats]
    surfaces: tuple[str, ...]
    raised: Bools
    owners: tuple[str, ...]
    cutters: Mapping[int, Ints]

    @cached_property
    def is_flat(self) -> bool:
        """Whether all cells have one height."""
        heights = [k[:, 2] for k in self.knots.values()] + [self.quads[..., 2].ravel()]
        values = np.concatenate(heights)
        values = values[np.isfinite(values)]
        return not len(values) or float(np.ptp(values)) < 1e-3

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Of all polygons."""
        return shapely.STRtree(self.polygons)

    @cached_property
    def lanes(self) -> Ints:
        """Numbers of the cells that are lanes, (k,)."""
        return np.flatnonzero(~np.isnan(self.quads[:, 0, 0]))

    @cached_property
    def lane_tree(self) -> shapely.STRtree:
        """Of the whole quads of `lanes`."""
        return shapely.STRtree(quad_polygons(self.quads[self.lanes]))

    @cached_property
    def crossings(self) -> Crossings:
        """The pairs of cells that overlap from above, a storey apart or more."""
        return _crossings_of(self)

    def heights(self, index: Ints, points: Floats) -> Floats:
        """Return the height of cells at points that lie on them or near them.

        A quad is ruled between its two ends; an area follows the planes that fit its known
        points best around each place.

        Args:
            index: Which cell each point belongs to, (m,).
            points: (m, 2) [m].

        Returns:
            (m,) [m].
        """
        quads = self.quads[index]
        first = _distance_to_line(points, quads[:, 0], quads[:, 3])
        last = _distance_to_line(points, quads[:, 1], quads[:, 2])
        share = np.clip(first / np.maximum(first + last, 1e-9), 0.0, 1.0)
        heights = (1 - share) * quads[:, [0, 3], 2].mean(axis=1) + share * quads[:, [1, 2], 2].mean(
            axis=1
        )
        areas = np.flatnonzero(np.isnan(heights))
        areas = areas[np.argsort(index[areas], kind="stable")]
        cells, starts = np.unique(index[areas], return_index=True)
        for cell, here in zip(cells, np.split(areas, starts[1:]), strict=False):
            heights[here] = fitted_heights(self.knots[int(cell)], points[here])
        return np.asarray(heights)


def lane_cells(strips: Sequence[Strip], owners: Sequence[str]) -> Cells:
    """Return quads of strips, in their order."""
    quads = [strip.quads for strip in strips]
    counts = [len(quad) for quad in quads]
    corners = np.concatenate(quads) if quads else np.zeros((0, 4, 3))
    index = np.repeat(np.arange(len(strips)), counts).tolist()
    return Cells(
        quad_polygons(corners),
        corners,
        {},
        tuple(strips[i].look.surface for i in index),
        np.array([strips[i].look.raised for i in index], dtype=np.bool_),
        tuple(owners[i] for i in index),
        {},
    )


def area_cells(
    polygons: Sequence[shapely.Geometry],
    *,
    knots: Sequence[Floats],
    surfaces: Sequence[str],
    raised: bool,
    owners: Sequence[str],
) -> Cells:
    """Return cells of whole polygons with points of known height.

    Args:
        polygons: Outlines from above, n of them [m].
        knots: Points of known height of each polygon, (k, 3) [m].
        surfaces: Surface key of each.
        raised: Whether they lie on the height of a kerb.
        owners: Edge or junction id of each.
    """
    count = len(polygons)
    return Cells(
        _geometries(polygons),
        np.full((count, 4, 3), np.nan),
        dict(enumerate(knots)),
        tuple(surfaces),
        np.full(count, raised),
        tuple(owners),
        {},
    )


def join_cells(groups: Sequence[Cells]) -> Cells:
    """Join groups one after the other; earlier ones take precedence."""
    starts = np.cumsum([0, *(len(g.polygons) for g in groups)])
    knots = {
        int(start) + key: value
        for g, start in zip(groups, starts, strict=False)
        for key, value in g.knots.items()
    }
    return Cells(
        np.concatenate([g.polygons for g in groups]),
        np.concatenate([g.quads for g in groups]),
        knots,
        tuple(s for g in groups for s in g.surfaces),
        np.concatenate([g.raised for g in groups]),
        tuple(o for g in groups for o in g.owners),
        {},
    )


class Overlaps(NamedTuple):
    """Pairs of cells that overlap on one level.

    Attributes:
        winners: Cells with the higher precedence, (m,).
        losers: Cells with the lower precedence, (m,).
        parts: What to cut from each loser, (m,); None where it is all of the winner.
    """

    winners: Ints
    losers: Ints
    parts: Polygons


def without_overlaps(cells: Cells) -> Cells:
    """Cut from every cell what belongs to cells before it on the same level."""
    first, second, parts = overlaps(cells)
    if not len(first):
        return cells
    polygons = cells.polygons.copy()
    cutters: dict[int, Ints] = {}
    order = np.argsort(second, kind="stable")
    loser, starts = np.unique(second[order], return_index=True)
    for index, pairs in zip(loser, np.split(order, starts[1:]), strict=True):
        cutters[int(index)] = first[pairs]
        cut = [parts[k] if parts[k] is not None else cells.polygons[first[k]] for k in pairs]
        polygons[index] = subtract(cells.polygons[index], cut)
    return replace(cells, polygons=polygons, cutters=cutters)


def overlaps(cells: Cells, *, above: float = _CRUMB) -> Overlaps:
    """Return the pairs of cells that overlap on one level.

    Args:
        cells: In order of precedence.
        above: Overlaps of less than this area do not count [m2].
    """
    tree = shapely.STRtree(cells.polygons)
    one, other = tree.query(cells.polygons, predicate="intersects")
    ordered = one < other
    first, second = one[ordered], other[ordered]
    shared = shapely.intersection(cells.polygons[first], cells.polygons[second], grid_size=GRID)
    real = shapely.area(shared) > above
    first, second, shared = first[real], second[real], shared[real]
    parts = np.full(len(first), None, dtype=object)
    if not len(first) or cells.is_flat:
        return Overlaps(first, second, parts)
    # Where one climbs away from the other, only the part within a storey is cut.
    points, pair = shapely.get_coordinates(shared, return_index=True)
    gap = np.abs(cells.heights(first[pair], points) - cells.heights(second[pair], points))
    low, high = np.full(len(first), np.inf), np.zeros(len(first))
    np.minimum.at(low, pair, gap)
    np.maximum.at(high, pair, gap)
    for k in np.flatnonzero((low < STOREY) & (high >= STOREY)):
        parts[k] = _within_storey(cells, int(first[k]), int(second[k]), areal(shared[k]))
    near = np.array(
        [
            high[k] < STOREY if parts[k] is None else not parts[k].is_empty
            for k in range(len(first))
        ],
        dtype=np.bool_,
    )
    return Overlaps(first[near], second[near], parts[near])


def _within_storey(cells: Cells, one: int, other: int, shared: shapely.Geometry) -> Any:
    """What to cut from a cell below another: squares where they are less than a storey apart."""
    x0, y0, x1, y1 = (np.floor(shared.bounds[k] / _SQUARE) + (k > 1) for k in range(4))
    x, y = (each.ravel() for each in np.meshgrid(np.arange(x0, x1), np.arange(y0, y1)))
    squares = shapely.box(_SQUARE * x, _SQUARE * y, _SQUARE * (x + 1), _SQUARE * (y + 1))
    pieces = shapely.intersection(squares, shared, grid_size=GRID)
    points, square = shapely.get_coordinates(
        shapely.segmentize(pieces, 0.5 * _SQUARE), return_index=True
    )
    gap = cells.heights(np.full(len(points), one), points)
    gap -= cells.heights(np.full(len(points), other), points)
    low = np.full(len(squares), np.inf)
    np.minimum.at(low, square, np.abs(gap))
    # No hair of the loser is left along the winner's border.
    return common(cells.polygons[one].buffer(100 * GRID), union(squares[low < STOREY]))


def quad_polygons(corners: Floats) -> Polygons:
    """Return valid polygons of quads; folded ones (inside sharp bends) become their hull."""
    if not len(corners):
        return np.zeros(0, dtype=object)
    polygons = np.asarray(shapely.polygons(corners[..., :2]))
    folded = ~shapely.is_valid(polygons)
    polygons[folded] = [areal(shapely.convex_hull(quad)) for quad in polygons[folded]]
    return polygons


def _geometries(shapes: Sequence[shapely.Geometry]) -> Polygons:
    """An object array, whatever the number of shapes."""
    array = np.empty(len(shapes), dtype=object)
    array[:] = [areal(shape) for shape in shapes]
    return array


def fitted_heights(knots: Floats, points: Floats) -> Floats:
    """Return heights of the planes that fit known points best around places.

    A moving least-squares fit (Lancaster and Salkauskas 1981, doi:10.2307/2007507): every place
    has a plane of its own, for which near points count most. A slope stays a slope, and heights
    never leave the range of those that are known.

    Args:
        knots: Points of known height, (k, 3) [m], k >= 1.
        points: (m, 2) [m].

    Returns:
        (m,) [m].
    """
    low, high = float(knots[:, 2].min()), float(knots[:, 2].max())
    if low == high:
        return np.full(len(points), low)
    heights = [_fitted(knots, some) for some in np.array_split(points, len(points) // _ROWS + 1)]
    return np.clip(np.concatenate(heights), low, high)


def _fitted(knots: Floats, points: Floats) -> Floats:
    """Heights as `fitted_heights` gives, beyond the known range too, (m,) [m]."""
    east, north = (knots[None, :, k] - points[:, None, k] for k in range(2))
    weights = (east**2 + north**2 + _BLUR**2) ** -2.0
    weights /= weights.sum(axis=1, keepdims=True)
    # Weighted means and variances around them, as seen from each place.
    x, y, z = (weights * east).sum(axis=1), (weights * north).sum(axis=1), weights @ knots[:, 2]
    east, north = east - x[:, None], north - y[:, None]
    pairs = ((east, east), (east, north), (north, north))
    xx, xy, yy = ((weights * a * b).sum(axis=1) for a, b in pairs)
    rise = knots[None, :, 2] - z[:, None]
    xz, yz = (weights * east * rise).sum(axis=1), (weights * north * rise).sum(axis=1)
    # Solve for the slopes; across points in one row, the plane is level.
    ridge = _RIDGE * (xx + yy) + 1e-9
    xx, yy = xx + ridge, yy + ridge
    scale = 1.0 / (xx * yy - xy**2)
    return np.asarray(z - scale * (x * (yy * xz - xy * yz) + y * (xx * yz - xy * xz)))


def _distance_to_line(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distance from points, (m, 2), to the lines through start and end, (m, 3) [m]."""
    along = (end - start)[:, :2]
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    away = points - start[:, :2]
    return np.asarray(np.abs(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]) / length)


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


def _crossings_of(cells: Cells) -> Crossings:
    """What `Cells.crossings` keeps."""
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
    point, cell = tree.query_nearest(shapely.points(points), all_matches=False)
    heights = np.zeros(len(points))
    number = cell if among is None else among[cell]
    heights[point] = surface_heights(cells, number, points[point])
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
    point, face = tree.query(shapely.points(points[:, :2]), predicate="intersects")
    a, b, c = (corners[face, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    away = points[point, :2] - a[:, :2]
    level = a[:, 2] - (away * normal[:, :2]).sum(axis=1) / np.maximum(normal[:, 2], 1e-9)
    miss = np.abs(level - points[point, 2])
    # The nearest triangle is written last and so stays.
    order = np.argsort(-miss, kind="stable")
    order = order[miss[order] < STOREY]
    moved = points.copy()
    moved[point[order], 2] = level[order]
    return moved
