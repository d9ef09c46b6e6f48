"""The lanes of a network as a graph, and the centre lines along chains of them.

The graph finds the route that a vehicle drove between two samples: a sequence of lanes. Several
routes can lead from one sample to the next. They are ranked by how far their length is from the
distance that the logged speeds tell, plus 2 m for each change of lanes (6 m inside a junction).
Lanes beside each other inside a junction differ in length; a vehicle that changes between them
keeps its share of the length.

SUMO's lanes are polylines. An average along their length makes them smooth to the second
derivative, but moves them inward in bends. So the average is taken twice over: what the first one
took away is averaged too, and added ("twicing"). For a polyline all of it has a closed form: each
corner bends the line within reach of it, and nothing else changes.

References:
    J. W. Tukey, Exploratory Data Analysis, 1977, chapter 16 (twicing): 2 K - K * K has no
    second moment, so that arcs stay where they are. A plain triangle of 2 m would move a bend
    of 8 m radius by 4 cm, and its headings are half as accurate at the same jerk
    (docs/internals/motion.md).
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, arc_length
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.motion.front import cubic
from sumo3dviz_pt.motion.samples import Places

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

_GRAPH_GRAIN = 15.0
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
        following: dict[str, dict[str, None]] = defaultdict(dict)
        continued = {connection.from_lane for connection in self.network.connections}
        for connection in self.network.connections:
            following[connection.from_lane][connection.via or connection.to_lane] = None
            if connection.via and connection.via not in continued:
                following[connection.via][connection.to_lane] = None
        lanes = self.network.lanes
        return {name: tuple(n for n in others if n in lanes) for name, others in following.items()}

    @cached_property
    def before(self) -> dict[str, tuple[str, ...]]:
        """The lanes that lead to each lane."""
        before: dict[str, list[str]] = defaultdict(list)
        for name, others in self.onward.items():
            for other in others:
                before[other].append(name)
        return {name: tuple(others) for name, others in before.items()}

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
        key = (first, last, int(expected / _GRAPH_GRAIN))
        if key not in self._found:
            limit = 1.5 * (key[2] + 1) * _GRAPH_GRAIN + 40.0 + self.length(first)
            self._found[key] = tuple(self._search(first, last, limit))
        return self._found[key]

    def _search(self, first: str, last: str, limit: float) -> Iterator[Route]:
        """Yield routes by cost (Dijkstra's algorithm; a lane may be passed more than once)."""
        queue = [_Partial(0.0, 0.0, 0, (Hop(first),))]
        visits: dict[str, int] = defaultdict(int)
        count = number = 0
        while queue and count < _MOST_ROUTES and number < _MOST_STEPS:
            cost, length, _, hops = heapq.heappop(queue)
            name = hops[-1].lane
            if name == last and len(hops) > 1:
                count += 1
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


TIGHTEST, WIDEST = 2.25, 10.0
"""Half the width of the averaging triangle at corners and at faint bends [m]."""

_BEND = 0.3
"""Half width times bend of the triangle where a corner is not tight [m].

Such a corner is cut by a tenth of this, 3 cm.
"""

REACH = 2.0 * WIDEST
"""Further from a bend than this the rounded line is the polyline itself [m]."""

_TOUCHING = 1e-6
"""Smallest distance between points of a track [m]."""

_TRACK_GRAIN = 0.5
"""Distance between the knots of the rounded line [m]."""

_STRAIGHT = 1e-5
"""Fainter bends count as straight [rad]."""

_RAMP = 4.0
"""Lanes that do not join are bent towards each other over this length [m].

Over gaps wider than 1 m, the length is this many times the gap.
"""

_JOG_REACH, _JOG = 4.0, 0.6
"""Corners within the first distance of each other that lead aside by less than the second are no
bend [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Bends:
    """Corners that are rounded together.

    Attributes:
        stations: Stations of the corners, rising, (n,) [m].
        bends: Changes of tangent, (n, 3).
        widths: Half the width of the triangle at each, (n,) [m].
        reach: Twice the largest of them [m].
    """

    stations: Floats
    bends: Floats
    widths: Floats
    reach: float

    def add(self, stations: Floats, points: Floats, tangents: Floats) -> None:
        """Round a line in place.

        Args:
            stations: (m,) [m].
            points: Points of the line at the stations, (m, 3) [m]; they change.
            tangents: Its derivatives there, (m, 3); they change.
        """
        first = np.searchsorted(self.stations, stations - self.reach, side="right")
        last = np.searchsorted(self.stations, stations + self.reach, side="left")
        for step in range(int((last - first).max(initial=0))):
            near = np.flatnonzero(first + step < last)
            corner = first[near] + step
            away = stations[near] - self.stations[corner]
            moved, turned = _rounded(np.abs(away), self.widths[corner])
            bends = self.bends[corner]
            points[near] += moved[:, None] * bends
            tangents[near] += np.where(away < 0.0, -turned, turned)[:, None] * bends


@dataclass(frozen=True, slots=True, eq=False)
class Polyline:
    """A polyline by station, and the rounded line.

    Attributes:
        stations: Stations of the points, strictly increasing, (n,) [m], n >= 2.
        points: (n, 3) [m].
        tangents: Derivatives of the stretches between points, (n - 1, 3).
        knots: Evenly spaced, they cover the stations and `REACH` beyond, (m,) [m].
        rounded: Points and derivatives of the rounded line at the knots, (6, m).
    """

    stations: Floats
    points: Floats
    tangents: Floats = field(init=False)
    knots: Floats = field(init=False)
    rounded: Floats = field(init=False)

    def __post_init__(self) -> None:
        """Round the line once for all vehicles on these lanes."""
        tangents = np.diff(self.points, axis=0) / np.diff(self.stations)[:, None]
        object.__setattr__(self, "tangents", tangents)
        count = (
            int(np.ceil((self.stations[-1] - self.stations[0] + 2.0 * REACH) / _TRACK_GRAIN)) + 1
        )
        knots = self.stations[0] - REACH + _TRACK_GRAIN * np.arange(count)
        points, ahead = (part.copy() for part in self.corners_at(knots))
        for bends in _bends(self.stations[1:-1], np.diff(tangents, axis=0)):
            bends.add(knots, points, ahead)
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "rounded", np.concatenate([points.T, ahead.T]))

    def corners_at(self, stations: Floats) -> tuple[Floats, Floats]:
        """Return points and derivatives of the unrounded polyline, (m, 3) each."""
        index = np.searchsorted(self.stations[1:-1], stations, side="right")
        tangents = self.tangents[index]
        return self.points[index] + (stations - self.stations[index])[:, None] * tangents, tangents

    def at(self, stations: Floats) -> tuple[Floats, Floats]:
        """Return points and derivatives of the rounded line, (m, 3) each.

        Beyond both ends the line goes straight on. Between knots it is a cubic Hermite curve,
        which is at most 0.2 mm off the average itself.
        """
        inside = np.minimum(np.maximum(stations, self.knots[0]), self.knots[-1])
        place = (inside - self.knots[0]) / _TRACK_GRAIN
        index = np.minimum(place.astype(np.intp), len(self.knots) - 2)
        here = self.rounded.take(index, axis=1)
        there = self.rounded.take(index + 1, axis=1)
        rise, first, last = there[:3] - here[:3], _TRACK_GRAIN * here[3:], _TRACK_GRAIN * there[3:]
        moved, rates = cubic(place - index, rise, first, last)
        tangents = rates / _TRACK_GRAIN
        return (here[:3] + moved + (stations - inside) * tangents).T, tangents.T


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A chain of lanes that begins at a station.

    Attributes:
        line: The line along the lanes; its stations count from 0.
        begin: Station of its beginning [m].
    """

    line: Polyline
    begin: float

    def corners_at(self, stations: Floats) -> tuple[Floats, Floats]:
        """Return points and derivatives of the lanes' own polylines, (m, 3) each."""
        return self.line.corners_at(stations - self.begin)

    def at(self, stations: Floats) -> tuple[Floats, Floats]:
        """Return points and derivatives of the rounded line, (m, 3) each."""
        return self.line.at(stations - self.begin)


class Tracks:
    """Centre lines of a network's lanes; each is made when it is first needed."""

    def __init__(self, graph: LaneGraph) -> None:
        self.graph = graph
        self._lines: dict[tuple[str, ...], Polyline] = {}

    def along(self, chain: Sequence[tuple[str, float]]) -> Track:
        """Return the centre line along lanes.

        Args:
            chain: Each lane and the station of its beginning, in order.
        """
        names = tuple(name for name, _ in chain)
        begin = chain[0][1]
        if names not in self._lines:
            self._lines[names] = _polyline(self.graph, [(n, at - begin) for n, at in chain])
        return Track(self._lines[names], begin)


def _bends(stations: Floats, turned: Floats) -> Iterator[_Bends]:
    """Yield tight corners, then faint ones, from stations, (n,), and changes of tangent, (n, 3)."""
    size = np.linalg.norm(turned, axis=1)
    around = np.maximum(_turning(stations, turned, size), 1e-9)
    widths = np.clip(_BEND / around, TIGHTEST, WIDEST)
    widths = np.where(around > 1.0, TIGHTEST / around, widths)
    for chosen in (widths <= TIGHTEST, (widths > TIGHTEST) & (size > _STRAIGHT)):
        if chosen.any():
            reach = 2.0 * float(widths[chosen].max())
            yield _Bends(stations[chosen], turned[chosen], widths[chosen], reach)


def _turning(stations: Floats, turned: Floats, size: Floats) -> Floats:
    """Return how much the line turns around each corner, (n,) [rad].

    A bend that is drawn with many points can be tight although each corner is faint. A jog
    turns back at once; if it leads aside by little, it counts as straight.
    """
    around = _sums(size[:, None], *_near(stations, TIGHTEST))[:, 0]
    near = _near(stations, _JOG_REACH)
    net = _sums(turned, *near)
    aside = _sums(turned * stations[:, None], *near) - net * stations[:, None]
    net, aside = np.linalg.norm(net, axis=1), np.linalg.norm(aside, axis=1)
    jog = (aside < _JOG) & (net < around / 2.0)
    return np.where(jog, net, around)


def _near(stations: Floats, reach: float) -> tuple[Places, Places]:
    """Return for each station the first index within reach and the first beyond, (n,) each."""
    return (
        np.searchsorted(stations, stations - reach, side="left"),
        np.searchsorted(stations, stations + reach, side="right"),
    )


def _sums(values: Floats, first: Places, last: Places) -> Floats:
    """Return sums of rows from `first` to before `last`, (n, k)."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    return np.asarray(total[last] - total[first])


def _rounded(away: Floats, widths: Floats) -> tuple[Floats, Floats]:
    """Return what rounding adds to a ramp that begins at 0, and the rate of that, (n,) each.

    A ramp that is averaged with the B-spline of order 2 or 4 (the triangle, and the triangle
    twice) exceeds itself by truncated powers of the distance from its beginning.

    Args:
        away: Distance from the beginning of the ramp, (n,) [m], >= 0.
        widths: Half widths of the triangles, (n,) [m].
    """
    share = away / widths
    near, far = np.maximum(1.0 - share, 0.0), np.maximum(2.0 - share, 0.0)
    moved = near**3 / 3.0 - (far**5 - 4.0 * near**5) / 120.0
    turned = (far**4 - 4.0 * near**4) / 24.0 - near**2
    return widths * moved, turned


def _polyline(graph: LaneGraph, lanes: Sequence[tuple[str, float]]) -> Polyline:
    """Join lanes, given with the stations of their beginnings, to one polyline.

    Where two lanes leave a gap, both are bent towards its middle.
    """
    stations = [graph.stations(name) + begin for name, begin in lanes]
    points = [graph.lane(name).shape for name, _ in lanes]
    for number in range(len(lanes) - 1):
        gap = points[number + 1][0] - points[number][-1]
        if np.linalg.norm(gap) > _TOUCHING:
            _join(stations, points, number, gap)
    along = np.concatenate(stations)
    # One lane begins where the one before it ends; of two points at one station the first counts.
    apart = np.concatenate([[True], along[1:] > np.maximum.accumulate(along)[:-1] + _TOUCHING])
    return Polyline(along[apart], np.concatenate(points)[apart])


def _join(stations: list[Floats], points: list[Floats], number: int, gap: Floats) -> None:
    """Bend two lanes towards the middle of a gap, each over at most half its length."""
    ramp = max(_RAMP, _RAMP * float(np.linalg.norm(gap)))
    for lane, end, share in ((number, -1, 0.5), (number + 1, 0, -0.5)):
        along, shape = stations[lane], points[lane]
        cut = min(ramp, (along[-1] - along[0]) / 2.0)
        places = np.union1d(along, [along[end] + (cut if end == 0 else -cut)])
        bent = np.stack([np.interp(places, along, axis) for axis in shape.T], axis=1)
        weight = np.maximum(1.0 - np.abs(places - along[end]) / max(cut, 1e-9), 0.0)
        stations[lane], points[lane] = places, bent + share * weight[:, None] * gap
