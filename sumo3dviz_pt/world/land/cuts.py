"""Holes in the ground: for water, and for what is paved beside roads on slopes.

A terrain follows the borders of roads. Forecourts, parking bays, yards and platforms follow the
road beside them, too, but farther from it, where the terrain already leads to other roads. So
the ground is cut out below them, and low walls hold it back where it is higher.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, union
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes, unit
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.areas.drape import without
from sumo3dviz_pt.world.areas.slabs import Paving
from sumo3dviz_pt.world.land.ground import GroundParts
from sumo3dviz_pt.world.placement.surroundings import HeightAt
from sumo3dviz_pt.world.structures.bridges import MATERIAL, concrete

WALLS = "ground/paving walls"
"""Id of the walls that hold back the ground beside paving."""

_STEP = 1.0  # distance of points along walls [m]
_THICK, _ABOVE = 0.20, 0.08  # thickness of walls, and how far they stand above the ground [m]
_FOOT = 0.5  # how far walls reach below paving [m]
_LEAST = 0.02  # where the ground is no higher than this above paving, nothing holds it back [m]
_SIDES = np.array([
    # Corners: inner feet of both ends, inner rims, outer feet, outer rims.
    *((1, 0, 2), (1, 2, 3), (4, 5, 7), (4, 7, 6), (6, 7, 3), (6, 3, 2)),
    *((0, 4, 6), (0, 6, 2), (5, 1, 3), (5, 3, 7)),
])  # fmt: skip
_INSIDE = 0.05  # nearer to its border, paving does not tell heights [m]


def with_hole(ground: GroundParts, hole: shapely.Geometry) -> GroundParts:
    """Return the ground without what lies in a hole.

    Args:
        ground: Its woods, bridges and walls stay.
        hole: In plan [m].
    """
    static = []
    for part in ground.static:
        if part.id not in ("ground", "ground/far"):
            static.append(part)
            continue
        cut = without(part.part.mesh, hole)
        tint = None if part.part.tint is None else part.part.tint[cut.sources]
        static.append(replace(part, part=Part(cut.mesh, part.part.material, tint)))
    return replace(ground, static=tuple(static))


def laid_beside(
    ground: GroundParts, pavings: Sequence[Paving], *, solid: Sequence[shapely.Geometry]
) -> GroundParts:
    """Return sloped ground with paving in it: cut out below, held back by walls beside it.

    Its height at places in paving is that of the paving.

    Args:
        ground: As roads shape it.
        pavings: What is paved beside roads.
        solid: Roads and houses, before which no walls stand.
    """
    pavings = [some for some in pavings if len(some.shapes)]
    if not pavings:
        return ground
    shapes = [shape for some in pavings for shape in some.shapes]
    cut = with_hole(ground, union(shapes))
    taken = [*solid, *shapes]
    walls = merge_meshes([_walls(some, taken, ground.height_at) for some in pavings])
    held = (StaticPart(WALLS, "ground", Part(concrete(walls), MATERIAL)),) * bool(len(walls.faces))
    inner = [[shape.buffer(-_INSIDE) for shape in some.shapes] for some in pavings]
    trees = [shapely.STRtree(some) for some in inner]

    def height_at(places: Floats) -> Floats:
        """Return height of ground or paving at places, (n, 2) -> (n,) [m]."""
        heights = np.array(ground.height_at(places), dtype=np.float64)
        spots = shapely.points(np.asarray(places, dtype=np.float64)[:, :2])
        for some, tree in zip(pavings, trees, strict=True):
            on = np.unique(tree.query(spots, predicate="intersects")[0])
            if len(on):
                heights[on] = some.top_at(np.asarray(places)[on, :2])
        return heights

    return replace(cut, static=(*cut.static, *held), height_at=height_at)


def _walls(paving: Paving, taken: Sequence[shapely.Geometry], ground_at: HeightAt) -> Mesh:
    """Walls along borders of paving where the ground beside it is higher."""
    rings = [
        shapely.get_coordinates(shapely.segmentize(ring, _STEP))
        for shape in paving.shapes
        for part in polygon_parts(shape)
        for whole in [shapely.orient_polygons(part)]
        for ring in (whole.exterior, *whole.interiors)
    ]
    a = np.concatenate([np.zeros((0, 2)), *(ring[:-1] for ring in rings)])
    b = np.concatenate([np.zeros((0, 2)), *(ring[1:] for ring in rings)])
    out = _THICK * unit(np.column_stack([(b - a)[:, 1], -(b - a)[:, 0]]))
    # Leave out what lies before roads, houses and other paving.
    outside = shapely.STRtree(shapely.points(0.5 * (a + b) + 1.5 * out))
    free = np.ones(len(a), dtype=np.bool_)
    free[outside.query(taken, predicate="intersects")[1]] = False
    ends, beside = np.stack([a[free], b[free]]).reshape(-1, 2), np.tile(out[free], (2, 1))
    # Keep the pieces where the ground is higher at either end.
    top = paving.top_at(ends)
    level = np.maximum(ground_at(ends), ground_at(ends + beside))
    high = (level > top + _LEAST).reshape(2, -1).any(axis=0)
    foot, rim = top - _FOOT, np.maximum(top, level) + _ABOVE
    corners = [np.column_stack([place, z]) for place in (ends, ends + beside) for z in (foot, rim)]
    each = np.stack([corner.reshape(2, -1, 3) for corner in corners])  # side and level, end, piece
    pieces = each[:, :, high].transpose(2, 0, 1, 3).reshape(-1, 3)
    count = int(high.sum())
    faces = (8 * np.arange(count))[:, None, None] + _SIDES
    return Mesh(pieces, faces.reshape(-1, 3))
