"""Traffic signs from the network: limits where they change, priority, exits and gantries."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from sumo3dviz_pt.library.buildings.shop_words import LANGUAGES
from sumo3dviz_pt.library.street import national
from sumo3dviz_pt.library.street import signs as shapes
from sumo3dviz_pt.library.street.lettering import can_write
from sumo3dviz_pt.library.street.road_styles import SignStyle
from sumo3dviz_pt.model.geometry import Transform, arc_length, belonging
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_at
from sumo3dviz_pt.world.street.places import Border, Site

REACH = 400.0
"""Signs farther than this from every camera are left out [m]."""

GANTRY_REACH = 1500.0
"""The same for gantries [m]."""

FAST = 80.0 / 3.6
"""Speed limit from which roads of two lanes or more have gantries [m/s]."""

_LIMITS = {"km/h": (10, 130), "mph": (5, 85)}  # lowest and highest limit on a sign, by unit
_BESIDE = 0.45  # from the kerb to a post on a sidewalk [m]
_VERGE = 1.2  # the same without a sidewalk [m]
_FAR = 150.0
_TOP = 2.9  # about how high a sign on a post is [m]
_GANTRY_FEET = (1.6, 2.2, 3.0, 4.0)  # how far out a gantry's post is tried [m]
_GANTRY_TOP = 6.7  # about how high one is [m]
_GANTRY_SHIFTS = np.array([0.0, 20.0, -20.0, 40.0, -40.0])  # other places of one [m]
_NOSE_TOP = 3.0  # about how high the board at an exit is [m]
_BEFORE_EXIT = 180.0
_LONGEST = 22  # letters; of longer names a board shows the first words
_HOPS = 8  # edges that are followed to find one with a name


@dataclass(frozen=True, slots=True)
class Wish:
    """A sign that a road should have.

    Attributes:
        face: Its plate.
        along: Where, from the begin of the edge [m].
        bottom: Height of its lowest edge [m].
    """

    face: tuple[Part, ...]
    along: float
    bottom: float = 2.2


@dataclass(frozen=True, slots=True, eq=False)
class Sign:
    """A sign that stands, or a gantry.

    Attributes:
        stand: Where: `world_from_sign`.
        body: Its parts in its own frame by level of detail, 0 or 1.
        reach: Farther than this from every camera it is left out [m].
        radius: Of a ball around its foot that holds it [m].
    """

    stand: Transform
    body: Callable[..., Sequence[Part]]
    reach: float
    radius: float = 4.0


def place_signs(
    network: Network, borders: Sequence[Border], site: Site, links: EdgeLinks, style: SignStyle
) -> list[Sign]:
    """Place signs on posts along edges.

    Args:
        network: The road network.
        borders: Of edges.
        site: What is free; signs are added to it.
        links: Connections of the network.
        style: What signs look like.
    """
    return [
        sign
        for border in borders
        if "railway" not in border.edge.type
        for wish in (*_limit(network, border, links, style), *_priority(border, links, style))
        for sign in _posted(wish, border, site)
    ]


def place_exits(
    network: Network, borders: Sequence[Border], site: Site, links: EdgeLinks
) -> list[Sign]:
    """Place gantries before exits of motorways, and boards at the exits' noses.

    Args:
        network: The road network.
        borders: Of edges.
        site: What is free; posts of gantries are added to it.
        links: Connections of the network.
    """
    return [
        sign
        for border in borders
        if "railway" not in border.edge.type
        for sign in _exit(network, border, links, site)
    ]


def sign_parts(signs: Sequence[Sign], around: Surroundings) -> list[Part]:
    """Build everything that the signs which a camera sees are made of, in the world."""
    places = np.array([sign.stand.matrix[:2, 3] for sign in signs]).reshape(-1, 2)
    away = around.distances(places)
    parts: list[Part] = []
    for sign, place, distance in zip(signs, places, away.tolist(), strict=True):
        if distance < sign.reach and around.seen(place[None], radius=sign.radius)[0]:
            parts += _moved(sign.body(level=int(distance > _FAR)), sign.stand)
    return parts


@dataclass(frozen=True, slots=True)
class EdgeLinks:
    """Connections between normal edges.

    Attributes:
        into: Those that lead into an edge, by its id.
        out: Those that lead out of it.
        at: Those that cross a junction, by its id.
    """

    into: Mapping[str, list[Connection]]
    out: Mapping[str, list[Connection]]
    at: Mapping[str, list[Connection]]


def links_of(network: Network) -> EdgeLinks:
    """Sort connections by the normal edges that they join."""
    into: dict[str, list[Connection]] = {}
    out: dict[str, list[Connection]] = {}
    at: dict[str, list[Connection]] = {}
    for link in network.connections:
        start, end = (
            network.edges[network.lanes[k].edge_id] for k in (link.from_lane, link.to_lane)
        )
        if start.function == end.function == "normal":
            out.setdefault(start.id, []).append(link)
            into.setdefault(end.id, []).append(link)
            at.setdefault(start.to_junction, []).append(link)
    return EdgeLinks(into, out, at)


def limit_of(edge: Edge, style: SignStyle) -> int:
    """Return the number on an edge's speed limit, in the style's unit."""
    return national.shown_limit(_fastest(edge), style)


def _limit(network: Network, border: Border, links: EdgeLinks, style: SignStyle) -> list[Wish]:
    """A speed limit where it differs from that of a road that leads here."""
    number = limit_of(border.edge, style)
    before = {
        limit_of(network.edges[network.lanes[link.from_lane].edge_id], style)
        for link in links.into.get(border.edge.id, [])
        if link.direction not in ("t", "T")
    }
    lowest, highest = _LIMITS[style.unit]
    if not lowest <= number <= highest or before == {number} or border.length < 40.0:
        return []
    return [Wish(national.speed_limit(number, style), min(9.0, border.length / 3))]


def _priority(border: Border, links: EdgeLinks, style: SignStyle) -> list[Wish]:
    """Stop, give way or priority where an edge ends without a signal."""
    own = [k for k in links.out.get(border.edge.id, []) if k.direction not in ("t", "T")]
    if not own or any(link.tls for link in own) or border.length < 15.0:
        return []
    states = {link.state for link in own}
    at = border.length - 2.0
    if states & {"s", "w"}:
        return [Wish(shapes.stop(), at)]
    # A left turn out of a main road waits, too, but straight on goes first.
    main = {link.state for link in own if link.direction in ("s", "R", "L")} or states
    if "m" in main or "=" in states:
        return [Wish(national.give_way(style), at)]
    others = links.at.get(border.edge.to_junction, [])
    diamond = style.priority and "motorway" not in border.edge.type
    if diamond and "M" in main and any(link.state in ("m", "s") for link in others):
        return [Wish(shapes.priority_road(), max(border.length - 35.0, border.length / 2))]
    return []


def _posted(wish: Wish, border: Border, site: Site) -> list[Sign]:
    """A sign on a post beside the road, if there is room near its place."""
    tries = wish.along + np.array([0.0, 1.5, -1.5, 3.0, -3.0, 5.0, -5.0])
    tries = tries[(tries > 1.0) & (tries < border.length - 0.8)]
    places, road, yaw = border.at(tries, _BESIDE if border.walk > 0.0 else _VERGE)
    free = site.free(places, radius=0.15, walks=False, height=_TOP)
    stand = site.stand(places, road, yaw, among=free)
    if stand is None:
        return []
    return [Sign(stand, partial(shapes.on_post, wish.face, bottom=wish.bottom), REACH)]


def _exit(network: Network, border: Border, links: EdgeLinks, site: Site) -> list[Sign]:
    """A gantry before a motorway's exit, and a board at the exit's nose."""
    edge = border.edge
    drives = [lane for lane in edge.lanes if lane.allowed & {"passenger", "bus"}]
    if len(drives) < 2 or max(lane.speed for lane in drives) < FAST - 0.1:
        return []
    targets = {network.lanes[k.to_lane].edge_id for k in links.out.get(edge.id, [])}
    slow = sorted(t for t in targets if _leaves(network.edges[t], edge))
    if not slow or len(targets) < 2:
        return []
    on = sorted(targets - set(slow)) or slow[1:]
    ways = (
        _led_to(network.edges[slow[0]], network, links),
        _led_to(network.edges[on[0]], network, links) if on else edge.name,
    )
    words = _words(edge, ways, site)
    return [*_gantry(border, words, site), *_nose(network.edges[slow[0]], network, site)]


def _led_to(edge: Edge, network: Network, links: EdgeLinks) -> str:
    """The name of the first street with one that an edge leads to; empty without any near."""
    for _ in range(_HOPS):
        if edge.name:
            return edge.name
        on = {network.lanes[link.to_lane].edge_id for link in links.out.get(edge.id, [])}
        if not on:
            break
        edge = network.edges[min(on)]
    return ""


def _words(edge: Edge, ways: tuple[str, str], site: Site) -> tuple[str, str]:
    """What is written for the exit and for straight on: streets' names, or whither by chance."""
    seed, names = site.around.seed, list(LANGUAGES[site.around.language].towards)
    chosen = []
    for name, way in zip(ways, ("exit", "ahead"), strict=True):
        place = names.pop(pick([1.0] * len(names), share_of(seed, edge.id, way)))
        shown = _shortened(name)
        known = bool(shown) and can_write(shown) and shown not in chosen
        chosen.append(shown if known else place)
    return chosen[0], chosen[1]


def _shortened(name: str) -> str:
    """A name as a board has room for it: the whole, or its first words, but no part of a word."""
    while len(name) > _LONGEST and " " in name:
        name = name.rsplit(" ", 1)[0]
    return name


def _fastest(edge: Edge) -> float:
    """The speed limit of an edge's fastest lane for cars and buses [m/s]."""
    speeds = [lane.speed for lane in edge.lanes if lane.allowed & {"passenger", "bus"}]
    return max(speeds, default=0.0)


def _leaves(target: Edge, edge: Edge) -> bool:
    """Whether an edge is the exit of another: a link, or with fewer lanes and slower."""
    if target.type.endswith("_link"):
        return True
    slower = round(0.36 * _fastest(target)) < round(0.36 * _fastest(edge))  # by 10 km/h
    return slower and len(target.lanes) < len(edge.lanes)


def _gantry(border: Border, words: tuple[str, str], site: Site) -> list[Sign]:
    """A gantry over an edge, about 180 m before its end."""
    # Find room for the outer post.
    at = _unseen(border, max(border.length - _BEFORE_EXIT, min(20.0, border.length / 2)), site)
    if at is None:
        return []
    span = border.road
    feet = np.array(_GANTRY_FEET)
    places, road, _ = border.at(np.full(len(feet), at), feet)
    good = site.level_with(places, road, among=site.free(places, radius=0.5))
    if not good.any():
        return []
    out = float(feet[int(np.argmax(good))])
    # Find room for the inner post; without any, the gantry ends over the road.
    insides = -(span + np.array([1.0, 1.4, 1.8, 2.4]))
    others = border.at(np.full(len(insides), at), insides).places
    inner = site.free(others, radius=0.35)
    portal = bool(inner.any())
    reach = -float(insides[int(np.argmax(inner))]) if portal else span - 0.6
    # Build it.
    point, height, turn = border.at(np.array([at]), 0.0)
    stand = Transform.from_pose((*point[0], float(height[0])), yaw=float(turn[0]))
    site.use(places[int(np.argmax(good))][None])
    # In the frame of the border's point +y is left: away from the road on left-hand roads.
    side = float(-border.outward)
    boards = [(side * y, face) for y, face in _boards(border, words)]
    ends = (side * reach, -side * out)
    made = shapes.gantry(*ends, boards, portal=portal)
    return [Sign(stand, lambda level: made, GANTRY_REACH, radius=20.0 + span)]


def _unseen(border: Border, wanted: float, site: Site) -> float | None:
    """Where a gantry hangs right before no camera, near a distance along an edge [m], or None."""
    tries = wanted + _GANTRY_SHIFTS
    across = np.arange(-border.road - 1.0, _GANTRY_FEET[0] + 0.5, 1.0)
    for at in tries[(tries > 0.0) & (tries < border.length)].tolist():
        spots = border.at(np.full(len(across), at), across).places
        if site.in_nobodys_way(spots, height=_GANTRY_TOP, reach=0.5).all():
            return float(at)
    return None


def _boards(border: Border, words: tuple[str, str]) -> list[tuple[float, tuple[Part, ...]]]:
    """Boards by their distance from the outer border [m]: the exit's, and straight on."""
    span = border.road
    exit_name, ahead = words
    return [
        (min(2.2, span / 4), _fitted(exit_name, "exit", room=0.5 * span)),
        (0.68 * span, _fitted(ahead, "down", room=0.5 * span)),
    ]


def _fitted(word: str, pointer: str, *, room: float) -> tuple[Part, ...]:
    """A board that is at most so wide [m]."""
    height = 0.5
    board = shapes.board((word,), pointer, height=height)
    wide, _ = shapes.board_size(board)
    if wide > room:
        board = shapes.board((word,), pointer, height=height * room / wide)
    return board


def _nose(edge: Edge, network: Network, site: Site) -> list[Sign]:
    """The board between an exit and the road it leaves."""
    lane = edge.lanes[-1]
    # Try places along the exit, on its inner side.
    knots = arc_length(lane.shape[:, :2])
    tries = np.arange(6.0, min(knots[-1], 90.0), 3.0)
    points = np.column_stack([np.interp(tries, knots, column) for column in lane.shape.T])
    ahead = np.column_stack([np.interp(tries + 1.0, knots, column) for column in lane.shape.T])
    yaw = np.arctan2(ahead[:, 1] - points[:, 1], ahead[:, 0] - points[:, 0])
    inner = -1.0 if network.left_hand else 1.0
    normal = inner * np.column_stack([-np.sin(yaw), np.cos(yaw)])
    places = points[:, :2] + normal * (lane.width / 2 + 1.9)
    free = site.free(places, radius=1.3, height=_NOSE_TOP)
    stand = site.stand(places, points[:, 2], yaw, among=free)
    if stand is None:
        return []
    leaving = LANGUAGES[site.around.language].leaving
    return [Sign(stand, lambda level: shapes.exit_board((leaving,)), GANTRY_REACH / 2)]


def _moved(parts: Sequence[Part], stand: Transform) -> list[Part]:
    """Parts carried into the world."""
    thing = thing_at("sign", stand.position)
    return [
        Part(belonging(stand.mesh(part.mesh), thing), part.material, part.tint) for part in parts
    ]
