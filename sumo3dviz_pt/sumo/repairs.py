"""What is odd in a network: found, said in one note, and mended where lanes lack something.

Lanes that have no width, length or shape get one. Geometry that no map means is odd. What
netconvert writes as a habit is not: internal lanes of a point, outlines without any ground where a
road only goes on, and outlines that overlap themselves a little.

Roads that cross at one height without a junction are odd, too: who drives there passes through
others. Maps say which road is the bridge; a network that lost its heights does not.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path

import numpy as np
import shapely

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Floats, Ints, frozen
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Network
from sumo3dviz_pt.sumo import values

logger = logging.getLogger(__name__)


class Oddity(Enum):
    """What is odd, for one object and for several, and what is done about it."""

    SHORT = ("lane shorter than 10 cm", "lanes shorter than 10 cm", "left as given")
    NARROW = ("lane narrower than 10 cm", "lanes narrower than 10 cm", "left as given")
    NO_WIDTH = ("lane without a width", "lanes without a width", "drawn 3.2 m wide")
    NO_LENGTH = (
        "lane without a length above 0",
        "lanes without a length above 0",
        "measured along the shape",
    )
    NO_SHAPE = ("lane without a shape", "lanes without a shape", "drawn straight from end to end")
    REVERSING = (
        "lane that doubles back on itself",
        "lanes that double back on themselves",
        "drawn as given",
    )
    NO_LANE = ("edge without lanes", "edges without lanes", "left out")
    NO_PLACE = ("junction without a place", "junctions without a place", "put into its shape")
    NO_OUTLINE = (
        "junction without an outline",
        "junctions without an outline",
        "drawn by the lanes alone",
    )
    CROSSED_JUNCTION = (
        "junction whose outline crosses itself",
        "junctions whose outlines cross themselves",
        "all that the lines enclose is drawn",
    )
    CROSSED_AREA = (
        "walking area whose outline crosses itself",
        "walking areas whose outlines cross themselves",
        "all that the lines enclose is drawn",
    )
    NO_AREA = (
        "walking area of fewer than 3 points",
        "walking areas of fewer than 3 points",
        "not drawn",
    )


@dataclass(slots=True)
class Oddities:
    """What is odd in a network: how often, and where first."""

    counts: dict[Oddity, int] = field(default_factory=dict)
    firsts: dict[Oddity, str] = field(default_factory=dict)

    def add(self, oddity: Oddity, own: str) -> None:
        """Count one more object by its id."""
        self.counts[oddity] = self.counts.get(oddity, 0) + 1
        self.firsts.setdefault(oddity, own)

    @property
    def sentence(self) -> str:
        """All of it in one sentence; empty where nothing is odd."""
        parts = []
        for oddity in Oddity:
            count = self.counts.get(oddity, 0)
            if count:
                one, many, done = oddity.value
                what = one if count == 1 else many
                parts.append(f"{count} {what}, {done} (first: `{cut(self.firsts[oddity])}`)")
        return "the network has " + "; ".join(parts) if parts else ""

    def say(self, file: Path) -> None:
        """Note it, if there is anything to note.

        Args:
            file: The network's file.
        """
        if self.counts:
            once = {"once": f"oddities of {file}"}
            logger.warning("%s: %s", file, self.sentence, extra=once)


_SMALL = 0.1
"""Length or width of a lane below which it is odd [m]."""

_REVERSED = np.cos(np.radians(175.0))
"""Cosine of the smallest turn by which a lane doubles back."""

_CROSSED = (0.1, 1.0)
"""Enclosed ground that an outline walks round the wrong way, as a share and [m2], to be odd."""

_NO_GROUND = frozenset({"dead_end", "internal"})
"""Types of junctions that need no outline."""


def look_over(network: Network, oddities: Oddities) -> None:
    """Add what is odd in the geometry of a network.

    Args:
        network: The network, whose lanes all have a shape.
        oddities: What was found before; it grows.
    """
    for edge in network.edges.values():
        for lane in edge.lanes:
            if edge.function == "walkingarea":
                _look_at_area(lane, oddities)
            else:
                _look_at_lane(lane, edge, oddities)
    left_by = {edge.from_junction for edge in network.edges.values()}
    for junction in network.junctions.values():
        joins = bool(junction.incoming_lanes) and junction.id in left_by
        _look_at_junction(junction, oddities, joins=joins)


def _look_at_lane(lane: Lane, edge: Edge, oddities: Oddities) -> None:
    """Add what is odd in a lane that leads from one end to another."""
    if lane.width < _SMALL:
        oddities.add(Oddity.NARROW, lane.id)
    steps = np.diff(lane.shape[:, :2], axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    if lengths.sum() < _SMALL:
        if edge.function != "internal":
            oddities.add(Oddity.SHORT, lane.id)
    elif edge.function == "normal" and _reverses(steps[lengths > 0.0]):
        oddities.add(Oddity.REVERSING, lane.id)


def _reverses(steps: Floats) -> bool:
    """Return whether a way turns back on itself at a vertex; steps are (n, 2) [m], none is 0."""
    ways = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    return bool(((ways[1:] * ways[:-1]).sum(axis=1) < _REVERSED).any())


def _look_at_area(lane: Lane, oddities: Oddities) -> None:
    """Add what is odd in a walking area."""
    if len(lane.shape) < 3:
        oddities.add(Oddity.NO_AREA, lane.id)
    elif _crosses_itself(lane.shape):
        oddities.add(Oddity.CROSSED_AREA, lane.id)


def _look_at_junction(junction: Junction, oddities: Oddities, *, joins: bool) -> None:
    """Add what is odd in the outline of a junction; `joins` tells whether roads go on there."""
    if junction.type in _NO_GROUND:
        return
    if len(junction.outline) < 3:
        if joins:
            oddities.add(Oddity.NO_OUTLINE, junction.id)
    elif _crosses_itself(junction.outline):
        oddities.add(Oddity.CROSSED_JUNCTION, junction.id)


def _crosses_itself(outline: Floats) -> bool:
    """Return whether an outline, (n, 3) [m], walks round much of its ground the wrong way."""
    polygon = shapely.Polygon(outline[:, :2])
    if polygon.is_valid:
        return False
    ground = shapely.make_valid(polygon).area
    lost = abs(ground - polygon.area)
    return bool(lost > _CROSSED[1] and lost > _CROSSED[0] * ground)


DEFAULT_LANE_WIDTH = 3.2
"""SUMO's lane width where the file gives none [m]."""

_NARROWEST = 0.01
"""A lane with a smaller width has none [m]."""

SHORTEST = 0.01
"""Length of a lane of which only one point is known [m]."""

_NO_POINTS = frozen(np.empty((0, 3)))


def whole_lane(lane: Lane, oddities: Oddities, *, drawn: float, stated: bool) -> Lane:
    """Return a lane with a width and a length, and note what it lacks.

    Args:
        lane: As the file says.
        oddities: What is odd; it grows.
        drawn: Length of its shape [m]; 0 where it has none.
        stated: Whether the file gives a length.
    """
    width, length = lane.width, lane.length
    if width < _NARROWEST:
        # SUMO writes -1 for lanes of the usual width.
        if width != values.LANE_WIDTH.low:
            oddities.add(Oddity.NO_WIDTH, lane.id)
        width = DEFAULT_LANE_WIDTH
    if length < values.SHORTEST_LANE:
        if stated:
            oddities.add(Oddity.NO_LENGTH, lane.id)
        length = drawn
    return replace(lane, width=width, length=length)


class LaneEnds:
    """Finds where lanes without a shape begin and end.

    Args:
        edges: By id; lanes without a shape have no points.
        junctions: By id.
        connections: All of them.
        left_hand: Whether traffic keeps left.
    """

    def __init__(
        self,
        edges: Mapping[str, Edge],
        junctions: Mapping[str, Junction],
        connections: Sequence[Connection],
        *,
        left_hand: bool,
    ) -> None:
        self._junctions = junctions
        self._shapes = {lane.id: lane.shape for edge in edges.values() for lane in edge.lanes}
        self._side = -1.0 if left_hand else 1.0
        self._before: dict[str, str] = {}
        self._after: dict[str, str] = {}
        for link in connections:
            for lane in filter(None, (link.via, link.to_lane)):
                self._before.setdefault(lane, link.from_lane)
            for lane in (link.from_lane, link.via):
                self._after.setdefault(lane, link.to_lane)

    def mended(self, edge: Edge, oddities: Oddities) -> Edge | None:
        """Return an edge whose lanes all have a shape; None where nothing tells it.

        Lanes that get one are added to the oddities.
        """
        lanes: list[Lane] = []
        for lane in edge.lanes:
            known = lane if len(lane.shape) else self._with_shape(lane, edge)
            if known is None:
                return None
            if known is not lane and edge.function != "walkingarea":
                oddities.add(Oddity.NO_SHAPE, lane.id)
            lanes.append(known)
        return replace(edge, lanes=tuple(lanes))

    def _with_shape(self, lane: Lane, edge: Edge) -> Lane | None:
        """Return a lane without a shape with one; None where nothing tells where it is."""
        line = self._between_junctions(lane, edge) if edge.function == "normal" else None
        line = self._between_lanes(lane) if line is None else line
        line = self._at_junction(edge) if line is None else line
        if line is None:
            return None
        length = float(np.linalg.norm(line[1] - line[0]))
        return replace(lane, shape=frozen(line), length=lane.length or max(length, SHORTEST))

    def _between_junctions(self, lane: Lane, edge: Edge) -> Floats | None:
        """Return the line between an edge's junctions, moved aside to the lane's place."""
        ends = [self._junctions.get(name) for name in (edge.from_junction, edge.to_junction)]
        if ends[0] is None or ends[1] is None:
            return None
        line = np.array([ends[0].position, ends[1].position])
        way = (line[1] - line[0])[:2]
        length = float(np.hypot(*way))
        if length < SHORTEST:
            return None
        # SUMO puts the lanes beside the line between junctions, the outermost one farthest away.
        inner = sum(other.width for other in edge.lanes if other.index > lane.index)
        aside = self._side * (inner + 0.5 * lane.width) / length
        line[:, :2] += aside * np.array([way[1], -way[0]])
        return line

    def _between_lanes(self, lane: Lane) -> Floats | None:
        """Return the line from the lane before to the lane after."""
        before = self._shapes.get(self._before.get(lane.id, ""), _NO_POINTS)
        after = self._shapes.get(self._after.get(lane.id, ""), _NO_POINTS)
        if not len(before) or not len(after) or np.allclose(before[-1], after[0]):
            return None
        return np.array([before[-1], after[0]])

    def _at_junction(self, edge: Edge) -> Floats | None:
        """Return a line of 1 cm at the junction of an internal edge, as ids name it."""
        owner = edge.id[1:].rpartition("_")[0] if edge.id.startswith(":") else edge.from_junction
        junction = self._junctions.get(owner)
        return None if junction is None else from_point(junction.position)


def from_point(point: Floats, *, top: float | None = None) -> Floats:
    """Return a line of 1 cm from a point, (2, 3) [m], so that it has a direction.

    Args:
        point: Where it begins, (3,) [m].
        top: Height of its end [m]; default that of the point.
    """
    x, y, z = point.tolist()
    return np.array([[x, y, z], [x + SHORTEST, y, z if top is None else top]])


ROOM = 3.0
"""Roads with less height between them meet [m]; lorries are 4 m high, but decks may be crude."""

_SQUARE = float(np.sin(np.radians(15.0)))
"""Sine of the angle above which lanes cross; others run along each other, as tracks in streets."""

_NO_DRIVERS = frozenset({"pedestrian", "wheelchair", "ship", "aircraft", "cable_car", "subway"})
"""Who walks may cross a road anywhere; the others are above or below it."""


@dataclass(frozen=True, slots=True, eq=False)
class AtGrade:
    """A pair of roads that cross at one height without a junction.

    Attributes:
        first: Id of an edge.
        other: Id of the other.
        place: Where their lanes cross first, (3,) [m].
        height: Between them [m].
    """

    first: str
    other: str
    place: Floats
    height: float


def crossings_at_grade(network: Network) -> tuple[AtGrade, ...]:
    """Return the pairs of roads that cross at one height and share no junction.

    Args:
        network: Of any size.
    """
    lanes = [
        (edge, lane)
        for edge in network.edges.values()
        if edge.function == "normal"
        for lane in edge.lanes
        if len(lane.shape) > 1 and lane.allowed - _NO_DRIVERS
    ]
    if len(lanes) < 2:
        return ()
    pieces, owner = _pieces([lane for _, lane in lanes])
    lines = shapely.linestrings(pieces[..., :2])
    one, two = shapely.STRtree(lines).query(lines, predicate="intersects")
    apart = (owner[one] < owner[two]) & _crosswise(pieces[one], pieces[two])
    crossings: dict[tuple[str, str], AtGrade] = {}
    for a, b in zip(one[apart].tolist(), two[apart].tolist(), strict=True):
        first, other = lanes[owner[a]][0], lanes[owner[b]][0]
        if (first.id, other.id) in crossings or _joined(first, other):
            continue
        place, height = _meeting(pieces[a], pieces[b])
        if height < ROOM:
            crossings[first.id, other.id] = AtGrade(first.id, other.id, place, height)
    return tuple(crossings.values())


def say_at_grade(network: Network, file: Path) -> None:
    """Note where roads cross at one height, if they do.

    Args:
        network: As read.
        file: Its file.
    """
    crossings = crossings_at_grade(network)
    if not crossings:
        return
    first = crossings[0]
    x, y, _ = network.location.outside(first.place).tolist()
    more = f", and {len(crossings) - 1} more such pairs" if len(crossings) > 1 else ""
    logger.warning(
        "%s: `%s` and `%s` cross at (%.0f, %.0f) without a junction and with %.1f m of height"
        " between them%s: who drives there passes through others; give the upper road a height"
        " (z in its shape; for OpenStreetMap data, netconvert --osm.layer-elevation 6), or join"
        " the two in a junction",
        *(file, cut(first.first), cut(first.other), x, y, first.height, more),
        extra={"once": f"roads that cross in {file}"},
    )


def _pieces(lanes: list[Lane]) -> tuple[Floats, Ints]:
    """The straight pieces of lanes, (n, 2, 3) [m], and whose they are, (n,)."""
    pieces = [np.stack([lane.shape[:-1], lane.shape[1:]], axis=1) for lane in lanes]
    owner = np.repeat(np.arange(len(lanes)), [len(some) for some in pieces])
    return np.concatenate(pieces), owner


def _crosswise(some: Floats, others: Floats) -> Floats:
    """Which pieces cross at an angle, not along each other, (n,); pieces are (n, 2, 3) [m]."""
    a, b = (each[:, 1, :2] - each[:, 0, :2] for each in (some, others))
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return np.asarray(area > _SQUARE * np.hypot(*a.T) * np.hypot(*b.T))


def _joined(first: Edge, other: Edge) -> bool:
    """Whether two edges are one, or meet at a junction."""
    ends = {first.from_junction, first.to_junction}
    return first.id == other.id or bool(ends & {other.from_junction, other.to_junction})


def _meeting(piece: Floats, other: Floats) -> tuple[Floats, float]:
    """Where two pieces, (2, 3) [m], cross, (3,) [m], and the height between them there [m]."""
    way, across = piece[1] - piece[0], other[1] - other[0]
    area = way[0] * across[1] - way[1] * across[0]
    gap = other[0] - piece[0]
    place = piece[0] + (gap[0] * across[1] - gap[1] * across[0]) / area * way
    above = other[0] + (gap[0] * way[1] - gap[1] * way[0]) / area * across
    return place, float(abs(above[2] - place[2]))
