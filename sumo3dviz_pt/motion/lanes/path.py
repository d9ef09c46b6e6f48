"""The path of a run along lanes: tracks, and the eased moves between them.

The path is the first track plus, for each change of lanes, the eased difference to the next
track. As the path depends on the station only, nothing slides sideways while it stands.

A change of lanes that SUMO makes in one step becomes a move of 4 s whose sideways acceleration
begins and ends at zero. The move takes longer where the vehicle would drive less than four times
the move's width in 4 s.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.motion.curves import Hermite, eased, eased_rate
from sumo3dviz_pt.motion.lanes.graph import LaneGraph
from sumo3dviz_pt.motion.lanes.runs import ChainLane, LaneChain, LaneRun, Switch
from sumo3dviz_pt.motion.lanes.track import REACH, Track, Tracks
from sumo3dviz_pt.motion.manoeuvres import AROUND, LEAST_AHEAD

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
        found = _matching(graph, before, old, new[0].begin, ends=True)
        if found is None:
            break
        new.insert(0, ChainLane(found, new[0].begin - graph.length(found)))
    while (end := _end_of(graph, old)) < reach[1]:
        onward = graph.onward.get(old[-1].name, ())
        found = _matching(graph, onward, new, end, ends=False)
        if found is None:
            break
        old.append(ChainLane(found, end))


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
