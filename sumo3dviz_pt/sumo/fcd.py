"""Reads the vehicle log, SUMO's floating car data (FCD), and lists who is in it.

The log is streamed. Steps before the asked window are left out, and the reading stops at the first
step past it. Rows are packed into one buffer of doubles per road user.

Road users are listed in one pass. A log that was read before is taken from the user's cache. Any
other is streamed, and memory grows with road users, not with time. For messages, a quick search of
the whole log finds when a road user is in it.
"""

from __future__ import annotations

import html
import logging
from array import array
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import inf, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import (
    FASTEST,
    GAP_FACTOR,
    Passage,
    Point,
    RoadUser,
    TrafficLog,
    UserPlace,
    unique_ids,
)
from sumo3dviz_pt.sumo.belonging import coordinates_of, put_in_net
from sumo3dviz_pt.sumo.formats import format_of
from sumo3dviz_pt.sumo.guesses import TypesOfUsers
from sumo3dviz_pt.sumo.plausibility.log import TypeChanges, backward_steps, changed_types, row_twice
from sumo3dviz_pt.sumo.reader import CachedLog, Drain, LogReader, cache_log, cached_log, place_of
from sumo3dviz_pt.sumo.rows import (
    Key,
    RowsOfUsers,
    build_traces,
    in_order,
    rides_of,
    riding_rows,
    rows_of,
    table_of,
    taken_times,
)

logger = logging.getLogger(__name__)


def read_trajectories(
    paths: Iterable[Path],
    *,
    begin: float | None = None,
    end: float | None = None,
    margin: float = 0.0,
    allow_truncated: bool = False,
    location: Location | None = None,
) -> TrafficLog:
    """Read vehicle logs.

    Steps out of order are sorted; of repeated ones the first counts; a note says so. Persons and
    containers at the position of a vehicle ride in it and are left out while they do.
    An id that comes back with another type after a gap, or elsewhere, makes another trace with the
    same key; one that goes on with another type keeps its first one, and a note says so.
    Steps before `begin` are not checked. A log is read up to its first step after `end`, so
    steps that are written out of order behind that one are missed, and `TrafficLog.end` is the
    last step that was read. What is read of large logs is kept in the user's cache.

    Args:
        paths: Logs that belong together, such as one of vehicles and one of persons.
        begin: First time to keep [s]; None keeps all from the start.
        end: Last time to keep [s]; None keeps all to the end.
        margin: Time to keep before and after these, for smoothing [s].
        allow_truncated: Whether to use the complete steps of a log that breaks off.
        location: Of the network, so that longitudes and latitudes, or positions without the
            net's offset, become net coordinates.

    Returns:
        Traces with SI units, yaws counter-clockwise from east, slopes within 30 degrees.

    Raises:
        InputError: If a log is damaged, breaks off, holds no step or none in the
            window, or lacks an attribute that drawing needs.
    """
    window = (-inf if begin is None else begin, inf if end is None else end)
    # All of a log is the same with and without a margin, and is kept once.
    margin = 0.0 if begin is None and end is None else margin
    files = [Path(path) for path in paths]
    place = place_of(files, (window, margin, location))
    cached = None if place is None else cached_log(place)
    if cached is None:
        log, whole, notes = _read_logs(files, window, margin, allow_truncated, location)
        cached = CachedLog(log, notes)
        if place is not None and whole:
            cache_log(place, cached)
    for number, note in enumerate(cached.notes):
        once = {"once": f"disorder {number} of {files[0]}"}
        logger.warning("%s", note, extra=once)
    return cached.log


def whole_log(files: Sequence[Path], location: Location | None) -> TrafficLog | None:
    """Return all of a log that was read before, as `read_trajectories` gave it, if it was cached.

    Args:
        files: Logs that belong together.
        location: Of the network.
    """
    place = place_of(files, ((-inf, inf), 0.0, location))
    cached = None if place is None else cached_log(place)
    return None if cached is None else cached.log


class _Reading(NamedTuple):
    """What was read, whether no log breaks off, and what is to be noted."""

    log: TrafficLog
    whole: bool
    notes: tuple[str, ...]


def _read_logs(
    files: list[Path],
    within: tuple[float, float],
    margin: float,
    allow_truncated: bool,
    location: Location | None,
) -> _Reading:
    """Return what `read_trajectories` gives, and what else is known of the logs.

    Args:
        files: The logs.
        within: First and last time to keep [s].
        margin: Time to keep before and after these [s].
        allow_truncated: Whether to use a log that breaks off.
        location: Of the network.
    """
    window = (within[0] - margin, within[1] + margin)
    lanes: dict[str, int] = {}
    rows: RowsOfUsers = {}
    steps: set[float] = set()
    whole = True
    notes: list[str] = []
    changed: dict[str, float] = {}
    ridden: dict[str, list[float]] = {}
    for file in files:
        reader = LogReader(file, window, lanes)
        reader.read(allow_truncated=allow_truncated)
        whole = whole and not reader.breaks_off
        changed |= {f"{kind}:{name}": time for (kind, name), time in reader.changed.items()}
        for name, some in reader.taken.items():
            ridden.setdefault(name, []).extend(some)
        steps.update(reader.steps)
        put_in_net(reader.rows, coordinates_of(file, location), location)
        disorder = (backward_steps(reader.steps), row_twice(reader.rows))
        notes += [f"{file}: {text}" for text in disorder if text]
        _move(reader.rows, rows)
    if len(files) > 1 and not notes and (twice := row_twice(rows, logs=len(files))):
        notes.append(f"{' and '.join(map(str, files))}: {twice}")
    times = np.sort(np.fromiter(steps, dtype=np.float64, count=len(steps)))
    _check_steps(times, window, files, within=within)
    step = round(float(np.median(np.diff(times))), 6) if len(times) > 1 else 0.0
    changes = changed_types(rows, step=step)
    notes += [f"{files[0]}: {changes}"] if changes else []
    for name, some in taken_times(rows).items():
        ridden.setdefault(name, []).extend(some)
    log = TrafficLog(
        traces=build_traces(rows),
        lane_names=tuple(lanes),
        begin=float(times[0]),
        end=float(times[-1]),
        step=step,
        changed=changed,
        taken={f"vehicle:{name}": rides_of(some, step=step) for name, some in ridden.items()},
    )
    return _Reading(log, whole, tuple(notes))


def stream_rows(
    paths: Iterable[Path],
    drain: Drain,
    *,
    allow_truncated: bool = False,
    location: Location | None = None,
) -> tuple[str, ...]:
    """Pass on the rows of whole vehicle logs in blocks of whole steps, without keeping them.

    Args:
        paths: Logs that belong together.
        drain: Called with the rows of each block and the times of the log's steps until then.
        allow_truncated: Whether to use the complete steps of a log that breaks off.
        location: Of the network, so that all positions become net coordinates.

    Returns:
        Ids of lanes and edges; the rows hold their indices.

    Raises:
        InputError: If a log is damaged, breaks off or holds no step.
    """
    lanes: dict[str, int] = {}
    for file in map(Path, paths):
        placed = _placing(drain, file, location)
        reader = LogReader(file, (-inf, inf), lanes, drain=placed)
        reader.read(allow_truncated=allow_truncated)
        _check_steps(np.array(reader.steps), (-inf, inf), [file], within=(-inf, inf))
        placed(reader.rows, reader.steps)
    return tuple(lanes)


def _placing(drain: Drain, file: Path, location: Location | None) -> Drain:
    """Return a drain that gets net coordinates."""
    known = coordinates_of(file, location)

    def placed(rows: RowsOfUsers, steps: Sequence[float]) -> None:
        put_in_net(rows, known, location)
        drain(rows, steps)

    return placed


def _move(source: RowsOfUsers, target: RowsOfUsers) -> None:
    """Move rows to others, so that nothing is held twice."""
    for key in list(source):
        buffer = source.pop(key)
        if target.setdefault(key, buffer) is not buffer:
            target[key].extend(buffer)


def _check_steps(
    times: Floats,
    window: tuple[float, float],
    files: list[Path],
    *,
    within: tuple[float, float],
) -> None:
    """Refuse a log without steps, or without a step in the window.

    Args:
        times: Times of the log's steps, (n,) [s].
        window: First and last time to keep, margins included [s].
        files: The logs, for messages.
        within: First and last time that a user asked for, for messages [s].
    """
    file = files[0] if files else None
    if not len(times):
        raise InputError("the log holds no time step; run the simulation again", file=file)
    if not ((times >= window[0]) & (times <= window[1])).any():
        raise InputError(
            f"no time step lies {_span(within)}; "
            f"the log goes from {times[0]:.12g} s to {times[-1]:.12g} s",
            file=file,
        )


def _span(span: tuple[float, float]) -> str:
    """Return a span of time [s] in words; either end may be open."""
    if span[1] == inf:
        return f"from {span[0]:g} s on"
    return f"up to {span[1]:g} s" if span[0] == -inf else f"from {span[0]:g} s to {span[1]:g} s"


_LEAP = 15.0
"""A step that exceeds 1.5 x speed x time by more than this is a leap [m]."""


def read_roster(
    paths: Iterable[Path],
    *,
    types: TypesOfUsers,
    near: Point | None = None,
    at: float | None = None,
    allow_truncated: bool = False,
    location: Location | None = None,
) -> tuple[RoadUser, ...]:
    """Read who is in vehicle logs.

    The distance that a road user drives is the sum of the straight lines between its samples.
    Steps in which rows are missing, and steps too long for any vehicle, add neither distance
    nor time.

    Args:
        paths: Logs that belong together, such as one of vehicles and one of persons.
        types: vTypes that files define, and how to guess others.
        near: A point; the result says who passes it, and when.
        at: A time [s]; the result says where everyone is then.
        allow_truncated: Whether to use the complete steps of a log that breaks off.
        location: Of the network, so that all positions become net coordinates.

    Returns:
        Everyone in order of first appearance, under the ids that cameras use. People who ride
        in a vehicle count only while they walk.

    Raises:
        InputError: If a log is damaged, breaks off or holds no step.
    """
    census = _RowCensus(near, nan if at is None else at)
    files = list(map(Path, paths))
    known = whole_log(files, location)
    if known is None:
        lanes = stream_rows(files, census.count, allow_truncated=allow_truncated, location=location)
    else:
        lanes = known.lane_names
        census.count(rows_of(known.traces), [0.0, known.step] if known.step else [0.0])
    users = [_user(key, tally, lanes=lanes, types=types) for key, tally in census.tallies.items()]
    users.sort(key=lambda user: user.begin)
    return tuple(replace(user, id=own) for user, own in zip(users, unique_ids(users), strict=True))


@dataclass(slots=True)
class _UserTally:
    """What the rows that were read until now say about one road user.

    Attributes:
        begin: Time of its first sample [s].
        last: Its last sample as a row of the log, (10,).
        travelled: Distance that it drove [m].
        seconds: Time in which it drove that distance [s].
        fastest: Its largest speed [m/s].
        lanes: Indices of its lanes in order, none twice in a row.
        passage: When and how near it passes the given point.
        place: Where it is at the given time.
    """

    begin: float
    last: Floats
    travelled: float = 0.0
    seconds: float = 0.0
    fastest: float = 0.0
    lanes: array[int] = field(default_factory=lambda: array("i"))
    passage: Passage | None = None
    place: _RowPlace | None = None


class _RowPlace(NamedTuple):
    """A position [m] and the index of a lane, -1 for none."""

    x: float
    y: float
    lane: int


class _RowCensus:
    """Counts the rows of a log, block by block."""

    def __init__(self, near: Point | None, at: float) -> None:
        self.tallies: dict[Key, _UserTally] = {}
        self._near, self._at, self._changes = near, at, TypeChanges()

    def count(self, rows: RowsOfUsers, steps: Sequence[float]) -> None:
        """Add the rows of a block; `steps` are the times of all steps until now [s]."""
        step = float(np.median(np.diff(np.sort(steps)))) if len(steps) > 1 else np.inf
        self._changes.join(rows, step=step)
        riding = riding_rows(rows)
        for key, buffer in rows.items():
            table = table_of(buffer)
            table = in_order(table[~riding[key]] if key in riding else table)
            tally = self.tallies.get(key)
            # Rows that are older than the last one counted come too late.
            table = table if tally is None else table[table[:, 0] > tally.last[0]]
            if not len(table):
                continue
            if tally is None:
                tally = self.tallies[key] = _UserTally(float(table[0, 0]), table[0].copy())
            self._add(tally, np.vstack([tally.last, table]), step)

    def _add(self, tally: _UserTally, table: Floats, step: float) -> None:
        """Add samples of one road user; the first row was counted before.

        Args:
            tally: What is known of the road user; it changes.
            table: Rows of the log, (n, 10).
            step: Median step of the log [s].
        """
        # Distance, time and speed.
        spans = np.diff(table[:, 0])
        lengths = np.linalg.norm(np.diff(table[:, 1:4], axis=0), axis=1)
        speeds = np.abs(table[:, 5])
        driven = (spans <= GAP_FACTOR * step) & ~_leaps(speeds, spans, lengths)
        tally.travelled += float(lengths[driven].sum())
        tally.seconds += float(spans[driven].sum())
        moving = driven & (spans > 0.0)
        shown = lengths[moving] / spans[moving]
        known = speeds[np.isfinite(speeds)]
        tally.fastest = max(tally.fastest, *(known if len(known) else shown).tolist(), 0.0)
        tally.last = table[-1].copy()
        _note_lanes(tally.lanes, table[:, 7])
        # Lanes, and where it is; a step over a gap counts as standing at its end.
        starts = np.where(driven[:, None], table[:-1], table[1:])
        if self._near is not None:
            tally.passage = _joined(tally.passage, _passage(starts, table[1:], self._near))
        tally.place = _place_at(starts, table[1:], self._at) or tally.place


def _leaps(speeds: Floats, spans: Floats, lengths: Floats) -> Bools:
    """Return which steps are too long for any vehicle, (n - 1,).

    Args:
        speeds: Logged speeds, (n,) [m/s].
        spans: Durations of the steps, (n - 1,) [s].
        lengths: Lengths of the steps, (n - 1,) [m].
    """
    fastest = np.fmax(speeds[:-1], speeds[1:])
    fastest = np.where(np.isfinite(fastest), fastest, FASTEST)
    return np.asarray(lengths > 1.5 * fastest * spans + _LEAP)


def _note_lanes(lanes: array[int], column: Floats) -> None:
    """Add the lanes of samples, but none that repeats the lane before it."""
    known = column[column >= 0].astype(np.int64)
    if not len(known):
        return
    before = lanes[-1] if lanes else -1
    changed = np.diff(known, prepend=before) != 0
    lanes.extend(known[changed].tolist())


def _passage(starts: Floats, ends: Floats, near: Point) -> Passage | None:
    """Return how straight lines pass a point; None if all stay outside its radius.

    Args:
        starts: Rows of the log at which the lines start, (n, 10).
        ends: Rows at which they end, (n, 10).
        near: The point and its radius.
    """
    # Distance of each line from the point.
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
    # Shares of each line at which it enters and leaves the circle.
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
    """Join two parts of one passage."""
    if before is None or after is None:
        return before or after
    best = min(before, after, key=lambda each: each.distance)
    return replace(best, begin=before.begin, end=after.end)


def _place_at(starts: Floats, ends: Floats, at: float) -> _RowPlace | None:
    """Return the place at a time [s] along straight lines; None before, after and in gaps."""
    inside = np.flatnonzero((starts[:, 0] <= at) & (at <= ends[:, 0]))
    if not len(inside):
        return None
    start, end = starts[inside[0]], ends[inside[0]]
    share = (at - start[0]) / max(end[0] - start[0], 1e-9)
    x, y = start[1:3] + share * (end[1:3] - start[1:3])
    return _RowPlace(float(x), float(y), int((end if share > 0.5 else start)[7]))


def _user(key: Key, tally: _UserTally, *, lanes: Sequence[str], types: TypesOfUsers) -> RoadUser:
    """Return what a tally says as a value."""
    kind, name = key[0], key[1]
    known = types.of(kind, name, key[2])
    used = [lanes[index] for index in tally.lanes if not lanes[index].startswith(":")]
    edges = [_edge_of(lane, kind) for lane in used]
    standing = abs(float(np.nan_to_num(tally.last[5])))
    place = tally.place
    return RoadUser(
        id=name,
        kind=kind,
        type_id=known.id,
        vclass=known.vclass,
        begin=tally.begin,
        end=float(tally.last[0]),
        length=tally.travelled,
        mean_speed=tally.travelled / tally.seconds if tally.seconds else standing,
        max_speed=tally.fastest,
        lanes=len(set(used)),
        edges=tuple(edge for n, edge in enumerate(edges) if not n or edge != edges[n - 1]),
        place=None
        if place is None
        else UserPlace(place.x, place.y, lanes[place.lane] if place.lane >= 0 else ""),
        passage=tally.passage,
    )


def _edge_of(lane: str, kind: str) -> str:
    """Return the edge of a lane; a person is logged with the edge itself."""
    edge, _, number = lane.rpartition("_")
    return edge if edge and number.isdigit() and kind == "vehicle" else lane


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """When a road user is in a log, and who else is in it.

    Attributes:
        spans: First and last time of each stay without a gap [s].
        ids: Ids of all road users in the log.
        end: Last time of the log [s]; minus infinity if it is empty.
        step: Usual time from a step to the next [s]; 0 if it has one step at most.
    """

    spans: tuple[tuple[float, float], ...]
    ids: frozenset[str]
    end: float
    step: float = 0.0


@dataclass(slots=True)
class _Sightings:
    """What was found in the part of the log that was searched.

    Attributes:
        steps: Times of all steps [s].
        there: Times at which the road user is there [s].
        ids: Ids of everyone, as they are written in the file.
    """

    steps: set[float] = field(default_factory=set)
    there: set[float] = field(default_factory=set)
    ids: set[bytes] = field(default_factory=set)


def whereabouts(paths: Iterable[Path], name: str) -> Whereabouts:
    """Look for a road user in vehicle logs.

    A log that breaks off or is damaged is read as far as it goes.

    Args:
        paths: Logs that belong together.
        name: SUMO's id, with or without its kind, such as `person:walker_1`. An ending such as
            `#2`, by which our ids tell road users of one id apart, is ignored.
    """
    kind, _, own = name.partition(":")
    plain, _, number = name.rpartition("#")
    wanted = {_written(name), *([_written(plain)] if number.isdecimal() else [])}
    keyed = (_written(kind), _written(own))
    look = _Sightings()
    for path in paths:
        time = np.nan
        # The reader of the log reports what is wrong with it.
        with suppress(InputError):
            for step, kind_of_user, user in format_of(path).sightings(path):
                if step is not None:
                    time = step
                    look.steps.add(time)
                    continue
                look.ids.add(user)
                if user in wanted or (kind_of_user, user) == keyed:
                    look.there.add(time)
    ids = frozenset(html.unescape(each.decode("utf-8", errors="replace")) for each in look.ids)
    steps = np.diff(sorted(look.steps))
    step = round(float(np.median(steps)), 6) if len(steps) else 0.0
    return Whereabouts(_spans(look), ids, max(look.steps, default=-np.inf), step)


def _written(name: str) -> bytes:
    """Return an id as SUMO writes it into XML."""
    return html.escape(name).encode()


def _spans(look: _Sightings) -> tuple[tuple[float, float], ...]:
    """Return first and last time of each stay without a gap [s]."""
    times = np.array(sorted(look.there))
    if not len(times):
        return ()
    steps = np.diff(sorted(look.steps))
    step = float(np.median(steps)) if len(steps) else np.inf
    cuts = np.flatnonzero(np.diff(times) > GAP_FACTOR * step)
    firsts, lasts = times[[0, *(cuts + 1)]], times[[*cuts, len(times) - 1]]
    return tuple(zip(firsts.tolist(), lasts.tolist(), strict=True))
