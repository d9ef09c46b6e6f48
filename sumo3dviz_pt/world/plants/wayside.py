"""Belts of trees and shrubs beside fast roads: woods, hedges and gaps with a view of fields.

Motorways are planted everywhere, for noise and dazzle, also where a scenario has trees of
its own elsewhere. Nothing tall stands in the clear zone beside the carriageway.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.plants.woods import CORE_FACES, far_trees
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi
from sumo3dviz_pt.world.land.far_woods import grown
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.sightlines import SHRUB, TREE, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.build import (
    SHRUB_OFF,
    TREE_OFF,
    Plot,
    is_fast,
    planted,
)
from sumo3dviz_pt.world.street.places import Border, borders_near

CLEAR_ZONE = 9.5
"""Distance of trunks from the carriageways of fast roads, at least [m]."""

NEAR_REACH = 210.0
"""Farther from every camera than this belts are cheap far trees [m]."""

FAR_REACH = 1800.0
"""Where belts end [m]."""

MOST_TREES, MOST_SHRUBS, MOST_FAR = 420, 360, 60_000
"""Trees and shrubs in detail, and triangles of far ones, at most."""

_TUFTS = 46
_WOODED, _SCRUB = -0.75, -1.15  # cover above which there are trees, and shrubs
_SIGHT = 170.0  # roads are kept in sight up to this distance from a camera that stays [m]
_ROOM = {"blocks": 21.0, "homes": 13.0, "shops": 16.0, "trees": 4.0, "shrubs": 1.5}
_SPECIES = ("maple", "lime", "oak", "birch", "poplar", "pine", "spruce")
_OFTEN = np.array([4.0, 3.0, 4.0, 2.5, 0.8, 1.0, 1.2])
_SHRUBS = ("hazel", "hazel", "privet", "broom")


class _Row(NamedTuple):
    """A row of plants beside a road.

    Attributes:
        out: Distance from the carriageway or the sidewalk beside it [m].
        gap: Distance of its plants, about [m].
    """

    out: float
    gap: float


_ROWS = (_Row(12.2, 5.6), _Row(15.8, 6.2), _Row(20.0, 6.6), _Row(25.0, 7.0), _Row(31.0, 7.4))
_SHRUB_ROWS = (_Row(8.2, 2.2), _Row(10.0, 2.4), _Row(13.4, 2.8))


@dataclass(frozen=True, slots=True, eq=False)
class _BeltSpots:
    """Places of a belt.

    Attributes:
        places: (n, 2) [m].
        rows: Counted from the road, (n,).
        names: Unique, (n,).
    """

    places: Floats
    rows: Ints
    names: tuple[str, ...]

    def some(self, keep: Bools | Ints) -> _BeltSpots:
        """Return those that are kept, in the order asked for."""
        index = np.flatnonzero(keep) if keep.dtype == np.bool_ else keep
        names = tuple(self.names[int(k)] for k in index)
        return _BeltSpots(self.places[index], self.rows[index], names)


def wayside(
    network: Network, plot: Plot, pois: Sequence[Poi], *, around: Surroundings
) -> tuple[tuple[Poi, ...], tuple[StaticPart, ...]]:
    """Plant belts beside the fast roads around a shot's cameras.

    Args:
        network: Its fast edges get belts.
        plot: What they keep off.
        pois: The scenario's objects, which keep room around them.
        around: Cameras, ground and the seed.

    Returns:
        Trees and shrubs as points of interest, and far ones.
    """
    borders = [b for b in borders_near(network, around, reach=FAR_REACH) if is_fast(b)]
    if not borders:
        return (), ()
    # Choose free places, for trees outside the clear zone and out of lines of sight.
    lines = [shapely.LineString(border.line[:, :2]) for border in borders]
    trees = _free(_belt(borders, _ROWS, around, "tree"), plot, pois, margin=TREE_OFF)
    trees = trees.some(_beyond(trees.places, borders, CLEAR_ZONE))
    trees = trees.some(_leaves_sight(trees.places, lines, around))
    trees = trees.some(~in_the_way(trees.places, around, crown=TREE))
    shrubs = _belt(borders, _SHRUB_ROWS, around, "shrub")
    shrubs = shrubs.some(around.distances(shrubs.places) < 0.7 * NEAR_REACH)
    shrubs = _free(shrubs, plot, pois, margin=SHRUB_OFF)
    shrubs = shrubs.some(~in_the_way(shrubs.places, around, crown=SHRUB))
    # The nearest are built in detail, up to a number.
    away = around.distances(trees.places)
    order = np.argsort(away, kind="stable")
    count = min(int((away < NEAR_REACH).sum()), MOST_TREES)
    near, far = trees.some(order[:count]), trees.some(order[count:])
    low = shrubs.some(np.argsort(around.distances(shrubs.places), kind="stable")[:MOST_SHRUBS])
    return _pois(near, low, around.seed), _far(far.places, around)


def _belt(
    borders: Sequence[Border], rows: Sequence[_Row], around: Surroundings, what: str
) -> _BeltSpots:
    """Candidates in rows beside borders where the cover is dense, in the picture."""
    places, numbers, names = [np.zeros((0, 2))], [np.zeros(0, np.int64)], []
    for border in borders:
        for row, (out, gap) in enumerate(rows):
            rng = _dice(around.seed, what, border.edge.id, str(row))
            at = np.arange(rng.uniform(0.0, gap), border.length, gap)
            at = at + rng.uniform(-0.4, 0.4, len(at)) * gap
            side = border.walk + out + rng.normal(0.0, 0.16 * gap, len(at))
            spot = border.at(np.clip(at, 0.0, border.length), side).places
            limit = _SCRUB if what == "shrub" else _WOODED + 0.22 * row
            keep = _cover(spot, around.seed) + rng.normal(0, 0.22, len(at)) > limit
            places.append(spot[keep])
            numbers.append(np.full(int(keep.sum()), row))
            names += [f"{what}:{border.edge.id}:{row}:{k}" for k in np.flatnonzero(keep)]
    found = _BeltSpots(np.concatenate(places), np.concatenate(numbers), tuple(names))
    away = around.distances(found.places)
    seen = around.pictured(found.places, radius=14.0) | (away < 40.0)
    return found.some(seen & (away < FAR_REACH))


def _cover(places: Floats, seed: int) -> Floats:
    """How densely the wayside is planted at places, (n,): woods, scrub and gaps in turn."""
    phase = np.random.default_rng(seed + 61).uniform(0.0, 6.28, 4)
    x, y = places.T
    broad = np.sin(x / 43.0 + phase[0]) + np.sin(y / 35.0 + phase[1])
    return np.asarray(
        broad + 0.8 * np.sin((x + y) / 23.0 + phase[2]) + 0.5 * np.sin((x - y) / 11.0 + phase[3])
    )


def _free(spots: _BeltSpots, plot: Plot, pois: Sequence[Poi], *, margin: float) -> _BeltSpots:
    """Those that keep off what is paved and leave objects their room."""
    spots = spots.some(plot.free(spots.places, margin=margin))
    for kind, room in _ROOM.items():
        own = [poi.position for poi in pois if kind_of(poi.type, poi.source) == kind]
        if own and len(spots.places):
            away, _ = cKDTree(np.array(own)).query(spots.places)
            spots = spots.some(np.asarray(away) > room)
    return spots


def _beyond(places: Floats, borders: Sequence[Border], gap: float) -> Bools:
    """Which places keep a distance from all lanes of fast roads."""
    lanes = [lane for border in borders for lane in border.edge.lanes if len(lane.shape) > 1]
    middles = [shapely.LineString(lane.shape[:, :2]) for lane in lanes]
    areas = [m.buffer(k.width / 2, cap_style="flat") for m, k in zip(middles, lanes, strict=True)]
    keep = np.ones(len(places), dtype=np.bool_)
    near = shapely.STRtree(areas).query(shapely.points(places), predicate="dwithin", distance=gap)
    keep[near[0]] = False
    return keep


def _leaves_sight(
    places: Floats, lines: Sequence[shapely.LineString], around: Surroundings
) -> Bools:
    """Which places hide no fast road that lies near before a camera that stays."""
    keep = np.ones(len(places), dtype=np.bool_)
    if not len(places):
        return keep
    spots = shapely.get_coordinates(shapely.segmentize(lines, 6.0))
    for outlook in around.clearance.outlooks:
        eye = outlook.positions[0, :2]
        near = spots[np.hypot(*(spots - eye).T) < _SIGHT]
        road = near[around.pictured(near, radius=2.0, by=outlook)] - eye
        if len(road):
            keep &= _off_rays(places - eye, road)
    return keep


def _off_rays(at: Floats, road: Floats) -> Bools:
    """Which places stand beside all lines of sight to a road; both seen from an eye [m]."""
    away = np.maximum(np.hypot(*at.T), 1e-6)
    ahead = at @ road.T / away[:, None]
    aside = np.abs(at[:, :1] * road[:, 1] - at[:, 1:] * road[:, 0]) / away[:, None]
    # A crown of 5 m at the place is wider farther away.
    hidden = (ahead > away[:, None]) & (aside * away[:, None] < 5.0 * ahead)
    return np.asarray(~hidden.any(axis=1) & (away > 9.0))


def _pois(trees: _BeltSpots, shrubs: _BeltSpots, seed: int) -> tuple[Poi, ...]:
    """Belts as points of interest; neighbours are mostly of one species."""
    found = []
    before = _before(trees)
    for name, place, row in zip(trees.names, trees.places, before, strict=True):
        stand = share_of(seed, "stand", *(str(int(v // 38.0)) for v in place))
        own = share_of(seed, "stem", name)
        share = stand if own < 0.6 else (own - 0.6) / 0.4
        model = _SPECIES[int(np.searchsorted(np.cumsum(_OFTEN) / _OFTEN.sum(), share))]
        found.append(planted(f"wayside:{name}", place, model, tall=True, behind=int(row)))
    for name, place, row in zip(shrubs.names, shrubs.places, _before(shrubs), strict=True):
        model = _SHRUBS[int(share_of(seed, "shrub", name) * len(_SHRUBS))]
        found.append(planted(f"wayside:{name}", place, model, tall=False, behind=int(row)))
    return tuple(found)


def _before(trees: _BeltSpots) -> Ints:
    """How many trees of rows nearer to the road stand close before each, (n,)."""
    if not len(trees.places):
        return trees.rows
    near = cKDTree(trees.places).query_ball_point(trees.places, 8.0)
    pairs = zip(near, trees.rows, strict=True)
    return np.array([min(int((trees.rows[some] < row).sum()), 4) for some, row in pairs])


def _far(places: Floats, around: Surroundings) -> tuple[StaticPart, ...]:
    """The belts' cheap ends."""
    rng = np.random.default_rng(around.seed + 67)
    places = places[: MOST_FAR // (CORE_FACES + _TUFTS)]
    trees = grown(places, around.height_at(places), 1.0, rng)
    mesh, tint = far_trees(trees, tufts=_TUFTS, rng=rng, eyes=around.eyes)
    if not len(mesh.faces):
        return ()
    return (StaticPart("ground/wayside", "ground", Part(mesh, "leaf", tint)),)


def _dice(seed: int, *words: str) -> np.random.Generator:
    """Chance of one row."""
    return np.random.default_rng(int(share_of(seed, "wayside", *words) * 2**48))
