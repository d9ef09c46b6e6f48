"""Compares the places of a log with the lanes of its network, by a sample of the log's rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, arc_length
from sumo3dviz_pt.model.network import Lane, Location, Network
from sumo3dviz_pt.model.traffic import GAP_FACTOR, Trace, TrafficLog

_ROWS = 2500
"""Number of steps that are looked at, about."""

_USERS = 800
"""Largest number of vehicles that they are taken from."""

_MOVES = 0.3
"""Smallest distance in a step, and smallest speed, of a vehicle that drives [m], [m/s]."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What seems wrong with a log.

    Attributes:
        about: What it is about, in a word.
        text: What is wrong, how much, and what to do.
        hopeless: Whether a film of this log would be nonsense.
    """

    about: str
    text: str
    hopeless: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class LogSample:
    """Steps of driving vehicles from all over a log.

    Attributes:
        places: x, y and z at the end of each step, (n, 3) [m].
        moves: Way of the front from the row before, (n, 2) [m].
        spans: Duration of each step, (n,) [s].
        yaws: Logged direction at its end, counter-clockwise from east, (n,) [rad].
        speeds: Logged speed at its end; NaN where none is logged, (n,) [m/s].
        lanes: Index into the log's lane names; -1 where none is logged, (n,).
        offsets: Logged place along the lane; NaN where none is logged, (n,) [m].
    """

    places: Floats
    moves: Floats
    spans: Floats
    yaws: Floats
    speeds: Floats
    lanes: Ints
    offsets: Floats

    def __len__(self) -> int:
        return len(self.places)

    @property
    def lengths(self) -> Floats:
        """Distance of each step, (n,) [m]."""
        return np.asarray(np.hypot(self.moves[:, 0], self.moves[:, 1]))

    def where(self, rows: Bools | Ints) -> LogSample:
        """Return some of its steps."""
        return LogSample(*(getattr(self, name)[rows] for name in self.__slots__))


def sample_of(log: TrafficLog) -> LogSample:
    """Return steps of vehicles that drive, evenly spread over the log; always the same ones."""
    traces = [t for t in log.traces if t.kind == "vehicle" and len(t.times) > 1]
    traces = traces[:: max(1, -(-len(traces) // _USERS))]
    each = max(3, _ROWS // max(len(traces), 1))
    parts = [_steps_of(trace, each) for trace in traces]
    sample = _joined(parts)
    drives = (sample.lengths > _MOVES * np.minimum(sample.spans, 1.0)) | (sample.speeds > 1.0)
    return sample.where(drives)


def _steps_of(trace: Trace, most: int) -> LogSample:
    """Return some steps of a vehicle; those over gaps are left out."""
    spans = np.diff(trace.times)
    whole = np.flatnonzero(spans <= GAP_FACTOR * np.median(spans))
    # Every row is as likely as its neighbours, whatever the number of rows.
    chosen = whole[np.unique(np.linspace(0, len(whole) - 1, min(most, len(whole))).astype(int))]
    ends = chosen + 1
    offsets = trace.offsets[ends] if len(trace.offsets) else np.full(len(ends), np.nan)
    return LogSample(
        places=trace.positions[ends],
        moves=trace.positions[ends, :2] - trace.positions[chosen, :2],
        spans=spans[chosen],
        yaws=trace.yaws[ends],
        speeds=trace.speeds[ends],
        lanes=trace.lanes[ends],
        offsets=offsets,
    )


def _joined(parts: Sequence[LogSample]) -> LogSample:
    """Return the steps of all vehicles together."""
    if not parts:
        one, two = np.empty(0), np.empty((0, 2))
        return LogSample(np.empty((0, 3)), two, one, one, one, np.empty(0, np.int64), one)
    names = LogSample.__slots__
    return LogSample(*(np.concatenate([getattr(part, n) for part in parts]) for n in names))


LEAST = 20
"""Smallest number of steps that can show that something is wrong."""

_BESIDE = 1.5
"""Distance of a front from the side of a lane that counts as on it [m]."""

_REACH = 12.0
"""Largest distance from a lane's centre at which the lane is looked at [m]."""

_ALIGNED = np.cos(np.radians(50.0))
"""Cosine of the largest angle between a vehicle's way and a lane that counts as its own."""

_MANY = 0.15
"""Share of steps off the lanes from which on a log is doubted."""

_SHIFT = 3.0
"""Smallest shift of a whole log that is said [m]."""

_NONSENSE = 20.0
"""Median distance from the lanes from which on a film would be nonsense [m]."""

_HEIGHT = 3.0
"""Median distance of vehicles above or below their lanes from which on it is said [m]."""

_TRIED = 300
"""Number of steps with which explanations are tried."""

_FITS = 0.8
"""Share of these steps that must lie on lanes for an explanation to be said."""

_FIT_NOT = 0.5
"""Largest share of steps on lanes as they are logged for places to be called swapped or so."""

_EXTENT = 20.0
"""Smallest extent of a log after a change; on one spot everything fits [m]."""

_RATIOS = (0.7, 1.4)
"""Logged speeds over distances by which an explanation is confirmed."""


_ALIKE = 0.6
"""Share of steps that must be shifted alike for a shift of the whole log."""

_ROUNDS = 12
"""Rounds of fitting a shift."""

Geometries = Any
"""A geometry of shapely, or an array of them."""


class LaneMap:
    """Finds lanes near places."""

    def __init__(self, network: Network) -> None:
        lanes = network.lanes.values()
        walkable = {"crossing", "walkingarea"}
        self.lanes = [e for e in lanes if network.edges[e.edge_id].function not in walkable]

    @cached_property
    def widths(self) -> Floats:
        """Widths of all lanes, (n,) [m]."""
        return np.array([lane.width for lane in self.lanes])

    @cached_property
    def lines(self) -> Geometries:
        """Centre lines of all lanes, (n,)."""
        points = np.concatenate([lane.shape[:, :2] for lane in self.lanes])
        owners = np.repeat(np.arange(len(self.lanes)), [len(lane.shape) for lane in self.lanes])
        return np.asarray(shapely.linestrings(points, indices=owners))

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Index of the lines."""
        return shapely.STRtree(self.lines)

    def on_lanes(self, places: Floats, moves: Floats) -> Bools:
        """Return which fronts are on some lane and move along it, (n,).

        Args:
            places: x and y, (n, 2) [m].
            moves: Ways of their last steps, (n, 2) [m].
        """
        points = shapely.points(places)
        rows, index = self.tree.query(points, predicate="dwithin", distance=_REACH)
        lines, owners = self.lines[index], points[rows]
        near = shapely.distance(owners, lines) <= self.widths[index] / 2 + _BESIDE
        ways = _ways(lines, owners)
        fits = np.zeros(len(places), dtype=np.bool_)
        fits[rows[near & _aligned(ways, moves[rows])]] = True
        return fits

    def distances(self, places: Floats) -> Floats:
        """Return the distance of each place from the nearest lane's centre, (n,) [m]."""
        points = shapely.points(places)
        nearest = self.tree.nearest(points)
        return np.asarray(shapely.distance(points, self.lines[nearest]))


@dataclass(frozen=True, slots=True, eq=False)
class _OwnLanes:
    """How fronts lie to the lanes that the log names for them.

    Attributes:
        known: Which steps name a lane of the network, (n,).
        distances: From that lane's centre, NaN where there is none, (n,) [m].
        on: Which are on that lane, (n,).
        shifts: From the logged place on that lane to the front; NaN if unknown, (n, 3) [m].
        sides: Unit vectors to the left of that lane, (n, 2).
        aside: How far the front is to the left of it; NaN if unknown, (n,) [m].
    """

    known: Bools
    distances: Floats
    on: Bools
    shifts: Floats
    sides: Floats
    aside: Floats


def place_findings(
    sample: LogSample, names: Sequence[str], network: Network
) -> tuple[Finding, ...]:
    """Return what is wrong with the places of a log.

    Args:
        sample: Steps of the log.
        names: The log's lane ids.
        network: The roads.
    """
    if len(sample) < LEAST:
        return ()
    own = _own_lanes(sample, [network.lanes.get(name) for name in names])
    lane_map = LaneMap(network)
    on = own.on.copy()
    off = np.flatnonzero(~on)
    if len(off):
        on[off] = lane_map.on_lanes(sample.places[off, :2], sample.moves[off])
    shift = _shift(own)
    astray = 1.0 - float(on.mean())
    if astray < _MANY and np.hypot(*shift) < _SHIFT:
        return _heights(own, on)
    # The logged place on a lane tells more than the distance from it.
    far = np.linalg.norm(own.shifts[:, :2], axis=1)
    aside = np.where(on, 0.0, own.distances)
    distances = np.where(np.isfinite(far), far, aside)
    rest = np.flatnonzero(~np.isfinite(distances))
    if len(rest):
        distances[rest] = lane_map.distances(sample.places[rest, :2])
    typical = float(np.median(distances))
    why = _explained(sample, lane_map, shift, network)
    # Vehicles on roads along which a log is shifted stay on their lanes.
    far_off = float(np.median(distances[~on])) if astray >= _MANY else typical
    hopeless = max(typical, float(np.hypot(*shift))) > _NONSENSE
    return (Finding("places", _misplaced(astray, far_off, why), hopeless),)


def explanation(sample: LogSample, names: Sequence[str], network: Network) -> str:
    """Return the change after which a misplaced log lies on the lanes, as a clause, or nothing.

    Args:
        sample: Steps of the log.
        names: The log's lane ids.
        network: The roads.
    """
    own = _own_lanes(sample, [network.lanes.get(name) for name in names])
    return _explained(sample, LaneMap(network), _shift(own), network)


def _misplaced(astray: float, typical: float, why: str) -> str:
    """Return what is wrong with places in words."""
    share = f"{100 * astray:.0f} % of the driving vehicles are off the lanes that they drive on"
    why = why or "the log seems to be of another network, or of another version of this one"
    return (
        f"{share}, typically by {_metres(typical)} m; {why}; give network and log of one simulation"
    )


def _own_lanes(sample: LogSample, lanes: Sequence[Lane | None]) -> _OwnLanes:
    """Return how fronts lie to the lanes that the log names for them."""
    count = len(sample)
    distances, on = np.full(count, np.nan), np.zeros(count, dtype=np.bool_)
    shifts, sides = np.full((count, 3), np.nan), np.full((count, 2), np.nan)
    feet = np.full((count, 2), np.nan)
    for number in np.unique(sample.lanes[sample.lanes >= 0]).tolist():
        lane = lanes[number]
        if lane is None:
            continue
        rows = np.flatnonzero(sample.lanes == number)
        points = shapely.points(sample.places[rows, :2])
        line = shapely.LineString(lane.shape[:, :2])
        distances[rows] = shapely.distance(points, line)
        sides[rows] = _ways(line, points) @ [[0.0, 1.0], [-1.0, 0.0]]
        feet[rows] = shapely.get_coordinates(shapely.shortest_line(line, points))[::2]
        on[rows] = distances[rows] <= lane.width / 2 + _BESIDE
        # SUMO's length of a lane may differ from that of its shape.
        along = arc_length(lane.shape[:, :2])
        at = sample.offsets[rows] * along[-1] / max(lane.length, 1e-9)
        logged = np.column_stack([np.interp(at, along, axis) for axis in lane.shape.T])
        shifts[rows] = np.where(np.isfinite(at)[:, None], sample.places[rows] - logged, np.nan)
    # Where a lane is a point it has no side, and says nothing of shifts.
    lengths = np.linalg.norm(sides, axis=1, keepdims=True)
    sides /= np.where(lengths == 0.0, 1.0, lengths)
    aside = ((sample.places[:, :2] - feet) * sides).sum(axis=1)
    return _OwnLanes(np.isfinite(distances), distances, on, shifts, sides, aside)


def _shift(own: _OwnLanes) -> Floats:
    """Return by how much the whole log is shifted, (2,) [m]; 0 where it is not one shift."""
    shifts = own.shifts[np.isfinite(own.shifts[:, 0]), :2]
    if len(shifts) >= LEAST:
        shift = np.median(shifts, axis=0)
        alike = np.linalg.norm(shifts - shift, axis=1) < _SHIFT
    else:
        sides, aside = own.sides[own.known], own.aside[own.known]
        shift = _sideways(sides, aside) if len(aside) >= LEAST else np.zeros(2)
        alike = np.abs(sides @ shift - aside) < _SHIFT
    return np.asarray(shift if len(alike) and alike.mean() > _ALIKE else np.zeros(2))


def _sideways(sides: Floats, aside: Floats) -> Floats:
    """Return the shift that lets most fronts lie as far aside as they do, (2,) [m].

    Args:
        sides: Unit vectors to the left of the lanes, (n, 2).
        aside: How far the fronts are to the left, (n,) [m].
    """
    weights: Floats = np.ones(len(aside))
    shift: Floats = np.zeros(2)
    for _ in range(_ROUNDS):
        # Weights that fall with the error give the least sum of absolute errors.
        scaled = sides * weights[:, None]
        solved = np.linalg.lstsq(scaled.T @ sides, scaled.T @ aside, rcond=1e-3)
        shift = np.asarray(solved[0], dtype=np.float64)
        weights = 1.0 / np.maximum(np.abs(sides @ shift - aside), 0.05)
    return shift


def _heights(own: _OwnLanes, on: Bools) -> tuple[Finding, ...]:
    """Return what is wrong with the heights of fronts that lie on their lanes."""
    rises = own.shifts[on & np.isfinite(own.shifts[:, 2]), 2]
    rise = float(np.median(rises)) if len(rises) >= LEAST else 0.0
    if abs(rise) < _HEIGHT:
        return ()
    side = "above" if rise > 0.0 else "below"
    text = (
        f"vehicles are typically {_metres(rise)} m {side} their lanes: z of log and network have"
        " different zeros; write both anew from one network"
    )
    return (Finding("heights", text),)


# Explanations ------------------------------------------------------------------------------

_Change = Callable[[Floats], Floats]


def _explained(sample: LogSample, lane_map: LaneMap, shift: Floats, network: Network) -> str:
    """Return the change after which the log lies on the lanes, as a clause, or nothing."""
    some = sample.where(np.unique(np.linspace(0, len(sample) - 1, _TRIED).astype(int)))
    places = some.places[:, :2]
    # A log that is shifted along roads stays on them.
    astray = lane_map.on_lanes(places, some.moves).mean() <= _FIT_NOT
    changes = _shifts(shift, network) if astray or shift.any() else []
    for words, undo in [*changes, *(_misreadings(network) if astray else [])]:
        change = partial(_in_files, undo, network.location)
        moves = change(some.moves) - change(np.zeros((1, 2)))
        moved = change(places)
        fits = np.ptp(moved, axis=0).max() >= _EXTENT
        fits = fits and lane_map.on_lanes(moved, moves).mean() >= _FITS
        if fits and _as_fast(moves, some):
            return words
    return ""


def _as_fast(moves: Floats, sample: LogSample) -> bool:
    """Return whether ways are as long as logged speeds say, or speeds say nothing.

    Args:
        moves: Ways of the steps after a change, (n, 2) [m].
        sample: The steps as they are logged.
    """
    lengths = np.hypot(moves[:, 0], moves[:, 1])
    moving = np.isfinite(sample.speeds) & (sample.speeds > 1.0) & (lengths > 0.0)
    if moving.sum() < LEAST:
        return True
    ratio = np.median(sample.speeds[moving] * sample.spans[moving] / lengths[moving])
    return bool(_RATIOS[0] < ratio < _RATIOS[1])


def _in_files(change: _Change, location: Location, places: Floats) -> Floats:
    """Return our coordinates of places, (n, 2) [m], whose coordinates in files are changed."""
    return location.inside(change(location.outside(places)))


def _shifts(shift: Floats, network: Network) -> list[tuple[str, _Change]]:
    """Return by what a log may be shifted, and what undoes it in its file."""
    location = network.location
    offset = location.outside(location.net_offset)
    # A shift by the offset is likelier to be that than another one.
    changes: list[tuple[str, _Change]] = [
        ("the network's netOffset seems to be missing in it", lambda p: p + offset),
        ("the network's netOffset seems to be added twice", lambda p: p - offset),
    ]
    if np.hypot(*offset) < 10.0 * _SHIFT:
        changes.clear()
    if shift.any():
        changes.append((f"the log lies {in_compass(shift)} of the network", lambda p: p - shift))
    return changes


def _misreadings(network: Network) -> list[tuple[str, _Change]]:
    """Return what a log's coordinates may be, and what undoes it in its file."""
    outside = network.location.outside
    shapes = np.concatenate([lane.shape[:, :2] for lane in network.lanes.values()])
    low, high = (outside(end) for end in (shapes.min(axis=0), shapes.max(axis=0)))
    return [
        ("x and y seem to be swapped", lambda p: p[:, ::-1]),
        ("y seems to count downwards, as in pictures", lambda p: p * [1, -1]),
        (
            "y seems to count downwards, as in pictures",
            lambda p: [0, low[1] + high[1]] + p * [1, -1],
        ),
        ("its places seem to be feet, not metres", lambda p: p * 0.3048),
        ("its places seem to be kilometres, not metres", lambda p: p * 1e3),
        ("its places seem to be centimetres, not metres", lambda p: p * 1e-2),
    ]


def in_compass(shift: Floats) -> str:
    """Return a shift in words, such as `25 m east and 3 m south`."""
    words = zip(shift.tolist(), (("east", "west"), ("north", "south")), strict=True)
    parts = [f"{_metres(by)} m {way[by < 0]}" for by, way in words if abs(by) >= 0.5]
    return " and ".join(parts)


def _metres(length: float) -> str:
    """Return a length in words: small ones with a decimal [m]."""
    return f"{abs(length):.0f}" if abs(length) >= 10.0 else f"{abs(length):.2g}"


def _ways(lines: Geometries, points: Geometries) -> Floats:
    """Return the directions of lines beside points, along a short piece, (n, 2) [m]."""
    along = shapely.line_locate_point(lines, points)
    first = np.maximum(along - 0.5, 0.0)
    ends = [shapely.line_interpolate_point(lines, at) for at in (first, first + 1.0)]
    ways = shapely.get_coordinates(ends[1]) - shapely.get_coordinates(ends[0])
    return np.asarray(ways)


def _aligned(ways: Floats, moves: Floats) -> Bools:
    """Return which moves follow a way; those too short to tell do, (n,)."""
    lengths = np.linalg.norm(moves, axis=1)
    sides = lengths * np.linalg.norm(ways, axis=1)
    along = (ways * moves).sum(axis=1)
    return np.asarray((along >= _ALIGNED * sides) | (lengths < 0.3))
