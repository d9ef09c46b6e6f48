"""Surfaces that are not level: small pieces of junctions, and ramps at dropped kerbs.

Areas such as junctions are cut into small pieces, which follow their heights. Kerbs are dropped
where crossings meet footways: those ramp down to the carriageway.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import without_repeats
from sumo3dviz_pt.library.mesh.planar import GRID, areal, polygon_parts, subtract
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.roads.cells import Cells, Polygons
from sumo3dviz_pt.world.roads.strips import BoundsXY, distance_to

SIDEWALK_HEIGHT = 0.12
"""How far footways lie above the carriageway [m]."""

LOWEST = 0.03
"""How high a dropped kerb still is [m]."""

_BESIDE, _BEHIND = 1.2, 1.6
"""Lengths of the ramps beside a crossing and behind the kerb [m]."""

_BEFORE, _AFTER = 4.0, 5.0
"""How far a crossing's kerb may lie before and after the crossing's end [m]."""

_GRID = 0.4
"""Largest piece of a ramp [m]."""

_FARTHEST = 130.0
"""Crossings farther from the camera's path [m] have whole kerbs."""


@dataclass(frozen=True, slots=True, eq=False)
class Drops:
    """Ends of crossings.

    Attributes:
        ends: (n, 2) [m].
        ahead: Unit vectors off the carriageway, (n, 2).
        halves: Half the crossings' widths, (n,) [m].
        names: Crossing and number of the end, (n,).
        roads: Carriageways.
        focus: Box around the camera's path [m].
        ramps: Areas of the ramps.
    """

    ends: Floats
    ahead: Floats
    halves: Floats
    names: tuple[str, ...]
    roads: shapely.STRtree
    focus: BoundsXY | None
    ramps: shapely.STRtree

    def local(self, k: int, points: Floats) -> Floats:
        """Return points, (n, 2) [m], in the frame of an end.

        Args:
            k: Number of the end.
            points: (n, 2) [m].

        Returns:
            Distances from the end, off the carriageway and to the left, (n, 2) [m].
        """
        x, y = (points[:, axis] - self.ends[k, axis] for axis in (0, 1))
        ahead = self.ahead[k]
        # Sums without BLAS, which rounds a point by how many there are.
        return np.stack([x * ahead[0] + y * ahead[1], y * ahead[0] - x * ahead[1]], axis=1)

    def frame(self, k: int, places: Floats) -> Floats:
        """Return places in the frame of end k as points: the inverse of `local`."""
        ahead = self.ahead[k]
        left = np.array([-ahead[1], ahead[0]])
        return np.asarray(self.ends[k] + places[..., :1] * ahead + places[..., 1:] * left)

    def squares(self, k: int) -> list[shapely.Geometry]:
        """Return the ramp's area in small pieces."""
        wide = self.halves[k] + _BESIDE
        along = np.linspace(-_BEFORE, _AFTER, round((_BEFORE + _AFTER) / _GRID) + 1)
        count = int(np.ceil(2 * wide / _GRID))
        across = np.linspace(-wide, wide, count + 1)
        grid = np.stack(np.meshgrid(along, across, indexing="ij"), axis=-1)
        flat = self.frame(k, grid)
        quads = np.stack([flat[:-1, :-1], flat[1:, :-1], flat[1:, 1:], flat[:-1, 1:]], axis=2)
        return list(shapely.polygons(quads.reshape(-1, 4, 2)))

    def at(self, shape: shapely.Geometry) -> tuple[str, ...]:
        """Return names of the ends whose ramps meet a shape."""
        met = self.ramps.query(shape, predicate="intersects")
        return tuple(self.names[k] for k in sorted(met.tolist()))

    def area(self, k: int) -> shapely.Geometry:
        """Return the ramp's whole area."""
        wide = self.halves[k] + _BESIDE
        corners = [[-_BEFORE, -wide], [_AFTER, -wide], [_AFTER, wide], [-_BEFORE, wide]]
        return shapely.Polygon(self.frame(k, np.array(corners)))


def find_drops(network: Network, cells: Cells, focus: BoundsXY | None) -> Drops:
    """Find ends of all crossings near the camera; none without a focus.

    Args:
        network: The network.
        cells: The surface.
        focus: Box around the camera's path [m].
    """
    ends, ahead, halves, names = [], [], [], []
    for edge in network.edges.values() if focus is not None else ():
        if edge.function != "crossing":
            continue
        line = without_repeats(edge.lanes[0].shape)[:, :2]
        if len(line) < 2 or distance_to(focus, line).min() > _FARTHEST:
            continue
        for number, (end, before) in enumerate(((line[0], line[1]), (line[-1], line[-2]))):
            names.append(f"{edge.id}/{number}")
            ends.append(end)
            ahead.append((end - before) / np.hypot(*(end - before)))
            halves.append(0.5 * edge.lanes[0].width)
    # Ramps lie around their ends.
    drops = Drops(
        np.array(ends).reshape(-1, 2),
        np.array(ahead).reshape(-1, 2),
        np.array(halves),
        tuple(names),
        shapely.STRtree(cells.polygons[~cells.raised]),
        focus,
        shapely.STRtree([]),
    )
    return replace(drops, ramps=shapely.STRtree([drops.area(k) for k in range(len(ends))]))


def rise_at(drops: Drops, points: Floats) -> Floats:
    """Return how far footways lie above the carriageway.

    Args:
        drops: Where they are lowered.
        points: On footways, (n, 2) [m].

    Returns:
        (n,) [m].
    """
    share = np.ones(len(points))
    if not len(points):
        return LOWEST + (SIDEWALK_HEIGHT - LOWEST) * share
    low, high = points[:, :2].min(axis=0) - 0.05, points[:, :2].max(axis=0) + 0.05
    order = np.argsort(points[:, 0], kind="stable")
    for k in sorted(drops.ramps.query(shapely.box(*low, *high)).tolist()):
        some = _in_box(points, order, drops.ramps.geometries[k].bounds)
        place = drops.local(k, points[some])
        beside = (np.abs(place[:, 1]) - drops.halves[k]) / _BESIDE
        within = (beside < 1.0) & (place[:, 0] > -_BEFORE - 0.01) & (place[:, 0] < _AFTER + 0.01)
        near, beside = some[within], beside[within]
        if not len(near):
            continue
        # Ramps rise with the distance from the crossing or from the kerb.
        away = np.full(len(near), np.inf)
        (spot, _), distance = drops.roads.query_nearest(
            shapely.points(points[near]),
            max_distance=_BEHIND,
            return_distance=True,
            all_matches=False,
        )
        away[spot] = distance
        ramp = np.clip(np.maximum(beside, away / _BEHIND), 0.0, 1.0)
        share[near] = np.minimum(share[near], ramp)
    return LOWEST + (SIDEWALK_HEIGHT - LOWEST) * share


def _in_box(points: Floats, order: Ints, box: BoundsXY) -> Ints:
    """Numbers of the points, (n, 2) [m], in a box and up to 5 cm around it, ascending.

    Args:
        points: Places [m].
        order: Their numbers by rising x, (n,).
        box: Parallel to the axes [m].
    """
    x0, y0, x1, y1 = box
    first, last = np.searchsorted(points[order, 0], [x0 - 0.05, x1 + 0.05])
    index = np.sort(order[first:last])
    y = points[index, 1]
    return np.asarray(index[(y >= y0 - 0.05) & (y <= y1 + 0.05)])


def cut_for_ramps(shape: shapely.Geometry, drops: Drops) -> list[shapely.Geometry]:
    """Return pieces of a footway that are small where it ramps down."""
    pieces = polygon_parts(shape)
    for k in sorted(drops.ramps.query(shape, predicate="intersects").tolist()):
        area = drops.ramps.geometries[k]
        touched = [piece for piece in pieces if piece.intersects(area)]
        if not touched:
            continue
        pieces = [piece for piece in pieces if not piece.intersects(area)]
        squares = np.array(drops.squares(k), dtype=object)
        for piece in touched:
            pieces += polygon_parts(subtract(piece, [area]))
            pieces += cut_on_grid(piece, squares)
    return pieces


def cut_on_grid(piece: shapely.Geometry, squares: Polygons) -> list[shapely.Geometry]:
    """Return the parts of squares, (n,), that lie on a polygon."""
    shapely.prepare(piece)
    near = squares[shapely.intersects(piece, squares)]
    whole = shapely.contains_properly(piece, near)
    cut = shapely.intersection(piece, near[~whole], grid_size=GRID).tolist()
    return [*near[whole], *(part for some in cut for part in polygon_parts(areal(some)))]


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
