"""Which stretches of road run in tunnels, where their mouths are, and the ground above them.

SUMO has no tunnels, only heights. A road that runs deep below the ground for long, with another
road above it, is taken for one. The terrain stays the open cutting that it would be without
(`world/land/terrain.py`), and a lid of ground covers it from mouth to mouth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import sparse, spatial
from scipy.sparse.csgraph import connected_components

from sumo3dviz_pt.library.mesh.planar import (
    common,
    polygon_parts,
    subtract,
    triangulate_many,
    union,
)
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, arc_length, unit
from sumo3dviz_pt.world.land.terrain import STEEPEST
from sumo3dviz_pt.world.roads.cells import STOREY
from sumo3dviz_pt.world.roads.drops import cut_on_grid
from sumo3dviz_pt.world.roads.layout import RoadLayout, levels_of

DEEP = 6.0
"""How far below the ground, or below an upper road, a road in a tunnel lies [m], at least."""

LONG = 60.0
"""Length of a tunnel [m], at least; shorter ones are underpasses in open cuttings."""

HIGHEST = 5.2
"""Height of a ceiling above the road [m], at most."""

_DECKS = 150.0
"""Shorter deep stretches below two decks, one above the other, are interchanges, no tunnels [m]."""

_COVER = 0.7
"""Ceiling and soil between a tunnel and the ground above it [m], at least."""

_NARROWEST = 2.5
"""Width of a tunnel [m], at least; paths of hikers have none."""

_STEP, _GRID = 2.0, 3.0
"""Distances of places along roads and of points of the lid [m]."""

_JOINED, _TOGETHER = 2.0, 20.0
"""Stretches and mouths closer than these [m] belong together."""

_BELOW = 0.2
"""How far the lid lies below roads on it [m]."""

_WIDEST = 40.0
"""How far a lid reaches beyond its road [m], at most."""

HeightAt = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Mouth:
    """An end of a tunnel.

    Attributes:
        middle: On the road, (3,) [m].
        outward: Unit vector out of the tunnel, (2,).
        half: Half the road's width [m].
    """

    middle: Floats
    outward: Floats
    half: float

    @property
    def across(self) -> Floats:
        """Unit vector to the right of somebody who leaves the tunnel, (2,)."""
        return np.array([self.outward[1], -self.outward[0]])

    def box(self, *, ahead: float, aside: float) -> shapely.Geometry:
        """Return the area before the mouth.

        Args:
            ahead: Its length [m].
            aside: How much wider it is than the road, on each side [m].
        """
        side, out = (self.half + aside) * self.across, ahead * self.outward
        foot = self.middle[:2]
        return shapely.Polygon([foot - side, foot + side, foot + side + out, foot - side + out])


@dataclass(frozen=True, slots=True, eq=False)
class Tunnel:
    """A road below the ground.

    Attributes:
        area: Its road from above.
        mouths: Where it ends.
        height: Of its ceiling above the road [m].
        lid: The ground above it, from above.
    """

    area: shapely.Geometry
    mouths: tuple[Mouth, ...]
    height: float
    lid: shapely.Geometry


def tunnels_of(layout: RoadLayout, ground: HeightAt) -> tuple[Tunnel, ...]:
    """Return the tunnels of a layout.

    Args:
        layout: The roads.
        ground: Height of the ground between roads, as if the deep ones were not there.
    """
    levels = levels_of(layout)
    crossings = levels.crossings
    if not len(crossings.shared):
        return ()
    tunnels = []
    flat = shapely.get_coordinates(shapely.centroid(crossings.shared))
    below = np.column_stack([flat, layout.cells.heights(crossings.lower, flat)])
    decks = below[levels.of_cell[crossings.upper] - levels.of_cell[crossings.lower] > 1]
    for runs in _connected(list(_runs(layout, ground))):
        whole = union([run.area for run in runs]).buffer(_JOINED, join_style="mitre")
        for part in polygon_parts(whole.buffer(-_JOINED, join_style="mitre")):
            long, wide = _extent(part)
            if long < LONG or wide < _NARROWEST or part.area < _NARROWEST * long:
                continue
            if _crossed(part, runs, below) and not (long < _DECKS and _crossed(part, runs, decks)):
                tunnels.append(_tunnel(layout, ground, part, runs))
    return tuple(tunnel for tunnel in tunnels if tunnel is not None)


def _connected(runs: Sequence[_DeepRun]) -> list[list[_DeepRun]]:
    """Runs in groups that touch each other from above and differ by less than a storey there."""
    if not runs:
        return []
    areas = [run.area for run in runs]
    one, other = shapely.STRtree(areas).query(areas, predicate="dwithin", distance=2.0 * _JOINED)
    joined = np.array([_meet(runs[i], runs[j]) for i, j in zip(one, other, strict=True)])
    one, other = one[joined], other[joined]
    pairs = sparse.coo_matrix((np.ones(len(one)), (one, other)), shape=(len(runs), len(runs)))
    count, label = connected_components(pairs, directed=False)
    return [[run for run, of in zip(runs, label, strict=True) if of == k] for k in range(count)]


def _crossed(part: shapely.Geometry, runs: Sequence[_DeepRun], below: Floats) -> bool:
    """Whether a road crosses above a deep area.

    Args:
        part: The area.
        runs: What it was made of.
        below: Places of lower roads below others, (n, 3) [m].
    """
    inside = below[shapely.intersects_xy(part, below[:, 0], below[:, 1])]
    line = np.concatenate([run.line for run in runs])
    _, near = spatial.cKDTree(line[:, :2]).query(inside[:, :2])
    return bool((np.abs(line[np.asarray(near, dtype=np.int64), 2] - inside[:, 2]) < STOREY).any())


def _meet(one: _DeepRun, other: _DeepRun) -> bool:
    """Whether two runs differ by less than a storey where they are closest from above."""
    away, near = spatial.cKDTree(other.line[:, :2]).query(one.line[:, :2])
    first = int(np.argmin(away))
    rise = one.line[first, 2] - other.line[int(np.asarray(near)[first]), 2]
    return bool(abs(rise) < STOREY)


def lid_height(layout: RoadLayout, tunnels: Sequence[Tunnel], ground: HeightAt) -> HeightAt:
    """Build a function that gives the height of the ground on lids, (n, 2) -> (n,) [m].

    Args:
        layout: The roads; those on the lids lie above them.
        tunnels: Below the lids.
        ground: Height of the ground between roads.
    """
    inside = union([tunnel.area for tunnel in tunnels]).buffer(0.5)
    cells = layout.cells
    spots = shapely.point_on_surface(cells.polygons)
    under = shapely.intersects(inside, spots)
    flat = shapely.get_coordinates(shapely.centroid(cells.polygons))
    known = ~shapely.is_empty(cells.polygons)
    deep = np.zeros(len(under), dtype=np.bool_)
    at = np.flatnonzero(under & known)
    deep[at] = ground(flat[at]) - cells.heights(at, flat[at]) > 0.5 * DEEP
    upper = np.flatnonzero(~deep & known)
    tree = shapely.STRtree(cells.polygons[upper])

    def height_at(places: Floats) -> Floats:
        """Return height of the lid, (n,) [m]."""
        z = ground(places)
        spot, cell = tree.query(shapely.points(places), predicate="dwithin", distance=0.5)
        above = cells.heights(upper[cell], places[spot]) - _BELOW
        near = above > z[spot] - 0.5 * DEEP
        np.minimum.at(z, spot[near], above[near])
        return z

    return height_at


def lid_mesh(tunnel: Tunnel, top: HeightAt, terrain_at: HeightAt) -> Mesh:
    """Build the ground above a tunnel; at its rim it goes down to the terrain around.

    Args:
        tunnel: Below it.
        top: What `lid_height` gave.
        terrain_at: Height of the terrain, in which the tunnel is an open cutting.
    """
    pieces = [p for part in polygon_parts(tunnel.lid) for p in cut_on_grid(part, _squares(part))]
    flat, faces, _ = triangulate_many(pieces)
    if not len(faces):
        return Mesh(np.zeros((0, 3)), faces)
    z = top(flat)
    rim = shapely.distance(tunnel.lid.boundary, shapely.points(flat)) < 0.01
    for mouth in tunnel.mouths:
        rim &= np.abs((flat - mouth.middle[:2]) @ mouth.outward) > 0.05
    z[rim] = np.minimum(z[rim], terrain_at(flat[rim]) - 0.05)
    return Mesh(np.column_stack([flat, z]), faces)


@dataclass(frozen=True, slots=True, eq=False)
class _DeepRun:
    """A deep stretch of one edge.

    Attributes:
        area: From above.
        line: Points along it, (n, 3) [m].
        ends: Its first and its last cross section: right and left border, (2, 2, 3) [m].
        ahead: Directions out of it at both ends, (2, 2).
    """

    area: shapely.Geometry
    line: Floats
    ends: Floats
    ahead: Floats


def _runs(layout: RoadLayout, ground: HeightAt) -> Iterator[_DeepRun]:
    """Deep stretches of all edges, and deep junctions."""
    for strips in layout.strips.values():
        if all(strip.look.raised for strip in strips):
            continue
        right, left = strips[0].right, strips[-1].left
        if len(right) != len(left) or len(right) < 2:
            right, left = strips[0].right, strips[0].left
        along = arc_length(0.5 * (right + left)[:, :2])
        if along[-1] < _STEP:
            continue
        at = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / _STEP)) + 1)
        sides = np.stack(
            [np.stack([np.interp(at, along, s[:, k]) for k in range(3)], 1) for s in (right, left)],
            axis=1,
        )
        middle = sides.mean(axis=1)
        deep = ground(middle[:, :2]) - middle[:, 2] >= DEEP
        for first, last in _spans(deep):
            line = sides[first : last + 1]
            ring = np.concatenate([line[:, 0, :2], line[::-1, 1, :2]])
            area = shapely.make_valid(shapely.Polygon(ring))
            ahead = unit(
                np.array([middle[first] - middle[first + 1], middle[last] - middle[last - 1]])[
                    :, :2
                ]
            )
            yield _DeepRun(area, middle[first : last + 1], line[[0, -1]], ahead)
    cells = layout.cells
    areas = np.array([k for k in cells.knots if not cells.polygons[k].is_empty], dtype=np.int64)
    if len(areas):
        spots = shapely.get_coordinates(shapely.point_on_surface(cells.polygons[areas]))
        z = cells.heights(areas, spots)
        for k in np.flatnonzero(ground(spots) - z >= DEEP):
            spot = np.array([[*spots[k], z[k]]])
            area = cells.polygons[areas[k]]
            yield _DeepRun(area, spot, np.zeros((0, 2, 3)), np.zeros((0, 2)))


def _spans(deep: Bools) -> Iterator[tuple[int, int]]:
    """First and last numbers of runs of two or more."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], deep, [False]]).astype(np.int64)))
    for start, end in ends.reshape(-1, 2):
        if end - start > 1:
            yield int(start), int(end) - 1


def _extent(part: shapely.Geometry) -> tuple[float, float]:
    """Length of an area's longer and of its shorter side [m], as a rectangle."""
    around = shapely.minimum_rotated_rectangle(part)
    corners = shapely.get_coordinates(around)
    long = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max(initial=0.0))
    return long, float(around.area) / max(long, 1e-9)


def _tunnel(
    layout: RoadLayout, ground: HeightAt, part: shapely.Geometry, runs: Sequence[_DeepRun]
) -> Tunnel | None:
    """The tunnel in a deep area; None where its mouths leave nothing of it."""
    mouths = _mouths(part, runs)
    before = [mouth.box(ahead=_TOGETHER, aside=1.0) for mouth in mouths]
    left = polygon_parts(subtract(part, before))
    if not left:
        return None
    area = max(left, key=lambda piece: piece.area)
    # Measure how deep it lies.
    cells = layout.cells
    spots, cell = _places(layout, area, ground)
    if not len(spots) or _extent(area)[0] < 0.5 * LONG:
        return None
    depth = lid_height(layout, [Tunnel(area, (), 0.0, area)], ground)(spots)
    depth = depth - cells.heights(cell, spots)
    height = float(np.clip(depth.min() - _COVER, 4.0, HIGHEST))
    # The lid covers the cutting's slopes.
    aside = float(np.clip(depth.max() / STEEPEST + 6.0, 0.0, _WIDEST))
    lid = subtract(
        area.buffer(aside, quad_segs=4),
        [mouth.box(ahead=2.0 * _WIDEST, aside=aside + 2.0) for mouth in mouths],
    )
    lid = subtract(lid, _open_roads(layout, area, lid, ground))
    pieces = [piece for piece in polygon_parts(lid) if piece.intersects(area)]
    return Tunnel(area, mouths, height, union(pieces))


def _mouths(part: shapely.Geometry, runs: Sequence[_DeepRun]) -> tuple[Mouth, ...]:
    """Where the roads of a deep area leave it: one mouth for roads side by side."""
    ends = []
    for run in runs:
        for border, ahead in zip(run.ends, run.ahead, strict=True):
            middle = border.mean(axis=0)
            beyond = shapely.Point(middle[:2] + 1.5 * _JOINED * ahead)
            if not part.intersects(beyond):
                ends.append((middle, border, ahead))
    groups: list[list[tuple[Floats, Floats, Floats]]] = []
    for end in ends:
        near = (
            group
            for group in groups
            if group[0][2] @ end[2] > 0.8
            and np.linalg.norm(group[0][0][:2] - end[0][:2]) < _TOGETHER
        )
        mouth = next(near, None)
        if mouth is None:
            groups.append([end])
        else:
            mouth.append(end)
    return tuple(_mouth(group) for group in groups)


def _mouth(ends: Sequence[tuple[Floats, Floats, Floats]]) -> Mouth:
    """One mouth for the ends of roads side by side, at the innermost of them."""
    outward = unit(np.mean([ahead for _, _, ahead in ends], axis=0)[None])[0]
    across = np.array([outward[1], -outward[0]])
    points = np.concatenate([border for _, border, _ in ends])
    low, high = (points[:, :2] @ across).min(), (points[:, :2] @ across).max()
    inner = min(float(middle[:2] @ outward) for middle, _, _ in ends)
    place = 0.5 * (low + high) * across + inner * outward
    return Mouth(np.append(place, points[:, 2].mean()), outward, float(0.5 * (high - low)))


def _places(layout: RoadLayout, area: shapely.Geometry, ground: HeightAt) -> tuple[Floats, Ints]:
    """Places on the deep cells in an area, (n, 2) [m], and these cells, (n,)."""
    cells = layout.cells
    near = np.sort(cells.tree.query(area, predicate="intersects"))
    points, owners = [np.zeros((0, 2))], [np.zeros(0, np.int64)]
    for k in near:
        piece = common(cells.polygons[k], area)
        if piece.area < 0.05:
            continue
        flat = shapely.get_coordinates(shapely.segmentize(piece, _GRID))
        points.append(flat)
        owners.append(np.full(len(flat), k))
    flat, owner = np.concatenate(points), np.concatenate(owners)
    deep = ground(flat) - cells.heights(owner, flat) > 0.5 * DEEP
    return flat[deep], owner[deep]


def _open_roads(
    layout: RoadLayout, area: shapely.Geometry, lid: shapely.Geometry, ground: HeightAt
) -> list[shapely.Geometry]:
    """Other roads below the ground near a tunnel, with their slopes: no lid covers them."""
    cells = layout.cells
    sides = []
    for k in np.sort(cells.tree.query(lid, predicate="intersects")):
        rest = common(subtract(cells.polygons[k], [area.buffer(1.0)]), lid)
        if rest.area < 1.0:
            continue
        spot = shapely.get_coordinates(shapely.point_on_surface(rest))
        depth = float((ground(spot) - cells.heights(np.array([k]), spot))[0])
        if depth > 1.5:
            slopes = rest.buffer(depth / STEEPEST + 1.0, quad_segs=2)
            sides.append(slopes.difference(area.buffer(2.0)))
    return sides


def _squares(part: shapely.Geometry) -> shapely.Geometry:
    """Squares of a grid around a polygon, (n,)."""
    low, high = np.array(part.bounds).reshape(2, 2) / _GRID
    x, y = (_GRID * np.arange(np.floor(a), np.ceil(b)) for a, b in zip(low, high, strict=True))
    corners = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(shapely.box(*corners.T, *(corners + _GRID).T))
