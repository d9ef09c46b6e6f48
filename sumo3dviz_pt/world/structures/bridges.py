"""What carries roads above the ground: decks on piers, and walls where no slope has room.

Walls, decks and linings are of bare concrete. A deck is a slab under the road, wider than the
girder below it. Piers are round columns that keep off the roads below.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.materials import material_name, metres_per_tile
from sumo3dviz_pt.library.mesh.bands import between, densified, mitres, walls
from sumo3dviz_pt.library.mesh.planar import common, polygon_parts, triangulate_many, union
from sumo3dviz_pt.library.street.barriers import swept, upright_boxes
from sumo3dviz_pt.model.geometry import (
    UNWORN,
    Bools,
    Floats,
    Ints,
    Mesh,
    arc_length,
    area_vectors,
    merge_meshes,
)
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.land.terrain import STEEPEST
from sumo3dviz_pt.world.roads.cells import STOREY, Polygons
from sumo3dviz_pt.world.roads.layout import (
    Border,
    Levels,
    RoadLayout,
    heights_on,
    levels_of,
    lowest_surface,
)
from sumo3dviz_pt.world.roads.outlines import area_rings

SURFACE = "concrete"
"""Its key among the surfaces."""

MATERIAL = material_name(SURFACE)


def concrete(mesh: Mesh) -> Mesh:
    """Return a mesh that shows concrete: no two faces share a corner.

    The texture lies on each face along the two axes that it faces least.
    """
    if not len(mesh.faces):
        return mesh
    corners = mesh.vertices[mesh.faces]
    facing = np.abs(area_vectors(mesh.vertices, mesh.faces))
    # A wall shows its height upright, however steep it is.
    facing[:, 2] *= 0.7
    axis = np.argmax(np.round(facing, 6), axis=1)
    first, second = np.array([1, 0, 0])[axis], np.array([2, 2, 1])[axis]
    rows = np.arange(len(corners))[:, None]
    ends = np.arange(3)[None, :]
    shift = np.floor(mesh.vertices.min(axis=0))
    local = corners - shift
    uvs = np.stack([local[rows, ends, k[:, None]] for k in (first, second)], axis=-1)
    count = 3 * len(corners)
    return Mesh(
        corners.reshape(-1, 3),
        np.arange(count).reshape(-1, 3),
        None,
        uvs.reshape(-1, 2) / metres_per_tile(SURFACE),
        np.tile(UNWORN, (count, 1)),
    )


SLAB, THICKNESS = 0.35, 1.0
"""Depths of the slab's and of the girder's lower face below the road [m]."""

_INSET = 0.7
"""How far the girder's sides lie within the deck's [m]."""

_DECKS_LEAST = 0.9
"""A deck is built where the ground lies lower than this below the road [m]."""

_STEP = 3.0
"""Distance of points at which the ground's depth is found [m]."""

HeightAt = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Deck:
    """The cells of one level that cross others.

    Attributes:
        level: Of its cells.
        cells: Their numbers, (n,).
        pieces: What of each belongs to the deck, (n,) geometries.
        area: All of it.
    """

    level: int
    cells: Ints
    pieces: Polygons
    area: shapely.Geometry


def decks_of(layout: RoadLayout, zone: shapely.Geometry, height_at: HeightAt) -> list[Deck]:
    """Return the decks within a zone: pieces of cells that lie above open ground.

    Args:
        layout: The roads.
        zone: Where roads may be bridges.
        height_at: Height of the ground.
    """
    cells, of_cell = layout.cells, levels_of(layout).of_cell
    near = np.sort(shapely.STRtree(cells.polygons).query(zone, predicate="intersects"))
    pieces = np.array([common(cells.polygons[k], zone) for k in near], dtype=object)
    open_below = [_open(layout, int(k), p, height_at) for k, p in zip(near, pieces, strict=True)]
    near, pieces = near[open_below], pieces[open_below]
    decks = []
    for level in np.unique(of_cell[near]):
        here = of_cell[near] == level
        area = union(pieces[here])
        decks.append(Deck(int(level), near[here], pieces[here], area))
    return decks


def deck_mesh(deck: Deck, layout: RoadLayout) -> Mesh:
    """Build the slab and the girder below it."""
    girder = deck.area.buffer(-_INSET, join_style="mitre")
    narrow = girder.is_empty
    slab = _slab(deck, layout, deck.area, 0.05, THICKNESS if narrow else SLAB)
    return merge_meshes([slab, *([] if narrow else [_slab(deck, layout, girder, SLAB, THICKNESS)])])


def _open(layout: RoadLayout, cell: int, piece: shapely.Geometry, height_at: HeightAt) -> bool:
    """Whether the ground lies well below some point of a piece's border."""
    if piece.is_empty:
        return False
    points = shapely.get_coordinates(shapely.segmentize(piece, _STEP))
    height = layout.cells.heights(np.full(len(points), cell), points)
    return bool((height - height_at(points) > _DECKS_LEAST).any())


def _slab(
    deck: Deck, layout: RoadLayout, area: shapely.Geometry, top: float, bottom: float
) -> Mesh:
    """A slab below a part of a deck: its lower face and its sides."""
    down = np.array([0.0, 0.0, 1.0])
    rings = area_rings(np.array(polygon_parts(area), dtype=object), layout.cells, among=deck.cells)
    sides = walls([ring - top * down for ring in rings], [ring - bottom * down for ring in rings])
    # Its lower face follows every cell.
    parts = [
        (part, int(cell))
        for cell, piece in zip(deck.cells, deck.pieces, strict=True)
        for part in polygon_parts(common(piece, area))
    ]
    flat, faces, owner = triangulate_many([part for part, _ in parts])
    if not len(faces):
        return sides
    height = layout.cells.heights(np.array([cell for _, cell in parts])[owner], flat)
    return merge_meshes([sides, Mesh(np.column_stack([flat, height - bottom]), faces[:, ::-1])])


SPACING = 25.0
"""Distance of piers [m], about."""

RADIUS = 0.5
"""Of a column [m]."""

_OFF = 1.2
"""Distance of columns from roads below [m], at least."""

_PIERS_LEAST = 2.5
"""Height of a column above the ground [m], at least."""

_APART = 9.0
"""Piers stand at least this far from each other [m]."""

_WIDE = 8.0
"""Roads wider than this [m] stand on two columns side by side."""

_SIDES = 16


def piers(layout: RoadLayout, decks: Sequence[Deck], height_at: HeightAt) -> Mesh:
    """Build the piers of all decks.

    Args:
        layout: The roads.
        decks: What stands on them.
        height_at: Height of the ground.
    """
    feet = [foot for deck in decks for foot in _feet(layout, deck, height_at)]
    return merge_meshes([_column(*foot) for foot in feet])


def _feet(layout: RoadLayout, deck: Deck, height_at: HeightAt) -> Iterator[tuple[Floats, float]]:
    """Feet of the columns of a deck, (3,) [m], and the heights of their tops [m]."""
    owners = sorted({layout.cells.owners[k] for k in deck.cells} & set(layout.strips))
    for owner in owners:
        strips = layout.strips[owner]
        right, left = strips[0].right, strips[-1].left
        if len(right) != len(left):
            right, left = strips[0].right, strips[0].left
        middle = 0.5 * (right + left)
        distance = arc_length(middle[:, :2])
        at = np.arange(0.5, distance[-1], 1.0)
        if not len(at):
            continue
        way = np.column_stack([np.interp(at, distance, middle[:, k]) for k in range(2)])
        over = np.asarray(shapely.intersects_xy(deck.area, way[:, 0], way[:, 1]))
        if not over.any():
            continue
        top = heights_on(layout, deck.level, way) - THICKNESS
        ground = height_at(way)
        free = over & (top - ground > _PIERS_LEAST) & ~_above_roads(layout, way, top)
        across = np.stack([np.interp(at, distance, (left - right)[:, k]) for k in range(2)], axis=1)
        shares = (-0.28, 0.28) if np.linalg.norm(across, axis=1).max() > _WIDE else (0.0,)
        for k in _chosen(over & (top - ground > _PIERS_LEAST), free):
            for share in shares:
                spot = way[k] + share * across[k]
                if not _above_roads(layout, spot[None], top[k : k + 1])[0]:
                    foot = float(height_at(spot[None])[0]) - 0.5
                    yield np.array([*spot, foot]), float(top[k]) + 0.1


def _above_roads(layout: RoadLayout, places: Floats, top: Floats) -> Bools:
    """Which places, (n, 2), lie above or close to lower roads, (n,)."""
    turn = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    around = (RADIUS + _OFF) * np.column_stack([np.cos(turn), np.sin(turn)])
    shifts = np.vstack([np.zeros((1, 2)), around])
    below = lowest_surface(layout, (places[:, None] + shifts).reshape(-1, 2))
    below = below.reshape(len(places), len(shifts))
    lower = np.isfinite(below) & (below < (top + THICKNESS - STOREY)[:, None])
    return np.asarray(lower.any(axis=1))


def _chosen(high: Bools, free: Bools) -> list[int]:
    """Where along an edge, at steps of 1 m, piers stand.

    They stand on both sides of what they must keep off, and evenly between.
    """
    if not high.any():
        return []
    chosen: list[int] = []
    blocked = high & ~free
    sides = np.flatnonzero(free & (np.roll(blocked, 1) | np.roll(blocked, -1)))
    first, last = int(np.flatnonzero(high)[0]), int(np.flatnonzero(high)[-1])
    spans = max(round((last - first) / SPACING), 1)
    even = np.linspace(first, last, spans + 1)[1:-1].round().astype(np.int64)
    for k in [*sides.tolist(), *even.tolist()]:
        if free[k] and all(abs(k - other) >= _APART for other in chosen):
            chosen.append(int(k))
    return chosen


def _column(foot: Floats, top: float) -> Mesh:
    """A round column."""
    turn = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    ring = foot + RADIUS * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    upper = np.column_stack([ring[:, :2], np.full(_SIDES, top)])
    return between(upper, ring, closed=True)


HIGHEST_WALL = 9.0
"""Roads this far above the ground [m] stand on bridges."""


_SEEN = 0.15
"""Walls lower than this [m] are hidden by the slope beside the road."""

_FALL = 0.9
"""Drops of more than this [m] get a parapet."""

_FOOT = 0.5
"""How far walls reach into the ground [m]."""

_BEYOND = 2
"""Points by which parapets reach beyond the drop."""

_BEAM = np.array([(0.02, -0.42), (0.02, 0.16), (-0.36, 0.16), (-0.36, -0.42)])
"""Section of the beam along an edge: to the left and up [m]."""

_RAILS = ((0.28, 0.02), (0.56, 0.02), (0.84, 0.02), (1.12, 0.035))
"""Heights of a parapet's rails above the road and half their thickness [m]."""

_POST = 2.0
"""Distance of a parapet's posts [m]."""

_FARTHEST = 300.0
"""Parapets farther from every camera [m] are left out."""

_AXIS = -0.18
"""Where a parapet stands, to the left of the road's border [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """The side of a road above the ground.

    Attributes:
        line: Points along the border, (n, 3) [m]; a closed one repeats its first.
        depth: Of the ground below them, (n,) [m].
        spanning: Where the road is a bridge, (n,).
    """

    line: Floats
    depth: Floats
    spanning: Bools


def build_structures(layout: RoadLayout, height_at: HeightAt) -> tuple[StaticPart, ...]:
    """Build bridges and retaining walls; nothing where roads lie on the ground.

    Args:
        layout: The roads.
        height_at: Height of the ground.
    """
    if layout.cells.is_flat:
        return ()
    zone = bridge_zone(levels_of(layout))
    sides = _sides(layout, height_at)
    decks = decks_of(layout, zone, height_at)
    shell = [*(_walls(side) for side in sides), *(_beams(side) for side in sides)]
    shell += [deck_mesh(deck, layout) for deck in decks]
    shell.append(piers(layout, decks, height_at))
    return _parts("walls", MATERIAL, [concrete(merge_meshes(_bare(shell)))])


def build_parapets(
    layout: RoadLayout, height_at: HeightAt, *, eyes: Floats | None = None
) -> tuple[StaticPart, ...]:
    """Build posts and rails along bridges and walls.

    Args:
        layout: The roads.
        height_at: Height of the ground.
        eyes: Cameras, (n, 3) [m]: only what stands near them is built; default everything.
    """
    if layout.cells.is_flat:
        return ()
    meshes = [mesh for side in _sides(layout, height_at) for mesh in _parapets(side, eyes)]
    return _parts("parapets", "galvanised", meshes)


def _parts(name: str, material: str, meshes: list[Mesh]) -> tuple[StaticPart, ...]:
    """One part of several meshes, if they have any face."""
    whole = merge_meshes(meshes)
    return (StaticPart(f"ground/{name}", "ground", Part(whole, material)),) * bool(len(whole.faces))


def _sides(layout: RoadLayout, height_at: HeightAt) -> list[_Side]:
    """The sides of roads along all borders, which are kept in the layout's memory."""

    def make() -> list[_Side]:
        levels = levels_of(layout)
        lines = [_dense(border) for border in levels.borders]
        beside = [line[:, :2] - 0.08 * mitres(line) for line in lines]
        ends = np.cumsum([len(line) for line in lines])[:-1]
        if not lines:
            return []
        ground = np.split(height_at(np.concatenate(beside)), ends)
        zone = bridge_zone(levels)
        shapely.prepare(zone)
        return [_side(line, z, zone) for line, z in zip(lines, ground, strict=True)]

    return layout.memory.of(("sides",), make)


def bridge_zone(levels: Levels) -> shapely.Geometry:
    """Return where upper roads may be bridges: above lower roads and their slopes."""
    crossings = levels.crossings
    if not len(crossings.shared):
        return shapely.Polygon()
    reach = crossings.gap / STEEPEST + 6.0
    return union(shapely.buffer(crossings.shared, reach, quad_segs=4))


def _dense(border: Border) -> Floats:
    """Points along a border, (n, 3) [m]; of a closed one, the first comes again."""
    line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
    return densified(line, _STEP)


def _side(line: Floats, ground: Floats, zone: shapely.Geometry) -> _Side:
    """The side of the road along a line above ground of given heights, (n,) [m]."""
    depth = line[:, 2] - ground
    crossing = np.asarray(shapely.intersects_xy(zone, line[:, 0], line[:, 1]))
    return _Side(line, depth, (crossing & (depth > _FALL)) | (depth > HIGHEST_WALL))


def _walls(side: _Side) -> Mesh:
    """Walls from the border down into the ground, where the road is no bridge."""
    low = side.depth > _SEEN
    shown = (low[1:] | low[:-1]) & ~(side.spanning[1:] | side.spanning[:-1])
    meshes = []
    for part in _stretches(shown):
        top = side.line[part]
        depth = np.maximum(side.depth[part], 0.0) + _FOOT
        meshes.append(between(top, top - depth[:, None] * [0.0, 0.0, 1.0]))
    return merge_meshes(meshes)


def _beams(side: _Side) -> Mesh:
    """Beams along borders beside a drop."""
    falls = [part for part in _stretches(_falling(side)) if part.stop - part.start > 1]
    return merge_meshes(_bare([swept(side.line[part], _BEAM) for part in falls]))


def _parapets(side: _Side, eyes: Floats | None) -> Iterator[Mesh]:
    """Posts and rails along borders beside a drop, near cameras."""
    falls = _falling(side)
    if eyes is not None:
        away, _ = cKDTree(eyes[:, :2]).query(side.line[:, :2])
        falls &= np.asarray(away)[1:] < _FARTHEST
    for part in _stretches(falls):
        line = side.line[part]
        for height, half in _RAILS:
            square = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
            yield swept(line, square + np.array([_AXIS, height]))
        high = _RAILS[-1][0]
        posts = densified(line, _POST)
        yield upright_boxes(posts, (-0.03, _AXIS - 0.03, 0.0), (0.03, _AXIS + 0.03, high))


def _falling(side: _Side) -> Bools:
    """Along which stretches between points the ground lies so low that one could fall, (n-1,)."""
    low = side.depth > _FALL
    falls = low[1:] | low[:-1]
    for _ in range(_BEYOND):
        falls = falls | np.roll(np.append(falls, False), 1)[:-1] | np.append(falls[1:], False)
    return np.asarray(falls)


def _stretches(shown: Bools) -> Iterator[slice]:
    """Slices of points along runs of stretches that are shown, (n-1,)."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(np.int64)))
    for start, end in ends.reshape(-1, 2):
        yield slice(int(start), int(end) + 1)


def _bare(meshes: list[Mesh]) -> list[Mesh]:
    """Meshes without normals, so that they can be joined with others that have none."""
    return [Mesh(mesh.vertices, mesh.faces) for mesh in meshes]
