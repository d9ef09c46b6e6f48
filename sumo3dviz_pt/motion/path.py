"""The lanes that a road user drove along, and the path of such a run.

A run is a row of samples whose lanes are known. It consists of chains: lanes that lead into one
another. A change of lanes begins the next chain. All chains of a run share one arc length, the
station, because SUMO counts positions alike on all lanes of an edge.

The path is the first track plus, for each change of lanes, the eased difference to the next track.
As it depends on the station only, nothing slides sideways while it stands.

A change of lanes that SUMO makes in one step becomes a move of 4 s whose sideways acceleration
begins and ends at zero. The move takes longer where the vehicle would drive less than four times
the move's width in 4 s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.motion.front import Hermite, eased, eased_rate
from sumo3dviz_pt.motion.lanes import REACH, LaneGraph, Route, Track, Tracks
from sumo3dviz_pt.motion.manoeuvres import AROUND, LEAST_AHEAD
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting

_BACKWARD = 0.3
"""Offsets along a lane may fall by this much without meaning anything [m]."""

_FARTHEST_ASIDE, _FARTHEST_ALONG = 4.0, 1.0
"""A sample is not on its lane if it is further than this from its place there [m]."""


class ChainLane(NamedTuple):
    """A lane of a chain.

    Attributes:
        name: SUMO's lane id.
        begin: Station of its beginning [m].
    """

    name: str
    begin: float


LaneChain = list[ChainLane]
"""Lanes that lead into one another, in order."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A change of lanes between two samples.

    Attributes:
        step: Number of the sample before it.
        share: Its assumed time as a share of the step to the next sample, in (0, 1).
    """

    step: int
    share: float


@dataclass(slots=True, eq=False)
class LaneRun:
    """Samples whose lanes are known without a gap; it grows sample by sample.

    Attributes:
        first: Number of its first sample.
        stations: Stations of its samples [m].
        chains: Lanes that it drove along, at least one chain.
        own: Number of each sample's chain.
        switches: Changes of lanes, one between each chain and the next; their steps count
            from the run's first sample.
    """

    first: int
    stations: list[float]
    chains: list[LaneChain]
    own: list[int] = field(default_factory=lambda: [0])
    switches: list[Switch] = field(default_factory=list)

    def drive(self, station: float) -> None:
        """Add a sample on the current chain at a station [m]."""
        self.stations.append(max(station, self.stations[-1]))
        self.own.append(len(self.chains) - 1)

    def follow(self, graph: LaneGraph, route: Route, place: float) -> None:
        """Add a sample at the end of a route.

        Args:
            graph: The lanes.
            route: The route from the lane of the sample before to that of the new one.
            place: Place of the new sample along its lane [m].
        """
        step, changes = len(self.stations) - 1, sum(hop.beside for hop in route.hops)
        name, begin = self.chains[-1][-1]
        made = 0
        for number, hop in enumerate(route.hops[1:], 1):
            if hop.beside:
                made += 1
                if all(other.beside for other in route.hops[1:number]):
                    # Lanes beside each other inside a junction differ in length.
                    longer = graph.length(hop.lane) / max(graph.length(name), 1e-9)
                    begin += (self.stations[-1] - begin) * (1.0 - longer)
                self.chains.append([])
                self.switches.append(Switch(step, made / (changes + 1)))
            else:
                begin += graph.length(name)
            self.chains[-1].append(ChainLane(hop.lane, begin))
            name = hop.lane
        self.drive(begin + place)

    @property
    def last(self) -> int:
        """Number of its last sample."""
        return self.first + len(self.stations) - 1


def follow(
    samples: LoggedSamples, setting: Setting, *, trusted: bool = False
) -> tuple[list[LaneRun], dict[int, str]]:
    """Find the lanes that a stretch of samples drove along.

    Args:
        samples: Samples whose offsets count in metres of the drawn lanes.
        setting: What is known of the lanes.
        trusted: Whether samples are taken to be where their lanes and offsets say.

    Returns:
        Runs of two samples or more, in order; and for each step that lies in none of them the
        reason, by the number of the step's first sample.
    """
    graph = setting.graph
    if graph is None:
        return [], dict.fromkeys(range(len(samples.times) - 1), "no lanes")
    on = _named(samples, setting, graph)
    if not trusted:
        on &= _on_lanes(samples, setting, graph)
    runs: list[LaneRun] = []
    failed: dict[int, str] = {}
    run: LaneRun | None = None
    for step, reason, route in _steps(samples, setting, graph, on):
        if reason:
            failed[step] = reason
            run = None
            continue
        here, there = float(samples.offsets[step]), float(samples.offsets[step + 1])
        if run is None:
            name = setting.lane_names[samples.lanes[step]]
            run = LaneRun(step, [here], [[ChainLane(name, 0.0)]])
            runs.append(run)
        if route is None:
            run.drive(run.chains[-1][-1].begin + there)
        else:
            run.follow(graph, route, there)
    return runs, failed


def stretches_of(samples: LoggedSamples, setting: Setting, graph: LaneGraph) -> Floats:
    """Return the drawn length of each sample's lane as a multiple of SUMO's length, (n,).

    Args:
        samples: n samples.
        setting: Says what the samples' lanes are called.
        graph: The lanes.
    """
    factors = np.ones(len(samples.times))
    for lane, which in _groups(samples.lanes):
        name = setting.lane_names[lane] if lane >= 0 else ""
        if name in graph:
            factors[which] = graph.stretch(name)
    return factors


class _Step(NamedTuple):
    """What leads from one sample to the next.

    Attributes:
        number: Number of the first of the two samples.
        reason: Why no route is known; empty where one is.
        route: The route to another lane; None where the step stays on its lane.
    """

    number: int
    reason: str
    route: Route | None = None


def _steps(
    samples: LoggedSamples, setting: Setting, graph: LaneGraph, on: Bools
) -> Iterator[_Step]:
    """Yield what leads from each sample to the next; `on` says which samples are on lanes."""
    moved = np.diff(samples.offsets)
    stays = (np.diff(samples.lanes) == 0) & (moved >= -_BACKWARD) & on[:-1] & on[1:]
    expected = expected_distances(samples, euler=setting.euler)
    for step in range(len(moved)):
        if stays[step]:
            yield _Step(step, "")
        elif samples.lanes[step] < 0 or samples.lanes[step + 1] < 0:
            yield _Step(step, "no lanes")
        elif not (on[step] and on[step + 1]):
            yield _Step(step, "off lane")
        else:
            route = _route(samples, setting, graph, step, float(expected[step]))
            yield _Step(step, "" if route else "no route", route)


def _route(
    samples: LoggedSamples, setting: Setting, graph: LaneGraph, step: int, expected: float
) -> Route | None:
    """Return the route from a sample to the next if its length fits the speeds, else None."""
    first, last = (setting.lane_names[samples.lanes[step + k]] for k in (0, 1))
    if first == last:
        return None
    places = (float(samples.offsets[step]), float(samples.offsets[step + 1]))
    way = graph.between(first, last, places=places, expected=expected)
    if way is None:
        return None
    route, length = way
    slack = 2.0 + 0.5 * expected + 1.5 * float(samples.times[step + 1] - samples.times[step]) ** 2
    return route if abs(length - expected) <= slack and length >= -_BACKWARD else None


def expected_distances(samples: LoggedSamples, *, euler: bool) -> Floats:
    """Return how long each step should be by its speeds, or else by its positions, (n - 1,) [m]."""
    straight = np.linalg.norm(np.diff(samples.positions[:, :2], axis=0), axis=1)
    speeds = samples.speeds[1:] if euler else (samples.speeds[1:] + samples.speeds[:-1]) / 2.0
    driven = speeds * np.diff(samples.times)
    return np.where(np.isfinite(driven), driven, straight)


def is_astray(off: Floats) -> bool:
    """Return whether some samples are not where their lanes and offsets say.

    Args:
        off: How far samples are ahead and to the left of their places on their lanes, (n, 2) [m].
    """
    return bool((np.abs(off) > (_FARTHEST_ALONG, _FARTHEST_ASIDE)).any())


def _named(samples: LoggedSamples, setting: Setting, graph: LaneGraph) -> Bools:
    """Return which samples have a lane of the network and an offset along it, (n,)."""
    named = np.isfinite(samples.offsets)
    for lane, which in _groups(samples.lanes):
        named[which] &= lane >= 0 and setting.lane_names[lane] in graph
    return named


def _on_lanes(samples: LoggedSamples, setting: Setting, graph: LaneGraph) -> Bools:
    """Return which samples are where their lane and offset say, (n,)."""
    on = np.zeros(len(samples.times), dtype=np.bool_)
    for lane, which in _groups(samples.lanes):
        name = setting.lane_names[lane] if lane >= 0 else ""
        if name not in graph:
            continue
        # Find the place on the lane's polyline that each offset means.
        stations, shape = graph.stations(name), graph.lane(name).shape
        spots = samples.positions[which, :2] - shape[0, :2]
        places = samples.offsets[which]
        index = np.clip(np.searchsorted(stations, places, side="right") - 1, 0, len(shape) - 2)
        steps = np.diff(shape[:, :2], axis=0)[index]
        lengths = np.maximum(stations[index + 1] - stations[index], 1e-9)
        share = np.clip((places - stations[index]) / lengths, 0.0, 1.0)
        # Split the difference to that place into along and aside.
        away = spots - (shape[index, :2] - shape[0, :2] + share[:, None] * steps)
        steps = steps / np.maximum(np.linalg.norm(steps, axis=1), 1e-9)[:, None]
        along = np.abs((away * steps).sum(axis=1))
        aside = np.abs(steps[:, 0] * away[:, 1] - steps[:, 1] * away[:, 0])
        # Near a corner what is aside of one stretch is along the next.
        near = np.linalg.norm(away, axis=1) <= _FARTHEST_ALONG
        on[which] = (near | ((along <= _FARTHEST_ALONG) & (aside <= _FARTHEST_ASIDE))) & (
            np.isfinite(places)
        )
    return on


def _groups(lanes: Ints) -> Iterator[tuple[int, slice]]:
    """Yield the number of a lane and the samples on it, stretch by stretch."""
    cuts = [0, *(np.flatnonzero(np.diff(lanes)) + 1).tolist(), len(lanes)]
    for first, last in pairwise(cuts):
        yield int(lanes[first]), slice(first, last)


CHANGE_TIME = 4.0
"""Duration of the move that an instant change of lanes becomes [s]."""

_AHEAD = 4.0
"""A move lasts until this many times its width is driven, if there is time."""

_STANDING = 0.25
"""Steps that are driven slower than this count as standing [m/s]."""

_AMID = 0.2
"""The switch is amid a move if at least this share of the move lies before it and after it."""

_WIDENING = 0.5
"""A move that is too short begins earlier and ends later in steps of this time [s]."""

_SHORTEST = 0.5
"""Length of the shortest move [m]."""

_NEAR = 10.0
"""Lanes that end within this distance of a station can lie beside each other there [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Blend:
    """A move from one track to the next.

    Attributes:
        begin: Station where it begins [m].
        end: Where it ends [m].
        width: Distance from the first track to the next, positive to the left [m].
        times: Times at which it begins and ends [s].
    """

    begin: float
    end: float
    width: float
    times: tuple[float, float]


class PathPoints(NamedTuple):
    """A path at n stations.

    Attributes:
        points: (n, 3) [m].
        ahead: Derivatives of the road by station, without the moves aside, (n, 3).
        rates: Derivatives of the path by station, with the moves aside, (n, 3).
    """

    points: Floats
    ahead: Floats
    rates: Floats


@dataclass(frozen=True, slots=True, eq=False)
class LanePath:
    """A path by station.

    Attributes:
        tracks: m + 1 tracks, in order.
        begins: Stations where the moves between them begin, never falling, (m,) [m].
        ends: Stations where the moves end, never falling, (m,) [m].
    """

    tracks: tuple[Track, ...]
    begins: Floats
    ends: Floats

    def at(self, stations: Floats) -> PathPoints:
        """Return the path at stations, (n,) [m]."""
        if len(self.tracks) == 1:
            points, ahead = self.tracks[0].at(stations)
            return PathPoints(points, ahead, ahead)
        # Begin on the track of the last move that has ended.
        done = np.searchsorted(self.ends, stations, side="right")
        begun = np.searchsorted(self.begins, stations, side="left")
        points, ahead = self._on(done, stations)
        rates = ahead.copy()
        # Add the eased differences of the moves that have begun since.
        for step in range(int((begun - done).max(initial=0))):
            moving = np.flatnonzero(done + step < begun)
            number, at = done[moving] + step, stations[moving]
            length = self.ends[number] - self.begins[number]
            share = (at - self.begins[number]) / length
            (here, toward), (there, onward) = self._on(number, at), self._on(number + 1, at)
            weight = eased(share)[:, None]
            points[moving] += weight * (there - here)
            ahead[moving] += weight * (onward - toward)
            rate = (eased_rate(share) / length)[:, None]
            rates[moving] += weight * (onward - toward) + rate * (there - here)
        return PathPoints(points, ahead, rates)

    def _on(self, numbers: Ints, stations: Floats) -> tuple[Floats, Floats]:
        """Return points and derivatives at stations on tracks by number, (n, 3) each."""
        points, tangents = np.empty((len(stations), 3)), np.empty((len(stations), 3))
        for number, track in enumerate(self.tracks):
            inside = np.flatnonzero(numbers == number)
            if len(inside):
                points[inside], tangents[inside] = track.at(stations[inside])
        return points, tangents


def lane_path(tracks: Tracks, run: LaneRun, along: Hermite) -> tuple[LanePath, tuple[Blend, ...]]:
    """Return the path of a run, and the moves in it.

    Args:
        tracks: Lines along the lanes.
        run: The lanes and the stations of the samples.
        along: Stations over time.
    """
    chains = [list(chain) for chain in run.chains]
    blends: list[Blend] = []
    for number, switch in enumerate(run.switches):
        blend = _blend(tracks, chains, number, along, switch)
        blends.append(_after(blend, blends[-1]) if blends else blend)
    made = tuple(tracks.along(chain) for chain in chains)
    begins, ends = (np.array([getattr(b, name) for b in blends]) for name in ("begin", "end"))
    return LanePath(made, begins, ends), tuple(blends)


def _blend(
    tracks: Tracks, chains: list[LaneChain], number: int, along: Hermite, switch: Switch
) -> Blend:
    """Return the move from one chain to the next; both chains are lengthened to cover it."""
    # Find the station of the switch.
    knots = along.knots
    step = float(knots[switch.step + 1] - knots[switch.step])
    middle = float(knots[switch.step]) + switch.share * step
    station = float(along.at(np.array([middle]))[0][0])
    # Choose the times and stations of the move, around the switch and between standstills.
    width = _apart(tracks, (chains[number][-1], chains[number + 1][0]), station)
    room = _room(along, switch.step, LEAST_AHEAD * abs(width))
    times = _window(along, middle, _AHEAD * abs(width), room)
    begin, end = (float(each) for each in np.clip(along.at(np.array(times))[0], *room))
    short = max(LEAST_AHEAD * abs(width) - (end - begin), 0.0)
    begin, end = begin - short, end + short
    # Shift the move to where both chains have lanes.
    graph = tracks.graph
    _lengthen(graph, chains, number, (begin - REACH, end + REACH))
    low = chains[number + 1][0].begin
    high = _end_of(graph, chains[number])
    begin, end = _fitted((begin, end), station, room=room, lanes=(low, high))
    first, last = np.interp((begin, end), along.values, knots)
    return Blend(begin, end, width, (min(times[0], float(first)), max(times[1], float(last))))


def _apart(tracks: Tracks, lanes: tuple[ChainLane, ChainLane], station: float) -> float:
    """Return how far the second of two lanes is left of the first at a station [m]."""
    (here, ahead), (there, _) = (
        tracks.along([lane]).corners_at(np.array([station])) for lane in lanes
    )
    away, ahead = (there - here)[0, :2], ahead[0, :2]
    return float((ahead[0] * away[1] - ahead[1] * away[0]) / max(np.hypot(*ahead), 1e-9))


def _room(along: Hermite, step: int, least: float) -> tuple[float, float]:
    """Return the first and last station between the standstills around a step [m].

    A vehicle changes lanes only while it drives. A switch during a standstill becomes a move
    after the standstill, or before it if there is more room.

    Args:
        along: Stations over time.
        step: Number of the step.
        least: Length that a move needs at least [m].
    """
    # Find the standstill that the step lies in, if any, and those before and after.
    standing = np.diff(along.values) < _STANDING * np.diff(along.knots)
    moving = np.flatnonzero(~standing)
    first = last = step
    if standing[step]:
        first = int(moving[moving < step].max(initial=-1)) + 1
        last = int(moving[moving > step].min(initial=len(standing))) - 1
    before = np.flatnonzero(standing[:first])
    after = np.flatnonzero(standing[last + 1 :])
    low = float(along.values[before[-1] + 1] if len(before) else along.values[0])
    high = float(along.values[last + 1 + after[0]] if len(after) else along.values[-1])
    if not standing[step]:
        return low, high
    here, there = float(along.values[first]), float(along.values[last + 1])
    # A vehicle that switches just as it stops moves before, so that it waits in the new lane.
    if first == step < last and here - low >= least:
        return low, here
    return (there, high) if high - there >= min(least, here - low) else (low, here)


def _window(
    along: Hermite, middle: float, least: float, room: tuple[float, float]
) -> tuple[float, float]:
    """Return the times at which a move begins and ends [s].

    Args:
        along: Stations over time.
        middle: Time of the switch [s].
        least: Distance that should be driven during the move [m].
        room: First and last station that the move keeps to [m].
    """
    first, last = float(along.knots[0]), float(along.knots[-1])
    reach = CHANGE_TIME / 2.0
    while True:
        times = max(middle - reach, first), min(middle + reach, last)
        low, high = np.clip(along.at(np.array(times))[0], *room)
        if high - low >= least or reach >= AROUND:
            return times
        reach += _WIDENING


def _fitted(
    wanted: tuple[float, float],
    station: float,
    *,
    room: tuple[float, float],
    lanes: tuple[float, float],
) -> tuple[float, float]:
    """Return the stations where a move begins and ends [m].

    Args:
        wanted: Stations where it should begin and end [m].
        station: Station of the switch [m].
        room: First and last station that the move keeps to [m].
        lanes: First and last station where both tracks have lanes [m]; the move is shifted
            there as far as the switch stays amid it.
    """
    wanted = max(wanted[0], min(room[0], station)), min(wanted[1], max(room[1], station))
    length = max(min(wanted[1] - wanted[0], room[1] - room[0]), _SHORTEST)
    begin = max(min(wanted[0], room[1] - length), room[0])
    shift = max(lanes[0] - begin, 0.0) + min(lanes[1] - length - begin, 0.0)
    low = max(station - (1.0 - _AMID) * length, room[0])
    high = min(station - _AMID * length, room[1] - length)
    if low <= begin <= high:
        begin = min(max(begin + shift, low), high)
    return begin, begin + length


def _end_of(graph: LaneGraph, chain: LaneChain) -> float:
    """Return the station at which the last lane of a chain ends [m]."""
    return chain[-1].begin + graph.length(chain[-1].name)


def _lengthen(
    graph: LaneGraph, chains: list[LaneChain], number: int, reach: tuple[float, float]
) -> None:
    """Continue two chains beside each other as far as lanes of the same edges lead on.

    Args:
        graph: The lanes.
        chains: Chains; the one of the number grows at its end, the next one at its beginning.
        number: Number of the chain that the vehicle leaves.
        reach: First and last station that the chains should cover [m].
    """
    old, new = chains[number], chains[number + 1]
    while new[0].begin > reach[0]:
        before = graph.before.get(new[0].name, ())
        lane = _matching(graph, before, old, new[0].begin, ends=True)
        if lane is None:
            break
        new.insert(0, ChainLane(lane, new[0].begin - graph.length(lane)))
    while (end := _end_of(graph, old)) < reach[1]:
        onward = graph.onward.get(old[-1].name, ())
        lane = _matching(graph, onward, new, end, ends=False)
        if lane is None:
            break
        old.append(ChainLane(lane, end))


def _matching(
    graph: LaneGraph, names: Sequence[str], chain: LaneChain, station: float, *, ends: bool
) -> str | None:
    """Return the first lane of some that is on the same edge as a chain's lane near a station."""
    edges = set(_edges_near(graph, chain, station, ends=ends))
    return next((name for name in names if graph.lane(name).edge_id in edges), None)


def _edges_near(graph: LaneGraph, chain: LaneChain, station: float, *, ends: bool) -> Iterator[str]:
    """Yield edges of a chain's lanes that end (or begin) near a station."""
    for name, begin in chain:
        place = begin + graph.length(name) if ends else begin
        if abs(place - station) < _NEAR:
            yield graph.lane(name).edge_id


def _after(blend: Blend, earlier: Blend) -> Blend:
    """Return the same move, but neither begun nor ended before an earlier one."""
    begin, end = max(blend.begin, earlier.begin), max(blend.end, earlier.end)
    return Blend(min(begin, end - 1e-6), end, blend.width, blend.times)
