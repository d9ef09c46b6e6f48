"""Finds when and where most road users move, and which vehicles to ride in there.

Movement is told in rows of about a second. Vehicles to ride in are those that last a shot, drive
most of it, and pass the place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.network import Edge, Junction, Network
from sumo3dviz_pt.model.traffic import FASTEST, Trace, VehicleType, unique_ids
from sumo3dviz_pt.motion.samples import split

STEP = 1.0
"""Time between rows, unless the log's own steps are longer [s]."""

_MOST_ROWS = 4_000_000
"""Of longer logs only some road users are looked at, so that a city takes seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """Rows of road users, in order of users and time.

    Attributes:
        traces: The road users.
        users: Index into `traces`, (n,).
        times: (n,) [s].
        places: (n, 3) [m].
        yaws: (n,) [rad].
        driven: Distance since the user's row before, (n,) [m]; 0 at its first row, and where it
            was moved rather than drove.
    """

    traces: Sequence[Trace]
    users: Ints
    times: Floats
    places: Floats
    yaws: Floats
    driven: Floats

    def during(self, start: float, end: float) -> Movement:
        """Return the rows of a span of time [s], both ends included."""
        return self.where((self.times >= start - 1e-6) & (self.times <= end + 1e-6))

    def near(self, place: Floats, radius: float) -> Movement:
        """Return the rows within a distance in plan [m] of a place, (2,) or (3,) [m]."""
        return self.where(np.hypot(*(self.places[:, :2] - place[:2]).T) <= radius)

    def where(self, chosen: Bools) -> Movement:
        """Return some of the rows; distances stay those to the row before in the log."""
        return Movement(
            self.traces,
            self.users[chosen],
            self.times[chosen],
            self.places[chosen],
            self.yaws[chosen],
            self.driven[chosen],
        )

    def distances(self) -> tuple[Ints, Floats]:
        """Return the users of these rows, (m,), and how far each drives in them, (m,) [m]."""
        users, row = np.unique(self.users, return_inverse=True)
        sums = np.zeros(len(users))
        np.add.at(sums, row.ravel(), self.driven)
        return users, sums


def movement_of(traces: Sequence[Trace]) -> Movement:
    """Return the rows of road users, thinned to about one a second."""
    rows = sum(len(trace.times) for trace in traces)
    traces = tuple(traces[:: max(1, -(-rows // _MOST_ROWS))])
    if not traces:
        empty = np.zeros(0)
        return Movement((), np.zeros(0, np.int64), empty, np.zeros((0, 3)), empty, empty)
    users = np.repeat(np.arange(len(traces)), [len(trace.times) for trace in traces])
    times = np.concatenate([trace.times for trace in traces])
    # Keep the first row of each user in each second.
    second = np.floor(times / STEP + 1e-6)
    first = np.append(True, np.diff(users) != 0)
    turns = np.flatnonzero(first | np.append(True, np.diff(second) != 0))
    users, times, first = users[turns], times[turns], first[turns]
    places = np.concatenate([trace.positions for trace in traces])[turns]
    yaws = np.concatenate([trace.yaws for trace in traces])[turns]
    # What was moved faster than anything drives was teleported.
    steps = np.linalg.norm(np.diff(places[:, :2], axis=0, prepend=places[:1, :2]), axis=1)
    gaps = np.diff(times, prepend=times[0])
    drove = ~first & (steps <= FASTEST * np.maximum(gaps, 1e-9))
    return Movement(traces, users, times, places, yaws, np.where(drove, steps, 0.0))


NEAR = 45.0
"""What moves within this distance of a place happens at the place [m]."""

_CELL = 30.0  # squares by which places are compared first [m]
_BIN = 5.0  # times by which moments are compared first [s]
_CANDIDATES = 40
_SNAP = 40.0  # a junction within this distance becomes the place [m]
_AT_JUNCTION = 1.2  # by which factor junctions are preferred: vehicles turn and wait there
_VARIETY = 0.12  # what each further kind of road user adds
_LONG, _SHORT = 12.0, 4.0  # distances by which a vehicle and a person on foot count as moving [m]
_ON_FOOT = 0.6  # share by which a person on foot counts beside a vehicle
_LEAST_ARMS = 3
_CRUMB = 15.0  # edges shorter than this join the pieces of one crossing [m]
_WIDEST = 70.0  # of a crossing [m]
_ONE_LINE = 0.93  # how much of the traffic leads along one line where roads do not cross
_ON_FEET = frozenset({"pedestrian", "wheelchair"})


@dataclass(frozen=True, slots=True, eq=False)
class Busiest:
    """A moment and a place with traffic.

    Attributes:
        start: First time of the shots [s].
        end: Time after their last frame [s].
        place: On the road, (3,) [m].
        junction: Id of the junction there, or empty.
        movers: Number of road users that move there meanwhile.
    """

    start: float
    end: float
    place: Floats
    junction: str
    movers: int


def busiest(
    movement: Movement, network: Network, *, span: tuple[float, float], length: float
) -> Busiest:
    """Return the moment and place at which most road users move; standing ones do not count.

    Args:
        movement: Everyone, n >= 1 rows.
        network: Has the junctions.
        span: Begin and end of the log [s].
        length: Of the shots, as long as the log lasts [s].
    """
    begin, end = span
    # Shots keep off the log's ends, where smoothing has less to go by.
    slack = min(1.0, max(0.0, 0.5 * (end - begin - length)))
    first = min(float(np.ceil(begin + slack)), max(begin, end - length))
    crossings = _crossings(network)
    best: tuple[float, Busiest] | None = None
    rows: dict[float, Movement] = {}
    for number, place in _coarse(movement, first, latest=end - slack - length):
        start = first + _BIN * number
        stop = min(start + length, end)
        if start not in rows:
            rows[start] = movement.during(start, stop)
        there = rows[start]
        middle, junction = _snapped(place, crossings)
        if junction and not _crosses(there.near(middle, _SNAP)):
            middle, junction = place, ""
        value, movers = _worth(there.near(middle, NEAR))
        value *= _AT_JUNCTION if junction else 1.0
        if best is None or value > best[0] * (1.0 + 1e-9):
            best = (value, Busiest(start, stop, middle, junction, movers))
    if best is not None:
        return _alive(best[1], movement)
    # Nobody moves: any place and moment with a road user will do.
    row = len(movement.times) // 2
    place, junction = _snapped(movement.places[row], crossings)
    start = float(np.clip(np.floor(movement.times[row]), begin, max(first, end - length)))
    return _alive(Busiest(start, min(start + length, end), place, junction, 0), movement)


def _alive(spot: Busiest, movement: Movement) -> Busiest:
    """Shorten a moment to the time in which somebody is at the place, if that is under half."""
    there = movement.during(spot.start, spot.end).near(spot.place, NEAR).times
    if not len(there):
        return spot
    seconds = np.unique(np.floor(there - spot.start + 1e-6))
    if len(seconds) >= 0.5 * (spot.end - spot.start):
        return spot
    start = spot.start + float(seconds[0])
    end = min(spot.end, spot.start + float(seconds[-1]) + 1.0)
    return replace(spot, start=start, end=end)


def _coarse(movement: Movement, first: float, *, latest: float) -> list[tuple[int, Floats]]:
    """Numbers of bins and places with most moving seconds, the best first."""
    moving = 1.0 - np.exp(-movement.driven / 2.0)
    number = np.floor((movement.times - first) / _BIN + 1e-6).astype(np.int64)
    used = (moving > 0.1) & (number >= 0)
    number, moving, places = number[used], moving[used], movement.places[used]
    if not len(number):
        return []
    # Sum by cell and bin, then over neighbours and the next bin.
    low = places[:, :2].min(axis=0)
    cell = np.floor((places[:, :2] - low) / _CELL).astype(np.int64) + 1
    keys, row = np.unique(_key(number, cell[:, 0], cell[:, 1]), return_inverse=True)
    row = row.ravel()
    own = np.bincount(row, weights=moving)
    around = np.zeros(len(keys))
    for later, east, north in product((0, 1), (-1, 0, 1), (-1, 0, 1)):
        wanted = keys + _key(*(np.array([step]) for step in (later, east, north)))
        index = np.clip(np.searchsorted(keys, wanted), 0, len(keys) - 1)
        around += np.where(keys[index] == wanted, own[index], 0.0)
    middles = [np.bincount(row, weights=moving * column) / own for column in places.T]
    possible = np.flatnonzero((keys >> 40) * _BIN + first <= latest + 1e-6)
    possible = possible if len(possible) else np.flatnonzero(keys >> 40 == 0)
    ranked = possible[np.argsort(-np.round(around[possible], 6), kind="stable")][:_CANDIDATES]
    return [(int(keys[k] >> 40), np.array([column[k] for column in middles])) for k in ranked]


def _key(number: Ints, east: Ints, north: Ints) -> Ints:
    """One number for a bin and a cell; sums of keys are keys of sums."""
    return np.asarray(number * (1 << 40) + east * (1 << 20) + north)


def _worth(there: Movement) -> tuple[float, int]:
    """How much moves in some rows, and how many road users."""
    users, driven = there.distances()
    kinds = np.array([there.traces[user].kind != "vehicle" for user in users.tolist()], dtype=bool)
    scale = np.where(kinds, _SHORT, _LONG)
    each = (1.0 - np.exp(-driven / scale)) * np.where(kinds, _ON_FOOT, 1.0)
    moves = driven > scale / 4.0
    types = {there.traces[user].type_id for user in users[moves].tolist()}
    variety = 1.0 + _VARIETY * max(0, min(len(types), 4) - 1)
    return float(each.sum()) * variety, int(moves.sum())


@dataclass(frozen=True, slots=True, eq=False)
class _Crossings:
    """Places at which roads meet; junctions that short edges join are one.

    Attributes:
        ids: Of the largest junction of each.
        places: Their middles, (n, 3) [m].
    """

    ids: tuple[str, ...]
    places: Floats


def _crossings(network: Network) -> _Crossings:
    """Crossings with three arms or more, each of them a road and no crumb between junctions."""
    roads = [edge for edge in network.edges.values() if _is_road(edge, network)]
    whole = _joined([edge for edge in roads if edge.lanes[0].length < _CRUMB], network)
    arms: dict[str, set[str]] = {}
    for edge in roads:
        ends = [whole.get(name, name) for name in (edge.from_junction, edge.to_junction)]
        if edge.lanes[0].length >= _CRUMB:
            arms.setdefault(ends[0], set()).add(ends[1])
            arms.setdefault(ends[1], set()).add(ends[0])
    pieces: dict[str, list[Junction]] = {}
    for name, junction in sorted(network.junctions.items()):
        if junction.type != "internal":
            pieces.setdefault(whole.get(name, name), []).append(junction)
    real = [some for name, some in pieces.items() if len(arms.get(name, ())) >= _LEAST_ARMS]
    ids = tuple(max((_area(k), k.id) for k in some)[1] for some in real)
    places = [np.mean([_middle(k) for k in some], axis=0) for some in real]
    return _Crossings(ids, np.array(places).reshape(-1, 3))


def _is_road(edge: Edge, network: Network) -> bool:
    """Whether something drives along an edge between two junctions that are there."""
    ends = {edge.from_junction, edge.to_junction}
    drives = any(lane.allowed - _ON_FEET for lane in edge.lanes)
    return edge.function == "normal" and drives and ends <= network.junctions.keys()


def _joined(crumbs: Sequence[Edge], network: Network) -> dict[str, str]:
    """The name of the crossing that each junction at a crumb belongs to.

    Crumbs in a row that lead farther than a crossing is wide join nothing.
    """
    groups: dict[str, set[str]] = {}
    for edge in crumbs:
        both = (edge.from_junction, edge.to_junction)
        joint = {*both}.union(*(groups.get(name, ()) for name in both))
        groups |= dict.fromkeys(joint, joint)
    names = {}
    for name, group in groups.items():
        spots = np.array([network.junctions[k].position[:2] for k in group])
        if float(np.ptp(spots, axis=0).max()) <= _WIDEST:
            names[name] = min(group)
    return names


def _area(junction: Junction) -> float:
    """Of a junction's outline [m2]; 0 without one."""
    shape = junction.outline[:, :2]
    return float(shapely.Polygon(shape).area) if len(shape) > 2 else 0.0


def _middle(junction: Junction) -> Floats:
    """The middle of a junction's outline, or where the network puts it, (3,) [m]."""
    if len(junction.outline) < 3:
        return junction.position
    low, high = junction.outline.min(axis=0), junction.outline.max(axis=0)
    return np.array([*(0.5 * (low + high))[:2], junction.position[2]])


def _crosses(there: Movement) -> bool:
    """Whether traffic at a place leads in several directions, not only to and fro."""
    weight = there.driven
    if weight.sum() <= 0.0:
        return False
    # Opposite directions are one line.
    along = np.abs(np.sum(weight * np.exp(2j * there.yaws))) / weight.sum()
    return bool(along < _ONE_LINE)


def _snapped(place: Floats, crossings: _Crossings) -> tuple[Floats, str]:
    """The nearest junction to a place and its id, or the place itself."""
    if len(crossings.ids):
        away = np.linalg.norm(crossings.places - place, axis=1)
        nearest = int(np.argmin(away))
        if away[nearest] < _SNAP:
            # Junctions of flat networks have no height of their own.
            x, y = crossings.places[nearest, :2].tolist()
            return np.array([x, y, float(place[2])]), crossings.ids[nearest]
    return place, ""


_CARS = frozenset({"passenger", "taxi", "evehicle", "hov", "private", "custom1", "custom2"})
_TRAINS = frozenset({"rail", "rail_electric", "rail_fast", "rail_urban", "subway"})

_MOST, _MOST_LATER = 1200, 150  # traces of a kind that are looked at, then and at other times
_MOST_WINDOWS = 24  # of one trace
_MOVES = 0.5  # speed from which a vehicle drives [m/s]
_MOVING = 2.0 / 3.0  # share of the time that it must drive
_SHIFT = 5.0  # between windows that are tried where no vehicle lasts the first [s]
_TURN = 30.0  # what a turn of 90 degrees is worth [m]
_PASSES = 60.0  # and passing the place [m]


@dataclass(frozen=True, slots=True)
class _RideKind:
    """What can be ridden in.

    Attributes:
        camera: Name of its camera.
        classes: Its vClasses.
        view: A name of `scene_templates/camera`: `driver` where the body has an interior.
        least: A ride leads farther than this [m].
    """

    camera: str
    classes: frozenset[str]
    view: str
    least: float = 15.0


_KINDS = (
    _RideKind("driver", _CARS, "driver"),
    _RideKind("bus", frozenset({"bus", "coach"}), "chase"),
    _RideKind("tram", frozenset({"tram", "cable_car"}), "chase"),
    _RideKind("train", _TRAINS, "chase"),
    _RideKind("bicycle", frozenset({"bicycle"}), "chase"),
)
_WALK = _RideKind("walk", frozenset(), "pedestrian", least=6.0)
"""Proposed where nobody drives: somebody's eyes on foot."""


@dataclass(frozen=True, slots=True)
class ProposedRide:
    """A camera that rides.

    Attributes:
        camera: Its name.
        vehicle: Id of the vehicle.
        view: A name of `scene_templates/camera`.
        start: First time of its shot [s].
        end: Time after its last frame [s].
        metres: How far it drives [m].
    """

    camera: str
    vehicle: str
    view: str
    start: float
    end: float
    metres: float


def choose_rides(
    traces: Iterable[Trace], types: Mapping[str, VehicleType], spot: Busiest, *, step: float
) -> tuple[list[ProposedRide], list[str]]:
    """Return one ride of each kind of vehicle that the log has, and notes about the others.

    Where only people walk, one of them is gone with.

    Args:
        traces: Of the log.
        types: Vehicle types by id.
        spot: The moment, which rides keep where they can, and the place.
        step: Median step of the whole log [s].
    """
    by_class: dict[str, list[Trace]] = {}
    walkers: list[Trace] = []
    traces = list(traces)
    for name, trace in zip(unique_ids(traces), traces, strict=True):
        kind = types.get(trace.type_id)
        named = trace if name == trace.id else replace(trace, id=name)
        if trace.kind == "vehicle" and kind is not None:
            by_class.setdefault(kind.vclass, []).append(named)
        elif trace.kind == "person":
            walkers.append(named)
    rides, notes = [], []
    drives = any(trace.kind == "vehicle" for trace in traces)
    for ride in (*_KINDS, _WALK):
        some = [trace for name in sorted(ride.classes) for trace in by_class.get(name, ())]
        if ride is _WALK and not drives:
            some = walkers
        if not some:
            continue
        best = _best(ride, some, spot, step)
        if best is None:
            whom = "people walks" if ride is _WALK else "such vehicles drives"
            notes.append(
                f"no camera `{ride.camera}`: none of {len(some)} {whom} two thirds"
                f" of {spot.end - spot.start:g} s without a gap"
            )
        else:
            rides.append(best)
    return rides, notes


def _best(kind: _RideKind, traces: list[Trace], spot: Busiest, step: float) -> ProposedRide | None:
    """The best ride while the other shots last; else at any other time."""
    length = spot.end - spot.start
    there = [t for t in traces if t.times[0] <= spot.start and t.times[-1] >= spot.end]
    for later, some, most in ((False, there, _MOST), (True, traces, _MOST_LATER)):
        best: tuple[float, ProposedRide] | None = None
        for trace in some[:: max(1, -(-len(some) // most))]:
            starts = _windows(trace, length) if later else [spot.start]
            whole = [(part.times[0], part.times[-1]) for part in split(trace, step=step)]
            for start in starts:
                if not any(a < start + 1e-6 and b > start + length - 1e-6 for a, b in whole):
                    continue
                value, metres = _rides_worth(trace, start, start + length, spot.place)
                if metres < kind.least:
                    continue
                if value > 0.0 and (best is None or value > best[0] + 1e-6):
                    ride = ProposedRide(
                        kind.camera, trace.id, kind.view, start, start + length, metres
                    )
                    best = (value, ride)
        if best is not None:
            return best[1]
    return None


def _windows(trace: Trace, length: float) -> list[float]:
    """Begins of windows of a length [s] in which a road user is there, evenly spread."""
    starts = np.arange(np.ceil(trace.times[0] + 0.5), trace.times[-1] - length, _SHIFT)
    return [float(start) for start in starts[:: max(1, -(-len(starts) // _MOST_WINDOWS))]]


def _rides_worth(trace: Trace, start: float, end: float, place: Floats) -> tuple[float, float]:
    """How good a ride is, 0 for one that cannot be filmed, and how far it leads [m].

    Args:
        trace: Of the vehicle.
        start: Of the shot [s].
        end: Of the shot [s].
        place: That it should pass, (3,) [m].
    """
    inside = slice(
        max(0, int(np.searchsorted(trace.times, start + 1e-6, side="right")) - 1),
        int(np.searchsorted(trace.times, end - 1e-6)) + 1,
    )
    times, places, yaws = trace.times[inside], trace.positions[inside], trace.yaws[inside]
    if len(times) < 2 or times[0] > start + 1e-6 or times[-1] < end - 1e-6:
        return 0.0, 0.0
    gaps = np.diff(times)
    steps = np.hypot(*np.diff(places[:, :2], axis=0).T)
    metres = float(steps.sum())
    drives = steps > _MOVES * gaps
    if float(gaps[drives].sum()) < _MOVING * float(gaps.sum()):
        return 0.0, metres
    turned = float(np.abs(np.angle(np.exp(1j * np.diff(yaws)))[drives].sum()))
    near = float(np.hypot(*(places[:, :2] - place[:2]).T).min())
    value = min(metres, 140.0) + _TURN * min(turned / (np.pi / 2.0), 1.5)
    return value + _PASSES * float(np.exp(-near / 30.0)), metres
