"""Cells to meshes, one per surface, and raised footways with their kerbs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.library.materials import KERB, metres_per_tile, planar_uvs
from sumo3dviz_pt.library.mesh.bands import between, mitres, walls
from sumo3dviz_pt.library.mesh.planar import (
    Triangles,
    common,
    polygon_parts,
    subtract,
    triangulate_all,
    union,
)
from sumo3dviz_pt.library.mesh.shading import smooth_normals
from sumo3dviz_pt.model.geometry import (
    Floats,
    Ints,
    Mesh,
    merge_meshes,
)
from sumo3dviz_pt.world.memory import Memory, digest_of
from sumo3dviz_pt.world.roads.cells import (
    Cells,
    Crossings,
    Polygons,
    crossings_of,
    heights_near,
    stacked,
    surface_heights,
)
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT as SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.drops import Drops, cut_for_ramps, is_uneven, pieces_of, rise_at
from sumo3dviz_pt.world.roads.strips import PAVING
from sumo3dviz_pt.world.roads.wear.stains import (
    STAINED,
    Tile,
    cut_for_stains,
    stain_tiles,
    without_tiles,
)

_LEAST_ISLAND = 2.0
"""Smaller pieces of footway that touch no other are no islands [m2]."""

KERB_WIDTH = 0.15
"""Width of a kerb stone's top [m]."""

_VERGE_WIDTH, _VERGE_DROP = 0.12, 0.08
"""Extent of the slope around roads, sideways and down [m]."""

_RAMP_STEP = 0.3
"""Distance of points of kerbs where they are lowered [m]."""

_KERB_FOOT = 0.06
"""How far kerb faces reach below the carriageway [m]."""


def surface_meshes(
    cells: Cells,
    *,
    raised: Polygons,
    near: tuple[float, float],
    drops: Drops,
    memory: Memory | None = None,
) -> dict[str, Mesh]:
    """Build triangles of all cells, by surface key.

    Args:
        cells: Without overlaps.
        raised: What `raised_area` gave.
        near: A point of the network [m] near which texture coordinates are small.
        drops: Where kerbs are lowered.
        memory: What was built of these cells.
    """
    memory = memory or Memory()
    cells = memory.of(("kerb tops",), lambda: with_kerb_tops(cells, raised))
    meshes = {}
    for surface in sorted(set(cells.surfaces)):
        index = np.flatnonzero(np.array(cells.surfaces) == surface)
        mesh = _mesh_of(_Cutting(cells, drops, memory), index, near=near)
        if len(mesh.faces):
            meshes[surface] = mesh
    return meshes


def raised_area(cells: Cells) -> Polygons:
    """Return connected footways from above, (n,) polygons with holes; levels kept apart."""
    return np.concatenate([_joined(cells, some) for some in _raised_levels(cells)])


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
    found = shapely.STRtree(cells.polygons).query(zone, predicate="intersects")
    cut = np.sort(found[cells.raised[found]])
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


def _raised_levels(cells: Cells) -> list[Ints]:
    """Numbers of raised cells, one list for each level of footways above footways."""
    raised = np.flatnonzero(cells.raised)
    if cells.is_flat or not len(raised):
        return [raised]
    crossings = crossings_of(cells)
    both = cells.raised[crossings.lower] & cells.raised[crossings.upper]
    lower, upper, shared, gap = crossings
    among = Crossings(lower[both], upper[both], shared[both], gap[both])
    levels = stacked(among, len(cells.polygons))[raised]
    return [raised[levels == level] for level in np.unique(levels)]


def _joined(cells: Cells, some: Ints) -> Polygons:
    """Connected areas of some cells, (n,) polygons with holes."""
    shape = union(cells.polygons[some])
    # Closing by a centimetre joins neighbours that rounding has parted.
    closed = shape.buffer(0.01, join_style="mitre").buffer(-0.01, join_style="mitre")
    found = np.empty(len(parts := polygon_parts(closed)), dtype=object)
    found[:] = parts
    return found


def outer_area(cells: Cells) -> Polygons:
    """Return everything that is paved, as connected polygons with holes, (n,)."""
    return np.array(polygon_parts(union(cells.polygons)), dtype=object)


def with_kerb_tops(cells: Cells, areas: Polygons) -> Cells:
    """Split raised cells into kerb stones along their outer edge and paving inside."""
    if not len(areas):
        return cells
    # Paving is what lies inside the rim of its area.
    inner = shapely.buffer(areas, -KERB_WIDTH, join_style="mitre", mitre_limit=2.0)
    index = np.flatnonzero(cells.raised)
    polygons = cells.polygons[index]
    tree = shapely.STRtree(inner)
    cell, part = tree.query(polygons, predicate="intersects")
    paving = cells.polygons.copy()
    paving[index] = shapely.Polygon()
    for k in np.unique(cell):
        cores = inner[part[cell == k]]
        core = cores[0] if len(cores) == 1 else union(cores)
        paving[index[k]] = common(polygons[k], core)
    # Kerb stones are the rest.
    pairs = zip(polygons, paving[index], strict=True)
    stones = np.array([subtract(cell, [inside]) for cell, inside in pairs], dtype=object)
    return Cells(
        np.concatenate([paving, stones]),
        np.concatenate([cells.quads, cells.quads[index]]),
        {
            **cells.knots,
            **{
                len(paving) + k: cells.knots[int(i)]
                for k, i in enumerate(index)
                if int(i) in cells.knots
            },
        },
        cells.surfaces + (KERB,) * len(index),
        np.concatenate([cells.raised, np.ones(len(index), dtype=bool)]),
        cells.owners + tuple(cells.owners[i] for i in index),
        {},
    )


def kerb_faces(cells: Cells, raised: Polygons, drops: Drops) -> Mesh:
    """Build vertical faces around all raised areas, facing outwards.

    Args:
        cells: The surface.
        raised: What `raised_area` gave.
        drops: Where kerbs are lowered.
    """
    rings = kerb_rings(cells, raised, drops)
    return walls([top for _, top in rings], [foot - [0.0, 0.0, _KERB_FOOT] for foot, _ in rings])


def kerb_rings(cells: Cells, raised: Polygons, drops: Drops) -> list[tuple[Floats, Floats]]:
    """Return outlines of raised areas on the carriageway and on top of the kerb, (n, 3) [m] each.

    Args:
        cells: The surface.
        raised: What `raised_area` gave.
        drops: Where kerbs are lowered.
    """
    rings = []
    for foot in _raised_rings(cells, raised):
        foot = _with_points(foot, drops.ramps)
        top = foot.copy()
        top[:, 2] += rise_at(drops, foot[:, :2])
        rings.append((foot, top))
    return rings


def _raised_rings(cells: Cells, raised: Polygons) -> list[Floats]:
    """Outlines of raised areas at the height of the footways that they hold, (n, 3) [m] each."""
    levels = _raised_levels(cells)
    if len(levels) == 1:
        return area_rings(raised, cells, among=levels[0])
    return [ring for some in levels for ring in area_rings(_joined(cells, some), cells, among=some)]


def _with_points(ring: Floats, ramps: shapely.STRtree) -> Floats:
    """A ring with points close together where it runs through areas."""
    ends = np.roll(ring, -1, axis=0)
    sides = np.asarray(shapely.linestrings(np.stack([ring, ends], axis=1)[..., :2]))
    count = np.ones(len(ring), dtype=np.int64)
    touched = np.unique(ramps.query(sides, predicate="intersects")[0])
    count[touched] = np.maximum(np.ceil(shapely.length(sides[touched]) / _RAMP_STEP), 1)
    index = np.repeat(np.arange(len(ring)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    share = (step / count[index])[:, None]
    return np.asarray(ring[index] + share * (ends - ring)[index])


def verges(
    borders: Iterable[tuple[Floats, bool]], *, surface: str, near: tuple[float, float]
) -> Mesh:
    """Build short slopes around the whole surface, so that roads do not look like floating cards.

    Args:
        borders: Lines with the surface to their left, (n, 3) [m], and whether each is closed.
        surface: Key of the surface that the slopes show.
        near: A point of the network [m] near which texture coordinates are small.
    """
    pieces = []
    for line, closed in borders:
        foot = line - [0.0, 0.0, _VERGE_DROP]
        # The area lies to the left of its borders, so outwards is to the right.
        foot[:, :2] -= _VERGE_WIDTH * mitres(line, closed=closed)
        pieces.append(between(line, foot, closed=closed))
    mesh = merge_meshes(pieces)
    return replace(mesh, uvs=planar_uvs(mesh.vertices, tile=metres_per_tile(surface), near=near))


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
        kept = np.concatenate([[True], np.diff(along) > 0.005])
        dense.append(shapely.get_coordinates(shapely.line_interpolate_point(line, along[kept])))
    return dense


@dataclass(frozen=True, slots=True, eq=False)
class _Cutting:
    """Cells that are cut into triangles.

    Attributes:
        cells: With the tops of kerbs.
        drops: Where kerbs are lowered.
        memory: Triangles of cells.
    """

    cells: Cells
    drops: Drops
    memory: Memory

    def triangles(self, index: int) -> list[Triangles]:
        """Triangles of a cell: small ones where it ramps, is uneven or shows stains."""
        polygon = self.cells.polygons[index]
        ramps = self.drops.at(polygon) if self.cells.raised[index] else ()
        stained = self.cells.surfaces[index] in STAINED
        tiles = stain_tiles(polygon, self.drops.focus) if stained else ()
        uneven = is_uneven(self.cells, index)
        keep, shape = self.memory.by_content, digest_of(polygon)

        def pieces() -> list[shapely.Geometry]:
            cut = partial(cut_for_ramps, polygon, self.drops)
            return keep.of(("ramps", shape, ramps), cut) if ramps else polygon_parts(polygon)

        def rest() -> Triangles:
            left = [p for one in pieces() for p in without_tiles(one, tiles)]
            return triangulate_all(pieces_of(self.cells, index, left))

        def within(tile: Tile) -> Triangles:
            return triangulate_all([p for one in pieces() for p in cut_for_stains(one, tile)])

        found = [keep.of(("rest", shape, uneven, ramps, tiles), rest)]
        return found + [
            keep.of(("stained", shape, ramps, tile), partial(within, tile)) for tile in tiles
        ]


def _mesh_of(cutting: _Cutting, index: Ints, *, near: tuple[float, float]) -> Mesh:
    """Triangles of some cells of one surface."""
    cells, drops = cutting.cells, cutting.drops
    found = [(flat, faces, i) for i in index for flat, faces in cutting.triangles(int(i))]
    # Join all triangles.
    starts = np.cumsum([0, *(len(flat) for flat, _, _ in found)])
    moved = [some + start for (_, some, _), start in zip(found, starts[:-1], strict=True)]
    faces = np.concatenate([np.zeros((0, 3), np.int64), *moved])
    if not len(faces):
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    flat = np.concatenate([some for some, _, _ in found])
    cell = np.repeat([i for _, _, i in found], [len(some) for some, _, _ in found])
    # Lift them to the surface, and footways above it.
    heights = surface_heights(cells, cell, flat)
    raised = cells.raised[cell]
    heights[raised] += rise_at(drops, flat[raised])
    vertices = np.column_stack([flat, heights])
    normals = None if cells.is_flat else smooth_normals(vertices, faces)
    tile = metres_per_tile(cells.surfaces[int(index[0])])
    return Mesh(vertices, faces, normals, planar_uvs(flat, tile=tile, near=near))
