"""Read parking areas from SUMO's additional files, and find where their bays are.

SUMO divides the stretch of lane into as many pieces as there are places. A vehicle's front
bumper stands at the end of its piece where the angle is 0. Otherwise the bay is turned about
its middle and moved away from the road until it touches the lane's border. That was measured
with SUMO 1.28; in left-hand networks SUMO moves turned bays to the right, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from sumo3dviz_pt.model.bounds import Range
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.traffic import Bay, ParkingArea
from sumo3dviz_pt.model.vectors import arc_length
from sumo3dviz_pt.sumo.bounds import ANGLE, COORDINATE
from sumo3dviz_pt.sumo.places.objects import placed
from sumo3dviz_pt.sumo.stops import position_in
from sumo3dviz_pt.sumo.stream import Element, read_elements
from sumo3dviz_pt.sumo.values import parse_flag

_WIDTH, _LENGTH = 3.2, 7.5  # of places that have no size and no lane to divide [m]
_CAPACITY = Range(0, 100_000)
_SIZE = Range(0.0, 200.0, "m")


@dataclass(frozen=True, slots=True)
class _Row:
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
class _Draft:
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
        draft: _Draft | None = None
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


def _keep(draft: _Draft | None, areas: dict[str, ParkingArea]) -> None:
    """Add an area that has bays."""
    if draft is not None and draft.known and draft.bays:
        name = draft.element.text("id")
        area = ParkingArea(name, draft.element.text("lane"), tuple(draft.bays), draft.roadside)
        areas.setdefault(name, area)


def _begun(element: Element, network: Network) -> _Draft:
    """An area with its bays along the lane."""
    lane = network.lanes.get(element.text("lane"))
    on_road = parse_flag(element.text("onRoad", "false"))
    count = int(_number(element, "roadsideCapacity", 0.0, _CAPACITY))
    length = _number(element, "length", 0.0, _SIZE)
    width = _number(element, "width", 0.0, _SIZE) or _WIDTH
    if lane is None or on_road:
        return _Draft(element, [], 0, (length, width), known=False)
    start, end = _stretch(element, lane)
    if not length:
        length = (end - start) / count if count else _LENGTH
    angle = math.radians(_number(element, "angle", 0.0, ANGLE))
    row = _Row(lane, start, end, count, angle, length, width)
    bays = _along(row, left_hand=network.left_hand)
    return _Draft(element, bays, len(bays), (length, width))


def _number(element: Element, key: str, default: float, within: Range) -> float:
    """A number, or its default where the element has none."""
    return element.number(key, within=within) if key in element.attributes else default


def _stretch(element: Element, lane: Lane) -> tuple[float, float]:
    """Begin and end of a stretch on a lane's shape [m]; negative positions count from its end."""
    given = position_in(element, "startPos"), position_in(element, "endPos")
    first, last = given[0] or 0.0, lane.length if given[1] is None else given[1]
    low, high = sorted(at + lane.length if at < 0.0 else at for at in (first, last))
    shape = float(arc_length(lane.shape[:, :2])[-1])
    scale = shape / max(lane.length, 1e-9)
    return min(max(low * scale, 0.0), shape), min(max(high * scale, 0.0), shape)


def _along(row: _Row, *, left_hand: bool) -> list[Bay]:
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
