"""The lanes of a network as a graph, and the route that a vehicle drove between two samples.

A route is a sequence of lanes. Several routes can lead from one sample to the next. They are
ranked by how far their length is from the distance that the logged speeds tell, plus 2 m for each
change of lanes (6 m inside a junction). Lanes beside each other inside a junction differ in
length; a vehicle that changes between them keeps its share of the length.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.model.vectors import arc_length

_CHANGE_COST = {False: 6.0, True: 14.0}
"""Cost of a change of lanes in the search, on a road and inside a junction [m]."""

_CHANGE_RANK = {False: 2.0, True: 6.0}
"""The same in the choice among the routes that were found [m]."""

_MOST_ROUTES = 6
"""A search ends when it has found this many routes, ..."""

_MOST_STEPS = 4000
"""... or when it has looked at this many steps from lane to lane."""

_MOST_VISITS = 3
"""A search goes on from a lane at most this many times."""

_GRAIN = 15.0
"""Routes whose expected lengths fall into the same interval of this length share a search [m]."""


@dataclass(frozen=True, slots=True)
class Hop:
    """One lane of a route.

    Attributes:
        lane: SUMO's lane id.
        beside: Whether it was reached by a change of lanes, not by driving on.
    """

    lane: str
    beside: bool = False


@dataclass(frozen=True, slots=True)
class Route:
    """Lanes that lead from one lane to another.

    Attributes:
        hops: The lanes from the first to the last, both included.
        length: Distance from the beginning of the first lane to that of the last [m].
    """

    hops: tuple[Hop, ...]
    length: float


class _Partial(NamedTuple):
    """The beginning of a route in a search; the search goes on from the cheapest.

    Attributes:
        cost: Length plus what the changes of lanes cost [m].
        length: Length without the last lane [m].
        number: Number of the step that made it; decides between equals.
        hops: The lanes of the route up to now.
    """

    cost: float
    length: float
    number: int
    hops: tuple[Hop, ...]


@dataclass(frozen=True, eq=False)
class LaneGraph:
    """The graph of a network's lanes.

    Inside some junctions SUMO gives all lanes the same length, whatever their shapes. Here
    these lanes are as long as they are drawn.

    Attributes:
        network: The road network.
    """

    network: Network
    _found: dict[tuple[str, str, int], tuple[Route, ...]] = field(default_factory=dict, init=False)
    _stations: dict[str, Floats] = field(default_factory=dict, init=False)
    _stretches: dict[str, float] = field(default_factory=dict, init=False)

    def __contains__(self, lane: str) -> bool:
        """Whether there is such a lane."""
        return lane in self.network.lanes

    def lane(self, name: str) -> Lane:
        """Return a lane by its id; it must exist."""
        return self.network.lanes[name]

    def length(self, name: str) -> float:
        """Return the length of a lane [m]: SUMO's on roads, that of the drawn lane in junctions."""
        return self.network.lanes[name].length * self.stretch(name)

    def stretch(self, name: str) -> float:
        """Return a lane's length as a multiple of SUMO's; 1 outside junctions."""
        if not self.inside(name):
            return 1.0
        if name not in self._stretches:
            lane = self.network.lanes[name]
            drawn = np.linalg.norm(np.diff(lane.shape, axis=0), axis=1).sum()
            self._stretches[name] = float(drawn) / max(lane.length, 1e-9)
        return self._stretches[name]

    def inside(self, name: str) -> bool:
        """Return whether a lane lies inside a junction."""
        return name.startswith(":")

    def stations(self, name: str) -> Floats:
        """Return the stations of a lane's points, from 0 to its length, (n,) [m]."""
        if name not in self._stations:
            shape = self.network.lanes[name].shape
            along = arc_length(shape)
            self._stations[name] = along * (self.length(name) / max(along[-1], 1e-9))
        return self._stations[name]

    @cached_property
    def onward(self) -> dict[str, tuple[str, ...]]:
        """The lanes that follow each lane."""
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
        """The lanes that lead to each lane."""
        found: dict[str, list[str]] = defaultdict(list)
        for name, others in self.onward.items():
            for other in others:
                found[other].append(name)
        return {name: tuple(others) for name, others in found.items()}

    def beside(self, name: str) -> tuple[str, ...]:
        """Return the lanes right and left of a lane on its edge."""
        lane = self.network.lanes[name]
        lanes = self.network.edges[lane.edge_id].lanes
        return tuple(other.id for other in lanes if abs(other.index - lane.index) == 1)

    def between(
        self, first: str, last: str, *, places: tuple[float, float], expected: float
    ) -> tuple[Route, float] | None:
        """Return the route that was driven from a place on one lane to a place on another.

        Args:
            first: Id of the first lane.
            last: Id of the last lane.
            places: Places along the first and the last lane [m].
            expected: Distance that the route should have from place to place [m].

        Returns:
            The route and its distance from place to place [m]; None if there is no route.
        """
        best: tuple[float, Route, float] | None = None
        for route in self._candidates(first, last, expected):
            start = places[0] * self._stretch(route)
            reach = route.length - start + places[1]
            changes = sum(_CHANGE_RANK[self.inside(hop.lane)] for hop in route.hops if hop.beside)
            rank = abs(reach - expected) + changes
            if best is None or rank < best[0]:
                best = (rank, route, reach)
        return None if best is None else best[1:]

    def _stretch(self, route: Route) -> float:
        """Return the length of the lane that leaves a route's first edge over that of the first."""
        left = route.hops[0].lane
        for hop in route.hops[1:]:
            if not hop.beside:
                break
            left = hop.lane
        return self.length(left) / max(self.length(route.hops[0].lane), 1e-9)

    def _candidates(self, first: str, last: str, expected: float) -> tuple[Route, ...]:
        """Return some routes of about a length [m]; each search is made once."""
        key = (first, last, int(expected / _GRAIN))
        if key not in self._found:
            limit = 1.5 * (key[2] + 1) * _GRAIN + 40.0 + self.length(first)
            self._found[key] = tuple(self._search(first, last, limit))
        return self._found[key]

    def _search(self, first: str, last: str, limit: float) -> Iterator[Route]:
        """Yield routes by cost (Dijkstra's algorithm; a lane may be passed more than once)."""
        queue = [_Partial(0.0, 0.0, 0, (Hop(first),))]
        visits: dict[str, int] = defaultdict(int)
        found = number = 0
        while queue and found < _MOST_ROUTES and number < _MOST_STEPS:
            cost, length, _, hops = heapq.heappop(queue)
            name = hops[-1].lane
            if name == last and len(hops) > 1:
                found += 1
                yield Route(hops, length)
                continue
            visits[name] += 1
            if visits[name] > _MOST_VISITS or length > limit:
                continue
            for hop, extra, ahead in self._steps(hops):
                number += 1
                longer = _Partial(cost + extra, length + ahead, number, (*hops, hop))
                heapq.heappush(queue, longer)

    def _steps(self, hops: Sequence[Hop]) -> Iterator[tuple[Hop, float, float]]:
        """Yield the next lanes, the cost of going there, and the length driven for that [m]."""
        name = hops[-1].lane
        ahead = self.length(name)
        for other in self.onward.get(name, ()):
            yield Hop(other), ahead, ahead
        passed = {hop.lane for hop in hops}
        for other in self.beside(name):
            if other not in passed:
                yield Hop(other, beside=True), _CHANGE_COST[self.inside(other)], 0.0
