"""The path of a run along lanes: tracks, and the eased moves between them.

The path is the first track plus, for every change of lanes, the eased difference to the
next track. Driven by the arc length, nothing slides sideways while it stands.

References:
    shared facts on motion, section 5.4: an instant change becomes a lateral move of 4 s
    with level acceleration at both ends, longer where less than four times its width would
    be driven meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.motion.curves import Hermite, eased, eased_rate
from sumo3dviz_pt.motion.manoeuvres import AROUND, LEAST_AHEAD
from sumo3dviz_pt.motion.route import Chain, LaneRun, Switch
from sumo3dviz_pt.motion.track import REACH, Track, Tracks
from sumo3dviz_pt.motion.ways import Ways

CHANGE_TIME = 4.0
"""An instant change of lanes takes so long [s]."""

_AHEAD = 4.0
"""So many times its width is driven during the move, if there is time."""

_STANDING = 0.25
"""Ways between samples driven slower count as standing [m/s]."""

_AMID = 0.2
"""The switch is amid a move if at least this share of it lies before and after."""

_WIDENING = 0.5
_SHORTEST = 0.5
"""No move is shorter [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Blend:
    """A move from one track to the next.

    Attributes:
        begin: Station where it begins [m].
        end: Where it ends [m].
        width: How far the tracks are apart, positive to the left [m].
        times: When it begins and ends [s].
    """

    begin: float
    end: float
    width: float
    times: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class LanePath:
    """Points by station.

    Attributes:
        tracks: m + 1 of them.
        begins: Stations where the moves between them begin, never falling, (m,) [m].
        ends: Where they end, likewise.
    """

    tracks: tuple[Track, ...]
    begins: Floats
    ends: Floats

    def at(self, stations: Floats) -> tuple[Floats, Floats, Floats]:
        """Points, directions of the road and derivatives by station, (n, 3) each.

        The direction leaves the sideways move out; the derivative has it.
        """
        if len(self.tracks) == 1:
            points, ahead = self.tracks[0].at(stations)
            return points, ahead, ahead
        done = np.searchsorted(self.ends, stations, side="right")
        begun = np.searchsorted(self.begins, stations, side="left")
        points, ahead = self._on(done, stations)
        rates = ahead.copy()
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
        return points, ahead, rates

    def _on(self, numbers: Ints, stations: Floats) -> tuple[Floats, Floats]:
        """Points and derivatives on tracks, each of its own, (n, 3) each."""
        points, tangents = np.empty((len(stations), 3)), np.empty((len(stations), 3))
        for number, track in enumerate(self.tracks):
            inside = np.flatnonzero(numbers == number)
            if len(inside):
                points[inside], tangents[inside] = track.at(stations[inside])
        return points, tangents


def lane_path(tracks: Tracks, run: LaneRun, along: Hermite) -> tuple[LanePath, tuple[Blend, ...]]:
    """The path of a run, and the moves in it.

    Args:
        tracks: Lines along the lanes.
        run: Lanes and stations.
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
    tracks: Tracks, chains: list[Chain], number: int, along: Hermite, switch: Switch
) -> Blend:
    """Where a vehicle moves from one chain to the next; both are lengthened to cover it."""
    knots = along.knots
    step = float(knots[switch.step + 1] - knots[switch.step])
    middle = float(knots[switch.step]) + switch.share * step
    station = float(along.at(np.array([middle]))[0][0])
    ways = tracks.ways
    width = _apart(tracks, (chains[number][-1], chains[number + 1][0]), station)
    room = _room(along, switch.step, LEAST_AHEAD * abs(width))
    times = _window(along, middle, _AHEAD * abs(width), room)
    begin, end = (float(each) for each in np.clip(along.at(np.array(times))[0], *room))
    short = max(LEAST_AHEAD * abs(width) - (end - begin), 0.0)
    begin, end = begin - short, end + short
    _lengthen(ways, chains, number, (begin - REACH, end + REACH))
    low = chains[number + 1][0][1]
    high = chains[number][-1][1] + ways.length(chains[number][-1][0])
    begin, end = _fitted((begin, end), station, room=room, lanes=(low, high))
    first, last = np.interp((begin, end), along.values, knots)
    return Blend(begin, end, width, (min(times[0], float(first)), max(times[1], float(last))))


def _apart(tracks: Tracks, lanes: tuple[tuple[str, float], ...], station: float) -> float:
    """How far the second of two lanes is left of the first at a station [m]."""
    (here, ahead), (there, _) = (
        tracks.along([lane]).corners_at(np.array([station])) for lane in lanes
    )
    away, ahead = (there - here)[0, :2], ahead[0, :2]
    return float((ahead[0] * away[1] - ahead[1] * away[0]) / max(np.hypot(*ahead), 1e-9))


def _room(along: Hermite, step: int, least: float) -> tuple[float, float]:
    """Stations between the standstills around a step: who stands keeps its lane [m].

    A step amid a standstill moves over after it, or before it if there is more room.
    """
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
    # Rather where the standstill begins or ends with the step: nobody waits in a wrong lane.
    if first == step < last and here - low >= least:
        return low, here
    return (there, high) if high - there >= min(least, here - low) else (low, here)


def _window(
    along: Hermite, middle: float, least: float, room: tuple[float, float]
) -> tuple[float, float]:
    """Begin and end of a move around a time, long enough to drive so far within a room [s]."""
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
    """The stretch of a move [m].

    Args:
        wanted: Its begin and end.
        station: Of the switch.
        room: First and last station that it keeps to.
        lanes: Where both tracks have lanes. There it goes, if the switch stays amid it.
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


def _lengthen(ways: Ways, chains: list[Chain], number: int, reach: tuple[float, float]) -> None:
    """Continue two chains beside each other, so far as lanes of the same edges lead on."""
    old, new = chains[number], chains[number + 1]
    while new[0][1] > reach[0]:
        found = _matching(ways, ways.before.get(new[0][0], ()), old, new[0][1], ends=True)
        if found is None:
            break
        new.insert(0, (found, new[0][1] - ways.length(found)))
    while (end := old[-1][1] + ways.length(old[-1][0])) < reach[1]:
        found = _matching(ways, ways.onward.get(old[-1][0], ()), new, end, ends=False)
        if found is None:
            break
        old.append((found, end))


def _matching(
    ways: Ways, names: Sequence[str], chain: Chain, station: float, *, ends: bool
) -> str | None:
    """The lane of some that lies on an edge of a chain's lanes near a station."""
    edges = set(_edges_near(ways, chain, station, ends=ends))
    return next((name for name in names if ways.lane(name).edge_id in edges), None)


def _edges_near(ways: Ways, chain: Chain, station: float, *, ends: bool) -> Iterator[str]:
    """Edges of a chain's lanes that end (or begin) within 10 m of a station."""
    for name, begin in chain:
        place = begin + ways.length(name) if ends else begin
        if abs(place - station) < 10.0:
            yield ways.lane(name).edge_id


def _after(blend: Blend, earlier: Blend) -> Blend:
    """The same move, not begun or ended before an earlier one."""
    begin, end = max(blend.begin, earlier.begin), max(blend.end, earlier.end)
    return Blend(min(begin, end - 1e-6), end, blend.width, blend.times)
