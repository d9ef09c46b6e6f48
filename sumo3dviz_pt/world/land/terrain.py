"""The ground between roads: a terrain that meets sloped roads at their borders.

Heights are known on the roads only. Between and beyond them the nearest roads' heights are
blended; then slopes lead from every road's border up or down to that ground, at most as steep
as grass holds. Where two roads leave no room for such a slope, the terrain stays below the
lower one's, and a wall carries the higher one. Below a bridge the slopes of the lower road
win, so the space between its embankments stays open.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import shapely
from scipy import sparse, spatial
from scipy.sparse.csgraph import dijkstra

from sumo3dviz_pt.library.mesh.bands import densified, mitres
from sumo3dviz_pt.library.mesh.planar import sides
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, area_vectors, settled, unit
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.land.horizon import Land, built_points, land_around, land_mesh
from sumo3dviz_pt.world.roads.cells import Polygons, surface_heights
from sumo3dviz_pt.world.roads.drops import points_within
from sumo3dviz_pt.world.roads.layout import Levels, RoadLayout, levels_of, lowest_surface

STEP, _MOST_SAMPLES = 3.0, 30_000
"""Distance of points along borders [m], and how many there may be, about."""

_LOCAL, _AMBIENT, _ODD = 150.0, 120.0, 2.0
"""Roads within the first distance [m] of a crossing of levels are compared with the usual height
within the second one [m]; those that differ by more than the third [m] do not shape the ground."""

HeightAt = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class BorderSamples:
    """Points along the borders of roads.

    Attributes:
        points: On the border, (n, 3) [m].
        outward: Unit vectors away from the road, (n, 2).
    """

    points: Floats
    outward: Floats


class Shaping(NamedTuple):
    """Points of roads that shape the ground.

    Attributes:
        points: (n, 3) [m].
        tree: Of them in plan.
    """

    points: Floats
    tree: spatial.cKDTree


def ground_between(roads: RoadLayout, network: Network, land: Land) -> HeightAt:
    """Return the height of the ground as if no road were far above or below it.

    Args:
        roads: What is built.
        network: All roads.
        land: Its hills.
    """
    shaping = shaping_of(roads, network)

    def height_at(places: Floats) -> Floats:
        """Return height of the ground, (n, 2) -> (n,) [m]."""
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        return open_land(flat, shaping, network, land)

    return height_at


def open_land(flat: Floats, shaping: Shaping, network: Network, land: Land) -> Floats:
    """Return heights of the ground where no road changes it, (n,) [m].

    They are the land's own where those are known, and fade into the roads' and hills beyond.

    Args:
        flat: Places, (n, 2) [m].
        shaping: What `shaping_of` gave.
        network: Its heights of the land count.
        land: Its hills.
    """
    between = blended(flat, shaping) + land.heights(flat)
    if network.heights is None:
        return between
    share = network.heights.share(flat, fade=_FADE)
    real = np.where(share > 0.0, network.heights.at(flat), 0.0)
    return np.asarray(share * real + (1.0 - share) * between)


def shaping_of(roads: RoadLayout, network: Network) -> Shaping:
    """Return points of roads that shape the ground, which the layout's memory keeps."""

    def make() -> Shaping:
        levels = levels_of(roads)
        points = _shaping(border_samples(levels), network, levels)
        return Shaping(points, spatial.cKDTree(points[:, :2]))

    return roads.memory.of(("what shapes the ground",), make)


def border_samples(levels: Levels) -> BorderSamples:
    """Return points along all borders of a road surface, at most about 3 m apart."""
    total = sum(
        float(np.linalg.norm(np.diff(border.line[:, :2], axis=0), axis=1).sum())
        for border in levels.borders
    )
    step = max(STEP, total / _MOST_SAMPLES)
    points, outward = [np.zeros((0, 3))], [np.zeros((0, 2))]
    for border in levels.borders:
        line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
        dense = densified(line, step)
        dense = dense[:-1] if border.closed else dense
        points.append(dense)
        outward.append(-unit(mitres(dense, closed=border.closed)))
    return BorderSamples(np.concatenate(points), np.concatenate(outward))


def _shaping(samples: BorderSamples, network: Network, levels: Levels) -> Floats:
    """Points of roads that shape the ground, (n, 3) [m]: neither bridges nor underpasses.

    Near crossings of levels, roads far from the usual height around are left out.
    """
    lanes = np.concatenate([lane.shape for lane in network.lanes.values()])
    known = np.concatenate([samples.points, lanes])
    shared = levels.crossings.shared
    if not len(shared):
        return known
    # Find what lies near crossings.
    centres = shapely.get_coordinates(shapely.centroid(shared))
    away, _ = spatial.cKDTree(centres).query(known[:, :2])
    near = np.flatnonzero(np.asarray(away) < _LOCAL)
    # Compare it with the usual height around, to which odd heights count less each time.
    step = max(len(known) // 6000, 1)
    around = known[::step]
    pairs = spatial.cKDTree(known[near, :2]).query_ball_tree(
        spatial.cKDTree(around[:, :2]), 1.5 * _AMBIENT
    )
    odd = np.array(
        [
            abs(_usual(around[nearby], known[k]) - known[k, 2]) > _ODD
            for k, nearby in zip(near, pairs, strict=True)
        ],
        dtype=np.bool_,
    )
    return np.delete(known, near[odd], axis=0) if not odd.all() else known


def _usual(around: Floats, place: Floats) -> float:
    """The usual height around a place [m]: a mean that odd heights hardly change."""
    if not len(around):
        return float(place[2])
    away = ((around[:, :2] - place[:2]) ** 2).sum(axis=1)
    near = np.exp(-0.5 * away / (0.5 * _AMBIENT) ** 2) + 1e-9
    order = np.argsort(around[:, 2], kind="stable")
    share = np.cumsum(near[order])
    middle = float(around[order, 2][np.searchsorted(share, 0.5 * share[-1])])
    weight = near / (1.0 + (around[:, 2] - middle) ** 2)
    return float((weight * around[:, 2]).sum() / weight.sum())


def blended(flat: Floats, shaping: Shaping) -> Floats:
    """Return inverse-distance heights of the nearest roads.

    Args:
        flat: Places, (n, 2) [m].
        shaping: What `shaping_of` gave.

    Returns:
        (n,) [m].
    """
    count = min(16, len(shaping.points))
    away, near = (
        np.asarray(v).reshape(len(flat), count) for v in shaping.tree.query(flat, k=count)
    )
    weights = 1.0 / (away**2 + 4.0)
    return np.asarray((weights * shaping.points[near, 2]).sum(axis=1) / weights.sum(axis=1))


STEEPEST = 1.0 / 1.5
"""Slope of embankments and cuttings: two thirds, as grass holds."""

_MARGIN = 0.06
"""How far the terrain lies below the border of a road [m]."""

_SUNK = 0.30
"""How far it lies below the middle of a road [m]."""

_LEAST, _PUSHES = 0.052, 8
"""Depth below roads at which the terrain is lowered no more [m]; how often that is tried."""

_EDGE, _SHOULDER = 0.05, 1.0
"""Distances from a road's border to the terrain's points that have its height [m]."""

_BESIDE = (2.6, 5.5, 10.0)
"""Distances of further points, for slopes [m]."""

_CELL, _COARSE, _MOST = 10.0, 40.0, 260
"""Grid spacing near roads and elsewhere in the network [m]; most lines per axis."""

_BRIDGED = 9.0
"""How far roads lie above known land at most that an embankment carries [m]."""

_BANDS = ((15.0, 200.0), (40.0, 1000.0), (160.0, 4000.0))
"""Where heights or a picture of the land are known: spacing of points, and how far from what is
built [m]."""

_FADE = 300.0
"""Distance to the edge of known heights within which they fade into what is beyond [m]."""

_NEAR = 70.0
"""How far from roads the fine grid reaches [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """What the terrain is made of.

    Attributes:
        flat: From above, (n, 2) [m].
        known: Heights that roads give, (n,) [m]; NaN elsewhere.
        below: Heights of the roads that cover points, (n,) [m]; NaN elsewhere.
    """

    flat: Floats
    known: Floats
    below: Floats


def terrain(
    roads: RoadLayout, network: Network, *, land: Land | None = None
) -> tuple[Mesh, HeightAt]:
    """Build the terrain's mesh, and a function that gives its height at points (n, 2) [m].

    Args:
        roads: What is built; the terrain is fine around it.
        network: All roads, which give the heights further away.
        land: Its hills are added; default flat land.
    """
    if land is None:
        corners = built_points(roads.outline, network.location.boundary)
        land = land_around(corners, horizon="flat", surface="", seed=0)
    levels = levels_of(roads)
    samples = border_samples(levels)
    shaping = shaping_of(roads, network)
    fine = network.heights is not None or network.picture is not None
    points = _points(roads, samples, land, fine=fine)
    net = spatial.Delaunay(points.flat)
    faces, number = _facing_up(points.flat, net.simplices.astype(np.int64))
    z = open_land(points.flat, shaping, network, land)
    real = None if network.heights is None else network.heights.share(points.flat, fade=_FADE)
    if real is not None:
        # Where the land is known, a road high above it is a bridge, not a ridge.
        high = (points.known - z > _BRIDGED) & (real > 0.5)
        points = replace(points, known=np.where(high, np.nan, points.known))
    vertices = np.column_stack([points.flat, _sloped(points, z, faces, real)])
    shown = ~_hidden(points, vertices[:, 2], faces)
    under = road_samples(roads)
    face = number[net.find_simplex(under[:, :2])]
    vertices = _pushed_below(under, vertices, faces, on=np.where(shown[face], face, -1))
    mesh = Mesh(vertices, faces[shown], _normals(vertices, faces))
    return mesh, _height_at(vertices, faces, net, number)


def road_samples(roads: RoadLayout) -> Floats:
    """Return points of all cells, on their outlines and within, (n, 3) [m]."""
    polygons = roads.cells.polygons
    outlines = shapely.segmentize(polygons, 0.5 * STEP)
    rings, ring = shapely.get_coordinates(outlines, return_index=True)
    inside, inner = shapely.get_coordinates(shapely.point_on_surface(polygons), return_index=True)
    within, owner = points_within(roads.cells)
    flat, cell = np.concatenate([rings, inside, within]), np.concatenate([ring, inner, owner])
    return np.column_stack([flat, surface_heights(roads.cells, cell, flat)])


def _pushed_below(samples: Floats, vertices: Floats, faces: Ints, *, on: Ints) -> Floats:
    """Vertices lowered until no sample of a road lies below a face that is shown, (n, 3) [m].

    Args:
        samples: Points of roads, (k, 3) [m].
        vertices: Of the terrain, (n, 3) [m].
        faces: Its triangles, (m, 3).
        on: The triangle that is shown and lies at each point, (k,); negative where none is.
    """
    at = np.flatnonzero(on >= 0)
    face = on[at]
    pushed = vertices.copy()
    for _ in range(_PUSHES):
        above = _plane_heights(pushed[faces], face, samples[at, :2]) - samples[at, 2] + _LEAST
        low = above > 0.0
        if not low.any():
            break
        lowered = np.zeros(len(vertices))
        for k in range(3):
            np.maximum.at(lowered, faces[face[low], k], above[low])
        pushed[:, 2] -= lowered
    return pushed


def _plane_heights(corners: Floats, face: Ints, flat: Floats) -> Floats:
    """Heights of triangles' planes at points that lie on them from above, (m,) [m]."""
    a, b, c = (corners[face, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    return np.asarray(a[:, 2] - ((flat - a[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2])


def _height_at(vertices: Floats, faces: Ints, net: spatial.Delaunay, number: Ints) -> HeightAt:
    """A function that gives the height of triangles at points.

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3).
        net: Of all triangles from above.
        number: Each one's number among the faces, and -1 last; negative for one without area.
    """
    corners = vertices[faces]
    usual = float(vertices[:, 2].mean())

    def height_at(places: Floats) -> Floats:
        """Return height of the terrain at points, (n, 2) [m], as (n,) [m]."""
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        simplex = net.find_simplex(flat)
        face = number[simplex]
        at = np.flatnonzero(face >= 0)
        heights = np.full(len(flat), usual)
        heights[at] = _plane_heights(corners, face[at], flat[at])
        thin = np.flatnonzero((simplex >= 0) & (face < 0))
        heights[thin] = vertices[net.simplices[simplex[thin], 0], 2]
        return heights

    return height_at


def _points(roads: RoadLayout, samples: BorderSamples, land: Land, *, fine: bool) -> _Points:
    """All points of the terrain from above, with the heights that are known.

    Args:
        roads: What is built.
        samples: Points along its borders.
        land: What is around it.
        fine: Whether the grid is fine everywhere in the network, not only near roads.
    """
    at, out, z = samples.points[:, :2], samples.outward, samples.points[:, 2]
    away_from = partial(_away_from, roads.outline, shapely.STRtree(sides(list(roads.outline))))
    # Along the borders, and on the shoulders beside them where there is room.
    edge = at + _EDGE * out
    shoulder = at + _SHOULDER * out
    free = away_from(shoulder, 0.7 * _SHOULDER)
    beside = np.concatenate([at[1::2] + distance * out[1::2] for distance in _BESIDE])
    reach = np.repeat(_BESIDE, len(at[1::2]))
    beside = beside[away_from(beside, 0.7 * reach)]
    # On a grid, fine near roads, and on rings out to the horizon.
    grid = _grid(samples.points, land, fine=fine)
    border, _ = spatial.cKDTree(at).query(grid)
    grid = grid[np.asarray(border) > 2.0]
    rings = land_mesh(land, 0.0).vertices[:, :2]
    rings = rings[land.away(rings) > 1.0]
    if fine:
        rings = np.concatenate([rings, *_bands(land)])
    flat = np.concatenate([edge, shoulder[free], beside, grid, rings])
    known = np.full(len(flat), np.nan)
    known[: len(edge)] = z - _MARGIN
    known[len(edge) : len(edge) + int(free.sum())] = z[free] - 1.2 * _MARGIN
    # Join points at one place, first come first served, and put all below what covers them.
    places = settled(flat, 2.0**-5)
    _, first = np.unique(places, axis=0, return_index=True)
    first = np.sort(first)
    flat, known = places[first], known[first]
    below = lowest_surface(roads, flat)
    covered = np.isfinite(below)
    known[covered] = np.fmin(known[covered], below[covered] - _SUNK)
    return _Points(flat, known, below)


def _away_from(
    areas: Polygons, borders: shapely.STRtree, points: Floats, least: Floats | float
) -> Bools:
    """Which points are at least so far from all areas.

    Args:
        areas: Polygons, prepared here, for most points lie in a few large ones.
        borders: Their sides: a tree of many short ones tells distances faster.
        points: (n, 2) [m].
        least: Distance of each or of all [m].
    """
    free = np.ones(len(points), dtype=np.bool_)
    if len(points) and len(areas):
        shapely.prepare(areas)
        where = shapely.points(points)
        free[borders.query(where, predicate="dwithin", distance=least)[0]] = False
        point, area = shapely.STRtree(areas).query(where[free])
        inside = shapely.intersects(areas[area], where[free][point])
        free[np.flatnonzero(free)[point[inside]]] = False
    return free


def _bands(land: Land) -> Iterator[Floats]:
    """Yield points of grids in bands around the land's hull, (n, 2) [m]."""
    nearest = 1.0
    for step, farthest in _BANDS:
        x0, y0, x1, y1 = land.hull.buffer(farthest).bounds
        i, j = (v.ravel() for v in np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step)))
        # As above.
        flat = np.column_stack([i + 0.37 * step * (np.round((j - y0) / step) % 2), j])
        away = land.away(flat)
        yield np.asarray(flat[(away > nearest) & (away <= farthest)])
        nearest = farthest


def _grid(samples: Floats, land: Land, *, fine: bool) -> Floats:
    """Points of a grid within the land's hull, fine near samples or everywhere, (n, 2) [m]."""
    x0, y0, x1, y1 = land.hull.bounds
    step = max(_CELL, (x1 - x0) / _MOST, (y1 - y0) / _MOST)
    x, y = (np.arange(np.ceil((b - a) / step) + 1) for a, b in ((x0, x1), (y0, y1)))
    i, j = (v.ravel() for v in np.meshgrid(x, y))
    # Rows are shifted against each other, so that no four points lie on a circle.
    flat = np.column_stack([x0 + step * (i + 0.37 * (j % 2)), y0 + step * j])
    away, _ = spatial.cKDTree(samples[:, :2]).query(flat)
    every = 1 if fine else max(int(_COARSE / step), 1)
    keep = (np.asarray(away) < _NEAR) | ((i % every == 0) & (j % every == 0))
    return np.asarray(flat[keep & (land.away(flat) < 1.0)])


def _sloped(points: _Points, z: Floats, triangles: Ints, real: Floats | None) -> Floats:
    """Heights that reach all roads in slopes that are not too steep, (n,) [m].

    Args:
        points: What the terrain is made of.
        z: Heights where no road changes them, (n,) [m].
        triangles: (m, 3).
        real: How much of these is known and stays as it is, (n,).
    """
    graph = _sides(points.flat, triangles)
    fixed = np.isfinite(points.known)
    z = _smoothed(z, graph, fixed if real is None else fixed | (real > 0.5))
    lower = -_reached(graph, -points.known)
    upper = _reached(graph, points.known)
    clipped = np.minimum(np.maximum(z, lower), upper)
    return np.where(np.isfinite(clipped), clipped, z)


def _sides(flat: Floats, triangles: Ints) -> sparse.csr_matrix:
    """Lengths of the sides of triangles, as a symmetric matrix, (n, n) [m]."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ends = np.unique(np.sort(ends, axis=1), axis=0).astype(np.int64)
    length = np.linalg.norm(flat[ends[:, 0]] - flat[ends[:, 1]], axis=1)
    shape = (len(flat), len(flat))
    half = sparse.csr_matrix((length, (ends[:, 0], ends[:, 1])), shape=shape)
    return half + half.T


def _smoothed(z: Floats, graph: sparse.csr_matrix, fixed: Bools) -> Floats:
    """Heights as means of their neighbours', several times, where none is known, (n,) [m]."""
    weights = graph.copy()
    weights.data = 1.0 / np.maximum(weights.data, 0.5)
    total = np.asarray(weights.sum(axis=1)).ravel()
    for _ in range(6):
        mean = (weights @ z) / total
        z = np.where(fixed, z, mean)
    return np.asarray(z)


def _reached(graph: sparse.csr_matrix, start: Floats) -> Floats:
    """The lowest height at each point that climbs from some start at most as grass holds, (n,).

    Args:
        graph: Lengths of sides.
        start: Heights where they begin, (n,) [m]; NaN elsewhere.
    """
    begins = np.flatnonzero(np.isfinite(start))
    if not len(begins):
        return np.full(len(start), np.inf)
    # One more point leads to all starts, at the cost of their height above the lowest.
    lowest = float(start[begins].min()) - 1.0
    count = len(start)
    sides = graph.tocoo()
    cost = np.concatenate([STEEPEST * sides.data, start[begins] - lowest])
    tail = np.concatenate([sides.row, np.full(len(begins), count)])
    head = np.concatenate([sides.col, begins])
    whole = sparse.csr_matrix((cost, (tail, head)), shape=(count + 1, count + 1))
    heights = np.asarray(dijkstra(whole, indices=np.array([count])))[0, :count]
    return np.asarray(heights + lowest)


def _facing_up(flat: Floats, faces: Ints) -> tuple[Ints, Ints]:
    """Faces with their corners counter-clockwise from above; those without area go.

    Returns:
        Faces, (m, 3), and the number that each of all has among them, with -1 at the end; -1 for
        those that go.
    """
    a, b, c = (flat[faces[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    turned = np.where((twice < 0)[:, None], faces[:, ::-1], faces)
    solid = np.abs(twice) > 1e-6
    number = np.where(solid, np.cumsum(solid) - 1, -1)
    return np.asarray(turned[solid]), np.append(number, -1)


def _hidden(points: _Points, z: Floats, faces: Ints) -> Bools:
    """Which faces lie wholly below a road that rests on the ground, (m,)."""
    rests = np.isfinite(points.below) & (points.below - z < 2.0 * _SUNK)
    return np.asarray(rests[faces].all(axis=1))


def _normals(vertices: Floats, faces: Ints) -> Floats:
    """Area-weighted normals, (n, 3)."""
    areas = area_vectors(vertices, faces)
    total = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(total, faces[:, k], areas)
    total[(total == 0.0).all(axis=1)] = (0.0, 0.0, 1.0)
    return unit(total)
