"""The town that is invented beside the roads: houses in gardens, trees in streets, parks.

Everything is given to the builders as if the scenario had brought it: points of interest and
polygons with `SOURCE`. Closed rows of houses grow where a road is said to run through a centre.

Each lot beside a street is tried by itself: it must lie free of all roads, rails and footways. Of
lots that overlap, one whose name is drawn stays, whatever becomes of the others, so that a change
at one place changes nothing far from it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract, union
from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.geometry import Floats, settled
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.random import dice_of, pick, share_of
from sumo3dviz_pt.model.traffic import Poi, Polygon, Scenario
from sumo3dviz_pt.world.objects.houses import plan_of, rectangles
from sumo3dviz_pt.world.objects.kinds import INVENTED as SOURCE
from sumo3dviz_pt.world.objects.kinds import KINDS, kind_of
from sumo3dviz_pt.world.placement.sightlines import SHRUB, TREE, hides, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.street.places import Border, border_of, drives, offset
from sumo3dviz_pt.world.town.character import URBAN, Character, characters_of
from sumo3dviz_pt.world.town.pavements import WIDTH as PAVEMENT
from sumo3dviz_pt.world.town.pavements import lacks_walk


@dataclass(frozen=True, slots=True, eq=False)
class Town:
    """What is invented for a network.

    Attributes:
        characters: What each edge runs through.
        pois: Houses and trees.
        polygons: Gardens, drives, hedges, fences, parks.
    """

    characters: Mapping[str, Character] = field(default_factory=dict)
    pois: tuple[Poi, ...] = ()
    polygons: tuple[Polygon, ...] = ()

    def within(self, scenario: Scenario) -> Scenario:
        """Return a scenario with all of it."""
        return replace(
            scenario,
            pois=(*scenario.pois, *self.pois),
            polygons=(*scenario.polygons, *self.polygons),
        )

    def origin(self) -> Mapping[str, str]:
        """Return what is from files, what follows from them and what is invented, in words."""
        along = Counter(self.characters.values())
        derived = [f"{some} edges of {name}" for name in _ORDER if (some := along[name])]
        counts = {name: some for name, some in self.counts().items() if some}
        made = [f"{some:,} {name}" for name, some in counts.items()]
        if along["centre"]:
            made.append("rows of houses in centres")
        if any(along[name] for name in URBAN):
            made.append("pavements of urban streets without any")
        return {
            "from files": "roads, traffic, signals, stops",
            "derived": ", ".join(derived) or "nothing",
            "invented": ", ".join(made) or "nothing",
        }

    def counts(self) -> Mapping[str, int]:
        """Return how much there is of each kind."""
        types = Counter([*(k.type for k in self.pois), *(k.type for k in self.polygons)])
        return {
            "houses": types["home"] + types["block"] + types["shop"],
            "trees": types["tree"],
            "gardens": types["residential"],
            "hedges and fences": types["hedge"] + types["wooden"],
            "parks": types["park"],
        }


_ORDER: tuple[Character, ...] = ("centre", "suburb", "village", "country", "motorway")


@dataclass(frozen=True, slots=True)
class _Habit:
    """How people build beside the streets of a character.

    Attributes:
        front: Width of lots, least and most [m].
        back: How far houses stand behind pavements, least and most [m].
        depths: Of lots, the first that fits [m].
        built: Share of lots that bear a house.
        fenced: Shares of streets whose gardens have a hedge, a fence.
    """

    front: tuple[float, float]
    back: tuple[float, float]
    depths: tuple[float, ...]
    built: float
    fenced: tuple[float, float]


_HABITS: Mapping[Character, _Habit] = {
    #                  front         back        depths              built  hedge, fence
    "suburb": _Habit((16.0, 22.0), (3.5, 6.5), (34.0, 26.0, 19.0), 0.93, (0.45, 0.35)),
    "village": _Habit((19.0, 29.0), (2.5, 9.0), (40.0, 30.0, 20.0), 0.72, (0.30, 0.35)),
    "country": _Habit((60.0, 90.0), (9.0, 20.0), (60.0, 45.0), 0.05, (0.30, 0.00)),
}
_FLATS = _Habit((27.0, 34.0), (4.0, 8.0), (38.0, 30.0, 23.0), 0.9, (0.5, 0.0))
"""Blocks of flats, beside the wide streets of suburbs."""

_VERGE = 0.3  # between pavement or kerb and lots [m]
_BARE = 1.2  # the same where a road has no pavement [m]
_END = 3.0  # lots begin so far from the ends of edges [m]
_DRIVE = 3.0  # width of drives [m]
_GAP = 1.5  # between houses and the sides of their lots [m]
_ALLEYS: Mapping[Character, tuple[float, float]] = {
    "centre": (0.6, 9.0),
    "suburb": (0.4, 11.0),
    "village": (0.15, 13.0),
}
"""Share of streets with trees, and the distance of these [m]."""

_PARKS = {"centre": 0.10, "suburb": 0.05}  # share of blocks that are a park
_PARK = (1500.0, 12_000.0)  # area of these [m2]


_HARDLY_ANY = 3  # objects and areas that make no town


def lacks_town(scenario: Scenario) -> bool:
    """Return whether a scenario has no houses, trees or areas of its own, or hardly any."""
    drawn = [poi for poi in scenario.pois if kind_of(poi.type, poi.source) is not None]
    areas = [item for item in scenario.polygons if len(item.shape) > 2]
    return len(drawn) + len(areas) <= _HARDLY_ANY


def invented(scenario: Scenario, around: Surroundings) -> Town:
    """Invent a town beside the roads of a scenario.

    Args:
        scenario: Roads, stops, and what it has put somewhere, which keeps its place.
        around: Lanes, the seed, and the cameras that nothing stands before.
    """
    network = scenario.network
    characters = characters_of(network, scenario.stops)
    sides = list(_sides(network, characters))
    if not sides:
        return Town(characters)
    solid = _solid(scenario, characters)
    parks = _parks(network, characters, solid, around.seed)
    lots = _free(_lots(sides, around.seed), _with(solid, parks))
    pois: list[Poi] = []
    polygons = [_area(f"park:{k}", "park", park) for k, park in enumerate(parks)]
    for lot in lots:
        houses, areas = _furnished(lot, around.seed)
        pois += houses
        polygons += areas
    pois += _alley_trees(sides, solid, lots, around.seed)
    return _out_of_sight(Town(characters, tuple(pois), tuple(polygons)), around)


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """One side of a street.

    Attributes:
        name: Unique.
        street: The same for both directions of a street.
        border: Where it begins.
        character: Of the street.
        begin: Where lots begin, from the border [m].
        wide: Whether two lanes or more lead each way.
    """

    name: str
    street: str
    border: Border
    character: Character
    begin: float
    wide: bool


def _sides(network: Network, characters: Mapping[str, Character]) -> Iterator[_Side]:
    """Both sides of all streets but motorways and those that cross others without a junction."""
    ends = {
        (edge.from_junction, edge.to_junction): name
        for name, edge in sorted(network.edges.items(), reverse=True)
    }
    over = _crossing(network, characters)
    for name, character in characters.items():
        border = border_of(network, network.edges[name])
        if character == "motorway" or name in over or border is None or border.length < 8.0:
            continue
        edge = border.edge
        back = ends.get((edge.to_junction, edge.from_junction))
        street = name if back is None else min(name, back)
        bare = PAVEMENT + _VERGE if character in URBAN else _BARE
        wide = sum(drives(lane) for lane in edge.lanes) > 1
        begin = border.walk + _VERGE if border.walk else bare
        yield _Side(name, street, border, character, begin, wide)
        if back is None:
            last = edge.lanes[-1]
            line = offset(last.shape, -border.outward * last.width / 2.0)
            inner = Border(edge, line, -border.outward, 0.0, border.road)
            yield _Side(f"{name}:inner", street, inner, character, bare, wide)


def _crossing(network: Network, characters: Mapping[str, Character]) -> frozenset[str]:
    """Edges that cross others without a junction: bridges, and what they lead over."""
    edges = [network.edges[name] for name in characters]
    lines = [shapely.LineString(edge.lanes[0].shape[:, :2]) for edge in edges]
    one, other = shapely.STRtree(lines).query(lines, predicate="crosses")
    over = set()
    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        met = {edges[a].from_junction, edges[a].to_junction}
        if not met & {edges[b].from_junction, edges[b].to_junction}:
            over.add(edges[a].id)
    return frozenset(over)


def _solid(scenario: Scenario, characters: Mapping[str, Character]) -> shapely.STRtree:
    """Everything that lots keep off: roads with pavements, rails, paths, and what is given."""
    network = scenario.network
    lines, widths = [], []
    for edge in network.edges.values():
        room = _pavement(edge, characters)
        for lane in edge.lanes:
            if edge.function != "walkingarea" and len(lane.shape) > 1:
                lines.append(shapely.LineString(lane.shape[:, :2]))
                widths.append(lane.width / 2.0 + room)
    shapes: list[shapely.Geometry] = list(shapely.buffer(lines, widths, cap_style="flat"))
    outlines = [k.outline for k in network.junctions.values() if k.type != "internal"]
    outlines += [lane.shape for e in network.edges.values() if e.function == "walkingarea"
                 for lane in e.lanes]  # fmt: skip
    outlines += [item.shape for item in scenario.polygons if item.fill]
    shapes += [
        shapely.make_valid(shapely.Polygon(shape[:, :2])).buffer(PAVEMENT)
        for shape in outlines
        if len(shape) > 2
    ]
    shapes += [shapely.Point(poi.position).buffer(8.0) for poi in scenario.pois]
    return shapely.STRtree(shapes)


def _pavement(edge: Edge, characters: Mapping[str, Character]) -> float:
    """Width of the pavement that an edge gets [m]."""
    if characters.get(edge.id) not in URBAN:
        return 0.5
    return PAVEMENT if lacks_walk(edge) else 0.1


def _with(solid: shapely.STRtree, more: Sequence[shapely.Geometry]) -> shapely.STRtree:
    """A tree with further shapes."""
    return shapely.STRtree([*solid.geometries, *more])


@dataclass(frozen=True, slots=True, eq=False)
class _Lot:
    """A piece of land beside a street.

    Attributes:
        name: Unique.
        side: The street's.
        habit: How people build there.
        span: Where it begins and ends along the border [m].
        depth: [m].
        plan: Its corners: front, then back, (4, 2) [m].
    """

    name: str
    side: _Side
    habit: _Habit
    span: tuple[float, float]
    depth: float
    plan: Floats

    @property
    def along(self) -> Floats:
        """Direction of its front, (2,)."""
        way = self.plan[1] - self.plan[0]
        return np.asarray(way / np.hypot(*way))

    @property
    def inward(self) -> Floats:
        """Away from the street, (2,)."""
        way = self.along
        return self.side.border.outward * np.array([-way[1], way[0]])

    @property
    def width(self) -> float:
        """Of its front [m]."""
        return float(np.hypot(*(self.plan[1] - self.plan[0])))

    def at(self, along: float, inward: float) -> Floats:
        """Return a place in it, counted from where its front begins, (2,) [m]."""
        return np.asarray(self.plan[0] + along * self.along + inward * self.inward)

    def box(self, begin: float, end: float, low: float, high: float) -> shapely.Polygon:
        """Return a rectangle in it [m]."""
        spots = ((begin, low), (end, low), (end, high), (begin, high))
        return shapely.Polygon([self.at(*spot) for spot in spots])


def _lots(sides: Sequence[_Side], seed: int) -> list[list[_Lot]]:
    """Lots along all sides, each as deep as it may be, then shallower."""
    lots = []
    for side in sides:
        habit = _HABITS.get(side.character)
        if habit is None:
            continue
        rng = dice_of(seed, SOURCE, "lots", side.name)
        if side.character == "suburb" and side.wide and share_of(seed, "flats", side.street) < 0.6:
            habit = _FLATS
        at, number = _END + rng.uniform(0.0, 3.0), 0
        while at < side.border.length - _END:
            end = at + rng.uniform(*habit.front)
            if end < side.border.length - _END and rng.random() < habit.built:
                name = f"{side.name}:{number}"
                lots.append([_lot(name, side, habit, (at, end), deep) for deep in habit.depths])
            at, number = end, number + 1
    return lots


def _lot(name: str, side: _Side, habit: _Habit, span: tuple[float, float], depth: float) -> _Lot:
    """One lot; of one depth."""
    a, b = side.border.at(np.array(span), side.begin).places
    way = (b - a) / max(float(np.hypot(*(b - a))), 1e-6)
    inward = depth * side.border.outward * np.array([-way[1], way[0]])
    return _Lot(name, side, habit, span, depth, settled([a, b, b + inward, a + inward]))


def _free(lots: Sequence[Sequence[_Lot]], solid: shapely.STRtree) -> list[_Lot]:
    """Lots that have room, as deep as they may be; of those that overlap, the one that is drawn."""
    chosen: list[_Lot] = []
    left = list(lots)
    while left:
        firsts = [some[0] for some in left]
        plans = shapely.polygons([lot.plan for lot in firsts])
        blocked = np.zeros(len(plans), dtype=np.bool_)
        blocked[solid.query(plans, predicate="intersects")[0]] = True
        chosen += [lot for lot, out in zip(firsts, blocked, strict=True) if not out]
        left = [some[1:] for some, out in zip(left, blocked, strict=True) if out and len(some) > 1]
    if not chosen:
        return []
    chosen.sort(key=lambda lot: lot.name)
    plans = shapely.buffer(shapely.polygons([lot.plan for lot in chosen]), -0.05)
    rank = np.array([share_of(0, lot.name) for lot in chosen])
    one, other = shapely.STRtree(plans).query(plans, predicate="intersects")
    stays, gone = np.zeros((2, len(chosen)), dtype=np.bool_)
    # A few rounds only: what happens at one place must not spread.
    for _ in range(_ROUNDS):
        alive = ~(gone[one] | gone[other])
        beaten = np.zeros(len(chosen), dtype=np.bool_)
        beaten[one[alive & (rank[one] > rank[other])]] = True
        stays |= ~beaten & ~gone
        gone[one[stays[other] & (one != other)]] = True
        gone &= ~stays
    return [lot for lot, keep in zip(chosen, stays, strict=True) if keep]


_ROUNDS = 4
_KINDS = {kind.name: kind for kind in KINDS}
_TRIES = 5  # houses that are drawn until one has room
_VARIATION = ObjectSettings().variation


def _furnished(lot: _Lot, seed: int) -> tuple[list[Poi], list[Polygon]]:
    """A house, its drive, its garden and what is around that."""
    rng = dice_of(seed, SOURCE, "lot", lot.name)
    kind = "blocks" if lot.habit is _FLATS else "homes"
    polygons = [_area(f"garden:{lot.name}", "residential", shapely.Polygon(lot.plan))]
    back = float(rng.uniform(*lot.habit.back))
    drawn = _drawn(lot, kind, back, seed)
    if drawn is None:
        return [], polygons
    name, deep, wide = drawn
    # Beside the house there is room for a drive, on one side.
    slack = lot.width - wide - 2.0 * _GAP
    right = bool(rng.random() < 0.5)
    middle = _GAP + wide / 2.0 + slack * (0.1 if right else 0.9)
    place = lot.at(middle, back + deep / 2.0)
    out = -lot.inward
    yaw = float(np.arctan2(out[1], out[0]))
    house = Poi(name, kind.removesuffix("s"), (float(place[0]), float(place[1])), yaw, None, SOURCE)
    gap = (lot.width - _GAP - _DRIVE, lot.width - _GAP) if right else (_GAP, _GAP + _DRIVE)
    if slack > 1.0:
        drive = lot.box(*gap, -_VERGE, back + (deep if slack > _DRIVE else 0.0))
        polygons.append(_area(f"drive:{lot.name}", "square", drive))
    polygons += _bounds(lot, gap, back, seed)
    return [house, *_garden(lot, rng, (middle, wide), back + deep)], polygons


def _drawn(lot: _Lot, kind: str, back: float, seed: int) -> tuple[str, float, float] | None:
    """The name, depth and width [m] of the first house of a few that has room, or None.

    Names choose models and sizes.
    """
    for number in range(_TRIES):
        name = f"{SOURCE}:{lot.name}:{number}"
        own = f"{kind}:{name}"
        size = 1.0 + _VARIATION * (2.0 * share_of(seed, own, "size") - 1.0)
        plan = plan_of(_KINDS[kind], ObjectSettings(), seed=seed, name=own)
        deep, wide = (size * (plan[1] - plan[0])).tolist()
        if wide + 2.0 * _GAP < lot.width and back + deep + _GAP < lot.depth:
            return name, deep, wide
    return None


def _bounds(lot: _Lot, gap: tuple[float, float], back: float, seed: int) -> Iterator[Polygon]:
    """Hedges and fences in front, beside a drive, and between neighbours."""
    hedge, fence = lot.habit.fenced
    taste = share_of(seed, SOURCE, "bounds", lot.side.street)
    own = share_of(seed, SOURCE, "bounds", lot.name)
    which = taste if own < 0.7 else (own - 0.7) / 0.3
    kind = "hedge" if which < hedge else "wooden" if which < hedge + fence else ""
    if kind:
        front = 0.55
        for number, (a, b) in enumerate(((0.3, gap[0] - 0.3), (gap[1] + 0.3, lot.width - 0.3))):
            if b - a > 1.5:
                ends = [lot.at(a, front), lot.at(b, front)]
                yield _line(f"front:{lot.name}:{number}", kind, ends)
    if own < 0.75 and lot.depth > back + 8.0:
        beside = "hedge" if own < 0.25 else "wooden"
        ends = [lot.at(lot.width - 0.4, back), lot.at(lot.width - 0.4, lot.depth - 1.0)]
        yield _line(f"beside:{lot.name}", beside, ends)


def _garden(
    lot: _Lot, rng: np.random.Generator, house: tuple[float, float], behind: float
) -> Iterator[Poi]:
    """Shrubs and a tree before the house, trees behind it."""
    kinds, weights = urn("yards")
    shrubs, _ = urn("area_shrubs")
    for k in range(int(rng.integers(0, 3))):
        along = house[0] + rng.uniform(-0.5, 0.5) * house[1]
        place = lot.at(float(along), float(rng.uniform(1.3, max(1.4, lot.habit.back[0] - 0.6))))
        yield _plant(f"{lot.name}:s{k}", "shrub", place, shrubs[int(rng.integers(len(shrubs)))])
    room = lot.depth - behind - 5.0
    for k in range(int(rng.integers(0, 3)) if room > 2.0 else 0):
        along = float(rng.uniform(2.5, lot.width - 2.5))
        place = lot.at(along, behind + 3.5 + float(rng.uniform(0.0, room)))
        yield _plant(f"{lot.name}:t{k}", "tree", place, kinds[pick(weights, rng.random())])


def _alley_trees(
    sides: Sequence[_Side], solid: shapely.STRtree, lots: Sequence[_Lot], seed: int
) -> list[Poi]:
    """Trees in a row along some streets: between pavement and houses, or in front gardens."""
    kinds, weights = urn("alleys")
    spots: list[tuple[str, str, Floats]] = []
    for side in sides:
        chance, gap = _ALLEYS.get(side.character, (0.0, 1.0))
        share = share_of(seed, SOURCE, "alley", side.street)
        if share > chance + 0.2 * side.wide:
            continue
        species = kinds[pick(weights, share_of(seed, SOURCE, "species", side.street))]
        at = np.arange(0.5 * gap, side.border.length - 0.4 * gap, gap)
        out = side.begin + (0.75 if side.character == "centre" else 1.9)
        places = side.border.at(at, out).places
        spots += [(f"{side.name}:a{k}", species, place) for k, place in enumerate(places)]
    if not spots:
        return []
    points = shapely.points(np.array([place for *_, place in spots]))
    keep = np.ones(len(spots), dtype=np.bool_)
    keep[solid.query(points, predicate="dwithin", distance=0.4)[0]] = False
    ways = [lot.box(g, g + _DRIVE, 0.0, 6.0) for lot in lots
            for g in (_GAP, lot.width - _GAP - _DRIVE)]  # fmt: skip
    if ways:
        keep[shapely.STRtree(ways).query(points, predicate="dwithin", distance=0.3)[0]] = False
    return [
        _plant(name, "tree", place, species)
        for (name, species, place), stays in zip(spots, keep, strict=True)
        if stays
    ]


def _parks(
    network: Network, characters: Mapping[str, Character], solid: shapely.STRtree, seed: int
) -> list[shapely.Polygon]:
    """Some of the blocks between streets, without what lies beside these."""
    some = [name for name, character in characters.items() if character != "motorway"]
    lines = [shapely.LineString(network.edges[k].lanes[-1].shape[:, :2]) for k in some]
    joined = {k: network.junctions.get(network.edges[k].to_junction) for k in some}
    lines += [
        shapely.LineString([network.edges[k].lanes[-1].shape[-1, :2], end.position[:2]])
        for k, end in joined.items()
        if end is not None
    ]
    lines += [
        shapely.LineString([start.position[:2], network.edges[k].lanes[-1].shape[0, :2]])
        for k in some
        if (start := network.junctions.get(network.edges[k].from_junction)) is not None
    ]
    chance = max(_PARKS.values())
    parks = []
    for face in polygon_parts(shapely.polygonize([shapely.union_all(lines)])):
        middle = settled(face.representative_point().coords[0])
        share = share_of(seed, SOURCE, "park", *(f"{value:.0f}" for value in middle))
        if share > chance or not _PARK[0] < face.area < 2.0 * _PARK[1]:
            continue
        near = solid.geometries[np.sort(solid.query(face))]
        free = subtract(face, [union(near)]).buffer(-0.3, join_style="mitre")
        parts = [part for part in polygon_parts(free) if part.area > _PARK[0]]
        parks += [part for part in parts if part.area < _PARK[1] and not part.interiors]
    return parks


def _plant(name: str, kind: str, place: Floats, species: str) -> Poi:
    """A plant."""
    x, y = settled(place).tolist()
    return Poi(f"{SOURCE}:{name}", kind, (x, y), None, None, SOURCE, {"model": species})


def _area(name: str, kind: str, shape: shapely.Polygon) -> Polygon:
    """A piece of ground."""
    ring = shapely.get_coordinates(shapely.orient_polygons(shape).exterior)
    return Polygon(f"{SOURCE}:{name}", kind, settled(ring), True, None, SOURCE)


def _line(name: str, kind: str, points: Sequence[Floats]) -> Polygon:
    """A hedge or a fence."""
    return Polygon(f"{SOURCE}:{name}", kind, settled(points), False, None, SOURCE)


TREES, SHRUBS, BOUNDS = 480.0, 110.0, 130.0
"""Farther from every camera than this they are left out [m]."""

MOST_TREES, MOST_SHRUBS = 420, 160
"""The nearest of them, at most."""


def near_cameras(scenario: Scenario, around: Surroundings) -> Scenario:
    """Return a scenario without invented plants and fences that a shot shows too small, or not at all.

    Args:
        scenario: With a town.
        around: The shot's cameras.
    """
    gone: set[str] = set()
    for kind, reach, most in (("tree", TREES, MOST_TREES), ("shrub", SHRUBS, MOST_SHRUBS)):
        own = [poi for poi in scenario.pois if poi.source == SOURCE and poi.type == kind]
        places = settled([poi.position for poi in own]).reshape(-1, 2)
        away = around.distances(places)
        shown = (away < reach) & (around.pictured(places, radius=12.0) | (away < 40.0))
        near = np.flatnonzero(shown)
        near = near[np.argsort(away[near], kind="stable")][:most]
        kept = {own[k].id for k in near.tolist()}
        gone.update(poi.id for poi in own if poi.id not in kept)
    lines = [k for k in scenario.polygons if k.source == SOURCE and not k.fill]
    if lines:
        away = around.distances(settled([k.shape.mean(axis=0) for k in lines]))
        gone.update(k.id for k, far in zip(lines, away > BOUNDS, strict=True) if far)
    return replace(
        scenario,
        pois=tuple(poi for poi in scenario.pois if poi.id not in gone),
        polygons=tuple(item for item in scenario.polygons if item.id not in gone),
    )


_SIGHT = 130.0  # what stands farther from all cameras hides nothing [m]
_OVER = 4.0  # cameras higher than this above the roads look over hedges and fences [m]
_BODY = {"home": 7.5, "block": 12.0, "shop": 9.5}  # half the width of houses, about [m]


def _out_of_sight(town: Town, around: Surroundings) -> Town:
    """A town without what stands in a camera, or before what one looks at."""
    pois = list(town.pois)
    for kind, crown in (("tree", TREE), ("shrub", SHRUB)):
        own = np.array([poi.type == kind for poi in pois], dtype=np.bool_)
        places = settled([poi.position for poi in pois]).reshape(-1, 2)
        spoils = np.zeros(len(pois), dtype=np.bool_)
        spoils[own] = in_the_way(places[own], around, crown=crown)
        pois = [poi for poi, out in zip(pois, spoils, strict=True) if not out]
    kept = [poi for poi in pois if poi.type not in _BODY or not _hides(poi, around)]
    lines = [item for item in town.polygons if item.fill or not _veils(item, around)]
    return replace(town, pois=tuple(kept), polygons=tuple(lines))


def _hides(house: Poi, around: Surroundings) -> bool:
    """Whether a house stands in a camera's way."""
    place = np.array([house.position])
    if around.clearance.distances(place)[0] > _SIGHT:
        return False
    half = _BODY[house.type]
    corner = np.array([[[-half, -half], [half, half]]])
    return hides(rectangles(place, np.array([house.yaw or 0.0]), corner)[0], around)


def _veils(line: Polygon, around: Surroundings) -> bool:
    """Whether a hedge or a fence does."""
    if around.clearance.distances(line.shape).min() > _SIGHT:
        return False
    return hides(shapely.LineString(line.shape).buffer(0.5), around, over=_OVER)
