"""Read SUMO's road network, `.net.xml`, plain or gzipped."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.geometry import Floats, frozen
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.sumo import bounds
from sumo3dviz_pt.sumo.classes import allowed_classes
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import parse_flag, parse_points

logger = logging.getLogger(__name__)

_T = TypeVar("_T")

DEFAULT_LANE_WIDTH = 3.2
"""SUMO's lane width where the file gives none [m]."""

_DEFAULT_SPEED = 13.89
_SHORTEST_LANE = 0.01
_NARROWEST_LANE = 0.01


@dataclass(slots=True)
class _Draft:
    """A network while its file is being read."""

    edges: dict[str, tuple[Element, list[Lane]]] = field(default_factory=dict)
    junctions: dict[str, tuple[Element, Junction]] = field(default_factory=dict)
    connections: list[tuple[Element, Connection]] = field(default_factory=list)
    location: Location = field(default_factory=Location)
    left_hand: bool = False
    lanes: dict[str, Lane] = field(default_factory=dict)
    length: float = 0.0


def network_of(path: Path) -> Network:
    """Read a road network as `read_network` does, once for as long as its file is the same."""
    if not path.is_file():
        return read_network(path)
    stat = path.stat()
    return _network_of(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=1)
def _network_of(path: Path, changed: int, size: int) -> Network:
    """What `network_of` keeps: the last network, which all shots of a scene file share."""
    return read_network(path)


def read_network(path: Path) -> Network:
    """Read a road network.

    Repeated neighbouring points of shapes are dropped. A lane whose shape is a single
    point becomes 1 cm long, so that it has a direction.

    Args:
        path: The .net.xml, plain or gzipped.

    Returns:
        Edges of every function, junctions and connections, in net coordinates.

    Raises:
        InputError: If the file is damaged, no network, has no lane, a lane has no shape, a
            number is out of range, an id stands twice, or something names a lane or edge
            that is not there.
    """
    draft = _Draft()
    for element in read_elements(path, root="net", what="a SUMO network"):
        _take(draft, element)
    if not draft.edges:
        message = "the network has no lane; write it again with netedit or netconvert"
        raise InputError(message, file=path)
    network = Network(
        {key: _edge(element, lanes) for key, (element, lanes) in draft.edges.items()},
        {key: junction for key, (_, junction) in draft.junctions.items()},
        tuple(connection for _, connection in draft.connections),
        draft.location,
        draft.left_hand,
    )
    _check_names(draft, network)
    if draft.length > bounds.MOST_LENGTH:
        raise InputError(
            f"all lanes together are {draft.length / 1e3:,.0f} km long, and at most"
            f" {bounds.MOST_LENGTH / 1e3:,.0f} km can be drawn; cut the network to the place",
            file=path,
        )
    return network


def read_location(path: Path) -> Location:
    """Read only where a road network lies on the Earth.

    Raises:
        InputError: If the file is damaged or no network.
    """
    elements = read_elements(path, root="net", what="a SUMO network")
    for element in elements:
        if element.tag == "location":
            return _location(element)
    return Location()


def _check_names(draft: _Draft, network: Network) -> None:
    """Refuse connections and junctions that name missing lanes, as SUMO does."""
    for element, connection in draft.connections:
        for lane in (connection.from_lane, connection.to_lane, connection.via):
            if lane and lane not in network.lanes:
                raise element.error(_unknown("lane", lane))
    for element, junction in draft.junctions.values():
        for lane in junction.incoming_lanes:
            if lane not in network.lanes:
                raise element.error(_unknown("lane", lane))


def _unknown(what: str, name: str) -> str:
    """Return a message that something is missing."""
    return f'the network has no {what} "{cut(name)}"; write the network again with netconvert'


def _take(draft: _Draft, element: Element) -> None:
    """Add the content of one element."""
    match element.tag:
        case "net":
            draft.left_hand = parse_flag(element.text("lefthand", "false"))
        case "location":
            draft.location = _location(element)
        case "edge":
            _add(draft.edges, element, (element, []))
        case "lane" if draft.edges:
            owner, siblings = draft.edges[next(reversed(draft.edges))]
            shape = _lane_shape(element)
            length = float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
            lane = _lane(element, owner, shape, drawn=length, place=len(siblings))
            _add(draft.lanes, element, lane)
            siblings.append(lane)
            draft.length += length
        case "junction":
            _add(draft.junctions, element, (element, _junction(element)))
        case "connection":
            draft.connections.append((element, _connection(element)))


def _add(known: dict[str, _T], element: Element, made: _T) -> None:
    """Add an object under its element's id, which must be new.

    Args:
        known: Objects by id.
        element: The element that the object was made from.
        made: The object.
    """
    if element.text("id") in known:
        raise element.error("the id stands twice in the network; remove or rename one")
    known[element.text("id")] = made


def _edge(element: Element, lanes: list[Lane]) -> Edge:
    if not lanes:
        raise element.error("the edge has no lane; write the network again with netconvert")
    function = element.text("function", "normal") or "normal"
    # netconvert itself numbers lanes of second internal edges twice.
    if function == "normal" and len({lane.index for lane in lanes}) < len(lanes):
        raise element.error("two of the edge's lanes have the same index; number them 0, 1, ...")
    return Edge(
        id=element.text("id"),
        function=function,
        from_junction=element.text("from", ""),
        to_junction=element.text("to", ""),
        lanes=tuple(sorted(lanes, key=lambda lane: lane.index)),
        type=element.text("type", ""),
        priority=element.integer("priority", -1, within=bounds.PRIORITY),
        crossed_edges=tuple(element.text("crossingEdges", "").split()),
    )


def _lane(element: Element, owner: Element, shape: Floats, *, drawn: float, place: int) -> Lane:
    """Make a lane; `drawn` is the length of its shape [m], `place` its position on the edge."""
    outline = _points(element, "outlineShape")
    width = element.number("width", DEFAULT_LANE_WIDTH, within=bounds.LANE_WIDTH)
    return Lane(
        id=element.text("id"),
        edge_id=owner.text("id"),
        index=element.integer("index", place, within=bounds.INDEX),
        shape=shape,
        # SUMO writes -1 for "not given" in some generated files.
        width=width if width >= _NARROWEST_LANE else DEFAULT_LANE_WIDTH,
        speed=element.number("speed", _DEFAULT_SPEED, within=bounds.SPEED_LIMIT),
        length=element.number("length", drawn, within=bounds.LANE_LENGTH),
        allowed=allowed_classes(element.text("allow", ""), element.text("disallow", "")),
        outline=outline if len(outline) >= 3 else None,
    )


def _lane_shape(element: Element) -> Floats:
    """Return a lane's shape with at least two points."""
    shape = _points(element, "shape")
    if not len(shape):
        raise element.error("the lane has no shape; write the network again with netconvert")
    if len(shape) == 1:
        logger.debug("%s: %s is a single point", element.file, element.name)
        shape = np.vstack([shape, shape[0] + np.array([_SHORTEST_LANE, 0.0, 0.0])])
    return frozen(shape)


def _points(element: Element, key: str) -> Floats:
    text = element.text(key, "")
    try:
        return frozen(parse_points(text))
    except ValueError as error:
        raise element.error(f"{key} must hold points such as 1.0,2.0, but {error}") from None


def _junction(element: Element) -> Junction:
    return Junction(
        id=element.text("id"),
        type=element.text("type", ""),
        position=frozen(
            [
                element.number("x", within=bounds.COORDINATE),
                element.number("y", within=bounds.COORDINATE),
                element.number("z", 0.0, within=bounds.HEIGHT),
            ]
        ),
        outline=_points(element, "shape"),
        incoming_lanes=tuple(element.text("incLanes", "").split()),
    )


def _connection(element: Element) -> Connection:
    from_lane, to_lane = (
        f"{element.text(edge)}_{element.text(lane)}"
        for edge, lane in (("from", "fromLane"), ("to", "toLane"))
    )
    return Connection(
        from_lane=from_lane,
        to_lane=to_lane,
        via=element.text("via", ""),
        tls=element.text("tl", ""),
        link_index=element.integer("linkIndex", -1, within=bounds.LINK_INDEX),
        direction=element.text("dir", "s"),
        state=element.text("state", ""),
    )


def _location(element: Element) -> Location:
    x, y = _numbers(element, "netOffset", 2)
    return Location(
        net_offset=(x, y),
        boundary=_box(element, "convBoundary"),
        geo_boundary=_box(element, "origBoundary"),
        projection=element.text("projParameter", "!"),
    )


def _box(element: Element, key: str) -> tuple[float, float, float, float]:
    a, b, c, d = _numbers(element, key, 4)
    return a, b, c, d


def _numbers(element: Element, key: str, count: int) -> list[float]:
    text = element.text(key, ",".join(["0"] * count))
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise element.error(f'{key}="{cut(text)}" must be {count} numbers')
    return numbers
