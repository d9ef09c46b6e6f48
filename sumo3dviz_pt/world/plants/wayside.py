"""What grows along fast roads and on open lots: verges, belts of trees, yards.

Verges are gravel, mown grass, then tall weeds. Colours are tints of faces, so that no material is
added.

Belts of trees and shrubs are woods, hedges and gaps with a view of fields. Motorways are planted
everywhere, for noise and dazzle, also where a scenario has trees of its own elsewhere. Nothing tall
stands in the clear zone beside the carriageway.

On lots between houses that stay open, trees grow behind a hedge. Without them one would look
through such gaps over empty fields in the middle of a town.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.plants.greenery import CORE_FACES, Blades, blades_mesh, far_trees
from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import dice_of, share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.land.horizon import grown
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.sightlines import SHRUB, TREE, hides, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.trees import SHRUB_OFF, TREE_OFF, Plot, is_fast, planted
from sumo3dviz_pt.world.rows.fronts import SOURCE, Rows, Yard
from sumo3dviz_pt.world.street.places import Border, borders_near

REACH = 170.0
"""Weeds and gravel lie at most this far from a camera [m]."""

MOST_WEEDS = 90_000
"""Triangles of weeds, at most."""

STRIP = 0.55
"""Width of the strip of gravel beside the asphalt, about [m]."""

_MOWN = 2.4  # width of the strip that is mown [m]
_DEEP = 12.5  # where weeds end [m]
_VERGES_DENSE = 7.0  # clumps on a square metre where they are densest
_WHOLE = 9.0  # up to this distance clumps are whole [m]
_BLADES = 22  # of a whole clump
_CLEAR = 0.9  # distance from everything paved [m]
_PIECE = 8.0  # length of gravel with one width of grains [m]
_STEP_OFF = 0.5  # where the ground lies farther from the road's height, no stones lie [m]
_STALKS = np.array(
    [
        [0.235, 0.195, 0.092],  # dead grass
        [0.165, 0.165, 0.062],  # ripe
        [0.085, 0.128, 0.034],  # green
        [0.058, 0.105, 0.030],  # nettles
        [0.120, 0.150, 0.040],
        [0.150, 0.090, 0.058],  # dock
    ]
)
_SHARES = np.array([0.26, 0.24, 0.22, 0.10, 0.13, 0.05])
_STONES = np.array(
    [[0.150, 0.140, 0.122], [0.185, 0.170, 0.148], [0.125, 0.112, 0.092], [0.130, 0.115, 0.080]]
)


def verges(network: Network, plot: Plot, *, around: Surroundings) -> tuple[StaticPart, ...]:
    """Build gravel and weeds beside the fast roads near a shot's cameras.

    Args:
        network: Its fast edges have verges.
        plot: What is paved.
        around: Cameras, ground and the seed.
    """
    borders = [b for b in borders_near(network, around, reach=REACH) if is_fast(b)]
    if not borders:
        return ()
    parts = [_gravel(borders, around), _weeds(borders, plot, around)]
    return tuple(part for part in parts if len(part.part.mesh.faces))


def _weeds(borders: Sequence[Border], plot: Plot, around: Surroundings) -> StaticPart:
    """Clumps of tall grass and weeds where no mower comes."""
    places = np.concatenate([_clumps(border, around.seed) for border in borders])
    away = around.distances(places)
    keep = (away < REACH) & around.pictured(places, radius=1.5)
    places = places[keep]
    places = places[plot.free(places, margin=_CLEAR)]
    away = around.distances(places)
    rng = np.random.default_rng(around.seed + 71)
    # Towards the end they thin out, so that no edge shows.
    fade = np.clip((REACH - away) / (0.5 * REACH), 0.0, 1.0)
    counts = np.clip(_BLADES * (_WHOLE / np.maximum(away, _WHOLE)) ** 1.15, 3.0, _BLADES)
    share = min(1.0, MOST_WEEDS / max(float((counts * fade).sum()), 1.0))
    keep = rng.random(len(places)) < fade * share
    blades = _blades(places[keep], counts[keep].astype(np.int64), around, rng)
    mesh, tint = blades_mesh(blades, fine=False)
    return StaticPart("ground/weeds", "ground", Part(mesh, "leaf", tint))


def _clumps(border: Border, seed: int) -> Floats:
    """Places of clumps beside a border, (n, 2) [m]: in drifts, denser away from the road."""
    rng = dice_of(seed, "weeds", border.edge.id)
    count = int(_VERGES_DENSE * border.length * (_DEEP - _MOWN))
    along = rng.uniform(0.0, border.length, count)
    # The mower's edge is no straight line.
    edge = _MOWN + 0.35 * np.sin(along / 3.1) + 0.3 * np.sin(along / 7.7 + 1.0)
    out = edge + (_DEEP - edge) * rng.random(count) ** 1.4
    places = border.at(along, border.walk + out).places
    x, y = places.T
    drift = np.sin(x / 5.3 + y / 9.1) + np.sin(y / 4.1 - x / 11.0) + 0.8 * np.sin((x + y) / 2.3)
    chance = np.clip(0.42 + 0.3 * drift, 0.05, 1.0)
    return np.asarray(places[rng.random(count) < chance])


def _blades(places: Floats, counts: Ints, around: Surroundings, rng: np.random.Generator) -> Blades:
    """Blades of clumps: those of one share colour and height."""
    clump = np.repeat(np.arange(len(places)), counts)
    total = len(clump)
    x, y = places.T if len(places) else (np.zeros(0), np.zeros(0))
    # Neighbouring clumps are often of one kind.
    stand = 0.5 + 0.5 * np.sin(x / 3.7 + 2.0 * np.sin(y / 4.9)) * np.sin(y / 3.1 + x / 13.0)
    pick = np.clip(0.6 * stand + 0.4 * rng.random(len(places)), 0.0, 0.999)
    kind = np.searchsorted(np.cumsum(_SHARES), pick)
    coarse = np.sqrt(_BLADES / np.maximum(counts, 1))[clump]
    tall = rng.uniform(0.28, 0.8, len(places))[clump] * rng.uniform(0.45, 1.1, total)
    feet = places[clump] + rng.normal(0, 0.09, (total, 2)) * (1.0 + 0.35 * coarse[:, None])
    value = rng.uniform(0.75, 1.25, (total, 1)) * rng.uniform(0.85, 1.15, len(places))[clump, None]
    return Blades(
        np.column_stack([feet, around.height_at(feet) if total else np.zeros(0)]),
        rng.uniform(0.0, 2.0 * np.pi, total),
        tall,
        rng.uniform(0.011, 0.024, total) * coarse**2,
        rng.uniform(0.08, 0.6, total),
        np.clip(1.25 * _STALKS[np.minimum(kind, 5)][clump] * value, 0.004, 0.6),
    )


def _gravel(borders: Sequence[Border], around: Surroundings) -> StaticPart:
    """A ragged strip of stones along the asphalt's edge."""
    meshes: list[Mesh] = [merge_meshes([])]
    tints = [np.zeros((0, 3))]
    for border in borders:
        for k in range(max(int(border.length / _PIECE), 1)):
            ends = np.minimum(np.array([k, k + 1]) * _PIECE, border.length)
            middle = border.at(np.array([ends.mean()]), 0.3).places
            away = float(around.distances(middle)[0])
            if away > REACH or not around.pictured(middle, radius=_PIECE).all():
                continue
            rng = dice_of(around.seed, "gravel", border.edge.id, str(k))
            mesh, tint = _strip(border, ends, away, around, rng)
            meshes.append(mesh)
            tints.append(tint)
    part = Part(merge_meshes(meshes), "bark", np.concatenate(tints))
    return StaticPart("ground/gravel", "ground", part)


def _strip(
    border: Border, ends: Floats, away: float, around: Surroundings, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """One piece of gravel: a grid whose outer edge is ragged, finer near a camera."""
    grain = float(np.clip(0.005 * away, 0.08, 0.6))
    along = np.linspace(ends[0], ends[1], max(int(np.ptp(ends) / grain), 1) + 1)
    across = np.linspace(0.0, 1.0, max(int(STRIP / grain), 1) + 1)
    wide = STRIP * (0.8 + 0.3 * np.sin(along / 1.7) * np.sin(along / 4.3 + 1.0))
    rows, steps = [], []
    for share in across:
        jitter = rng.normal(0, 0.22 * grain, len(along)) if share > 0.0 else 0.0
        places, level, _ = border.at(along, border.walk + share * wide + jitter)
        ground = around.height_at(places) + 0.012
        steps.append(np.abs(level - ground))
        rows.append(np.column_stack([places, ground + (1.0 - share) * (level - 0.015 - ground)]))
    n, m = len(along), len(across)
    i = np.arange(n - 1)[:, None] + n * np.arange(m - 1)
    quads = np.stack([i, i + 1, i + n + 1, i + n], axis=-1).reshape(-1, 4)
    # Beside bridges, walls and tunnels it would hang as a curtain from road to ground.
    quads = quads[np.concatenate(steps)[quads].max(axis=1, initial=0.0) < _STEP_OFF]
    if border.outward < 0:
        quads = quads[:, ::-1]
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    stone = _STONES[rng.integers(0, len(_STONES), len(faces))]
    return Mesh(np.concatenate(rows), faces), stone * rng.uniform(0.85, 1.15, (len(faces), 1))


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


class _Row(NamedTuple):
    """A row of plants beside a road.

    Attributes:
        out: Distance from the carriageway or the sidewalk beside it [m].
        gap: Distance of its plants, about [m].
    """

    out: float
    gap: float


_ROWS = (_Row(12.2, 5.6), _Row(15.8, 6.2), _Row(20.0, 6.6), _Row(25.0, 7.0), _Row(31.0, 7.4))
_BAYS = {"tree": 7.0, "shrub": 2.5}
"""How far the edge of a wood steps back in its bays [m]: in line it would be a wall."""

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
    bays = _BAYS[what]
    places, numbers, names = [np.zeros((0, 2))], [np.zeros(0, np.int64)], []
    for border in borders:
        for row, (out, gap) in enumerate(rows):
            rng = dice_of(around.seed, "wayside", what, border.edge.id, str(row))
            at = np.arange(rng.uniform(0.0, gap), border.length, gap)
            at = at + rng.uniform(-0.4, 0.4, len(at)) * gap
            at = np.clip(at, 0.0, border.length)
            side = border.walk + out + rng.normal(0.0, 0.16 * gap, len(at))
            side += bays * _bay(border.at(at, side).places, around.seed)
            spot = border.at(at, side).places
            limit = _SCRUB if what == "shrub" else _WOODED + 0.22 * row
            keep = _cover(spot, around.seed) + rng.normal(0, 0.22, len(at)) > limit
            places.append(spot[keep])
            numbers.append(np.full(int(keep.sum()), row))
            names += [f"{what}:{border.edge.id}:{row}:{k}" for k in np.flatnonzero(keep)]
    belt = _BeltSpots(np.concatenate(places), np.concatenate(numbers), tuple(names))
    away = around.distances(belt.places)
    seen = around.pictured(belt.places, radius=14.0) | (away < 40.0)
    return belt.some(seen & (away < FAR_REACH))


def _cover(places: Floats, seed: int) -> Floats:
    """How densely the wayside is planted at places, (n,): woods, scrub and gaps in turn."""
    phase = np.random.default_rng(seed + 61).uniform(0.0, 6.28, 4)
    x, y = places.T
    broad = np.sin(x / 43.0 + phase[0]) + np.sin(y / 35.0 + phase[1])
    return np.asarray(
        broad + 0.8 * np.sin((x + y) / 23.0 + phase[2]) + 0.5 * np.sin((x - y) / 11.0 + phase[3])
    )


def _bay(places: Floats, seed: int) -> Floats:
    """How far a wood's edge steps back from the road at places, (n,) in [0, 1]."""
    phase = np.random.default_rng(seed + 62).uniform(0.0, 6.28, 3)
    x, y = places.T
    wave = np.sin(x / 5.9 + phase[0]) + np.sin(y / 4.7 + phase[1])
    return np.asarray(np.clip(0.35 * (wave + np.sin((x + y) / 9.1 + phase[2])), 0.0, 1.0))


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
    pois = []
    before = _before(trees)
    species, often = urn("belts")
    bushes, _ = urn("belt_shrubs")
    for name, place, row in zip(trees.names, trees.places, before, strict=True):
        stand = share_of(seed, "stand", *(str(int(v // 38.0)) for v in place))
        own = share_of(seed, "stem", name)
        share = stand if own < 0.6 else (own - 0.6) / 0.4
        model = species[int(np.searchsorted(np.cumsum(often) / np.sum(often), share))]
        pois.append(planted(f"wayside:{name}", place, model, tall=True, behind=int(row)))
    for name, place, row in zip(shrubs.names, shrubs.places, _before(shrubs), strict=True):
        model = bushes[int(share_of(seed, "shrub", name) * len(bushes))]
        pois.append(planted(f"wayside:{name}", place, model, tall=False, behind=int(row)))
    return tuple(pois)


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


_GAP = 5.5  # between trees [m]
_EDGE = 2.6  # distance of trunks from the border of the lot [m]
_YARDS_DENSE = 0.9  # share of places that bear one
_OVERLAP = 0.15  # by how much neighbours may overlap [m]
_HEDGE = 0.7  # how far the hedge's middle lies behind the building line [m]
_THICK = 0.5  # half the width of a hedge [m]
_LOOKED_OVER = 4.0  # cameras higher than this above the roads look over hedges [m]


def gardens(rows: Rows) -> tuple[Yard, ...]:
    """Open lots that no house reaches into, nor another open lot before them."""
    areas = [shapely.Polygon(yard.plan).buffer(-_OVERLAP) for yard in rows.yards]
    houses = shapely.STRtree([shapely.Polygon(house.plan) for house in rows.houses])
    others = shapely.STRtree(areas)
    return tuple(
        yard
        for number, (yard, area) in enumerate(zip(rows.yards, areas, strict=True))
        if not len(houses.query(area, predicate="intersects"))
        and others.query(area, predicate="intersects").min(initial=number) == number
    )


def yard_trees(yards: Sequence[Yard], around: Surroundings) -> tuple[Poi, ...]:
    """Place trees on open lots, as points of interest.

    Args:
        yards: The lots.
        around: Trees keep clear of cameras and of what they look at.
    """
    trees = [
        (f"yard:{yard.id}:{number}", place, species)
        for yard in yards
        for number, (place, species) in enumerate(_trees(yard, around.seed))
    ]
    places = np.array([place for _, place, _ in trees]).reshape(-1, 2)
    gone = in_the_way(places, around, crown=TREE).tolist()
    return tuple(
        planted(*tree, tall=True) for tree, yields in zip(trees, gone, strict=True) if not yields
    )


def yard_hedges(yards: Sequence[Yard], around: Surroundings) -> tuple[Polygon, ...]:
    """Place hedges along the streets that open lots lie at, as lines.

    Args:
        yards: The lots.
        around: Hedges keep clear of cameras at the height of people and of what they look at.
    """
    hedges = []
    for yard in yards:
        front = shapely.LineString(yard.plan[: yard.fronts + 1])
        line = front.offset_curve(_HEDGE, join_style="mitre")
        hidden = hides(line.buffer(_THICK), around, over=_LOOKED_OVER)
        if line.geom_type == "LineString" and line.length > 2.0 and not hidden:
            shape = shapely.get_coordinates(line)
            hedges.append(Polygon(f"yard:{yard.id}", "hedge", shape, False, None, SOURCE))
    return tuple(hedges)


def _trees(yard: Yard, seed: int) -> Iterator[tuple[Floats, str]]:
    """Places and species of trees in rows that are out of line."""
    inner = shapely.Polygon(yard.plan).buffer(-_EDGE)
    if inner.is_empty:
        return
    rng = dice_of(seed, "yard trees", yard.id)
    kinds, _ = urn("yards")
    x0, y0, x1, y1 = inner.bounds
    for x in np.arange(x0 + 0.3, x1, _GAP):
        for y in np.arange(y0 + 0.3, y1, _GAP):
            place = np.array([x, y]) + rng.uniform(-0.9, 0.9, 2)
            species = kinds[int(rng.integers(len(kinds)))]
            if shapely.contains_xy(inner, *place) and rng.random() < _YARDS_DENSE:
                yield place, species
