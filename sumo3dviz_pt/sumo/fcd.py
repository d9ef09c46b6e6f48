"""Read the vehicle log, SUMO's floating car data (FCD), in any of the formats in `formats`.

The log is streamed. Steps before the asked window are left out, and the reading stops at
the first step past it. Rows are packed into one buffer of doubles per road user.
"""

from __future__ import annotations

import logging
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import inf, nan
from pathlib import Path
from typing import NoReturn

import numpy as np

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import TrafficLog
from sumo3dviz_pt.sumo import bounds
from sumo3dviz_pt.sumo.formats import ElementSink, format_of
from sumo3dviz_pt.sumo.formats.format import KINDS, STEP, Rows
from sumo3dviz_pt.sumo.logs.packing import NEEDED, BadRowsError, RowPacker
from sumo3dviz_pt.sumo.places.coordinates import coordinates_of, put_in_net
from sumo3dviz_pt.sumo.stream import Element, TruncatedError
from sumo3dviz_pt.sumo.traces import COLUMNS, RowsOfUsers, build_traces
from sumo3dviz_pt.sumo.values import parse_time

logger = logging.getLogger(__name__)

_FAR, _HIGH, _TURN = bounds.COORDINATE.high, bounds.HEIGHT.high, bounds.ANGLE.high
_OLDEST, _NEWEST = bounds.SECONDS.low, bounds.SECONDS.high
_BITS = bounds.SIGNAL_BITS.high
_RANGES = {
    "x": bounds.COORDINATE,
    "y": bounds.COORDINATE,
    "z": bounds.HEIGHT,
    "angle": bounds.ANGLE,
    "speed": bounds.ANY,
    "slope": bounds.ANGLE,
    "pos": bounds.ANY,
    "signals": bounds.SIGNAL_BITS,  # last: whole numbers
}
"""Allowed ranges of a row's numbers by attribute; impossible speeds count as not logged."""

_BLOCK = 200_000 * COLUMNS
"""Number of values after which a block of rows is passed on, 16 MB."""

Drain = Callable[[RowsOfUsers, Sequence[float]], None]
"""A function that takes rows, and the times of all steps read until then [s]."""


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

    Steps out of order are sorted; of repeated ones the first counts. Persons and
    containers at the position of a vehicle ride in it and are left out while they do.
    An id that comes back with another type makes another trace with the same key.
    Steps before `begin` are not checked. A log is read up to its first step after `end`, so
    steps that are written out of order behind that one are missed, and `TrafficLog.end` is the
    last step that was read.

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
    window = (asked[0] - margin, asked[1] + margin)
    lanes: dict[str, int] = {}
    rows: RowsOfUsers = {}
    steps: set[float] = set()
    files = [Path(path) for path in paths]
    for file in files:
        reader = _Reader(file, window, lanes)
        reader.read(allow_truncated=allow_truncated)
        steps.update(reader.steps)
        put_in_net(reader.rows, coordinates_of(file, location), location)
        _move(reader.rows, rows)
    times = np.sort(np.fromiter(steps, dtype=np.float64, count=len(steps)))
    _check_steps(times, window, files, asked=asked)
    return TrafficLog(
        traces=build_traces(rows),
        lane_names=tuple(lanes),
        begin=float(times[0]),
        end=float(times[-1]),
        step=round(float(np.median(np.diff(times))), 6) if len(times) > 1 else 0.0,
    )


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
        reader = _Reader(file, (-inf, inf), lanes, drain=placed)
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
            f"the log goes from {times[0]:g} s to {times[-1]:g} s",
            file=file,
        )


def _span(asked: tuple[float, float]) -> str:
    """Return a span of time [s] in words; either end may be open."""
    if asked[1] == inf:
        return f"from {asked[0]:g} s on"
    return f"up to {asked[1]:g} s" if asked[0] == -inf else f"from {asked[0]:g} s to {asked[1]:g} s"


class _DoneError(Exception):
    """Everything up to the end of the window has been read."""


class _Reader(ElementSink):
    """Packs the rows of one log."""

    def __init__(
        self,
        file: Path,
        window: tuple[float, float],
        lanes: dict[str, int],
        *,
        drain: Drain | None = None,
    ) -> None:
        super().__init__(begin=window[0])
        self.file = file
        self.rows: RowsOfUsers = {}
        self._drain = drain
        self._end = window[1]
        self._lanes = lanes
        self._packer = RowPacker(self.rows, lanes)
        self._time = nan
        self._kept = False
        self._inside = False

    def read(self, *, allow_truncated: bool) -> None:
        """Stream the file into `rows` and `steps`."""
        try:
            try:
                format_of(self.file).read(self.file, self)
            finally:
                self._flush()
        except _DoneError:
            logger.debug("%s: stopped reading past %g s", self.file, self._end)
        except TruncatedError as error:
            self._drop_last_step()
            if not allow_truncated:
                raise self._broken_off(error) from None
            logger.warning(
                "%s: breaks off; its %d complete steps are used", self.file, len(self.steps)
            )

    def _pass(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Pass over an element that is no row to keep, but enter a step."""
        if tag == STEP:
            self._step(attributes)

    def _step(self, attributes: Mapping[str, str]) -> None:
        """Enter a time step and choose whether its rows are kept."""
        try:
            time = float(attributes["time"])
            time = parse_time(attributes["time"]) if not _OLDEST <= time <= _NEWEST else time
        except (KeyError, ValueError):
            time = self._odd_time(attributes)
        # Once rows are kept, nothing after the window matters. Without any row, reading goes on,
        # because the error message says where the log ends.
        if time > self._end and self._kept:
            raise _DoneError
        if self._drain is not None and self._held() >= _BLOCK:
            self._flush()
            self._drain(self.rows, self.steps)
            self.rows.clear()
            self._packer.forget_users()
        self._time = time
        self.steps.append(time)
        self._inside = self.begin <= time <= self._end
        self._kept = self._kept or self._inside

    def take_rows(self, rows: Rows) -> None:
        """Collect rows, which are packed when there are many."""
        if not self._inside:
            return
        if any(name not in rows.columns for name in NEEDED):
            super().take_rows(rows)
            return
        try:
            self._packer.add(self._time, rows)
        except BadRowsError as error:
            self._take_singly(error)

    def _held(self) -> int:
        """Return the number of values of all rows that were not passed on."""
        return self._packer.collected * COLUMNS + sum(map(len, self.rows.values()))

    def _flush(self) -> None:
        """Pack the rows that were collected."""
        try:
            self._packer.flush()
        except BadRowsError as error:
            self._take_singly(error)

    def _take_singly(self, error: BadRowsError) -> None:
        """Take rows one by one, so that the bad one among them is named."""
        for self._time, rows in error.runs:
            super().take_rows(rows)

    def take(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Pack one row; the code is plain because it runs a million times."""
        if tag not in KINDS or not self._inside:
            self._pass(tag, attributes)
            return
        self._flush()
        get = attributes.get
        try:
            x, y = float(attributes["x"]), float(attributes["y"])
            z = float(get("z", 0.0))
            angle = float(attributes["angle"])
            speed, slope = float(get("speed", nan)), float(get("slope", 0.0))
            offset = float(get("pos", nan))
            signals = int(get("signals", -1))
            key = (tag, attributes["id"], get("type", ""))
        except (KeyError, ValueError):
            self._refuse(tag, attributes)
        # Written so that NaN fails too.
        if not (-_FAR <= x <= _FAR and -_FAR <= y <= _FAR and -_HIGH <= z <= _HIGH):
            self._refuse(tag, attributes)
        if not (-_TURN <= angle <= _TURN and -_TURN <= slope <= _TURN):
            self._refuse(tag, attributes)
        if not -1 <= signals <= _BITS:
            self._refuse(tag, attributes)
        if tag != "vehicle" and get("vehicle") and get("stage", "driving") == "driving":
            return
        lane = get("lane") or get("edge")
        place = self._lanes.setdefault(lane, len(self._lanes)) if lane else -1
        buffer = self.rows.get(key)
        if buffer is None:
            buffer = self.rows[key] = array("d")
        buffer.extend((self._time, x, y, z, angle, speed, slope, place, signals, offset))

    def _odd_time(self, attributes: Mapping[str, str]) -> float:
        """Return a time that is not written in seconds."""
        step = self._element(STEP, attributes)
        text = step.text("time")
        try:
            return parse_time(text)
        except ValueError:
            message = f'time="{cut(text)}" must be seconds, h:m:s or d:h:m:s, {bounds.SECONDS}'
            raise step.error(message) from None

    def _refuse(self, tag: str, attributes: Mapping[str, str]) -> NoReturn:
        """Raise an error that says what is wrong with a row."""
        element = self._element(tag, attributes)
        for name in ("id", "x", "y", "angle"):
            if name not in attributes:
                raise element.error(
                    f'the attribute "{name}" is missing; log at least x,y,angle '
                    "(--fcd-output.attributes)"
                )
        for name, within in _RANGES.items():
            if element.number(name, 0.0) not in within:
                break
        raise element.error(
            f'{name}="{cut(attributes[name])}" cannot be: {_RANGES[name]}; run the simulation again'
        )

    def _element(self, tag: str, attributes: Mapping[str, str]) -> Element:
        return Element(tag, attributes, 0, self.file, self.line())

    def _drop_last_step(self) -> None:
        """Forget the step in which the log breaks off, as it may be incomplete."""
        if not self.steps:
            return
        time = self.steps.pop()
        for buffer in self.rows.values():
            while buffer and buffer[-COLUMNS] == time:
                del buffer[-COLUMNS:]

    def _broken_off(self, error: TruncatedError) -> InputError:
        last = f" (the last at {self.steps[-1]:g} s)" if self.steps else ""
        return InputError(
            f"the log breaks off after {len(self.steps)} complete time steps{last}; run the "
            "simulation again, or set scenario.allow_truncated to use these",
            file=self.file,
            line=error.line,
        )
