"""Where closed rows of houses stand along city streets that bring none of their own.

Streets are sampled, with what decides whether houses stand beside them. Streets with footways, or
in a dense net, and not too fast, have houses side by side behind their pavements. A building line
runs around everything that is paved; houses stand on it wherever its nearest street is such a
street, and yards lie between them. What the scenario brings (points of interest, areas, cameras)
keeps its place: there the row has a gap.

Rows grow tile by tile. A block of land between streets belongs whole to the tile of its middle; one
that is larger than `MARGIN` is divided along the borders of tiles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.buildings.styles import Lot, lots_along
from sumo3dviz_pt.library.mesh.planar import closing, polygon_parts, subtract, union
from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.areas.slabs import SOURCE as SLABS
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.lanes import Nearest
from sumo3dviz_pt.world.placement.sightlines import hides
from sumo3dviz_pt.world.placement.surroundings import Surroundings, Tile, edges_in, tiles_seen
from sumo3dviz_pt.world.town.character import Character
from sumo3dviz_pt.world.town.pavements import pavements

SOURCE = "street_fronts"
"""The `source` of areas that rows take."""

DEPTHS = (12.5, 9.5, 7.0)
"""Depths of houses, the first that fits [m]."""

MARGIN = 250.0
"""Blocks of land up to this size belong to one tile [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class House:
    """A house in a row.

    Attributes:
        id: Unique.
        plan: Counter-clockwise corners, (n, 2) [m]; its front walls come first.
        fronts: How many walls look at a street.
        blind: Numbers of walls that neighbours share.
        corner: Whether it stands at a corner.
        main: Whether its street has two lanes or more each way.
    """

    id: str
    plan: Floats
    fronts: int
    blind: tuple[int, ...]
    corner: bool
    main: bool

    @property
    def name(self) -> tuple[str | bytes | int | tuple[int, ...], ...]:
        """Everything that its mesh depends on, as a name in a memory."""
        return self.id, self.plan.tobytes(), self.fronts, self.blind, self.corner, self.main


@dataclass(frozen=True, slots=True, eq=False)
class Yard:
    """A lot in a row on which no house stands.

    Attributes:
        id: Unique.
        plan: As a house's, (n, 2) [m].
        fronts: How many sides look at a street.
    """

    id: str
    plan: Floats
    fronts: int


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows of houses.

    Attributes:
        houses: Tile by tile.
        forecourts: What is paved between pavements and houses.
        yards: Lots that stay open; they may overlap houses of another street.
        why: Why there are none, where the scene has none.
    """

    houses: tuple[House, ...] = ()
    forecourts: tuple[shapely.Polygon, ...] = ()
    yards: tuple[Yard, ...] = ()
    why: str = ""

    def polygons(self) -> tuple[Polygon, ...]:
        """Return houses and forecourts as areas on which nothing else may stand."""
        polygons = [
            Polygon(f"row:{house.id}", "building", house.plan, True, None, SOURCE)
            for house in self.houses
        ]
        for number, area in enumerate(self.forecourts):
            ring = shapely.get_coordinates(area.exterior)
            polygons.append(Polygon(f"court:{number}", "forecourt", ring, True, None, SOURCE))
        return tuple(polygons)


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Land between streets, as far as one tile knows it.

    Attributes:
        land: Its outline, cut off at a margin around the tile.
        tile: The tile whose houses are wanted.
    """

    land: shapely.Polygon
    tile: Tile

    @property
    def is_small(self) -> bool:
        """Whether it belongs to one tile as a whole."""
        x0, y0, x1, y1 = self.land.bounds
        return bool(max(x1 - x0, y1 - y0) <= MARGIN)

    @property
    def room(self) -> shapely.Geometry:
        """Where the tile's houses may stand."""
        if not self.is_small:
            return shapely.intersection(self.land, self.tile.box())
        x0, y0, x1, y1 = self.land.bounds
        own = self.tile.holds(np.array([[x0 + x1, y0 + y1]]) / 2.0)[0]
        # What ends at the margin is the rest of a larger block, far from the tile.
        whole = self.tile.box(MARGIN - 0.01).covers(shapely.box(x0, y0, x1, y1))
        return self.land if own and whole else shapely.Polygon()

    def lots(self, fit: Callable[[Floats], Bools], seed: int) -> list[Lot]:
        """Divide its building lines, those of a larger block only within the tile.

        Args:
            fit: Which places, (n, 2) [m], may bear a front.
            seed: Of widths.
        """

        def share(place: Floats, word: str) -> float:
            """Return a random number of a place, whatever else is built."""
            return share_of(seed, "row", f"{place[0]:.0f}", f"{place[1]:.0f}", word)

        area = shapely.orient_polygons(self.land)
        lines = [shapely.get_coordinates(ring) for ring in (area.exterior, *area.interiors)]
        if not self.is_small:
            lines = [piece for line in lines for piece in self._cut(line)]
        return [
            lot for line in lines for lot in lots_along(line, fit, depth=DEPTHS[0], share=share)
        ]

    def _cut(self, ring: Floats) -> list[Floats]:
        """Those pieces of a ring that lie in the tile, in the ring's direction."""
        inside = shapely.intersection(shapely.LineString(ring), self.tile.box())
        parts = shapely.get_parts(shapely.line_merge(inside, directed=True))
        lines = [part for part in parts if part.geom_type == "LineString"]
        return [shapely.get_coordinates(line) for line in lines]


FASTEST = 61.0 / 3.6
"""On faster roads nobody lives at the kerb [m/s]."""

AROUND = 200.0
"""Radius within which streets are counted [m]."""

_DENSE = 2200.0  # metres of streets within that radius make a town [m]
_NOISE = 16.0  # distance from fast roads [m]


@dataclass(frozen=True, slots=True, eq=False)
class Streets:
    """Sampled streets and what they are."""

    tree: Nearest
    city: Bools
    main: Bools
    walks: Bools
    fast: shapely.Geometry

    def fit(self, places: Floats, reach: float) -> Bools:
        """Return whether places, (n, 2) [m], lie at a city street, not farther than a reach [m]."""
        away, nearest = self.tree.query(places)
        good = self.city[nearest] & (away < reach)
        if not self.fast.is_empty:
            shapely.prepare(self.fast)
            good &= ~shapely.contains_xy(self.fast, places)
        return np.asarray(good)


def streets_in(
    network: Network,
    box: shapely.Polygon,
    memory: Memory,
    characters: Mapping[str, Character] | None = None,
) -> Streets | None:
    """Sample the streets in a box.

    Args:
        network: The road network.
        box: Upright [m].
        memory: Of the network's world.
        characters: As those of `Given`.

    Returns:
        None where no street runs.
    """
    points, rank, length, fast, central = [], [], [], [], []
    for edge in edges_in(network, box, memory):
        roads = [lane for lane in edge.lanes if lane.allowed & {"passenger", "bus", "delivery"}]
        if edge.function != "normal" or not roads:
            continue
        line = shapely.LineString(roads[0].shape[:, :2])
        at = np.linspace(0.0, line.length, max(int(line.length / 5.0), 1) + 1)
        quick = _is_fast(edge)
        fast += [_beyond(network, edge, end) for end in (0, -1)]
        walks = any(lane.allowed and lane.allowed <= {"pedestrian"} for lane in edge.lanes)
        if quick:
            fast.append(line.buffer(_width(edge) + _NOISE, cap_style="flat"))
        for lane in edge.lanes:  # all lanes, so that the nearest point is the nearest street's
            track = shapely.LineString(lane.shape[:, :2])
            spots = shapely.line_interpolate_point(track, at / line.length, normalized=True)
            points.append(shapely.get_coordinates(spots))
            rank += [(not quick, len(roads) > 1, walks)] * len(at)
            own = lane is roads[0]
            length += [line.length / len(at) * own] * len(at)
            central += [(characters or {}).get(edge.id) == "centre"] * len(at)
    if not points:
        return None
    places, kinds = settled(np.concatenate(points)), np.array(rank, dtype=np.bool_)
    tree = Nearest(places)
    total = _density(places, np.array(length) * kinds[:, 0])
    dense = kinds[:, 2] | (total > _DENSE) if characters is None else np.array(central)
    city = kinds[:, 0] & dense
    return Streets(tree, city, kinds[:, 1], kinds[:, 2], shapely.union_all(fast))


def _density(places: Floats, length: Floats) -> Floats:
    """Metres of streets around places, (n,), counted on a grid of cells."""
    cell = np.floor(places / AROUND).astype(np.int64)
    keys, own = np.unique(cell, axis=0, return_inverse=True)
    sums = np.bincount(own.ravel(), weights=length)
    near = cKDTree(keys.astype(np.float64)).query_ball_point(keys, 1.01)
    mean = np.array([sums[some].sum() / 5.0 for some in near])
    return np.asarray(mean[own.ravel()] * np.pi)  # a disc has pi cells of its radius


def _width(edge: Edge) -> float:
    """Of all lanes of an edge [m]."""
    return sum(lane.width for lane in edge.lanes)


def _beyond(network: Network, edge: Edge, end: int) -> shapely.Geometry:
    """Where a road that ends at the network's rim would go on."""
    junction = network.junctions.get(edge.to_junction if end else edge.from_junction)
    if junction is None or junction.type != "dead_end":
        return shapely.Polygon()
    shape = edge.lanes[0].shape[:, :2]
    step = shape[-1] - shape[-2] if end else shape[0] - shape[1]
    away = shape[end] + 60.0 * step / max(float(np.hypot(*step)), 1e-6)
    return shapely.LineString([shape[end], away]).buffer(_width(edge) + 1.0, cap_style="flat")


def _is_fast(edge: Edge) -> bool:
    """Whether a road is too fast for houses."""
    named = any(word in edge.type for word in ("motorway", "trunk"))
    return named or edge.told_speed > FASTEST


REACH = 620.0
"""Houses stand at most this far from a camera [m]."""

_SETBACK, _BARE = 2.2, 4.2  # between pavement, or kerb, and houses [m]
_ROW, _TRUNK = 9.0, 2.6  # trees nearer to a pavement are street trees; houses keep off them [m]
_SLIT = 4.0  # narrower gaps between pavements are no land [m]
_RIM = 0.17  # how far forecourts cover the stones at the back of pavements [m]
_STRAIGHT = 0.3  # by how much mitred land may come nearer to what is paved [m]
_YARDS = 0.06  # share of lots that stay open
_TILE = 500.0  # tiles of houses [m]
_SMALLEST = 250.0  # smaller blocks bear no houses [m2]
_HOUSE = {"homes": 11.0, "shops": 13.0, "blocks": 16.0, "trees": _TRUNK}  # radii [m]
_LEAST = 4.0  # smaller forecourts are left out [m2]
_SLIVER = 0.01  # forecourts that share less are left as they are [m2]
_STOP = "bus_stop"  # shelters stand on what is paved
_LAND = ("boundary", "place", "admin", "landuse.residential", "landuse.commercial")


@dataclass(frozen=True, slots=True, eq=False)
class Given:
    """What a scenario has put somewhere; it keeps its place.

    Attributes:
        pois: All points of interest.
        polygons: All areas and lines.
        characters: What edges run through, where that says which streets are a city's; None where
            their density and their footways do.
    """

    pois: Sequence[Poi] = ()
    polygons: Sequence[Polygon] = ()
    characters: Mapping[str, Character] | None = None


def why_none(polygons: Sequence[Polygon]) -> str | None:
    """Return why no rows of houses are grown beside a scenario's polygons, or None."""
    if any(kind_of(item.type, item.source) == "buildings" for item in polygons):
        return "the scenario has building polygons of its own"
    return None


def grow_rows(
    network: Network,
    paved: Sequence[shapely.Polygon],
    fixed: Given,
    *,
    around: Surroundings,
) -> Rows:
    """Grow rows of houses along city streets in all tiles that the cameras of a shot see.

    Args:
        network: Says which streets are a city's.
        paved: Outlines of roads and footways.
        fixed: What keeps its place.
        around: Cameras, the seed, and the memory of the network's world.

    Returns:
        All houses of these tiles; `in_view` chooses.
    """
    tiles = tiles_seen(around, size=_TILE, reach=REACH, beyond=MARGIN / 2.0)
    some = [
        around.memory.of((SOURCE, tile), partial(_in_tile, tile, network, paved, fixed, around))
        for tile in tiles
    ]
    return Rows(
        tuple(house for rows in some for house in rows.houses),
        _apart([court for rows in some for court in rows.forecourts]),
        tuple(yard for rows in some for yard in rows.yards),
    )


def _apart(courts: Sequence[shapely.Polygon]) -> tuple[shapely.Polygon, ...]:
    """Forecourts of which none lies on one of an earlier tile; all have the same height there."""
    tree = shapely.STRtree(courts)
    first, later = tree.query(tree.geometries, predicate="intersects")
    before: dict[int, list[int]] = {}
    for one, other in sorted(zip(first.tolist(), later.tolist(), strict=True)):
        if other < one and courts[one].intersection(courts[other]).area > _SLIVER:
            before.setdefault(one, []).append(other)
    parts: list[shapely.Polygon] = []
    for number, court in enumerate(courts):
        others = [courts[k] for k in before.get(number, ())]
        parts += polygon_parts(subtract(court, [union(others)])) if others else [court]
    return tuple(parts)


def in_view(rows: Rows, around: Surroundings) -> Rows:
    """Return the houses that a camera sees or whose shadows it sees, and all else.

    Args:
        rows: From `grow_rows`.
        around: The cameras.
    """
    if not rows.houses:
        return rows
    middles = np.array([house.plan.mean(axis=0) for house in rows.houses])
    keep = around.seen(middles, radius=40.0) & (around.distances(middles) < REACH)
    houses = tuple(house for house, stays in zip(rows.houses, keep, strict=True) if stays)
    return replace(rows, houses=houses)


def _in_tile(
    tile: Tile,
    network: Network,
    paved: Sequence[shapely.Polygon],
    fixed: Given,
    around: Surroundings,
) -> Rows:
    """Rows of houses in one tile; they do not depend on the cameras that look at it."""
    known = fixed.characters
    streets = streets_in(network, tile.box(MARGIN + 2.0 * AROUND), around.memory, known)
    if streets is None or (known is None and not streets.city.any()):
        return Rows()
    # Find the land between what is paved, a setback away from it.
    box = tile.box(MARGIN)
    near = shapely.STRtree(list(paved)).query(box, predicate="intersects")
    ground = union(polygon_parts(shapely.intersection(union([paved[k] for k in near]), box)))
    setback = _setback(ground, _trees(fixed.pois), streets)
    grown = _kept_free(ground, setback)
    blocks = [Block(land, tile) for land in polygon_parts(shapely.difference(box, grown))]
    blocks = [block for block in blocks if block.land.area > _SMALLEST and not block.room.is_empty]
    # Divide its borders into lots and build on them.
    taken = around.memory.of((SOURCE, "taken"), partial(_taken, fixed))
    growth = _Growing(union([block.room for block in blocks]), taken, around)
    lots: list[Lot] = []
    for block in blocks:
        for lot in block.lots(partial(streets.fit, reach=setback + 14.0), around.seed):
            growth.build(lot, streets)
            lots.append(lot)
    # Pave what lies between houses and pavements.
    houses = _neighbours(growth.houses)
    rim = _RIM if streets.walks.mean() > 0.5 else 0.0
    inner = ground.buffer(-rim, join_style="mitre")
    courts = _forecourts(lots, setback, ground=inner, houses=houses)
    if known is not None:
        edges = edges_in(network, tile.box(10.0), around.memory)
        bays = [shapely.Polygon(k.shape[:, :2]) for k in fixed.polygons if k.source == SLABS]
        beside = [bay for bay in bays if bay.intersects(box)]
        strips = pavements(network, edges, known, ground, beside)
        strips = list(shapely.intersection(strips, tile.box()))
        courts = tuple(polygon_parts(union([*courts, *polygon_parts(union(strips))])))
    courts = _beside(courts, around.memory.of((SOURCE, "laid"), partial(_laid, fixed)))
    return Rows(tuple(houses), courts, tuple(growth.yards))


def _kept_free(ground: shapely.Geometry, setback: float) -> shapely.Geometry:
    """What is paved with a setback [m] around it, and narrow gaps between."""
    wide = ground.buffer(setback + _SLIT, join_style="mitre", mitre_limit=2.0)
    closed = wide.buffer(-_SLIT, join_style="mitre", mitre_limit=2.0)
    # Mitred corners that are cut off come back too small, even smaller than what is paved.
    return union([closed, ground.buffer(setback - _STRAIGHT, quad_segs=4)])


def _trees(pois: Sequence[Poi]) -> Floats:
    """Where the scenario has trees, (n, 2) [m]."""
    places = [poi.position for poi in pois if kind_of(poi.type, poi.source) == "trees"]
    return np.array(places, dtype=np.float64).reshape(-1, 2)


class _Growing:
    """Houses while they are built."""

    def __init__(
        self, land: shapely.Geometry, taken: shapely.STRtree, around: Surroundings
    ) -> None:
        """Begin with none."""
        self.land = land
        shapely.prepare(self.land)
        self.taken, self.around = taken, around
        self.houses: list[House] = []
        self.yards: list[Yard] = []
        self.areas: list[shapely.Polygon] = []
        self.bounds = np.zeros((0, 4))

    def build(self, lot: Lot, streets: Streets) -> None:
        """Build a house on a lot, as deep as there is room for, or leave a yard."""
        middle = settled(lot.line.mean(axis=0))
        name, fronts = f"{middle[0]:.0f}:{middle[1]:.0f}", len(lot.line) - 1
        depths = [depth - 1.5 * share_of(self.around.seed, "depth", name) for depth in DEPTHS]
        plans = [plan for depth in depths if (plan := lot.plan(depth)) is not None]
        free = (plan for plan in plans if self._free(plan))
        plan = next((plan for plan in free if not hides(shapely.Polygon(plan), self.around)), None)
        open_lot = share_of(self.around.seed, "yard", name) < _YARDS and not lot.corner
        if plan is None or open_lot:
            room = next(filter(self._free, plans), None)
            self.yards += [] if room is None else [Yard(name, room, fronts)]
            return
        ends = (len(plan) - 1, fronts)  # the wall where the line begins comes last
        blind = tuple(wall for wall, joined in zip(ends, lot.joined, strict=True) if joined)
        main = bool(streets.main[streets.tree.query(middle[None])[1][0]])
        self.houses.append(House(name, plan, fronts, blind, lot.corner, main))
        area = shapely.Polygon(plan)
        self.areas.append(area)
        self.bounds = np.vstack([self.bounds, area.bounds])

    def _free(self, plan: Floats) -> bool:
        """Whether a house has room on its land, and nothing else stands there."""
        # Straightened fronts may reach a little over the building line.
        inner = shapely.Polygon(plan).buffer(-0.7)
        if inner.is_empty or not self.land.contains(inner):
            return False
        area = shapely.Polygon(plan).buffer(-0.15)
        if len(self.taken.query(area, predicate="intersects")):
            return False
        x0, y0, x1, y1 = area.bounds
        b = self.bounds
        near = np.flatnonzero((b[:, 0] < x1) & (b[:, 2] > x0) & (b[:, 1] < y1) & (b[:, 3] > y0))
        return not any(self.areas[k].intersects(area) for k in near.tolist())


def _neighbours(houses: Sequence[House]) -> list[House]:
    """Houses that do not stand alone, with walls blind only where a neighbour stands."""
    areas = [shapely.Polygon(house.plan) for house in houses]
    tree = shapely.STRtree(areas)
    neighbours = []
    for number, house in enumerate(houses):
        after = np.roll(house.plan, -1, axis=0)
        blind = []
        for wall in house.blind:
            spot = shapely.Point(0.5 * (house.plan[wall] + after[wall]))
            others = tree.query(spot, predicate="dwithin", distance=1.5)
            if (others != number).any():
                blind.append(wall)
        if blind or house.corner:
            neighbours.append(replace(house, blind=tuple(blind)))
    return neighbours


def _setback(ground: shapely.Geometry, trees: Floats, streets: Streets) -> float:
    """How far houses stand behind pavements: behind the street trees, if there are any [m]."""
    usual = _SETBACK if streets.walks.mean() > 0.5 else _BARE
    if not len(trees):
        return usual
    near = trees[streets.fit(trees, _ROW + 12.0)]
    away = shapely.distance(ground, shapely.points(near))
    row = away[away < _ROW]
    return max(usual, float(np.percentile(row, 80)) + _TRUNK + 0.2) if len(row) > 12 else usual


def _taken(fixed: Given) -> shapely.STRtree:
    """What the scenario has put somewhere."""
    shapes: list[shapely.Geometry] = []
    for poi in fixed.pois:
        radius = _HOUSE.get(kind_of(poi.type, poi.source) or "", 1.0)
        shapes.append(shapely.Point(poi.position).buffer(radius, quad_segs=3))
    for item in fixed.polygons:
        if item.type.startswith(_LAND) or len(item.shape) < 2:
            continue
        if item.fill and len(item.shape) > 2:
            shapes.append(shapely.make_valid(shapely.Polygon(item.shape[:, :2])))
        elif kind_of(item.type, item.source) is not None:
            shapes.append(shapely.LineString(item.shape[:, :2]))
    return shapely.STRtree(shapes)


def _laid(fixed: Given) -> shapely.STRtree:
    """What the scenario has laid on the ground: water, bays, lawns, and its own houses."""
    return shapely.STRtree(
        [
            shapely.make_valid(shapely.Polygon(item.shape[:, :2]))
            for item in fixed.polygons
            if item.fill and len(item.shape) > 2 and not item.type.startswith((*_LAND, _STOP))
        ]
    )


def _beside(
    courts: tuple[shapely.Polygon, ...], laid: shapely.STRtree
) -> tuple[shapely.Polygon, ...]:
    """Forecourts without what else lies there, which keeps its place."""
    pieces: list[shapely.Polygon] = []
    for court in courts:
        near = np.sort(laid.query(court, predicate="intersects"))
        if not len(near):
            pieces.append(court)
            continue
        left = subtract(court, [union(laid.geometries[near])])
        pieces += [part for part in polygon_parts(left) if part.area > _LEAST]
    return tuple(pieces)


def _forecourts(
    lots: Sequence[Lot], setback: float, *, ground: shapely.Geometry, houses: Sequence[House]
) -> tuple[shapely.Polygon, ...]:
    """What is paved between pavements and the lots whose houses stand.

    Args:
        lots: With a house or without.
        setback: How far they lie behind pavements [m].
        ground: Everything that is paved, without a rim that forecourts cover.
        houses: Those that stand.
    """
    shown = shapely.STRtree([shapely.Polygon(house.plan) for house in houses])
    strips = []
    for lot in lots:
        line = shapely.LineString(lot.line)
        if len(shown.query(line, predicate="dwithin", distance=25.0)):
            strips.append(line.buffer(-(setback + 1.2), single_sided=True, join_style="mitre"))
            strips.append(line.buffer(0.4, single_sided=True, join_style="mitre"))
    if not strips:
        return ()
    whole = closing(union(strips), 0.6)
    near = shapely.intersection(ground.buffer(30.0), whole)
    area = shapely.difference(near, ground)
    return tuple(part for part in polygon_parts(area.buffer(0)) if part.area > _LEAST)
