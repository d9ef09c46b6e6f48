"""Who is in a vehicle log, read in one pass; memory grows with people, not with time."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.roster import Passage, Point, RoadUser, UserPlace
from sumo3dviz_pt.model.traffic import VehicleType, unique_ids
from sumo3dviz_pt.sumo.classes import TYPE_OF_KIND
from sumo3dviz_pt.sumo.fcd import stream_rows
from sumo3dviz_pt.sumo.traces import Key, RowsOfUsers, in_order, riding_rows, table_of
from sumo3dviz_pt.sumo.types import default_vehicle_type

_GAP = 1.5
"""A step longer than this many steps of the log lacks rows."""

_LEAP = 15.0
"""What a step may exceed one and a half times speed x time by, before it is a leap [m]."""

_FASTEST = 100.0
"""Where no speed is logged: no road or rail vehicle is faster [m/s]."""


def read_roster(
    paths: Iterable[Path],
    *,
    types: Mapping[str, VehicleType],
    near: Point | None = None,
    at: float | None = None,
    allow_truncated: bool = False,
) -> tuple[RoadUser, ...]:
    """Read who is in vehicle logs.

    Ways are sums of straight lines between samples. Steps in which rows are missing, or that
    lead further than anyone drives, count neither as way nor as time.

    Args:
        paths: Logs that belong together, such as vehicles and persons apart.
        types: Known vTypes; others get SUMO's defaults.
        near: Note who passes this point, and when.
        at: Note where everyone is at this time [s].
        allow_truncated: Use the complete steps of a log that breaks off.

    Returns:
        Everyone, in order of first appearance, under the ids by which cameras ride; riders
        only while they walk.

    Raises:
        InputError: If a log is damaged, breaks off or holds no step.
    """
    census = _RowCensus(near, nan if at is None else at)
    lanes = stream_rows(paths, census.count, allow_truncated=allow_truncated)
    found = [_user(key, tally, lanes=lanes, types=types) for key, tally in census.tallies.items()]
    found.sort(key=lambda user: user.begin)
    return tuple(replace(user, id=own) for user, own in zip(found, unique_ids(found), strict=True))


@dataclass(slots=True)
class _UserTally:
    """What is known of one road user so far.

    Attributes:
        begin: First time [s].
        last: Its last sample, (10,).
        way: Driven [m].
        seconds: During which it drove that [s].
        fastest: [m/s].
        lanes: Indices, each unlike the one before.
        passage: Past the asked point.
        place: x, y [m] and lane at the asked time.
    """

    begin: float
    last: Floats
    way: float = 0.0
    seconds: float = 0.0
    fastest: float = 0.0
    lanes: array[int] = field(default_factory=lambda: array("i"))
    passage: Passage | None = None
    place: tuple[float, float, int] | None = None


class _RowCensus:
    """Counts blocks of rows."""

    def __init__(self, near: Point | None, at: float) -> None:
        self.tallies: dict[Key, _UserTally] = {}
        self._near, self._at = near, at

    def count(self, rows: RowsOfUsers, steps: Sequence[float]) -> None:
        """Count the rows of a block in."""
        step = float(np.median(np.diff(np.sort(steps)))) if len(steps) > 1 else np.inf
        riding = riding_rows(rows)
        for key, buffer in rows.items():
            table = table_of(buffer)
            table = in_order(table[~riding[key]] if key in riding else table)
            tally = self.tallies.get(key)
            # What was written out of order has been passed by.
            table = table if tally is None else table[table[:, 0] > tally.last[0]]
            if not len(table):
                continue
            if tally is None:
                tally = self.tallies[key] = _UserTally(float(table[0, 0]), table[0].copy())
            self._add(tally, np.vstack([tally.last, table]), step)

    def _add(self, tally: _UserTally, table: Floats, step: float) -> None:
        """Count samples of one road user in; the first row was counted before."""
        spans = np.diff(table[:, 0])
        ways = np.linalg.norm(np.diff(table[:, 1:4], axis=0), axis=1)
        speeds = np.abs(table[:, 5])
        driven = (spans <= _GAP * step) & ~_leaps(speeds, spans, ways)
        tally.way += float(ways[driven].sum())
        tally.seconds += float(spans[driven].sum())
        moving = driven & (spans > 0.0)
        shown = ways[moving] / spans[moving]
        known = speeds[np.isfinite(speeds)]
        tally.fastest = max(tally.fastest, *(known if len(known) else shown).tolist(), 0.0)
        tally.last = table[-1].copy()
        _note_lanes(tally.lanes, table[:, 7])
        # After a gap one stands at the sample itself.
        starts = np.where(driven[:, None], table[:-1], table[1:])
        if self._near is not None:
            tally.passage = _joined(tally.passage, _passage(starts, table[1:], self._near))
        tally.place = _place_at(starts, table[1:], self._at) or tally.place


def _leaps(speeds: Floats, spans: Floats, ways: Floats) -> Bools:
    """Which steps lead further than anyone drives, (n - 1,)."""
    fastest = np.fmax(speeds[:-1], speeds[1:])
    fastest = np.where(np.isfinite(fastest), fastest, _FASTEST)
    return np.asarray(ways > 1.5 * fastest * spans + _LEAP)


def _note_lanes(lanes: array[int], column: Floats) -> None:
    """Add the lanes of samples to those before, each once in a row."""
    known = column[column >= 0].astype(np.int64)
    if not len(known):
        return
    before = lanes[-1] if lanes else -1
    changed = np.diff(known, prepend=before) != 0
    lanes.extend(known[changed].tolist())


def _passage(starts: Floats, ends: Floats, near: Point) -> Passage | None:
    """The way past a point along straight lines, (n, 10) each; None outside its radius."""
    here = np.array([near.x, near.y])
    from_point, step = starts[:, 1:3] - here, ends[:, 1:3] - starts[:, 1:3]
    times, spans = starts[:, 0], ends[:, 0] - starts[:, 0]
    square = np.maximum((step**2).sum(axis=1), 1e-12)
    along = (from_point * step).sum(axis=1)
    nearest = np.clip(-along / square, 0.0, 1.0)
    distances = np.linalg.norm(from_point + nearest[:, None] * step, axis=1)
    inside = np.flatnonzero(distances <= near.radius)
    if not len(inside):
        return None
    # Where each line enters and leaves the circle, as shares of the line.
    rest = (from_point**2).sum(axis=1) - near.radius**2
    root = np.sqrt(np.maximum(along**2 - square * rest, 0.0))
    enters, leaves = (np.clip((-along + sign * root) / square, 0.0, 1.0) for sign in (-1, 1))
    first, last, best = inside[0], inside[-1], int(np.argmin(distances))
    return Passage(
        begin=float(times[first] + enters[first] * spans[first]),
        end=float(times[last] + leaves[last] * spans[last]),
        time=float(times[best] + nearest[best] * spans[best]),
        distance=float(distances[best]),
    )


def _joined(before: Passage | None, after: Passage | None) -> Passage | None:
    """Two parts of one way past a point."""
    if before is None or after is None:
        return before or after
    best = min(before, after, key=lambda each: each.distance)
    return replace(best, begin=before.begin, end=after.end)


def _place_at(starts: Floats, ends: Floats, at: float) -> tuple[float, float, int] | None:
    """Place and lane at a time, along straight lines; None before, after and in gaps."""
    found = np.flatnonzero((starts[:, 0] <= at) & (at <= ends[:, 0]))
    if not len(found):
        return None
    start, end = starts[found[0]], ends[found[0]]
    share = (at - start[0]) / max(end[0] - start[0], 1e-9)
    x, y = start[1:3] + share * (end[1:3] - start[1:3])
    return float(x), float(y), int((end if share > 0.5 else start)[7])


def _user(
    key: Key, tally: _UserTally, *, lanes: Sequence[str], types: Mapping[str, VehicleType]
) -> RoadUser:
    """A tally in words."""
    kind, name, type_id = key[0], key[1], key[2] or TYPE_OF_KIND[key[0]]
    known = types.get(type_id) or default_vehicle_type(type_id, kind)
    used = [lanes[index] for index in tally.lanes if not lanes[index].startswith(":")]
    edges = [_edge_of(lane, kind) for lane in used]
    standing = abs(float(np.nan_to_num(tally.last[5])))
    x, y, lane = tally.place or (nan, nan, -1)
    return RoadUser(
        id=name,
        kind=kind,
        type_id=type_id,
        vclass=known.vclass,
        begin=tally.begin,
        end=float(tally.last[0]),
        length=tally.way,
        mean_speed=tally.way / tally.seconds if tally.seconds else standing,
        max_speed=tally.fastest,
        lanes=len(set(used)),
        edges=tuple(edge for n, edge in enumerate(edges) if not n or edge != edges[n - 1]),
        place=None if tally.place is None else UserPlace(x, y, lanes[lane] if lane >= 0 else ""),
        passage=tally.passage,
    )


def _edge_of(lane: str, kind: str) -> str:
    """The edge of a lane; persons are logged by their edge."""
    edge, _, number = lane.rpartition("_")
    return edge if edge and number.isdigit() and kind == "vehicle" else lane
