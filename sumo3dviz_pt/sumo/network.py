"""Read SUMO's road network, `.net.xml`, plain or gzipped."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.geometry import Floats, frozen
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.sumo import values
from sumo3dviz_pt.sumo.places import counted_from, first_place
from sumo3dviz_pt.sumo.repairs import (
    DEFAULT_LANE_WIDTH,
    LaneEnds,
    Oddities,
    Oddity,
    from_point,
    look_over,
    say_at_grade,
    whole_lane,
)
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.types import allowed_classes
from sumo3dviz_pt.sumo.values import parse_flag, parse_number, parse_points

_T = TypeVar("_T")

_DEFAULT_SPEED = 13.89
_NO_LENGTH = 1e-6
"""A lane that reaches less far in plan [m] is one point, or goes straight up."""

_WIDEST_JUNCTION = 10_000.0
"""Length of the longest side of a box around an outline that is drawn [m]."""


@dataclass(slots=True)
class _Draft:
    """A network while its file is being read."""

    edges: dict[str, tuple[Element, list[Lane]]] = field(default_factory=dict)
    junctions: dict[str, tuple[Element, Junction]] = field(default_factory=dict)
    connections: list[tuple[Element, Connection]] = field(default_factory=list)
    location: Location = field(default_factory=Location)
    placed: bool = False
    left_hand: bool = False
    lanes: dict[str, Lane] = field(default_factory=dict)
    length: float = 0.0
    oddities: Oddities = field(default_factory=Oddities)

    def settle(self, element: Element) -> None:
        """Settle from where coordinates are counted, by the first place that the file gives."""
        if not self.placed and (first := first_place(element)) is not None:
            self.location, self.placed = counted_from(self.location, first), True


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
    point, or goes straight up, becomes 1 cm long in plan, so that it has a direction. What
    else can be repaired is, and one note says what was odd: lanes without shape, width or length,
    junctions without a place.

    Args:
        path: The .net.xml, plain or gzipped.

    Returns:
        Edges of every function, junctions and connections, counted from `Location.origin`.

    Raises:
        InputError: If the file is damaged, no network, has no lane, a number is out of
            range, an id stands twice, or something names a lane or edge that is not there.
    """
    draft = _Draft()
    for element in read_elements(path, root="net", what="a SUMO network"):
        _take(draft, element)
    if not draft.lanes:
        message = "the network has no lane; write it again with netedit or netconvert"
        raise InputError(message, file=path)
    network = Network(
        _edges(draft),
        {key: junction for key, (_, junction) in draft.junctions.items()},
        tuple(connection for _, connection in draft.connections),
        draft.location,
        draft.left_hand,
    )
    _check_names(draft, network)
    if draft.length > values.MOST_LENGTH:
        raise InputError(
            f"all lanes together are {draft.length / 1e3:,.0f} km long, and at most"
            f" {values.MOST_LENGTH / 1e3:,.0f} km can be drawn; cut the network to the place",
            file=path,
        )
    look_over(network, draft.oddities)
    draft.oddities.say(path)
    say_at_grade(network, path)
    return network


def read_location(path: Path) -> Location:
    """Read only where a road network lies on the Earth.

    Raises:
        InputError: If the file is damaged or no network.
    """
    location = Location()
    for element in read_elements(path, root="net", what="a SUMO network"):
        if element.tag == "location":
            location = _location(element)
        elif (first := first_place(element)) is not None:
            return counted_from(location, first)
    return counted_from(location, None)


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
    draft.settle(element)
    match element.tag:
        case "net":
            draft.left_hand = parse_flag(element.text("lefthand", "false"))
        case "location" if not draft.placed:
            draft.location = _location(element)
        case "edge":
            _add(draft.edges, element, (element, []))
        case "lane" if draft.edges:
            owner, siblings = draft.edges[next(reversed(draft.edges))]
            shape = _lane_shape(element, draft.location)
            length = float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
            lane = _lane(element, owner, shape, drawn=length, place=len(siblings))
            outline = _outline(element, "outlineShape", draft.location)
            lane = replace(lane, outline=outline) if len(outline) >= 3 else lane
            _add(draft.lanes, element, lane)
            if length > max(values.LONGEST_SHAPE, values.MOST_STRETCHED * lane.length):
                raise element.error(
                    f"the shape is {length / 1e3:,.0f} km long, and the length is"
                    f" {lane.length:g} m; write the network again with netconvert"
                )
            has_length = "length" in element.attributes
            siblings.append(whole_lane(lane, draft.oddities, drawn=length, stated=has_length))
            draft.length += length
        case "junction":
            _add(draft.junctions, element, (element, _junction(element, draft)))
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


def _edges(draft: _Draft) -> dict[str, Edge]:
    """Return the edges that have lanes; lanes without a shape get one."""
    edges: dict[str, Edge] = {}
    for key, (element, lanes) in draft.edges.items():
        if lanes:
            edges[key] = _edge(element, lanes)
        else:
            draft.oddities.add(Oddity.NO_LANE, key)
    shapeless = [e for e in edges.values() if not all(len(lane.shape) for lane in e.lanes)]
    if not shapeless:
        return edges
    junctions = {key: junction for key, (_, junction) in draft.junctions.items()}
    links = [connection for _, connection in draft.connections]
    ends = LaneEnds(edges, junctions, links, left_hand=draft.left_hand)
    for edge in shapeless:
        mended = ends.mended(edge, draft.oddities)
        if mended is None:
            message = "the edge has a lane without a shape; write the network again with netconvert"
            raise draft.edges[edge.id][0].error(message)
        edges[edge.id] = mended
    return edges


def _edge(element: Element, lanes: list[Lane]) -> Edge:
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
        priority=element.integer("priority", -1, within=values.PRIORITY),
        crossed_edges=tuple(element.text("crossingEdges", "").split()),
        name=element.text("name", "").strip(),
    )


def _lane(element: Element, owner: Element, shape: Floats, *, drawn: float, place: int) -> Lane:
    """Make a lane; `drawn` is the length of its shape [m], `place` its position on the edge."""
    width = element.number("width", DEFAULT_LANE_WIDTH, within=values.LANE_WIDTH)
    return Lane(
        id=element.text("id"),
        edge_id=owner.text("id"),
        index=element.integer("index", place, within=values.INDEX),
        shape=shape,
        width=width,
        speed=element.number("speed", _DEFAULT_SPEED, within=values.SPEED_LIMIT),
        length=element.number("length", drawn, within=values.LANE_LENGTH),
        allowed=allowed_classes(element.text("allow", ""), element.text("disallow", "")),
        up=_changing(element, "changeLeft"),
        down=_changing(element, "changeRight"),
    )


def _changing(element: Element, key: str) -> frozenset[str] | None:
    """Return who may change lanes; None where the file lets all, as by an empty list."""
    text = element.text(key, "")
    return allowed_classes(text, "") if text.strip() else None


def _lane_shape(element: Element, location: Location) -> Floats:
    """Return a lane's shape, which has a direction in plan unless it has no point."""
    shape = _points(element, "shape", location)
    upright = len(shape) and float(np.ptp(shape[:, :2], axis=0).max()) < _NO_LENGTH
    return frozen(from_point(shape[0], top=float(shape[-1, 2])) if upright else shape)


def _outline(element: Element, key: str, location: Location) -> Floats:
    """Return the outline of a junction or crossing, which is of a possible size."""
    outline = _points(element, key, location)
    across = float(np.ptp(outline[:, :2], axis=0).max()) if len(outline) else 0.0
    if across > _WIDEST_JUNCTION:
        raise element.error(
            f"{key} is {across / 1e3:,.0f} km across, and at most {_WIDEST_JUNCTION / 1e3:g} km can"
            " be drawn; write the network again with netconvert"
        )
    return outline


def _points(element: Element, key: str, location: Location) -> Floats:
    text = element.text(key, "")
    try:
        return frozen(location.inside(parse_points(text)))
    except ValueError as error:
        raise element.error(f"{key} must hold points such as 1.0,2.0, but {error}") from None


def _junction(element: Element, draft: _Draft) -> Junction:
    outline = _outline(element, "shape", draft.location)
    return Junction(
        id=element.text("id"),
        type=element.text("type", ""),
        position=_place(element, outline, draft),
        outline=outline,
        incoming_lanes=tuple(element.text("incLanes", "").split()),
    )


def _place(element: Element, outline: Floats, draft: _Draft) -> Floats:
    """Return the position of a junction, (3,) [m]; where none is given, the middle of its outline.

    Args:
        element: The junction's.
        outline: (n, 3) [m].
        draft: Has the origin, and what is odd, which grows.
    """
    if len(outline) and not {"x", "y"} <= element.attributes.keys():
        draft.oddities.add(Oddity.NO_PLACE, element.text("id"))
        return frozen(outline.mean(axis=0))
    x, y = (element.number(axis, within=values.COORDINATE) for axis in ("x", "y"))
    z = element.number("z", 0.0, within=values.HEIGHT)
    return frozen(draft.location.inside([x, y, z]))


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
        link_index=element.integer("linkIndex", -1, within=values.LINK_INDEX),
        direction=element.text("dir", "s"),
        state=element.text("state", ""),
    )


def _location(element: Element) -> Location:
    """Return what a file says of where it lies; `origBoundary` holds what was cut off, too."""
    x, y = _numbers(element, "netOffset", 2)
    west, south, east, north = _numbers(element, "convBoundary", 4)
    return Location(
        net_offset=(x, y),
        boundary=(west, south, east, north),
        projection=element.text("projParameter", "!"),
    )


def _numbers(element: Element, key: str, count: int) -> list[float]:
    text = element.text(key, ",".join(["0"] * count))
    try:
        numbers = [parse_number(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise element.error(f'{key}="{cut(text)}" must be {count} numbers')
    return numbers
