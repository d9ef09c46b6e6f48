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
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import Job, ObjectSettings
from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract, union
from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.geometry import Floats, settled
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import dice_of, pick, share_of
from sumo3dviz_pt.model.traffic import ParkingArea, Poi, Polygon, Scenario
from sumo3dviz_pt.world.areas.build import covers_ground
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.objects.houses import plan_of, rectangles
from sumo3dviz_pt.world.objects.kinds import INVENTED as SOURCE
from sumo3dviz_pt.world.objects.kinds import KINDS, kind_of
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.placement.sightlines import SHRUB, TREE, hides, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings, surroundings
from sumo3dviz_pt.world.town.character import URBAN, Character, characters_of
from sumo3dviz_pt.world.town.parked import CAR, ParkedCar, in_bays
from sumo3dviz_pt.world.town.pavements import lacks_walk
from sumo3dviz_pt.world.town.streets import (
    VERGE,
    Side,
    alley_trees,
    area,
    line,
    parking_of,
    plant,
    rims,
    sides_of,
    taken_by,
)


@dataclass(frozen=True, slots=True, eq=False)
class Town:
    """What is invented for a network.

    Attributes:
        characters: What each edge runs through.
        pois: Houses and trees.
        polygons: Gardens, drives, hedges, fences, parks.
        parking: Bays.
        cars: That are parked.
    """

    characters: Mapping[str, Character] = field(default_factory=dict)
    pois: tuple[Poi, ...] = ()
    polygons: tuple[Polygon, ...] = ()
    parking: tuple[ParkingArea, ...] = ()
    cars: tuple[ParkedCar, ...] = ()

    def within(self, scenario: Scenario) -> Scenario:
        """Return a scenario with all of it."""
        return replace(
            scenario,
            pois=(*scenario.pois, *self.pois),
            polygons=(*scenario.polygons, *self.polygons),
            parking=(*scenario.parking, *self.parking),
        )

    def origin(self, scenario: Scenario) -> Mapping[str, str]:
        """Return what is from files, what follows from them and what is invented, in words."""
        along = Counter[Character](self.characters.values())
        derived = [f"{some} edges of {name}" for name in _ORDER if (some := along[name])]
        counts = {name: some for name, some in self.counts().items() if some}
        made = [f"{some:,} {name}" for name, some in counts.items()]
        if along["centre"]:
            made.append("rows of houses in centres")
        edges = scenario.network.edges
        if any(what in URBAN and lacks_walk(edges[k]) for k, what in self.characters.items()):
            made.append("pavements of urban streets without any")
        sources = {k.source for k in scenario.pois} | {k.source for k in scenario.polygons}
        own = bool(sources - {SOURCE})
        given = {"signals": scenario.signals, "stops": scenario.stops, "objects": own}
        return {
            "from files": ", ".join(["roads", "traffic", *(k for k, v in given.items() if v)]),
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
            "parked cars": len(self.cars),
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
    "suburb": _Habit((16.0, 22.0), (3.5, 6.5), (34.0, 26.0, 19.0), 0.93, (0.52, 0.38)),
    "village": _Habit((19.0, 29.0), (2.5, 9.0), (40.0, 30.0, 20.0), 0.76, (0.40, 0.40)),
    "country": _Habit((60.0, 90.0), (9.0, 20.0), (60.0, 45.0), 0.05, (0.30, 0.00)),
}
_FLATS = _Habit((27.0, 34.0), (4.0, 8.0), (38.0, 30.0, 23.0), 0.9, (0.5, 0.0))
"""Blocks of flats, beside the wide streets of suburbs."""

_END = 3.0  # lots begin so far from the ends of edges [m]
_DRIVE = 3.0  # width of drives [m]
_WAY = 12.0  # between the gardens of a row and the houses of the next [m]
_GAP = 1.5  # between houses and the sides of their lots [m]
_AT_HOME = 0.5  # share of drives on which a car stands
_PARKS = {"centre": 0.10, "suburb": 0.05}  # share of blocks that are a park
_PARK = (1500.0, 12_000.0)  # area of these [m2]


_HARDLY_ANY = 3  # objects and areas that make no town


def lacks_town(scenario: Scenario) -> bool:
    """Return whether a scenario has no houses, trees or areas of its own, or hardly any."""
    drawn = [poi for poi in scenario.pois if kind_of(poi.type, poi.source) is not None]
    areas = [
        item
        for item in scenario.polygons
        if len(item.shape) > 2 and not item.type.startswith("jupedsim.")
    ]
    return len(drawn) + len(areas) <= _HARDLY_ANY


def with_town(
    scenario: Scenario, job: Job, clearance: Clearance, memory: Memory
) -> tuple[Scenario, Town | None]:
    """Return a scenario with a town beside its roads, and the town; None if nobody asks for one.

    Args:
        scenario: As read.
        job: The scene file.
        clearance: Cameras that nothing stands in or before.
        memory: What was built of the world.
    """
    if job.street.town == "none" or not job.textured:
        return scenario, None

    def make() -> Town:
        lanes = memory.of(("lane index",), partial(build_lane_index, scenario.network))
        around = surroundings(lanes, seed=job.seed, clearance=clearance)
        parked = job.street.parked == "auto" and covers_ground(job)
        return invented(scenario, replace(around, memory=memory), parked=parked)

    town = memory.of(("town",), make)
    return town.within(scenario), town


def invented(scenario: Scenario, around: Surroundings, *, parked: bool = True) -> Town:
    """Invent a town beside the roads of a scenario.

    Args:
        scenario: Roads, stops, and what it has put somewhere, which keeps its place.
        around: Lanes, the seed, and the cameras that nothing stands before.
        parked: Whether cars stand in bays and on drives.
    """
    network = scenario.network
    characters = characters_of(network, scenario.stops)
    seed = around.seed
    # Where a scenario says where cars park, there are no other bays.
    bays = parked and not scenario.parking
    sides = list(sides_of(network, characters, seed=seed, bays=bays))
    if not sides:
        return Town(characters)
    taken = taken_by(scenario, characters, sides)
    parks = _parks(network, characters, taken.wide, seed)
    lots = _free(_lots(sides, seed), _with(taken.wide, parks))
    solid = [*parks, *(shapely.Polygon(lot.plan) for lot in lots)]
    lots += _free(_lots(sides, seed, row=1), _with(taken.wide, solid))
    pois: list[Poi] = []
    polygons = [area(f"park:{k}", "park", park) for k, park in enumerate(parks)]
    cars: list[ParkedCar] = []
    ways: list[shapely.Polygon] = []
    for lot in lots:
        made = _furnished(lot, seed)
        pois += made.pois
        polygons += made.polygons
        if made.drive is not None:
            ways.append(lot.box(*made.drive, -lot.side.begin, 6.0))
            cars += _on_drive(lot, made.drive, seed) if parked else ()
    parking = parking_of(sides, taken, ways)
    cars += [car for area_ in parking for car in in_bays(area_, seed)]
    bounds, trees = rims(sides, taken, [*parks, *(shapely.Polygon(k.plan) for k in lots)], seed)
    pois += [*alley_trees(sides, taken, ways, seed), *trees]
    polygons += bounds
    town = Town(characters, tuple(pois), tuple(polygons), tuple(parking), tuple(cars))
    return _out_of_sight(town, around)


def _with(solid: shapely.STRtree, more: Sequence[shapely.Geometry]) -> shapely.STRtree:
    """A tree with further shapes."""
    return shapely.STRtree([*solid.geometries, *more])


@dataclass(frozen=True, slots=True, eq=False)
class _Lot:
    """A piece of land beside a street.

    Attributes:
        name: Unique.
        side: The street's.
        row: 0 at the street; 1 behind that, at a way of its own, of which nothing is seen.
        habit: How people build there.
        plan: Its corners: front, then back, (4, 2) [m].
    """

    name: str
    side: Side
    row: int
    habit: _Habit
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

    @property
    def depth(self) -> float:
        """[m]."""
        return float(np.hypot(*(self.plan[3] - self.plan[0])))

    def at(self, along: float, inward: float) -> Floats:
        """Return a place in it, counted from where its front begins, (2,) [m]."""
        return np.asarray(self.plan[0] + along * self.along + inward * self.inward)

    def box(self, begin: float, end: float, low: float, high: float) -> shapely.Polygon:
        """Return a rectangle in it [m]."""
        spots = ((begin, low), (end, low), (end, high), (begin, high))
        return shapely.Polygon([self.at(*spot) for spot in spots])


def _lots(sides: Sequence[Side], seed: int, *, row: int = 0) -> list[list[_Lot]]:
    """Lots along all sides, each as deep as it may be, then shallower; only suburbs have rows."""
    lots, suffix = [], f":row{row}" if row else ""
    for side in sides:
        habit = _HABITS.get(side.character)
        if habit is None or (row and side.character != "suburb"):
            continue
        rng = dice_of(seed, SOURCE, "lots", side.name + suffix)
        if side.character == "suburb" and side.wide and share_of(seed, "flats", side.street) < 0.6:
            habit = _FLATS
        at, number = _END + rng.uniform(0.0, 3.0), 0
        while at < side.border.length - _END:
            end = at + rng.uniform(*habit.front)
            if end < side.border.length - _END and rng.random() < habit.built:
                name = f"{side.name}:{number}{suffix}"
                plans = _plans(side, row, habit, (at, end))
                lots.append([_Lot(name, side, row, habit, plan) for plan in plans])
            at, number = end, number + 1
    return lots


def _plans(side: Side, row: int, habit: _Habit, span: tuple[float, float]) -> Iterator[Floats]:
    """Yield corners of a lot that begins and ends so far along a border [m], by its depths."""
    border, behind = side.border, row * (max(habit.depths) + _WAY)
    a, b = border.at(np.array(span), side.begin + behind).places
    way = (b - a) / max(float(np.hypot(*(b - a))), 1e-6)
    for depth in habit.depths:
        inward = depth * border.outward * np.array([-way[1], way[0]])
        yield settled([a, b, b + inward, a + inward])


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


@dataclass(frozen=True, slots=True, eq=False)
class _Furnished:
    """What stands on a lot; where its drive begins and ends along the front, if it has one [m]."""

    pois: Sequence[Poi]
    polygons: Sequence[Polygon]
    drive: tuple[float, float] | None = None


def _furnished(lot: _Lot, seed: int) -> _Furnished:
    """A house, its drive, its garden and what is around that."""
    rng = dice_of(seed, SOURCE, "lot", lot.name)
    kind = "blocks" if lot.habit is _FLATS else "homes"
    polygons = [area(f"garden:{lot.name}", "residential", shapely.Polygon(lot.plan))]
    back = float(rng.uniform(*lot.habit.back))
    drawn = _drawn(lot, kind, back, seed)
    if drawn is None:
        return _Furnished((), polygons)
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
    if slack > 1.0 and not lot.row:
        drive = lot.box(*gap, -VERGE, back + (deep if slack > _DRIVE else 0.0))
        polygons.append(area(f"drive:{lot.name}", "square", drive))
    polygons += _bounds(lot, gap, back, seed)
    pois = [house, *_garden(lot, rng, (middle, wide), back + deep)]
    return _Furnished(pois, polygons, gap if slack > 1.0 and not lot.row else None)


def _on_drive(lot: _Lot, gap: tuple[float, float], seed: int) -> Iterator[ParkedCar]:
    """A car on the drive of some lots, most with their front to the house."""
    share = share_of(seed, SOURCE, "drive", lot.name)
    if share > _AT_HOME:
        return
    inward = share > 0.3 * _AT_HOME
    front = lot.at(sum(gap) / 2.0, 1.2 + (CAR if inward else 0.0))
    way = lot.inward if inward else -lot.inward
    yaw = float(np.arctan2(way[1], way[0]))
    yield ParkedCar(f"drive:{lot.name}", (float(front[0]), float(front[1])), yaw)


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
                yield line(f"front:{lot.name}:{number}", kind, ends)
    if own < 0.75 and lot.depth > back + 8.0:
        beside = "hedge" if own < 0.25 else "wooden"
        ends = [lot.at(lot.width - 0.4, back), lot.at(lot.width - 0.4, lot.depth - 1.0)]
        yield line(f"beside:{lot.name}", beside, ends)


def _garden(
    lot: _Lot, rng: np.random.Generator, house: tuple[float, float], behind: float
) -> Iterator[Poi]:
    """Shrubs and a tree before the house, trees behind it."""
    kinds, weights = urn("yards")
    shrubs, _ = urn("area_shrubs")
    for k in range(int(rng.integers(0, 3))):
        along = house[0] + rng.uniform(-0.5, 0.5) * house[1]
        place = lot.at(float(along), float(rng.uniform(1.3, max(1.4, lot.habit.back[0] - 0.6))))
        yield plant(f"{lot.name}:s{k}", "shrub", place, shrubs[int(rng.integers(len(shrubs)))])
    room = lot.depth - behind - 5.0
    for k in range(int(rng.integers(0, 3)) if room > 2.0 else 0):
        along = float(rng.uniform(2.5, lot.width - 2.5))
        place = lot.at(along, behind + 3.5 + float(rng.uniform(0.0, room)))
        yield plant(f"{lot.name}:t{k}", "tree", place, kinds[pick(weights, rng.random())])


def _to_ends(name: str, network: Network) -> Iterator[Floats]:
    """Yield an edge's line, and straight ones from the junctions at its ends to it."""
    edge = network.edges[name]
    line = edge.lanes[-1].shape[:, :2]
    yield line
    for junction, end in ((edge.from_junction, line[0]), (edge.to_junction, line[-1])):
        if junction in network.junctions:
            yield np.stack([network.junctions[junction].position[:2], end])


def _parks(
    network: Network, characters: Mapping[str, Character], solid: shapely.STRtree, seed: int
) -> list[shapely.Polygon]:
    """Some of the blocks between streets, without what lies beside these."""
    some = [name for name, character in characters.items() if character != "motorway"]
    lines = [shapely.LineString(line) for name in some for line in _to_ends(name, network)]
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


TREES, SHRUBS, BOUNDS = 400.0, 110.0, 130.0
"""Farther from every camera than this they are left out [m]."""

MOST_TREES, MOST_SHRUBS = 280, 120
"""The nearest of them, at most."""


def near_cameras(scenario: Scenario, around: Surroundings) -> Scenario:
    """Return a scenario without what is invented that a shot hardly shows, or not at all.

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
    houses = [poi for poi in scenario.pois if poi.source == SOURCE and poi.type in _BODY]
    seen = around.seen(settled([k.position for k in houses]).reshape(-1, 2), radius=40.0)
    gone.update(poi.id for poi, shown in zip(houses, seen, strict=True) if not shown)
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
    spots = settled([car.middle for car in town.cars]).reshape(-1, 2)
    ground = around.height_at(spots) if len(spots) else np.zeros(0)
    clear = around.clearance
    out = clear.distances(spots) < CAR
    if out.size:
        out |= clear.filled(spots, ground, height=1.6, radius=2.0)
    cars = [car for car, gone in zip(town.cars, out, strict=True) if not gone]
    kept = [poi for poi in pois if poi.type not in _BODY or not _hides(poi, around)]
    lines = [item for item in town.polygons if item.fill or not _veils(item, around)]
    return replace(town, pois=tuple(kept), polygons=tuple(lines), cars=tuple(cars))


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
