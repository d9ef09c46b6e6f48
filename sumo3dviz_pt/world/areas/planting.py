"""The ground between houses, and the trees and shrubs of woods, parks and gardens.

Around houses lies mown lawn, with gravel at walls and paving up to near sidewalks. Near plants are
built in detail, far ones are cheap. Where they may stand depends on seed and place only: every cell
of a grid over the world has one place. Which of them are there depends on what the shot's camera
sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import closing, polygon_parts, subtract, union
from sumo3dviz_pt.library.plants.greenery import CORE_FACES, far_trees
from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.geometry import Floats, Ints, settled
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.areas.covers import Area, Cover
from sumo3dviz_pt.world.land.horizon import grown
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.sightlines import SHRUB, TREE, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings, Tile
from sumo3dviz_pt.world.plants.trees import Plot, planted

NEAR_REACH = 130.0
"""Trees farther from every camera than this are cheap far trees [m]."""

FAR_REACH = 2600.0
"""Where far trees end [m]."""

MOST_TREES, MOST_SHRUBS, MOST_FAR = 260, 160, 90_000
"""Trees and shrubs in detail, and triangles of far ones, at most."""

_OFF_ROAD = {True: 3.2, False: 1.4}  # of trees and of shrubs, from what is paved [m]
_RIM = 1.2  # of stems from the edge of their area [m]
_SHRUB_REACH = 90.0
_GROVE = 450.0  # farther away one far tree stands for several [m]
_TUFTS = {False: 30, True: 14}
_HECTARE = 10_000.0


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """An area on which something grows.

    Attributes:
        area: The area.
        cover: Its cover.
        shape: What is seen of it [m].
    """

    area: Area
    cover: Cover
    shape: shapely.Geometry


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """What grows on areas.

    Attributes:
        pois: Trees and shrubs in detail.
        static: Far ones.
    """

    pois: tuple[Poi, ...] = ()
    static: tuple[StaticPart, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class _Spots:
    """Places of plants.

    Attributes:
        places: (n, 2) [m].
        cells: Of the grid, (n, 2).
        shares: Chance of each, (n,) in [0, 1).
        stands: Number of the stand that each belongs to, (n,).
    """

    places: Floats
    cells: Ints
    shares: Floats
    stands: Ints


def grow(stands: Sequence[Stand], plot: Plot, *, around: Surroundings) -> Grown:
    """Grow trees and shrubs on areas around the cameras of a shot.

    Args:
        stands: Areas on which something grows.
        plot: What stems keep off.
        around: Cameras, ground and the seed.
    """
    trees = _spots(stands, plot, around, tall=True)
    away = around.distances(trees.places)
    order = np.argsort(away, kind="stable")
    count = min(int((away < NEAR_REACH).sum()), MOST_TREES)
    shrubs = _spots(stands, plot, around, tall=False)
    low = np.argsort(around.distances(shrubs.places), kind="stable")[:MOST_SHRUBS]
    pois = [
        *_pois(stands, trees, order[:count], tall=True),
        *_pois(stands, shrubs, low, tall=False),
    ]
    return Grown(tuple(pois), _far(trees, order[count:], around))


def _spots(stands: Sequence[Stand], plot: Plot, around: Surroundings, *, tall: bool) -> _Spots:
    """Places that are free, and that a camera sees."""
    reach = FAR_REACH if tall else _SHRUB_REACH
    parts = []
    for number, stand in enumerate(stands):
        density = stand.cover.trees if tall else stand.cover.shrubs
        if density > 0.0:
            spots = _grid(stand, density, number, around, reach=reach, tall=tall)
            if len(spots.places):
                parts.append(spots)
    if not parts:
        return _Spots(np.zeros((0, 2)), np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(0, int))
    columns = (
        np.concatenate([getattr(spots, name) for spots in parts])
        for name in ("places", "cells", "shares", "stands")
    )
    spots = _Spots(*columns)
    keep = ~in_the_way(spots.places, around, crown=TREE if tall else SHRUB)
    keep[keep] = plot.free(spots.places[keep], margin=_OFF_ROAD[tall])
    return _some(spots, np.flatnonzero(keep))


def _grid(
    stand: Stand, density: float, number: int, around: Surroundings, *, reach: float, tall: bool
) -> _Spots:
    """One place in every cell of a grid over an area, near a camera and in its picture."""
    step = float(np.sqrt(_HECTARE / density))
    low, high = np.reshape(stand.shape.bounds, (2, 2))
    eyes = around.viewpoints[:, :2]
    if len(eyes):
        low, high = (
            np.maximum(low, eyes.min(axis=0) - reach),
            np.minimum(high, eyes.max(axis=0) + reach),
        )
    first, last = np.floor(low / step).astype(np.int64), np.floor(high / step).astype(np.int64)
    if (last < first).any():
        return _Spots(np.zeros((0, 2)), np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(0, int))
    i, j = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)))
    cells = np.column_stack([i.ravel(), j.ravel()])
    salt = 2 * around.seed + int(tall)
    chance = np.stack([_hashed(cells, salt + 101 * k) for k in range(3)], axis=1)
    places = settled((cells + 0.12 + 0.76 * chance[:, :2]) * step)
    keep = around.distances(places) < reach
    keep[keep] = around.pictured(places[keep], radius=14.0) | (
        around.distances(places[keep]) < 40.0
    )
    inner = shapely.buffer(stand.shape, -_RIM, quad_segs=1)
    shapely.prepare(inner)
    keep[keep] = shapely.contains_xy(inner, places[keep])
    count = int(keep.sum())
    return _Spots(places[keep], cells[keep], chance[keep, 2], np.full(count, number))


def _hashed(cells: Ints, salt: int) -> Floats:
    """A number in [0, 1) for every cell, (n,): an integer hash, the same everywhere."""
    with np.errstate(over="ignore"):
        x, y = cells.astype(np.uint64).T
        value = x * np.uint64(0x9E3779B97F4A7C15) ^ y * np.uint64(0xC2B2AE3D27D4EB4F)
        value ^= np.uint64(salt % 2**32) * np.uint64(0x165667B19E3779F9)
        for shift in (30, 27):
            value ^= value >> np.uint64(shift)
            value *= np.uint64(0xBF58476D1CE4E5B9)
        value ^= value >> np.uint64(31)
    return np.asarray((value >> np.uint64(11)).astype(np.float64) / 2.0**53)


def _some(spots: _Spots, index: Ints) -> _Spots:
    """Some of the places."""
    return _Spots(spots.places[index], spots.cells[index], spots.shares[index], spots.stands[index])


def _pois(stands: Sequence[Stand], spots: _Spots, index: Ints, *, tall: bool) -> list[Poi]:
    """Plants as points of interest; those with others before them may be coarser."""
    pois, shrubs = [], urn("area_shrubs")
    for rank, k in enumerate(index.tolist()):
        stand, share = stands[int(spots.stands[k])], float(spots.shares[k])
        weights = dict(stand.cover.species) if tall else {}
        names, often = (tuple(weights), tuple(weights.values())) if weights else shrubs
        sums = np.cumsum(often)
        species = names[int(np.searchsorted(sums / sums[-1], share, side="right"))]
        i, j = spots.cells[k].tolist()
        name = f"area:{'tree' if tall else 'shrub'}:{stand.area.id}:{i}:{j}"
        # The nearest ones hide most of those behind them.
        behind = min(rank // 40, 3) if stand.cover.trees > 100.0 else 0
        pois.append(planted(name, spots.places[k], species, tall=tall, behind=behind))
    return pois


def _far(spots: _Spots, index: Ints, around: Surroundings) -> tuple[StaticPart, ...]:
    """Far trees; farther still, one stands for several."""
    places = spots.places[index]
    if not len(places):
        return ()
    cells, away = spots.cells[index], around.distances(places)
    parts = []
    budget = MOST_FAR
    for grove in (False, True):
        tufts = _TUFTS[grove]
        here = away >= _GROVE if grove else away < _GROVE
        if grove:
            here &= (cells % 2 == 0).all(axis=1)
        chosen = np.flatnonzero(here)
        # Chance among near and far ones, or the budget would end at a ring.
        rank = away[chosen] * (0.35 + 0.65 * spots.shares[index][chosen])
        chosen = chosen[np.argsort(rank, kind="stable")][: budget // (tufts + CORE_FACES)]
        if not len(chosen):
            continue
        rng = np.random.default_rng(around.seed + 83 + int(grove))
        scale = 1.75 if grove else 1.0
        trees = grown(places[chosen], around.height_at(places[chosen]), scale, rng)
        mesh, tint = far_trees(trees, tufts=tufts, rng=rng, eyes=around.eyes)
        budget -= len(chosen) * (tufts + CORE_FACES)
        name = "groves" if grove else "trees"
        parts.append(StaticPart(f"areas/{name}", "areas", Part(mesh, "leaf", tint)))
    return tuple(parts)


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
