"""Trains that split and join: SUMO changes their lengths, which no log tells.

SUMO's rear part of a train that splits is a new vehicle, which stands behind the front part from
then on; the front part is shorter by the length of the rear one. Of two trains that join, one is
removed, and the other one is longer by its length; if the rear one stays, its front is where that
of the front one was. The one that stays gets a type of its own (`type@id`), which tells a train
that joins from one whose run ends beside another. That was measured with SUMO 1.28. From the
moment of the change on, the one that stays is another road user, named `id#2`, of its new length.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Ints
from sumo3dviz_pt.model.traffic import RAIL_CLASSES, Trace, TrafficLog, VehicleType

_GAP = 15.0  # most between trains that split or join [m]
_NEAR = 1.0  # how exactly lengths and places fit [m]
_STANDS = 0.5  # who moves less than this between rows stands [m]
_BEHIND = 0.8  # cosine of the angle within which a train stands behind another
_JUST_BEFORE = 1e-3  # how long before a change the last row of what was before stands [s]


@dataclass(frozen=True, slots=True)
class _Change:
    """A new length of a train.

    Attributes:
        stays: Number of the trace of the train that stays.
        time: From when on [s].
        longer: By how much; negative is shorter [m].
        gone: Number of the trace of a train that is part of it from then on; -1 for none.
    """

    stays: int
    time: float
    longer: float
    gone: int = -1


def coupled(
    log: TrafficLog, types: Mapping[str, VehicleType]
) -> tuple[tuple[Trace, ...], dict[str, VehicleType]]:
    """Return traces of trains that change their length where they split or join.

    Args:
        log: Its traces, and which types changed.
        types: By id, of all traces.

    Returns:
        All traces in order of first appearance, and the types of new lengths by id.
    """
    traces = log.traces
    if not any(key.startswith("vehicle:") for key in log.changed):
        return traces, {}
    trains = [k for k, trace in enumerate(traces) if types[trace.type_id].vclass in RAIL_CLASSES]
    changes = sorted(_changes(log, trains, types), key=lambda change: change.time)
    if not changes:
        return traces, {}
    lengths: dict[str, VehicleType] = {}
    rest: dict[int, list[Trace]] = {k: [trace] for k, trace in enumerate(traces)}
    for change in changes:
        before, after = _cut(rest[change.stays][-1], change.time)
        kind = lengths.get(before.type_id) or types[before.type_id]
        own = replace(kind, id=f"{kind.id}@{before.id}", length=kind.length + change.longer)
        lengths[own.id] = own
        rest[change.stays][-1:] = [before, replace(after, type_id=own.id)]
        if change.gone >= 0:
            rest[change.gone][-1] = _cut(rest[change.gone][-1], change.time)[0]
    made = [trace for pieces in rest.values() for trace in pieces]
    return tuple(sorted(made, key=lambda trace: trace.times[0])), lengths


def _changes(
    log: TrafficLog, trains: Sequence[int], types: Mapping[str, VehicleType]
) -> Iterator[_Change]:
    """Find who splits off, and who joins."""
    begins = np.array([log.traces[k].times[0] for k in trains])
    ends = np.array([log.traces[k].times[-1] for k in trains])
    for place, k in enumerate(trains):
        train = log.traces[k]
        if train.key not in log.changed:
            continue
        length, first = types[train.type_id].length, float(train.times[0])
        others = np.arange(len(trains)) != place
        born = (begins > first) & (begins <= train.times[-1]) & others
        for j in np.flatnonzero(born).tolist():
            rear, time = log.traces[trains[j]], float(begins[j])
            left = length - types[rear.type_id].length
            away = _behind(train, rear, time)
            if left > 0.0 and left - _NEAR <= away <= min(left + _GAP, length):
                yield _Change(k, time, left - length)
        since = log.changed[train.key] - log.step - 1e-6
        gone = (ends >= since) & (ends < train.times[-1]) & (ends >= first) & others
        for j in np.flatnonzero(gone).tolist():
            other, time = log.traces[trains[j]], float(ends[j])
            own = types[other.type_id].length
            for ahead, behind, least in ((train, other, length), (other, train, own)):
                if least - _NEAR <= _behind(ahead, behind, time) <= least + _GAP:
                    after = int(np.searchsorted(train.times, time + 1e-6))
                    yield _Change(k, float(train.times[after]), own, trains[j])


def _behind(ahead: Trace, behind: Trace, time: float) -> float:
    """How far the front of a train that stands is behind another's [m]; infinite if it is not.

    Args:
        ahead: A train with a row at the time.
        behind: Another one with a row then.
        time: [s].
    """
    rows = [int(np.searchsorted(trace.times, time - 1e-6)) for trace in (ahead, behind)]
    for trace, row in zip((ahead, behind), rows, strict=True):
        if row >= len(trace.times):
            return np.inf
        beside = trace.positions[slice(row - 1, row + 1) if row else slice(0, 2)]
        if np.ptp(beside[:, :2], axis=0).max() > _STANDS:
            return np.inf
    way = ahead.positions[rows[0], :2] - behind.positions[rows[1], :2]
    away = float(np.hypot(*way))
    heading = np.array([np.cos(ahead.yaws[rows[0]]), np.sin(ahead.yaws[rows[0]])])
    return away if away > _NEAR and float(way @ heading) > _BEHIND * away else np.inf


def _cut(trace: Trace, time: float) -> tuple[Trace, Trace]:
    """A trace until just before a time, when it still stands, and from that row on."""
    row = int(np.searchsorted(trace.times, time - 1e-6))
    kept = np.append(np.arange(row), max(row - 1, 0))
    before, after = _rows(trace, kept), _rows(trace, np.arange(row, len(trace.times)))
    return replace(before, times=np.append(trace.times[:row], time - _JUST_BEFORE)), after


def _rows(trace: Trace, rows: Ints) -> Trace:
    """Some rows of a trace."""
    names = ["times", "positions", "yaws", "speeds", "slopes", "lanes", "signals"]
    names += ["offsets"] * bool(len(trace.offsets))
    return replace(trace, **{name: getattr(trace, name)[rows] for name in names})
