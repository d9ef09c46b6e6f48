"""Reads SUMO's additional files: points of interest, polygons, stops, parking areas, detectors.

Stops are those of buses, trains and containers, and charging stations.

Where the bays of a parking area are follows SUMO. It divides the stretch of lane into as many
pieces as there are places. A vehicle's front bumper stands at the end of its piece where the angle
is 0. Otherwise the bay is turned about its middle and moved away from the road until it touches the
lane's border. That was measured with SUMO 1.28; in left-hand networks SUMO moves turned bays to the
right, too.
"""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Colour, Floats, arc_length, frozen
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.numbers import Range
from sumo3dviz_pt.model.traffic import Bay, Loop, ParkingArea, Poi, Polygon, Stop, StopKind
from sumo3dviz_pt.sumo import values
from sumo3dviz_pt.sumo.places import is_geo, placed, poi_position, shape_in_net, unplaced
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import (
    ANGLE,
    COORDINATE,
    parse_colour,
    parse_flag,
    parse_points,
    yaw_from_angle_deg,
)

KINDS: Mapping[str, StopKind] = {
    "busStop": "bus",
    "trainStop": "train",
    "containerStop": "container",
    "chargingStation": "charging",
}
"""Elements that are stops, and what they are for."""


def read_stops(paths: Iterable[Path]) -> tuple[Stop, ...]:
    """Read the stops of additional files; other elements are ignored.

    Args:
        paths: Additional files, plain or gzipped.

    Returns:
        Stops in file order; of several with one kind and id, the first.

    Raises:
        InputError: If a file is damaged or an attribute cannot be understood.
    """
    stops: dict[tuple[str, str], Stop] = {}
    for path in paths:
        for element in read_elements(path, root=(), what="an additional file of SUMO"):
            if element.tag not in KINDS or "lane" not in element.attributes:
                continue
            stop = Stop(
                element.text("id"),
                element.text("lane"),
                position_in(element, "startPos"),
                position_in(element, "endPos"),
                KINDS[element.tag],
                tuple(element.text("lines", "").replace(",", " ").split()),
            )
            stops.setdefault((stop.kind, stop.id), stop)
    return tuple(stops.values())


_INDUCTIVE = frozenset({"inductionLoop", "instantInductionLoop", "e1Detector"})
_OF_AREAS = frozenset({"laneAreaDetector", "e2Detector"})
DETECTORS = _INDUCTIVE | _OF_AREAS
"""Elements that are detectors with loops."""

UNSEEN: Mapping[str, str] = {
    "calibrator": "calibrators",
    "rerouter": "rerouters",
    "routeProbe": "route probes",
    "variableSpeedSign": "variable speed signs",
    "entryExitDetector": "entry-exit detectors",
    "e3Detector": "entry-exit detectors",
}
"""Elements that steer or count and have no body on a street, and what many of them are called."""


def read_detectors(paths: Iterable[Path]) -> tuple[tuple[Loop, ...], dict[str, int]]:
    """Read the loops of detectors, and count what has no body on a street.

    Args:
        paths: Additional files, plain or gzipped.

    Returns:
        Loops in file order, two of each lane area detector; and numbers of `UNSEEN`.

    Raises:
        InputError: If a file is damaged or a position is no number.
    """
    loops: list[Loop] = []
    unseen: Counter[str] = Counter()
    for path in paths:
        for element in read_elements(path, root=(), what="an additional file of SUMO"):
            if element.tag in UNSEEN:
                unseen[UNSEEN[element.tag]] += 1
            elif element.tag in DETECTORS:
                loops += _loops(element)
    return tuple(loops), dict(unseen)


def _loops(element: Element) -> list[Loop]:
    """The loops of a detector; none where it names no lane."""
    lanes = (element.text("lanes", "") or element.text("lane", "")).split()
    if not lanes:
        return []
    name, at = element.text("id"), position_in(element, "pos") or 0.0
    if element.tag in _INDUCTIVE:
        return [Loop(name, lanes[0], at)]
    end = position_in(element, "endPos")
    length = position_in(element, "length")
    if end is None and length is not None and len(lanes) == 1:
        end = at + length
    return [Loop(name, lanes[0], at), *([] if end is None else [Loop(name, lanes[-1], end)])]


def position_in(element: Element, key: str) -> float | None:
    """Return a position on a lane, [m]; None where the element has none.

    Raises:
        InputError: If it is no number.
    """
    return element.number(key, within=COORDINATE) if key in element.attributes else None


logger = logging.getLogger(__name__)

_POI_FIELDS = frozenset(
    {"id", "type", "x", "y", "lon", "lat", "lane", "pos", "posLat", "color", "angle"}
)
_POLYGON_FIELDS = frozenset({"id", "type", "shape", "geo", "color", "fill"})
_KINDS = ("poi", "poly")


def read_additional(
    paths: Iterable[Path], network: Network | None = None
) -> tuple[tuple[Poi, ...], tuple[Polygon, ...]]:
    """Read the POIs and polygons of additional files; other elements are ignored.

    POIs and polygons whose place is not known, and polygons with fewer than two points, are
    left out with a warning that counts them.

    Args:
        paths: Additional files, plain or gzipped.
        network: Places what is given by longitude and latitude, or by a lane.

    Returns:
        POIs and polygons in file order.

    Raises:
        InputError: If a file is damaged or an attribute cannot be understood.
    """
    pois: list[Poi] = []
    polygons: list[Polygon] = []
    for path in paths:
        left_out: Counter[str] = Counter()
        for element, params in _objects(path):
            reason = _unusable(element, network)
            if reason:
                left_out[reason] += 1
            elif element.tag == "poi":
                pois.append(_poi(element, params, network))
            else:
                polygons.append(_polygon(element, params, network))
        for reason, count in left_out.items():
            logger.warning("%s: %d %s", path, count, reason)
    return tuple(pois), tuple(polygons)


def _objects(path: Path) -> list[tuple[Element, dict[str, str]]]:
    """Return the POIs and polygons of a file, each with its `<param>` children."""
    objects: list[tuple[Element, dict[str, str]]] = []
    owner: Element | None = None
    for element in read_elements(path, root=(), what="an additional file of SUMO"):
        if element.tag in _KINDS:
            owner = element
            objects.append((element, {}))
        elif owner is not None and element.depth <= owner.depth:
            owner = None
        elif owner is not None and element.tag == "param":
            objects[-1][1][element.text("key")] = element.text("value", "")
    return objects


def _unusable(element: Element, network: Network | None) -> str:
    """Return why an object cannot be placed, or nothing."""
    what = "POIs" if element.tag == "poi" else "polygons"
    reason = unplaced(element, network)
    if not reason and what == "polygons" and len(element.text("shape", "").split()) < 2:
        reason = "they have fewer than two points"
    return reason and f"{what} left out: {reason}"


def _poi(element: Element, params: dict[str, str], network: Network | None) -> Poi:
    has_angle = "angle" in element.attributes
    angle = element.number("angle", within=values.ANGLE) if has_angle else None
    return Poi(
        id=element.text("id"),
        type=element.text("type", ""),
        position=poi_position(element, network),
        yaw=None if angle is None else yaw_from_angle_deg(angle),
        colour=colour_of(element),
        source=str(element.file),
        params=params | _others(element, _POI_FIELDS),
    )


def _polygon(element: Element, params: dict[str, str], network: Network | None) -> Polygon:
    try:
        shape = parse_points(element.text("shape"))[:, :2]
    except ValueError as error:
        raise element.error(f"shape must hold points such as 1.0,2.0, but {error}") from None
    if network is not None:
        location = network.location
        geo = is_geo(element)
        shape = shape_in_net(element, shape, location) if geo else location.inside(shape)
    return Polygon(
        id=element.text("id"),
        type=element.text("type", ""),
        shape=frozen(shape),
        # Those of JuPedSim are areas, whether they are filled or not.
        fill=parse_flag(element.text("fill", "false"))
        or element.text("type", "").startswith("jupedsim."),
        colour=colour_of(element),
        source=str(element.file),
        params=params | _others(element, _POLYGON_FIELDS),
    )


def colour_of(element: Element) -> Colour | None:
    """Return the linear sRGB of an element's `color`, or None where it has none.

    Raises:
        InputError: If SUMO would not understand it either.
    """
    text = element.text("color", "")
    try:
        return parse_colour(text)
    except ValueError:
        raise element.error(
            f'color="{cut(text)}" must be a name, #rrggbb or r,g,b with 0-255 or 0-1'
        ) from None


def _others(element: Element, known: frozenset[str]) -> dict[str, str]:
    return {key: value for key, value in element.attributes.items() if key not in known}


_WIDTH, _LENGTH = 3.2, 7.5  # of places that have no size and no lane to divide [m]
_CAPACITY = Range(0, 100_000)
_SIZE = Range(0.0, 200.0, "m")


@dataclass(frozen=True, slots=True)
class _BayRow:
    """A row of bays along a lane.

    Attributes:
        lane: The lane.
        start: Where it begins on the lane's shape [m].
        end: Where it ends [m].
        count: Bays.
        angle: Of bays against the lane [rad].
        length: Of a bay [m]; 0 is that of its piece of lane.
        width: Of a bay [m].
    """

    lane: Lane
    start: float
    end: float
    count: int
    angle: float
    length: float
    width: float


@dataclass(slots=True)
class _ParkingDraft:
    """A parking area while its elements are read."""

    element: Element
    bays: list[Bay]
    roadside: int
    size: tuple[float, float]
    known: bool = field(default=True)


def read_parking(paths: Iterable[Path], network: Network) -> tuple[ParkingArea, ...]:
    """Read the parking areas of additional files; other elements are ignored.

    Areas on the road itself (`onRoad`) and on unknown lanes have no bays and are left out.

    Args:
        paths: Additional files, plain or gzipped.
        network: Has the lanes.

    Returns:
        Areas in file order; of several with one id, the first.

    Raises:
        InputError: If a file is damaged or an attribute cannot be understood.
    """
    areas: dict[str, ParkingArea] = {}
    for path in paths:
        draft: _ParkingDraft | None = None
        for element in read_elements(path, root=(), what="an additional file of SUMO"):
            if element.tag == "parkingArea" and "lane" in element.attributes:
                _keep(draft, areas)
                draft = _begun(element, network)
            elif draft is not None and element.depth <= draft.element.depth:
                _keep(draft, areas)
                draft = None
            elif draft is not None and element.tag == "space" and "x" in element.attributes:
                draft.bays.append(_space(element, draft.size, network))
        _keep(draft, areas)
    return tuple(areas.values())


def _keep(draft: _ParkingDraft | None, areas: dict[str, ParkingArea]) -> None:
    """Add an area that has bays."""
    if draft is not None and draft.known and draft.bays:
        name = draft.element.text("id")
        area = ParkingArea(name, draft.element.text("lane"), tuple(draft.bays), draft.roadside)
        areas.setdefault(name, area)


def _begun(element: Element, network: Network) -> _ParkingDraft:
    """An area with its bays along the lane."""
    lane = network.lanes.get(element.text("lane"))
    on_road = parse_flag(element.text("onRoad", "false"))
    count = int(_number(element, "roadsideCapacity", 0.0, _CAPACITY))
    length = _number(element, "length", 0.0, _SIZE)
    width = _number(element, "width", 0.0, _SIZE) or _WIDTH
    if lane is None or on_road:
        return _ParkingDraft(element, [], 0, (length, width), known=False)
    start, end = _stretch(element, lane)
    if not length:
        length = (end - start) / count if count else _LENGTH
    angle = math.radians(_number(element, "angle", 0.0, ANGLE))
    row = _BayRow(lane, start, end, count, angle, length, width)
    bays = _along(row, left_hand=network.left_hand)
    return _ParkingDraft(element, bays, len(bays), (length, width))


def _number(element: Element, key: str, default: float, within: Range) -> float:
    """A number, or its default where the element has none."""
    return element.number(key, within=within) if key in element.attributes else default


def _stretch(element: Element, lane: Lane) -> tuple[float, float]:
    """Begin and end of a stretch on a lane's shape [m]; negative positions count from its end."""
    ends = position_in(element, "startPos"), position_in(element, "endPos")
    first, last = ends[0] or 0.0, lane.length if ends[1] is None else ends[1]
    low, high = sorted(at + lane.length if at < 0.0 else at for at in (first, last))
    shape = float(arc_length(lane.shape[:, :2])[-1])
    scale = shape / max(lane.length, 1e-9)
    return min(max(low * scale, 0.0), shape), min(max(high * scale, 0.0), shape)


def _along(row: _BayRow, *, left_hand: bool) -> list[Bay]:
    """Bays beside a lane."""
    if not row.count or row.end <= row.start:
        return []
    beside = (row.lane.width + row.width) / 2.0
    stretch = _part(row.lane.shape[:, :2], row.start, row.end)
    line = _moved(stretch, beside if left_hand else -beside)
    knots = arc_length(line)
    step = (row.end - row.start) / row.count
    marks = np.minimum(np.arange(row.count + 1) * step, knots[-1])
    points = np.column_stack([np.interp(marks, knots, column) for column in line.T])
    # A turned bay touches the border of the lane as the upright one did; SUMO gets this right
    # for bays that look away from the road only.
    across = row.width * abs(math.cos(row.angle))
    inwards = math.sin(row.angle) < -1e-9 and math.cos(row.angle) > 0.0
    broad = row.length * abs(math.sin(row.angle)) + (-across if inwards else across)
    out = (broad - row.width) / 2.0
    bays = []
    for begin, end in pairwise(points):
        way = (end - begin) / max(float(np.hypot(*(end - begin))), 1e-9)
        yaw = math.atan2(way[1], way[0]) - row.angle
        if row.angle == 0.0:
            front = end
        else:
            middle = 0.5 * (begin + end) + out * np.array([way[1], -way[0]])
            front = middle + 0.5 * row.length * np.array([math.cos(yaw), math.sin(yaw)])
        bays.append(Bay((float(front[0]), float(front[1])), yaw, row.length, row.width))
    return bays


def _space(element: Element, size: tuple[float, float], network: Network) -> Bay:
    """A bay with a place of its own; an angle of 0 looks to the south and 90 to the east."""
    x, y = (element.number(axis, within=COORDINATE) for axis in ("x", "y"))
    angle = math.radians(_number(element, "angle", 0.0, ANGLE))
    length = _number(element, "length", 0.0, _SIZE) or size[0] or _LENGTH
    width = _number(element, "width", 0.0, _SIZE) or size[1] or _WIDTH
    return Bay(placed(x, y, network), angle - math.pi / 2.0, length, width)


def _part(shape: Floats, start: float, end: float) -> Floats:
    """A stretch of a polyline, (n, 2) [m]."""
    knots = arc_length(shape)
    inner = knots[(knots > start + 1e-6) & (knots < end - 1e-6)]
    at = np.concatenate([[start], inner, [end]])
    return np.column_stack([np.interp(at, knots, column) for column in shape.T])


def _moved(line: Floats, left: float) -> Floats:
    """A polyline moved to its left [m]; bends are mitred as SUMO does."""
    step = np.diff(line, axis=0)
    length = np.hypot(*step.T)
    line, step = line[np.append(True, length > 1e-6)], step[length > 1e-6]
    if not len(step):
        return line
    step = step / np.hypot(*step.T)[:, None]
    normal = np.column_stack([-step[:, 1], step[:, 0]])
    before, after = np.vstack([normal[:1], normal]), np.vstack([normal, normal[-1:]])
    mitre = (before + after) / np.maximum(1.0 + (before * after).sum(axis=1), 0.5)[:, None]
    return np.asarray(line + left * mitre)
