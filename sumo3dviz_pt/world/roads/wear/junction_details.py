"""Repairs, manholes, cracks and rubber marks inside junctions near the camera."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import band_along
from sumo3dviz_pt.library.mesh.planar import GRID, areal
from sumo3dviz_pt.library.mesh.polyline import without_repeats
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.world.roads.cells import Cells, Polygons, quad_polygons
from sumo3dviz_pt.world.roads.graded import Graded, graded_on
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip
from sumo3dviz_pt.world.roads.wear.details import FreeStretch, detail_quads
from sumo3dviz_pt.world.roads.wear.junctions import (
    DrivenJunction,
    brightness,
    built_inside,
    near_junctions,
)
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE

_LEAST = 80.0
"""Smaller junctions [m2] show none."""

_EACH = 110.0
"""Area for one detail [m2]."""

_KINDS = ("manhole", "patch", "snake", "patch", "crack", "snake", "manhole", "patch")
_HALF = 2.2
"""From the middle of a detail's place to its border [m]."""

_RUBBER_WIDTH, _RUBBER_TONE = 0.17, 0.66
"""Width of a tyre's mark [m] and its factor of brightness in its middle."""

_RUBBED = 0.45
"""Share of ways with rubber marks."""

_TOUCH = 1e-4
"""Details that share less area [m2] only touch."""

_Tones = list[tuple[Floats, Floats]]
"""Quads, (n, 4, 3), and their brightness at both ends, (n, 2)."""


def junction_details(
    layout: RoadLayout, *, surfaces: frozenset[str], focus: BoundsXY | None
) -> dict[str, Graded]:
    """Build details of junctions near the camera's path, by surface key.

    Args:
        layout: The roads.
        surfaces: Those that show wear.
        focus: Box around the camera's path [m]; without one no junction is near.
    """
    junctions = near_junctions(layout, surfaces=surfaces, focus=focus)
    large = (junction for junction in junctions if junction.polygon.area > _LEAST)
    return built_inside(layout, "repairs", large, partial(_repaired, layout.cells))


def _repaired(cells: Cells, junction: DrivenJunction) -> Graded:
    """Details of one junction, as dirty as what they lie on."""
    ways = junction.ways
    tones = [*_repairs(cells.owners[junction.cell], junction.polygon, ways), *_rubber(ways)]
    piece = _laid(tones, cells, junction.cell)
    worn = brightness(piece.vertices[:, :2], ways)[:, None] ** [1.0, 0.0, 0.0]
    return Graded(piece.vertices, piece.faces, piece.wear * worn)


def _repairs(name: str, polygon: shapely.Geometry, ways: Sequence[Strip]) -> _Tones:
    """Patches and the like along some ways, and a trench across them all."""
    # Choose places; what lies at each is a matter of its number.
    places = [_across(name, polygon, ways)]
    x0, y0, x1, y1 = polygon.bounds
    for k in range(int(polygon.area / _EACH) + 1):
        at = np.array(
            [
                x0 + (x1 - x0) * share_of(0, "repair", name, str(k), "x"),
                y0 + (y1 - y0) * share_of(0, "repair", name, str(k), "y"),
            ]
        )
        way = ways[int(share_of(0, "repair", name, str(k)) * len(ways))].lane.shape
        ahead = (way[1] - way[0])[:2] / max(float(np.hypot(*(way[1] - way[0])[:2])), 1e-9)
        line = np.column_stack([at + np.array([[-5.5], [5.5]]) * ahead, np.zeros(2)])
        places.append((_KINDS[k % len(_KINDS)], FreeStretch(line, _HALF, 1.0, 10.0, f"{name}:{k}")))
    # Lay the first of those that would overlap.
    tones: _Tones = []
    taken = shapely.Polygon()
    for kind, place in places:
        found = [(quads, tone) for quads, tone in detail_quads(place, kind) if len(quads)]
        cover = shapely.union_all(np.concatenate([quad_polygons(quads) for quads, _ in found]))
        if cover.distance(taken) > 0.3 or taken.is_empty:
            taken = taken.union(cover.envelope)
            short = [(_shortened(quads), tone) for quads, tone in found]
            tones += [(quads, np.full((len(quads), 2), tone)) for quads, tone in short]
    return tones


def _shortened(quads: Floats) -> Floats:
    """Quads cut across every metre or so, so that their wear can follow what is around them."""
    sides = (quads[:, [1, 2]] - quads[:, [0, 3]])[..., :2]
    rows = np.maximum(np.linalg.norm(sides, axis=-1).max(axis=1).round().astype(np.int64), 1)
    index = np.repeat(np.arange(len(quads)), rows)
    step = np.arange(len(index)) - np.repeat(np.cumsum(rows) - rows, rows)
    low, high = ((step + k)[:, None, None] / rows[index][:, None, None] for k in (0, 1))
    start, end = quads[index][:, [0, 3]], quads[index][:, [1, 2]]
    near, far = start + low * (end - start), start + high * (end - start)
    return np.stack([near[:, 0], far[:, 0], far[:, 1], near[:, 1]], axis=1)


def _across(name: str, polygon: shapely.Geometry, ways: Sequence[Strip]) -> tuple[str, FreeStretch]:
    """A trench from kerb to kerb, a little askew."""
    middle = shapely.get_coordinates(polygon.centroid)[0]
    way = ways[0].lane.shape
    yaw = np.arctan2(*(way[1] - way[0])[1::-1]) + np.pi / 2
    yaw += 0.5 * share_of(0, "trench", name, "yaw") - 0.25
    ahead, aside = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    reach = 0.5 * float(np.hypot(*np.ptp(shapely.get_coordinates(polygon), axis=0)))
    shift = 0.35 * reach * (1.0 if share_of(0, "trench", name) < 0.5 else -1.0)
    ends = middle + shift * aside + np.array([[-reach], [reach]]) * ahead
    line = np.column_stack([ends, np.zeros(2)])
    return "trench", FreeStretch(line, _HALF, 0.0, 2.0 * reach, f"{name}:trench")


def _rubber(ways: Sequence[Strip]) -> _Tones:
    """Pairs of tyre marks along parts of some ways, fading at their ends."""
    tones: _Tones = []
    for way in ways:
        chance = [
            share_of(0, "rubber", way.lane.id, word) for word in ("any", "at", "long", "side")
        ]
        line = without_repeats(way.lane.shape)
        if chance[0] > _RUBBED or len(line) < 2:
            continue
        # Choose the stretch that tyres have marked.
        whole = float(arc_length(line[:, :2])[-1])
        start = 0.5 * chance[1] * whole
        long = min(3.0 + 6.0 * chance[2], whole - start)
        # Lay both tracks.
        for side in (-TRACK_PLACE, TRACK_PLACE):
            middle = side + 0.5 * chance[3] - 0.25
            half = 0.5 * _RUBBER_WIDTH
            band = band_along(line, right=middle - half, left=middle + half)
            marks = np.linspace(start, start + long, 9)
            fade = 1.0 - (1.0 - _RUBBER_TONE) * np.sin(np.linspace(0.0, np.pi, 9)) ** 0.7
            for k in range(8):
                quads = band.quads(float(marks[k]), float(marks[k + 1]))
                tone = np.linspace(fade[k], fade[k + 1], len(quads) + 1)
                tones.append((quads, np.stack([tone[:-1], tone[1:]], axis=1)))
    return tones


def _laid(tones: _Tones, cells: Cells, index: int) -> Graded:
    """Quads on one cell, cut at its border and at the height of the surface."""
    quads = np.concatenate([np.zeros((0, 4, 3)), *(quads for quads, _ in tones)])
    factor = np.concatenate([np.zeros((0, 2)), *(tone for _, tone in tones)])
    wear = np.zeros((len(quads), 2, 2, 3))
    wear[..., 0] = factor[:, :, None]
    left: Polygons = quad_polygons(quads)
    shapely.prepare(cells.polygons[index])
    cut = ~shapely.contains_properly(cells.polygons[index], left)
    left[cut] = shapely.intersection(left[cut], cells.polygons[index])
    left = _first_laid(left)
    piece = graded_on(quads, np.tile([0.0, 1.0], (len(quads), 1)), wear, polygons=left)
    heights = cells.heights(np.full(len(piece.vertices), index), piece.vertices[:, :2])
    return Graded(np.column_stack([piece.vertices[:, :2], heights]), piece.faces, piece.wear)


def _first_laid(polygons: Polygons) -> Polygons:
    """Return polygons without what earlier ones cover: two faces in one place would flicker."""
    free = polygons.copy()
    later, earlier = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    later, earlier = later[earlier < later], earlier[earlier < later]
    # Neighbours of one detail only touch.
    shared = shapely.area(shapely.intersection(polygons[later], polygons[earlier])) > _TOUCH
    later, earlier = later[shared], earlier[shared]
    for k in np.unique(later).tolist():
        before = shapely.union_all(polygons[earlier[later == k]])
        free[k] = areal(shapely.difference(areal(free[k]), before, grid_size=GRID))
    return free
