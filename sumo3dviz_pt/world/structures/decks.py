"""Decks of bridges: a slab under the road, wider than the girder below it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import common, polygon_parts, union
from sumo3dviz_pt.library.mesh.triangulate import triangulate_many
from sumo3dviz_pt.library.mesh.walls import walls
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.world.roads.cells import Polygons
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.levels import levels_of
from sumo3dviz_pt.world.roads.mesh import area_rings

SLAB, THICKNESS = 0.35, 1.0
"""Depths of the slab's and of the girder's lower face below the road [m]."""

_INSET = 0.7
"""How far the girder's sides lie within the deck's [m]."""

_LEAST = 0.9
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
    found = []
    for level in np.unique(of_cell[near]):
        here = of_cell[near] == level
        area = union(pieces[here])
        found.append(Deck(int(level), near[here], pieces[here], area))
    return found


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
    return bool((height - height_at(points) > _LEAST).any())


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
