"""Both sides of the streets of an invented town: trees in rows, bays with parked cars, hedges.

A place beside a street is free where no road, rail, footway or lot takes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.random import dice_of, pick, share_of
from sumo3dviz_pt.model.traffic import Bay, ParkingArea, Poi, Polygon, Scenario
from sumo3dviz_pt.world.objects.kinds import INVENTED as SOURCE
from sumo3dviz_pt.world.street.furniture import stop_areas
from sumo3dviz_pt.world.street.places import Border, border_of, drives, offset
from sumo3dviz_pt.world.town.character import URBAN, Character
from sumo3dviz_pt.world.town.pavements import WIDTH as PAVEMENT
from sumo3dviz_pt.world.town.pavements import lacks_walk

VERGE = 0.3  # between pavement or kerb and lots [m]
_BARE = 1.2  # the same where a road has no pavement [m]
_ALLEYS: Mapping[Character, tuple[float, float]] = {
    "centre": (0.6, 9.0),
    "suburb": (0.4, 11.0),
    "village": (0.15, 13.0),
}
"""Share of streets with trees, and the distance of these [m]."""

_BAYS: Mapping[Character, float] = {"centre": 0.6, "suburb": 0.45}
"""Share of streets with bays for parked cars, among those that have room for them."""

BAY = 2.3
"""Width of bays beside the carriageway, with what keeps them off it [m]."""

_LONG, _ACROSS, _OFF = 5.8, 2.1, 0.12  # a bay's length and width, and how far off lanes it lies [m]
_CORNER = 10.0  # nobody parks nearer to a junction [m]
_CALM = 61.0 / 3.6  # nor beside faster roads [m/s]


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One side of a street.

    Attributes:
        name: Unique.
        street: The same for both directions of a street.
        border: Where it begins.
        character: Of the street.
        begin: Where lots begin, from the border [m].
        wide: Whether two lanes or more lead each way.
        bays: Whether cars park between carriageway and pavement.
    """

    name: str
    street: str
    border: Border
    character: Character
    begin: float
    wide: bool
    bays: bool = False


def sides_of(
    network: Network, characters: Mapping[str, Character], *, seed: int, bays: bool
) -> Iterator[Side]:
    """Yield both sides of all streets but motorways and those that cross others without a junction.

    Args:
        network: The roads.
        characters: What they run through.
        seed: Of streets with bays.
        bays: Whether there are any.
    """
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
        bare = PAVEMENT + VERGE if character in URBAN else _BARE
        wide = sum(drives(lane) for lane in edge.lanes) > 1
        begin = border.walk + VERGE if border.walk else bare
        park = bays and not wide and _has_room(edge, character)
        park = park and share_of(seed, SOURCE, "bays", street) < _BAYS.get(character, 0.0)
        yield Side(name, street, border, character, begin + BAY * park, wide, park)
        if back is None:
            last = edge.lanes[-1]
            line = offset(last.shape, -border.outward * last.width / 2.0)
            inner = Border(edge, line, -border.outward, 0.0, border.road)
            yield Side(f"{name}:inner", street, inner, character, bare, wide)


def _has_room(edge: Edge, character: Character) -> bool:
    """Whether bays fit beside an edge: the pavement is ours, and it is no fast road."""
    return character in URBAN and lacks_walk(edge) and edge.told_speed <= _CALM


def _crossing(network: Network, characters: Mapping[str, Character]) -> frozenset[str]:
    """Edges that cross others without a junction: bridges, and what they lead over."""
    edges = [network.edges[name] for name in characters]
    if not edges:
        return frozenset()
    lines = [shapely.LineString(edge.lanes[0].shape[:, :2]) for edge in edges]
    one, other = shapely.STRtree(lines).query(lines, predicate="crosses")
    over = set()
    for a, b in zip(one.tolist(), other.tolist(), strict=True):
        met = {edges[a].from_junction, edges[a].to_junction}
        if not met & {edges[b].from_junction, edges[b].to_junction}:
            over.add(edges[a].id)
    return frozenset(over)


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """What roads and all that is given take.

    Attributes:
        bare: Roads, rails, footways, stops, and the scenario's areas and objects.
        wide: The same with pavements and bays.
    """

    bare: shapely.STRtree
    wide: shapely.STRtree


def taken_by(
    scenario: Scenario, characters: Mapping[str, Character], sides: Sequence[Side]
) -> Taken:
    """Return what is taken before anything is invented.

    Args:
        scenario: Roads, and what it has put somewhere.
        characters: What edges run through.
        sides: Of streets; some have bays.
    """
    network = scenario.network
    parked = frozenset(side.border.edge.id for side in sides if side.bays)
    lines, halves, rooms = [], [], []
    for edge in network.edges.values():
        room = _pavement(edge, characters) + BAY * (edge.id in parked)
        for lane in edge.lanes:
            if edge.function != "walkingarea" and len(lane.shape) > 1:
                lines.append(shapely.LineString(lane.shape[:, :2]))
                halves.append(lane.width / 2.0)
                rooms.append(room)
    half, room_at = np.array(halves), np.array(rooms)
    outlines = [k.outline for k in network.junctions.values() if k.type != "internal"]
    outlines += [lane.shape for e in network.edges.values() if e.function == "walkingarea"
                 for lane in e.lanes]  # fmt: skip
    outlines += [item.shape for item in scenario.polygons if item.fill]
    outlines += [item.shape for item in stop_areas(network, scenario.stops)]
    areas = [
        shapely.make_valid(shapely.Polygon(shape[:, :2])) for shape in outlines if len(shape) > 2
    ]
    points = [shapely.Point(poi.position).buffer(8.0) for poi in scenario.pois]
    bare = [*shapely.buffer(lines, half, cap_style="flat"), *areas, *points]
    wide = [*shapely.buffer(lines, half + room_at, cap_style="flat"), *points]
    wide += list(shapely.buffer(areas, PAVEMENT))
    return Taken(shapely.STRtree(bare), shapely.STRtree(wide))


def _pavement(edge: Edge, characters: Mapping[str, Character]) -> float:
    """Width of the pavement that an edge gets [m]."""
    if characters.get(edge.id) not in URBAN:
        return 0.5
    return PAVEMENT if lacks_walk(edge) else 0.1


def alley_trees(
    sides: Sequence[Side], taken: Taken, ways: Sequence[shapely.Geometry], seed: int
) -> list[Poi]:
    """Return trees in a row along some streets: behind the pavement, or in front gardens.

    Args:
        sides: Of all streets.
        taken: What they keep off.
        ways: Drives.
        seed: Of all chance.
    """
    kinds, weights = urn("alleys")
    spots: list[tuple[str, str, Floats]] = []
    for side in sides:
        chance, gap = _ALLEYS.get(side.character, (0.0, 1.0))
        if share_of(seed, SOURCE, "alley", side.street) > chance + 0.2 * side.wide:
            continue
        species = kinds[pick(weights, share_of(seed, SOURCE, "species", side.street))]
        at = np.arange(0.5 * gap, side.border.length - 0.4 * gap, gap)
        out = side.begin + (0.75 if side.character == "centre" else 1.9)
        places = side.border.at(at, out).places
        spots += [(f"{side.name}:a{k}", species, place) for k, place in enumerate(places)]
    if not spots:
        return []
    places = np.array([place for *_, place in spots])
    keep = _free(places, taken.wide, 0.4) & _free(places, shapely.STRtree(list(ways)), 0.4)
    return [
        plant(name, "tree", place, species)
        for (name, species, place), stays in zip(spots, keep, strict=True)
        if stays
    ]


def _free(places: Floats, tree: shapely.STRtree, gap: float) -> Bools:
    """Which places, (n, 2) [m], are farther than a gap [m] from all shapes of a tree, (n,)."""
    keep = np.ones(len(places), dtype=np.bool_)
    if len(places) and len(tree.geometries):
        keep[tree.query(shapely.points(places), predicate="dwithin", distance=gap)[0]] = False
    return keep


def parking_of(
    sides: Sequence[Side], taken: Taken, ways: Sequence[shapely.Geometry]
) -> list[ParkingArea]:
    """Return bays along the sides that have some, but not before drives.

    Args:
        sides: Of all streets.
        taken: What they keep off.
        ways: Drives, up to the carriageway.
    """
    areas = []
    drives_at = shapely.STRtree(list(ways))
    for side in sides:
        at = np.arange(_CORNER, side.border.length - _CORNER - _LONG, _LONG)
        if not side.bays or not len(at):
            continue
        out = _OFF + _ACROSS / 2.0
        rear, front = (side.border.at(at + more, out).places for more in (0.0, _LONG))
        yaws = np.arctan2(*(front - rear).T[::-1])
        bays = [
            Bay((float(x), float(y)), float(yaw), _LONG, _ACROSS)
            for (x, y), yaw in zip(front, yaws, strict=True)
        ]
        plans = shapely.buffer([shapely.Polygon(bay.corners()) for bay in bays], -0.05)
        gone = np.zeros(len(bays), dtype=np.bool_)
        for tree in (taken.bare, drives_at):
            gone[tree.query(plans, predicate="intersects")[0]] = True
        stay = tuple(bay for bay, out_ in zip(bays, gone, strict=True) if not out_)
        if stay:
            edge = side.border.edge
            lane = min((k for k in edge.lanes if drives(k)), key=lambda k: k.index)
            areas.append(ParkingArea(f"{SOURCE}:{side.name}", lane.id, stay, len(stay)))
    return areas


_STEP = 2.0  # distance of points of hedges along open land [m]
_RIM: Mapping[Character, float] = {"suburb": 0.85, "village": 0.5}  # share of sides that have some


def rims(
    sides: Sequence[Side], taken: Taken, lots: Sequence[shapely.Geometry], seed: int
) -> tuple[list[Polygon], list[Poi]]:
    """Return hedges, fences and trees along what lies open between lots.

    Args:
        sides: Of all streets.
        taken: What they keep off.
        lots: Plans of all lots and parks.
        seed: Of all chance.
    """
    built = shapely.STRtree(list(lots))
    lines: list[Polygon] = []
    trees: list[Poi] = []
    kinds, weights = urn("yards")
    for side in sides:
        if share_of(seed, SOURCE, "rim", side.name) > _RIM.get(side.character, 0.0):
            continue
        rng = dice_of(seed, SOURCE, "rim", side.name)
        at = np.arange(0.0, side.border.length + 0.5 * _STEP, _STEP)
        places = side.border.at(at, side.begin + 0.6).places
        free = _free(places, taken.wide, 0.4) & _free(places, built, 0.5)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int64)))
        kind = "wooden" if share_of(seed, SOURCE, "bounds", side.street) > 0.7 else "hedge"
        for number, (a, b) in enumerate(ends.reshape(-1, 2).tolist()):
            if b - a > 2:
                lines.append(line(f"rim:{side.name}:{number}", kind, list(places[a:b])))
        some = at[::3] + rng.uniform(-2.0, 2.0, len(at[::3]))
        behind = side.begin + rng.uniform(3.0, 6.0, len(some))
        spots = side.border.at(np.clip(some, 0.0, side.border.length), behind).places
        keep = _free(spots, taken.wide, 2.0) & _free(spots, built, 1.5)
        keep &= rng.random(len(some)) < 0.5
        for k in np.flatnonzero(keep).tolist():
            species = kinds[pick(weights, rng.random())]
            trees.append(plant(f"{side.name}:r{k}", "tree", spots[k], species))
    return lines, trees


def plant(name: str, kind: str, place: Floats, species: str) -> Poi:
    """Return a plant."""
    x, y = settled(place).tolist()
    return Poi(f"{SOURCE}:{name}", kind, (x, y), None, None, SOURCE, {"model": species})


def area(name: str, kind: str, shape: shapely.Polygon) -> Polygon:
    """Return a piece of ground."""
    ring = shapely.get_coordinates(shapely.orient_polygons(shape).exterior)
    return Polygon(f"{SOURCE}:{name}", kind, settled(ring), True, None, SOURCE)


def line(name: str, kind: str, points: Sequence[Floats]) -> Polygon:
    """Return a hedge or a fence."""
    return Polygon(f"{SOURCE}:{name}", kind, settled(points), False, None, SOURCE)
