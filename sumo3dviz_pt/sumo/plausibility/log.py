"""What is odd in a vehicle log: angles, speeds and times, rows out of order, other vTypes.

A log is judged by a sample of its rows. Rows out of order are told of here; `build_traces` puts
them in order.

TraCI's `setType` gives a vehicle another type while it drives. It is one road user all the same:
its rows are joined, and it keeps the type, and so the look, that it began with. An id that comes
back elsewhere, or after a gap, with another type is another road user.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import FASTEST, GAP_FACTOR, Trace, TrafficLog
from sumo3dviz_pt.sumo.plausibility.places import (
    LEAST,
    Finding,
    LogSample,
    place_findings,
    sample_of,
)
from sumo3dviz_pt.sumo.rows import RowsOfUsers, in_order, table_of

_TURNED = 30.0
"""Median angle between logged and true direction from which on it is said [deg]."""

_EXPLAINED = 10.0
"""Largest median angle that is left when the true meaning of the angles is found [deg]."""

_FAR = 1.0
"""Length of a step whose direction and speed can be told [m]."""

_RATIOS = (0.75, 1.33)
"""Logged speeds over true ones that pass; values between steps differ a little."""

_UNITS = {3.6: "km/h", 2.237: "mph", 3.281: "feet per second", 100.0: "cm/s"}
"""Units of speed by their number in 1 m/s."""

_STRAY = 100.0
"""How much longer a step must be than any vehicle can go in its time for a row to be astray [m]."""

_COARSE = 2.0
"""Time between rows of a vehicle from which on its motion has to be guessed [s]."""

_LEAPS = 0.1
"""Share of steps faster than any vehicle from which on a log is doubted."""


def movement_findings(sample: LogSample) -> tuple[Finding, ...]:
    """Return what is wrong with the angles and speeds of a log.

    Args:
        sample: Steps of the log.
    """
    sure = sample.where(sample.lengths > _FAR)
    if len(sure) < LEAST:
        return ()
    leaping = float((sure.lengths > FASTEST * sure.spans).mean())
    if leaping > _LEAPS:
        text = (
            f"in {100 * leaping:.0f} % of the steps vehicles are faster than {FASTEST:g} m/s: ids,"
            " places or times are mixed up; write the log again"
        )
        return (Finding("leaps", text),)
    return tuple(each for each in (_angles(sure), _speeds(sure)) if each is not None)


def _angles(sample: LogSample) -> Finding | None:
    """Return what is wrong with angles."""
    ways = np.degrees(np.arctan2(sample.moves[:, 0], sample.moves[:, 1]))
    angles = (90.0 - np.degrees(sample.yaws) + 180.0) % 360.0 - 180.0
    off = _median_turn(angles, ways)
    if off < _TURNED:
        return None
    meanings = {
        "they seem to be radians; SUMO's are degrees": np.degrees(angles),
        "they seem to count counter-clockwise from east; SUMO's count clockwise from north": 90.0
        - angles,
        "they seem to be radians from east; SUMO's are degrees clockwise from north": 90.0
        - np.degrees(angles),
        "they seem to point backwards": angles + 180.0,
    }
    reasons = [why for why, meant in meanings.items() if _median_turn(meant, ways) < _EXPLAINED]
    why = reasons[0] if reasons else "they are not those of the vehicles"
    text = (
        f"the angles are typically {off:.0f} degrees off the way that vehicles go: {why};"
        " convert the column angle"
    )
    return Finding("angles", text, hopeless=True)


def _median_turn(angles: Floats, ways: Floats) -> float:
    """Return the median turn between directions [deg]."""
    return float(np.median(np.abs((angles - ways + 180.0) % 360.0 - 180.0)))


def _speeds(sample: LogSample) -> Finding | None:
    """Return what is wrong with speeds."""
    logged = np.isfinite(sample.speeds)
    if logged.sum() < LEAST:
        return None
    some = sample.where(logged)
    ratio = float(np.median(some.speeds * some.spans / some.lengths))
    if _RATIOS[0] <= ratio <= _RATIOS[1]:
        return None
    if abs(ratio / 1e3 - 1.0) < 0.05:
        return Finding("times", "the times seem to be milliseconds; convert them to seconds")
    units = [unit for factor, unit in _UNITS.items() if abs(ratio / factor - 1.0) < 0.05]
    what = "one of the two has another unit; positions must be metres, times seconds"
    if units:
        what = f"it seems to be {units[0]}; convert it to m/s"
    return Finding(
        "speeds",
        f"the column speed is typically {ratio:.3g} times the distance that is driven in a second:"
        f" {what}",
    )


# Single rows -------------------------------------------------------------------------------


def stray_findings(log: TrafficLog) -> tuple[Finding, ...]:
    """Return which single rows lie far from the rows before and after them, if any do.

    A vehicle that SUMO teleports does not come back, and is not meant.

    Args:
        log: The log.
    """
    strays = [(trace, row) for trace in log.traces for row in _strays(trace)]
    if not strays:
        return ()
    trace, row = strays[0]
    beside = row - 1 if row else 1
    away = float(np.linalg.norm(trace.positions[row, :2] - trace.positions[beside, :2]))
    around = trace.times[max(row - 1, 0) : row + 2]
    before, after = around[0], around[-1]
    rows, many = ("a row lies", "") if len(strays) == 1 else (f"{len(strays)} rows lie", "first ")
    text = (
        f'{rows} far from the rows before and after: {many}{trace.kind} "{cut(trace.id)}" at'
        f" {trace.times[row]:.12g} s, {away:,.0f} m away, so it is not drawn from {before:.12g} to"
        f" {after:.12g} s; mend the row, or write the log again"
    )
    return (Finding("strays", text),)


def _strays(trace: Trace) -> list[int]:
    """Return the rows to which and from which nobody can go, though past them one can.

    A first or last row from which, or to which, nobody can go is one, too.
    """
    if len(trace.times) < 3:
        return []
    places, times = trace.positions[:, :2], trace.times
    jumps = np.linalg.norm(np.diff(places, axis=0), axis=1) > _STRAY + FASTEST * np.diff(times)
    past = np.linalg.norm(places[2:] - places[:-2], axis=1) <= FASTEST * (times[2:] - times[:-2])
    inside: list[int] = (np.flatnonzero(jumps[:-1] & jumps[1:] & past) + 1).tolist()
    first = [0] if jumps[0] and not jumps[1] else []
    last = [len(times) - 1] if jumps[-1] and not jumps[-2] else []
    return [*first, *inside, *last]


# Times -------------------------------------------------------------------------------------


def time_findings(log: TrafficLog) -> tuple[Finding, ...]:
    """Return what is wrong with the times of a log's rows.

    Args:
        log: The log.
    """
    traces = [trace for trace in log.traces if trace.kind == "vehicle" and len(trace.times) > 1]
    if not traces:
        return ()
    both = (_coarse(traces), _hole(traces, log.step))
    return tuple(each for each in both if each is not None)


def _coarse(traces: Sequence[Trace]) -> Finding | None:
    """Return whether rows of one vehicle are too far apart for smooth motion."""
    step = float(np.median([np.median(np.diff(trace.times)) for trace in traces]))
    if step <= _COARSE:
        return None
    return Finding(
        "steps",
        f"each vehicle has a row every {step:g} s only, and what it does between is guessed; log"
        " every 1 s or less (sumo --step-length, --device.fcd.period)",
    )


def _hole(traces: Sequence[Trace], step: float) -> Finding | None:
    """Return the longest time without rows, if vehicles are on the road before and after it."""
    times = np.unique(np.concatenate([trace.times for trace in traces]))
    spans = np.diff(times)
    wide = np.flatnonzero(spans > max(GAP_FACTOR * step, 2.0 * float(np.median(spans)), 1.0))
    holes = []
    for number in wide.tolist():
        begin, end = times[number], times[number + 1]
        there = sum(trace.times[0] <= begin and end <= trace.times[-1] for trace in traces)
        if there:
            holes.append((float(end - begin), float(begin), there))
    if not holes:
        return None
    longest, begin, there = max(holes)
    many = f"{len(holes)} holes; the longest is" if len(holes) > 1 else "a hole"
    return Finding(
        "holes",
        f"the log has {many} from {begin:.12g} to {begin + longest:.12g} s, in which its"
        f" {there} vehicles are not drawn; write the log again, or film before or after it",
    )


_MESOSCOPIC = 0.8
"""Share of vehicles' rows that name edges instead of lanes in a mesoscopic log."""


def findings(log: TrafficLog, network: Network) -> tuple[Finding, ...]:
    """Return what seems wrong with a log.

    Args:
        log: The log, or a window of it.
        network: The roads that it belongs to.
    """
    if _mesoscopic(log, network):
        text = (
            "this is a log of a mesoscopic simulation, which knows the edges of vehicles but"
            " neither their lanes nor their places; run SUMO without --mesosim"
        )
        return (Finding("mesoscopic", text, hopeless=True),)
    sample = sample_of(log)
    misplaced = place_findings(sample, log.lane_names, network)
    # Directions and speeds of misplaced vehicles follow from what is wrong with their places.
    results = misplaced or movement_findings(sample)
    if any(each.about in ("times", "leaps") for each in results):
        return results
    return (*results, *time_findings(log), *stray_findings(log))


def _mesoscopic(log: TrafficLog, network: Network) -> bool:
    """Return whether vehicles are logged with edges instead of lanes."""
    rows = Counter(
        log.lane_names[int(trace.lanes[0])]
        for trace in log.traces
        if trace.kind == "vehicle" and trace.lanes[0] >= 0
    )
    edges = sum(
        n for name, n in rows.items() if name in network.edges and name not in network.lanes
    )
    return edges > _MESOSCOPIC * rows.total()


_SAME = 0.02
"""Distance of two places from which on they are not one place, rounded twice [m]."""


def backward_steps(steps: Sequence[float]) -> str:
    """Say where time goes backward in a log, or nothing.

    Args:
        steps: Times of the log's steps as they are written [s].
    """
    times = np.array(steps)
    back = np.flatnonzero(np.diff(times) < 0.0)
    if not len(back):
        return ""
    first = int(back[0])
    return (
        f"time goes backward {_times(len(back))}, at first from {times[first]:.12g} s to"
        f" {times[first + 1]:.12g} s; the steps are sorted, and the first of repeated ones counts"
    )


def row_twice(rows: RowsOfUsers, *, logs: int = 1) -> str:
    """Say which road user is at two places at one time, or nothing.

    Args:
        rows: Packed rows.
        logs: Number of the logs that they are of.
    """
    count, first = 0, ""
    for key, buffer in rows.items():
        table = table_of(buffer)
        steps = np.diff(table[:, 0])
        if (steps > 0.0).all():
            continue
        table = table[np.argsort(table[:, 0], kind="stable")]
        apart = np.abs(np.diff(table[:, 1:3], axis=0)).max(axis=1) > _SAME
        twice = np.flatnonzero((np.diff(table[:, 0]) == 0.0) & apart)
        if len(twice):
            first = first or f"`{cut(key[1])}` at {table[twice[0], 0]:g} s"
            count += len(twice)
    if not count:
        return ""
    remedy = "give each its own id" if logs == 1 else "logs of several runs are no one simulation"
    return (
        f"a road user is at two places at one time, {_times(count)} (first: {first}); the first"
        f" row counts; {remedy}"
    )


def _times(count: int) -> str:
    """Return a number of times in words."""
    return "once" if count == 1 else f"{count} times"


_BEYOND = 8.0
"""A step longer than speed x time by more than this leads to another place [m]."""


class _Last(NamedTuple):
    """The last row of an id: as a row of the log, its type, and the type that it goes under."""

    row: Floats
    type_id: str
    under: str


@dataclass(slots=True)
class TypeChanges:
    """Gives rows to the first type of their road user, block by block.

    Attributes:
        last: Last rows of ids by kind and id.
        first: The first change, in words; empty if there was none.
        users: Kinds and ids that changed.
    """

    last: dict[tuple[str, str], _Last] = field(default_factory=dict)
    first: str = ""
    users: set[tuple[str, str]] = field(default_factory=set)

    def join(self, rows: RowsOfUsers, *, step: float) -> None:
        """Move rows to the keys of the types that their road users began with.

        Args:
            rows: Packed rows of road users; they follow those of earlier calls.
            step: Median time between steps of the log [s].
        """
        types: dict[tuple[str, str], list[str]] = {}
        for (kind, name, type_id), buffer in rows.items():
            # A log that breaks off may name somebody and give no complete row.
            if len(buffer):
                types.setdefault((kind, name), []).append(type_id)
        for user, own in types.items():
            last = self.last.get(user)
            if len(own) == 1 and (last is None or last.type_id == last.under == own[0]):
                self.last[user] = _Last(table_of(rows[*user, own[0]])[-1].copy(), own[0], own[0])
                continue
            tables = {each: in_order(table_of(rows[*user, each])) for each in own}
            self._share(user, tables, rows, step=step)

    def _share(
        self,
        user: tuple[str, str],
        tables: Mapping[str, Floats],
        rows: RowsOfUsers,
        *,
        step: float,
    ) -> None:
        """Share the rows of an id out to the road users that it is; arguments as above."""
        table = np.concatenate(list(tables.values()))
        types = np.repeat(list(tables), [len(each) for each in tables.values()])
        order = np.argsort(table[:, 0], kind="stable")
        table, types = table[order], types[order]
        # Two rows of one id at one time are two road users.
        if not (np.diff(table[:, 0]) > 0.0).all():
            return
        last = self.last.get(user)
        under = []
        for row, type_id in zip(table, types.tolist(), strict=True):
            if last is None:
                own = type_id
            elif last.type_id == type_id or _goes_on(last.row, row, step=step):
                own = last.under
                self._note(user, last.type_id, type_id, time=float(row[0]))
            else:
                own = type_id
            last = _Last(row.copy(), type_id, own)
            under.append(own)
        if last is not None:
            self.last[user] = last
        # Keys stay where they are: road users come in the order of the log.
        for each in dict.fromkeys(under):
            own_rows = table[np.array(under) == each]
            rows[*user, each] = array("d", own_rows.ravel())
        for each in set(tables).difference(under):
            del rows[*user, each]

    def _note(self, user: tuple[str, str], before: str, after: str, *, time: float) -> None:
        """Remember that a road user goes on as another type at a time [s]."""
        if before != after:
            self.users.add(user)
            name, change = f"{user[0]} `{cut(user[1])}`", f"from `{cut(before)}` to `{cut(after)}`"
            self.first = self.first or f"{name}, {change} at {time:.12g} s"

    @property
    def text(self) -> str:
        """One sentence about who changed; empty if nobody did."""
        if not self.users:
            return ""
        who = (
            "a road user changes"
            if len(self.users) == 1
            else f"{len(self.users)} road users change"
        )
        return (
            f"{who} the vType while driving (first: {self.first}); the first type counts all along;"
            " where the look must change, write another id from then on"
        )


def _goes_on(before: Floats, row: Floats, *, step: float) -> bool:
    """Whether a row can be the next of the road user of the row before it.

    Args:
        before: Row of the log, (10,).
        row: A later one.
        step: Median time between steps of the log [s].
    """
    time = row[0] - before[0]
    speed = np.fmax(abs(before[5]), abs(row[5]))
    speed = speed if np.isfinite(speed) else FASTEST
    way = float(np.hypot(*(row[1:3] - before[1:3])))
    return bool(0.0 < time <= GAP_FACTOR * step and way <= speed * time + _BEYOND)


def changed_types(rows: RowsOfUsers, *, step: float) -> str:
    """Join the rows of all road users of a log; say who changed, or nothing.

    Args:
        rows: Packed rows of road users.
        step: Median time between steps of the log [s].
    """
    changes = TypeChanges()
    changes.join(rows, step=step)
    return changes.text
