"""Cells to meshes, one per surface, and raised footways with their kerbs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    Polygons,
    surface_heights,
)
from sumo3dviz_pt.world.roads.drops import SIDEWALK_HEIGHT as SIDEWALK_HEIGHT
from sumo3dviz_pt.world.roads.drops import Drops, cut_for_ramps, is_uneven, pieces_of, rise_at
from sumo3dviz_pt.world.roads.outlines import area_rings, joined_areas, raised_levels
from sumo3dviz_pt.world.roads.wear.stains import (
    STAINED,
    Tile,
    cut_for_stains,
    stain_tiles,
    without_tiles,
)

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


KerbRings = Sequence[tuple[Floats, Floats]]
"""Outlines of raised areas on the carriageway and on top of the kerb, (n, 3) [m] each."""


def kerb_faces(rings: KerbRings) -> Mesh:
    """Build vertical faces around all raised areas, facing outwards."""
    return walls([top for _, top in rings], [foot - [0.0, 0.0, _KERB_FOOT] for foot, _ in rings])


def kerb_rings(cells: Cells, raised: Polygons, drops: Drops) -> KerbRings:
    """Return the outlines of all raised areas.

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
    levels = raised_levels(cells)
    if len(levels) == 1:
        return area_rings(raised, cells, among=levels[0])
    return [
        ring for some in levels for ring in area_rings(joined_areas(cells, some), cells, among=some)
    ]


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

        triangles = [keep.of(("rest", shape, uneven, ramps, tiles), rest)]
        return triangles + [
            keep.of(("stained", shape, ramps, tile), partial(within, tile)) for tile in tiles
        ]


def _mesh_of(cutting: _Cutting, index: Ints, *, near: tuple[float, float]) -> Mesh:
    """Triangles of some cells of one surface."""
    cells, drops = cutting.cells, cutting.drops
    pieces = [(flat, faces, i) for i in index for flat, faces in cutting.triangles(int(i))]
    # Join all triangles.
    starts = np.cumsum([0, *(len(flat) for flat, _, _ in pieces)])
    moved = [some + start for (_, some, _), start in zip(pieces, starts[:-1], strict=True)]
    faces = np.concatenate([np.zeros((0, 3), np.int64), *moved])
    if not len(faces):
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    flat = np.concatenate([some for some, _, _ in pieces])
    cell = np.repeat([i for _, _, i in pieces], [len(some) for some, _, _ in pieces])
    # Lift them to the surface, and footways above it.
    heights = surface_heights(cells, cell, flat)
    raised = cells.raised[cell]
    heights[raised] += rise_at(drops, flat[raised])
    vertices = np.column_stack([flat, heights])
    normals = None if cells.is_flat else smooth_normals(vertices, faces)
    tile = metres_per_tile(cells.surfaces[int(index[0])])
    return Mesh(vertices, faces, normals, planar_uvs(flat, tile=tile, near=near))
