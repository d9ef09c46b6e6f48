"""Ground between houses: mown lawn around them, gravel at walls, paving up to near sidewalks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import closing, polygon_parts, subtract, union
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.tiles import Tile

TILE = 250.0
"""Width of the squares in which it is found [m]."""

_GARDEN, _EDGE = 16.0, 6.0  # around houses, and how far it draws back from open land [m]
_STRIP = 0.55  # of gravel along walls [m]
_NEAR = 6.0  # between a front and a sidewalk: paved if it is narrower [m]
_LEAST = 30.0  # footprints of houses with a garden, at least [m2]
_MARGIN = 40.0  # what lies this far around a tile counts [m]


@dataclass(frozen=True, slots=True, eq=False)
class Houses:
    """Footprints of buildings.

    Attributes:
        shapes: Outlines [m].
        tree: Of them.
    """

    shapes: tuple[shapely.Geometry, ...]
    tree: shapely.STRtree


@dataclass(frozen=True, slots=True, eq=False)
class BuiltUp:
    """The ground around houses in one tile, without overlaps.

    Attributes:
        pavement: Between fronts and sidewalks near them.
        apron: Along all other walls.
        lawn: The rest.
    """

    pavement: shapely.Geometry
    apron: shapely.Geometry
    lawn: shapely.Geometry


def houses_of(polygons: Sequence[Polygon]) -> Houses:
    """Return the footprints of a scenario's building polygons."""
    shapes = tuple(
        shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
        for item in polygons
        if len(item.shape) > 2 and kind_of(item.type, item.source) == "buildings"
    )
    return Houses(shapes, shapely.STRtree(shapes))


def built_up(
    tile: Tile,
    houses: Houses,
    *,
    paved: Sequence[shapely.Geometry],
    covered: Sequence[shapely.Geometry],
) -> BuiltUp | None:
    """Return the ground around the houses of a tile, or None where there are none.

    Args:
        tile: The square.
        houses: All footprints.
        paved: Roads and footways.
        covered: Areas of the scenario near the tile, which are on top.
    """
    wide = tile.box(_MARGIN)
    near = [houses.shapes[k] for k in sorted(houses.tree.query(wide, "intersects").tolist())]
    large = [shape for shape in near if shape.area > _LEAST]
    if not large:
        return None
    walls = union(near)
    low, high = np.reshape(wide.bounds, (2, 2))
    clipped = shapely.clip_by_rect(list(paved), *low, *high) if len(paved) else []
    roads = union([area for area in clipped if not area.is_empty])
    taken = union([roads, *covered])
    garden = union(large).buffer(_GARDEN, quad_segs=3).buffer(-_EDGE, quad_segs=3)
    # What lies between a front and a sidewalk touches both.
    between = subtract(closing(union([walls, roads]), _NEAR / 2.0), [walls, roads])
    touching = [
        part
        for part in polygon_parts(between)
        if part.area > 1.0 and part.distance(walls) < 0.05 and part.distance(roads) < 0.05
    ]
    box = tile.box()
    pavement = _in(box, subtract(union(touching), [taken, walls]))
    strip = union([walls]).buffer(_STRIP, join_style="mitre")
    apron = _in(box, subtract(strip, [walls, taken, pavement]))
    lawn = _in(box, subtract(garden, [walls, taken, pavement, apron]))
    return BuiltUp(pavement, apron, lawn)


def _in(box: shapely.Polygon, shape: shapely.Geometry) -> shapely.Geometry:
    """What of a shape lies in a tile."""
    return shapely.MultiPolygon(polygon_parts(shapely.intersection(shape, box)))
