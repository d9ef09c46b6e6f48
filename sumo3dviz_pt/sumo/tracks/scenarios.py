"""Reads who moves where from scenarios of CommonRoad and OpenSCENARIO.

CommonRoad tells the middle of bodies and has lanes of its own. OpenSCENARIO tells a point of
vehicles, usually the middle of the rear axle, of which their bounding boxes say where it is; only
its trajectories by positions are read, because what else it asks for needs a simulator.

References:
    CommonRoad, XML scenario format 2020a (commonroad.in.tum.de). ASAM OpenSCENARIO 1.0 to 1.3,
    `Trajectory`, `Vertex`, `WorldPosition`, `BoundingBox`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo.stream import chunks, may_be_xml, root_of
from sumo3dviz_pt.sumo.tracks.readings import Samples
from sumo3dviz_pt.sumo.tracks.tables import Words
from sumo3dviz_pt.sumo.values import parse_number

if TYPE_CHECKING:
    from sumo3dviz_pt.sumo.tracks.lanes import Road

SCENARIO_ROOTS = ("commonRoad", "OpenSCENARIO")

_COMMON_CLASSES = {
    # CommonRoad's types of obstacles that SUMO has other words for.
    "car": "passenger",
    "priorityVehicle": "emergency",
    "parkedVehicle": "passenger",
    "train": "rail",
    "unknown": "",
}
_OPEN_CLASSES = {"car": "passenger", "van": "delivery", "semitrailer": "trailer", "train": "rail"}
_USUAL_SPEED = 13.89  # where a lanelet has no limit [m/s]


def is_scenario(file: Path) -> bool:
    """Whether a file is a scenario of these."""
    return may_be_xml(file) and root_of(file) in SCENARIO_ROOTS


@dataclass(slots=True)
class _Collected:
    """Rows, one list for each of their values."""

    who: list[str] = field(default_factory=list)
    rows: list[tuple[float, float, float, float, float, float]] = field(default_factory=list)
    sizes: list[tuple[float, float, float]] = field(default_factory=list)
    classes: list[str] = field(default_factory=list)

    def samples(self, file: Path, meanings: dict[str, str]) -> Samples:
        """Return them; InputError if there are none."""
        if not self.rows:
            message = "nobody in it moves along given positions; record the run as a table"
            raise InputError(message, file=file)
        times, x, y, z, headings, speeds = np.array(self.rows).T
        return Samples(
            _words(self.who),
            times,
            np.column_stack([x, y, np.nan_to_num(z)]),
            headings,
            speeds,
            np.array(self.sizes),
            _words(self.classes),
            meanings=meanings,
        )


def _words(texts: Sequence[str]) -> Words:
    """Return texts as codes."""
    known: dict[str, int] = {}
    codes = np.array([known.setdefault(text, len(known)) for text in texts], dtype=np.int64)
    return Words(codes, tuple(known))


def scenario_samples(file: Path) -> tuple[Samples, list[Road]]:
    """Return where road users are in a scenario, and its roads; none where it has none.

    Raises:
        InputError: If the file is damaged, or nobody moves along given positions.
    """
    root = _parsed(file)
    try:
        if root.tag == "commonRoad":
            samples = _common_road(root).samples(file, _COMMON_CLASSES)
            return samples, [_road(lanelet) for lanelet in root.iter("lanelet")]
        return _open_scenario(root).samples(file, _OPEN_CLASSES), []
    except ValueError as error:
        raise InputError(f"cannot be understood ({error}); write it again", file=file) from None


def _parsed(file: Path) -> Element:
    """Return the root element of a file."""
    parser = ElementTree.XMLParser()
    try:
        for chunk in chunks(file):
            parser.feed(chunk)
        root: Element = parser.close()
    except ElementTree.ParseError as error:
        message = f"is not well-formed XML ({error}); copy or write it again"
        raise InputError(message, file=file) from None
    return root


def _number(element: Element | None, path: str = "", default: float = np.nan) -> float:
    """Return the number in an element, exact or the middle of an interval."""
    found = element if element is None or not path else element.find(path)
    if found is None:
        return default
    exact = found.find("exact")
    if exact is None and found.find("intervalStart") is not None:
        return (_number(found, "intervalStart") + _number(found, "intervalEnd")) / 2
    text = (found if exact is None else exact).text or ""
    return parse_number(text.strip())


def _common_road(root: Element) -> _Collected:
    """Return the moving obstacles of CommonRoad."""
    step = parse_number(root.get("timeStepSize", "0.1"))
    collected = _Collected()
    for obstacle in (*root.iter("dynamicObstacle"), *root.iter("obstacle")):
        role = obstacle.findtext("role", "dynamic")
        if role.strip() != "dynamic":
            continue
        box = obstacle.find("shape/rectangle")
        circle = 2 * _number(obstacle, "shape/circle/radius")
        size = (_number(box, "length", circle), _number(box, "width", circle), np.nan)
        kind = obstacle.findtext("type", "").strip()
        for state in (obstacle.find("initialState"), *obstacle.iterfind("trajectory/state")):
            point = None if state is None else state.find("position/point")
            if state is None or point is None:
                continue
            collected.who.append(obstacle.get("id", ""))
            collected.rows.append(
                (
                    step * _number(state, "time"),
                    _number(point, "x"),
                    _number(point, "y"),
                    _number(point, "z"),
                    _number(state, "orientation"),
                    _number(state, "velocity"),
                )
            )
            collected.sizes.append(size)
            collected.classes.append(kind)
    return collected


def _road(lanelet: Element) -> Road:
    """Return the road of a lanelet: one lane between its bounds."""
    from sumo3dviz_pt.sumo.tracks.lanes import Road

    left, right = (
        np.array(
            [
                (_number(point, "x"), _number(point, "y"))
                for point in lanelet.iterfind(f"{side}Bound/point")
            ]
        )
        for side in ("left", "right")
    )
    count = min(len(left), len(right))
    if count < 2:
        raise ValueError(f"lanelet {lanelet.get('id')} has no bounds")
    middle = (left[:count] + right[:count]) / 2
    width = float(np.median(np.linalg.norm(left[:count] - right[:count], axis=1)))
    return Road((middle,), (width,), _USUAL_SPEED)


@dataclass(frozen=True, slots=True)
class _Box:
    """A vehicle of OpenSCENARIO.

    Attributes:
        size: Length, width and height [m].
        ahead: Middle of the body ahead of its reference point [m].
        kind: Its category.
    """

    size: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    ahead: float = 0.0
    kind: str = ""


def _open_scenario(root: Element) -> _Collected:
    """Return those of OpenSCENARIO who follow trajectories by positions."""
    boxes = {each.get("name", ""): _box(each) for each in root.iter("ScenarioObject")}
    collected = _Collected()
    for group in root.iter("ManeuverGroup"):
        names = [each.get("entityRef", "") for each in group.iterfind("Actors/EntityRef")]
        for vertex in group.iter("Vertex"):
            place = vertex.find("Position/WorldPosition")
            if place is None:
                continue
            time, x, y, z, heading = (
                parse_number(each.get(key, "nan"))
                for each, key in ((vertex, "time"), *((place, key) for key in "xyzh"))
            )
            for name in names:
                box = boxes.get(name, _Box())
                ahead = box.ahead * np.array([np.cos(heading), np.sin(heading)])
                ahead = np.nan_to_num(ahead)
                collected.who.append(name)
                collected.rows.append((time, x + ahead[0], y + ahead[1], z, heading, np.nan))
                collected.sizes.append(box.size)
                collected.classes.append(box.kind)
    return collected


def _box(entity: Element) -> _Box:
    """Return what is told of an entity."""
    for kind in ("Vehicle", "Pedestrian"):
        own = entity.find(kind)
        if own is None:
            continue
        category = own.get("vehicleCategory", "pedestrian" if kind == "Pedestrian" else "")
        size, centre = own.find("BoundingBox/Dimensions"), own.find("BoundingBox/Center")
        if size is None or centre is None:
            return _Box(kind=category)
        lengths = [parse_number(size.get(key, "nan")) for key in ("length", "width", "height")]
        return _Box(
            (lengths[0], lengths[1], lengths[2]), parse_number(centre.get("x", "0")), category
        )
    return _Box()
