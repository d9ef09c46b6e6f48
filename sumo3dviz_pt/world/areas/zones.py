"""Areas of a scenario: polygons that say what covers the ground, lowest first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import areal, subtract, union
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import LeftOut
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.areas.covers import AS_IS, Cover, LandCovers, TypeRow
from sumo3dviz_pt.world.areas.slabs import SOURCE as SLABS
from sumo3dviz_pt.world.objects.kinds import kind_of

FAMILY = "areas"
"""What users call them."""

_MOST_NAMED = 6  # types that a message names
_SMALLEST = 0.5  # smaller areas are left out [m2]


@dataclass(frozen=True, slots=True, eq=False)
class Area:
    """A piece of ground and its cover.

    Attributes:
        id: Unique.
        cover: The cover's name.
        shape: Its outline [m].
        colour: Mean linear reflectance; None leaves the surface's own.
        number: Its place among all areas, lowest first.
    """

    id: str
    cover: str
    shape: shapely.Geometry
    colour: Colour | None = None
    number: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Areas:
    """All areas of a scenario.

    Attributes:
        all: Lowest first.
        tree: Their outlines.
        left_out: Types that nothing is known of.
    """

    all: tuple[Area, ...]
    tree: shapely.STRtree
    left_out: tuple[LeftOut, ...] = ()

    def visible(self, area: Area, paved: Sequence[shapely.Geometry]) -> shapely.Geometry:
        """Return what is seen of an area: without higher areas, and without what is paved.

        Args:
            area: One of them.
            paved: Roads and footways, which lie on top of all areas.
        """
        over = [k for k in self.tree.query(area.shape).tolist() if k > area.number]
        low, high = np.reshape(area.shape.bounds, (2, 2))
        near = shapely.clip_by_rect(list(paved), *(low - 1.0), *(high + 1.0)) if len(paved) else ()
        others = [self.all[k].shape for k in sorted(over)]
        others += [piece for piece in near if not piece.is_empty]
        return subtract(area.shape, [union(others)]) if others else area.shape


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """A polygon that covers ground, before areas are ordered.

    Attributes:
        item: The polygon.
        cover: Its cover's name.
        shape: Its outline.
        layer: SUMO's.
    """

    item: Polygon
    cover: str
    shape: shapely.Geometry
    layer: float


def areas_of(polygons: Sequence[Polygon], covers: LandCovers, *, seed: int) -> Areas:
    """Return the areas that polygons mean, in the order in which they lie on each other.

    SUMO's `layer` decides; within a layer an area that lies inside another is on top of it,
    and else the later one.

    Args:
        polygons: All polygons of a scenario; buildings and lines of objects are no areas.
        covers: What their types mean.
        seed: Chooses among the colours of a cover.
    """
    found: list[_Found] = []
    unknown: dict[str, int] = {}
    for item in polygons:
        if item.source == SLABS or kind_of(item.type, item.source) is not None:
            continue
        row = covers.row_of(item.type)
        if row is None:
            unknown[item.type or "(none)"] = unknown.get(item.type or "(none)", 0) + 1
        elif (one := _found(item, row)) is not None:
            found.append(one)
    ordered = _ordered(found)
    areas = tuple(
        Area(
            f"{number}:{one.item.id}",
            one.cover,
            one.shape,
            colour_for(covers.covers[one.cover], one.item.id, seed),
            number,
        )
        for number, one in enumerate(ordered)
    )
    tree = shapely.STRtree([area.shape for area in areas])
    return Areas(areas, tree, _unknown(unknown))


def colour_for(cover: Cover, name: str, seed: int) -> Colour | None:
    """Return the colour that falls to an area.

    Args:
        cover: Its cover, with the colours.
        name: Of the area.
        seed: Of all chance.
    """
    if not cover.colours:
        return None
    return cover.colours[int(share_of(seed, "area", name) * len(cover.colours))]


def _found(item: Polygon, row: TypeRow) -> _Found | None:
    """The ground that a polygon covers, or None."""
    points, cover = item.shape[:, :2], row.cover
    closed = len(points) > 3 and bool(np.allclose(points[0], points[-1]))
    if (item.fill or closed) and len(points) > 2:
        shape = areal(shapely.make_valid(shapely.Polygon(points)))
    elif row.width is not None and float(np.ptp(points, axis=0).max()) > 0.0:
        shape = shapely.LineString(points).buffer(row.width / 2.0, quad_segs=4)
        cover = row.line or cover
    else:
        return None
    if cover == AS_IS or shape.area <= _SMALLEST:
        return None
    return _Found(item, cover, shape, _layer(item))


def _layer(item: Polygon) -> float:
    """SUMO's layer of a polygon; 0 where it has none."""
    try:
        return float(item.params.get("layer", "0"))
    except ValueError:
        return 0.0


def _ordered(found: Sequence[_Found]) -> list[_Found]:
    """Areas by layer, then by how many of their layer they lie in, then as they come."""
    if not found:
        return []
    tree = shapely.STRtree([one.shape for one in found])
    inner, outer = tree.query([one.shape for one in found], predicate="covered_by")
    depth = np.zeros(len(found), dtype=np.int64)
    for low, high in zip(inner.tolist(), outer.tolist(), strict=True):
        same = found[low].layer == found[high].layer
        if same and found[low].shape.area < found[high].shape.area - _SMALLEST:
            depth[low] += 1
    order = sorted(range(len(found)), key=lambda k: (found[k].layer, int(depth[k]), k))
    return [found[k] for k in order]


def _unknown(types: dict[str, int]) -> tuple[LeftOut, ...]:
    """Name types that nothing is known of, the most frequent first."""
    if not types:
        return ()
    order = sorted(types, key=lambda name: (-types[name], name))
    names = ", ".join(repr(name) for name in order[:_MOST_NAMED])
    more = f" and {len(order) - _MOST_NAMED} more types" if len(order) > _MOST_NAMED else ""
    what = f"{sum(types.values())} polygons of type {names}{more}"
    return (LeftOut(what, "the table of land covers does not know the type"),)
