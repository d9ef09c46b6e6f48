"""Give a width, a length and a shape to lanes that have none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, frozen
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane
from sumo3dviz_pt.sumo import bounds
from sumo3dviz_pt.sumo.repairs.found import Oddities, Oddity

DEFAULT_LANE_WIDTH = 3.2
"""SUMO's lane width where the file gives none [m]."""

_NARROWEST = 0.01
"""A lane with a smaller width has none [m]."""

SHORTEST = 0.01
"""Length of a lane of which only one point is known [m]."""

_NO_POINTS = frozen(np.empty((0, 3)))


def whole_lane(lane: Lane, oddities: Oddities, *, drawn: float, given: bool) -> Lane:
    """Return a lane with a width and a length, and note what it lacks.

    Args:
        lane: As the file says.
        oddities: What is odd; it grows.
        drawn: Length of its shape [m]; 0 where it has none.
        given: Whether the file gives a length.
    """
    width, length = lane.width, lane.length
    if width < _NARROWEST:
        # SUMO writes -1 for lanes of the usual width.
        if width != bounds.LANE_WIDTH.low:
            oddities.add(Oddity.NO_WIDTH, lane.id)
        width = DEFAULT_LANE_WIDTH
    if length < bounds.SHORTEST_LANE:
        if given:
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
