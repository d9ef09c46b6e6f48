"""Lamps of vehicles whose log has no signals, derived from how they move.

All is decided once for a whole stretch of motion, as spans of time, so that no lamp
flickers from frame to frame: brake lamps with two thresholds and a shortest time,
indicators for turns that lie ahead on the path and for lane changes.

References:
    UN Regulation 13-H, 5.2.22.4: retarders light brake lamps above 1.3 m/s^2 and do not
    below 0.7 m/s^2. At speed, SUMO's own rule asks for more (MSVehicle, pseudo friction): its
    drivers dawdle, and every second car of a motorway would flash.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Remark

_STEP = 0.1  # [s]
_MEAN = 9
"""Steps over which speeds are averaged before they are differentiated."""

_BRAKES, _RELEASES = 1.3, 0.55
"""Slowing down harder than the one lights brake lamps [m/s^2]; less than this share of what
lights them puts them out."""

_FRICTION = (0.05, 0.005)
"""Without brakes, SUMO's vehicles lose this much by speed and speed squared [1/s, 1/m]."""

_STANDS, _GOES = 0.1, 0.4
"""Slower than the one is standing, with a foot on the brake; faster than the other is not [m/s]."""

_SHORTEST = 0.4
"""Lamps are not lit, and not put out, for less [s]."""

_WAY = 1.0  # between points of the path [m]
_ARC = 4.0
"""Of path over which its curvature is taken [m]."""

_WIDEST = 32.0
"""Bends of a larger radius are the road's own [m]."""

_LEAST_TURN = float(np.radians(35.0))
"""Smaller changes of direction are no turns [rad]."""

_WARNING_TIME, _WARNING_WAY = 3.0, 30.0
"""Indicators are set this long, or on this way, before a turn, whichever is earlier [s, m]."""

_LANE_CHANGE = 2.0
"""Indicators are set this long before a lane change [s]."""

Spans = tuple[tuple[float, float], ...]
"""Begins and ends [s], in order."""


@dataclass(frozen=True, slots=True)
class DerivedLamps:
    """When the lamps of a stretch of motion shine.

    Attributes:
        spans: By role: `brake`, `left`, `right`, `reverse`.
    """

    spans: Mapping[str, Spans]

    def roles_at(self, time: float) -> frozenset[str]:
        """Return roles that shine at a time [s]; indicators between their blinks, too."""
        return frozenset(
            role
            for role, spans in self.spans.items()
            if any(begin <= time <= end for begin, end in spans)
        )


def derived_lamps(
    piece: MotionPiece, remarks: Sequence[Remark] = (), *, steers: bool = True
) -> DerivedLamps:
    """Find when the lamps of a vehicle would shine.

    Args:
        piece: A stretch of its motion.
        remarks: On its trajectory; `reversing`, `lane change` and `parking` count.
        steers: Whether it chooses its way, and so shows it; not on rails.
    """
    count = max(2, int(np.ceil((piece.end - piece.begin) / _STEP)) + 1)
    times = np.linspace(piece.begin, piece.end, count)
    motion = piece.sample(times)
    parked = _during(remarks, "parking")
    spans = {
        "brake": _without(_spans(times, _braking(times, motion.speeds)), parked),
        "reverse": _during(remarks, "reversing"),
    }
    if steers:
        moves = [*_turns(times, motion), *_lane_changes(piece, remarks)]
        for role, side in (("left", 1), ("right", -1)):
            spans[role] = _merged((move.begin, move.end) for move in moves if move.side == side)
    return DerivedLamps({role: some for role, some in spans.items() if some})


def _braking(times: Floats, speeds: Floats) -> Bools:
    """Whether brake lamps are lit, (n,)."""
    if len(times) < 3 or float(np.max(speeds)) < _STANDS:
        return np.zeros(len(times), dtype=np.bool_)  # what never moves has no driver
    padded = np.pad(speeds, _MEAN // 2, mode="edge")
    mean = np.convolve(padded, np.ones(_MEAN) / _MEAN, mode="valid")
    change = np.gradient(mean, times)
    lost = np.maximum((_FRICTION[0] + _FRICTION[1] * mean) * mean, _BRAKES)
    wants = (change < -lost) | (speeds < _STANDS)
    leaves = (change > -_RELEASES * lost) & (speeds > _GOES)
    lit = _held(wants, leaves)
    least = round(_SHORTEST / _STEP)
    return _open(~_open(~lit, least), least)


def _held(sets: Bools, clears: Bools) -> Bools:
    """What stays as it was between two thresholds, (n,)."""
    state = np.where(sets, 1, np.where(clears, 0, -1))
    known = np.maximum.accumulate(np.where(state >= 0, np.arange(len(state)), 0))
    return np.asarray(state[known] == 1)


def _open(on: Bools, least: int) -> Bools:
    """Runs of fewer than so many steps are dropped, (n,)."""
    kept = on.copy()
    for first, last in _runs(on):
        if last - first < least and first > 0 and last < len(on):
            kept[first:last] = False
    return kept


def _runs(on: Bools) -> Iterator[tuple[int, int]]:
    """First index and the one behind the last of each run."""
    edges = np.diff(np.concatenate([[0], on.astype(np.int8), [0]]))
    yield from zip(
        np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True
    )


def _spans(times: Floats, on: Bools) -> Spans:
    """Runs as spans of time."""
    last = len(times) - 1
    return tuple((float(times[a]), float(times[min(b, last)])) for a, b in _runs(on))


@dataclass(frozen=True, slots=True)
class _Indicated:
    """When indicators of one side are set.

    Attributes:
        begin: [s].
        end: [s].
        side: 1 for left, -1 for right.
    """

    begin: float
    end: float
    side: int


def _turns(times: Floats, motion: Motion) -> Iterator[_Indicated]:
    """Indicators for turns."""
    # Take headings of short chords along the path.
    ways = motion.travelled - motion.travelled[0]
    places = np.arange(0.0, float(ways[-1]), _WAY)
    if len(places) < 2 * _ARC / _WAY:
        return
    points = np.column_stack([np.interp(places, ways, c) for c in motion.positions[:, :2].T])
    arc = int(_ARC / _WAY)
    chords = points[arc:] - points[:-arc]
    headings = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    middles = places[:-arc] + _ARC / 2.0
    curvature = np.gradient(headings, _WAY)
    # Tight bends that turn far enough are turns.
    for side in (1, -1):
        for first, last in _runs(side * curvature > 1.0 / _WIDEST):
            turned = side * (headings[last - 1] - headings[first])
            if turned < _LEAST_TURN:
                continue
            begins, ends = float(middles[first]), float(middles[last - 1])
            early = float(np.interp(max(begins - _WARNING_WAY, 0.0), ways, times))
            begin = min(early, float(np.interp(begins, ways, times)) - _WARNING_TIME)
            yield _Indicated(begin, float(np.interp(ends, ways, times)), side)


def _lane_changes(piece: MotionPiece, remarks: Iterable[Remark]) -> Iterator[_Indicated]:
    """Indicators for lane changes; the way that the vehicle takes tells the side."""
    for remark in remarks:
        if remark.kind != "lane change" or remark.end < piece.begin or remark.begin > piece.end:
            continue
        ends = np.clip([remark.begin, remark.end], piece.begin, piece.end)
        motion = piece.sample(ends)
        move = motion.positions[1, :2] - motion.positions[0, :2]
        # In a bend, half of the turn is the road's.
        turn = (motion.yaws[1] - motion.yaws[0] + np.pi) % (2.0 * np.pi) - np.pi
        yaw = motion.yaws[0] + turn / 2.0
        side = 1 if np.cos(yaw) * move[1] - np.sin(yaw) * move[0] > 0.0 else -1
        yield _Indicated(float(ends[0]) - _LANE_CHANGE, float(ends[1]), side)


def _during(remarks: Iterable[Remark], kind: str) -> Spans:
    """When remarks of a kind hold."""
    return tuple((remark.begin, remark.end) for remark in remarks if remark.kind == kind)


def _without(spans: Spans, others: Spans) -> Spans:
    """Spans that end where one of others begins."""
    kept = []
    for begin, end in spans:
        cuts = [first for first, last in others if first < end and last > begin]
        if not cuts or min(cuts) > begin:
            kept.append((begin, min([end, *cuts])))
    return tuple(kept)


def _merged(spans: Iterable[tuple[float, float]]) -> Spans:
    """Spans in order; those that meet, or nearly, are one."""
    found: list[tuple[float, float]] = []
    for begin, end in sorted(spans):
        if found and begin <= found[-1][1] + 1.0:
            found[-1] = (found[-1][0], max(end, found[-1][1]))
        else:
            found.append((begin, end))
    return tuple(found)
