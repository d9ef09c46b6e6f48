"""Lays out the whole road surface: without overlaps or gaps, level above level.

Seen from above, a bridge and the road below it overlap. So every cell gets a level, the number of
cells that lie below it one above the other, and the borders of the surface are found level by
level.

Roads too far away to show more than their surface are a ribbon for each lane, without kerbs and
paint. They are built of all lanes at once and are not cut where they overlap, which takes a
hundredth of the time of a road in detail.

Roads are cut, worn and painted as surfaces, not edge by edge. So which edge or junction each face
belongs to is found afterwards, by the middles of faces, and only where somebody asks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.materials import metres_per_tile, planar_uvs, shows_wear
from sumo3dviz_pt.library.mesh.planar import polygon_parts, triangulate_many, union
from sumo3dviz_pt.model.geometry import UNWORN, Bools, Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Junction, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.rails.ways import with_own_tracks
from sumo3dviz_pt.world.roads.areas import (
    JunctionInside,
    junction_cells,
    junction_insides,
    known_heights,
    sliver_cells,
    walking_cells,
    without_ways,
)
from sumo3dviz_pt.world.roads.cells import (
    STOREY,
    Cells,
    Crossings,
    Polygons,
    heights_near,
    join_cells,
    lane_cells,
    stacked,
    without_overlaps,
)
from sumo3dviz_pt.world.roads.outlines import area_rings, outer_area, without_crumbs
from sumo3dviz_pt.world.roads.strips import (
    PAVING,
    BoundsXY,
    Strip,
    is_skipped,
    junction_surface,
    look_of,
    network_strips,
    style_of,
    with_style,
)

_SHARPEST = 2.0
"""The outer corner of a bend lies at most this far out, by half of the ribbon's width."""

_STEP = 0.01
"""By how much what overlaps lies above each other [m]."""


class Line(NamedTuple):
    """The middle of a ribbon.

    Attributes:
        points: (n, 3) [m], n >= 2.
        width: [m].
    """

    points: Floats
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class PlainRoads:
    """Roads without details.

    Attributes:
        meshes: By surface key.
        outlines: Of lanes and junctions from above, (n,) polygons that may overlap.
        points: On them, (m, 3) [m].
    """

    meshes: dict[str, Mesh] = field(default_factory=dict)
    outlines: Polygons = field(default_factory=lambda: np.zeros(0, dtype=object))
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))


def plain_roads(
    network: Network, settings: RoadSettings, *, near: tuple[float, float], textured: bool
) -> PlainRoads:
    """Build the lanes of normal edges and the junctions of a network as ribbons and areas.

    Args:
        network: The network.
        settings: Surfaces and widths of lanes.
        near: A point of the network [m] near which texture coordinates are small.
        textured: False leaves out what says how worn a surface is.
    """
    lanes, areas = _lanes_by_surface(network, settings), _junctions_by_surface(network, settings)
    # Where they overlap, pavements lie above roads and those above junctions.
    meshes: dict[str, Mesh] = {}
    outlines: list[Polygons] = [np.zeros(0, dtype=object)]
    for surface in sorted({*lanes, *areas}):
        ribbon = ribbons(lanes.get(surface, ()))
        shapes, filled = _areas(areas.get(surface, ()))
        mesh = merge_meshes([_lifted(ribbon.mesh, _STEP * (surface == PAVING)), filled])
        outlines += [ribbon.outlines, shapes]
        if len(mesh.faces):
            meshes[surface] = _shown(mesh, surface, near, textured)
    points = np.concatenate([np.zeros((0, 3)), *(mesh.vertices for mesh in meshes.values())])
    return PlainRoads(meshes, np.concatenate(outlines), points)


def _lanes_by_surface(network: Network, settings: RoadSettings) -> dict[str, list[Line]]:
    """Middles and widths of the lanes that are drawn."""
    lines: dict[str, list[Line]] = {}
    for edge in network.edges.values():
        if edge.function not in {"normal", "connector"}:
            continue
        style = style_of(edge.id, settings)
        for lane in edge.lanes:
            if not is_skipped(lane) and len(lane.shape) > 1:
                look = look_of(lane, style)
                lines.setdefault(look.surface, []).append(Line(lane.shape, look.width))
    return lines


def _junctions_by_surface(network: Network, settings: RoadSettings) -> dict[str, list[Junction]]:
    """The junctions that have an area."""
    junctions: dict[str, list[Junction]] = {}
    for key, junction in network.junctions.items():
        if junction.type != "internal" and len(junction.outline) > 2:
            junctions.setdefault(junction_surface(network, key, settings), []).append(junction)
    return junctions


def _lifted(mesh: Mesh, height: float) -> Mesh:
    """A mesh moved up [m]."""
    return Mesh(mesh.vertices + np.array([0.0, 0.0, height]), mesh.faces)


@dataclass(frozen=True, slots=True, eq=False)
class Ribbons:
    """Lines with a width.

    Attributes:
        mesh: Of all of them.
        outlines: Of each from above, (n,) valid polygons.
    """

    mesh: Mesh
    outlines: Polygons


def ribbons(lines: Sequence[Line]) -> Ribbons:
    """Build ribbons along lines, all at once."""
    if not lines:
        return Ribbons(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), np.zeros(0, object))
    counts = np.array([len(line) for line, _ in lines])
    points = np.concatenate([line for line, _ in lines])
    half = np.repeat([0.5 * width for _, width in lines], counts)
    owner = np.repeat(np.arange(len(lines)), counts)
    across = half[:, None] * _mitres(points, owner)
    left, right = points.copy(), points.copy()
    left[:, :2] += across
    right[:, :2] -= across
    # Two triangles between each point and the next of its line.
    start = np.flatnonzero(owner[1:] == owner[:-1])
    n = len(points)
    quads = np.stack([start + n, start + n + 1, start + 1, start], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    # Around each line: its right side forwards, its left side backwards.
    order = np.lexsort((np.concatenate([np.arange(n), 2 * n - np.arange(n)]), np.tile(owner, 2)))
    ring = np.concatenate([right, left])[order, :2]
    rings = shapely.linearrings(ring, indices=np.tile(owner, 2)[order])
    return Ribbons(
        Mesh(np.concatenate([left, right]), faces), shapely.make_valid(shapely.polygons(rings))
    )


def _mitres(points: Floats, owner: Ints) -> Floats:
    """Vectors that carry each point of many lines one metre to the left of its line, (n, 2)."""
    steps = np.diff(points[:, :2], axis=0)
    inside = owner[1:] == owner[:-1]
    length = np.linalg.norm(steps, axis=1)
    good = inside & (length > 1e-9)
    sides = np.zeros_like(steps)
    sides[good] = np.column_stack([-steps[good, 1], steps[good, 0]]) / length[good, None]
    total = np.zeros((len(points), 2))
    total[:-1] += sides
    total[1:] += sides
    long = np.linalg.norm(total, axis=1)
    met = np.zeros(len(points), dtype=np.int64)
    met[:-1] += good
    met[1:] += good
    # |n1 + n2|^2 = 2 (1 + n1 . n2), so dividing twice by the length gives the mitre.
    reach = np.where(met > 1, np.minimum(2.0 / np.maximum(long, 1e-9), _SHARPEST), 1.0)
    return np.asarray(total / np.maximum(long, 1e-9)[:, None] * reach[:, None])


def _areas(junctions: Sequence[Junction]) -> tuple[Polygons, Mesh]:
    """Outlines of junctions from above, and their surfaces."""
    if not junctions:
        return np.zeros(0, dtype=object), Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    shapes = [shapely.make_valid(shapely.Polygon(node.outline[:, :2])) for node in junctions]
    parts = [part for shape in shapes for part in shapely.get_parts(shape)]
    parts = [part for part in parts if isinstance(part, shapely.Polygon) and part.area > 0.0]
    flat, faces, _ = triangulate_many(parts)
    known = np.concatenate([node.outline for node in junctions])
    heights = known[cKDTree(known[:, :2]).query(flat)[1], 2] if len(flat) else np.zeros(0)
    return np.array(parts, dtype=object), Mesh(np.column_stack([flat, heights - _STEP]), faces)


def _shown(mesh: Mesh, surface: str, near: tuple[float, float], textured: bool) -> Mesh:
    """A mesh as its surface is shown."""
    uvs = planar_uvs(mesh.vertices, tile=metres_per_tile(surface), near=near)
    wear = np.tile(UNWORN, (len(mesh.vertices), 1)) if textured and shows_wear(surface) else None
    return Mesh(mesh.vertices, mesh.faces, None, uvs, wear)


@dataclass(frozen=True, slots=True, eq=False)
class RoadLayout:
    """The road surface before it becomes meshes.

    Attributes:
        cells: Pieces without overlaps.
        strips: Lanes of normal edges, from right to left, by edge id.
        insides: Contents of junctions, by junction id.
        raised: Connected footways from above, (n,) polygons.
        outline: Connected pieces of everything that is paved and built in detail, (n,) polygons.
        memory: What was built on it, by cells and strips; a part of the world's memory.
        beyond: Roads farther away, which show no more than their surface.
    """

    cells: Cells
    strips: Mapping[str, tuple[Strip, ...]]
    insides: Mapping[str, JunctionInside]
    raised: Polygons
    outline: Polygons
    memory: Memory = field(default_factory=Memory)
    beyond: PlainRoads = field(default_factory=PlainRoads)

    @property
    def paved(self) -> list[shapely.Polygon]:
        """Everything that is paved, in detail or not; pieces beyond may overlap."""
        return [*self.outline, *self.beyond.outlines]


def layout_roads(
    network: Network,
    settings: RoadSettings,
    *,
    region: BoundsXY | None = None,
    memory: Memory | None = None,
) -> RoadLayout:
    """Lay out the road surface without overlaps or gaps.

    Args:
        network: The network.
        settings: Surfaces, widths and overrides.
        region: Only lanes and junctions that touch this box are built [m].
        memory: Keeps what is built on this layout; no other layout may use it.
    """
    memory = memory or Memory()
    settings = with_style(settings, network)
    strips = with_own_tracks(network_strips(network, settings, region=region, memory=memory))
    insides = junction_insides(network, settings, region=region, memory=memory)
    carriageways = _lane_cells(strips, raised=False)
    footways = without_ways(_lane_cells(strips, raised=True), insides)
    lanes = join_cells([carriageways, footways])
    known = known_heights(network, insides, lanes=lanes, memory=memory)
    walks = walking_cells(insides, footways=footways, known=known, memory=memory)
    walks = without_ways(walks, insides)
    slivers = sliver_cells(network, settings, strips)
    around = join_cells([lanes, walks])
    junctions = junction_cells(
        network, settings, insides=insides, lanes=around, known=known, memory=memory
    )
    junctions = without_ways(junctions, insides)
    joined = without_overlaps(join_cells([lanes, walks, slivers, junctions]))
    cells, raised = without_crumbs(joined)
    return RoadLayout(cells, strips, insides, raised, outer_area(cells), memory)


def _lane_cells(strips: Mapping[str, tuple[Strip, ...]], *, raised: bool) -> Cells:
    """Cells of all lanes that are raised, or all that are not."""
    chosen = [
        (strip, key)
        for key, group in strips.items()
        for strip in group
        if strip.look.raised == raised
    ]
    return lane_cells([strip for strip, _ in chosen], [key for _, key in chosen])


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

    def make() -> Levels:
        crossings = layout.cells.crossings
        of_cell = stacked(crossings, len(layout.cells.polygons))
        return Levels(crossings, of_cell, _borders(layout, of_cell))

    return layout.memory.of(("levels",), make)


def _borders(layout: RoadLayout, levels: Ints) -> tuple[Border, ...]:
    """The surface's borders, level by level."""
    if not levels.any():
        rings = area_rings(layout.outline, layout.cells)
        return tuple(Border(ring, closed=True, level=0) for ring in rings)
    cells, borders = layout.cells, []
    for level in np.unique(levels):
        among, rest = np.flatnonzero(levels == level), np.flatnonzero(levels != level)
        areas = np.array(polygon_parts(union(cells.polygons[among])), dtype=object)
        for ring in area_rings(areas, cells, among=among):
            free = ~_continued(ring, cells, rest)
            borders += [Border(line, closed, int(level)) for line, closed in _runs(ring, free)]
    return tuple(borders)


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
    levels = np.full(len(points), np.inf)
    np.minimum.at(levels, at, cells.heights(cell, points[at]))
    return np.where(np.isfinite(levels), levels, np.nan)


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


_KINDS = {
    "faces": "kerb",
    "gutter": "kerb",
    "joints": "kerb",
    "kerb": "kerb",
    "stones": "kerb",
    "verge": "verge",
}
"""What parts of roads are that are no lanes, by the second word of their ids."""


@dataclass(frozen=True, slots=True, eq=False)
class RoadOwners:
    """Tells which edge or junction faces of roads belong to.

    Attributes:
        cells: The road surface.
        edges: Ids of the normal edges among its owners.
    """

    cells: Cells
    edges: frozenset[str]

    def things(self, part: str, mesh: Mesh) -> tuple[tuple[str, int], ...]:
        """Return what the faces of a part of the roads belong to; see `Mesh.things`.

        Names are `edge:` and `junction:` with the id of the carriageway, `sidewalk:` with that of
        raised footways, and `marking:`, `kerb:`, `verge:` and `rails:` with that of the nearest.

        Args:
            part: Its id, such as `road/wear/asphalt`.
            mesh: In world coordinates.
        """
        if not len(self.cells.polygons) or part.startswith("road/beyond"):
            return ()
        nearest = _cells_at(self.cells, mesh.vertices[mesh.faces].mean(axis=1))
        first, _, rest = part.partition("/")
        other = _KINDS.get(rest.split("/")[0], "")
        names = self._names({"markings": "marking", "rails": "rails"}.get(first, other))
        return tuple((names[cell], len(list(run))) for cell, run in groupby(nearest.tolist()))

    def _names(self, kind: str) -> Sequence[str]:
        """Names of what belongs to each cell; of lanes and footways if there is no other kind."""
        names = []
        for owner, raised in zip(self.cells.owners, self.cells.raised.tolist(), strict=True):
            lane = "edge" if owner in self.edges else "junction"
            names.append(f"{kind or ('sidewalk' if raised else lane)}:{owner}")
        return names


def owners_of_roads(layout: RoadLayout) -> RoadOwners:
    """Return what tells the edge or junction that a face of the roads belongs to."""
    return RoadOwners(layout.cells, frozenset(layout.strips))


def _cells_at(cells: Cells, points: Floats) -> Ints:
    """Return the cell that each point lies on, or else the nearest, (n,)."""
    spots = shapely.points(points[:, :2])
    spot, cell = cells.tree.query(spots, predicate="intersects")
    cells_at = np.full(len(points), -1)
    if cells.is_flat:
        cells_at[spot[::-1]] = cell[::-1]
    else:
        # Of cells above each other, the one at the point's height.
        away = np.abs(cells.heights(cell, points[spot, :2]) - points[spot, 2])
        order = np.lexsort((-cell, -away, spot))
        cells_at[spot[order]] = cell[order]
    beside = np.flatnonzero(cells_at < 0)
    if len(beside):
        near, cell = cells.tree.query_nearest(spots[beside], all_matches=False)
        cells_at[beside[near]] = cell
    return cells_at
