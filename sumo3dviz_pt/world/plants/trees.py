"""Trees and shrubs where a scenario brings none: along roads, and what closes an open plain.

They are points of interest like those of a scenario, so that sizes, species, levels of detail and
the budget are the same. Where they may stand depends on seed and place only; which of them are
there on what the shot's camera sees.

An open plain is closed by far hedgerows, woods and villages. They lie farther away than single
trees and are as cheap as they look small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.mesh.planar import sides
from sumo3dviz_pt.library.plants.greenery import CORE_FACES, FarTrees, far_trees
from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.camera import in_picture
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes, settled
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import dice_of, pick
from sumo3dviz_pt.model.scene import LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.land.horizon import GREEN, grown
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.sightlines import SHRUB, TREE, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.street.places import Border, borders_near, drives

TREE_OFF, SHRUB_OFF = 8.0, 4.0
"""Distance of trees and shrubs from everything paved, at least [m]."""

REACH = 620.0
"""Trees stand at most this far from a camera [m]; beyond, `woods` has cheaper ones."""

CLEAR = 130.0
"""A camera that stays where it is sees at least this far without a tree [m]."""

MOST_TREES, MOST_SHRUBS = 900, 280
"""The nearest of them, at most."""

MARGIN = 6.0
"""Distance from the scenario's own objects [m]."""

_CROWN = 8.0  # height of the middle of a tree's crown [m]

SOURCE = "planting"
"""The `source` of everything that is planted."""

BEHIND = "behind"
"""The parameter with the number of rows of plants in front of a plant."""

_OWN = frozenset({"trees", "homes", "shops", "blocks", "buildings"})
_FAST = 70.0 / 3.6  # roads on which more is allowed have belts [m/s]
_WIDE = 3  # lanes of carriageways that have them, whatever is allowed there
_IN_VIEW = 400.0  # objects farther away do not make a picture green [m]
_SHRUB_REACH = 200.0
_LOTS = 88.0  # spacing of lots that may bear a grove [m]
_TILE = 12.0  # of the ground's texture [m]
_FIELDS = np.array([[1.0, 0.5], [-1.0, 2.0]]) / (16.0 * _TILE)  # as that draws them [1/m]


@dataclass(frozen=True, slots=True, eq=False)
class Plot:
    """What plants must keep off.

    Attributes:
        paved: Roads, rails and footways: polygons, (n,).
        areas: Buildings and other areas: polygons, (k,).
        objects: The scenario's points of interest, (m, 2) [m].
    """

    paved: Sequence[shapely.Polygon]
    areas: Sequence[shapely.Polygon] = ()
    objects: Floats = field(default_factory=lambda: np.zeros((0, 2)))

    def free(self, places: Floats, *, margin: float) -> Bools:
        """Return which places, (n, 2) [m], are at least a margin [m] away from everything."""
        spots = shapely.points(places)
        clear = np.ones(len(places), dtype=np.bool_)
        for areas, gap in ((self.paved, margin), (self.areas, MARGIN)):
            if not len(areas) or not len(places):
                continue
            x0, y0 = places.min(axis=0) - gap
            x1, y1 = places.max(axis=0) + gap
            near = shapely.clip_by_rect(list(areas), x0 - 1.0, y0 - 1.0, x1 + 1.0, y1 + 1.0)
            near = [area for area in near if not area.is_empty]
            for area in near:
                shapely.prepare(area)
                clear &= ~shapely.contains_xy(area, places)
            borders = shapely.STRtree(sides(near))
            clear[borders.query(spots, predicate="dwithin", distance=gap)[0]] = False
        if len(self.objects) and len(places):
            clear &= np.asarray(cKDTree(self.objects).query(places)[0]) > MARGIN
        return clear


@dataclass(frozen=True, slots=True)
class Planting:
    """Plants of a shot.

    Attributes:
        pois: Trees and shrubs; `params["model"]` is their species.
        left_out: Why there are none.
        static: What lies farther away.
        open: Whether it is open country, with fields.
    """

    pois: tuple[Poi, ...]
    left_out: tuple[LeftOut, ...] = ()
    static: tuple[StaticPart, ...] = ()
    open: bool = False


class _Candidate(NamedTuple):
    """A plant that stands somewhere if there is room.

    Attributes:
        name: Unique among plants.
        place: (2,) [m].
        species: A key of `SPECIES` or `SHRUBS`.
    """

    name: str
    place: Floats
    species: str


@dataclass(slots=True, eq=False)
class _Nursery:
    """Candidates while they are collected."""

    trees: list[_Candidate] = field(default_factory=list)
    shrubs: list[_Candidate] = field(default_factory=list)


def plot_of(
    paved: Sequence[shapely.Polygon], pois: Sequence[Poi], polygons: Sequence[Polygon]
) -> Plot:
    """Return what plants must keep off.

    Args:
        paved: Outlines of roads, rails and footways.
        pois: All points of interest.
        polygons: All polygons: nothing is planted in areas of any kind.
    """
    areas = [
        shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
        for item in polygons
        if (item.fill or kind_of(item.type, item.source) == "buildings") and len(item.shape) > 2
    ]
    objects = np.array([poi.position for poi in pois], dtype=np.float64).reshape(-1, 2)
    return Plot(paved, areas, objects)


def is_fast(border: Border) -> bool:
    """Return whether a border is that of a motorway or of a wide road without sidewalks."""
    # A cycle lane makes no motorway of a street.
    lanes = [lane for lane in border.edge.lanes if drives(lane)]
    wide = len(lanes) >= _WIDE and border.walk == 0.0
    return wide or border.edge.told_speed > _FAST


def why_nowhere(surface: str) -> str | None:
    """Return why nothing grows on a ground of a name, or None."""
    return None if any(word in surface for word in GREEN) else f"nothing grows on {surface}"


def why_bare(pois: Sequence[Poi], polygons: Sequence[Polygon], around: Surroundings) -> str | None:
    """Return why nothing is planted away from fast roads, or None.

    Args:
        pois: All points of interest.
        polygons: All polygons.
        around: Cameras.
    """
    own = [poi.position for poi in pois if kind_of(poi.type, poi.source) in _OWN]
    own += [
        tuple(item.shape[:, :2].mean(axis=0))
        for item in polygons
        if kind_of(item.type, item.source) in _OWN
    ]
    places = np.array(own, dtype=np.float64).reshape(-1, 2)
    if len(places):
        seen = (around.distances(places) < _IN_VIEW) & around.pictured(places, radius=15.0)
        if seen.any():
            return "the scenario has trees or buildings of its own in view"
    return None


def plant(network: Network, plot: Plot, *, around: Surroundings) -> Planting:
    """Plant trees and shrubs around the cameras of a shot.

    Args:
        network: Its edges give rows and shrubs along carriageways.
        plot: What they keep off.
        around: Lanes, cameras and the seed.
    """
    nursery = _Nursery()
    for border in borders_near(network, around, reach=_IN_VIEW):
        _along(border, around.seed, nursery)
    for lot in _lots(around, _LOTS):
        _grove(lot, around.seed, nursery)
    # The ground's texture begins at whole tiles.
    origin = _TILE * np.floor(np.array(network.location.boundary[:2]) / _TILE)
    _hedgerows(around, origin, nursery)
    trees = _chosen(nursery.trees, plot, around, tall=True)
    shrubs = _chosen(nursery.shrubs, plot, around, tall=False)
    return Planting((*trees, *shrubs))


def _along(border: Border, seed: int, nursery: _Nursery) -> None:
    """A row of trees, or shrubs in clumps, beside a carriageway."""
    edge, length = border.edge.id, border.length
    rng = dice_of(seed, "planting", "border", edge)
    if is_fast(border):
        return  # those have belts (`wayside`)
    # A row of trees.
    out = border.walk + rng.uniform(13.0, 15.0)
    species, chance = _drawn("alleys", rng), rng.random()
    gap = rng.uniform(9.0, 14.0)
    if length > 50.0 and chance < 0.5:
        along = np.arange(rng.uniform(0, gap), length, gap)
        along = along[rng.random(len(along)) < 0.9]
        places = border.at(along, out + rng.normal(0, 0.4, len(along))).places
        nursery.trees += [
            _Candidate(f"row:{edge}:{k}", place, species) for k, place in enumerate(places)
        ]
    if length < 25.0:
        return
    # Shrubs come in clumps of one kind.
    kinds, _ = urn("verges")
    for clump in range(int(length / 26.0)):
        if rng.random() < 0.45:
            count, model = int(rng.integers(2, 7)), kinds[rng.integers(len(kinds))]
            along = np.clip(rng.uniform(0, length) + rng.normal(0, 3.5, count), 0.0, length)
            places = border.at(along, border.walk + rng.uniform(4.5, 10.0, count)).places
            nursery.shrubs += [
                _Candidate(f"verge:{edge}:{clump}:{k}", place, model)
                for k, place in enumerate(places)
            ]


def _grove(lot: tuple[int, int], seed: int, nursery: _Nursery) -> None:
    """A grove of mostly one species, with shrubs at its rim, in some of the lots."""
    rng = dice_of(seed, "planting", "grove", str(lot[0]), str(lot[1]))
    if rng.random() > 0.34:
        return
    # Choose its shape and species.
    name = f"grove:{lot[0]}:{lot[1]}"
    middle = (np.array(lot) + rng.uniform(0.1, 0.9, 2)) * _LOTS
    count = int(3 + 26 * rng.random() ** 1.6)
    size = 4.2 * np.sqrt(count)
    turn = rng.uniform(0, np.pi)
    long, wide = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    species, other = _drawn("groves", rng), _drawn("groves", rng)
    # Plant trees in an oval, and shrubs around it.
    spots = _apart(rng.uniform(-1, 1, (4 * count, 2)) * [1.5 * size, 0.75 * size], 5.0)[:count]
    for k, (a, b) in enumerate(spots):
        which = species if rng.random() < 0.75 else other
        nursery.trees.append(_Candidate(f"{name}:{k}", middle + a * long + b * wide, which))
    rim = rng.uniform(0, 2 * np.pi, count)
    for k, angle in enumerate(rim):
        reach = rng.uniform(0.9, 1.35)
        spot = np.cos(angle) * 1.5 * size * reach * long + np.sin(angle) * size * reach * wide
        nursery.shrubs.append(_Candidate(f"{name}:rim:{k}", middle + spot, "hazel"))


def _hedgerows(around: Surroundings, origin: Floats, nursery: _Nursery) -> None:
    """Broken lines of trees and shrubs on some of the borders between fields."""
    back = np.linalg.inv(_FIELDS)
    corners = {tuple(cell) for cell in _cells_of(_lots(around, 60.0), origin)}
    for i, j in sorted(corners):
        for side, step in enumerate(np.eye(2)):
            rng = dice_of(around.seed, "planting", "hedgerow", str(i), str(j), str(side))
            if rng.random() > 0.42:
                continue
            begin, way = origin + back @ np.array([i, j]), back @ step
            at = np.arange(0.02, 0.98, 4.0 / float(np.hypot(*way)))
            dense = np.sin(9.0 * at + rng.uniform(0, 6.28)) + 0.8 * np.sin(23.0 * at)
            species = _drawn("groves", rng)
            for k, (share, full) in enumerate(zip(at, dense, strict=True)):
                place = begin + share * way + rng.normal(0, 0.9, 2)
                name = f"hedgerow:{i}:{j}:{side}:{k}"
                if rng.random() < 0.2 + 0.24 * full:
                    nursery.trees.append(_Candidate(name, place, species))
                elif rng.random() < 0.3 + 0.3 * full:
                    shrub = "hazel" if k % 3 else "broom"
                    nursery.shrubs.append(_Candidate(name, place, shrub))


def _chosen(
    candidates: Sequence[_Candidate], plot: Plot, around: Surroundings, *, tall: bool
) -> list[Poi]:
    """Candidates that stand free, can be seen and hide nothing, the nearest to a camera."""
    if not candidates:
        return []
    places = settled([candidate.place for candidate in candidates])
    away = around.distances(places)
    keep = away < (REACH if tall else _SHRUB_REACH)
    keep &= around.pictured(places, radius=14.0) | (away < 40.0)
    keep &= ~in_the_way(places, around, crown=TREE if tall else SHRUB)
    if tall:
        keep &= ~in_sight(places, around)
    near = np.flatnonzero(keep)
    margin = TREE_OFF if tall else SHRUB_OFF
    near = near[plot.free(places[near], margin=margin)]
    near = near[~around.index.covers(places[near], margin=margin)]
    near = near[np.argsort(away[near], kind="stable")]
    most = MOST_TREES if tall else MOST_SHRUBS
    return [planted(*candidates[int(k)], tall=tall) for k in near[:most]]


def in_sight(places: Floats, around: Surroundings) -> Bools:
    """Return at which places, (n, 2) [m], a tree would close the view of open country, (n,)."""
    hidden = np.zeros(len(places), dtype=np.bool_)
    for outlook in around.clearance.outlooks:
        near = np.flatnonzero(np.hypot(*(places - outlook.positions[0, :2]).T) < CLEAR)
        if not len(near):
            continue
        feet = np.column_stack([places[near], around.height_at(places[near])])
        # A camera high above sees crowns whose feet lie below its picture.
        for up in (0.0, _CROWN):
            crowns = feet + np.array([0.0, 0.0, up])
            hidden[near] |= in_picture(outlook, crowns, radius=6.0).any(axis=1)
    return hidden


def before_cameras(
    pois: Sequence[Poi], network: Network, around: Surroundings
) -> tuple[LeftOut, ...]:
    """Say which trees and shrubs of the scenario spoil a camera's view: they stay.

    Args:
        pois: All points of interest of the scenario that are drawn.
        network: Places are told in its file's coordinates.
        around: Cameras.
    """
    gone = []
    for kind, crown in (("trees", TREE), ("shrubs", SHRUB)):
        own = [poi.position for poi in pois if kind_of(poi.type, poi.source) == kind]
        places = settled(own).reshape(-1, 2)
        spoils = in_the_way(places, around, crown=crown)
        if spoils.any():
            what = f"a clear view past {int(spoils.sum())} {kind} of the scenario"
            outside = network.location.outside(places[int(np.argmax(spoils))])
            first = "({:.0f}, {:.0f})".format(*outside)
            why = f"they hide much of a camera's picture, the first at {first}; another eye sees"
            gone.append(LeftOut(what, f"{why} past them"))
    return tuple(gone)


def planted(name: str, place: Floats, species: str, *, tall: bool, behind: int = 0) -> Poi:
    """Return a plant as a point of interest.

    Args:
        name: Unique among plants.
        place: (2,) [m].
        species: A key of `SPECIES` or `SHRUBS`.
        tall: Whether it is a tree.
        behind: Rows of other plants between it and the cameras, which allow a coarser level.
    """
    x, y = settled(place).tolist()
    params = {"model": species} | ({BEHIND: str(behind)} if behind else {})
    kind = "tree" if tall else "shrub"
    return Poi(f"planted:{name}", kind, (x, y), None, None, SOURCE, params)


def _lots(around: Surroundings, spacing: float) -> list[tuple[int, int]]:
    """Cells of a world grid that lie near a camera, sorted."""
    if not len(around.viewpoints):
        return []
    steps = int(np.ceil(REACH / spacing)) + 1
    own = np.unique(np.floor(around.viewpoints[:, :2] / spacing).astype(np.int64), axis=0)
    x, y = np.meshgrid(*[np.arange(-steps, steps + 1)] * 2)
    near = np.column_stack([x.ravel(), y.ravel()])
    near = near[(near**2).sum(axis=1) <= steps**2]
    cells = np.unique((own[:, None] + near).reshape(-1, 2), axis=0)
    return [(int(a), int(b)) for a, b in cells]


def _cells_of(lots: Sequence[tuple[int, int]], origin: Floats) -> list[tuple[int, int]]:
    """Fields that the middles of lots of 60 m lie in."""
    middles = (np.array(lots, dtype=np.float64).reshape(-1, 2) + 0.5) * 60.0
    inside = ((middles - origin)[:, None] * _FIELDS).sum(axis=-1)
    cells = np.floor(settled(inside)).astype(np.int64)
    return [(int(a), int(b)) for a, b in np.unique(cells, axis=0)]


def _apart(spots: Floats, gap: float) -> Floats:
    """The first of the spots that keep a gap [m] to all chosen before, (m, 2)."""
    chosen: list[Floats] = []
    for spot in spots:
        if all(np.hypot(*(spot - other)) > gap for other in chosen):
            chosen.append(spot)
    return np.array(chosen).reshape(-1, 2)


def _drawn(where: str, rng: np.random.Generator) -> str:
    """A species by chance."""
    names, weights = urn(where)
    return names[pick(weights, float(rng.random()))]


FARTHEST = 2800.0
"""Farther away there are only the hills' own woods [m]."""

MOST = 60_000
"""Triangles of all far trees, at most."""

_TUFTS = 24
_OFF = 12.0  # distance from everything paved [m]
_BLOCK = 240.0  # spacing of places that may bear a hedgerow, a wood or a village [m]
_WALLS = np.array([[0.55, 0.52, 0.46], [0.62, 0.6, 0.56], [0.42, 0.34, 0.27], [0.5, 0.44, 0.36]])
_ROOFS = np.array([[0.22, 0.085, 0.055], [0.16, 0.075, 0.05], [0.09, 0.085, 0.085]])
_LINE, _WOOD, _VILLAGE = 0.46, 0.22, 0.035  # share of the places that bear each


def plant_far(plot: Plot, *, around: Surroundings) -> tuple[StaticPart, ...]:
    """Build hedgerows, woods and villages around the cameras of a shot, far away.

    Args:
        plot: What they keep off.
        around: Ground, cameras and the seed.
    """
    blocks = _blocks(around)
    spots: list[Floats] = []
    houses: list[Floats] = []
    for block in blocks:
        rng = dice_of(around.seed, "far", str(block[0]), str(block[1]))
        middle = (np.array(block) + rng.uniform(0.0, 1.0, 2)) * _BLOCK
        what = rng.random()
        if what < _LINE:
            spots.append(_line(middle, rng))
        elif what < _LINE + _WOOD:
            spots.append(middle + rng.normal(0, 1, (22, 2)) * rng.uniform(15.0, 48.0, 2))
        elif what < _LINE + _WOOD + _VILLAGE:
            houses.append(middle + rng.normal(0, 1, (26, 2)) * [85.0, 55.0])
            spots.append(middle + rng.normal(0, 1, (30, 2)) * [100.0, 65.0])
    trees = _trees(_allowed(spots, plot, around), around)
    return (*trees, *_houses(_allowed(houses, plot, around), around))


def _blocks(around: Surroundings) -> list[tuple[int, int]]:
    """Cells of a world grid in the picture and not near, sorted."""
    if not len(around.viewpoints):
        return []
    steps = int(FARTHEST / _BLOCK) + 1
    own = np.unique(np.floor(around.viewpoints[:, :2] / _BLOCK).astype(np.int64), axis=0)
    x, y = np.meshgrid(*[np.arange(-steps, steps + 1)] * 2)
    cells = np.unique(
        (own[:, None] + np.column_stack([x.ravel(), y.ravel()])).reshape(-1, 2), axis=0
    )
    middles: Floats = np.asarray((cells + 0.5) * _BLOCK, dtype=np.float64)
    away = around.distances(middles)
    keep = (away > REACH - _BLOCK) & (away < FARTHEST) & around.pictured(middles, radius=_BLOCK)
    return [(int(a), int(b)) for a, b in cells[keep]]


def _line(middle: Floats, rng: np.random.Generator) -> Floats:
    """A broken hedgerow along one of the two directions of fields, (n, 2) [m]."""
    way = np.array([(2.0, 1.0), (-1.0, 2.0)][int(rng.random() < 0.4)]) / 5.0**0.5
    along = np.arange(-110.0, 110.0, 8.5)
    along = along[np.sin(along / 21.0 + rng.uniform(0, 6.28)) > -0.5]
    return np.asarray(middle + along[:, None] * way + rng.normal(0, 1.6, (len(along), 2)))


def _allowed(groups: Sequence[Floats], plot: Plot, around: Surroundings) -> Floats:
    """Places of groups that are far, seen and free, (n, 2) [m]."""
    places = np.concatenate([np.zeros((0, 2)), *groups])
    if len(places):
        keep = (around.distances(places) > REACH) & around.pictured(places, radius=15.0)
        places = places[keep]
    return places[plot.free(places, margin=_OFF)] if len(places) else places


def _trees(places: Floats, around: Surroundings) -> list[StaticPart]:
    """Far trees at places, those left out that are too many."""
    rng = np.random.default_rng(around.seed + 47)
    # Chance among near and far ones, or the budget would end at a ring.
    rank = around.distances(places) * rng.uniform(0.35, 1.0, len(places))
    places = places[np.argsort(rank, kind="stable")][: MOST // (CORE_FACES + _TUFTS)]
    trees = grown(places, around.height_at(places), 1.0, rng)
    small = rng.uniform(0.55, 1.1, len(places))
    trees = FarTrees(trees.feet, trees.widths, trees.heights * small, trees.cones, trees.tints)
    mesh, tint = far_trees(trees, tufts=_TUFTS, rng=rng, eyes=around.eyes)
    if not len(mesh.faces):
        return []
    return [StaticPart("ground/planted", "ground", Part(mesh, "leaf", tint))]


def _houses(places: Floats, around: Surroundings) -> list[StaticPart]:
    """Boxes under gables, in two parts: walls and roofs."""
    rng = np.random.default_rng(around.seed + 53)
    walls: list[Mesh] = []
    roofs: list[Mesh] = []
    for x, y, z in np.column_stack([places, around.height_at(places)]):
        size = np.array([rng.uniform(4.5, 8.0), rng.uniform(3.5, 5.0), rng.uniform(3.5, 6.0)])
        turn = 0.46 + 0.5 * np.pi * rng.integers(0, 2) + rng.normal(0, 0.12)
        one, top = _house(size, turn, np.array([x, y, z - 0.3]))
        walls.append(one)
        roofs.append(top)
    parts = []
    for name, meshes, palette in (("wall", walls, _WALLS), ("roof", roofs, _ROOFS)):
        if meshes:
            mesh = merge_meshes(meshes)
            colours = palette[rng.integers(0, len(palette), len(meshes))]
            tint = np.repeat(colours, len(meshes[0].faces), axis=0)
            parts.append(StaticPart(f"ground/village/{name}", "ground", Part(mesh, name, tint)))
    return parts


def _house(size: Floats, turn: float, foot: Floats) -> tuple[Mesh, Mesh]:
    """Walls with gables, and a roof: half length, half width and height of the walls [m]."""
    a, b, h = size
    ridge = h + 0.85 * b
    base = [[-a, -b], [a, -b], [a, b], [-a, b]]
    corners = [[*corner, level] for level in (0.0, h) for corner in base]
    points = np.array([*corners, [-a, 0.0, ridge], [a, 0.0, ridge]])
    c, s = np.cos(turn), np.sin(turn)
    world = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + foot
    gables = [[5, 6, 9], [7, 4, 8]]
    below = [[0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [3, 0, 4, 7]]
    sides = np.array([*([i, j, k] for i, j, k, _ in below), *([i, k, m] for i, _, k, m in below)])
    sides = np.concatenate([sides, gables])
    slopes = np.array([[4, 5, 9], [4, 9, 8], [6, 7, 8], [6, 8, 9]])
    return Mesh(world, sides), Mesh(world[4:], slopes - 4)
