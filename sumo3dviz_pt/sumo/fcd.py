"""Read the vehicle log, SUMO's floating car data (FCD), in any of the formats in `formats`.

The log is streamed. Steps before the asked window are left out, and the reading stops at
the first step past it. Rows are packed into one buffer of doubles per road user.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import TrafficLog
from sumo3dviz_pt.sumo.logs.kept import KeptLog, keep_log, kept_log, place_of
from sumo3dviz_pt.sumo.logs.reader import Drain, LogReader
from sumo3dviz_pt.sumo.places.coordinates import coordinates_of, put_in_net
from sumo3dviz_pt.sumo.repairs.changes import changed_types
from sumo3dviz_pt.sumo.repairs.order import backward_steps, row_twice
from sumo3dviz_pt.sumo.traces import RowsOfUsers, build_traces

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
    asked = (-inf if begin is None else begin, inf if end is None else end)
    # All of a log is the same with and without a margin, and is kept once.
    margin = 0.0 if begin is None and end is None else margin
    files = [Path(path) for path in paths]
    place = place_of(files, (asked, margin, location))
    kept = None if place is None else kept_log(place)
    if kept is None:
        log, whole, notes = _read_logs(files, asked, margin, allow_truncated, location)
        kept = KeptLog(log, notes)
        if place is not None and whole:
            keep_log(place, kept)
    for number, note in enumerate(kept.notes):
        once = {"once": f"disorder {number} of {files[0]}"}
        logger.warning("%s", note, extra=once)
    return kept.log


def whole_log(files: Sequence[Path], location: Location | None) -> TrafficLog | None:
    """Return all of a log that was read before, as `read_trajectories` gave it, if it was kept.

    Args:
        files: Logs that belong together.
        location: Of the network.
    """
    place = place_of(files, ((-inf, inf), 0.0, location))
    kept = None if place is None else kept_log(place)
    return None if kept is None else kept.log


class _Reading(NamedTuple):
    """What was read, whether no log breaks off, and what is to be noted."""

    log: TrafficLog
    whole: bool
    notes: tuple[str, ...]


def _read_logs(
    files: list[Path],
    asked: tuple[float, float],
    margin: float,
    allow_truncated: bool,
    location: Location | None,
) -> _Reading:
    """Return what `read_trajectories` gives, and what else is known of the logs.

    Args:
        files: The logs.
        asked: First and last time to keep [s].
        margin: Time to keep before and after these [s].
        allow_truncated: Whether to use a log that breaks off.
        location: Of the network.
    """
    window = (asked[0] - margin, asked[1] + margin)
    lanes: dict[str, int] = {}
    rows: RowsOfUsers = {}
    steps: set[float] = set()
    whole = True
    notes: list[str] = []
    for file in files:
        reader = LogReader(file, window, lanes)
        reader.read(allow_truncated=allow_truncated)
        whole = whole and not reader.breaks_off
        steps.update(reader.steps)
        put_in_net(reader.rows, coordinates_of(file, location), location)
        disorder = (backward_steps(reader.steps), row_twice(reader.rows))
        notes += [f"{file}: {text}" for text in disorder if text]
        _move(reader.rows, rows)
    times = np.sort(np.fromiter(steps, dtype=np.float64, count=len(steps)))
    _check_steps(times, window, files, asked=asked)
    step = round(float(np.median(np.diff(times))), 6) if len(times) > 1 else 0.0
    changes = changed_types(rows, step=step)
    notes += [f"{files[0]}: {changes}"] if changes else []
    log = TrafficLog(
        traces=build_traces(rows),
        lane_names=tuple(lanes),
        begin=float(times[0]),
        end=float(times[-1]),
        step=step,
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
        _check_steps(np.array(reader.steps), (-inf, inf), [file], asked=(-inf, inf))
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
    asked: tuple[float, float],
) -> None:
    """Refuse a log without steps, or without a step in the window.

    Args:
        times: Times of the log's steps, (n,) [s].
        window: First and last time to keep, margins included [s].
        files: The logs, for messages.
        asked: First and last time that a user asked for, for messages [s].
    """
    file = files[0] if files else None
    if not len(times):
        raise InputError("the log holds no time step; run the simulation again", file=file)
    if not ((times >= window[0]) & (times <= window[1])).any():
        raise InputError(
            f"no time step lies {_span(asked)}; "
            f"the log goes from {times[0]:.12g} s to {times[-1]:.12g} s",
            file=file,
        )


def _span(asked: tuple[float, float]) -> str:
    """Return a span of time [s] in words; either end may be open."""
    if asked[1] == inf:
        return f"from {asked[0]:g} s on"
    return f"up to {asked[1]:g} s" if asked[0] == -inf else f"from {asked[0]:g} s to {asked[1]:g} s"
