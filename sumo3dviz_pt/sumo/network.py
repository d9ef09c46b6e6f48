"""Read SUMO's road network, `.net.xml`, plain or gzipped."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats, frozen
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.sumo.classes import allowed_classes
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import parse_flag, parse_points

logger = logging.getLogger(__name__)

DEFAULT_LANE_WIDTH = 3.2
"""SUMO's lane width where the file gives none [m]."""

_DEFAULT_SPEED = 13.89
_SHORTEST_LANE = 0.01


@dataclass(slots=True)
class _Draft:
    """A network while its file is being read."""

    edges: list[tuple[Element, list[Lane]]] = field(default_factory=list)
    junctions: dict[str, Junction] = field(default_factory=dict)
    connections: list[Connection] = field(default_factory=list)
    location: Location = field(default_factory=Location)
    left_hand: bool = False


def read_network(path: Path) -> Network:
    """Read a road network.

    Repeated neighbouring points of shapes are dropped. A lane whose shape is a single
    point becomes 1 cm long, so that it has a direction.

    Args:
        path: The .net.xml, plain or gzipped.

    Returns:
        Edges of every function, junctions and connections, in net coordinates.

    Raises:
        InputError: If the file is damaged, no network, has no lane, or a lane has no shape.
    """
    draft = _Draft()
    for element in read_elements(path, root="net", what="a SUMO network"):
        _take(draft, element)
    edges = {e.text("id"): _edge(e, lanes) for e, lanes in draft.edges}
    network = Network(
        edges, draft.junctions, tuple(draft.connections), draft.location, draft.left_hand
    )
    if not network.lanes:
        message = "the network has no lane; write it again with netedit or netconvert"
        raise InputError(message, file=path)
    return network


def _take(draft: _Draft, element: Element) -> None:
    """Add what one element says."""
    match element.tag:
        case "net":
            draft.left_hand = parse_flag(element.text("lefthand", "false"))
        case "location":
            draft.location = _location(element)
        case "edge":
            draft.edges.append((element, []))
        case "lane" if draft.edges:
            draft.edges[-1][1].append(_lane(element, draft.edges[-1]))
        case "junction":
            draft.junctions[element.text("id")] = _junction(element)
        case "connection":
            draft.connections.append(_connection(element))


def _edge(element: Element, lanes: list[Lane]) -> Edge:
    return Edge(
        id=element.text("id"),
        function=element.text("function", "normal") or "normal",
        from_junction=element.text("from", ""),
        to_junction=element.text("to", ""),
        lanes=tuple(sorted(lanes, key=lambda lane: lane.index)),
        type=element.text("type", ""),
        priority=int(element.number("priority", -1)),
        crossed_edges=tuple(element.text("crossingEdges", "").split()),
    )


def _lane(element: Element, edge: tuple[Element, list[Lane]]) -> Lane:
    owner, siblings = edge
    shape = _lane_shape(element)
    outline = _points(element, "outlineShape")
    width = element.number("width", DEFAULT_LANE_WIDTH)
    return Lane(
        id=element.text("id"),
        edge_id=owner.text("id"),
        index=int(element.number("index", len(siblings))),
        shape=shape,
        # SUMO writes -1 for "not given" in some generated files.
        width=width if width > 0 else DEFAULT_LANE_WIDTH,
        speed=element.number("speed", _DEFAULT_SPEED),
        length=element.number(
            "length", float(np.linalg.norm(np.diff(shape, axis=0), axis=1).sum())
        ),
        allowed=allowed_classes(element.text("allow", ""), element.text("disallow", "")),
        outline=outline if len(outline) >= 3 else None,
    )


def _lane_shape(element: Element) -> Floats:
    """A lane's shape with at least two points."""
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
        position=frozen([element.number("x"), element.number("y"), element.number("z", 0.0)]),
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
        link_index=int(element.number("linkIndex", -1)),
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
    if len(numbers) != count:
        raise element.error(f'{key}="{text}" must be {count} numbers')
    return numbers
