"""Street furniture: benches, bins, bollards and meters, and shelters at bus stops.

It stands along sidewalks, at POIs and on corners of streets: at their outer border, out of people's
way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import combinations

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import areal
from sumo3dviz_pt.library.street import signs
from sumo3dviz_pt.library.street.furniture import FURNITURE, SHELTER
from sumo3dviz_pt.model.geometry import Bools, Floats, Transform, belonging
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Poi, Polygon, Stop
from sumo3dviz_pt.world.placement.lanes import facing_roads
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_at
from sumo3dviz_pt.world.street.places import Border, Site, border_of, is_urban, spread
from sumo3dviz_pt.world.street.signs import Sign

REACH = 220.0
"""Furniture farther than this from every camera is left out; shelters at twice that [m]."""

WORDS: Mapping[str, str] = {
    "bench": "bench",
    "bin": "bin",
    "waste_basket": "bin",
    "bollard": "bollard",
    "charging_station": "charging_post",
    "charging_post": "charging_post",
    "bus_shelter": "bus_shelter",
    "shelter": "bus_shelter",
    "parking_meter": "parking_meter",
    "vending_machine": "parking_meter",
}
"""Types of POIs, in lower case, and the piece that they mean."""

RADII: Mapping[str, float] = {
    "bollard": 0.06,
    "bin": 0.25,
    "bench": 0.4,
    "parking_meter": 0.2,
    "charging_post": 0.25,
    "bus_shelter": 0.9,
    "bicycle_stand": 0.5,
}
"""How much room a piece needs around its middle, across the sidewalk [m]."""

_LEVEL = 60.0
_SIGN = 2.9  # height of the sign at a stop [m]
_ENDS = (16.0, 16.0)  # kept clear at both ends of an edge, where people wait and turn [m]
_SPACING = 38.0
_WALK = 1.9  # narrowest sidewalk that benches stand on [m]
_ROOM = 16.0  # a shelter stands within this length of a stop [m]
_BOLLARDS = (7.0, 8.6, 10.2, 11.8)  # a row of them near a junction [m]


@dataclass(frozen=True, slots=True)
class FurnitureItem:
    """Something that stands.

    Attributes:
        name: In `FURNITURE`.
        place: x, y, z [m].
        yaw: Towards the road [rad].
    """

    name: str
    place: tuple[float, float, float]
    yaw: float


def off_lanes(piece: FurnitureItem, site: Site) -> bool:
    """Return whether no part of a piece stands on or hangs over a carriageway."""
    foot = Transform.from_pose(piece.place, yaw=piece.yaw).points(_foot(piece.name))
    return not site.around.index.meets(shapely.Polygon(foot[:, :2]))


def hides_nothing(name: str, places: Floats, site: Site) -> Bools:
    """Return where a piece would not fill much of a camera's picture, (n, 2) -> (n,)."""
    low, high = _bounds(name)
    radius = float(np.hypot(*(high - low)[:2])) / 2.0
    return site.fills_nothing(places, height=float(high[2]), radius=radius)


@cache
def _bounds(name: str) -> tuple[Floats, Floats]:
    """Lowest and highest corner of the box around a piece in its own frame, (3,) each [m]."""
    bounds = np.stack([part.mesh.bounds for part in _body(name, 0)])
    return bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)


def _foot(name: str) -> Floats:
    """The rectangle around a piece in its own frame, (4, 3) [m]."""
    (x0, y0, _), (x1, y1, _) = _bounds(name)
    return np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])


def place_furniture(
    borders: Sequence[Border], pois: Sequence[Poi], site: Site, *, auto: bool
) -> list[FurnitureItem]:
    """Place furniture at POIs and, if wanted, along the sidewalks of towns.

    Args:
        borders: Of edges.
        pois: All of the scenario.
        site: What is free; furniture is added to it.
        auto: Whether sidewalks get furniture that the scenario does not have.
    """
    pieces = _at_pois(pois, site)
    for border in borders if auto else ():
        if is_urban(border) and border.walk >= _WALK:
            pieces += _bollards(border, site)
            pieces += _benches(border, site)
    return pieces


def furniture_parts(pieces: Sequence[FurnitureItem], around: Surroundings) -> list[Part]:
    """Build meshes of the pieces that a camera sees."""
    places = np.array([piece.place[:2] for piece in pieces]).reshape(-1, 2)
    away = around.distances(places)
    reach = [REACH * (2.0 if piece.name == "bus_shelter" else 1.0) for piece in pieces]
    shown = (away < reach) & around.seen(places, radius=4.0)
    parts: list[Part] = []
    for k in np.flatnonzero(shown).tolist():
        piece, is_far = pieces[k], away[k] > _LEVEL
        stand = Transform.from_pose(piece.place, yaw=piece.yaw)
        for part in _body(piece.name, int(is_far)):
            mesh = belonging(stand.mesh(part.mesh), thing_at(piece.name, piece.place))
            parts.append(Part(mesh, part.material, part.tint))
    return parts


@cache
def _body(name: str, level: int) -> tuple[Part, ...]:
    """The parts of a piece in its own frame."""
    return tuple(FURNITURE[name](level))


@dataclass(frozen=True, slots=True)
class StopFurniture:
    """What stands at bus stops.

    Attributes:
        shelters: One a stop, where there is room.
        signs: One a stop, where there is room.
        cramped: How many stops have no room for a shelter.
    """

    shelters: Sequence[FurnitureItem]
    signs: Sequence[Sign]
    cramped: int


def place_stops(network: Network, stops: Sequence[Stop], site: Site) -> StopFurniture:
    """Place shelters and signs at bus stops.

    Args:
        network: Says where stops are.
        stops: All of the scenario.
        site: What is free; shelters and signs are added to it.
    """
    shelters: list[FurnitureItem] = []
    posts: list[Sign] = []
    cramped = 0
    for stop in (stop for stop in stops if stop.kind == "bus"):
        lane = network.lanes.get(stop.lane)
        border = None if lane is None else border_of(network, network.edges[lane.edge_id])
        if lane is None or border is None:
            continue
        begin, end = (share * border.length for share in stop.span(lane.length))
        spot = border.at(np.array([(begin + end) / 2]), 0.0).places
        if not site.holds(spot)[0]:
            continue
        shelter = _shelter(border, (begin + end) / 2, site)
        posts += _stop_sign(border, end, site)
        if shelter is None:
            cramped += 1
        else:
            shelters.append(shelter)
    return StopFurniture(shelters, posts, cramped)


def stop_areas(network: Network, stops: Sequence[Stop]) -> list[Polygon]:
    """Return where shelters at bus stops may stand, as areas that houses keep off.

    Args:
        network: Says where stops are.
        stops: All of the scenario.
    """
    areas = []
    for stop in (stop for stop in stops if stop.kind == "bus"):
        lane = network.lanes.get(stop.lane)
        border = None if lane is None else border_of(network, network.edges[lane.edge_id])
        if lane is None or border is None:
            continue
        middle = sum(stop.span(lane.length)) / 2 * border.length
        along = middle + 0.5 * _ROOM * np.array([-1.0, 1.0, 1.0, -1.0])
        deep = max(border.walk, 2.4) + 0.5
        corners = border.at(along, np.array([0.0, 0.0, deep, deep])).places
        areas.append(Polygon(f"stop:{stop.id}", "bus_stop", corners, True, None, "stops"))
    return areas


def _shelter(border: Border, along: float, site: Site) -> FurnitureItem | None:
    """A shelter whose back stands at the outer border of the sidewalk, or beyond the verge."""
    back = max(border.walk, 2.4)
    tries = along + np.array([0.0, 2.0, -2.0, 4.0, -4.0, 6.0, -6.0])
    tries = tries[(tries > 3.0) & (tries < border.length - 3.0)]
    places, road, yaw = border.at(tries, back - SHELTER[1] / 2 + 0.45)
    good = np.ones(len(places), dtype=np.bool_)
    # All of its length must be clear.
    for shift in (-SHELTER[0] / 2 + 0.7, 0.0, SHELTER[0] / 2 - 0.7):
        spots = border.at(tries + shift, back - SHELTER[1] / 2 + 0.45).places
        good &= site.free(spots, radius=0.85, height=SHELTER[2])
    good = site.level_with(places, road, among=good)
    # Take the first place where no part of it hangs over a lane.
    heights = site.standing(border.at(tries, back - SHELTER[1]).places)
    yaws = border.inward(yaw)
    for i in np.flatnonzero(good).tolist():
        x, y, z = (float(value) for value in (*places[i], heights[i]))
        shelter = FurnitureItem("bus_shelter", (x, y, z), float(yaws[i]))
        if off_lanes(shelter, site):
            for shift in (-1.5, 0.0, 1.5):
                site.use(border.at(tries[i : i + 1] + shift, back - 0.5).places)
            return shelter
    return None


def _stop_sign(border: Border, along: float, site: Site) -> list[Sign]:
    """The sign of a stop at its head end."""
    tries = np.clip(along - np.array([0.5, 1.5, 2.5, 4.0]), 0.5, max(border.length - 0.5, 0.5))
    places, road, yaw = border.at(tries, 0.5)
    free = site.free(places, radius=0.1, height=_SIGN)
    stand = site.stand(places, road, yaw, among=free)
    if stand is None:
        return []
    return [Sign(stand, partial(signs.on_post, signs.bus_stop(), bottom=2.2), 2 * REACH)]


def _at_pois(pois: Sequence[Poi], site: Site) -> list[FurnitureItem]:
    """Furniture at the scenario's points of interest; none on a road or before a camera."""
    wanted = [poi for poi in pois if poi.type.lower().split(".")[0] in WORDS]
    places = np.array([poi.position for poi in wanted]).reshape(-1, 2)
    index = site.around.index
    good = site.holds(places) & ~index.covers(places, margin=0.1)
    yaws, heights = facing_roads(places, index), np.zeros(len(places))
    if good.any():
        heights[good] = site.standing(places[good])
    pieces = []
    for i in np.flatnonzero(good):
        poi = wanted[i]
        yaw = float(yaws[i]) if poi.yaw is None else poi.yaw
        x, y = map(float, places[i])
        name = WORDS[poi.type.lower().split(".")[0]]
        piece = FurnitureItem(name, (x, y, float(heights[i])), yaw)
        if off_lanes(piece, site) and hides_nothing(name, places[i : i + 1], site)[0]:
            pieces.append(piece)
            site.use(places[i : i + 1])
    return pieces


def _benches(border: Border, site: Site) -> list[FurnitureItem]:
    """Benches, each with a bin, meters and bicycle stands, at the far side of a sidewalk."""
    seed, name = site.around.seed, border.edge.id
    at = spread(border.length, _SPACING, ends=_ENDS, shift=share_of(seed, name, "bench"))
    pieces: list[FurnitureItem] = []
    for i, along in enumerate(at.tolist()):
        chance = share_of(seed, name, "piece", str(i))
        if chance < 0.4:
            pieces += _stood("bench", border, site, along=along, out=border.walk - 0.42)
            pieces += _stood("bin", border, site, along=along + 2.1, out=border.walk - 0.4)
        elif chance < 0.6:
            pieces += _stood("bin", border, site, along=along, out=0.6)
        elif chance < 0.75:
            pieces += _stood("parking_meter", border, site, along=along, out=border.walk - 0.3)
        elif chance < 0.92:
            pieces += _stood("bicycle_stand", border, site, along=along, out=border.walk - 0.5)
    return pieces


def _bollards(border: Border, site: Site) -> list[FurnitureItem]:
    """Rows of bollards at some kerbs near junctions."""
    if border.length < 50.0 or share_of(site.around.seed, border.edge.id, "bollards") > 0.5:
        return []
    rows = [
        _stood("bollard", border, site, along=along, out=0.45, alone=False) for along in _BOLLARDS
    ]
    return [piece for row in rows for piece in row]


def _stood(
    name: str, border: Border, site: Site, *, along: float, out: float, alone: bool = True
) -> list[FurnitureItem]:
    """A piece beside a border, if there is room; else nothing.

    Args:
        name: Of the piece.
        border: The border.
        site: What is free.
        along: Distance from the border's begin [m].
        out: Distance from the border, away from the road [m].
        alone: Whether other things keep a distance from it.
    """
    places, road, yaw = border.at(np.array([along]), out)
    if not 0.0 < along < border.length or not _room(name, places, road, site):
        return []
    x, y = map(float, places[0])
    z = float(site.standing(places)[0])
    piece = FurnitureItem(name, (x, y, z), float(border.inward(yaw)[0]))
    if not off_lanes(piece, site):
        return []
    if alone:
        site.use(places)
    return [piece]


def _room(name: str, places: Floats, road: Floats, site: Site) -> bool:
    """Whether a piece has room at a place, (1, 2) [m]."""
    free = site.free(places, radius=RADII[name])
    free = site.level_with(places, road, among=free)
    return bool(free[0]) and bool(hides_nothing(name, places, site)[0])


@dataclass(frozen=True, slots=True)
class _CornerItem:
    """A kind of furniture on corners.

    Attributes:
        often: Share of corners that have one.
        room: Radius around its middle that it takes up [m].
        half: Half of how deep it is [m].
    """

    often: float
    room: float
    half: float


# fmt: off
_KINDS: Mapping[str, _CornerItem] = {
    #                           often room  half
    "cabinet":            _CornerItem(0.75, 0.60, 0.18),
    "advertising_column": _CornerItem(0.30, 0.75, 0.72),
    "bicycle_stand":      _CornerItem(0.55, 0.60, 0.42),
    "post_box":           _CornerItem(0.40, 0.35, 0.22),
    "bin":                _CornerItem(0.70, 0.25, 0.22),
    "bench":              _CornerItem(0.40, 0.95, 0.32),
}
# fmt: on

_GAPS = (0.12, 0.5, 1.2, 1.9, 2.6)
"""From the outer border to the back of a piece, the first that fits [m]."""

_SMALLEST = 25.0
"""Smaller corners stay empty [m2]."""

_PATH = 0.5
"""From walkers' shortest lines to a piece [m]."""

_ROAD = 2.0
"""Borders with a carriageway, a crossing or a footway this near are no outer ones [m]."""


def place_corners(edges: Sequence[Edge], network: Network, site: Site) -> list[FurnitureItem]:
    """Place furniture on corners, chosen by the seed.

    Args:
        edges: Those that are walking areas are the corners.
        network: The road network.
        site: What is free; furniture is added to it.
    """
    pieces: list[FurnitureItem] = []
    for edge in edges:
        outline = edge.lanes[0].shape if edge.function == "walkingarea" else np.zeros((0, 3))
        if len(outline) < 3:
            continue
        area = areal(shapely.make_valid(shapely.Polygon(outline[:, :2])))
        if area.area > _SMALLEST:
            pieces += _on_corner(edge, area, network, site)
    return pieces


def _on_corner(
    edge: Edge, area: shapely.Geometry, network: Network, site: Site
) -> list[FurnitureItem]:
    """Pieces along the outer border of one corner."""
    # Find its outer border, and the lines along which people walk.
    seed = site.around.seed
    doors = _doors(edge, network)
    paths = shapely.union_all([shapely.LineString(pair) for pair in combinations(doors, 2)])
    spots, inward = _outer_border(area, doors, site)
    # Put pieces there, some of them a little further in.
    pieces: list[FurnitureItem] = []
    for name, kind in _KINDS.items():
        if not len(spots) or share_of(seed, edge.id, name) > kind.often:
            continue
        inside = area.buffer(-kind.half)
        for gap in _GAPS:
            places = spots + (gap + kind.half) * inward
            dots = shapely.points(places)
            fits = site.free(places, radius=kind.room) & shapely.contains(inside, dots)
            good = np.flatnonzero(fits & (shapely.distance(dots, paths) > _PATH + kind.half))
            if not len(good):
                continue
            k = int(good[int(share_of(seed, edge.id, name, "at") * len(good))])
            z = float(site.standing(places[k : k + 1])[0])
            yaw = float(np.arctan2(inward[k, 1], inward[k, 0]))
            piece = FurnitureItem(name, (float(places[k, 0]), float(places[k, 1]), z), yaw)
            if off_lanes(piece, site) and hides_nothing(name, places[k : k + 1], site)[0]:
                site.use(places[k : k + 1])
                pieces.append(piece)
                break
    return pieces


def _doors(edge: Edge, network: Network) -> list[Floats]:
    """Where walkers enter a corner: ends of crossings and footways that touch it."""
    outline = shapely.Polygon(edge.lanes[0].shape[:, :2]).buffer(0.4)
    junction = edge.id[1:].rpartition("_")[0]
    doors: list[Floats] = []
    for other in network.edges.values():
        near = (
            other.id.startswith(f":{junction}_")
            if other.function == "crossing"
            else (junction in {other.from_junction, other.to_junction})
        )
        if not near or other.function in {"walkingarea", "internal"}:
            continue
        for lane in other.lanes:
            if "pedestrian" not in lane.allowed or not len(lane.shape):
                continue
            for end in (lane.shape[0, :2], lane.shape[-1, :2]):
                if outline.contains(shapely.Point(end)):
                    doors.append(end)
    return doors


def _outer_border(
    area: shapely.Geometry, doors: Sequence[Floats], site: Site
) -> tuple[Floats, Floats]:
    """Points of the border away from roads and doors, and unit vectors inwards, (n, 2) each."""
    part = max(getattr(area, "geoms", [area]), key=lambda one: one.area)
    ring = shapely.orient_polygons(part).exterior
    at = np.arange(0.25, ring.length, 0.5)
    points = shapely.get_coordinates(shapely.line_interpolate_point(ring, at))
    ahead = shapely.get_coordinates(shapely.line_interpolate_point(ring, at + 0.05)) - points
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    inward = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    outer = ~site.around.index.covers(points, margin=_ROAD)
    for door in doors:
        outer &= np.hypot(*(points - door).T) > _ROAD
    return points[outer], inward[outer]
