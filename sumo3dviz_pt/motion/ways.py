"""The lanes of a network as a graph, and the way that a vehicle drove between two samples.

References:
    shared facts on motion, sections 4 and 5.1: candidates are ranked by how far their
    length is from the way that the speeds tell, plus 2 m for each change of lanes (6 m
    within a junction); lanes beside each other inside a junction differ in length, and
    keep the share of it.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.vectors import arc_length

_CHANGE_COST = {False: 6.0, True: 14.0}
"""What a change of lanes counts in the search, on a road and inside a junction [m]."""

_CHANGE_RANK = {False: 2.0, True: 6.0}
"""What it counts in the choice among the ways found [m]."""

_MOST_WAYS = 6
_MOST_STEPS = 4000
_MOST_VISITS = 3
_GRAIN = 15.0
"""Ways expected to be about equally long share a search [m]."""


@dataclass(frozen=True, slots=True)
class Hop:
    """A lane of a way.

    Attributes:
        lane: SUMO's id.
        beside: Whether it was reached by a change of lanes, not by driving on.
    """

    lane: str
    beside: bool = False


@dataclass(frozen=True, slots=True)
class Way:
    """Lanes that lead from one to another.

    Attributes:
        hops: From the first lane to the last, both included.
        length: From the beginning of the first lane to that of the last [m].
    """

    hops: tuple[Hop, ...]
    length: float


@dataclass(frozen=True, eq=False)
class Ways:
    """The graph of a network's lanes.

    Inside some junctions SUMO gives all lanes one length, whatever their shapes; here they
    are as long as they are drawn.

    Attributes:
        network: The roads.
    """

    network: Network
    _found: dict[tuple[str, str, int], tuple[Way, ...]] = field(default_factory=dict, init=False)
    _stations: dict[str, Floats] = field(default_factory=dict, init=False)
    _stretches: dict[str, float] = field(default_factory=dict, init=False)

    def __contains__(self, lane: str) -> bool:
        """Whether there is such a lane."""
        return lane in self.network.lanes

    def lane(self, name: str) -> Lane:
        """A lane by its id; it must exist."""
        return self.network.lanes[name]

    def length(self, name: str) -> float:
        """Length of a lane [m]: SUMO's, but inside junctions that of the drawn lane."""
        return self.network.lanes[name].length * self.stretch(name)

    def stretch(self, name: str) -> float:
        """How much longer a lane is than SUMO says; lanes of a road keep their common length."""
        if not self.inside(name):
            return 1.0
        if name not in self._stretches:
            lane = self.network.lanes[name]
            drawn = np.linalg.norm(np.diff(lane.shape, axis=0), axis=1).sum()
            self._stretches[name] = float(drawn) / max(lane.length, 1e-9)
        return self._stretches[name]

    def inside(self, name: str) -> bool:
        """Whether a lane lies inside a junction."""
        return name.startswith(":")

    def stations(self, name: str) -> Floats:
        """Places of a lane's points, from 0 to its length, (n,) [m]."""
        if name not in self._stations:
            shape = self.network.lanes[name].shape
            along = arc_length(shape)
            self._stations[name] = along * (self.length(name) / max(along[-1], 1e-9))
        return self._stations[name]

    @cached_property
    def onward(self) -> dict[str, tuple[str, ...]]:
        """Lanes that follow each lane."""
        found: dict[str, dict[str, None]] = defaultdict(dict)
        continued = {connection.from_lane for connection in self.network.connections}
        for connection in self.network.connections:
            found[connection.from_lane][connection.via or connection.to_lane] = None
            if connection.via and connection.via not in continued:
                found[connection.via][connection.to_lane] = None
        lanes = self.network.lanes
        return {name: tuple(n for n in others if n in lanes) for name, others in found.items()}

    @cached_property
    def before(self) -> dict[str, tuple[str, ...]]:
        """Lanes that lead to each lane."""
        found: dict[str, list[str]] = defaultdict(list)
        for name, others in self.onward.items():
            for other in others:
                found[other].append(name)
        return {name: tuple(others) for name, others in found.items()}

    def beside(self, name: str) -> tuple[str, ...]:
        """The lanes right and left of a lane on its edge."""
        lane = self.network.lanes[name]
        lanes = self.network.edges[lane.edge_id].lanes
        return tuple(other.id for other in lanes if abs(other.index - lane.index) == 1)

    def between(
        self, first: str, last: str, *, places: tuple[float, float], expected: float
    ) -> tuple[Way, float] | None:
        """The way that was driven from a place on one lane to a place on another.

        Args:
            first: The first lane.
            last: The last lane.
            places: Along both [m].
            expected: How long the way should be [m].

        Returns:
            The way, and how far it is from place to place [m]; None if there is none.
        """
        best: tuple[float, Way, float] | None = None
        for way in self._candidates(first, last, expected):
            start = places[0] * self._stretch(way)
            reach = way.length - start + places[1]
            changes = sum(_CHANGE_RANK[self.inside(hop.lane)] for hop in way.hops if hop.beside)
            rank = abs(reach - expected) + changes
            if best is None or rank < best[0]:
                best = (rank, way, reach)
        return None if best is None else best[1:]

    def _stretch(self, way: Way) -> float:
        """Length of the lane that a way leaves its first edge on, as a share of the first's."""
        left = way.hops[0].lane
        for hop in way.hops[1:]:
            if not hop.beside:
                break
            left = hop.lane
        return self.length(left) / max(self.length(way.hops[0].lane), 1e-9)

    def _candidates(self, first: str, last: str, expected: float) -> tuple[Way, ...]:
        """Some ways of about a length, searched once."""
        key = (first, last, int(expected / _GRAIN))
        if key not in self._found:
            limit = 1.5 * (key[2] + 1) * _GRAIN + 40.0 + self.length(first)
            self._found[key] = tuple(self._search(first, last, limit))
        return self._found[key]

    def _search(self, first: str, last: str, limit: float) -> Iterator[Way]:
        """Ways in the order of their cost (Dijkstra; a lane may be passed more than once)."""
        queue: list[tuple[float, float, int, tuple[Hop, ...]]] = [(0.0, 0.0, 0, (Hop(first),))]
        visits: dict[str, int] = defaultdict(int)
        found = number = 0
        while queue and found < _MOST_WAYS and number < _MOST_STEPS:
            cost, length, _, hops = heapq.heappop(queue)
            name = hops[-1].lane
            if name == last and len(hops) > 1:
                found += 1
                yield Way(hops, length)
                continue
            visits[name] += 1
            if visits[name] > _MOST_VISITS or length > limit:
                continue
            for hop, extra, way in self._steps(hops):
                number += 1
                heapq.heappush(queue, (cost + extra, length + way, number, (*hops, hop)))

    def _steps(self, hops: Sequence[Hop]) -> Iterator[tuple[Hop, float, float]]:
        """Next lanes with their cost and length [m]."""
        name = hops[-1].lane
        ahead = self.length(name)
        for other in self.onward.get(name, ()):
            yield Hop(other), ahead, ahead
        passed = {hop.lane for hop in hops}
        for other in self.beside(name):
            if other not in passed:
                yield Hop(other, beside=True), _CHANGE_COST[self.inside(other)], 0.0
