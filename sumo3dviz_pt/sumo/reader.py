"""Reads the rows of one vehicle log in a window of time, and keeps logs that were read.

The next command need not read a kept log again. It lies in the user's cache under all that it
depends on: the files, the asked window, where the network lies, and our own code. To hash 700 MB
takes longer than to load what was made of them, so a file counts as the same if its path, its size,
its time of change and some samples of its content are.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.files.atomic import Files, make_room, read_folder, write_folder
from sumo3dviz_pt.model.traffic import Trace, TrafficLog
from sumo3dviz_pt.sumo import values
from sumo3dviz_pt.sumo.formats import ElementSink, format_of
from sumo3dviz_pt.sumo.formats.format import KINDS, STEP, Rows
from sumo3dviz_pt.sumo.rows import COLUMNS, NEEDED, BadRowsError, RowPacker, RowsOfUsers, user_key
from sumo3dviz_pt.sumo.stream import Element, TruncatedError
from sumo3dviz_pt.sumo.values import is_plain, parse_number, parse_time

logger = logging.getLogger(__name__)

_FAR, _HIGH, _TURN = values.COORDINATE.high, values.HEIGHT.high, values.ANGLE.high
_OLDEST, _NEWEST = values.SECONDS.low, values.SECONDS.high
_BITS = values.SIGNAL_BITS.high
_RANGES = {
    "x": values.COORDINATE,
    "y": values.COORDINATE,
    "z": values.HEIGHT,
    "angle": values.ANGLE,
    "speed": values.ANY,
    "slope": values.ANGLE,
    "pos": values.ANY,
    "signals": values.SIGNAL_BITS,  # last: whole numbers
}
"""Allowed ranges of a row's numbers by attribute; impossible speeds count as not logged."""

_BLOCK = 200_000 * COLUMNS
"""Number of values after which a block of rows is passed on, 16 MB."""

Drain = Callable[[RowsOfUsers, Sequence[float]], None]
"""A function that takes rows, and the times of all steps read until then [s]."""


class _DoneError(Exception):
    """Everything up to the end of the window has been read."""


class LogReader(ElementSink):
    """Packs the rows of one log.

    Args:
        file: The log.
        window: First and last time to keep [s].
        lanes: Indices of lanes and edges; new ones are added.
        drain: Takes blocks of rows; None keeps all.

    Attributes:
        rows: The packed rows.
        breaks_off: Whether the log ends in the middle.
    """

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
        self.breaks_off = False
        self._drain = drain
        self._end = window[1]
        self._lanes = lanes
        self._packer = RowPacker(self.rows, lanes)
        self._time = nan
        self._kept = False
        self._inside = False

    @property
    def changed(self) -> dict[tuple[str, str], float]:
        """When road users first had a type of their own, by kind and id [s]."""
        return self._packer.changed

    @property
    def taken(self) -> dict[str, list[float]]:
        """Times of rows of people that name the vehicle they ride in, by its id [s]."""
        return self._packer.taken

    def read(self, *, allow_truncated: bool) -> None:
        """Stream the file into `rows` and `steps`."""
        try:
            try:
                format_of(self.file).read(self.file, self)
            finally:
                self._flush()
        except _DoneError:
            logger.debug("%s: stopped reading past %.12g s", self.file, self._end)
        except TruncatedError as error:
            self.breaks_off = True
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
            time = parse_number(attributes["time"])
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
            x, y = parse_number(attributes["x"]), parse_number(attributes["y"])
            z = parse_number(get("z", "0"))
            angle = parse_number(attributes["angle"])
            speed, slope = parse_number(get("speed", "nan")), parse_number(get("slope", "0"))
            offset = parse_number(get("pos", "nan"))
            signals = int(get("signals", "-1")) if is_plain(get("signals", "")) else -2
            key = user_key(tag, attributes["id"], get("type", ""))
        except (KeyError, ValueError):
            self._refuse(tag, attributes)
        # Written so that NaN fails too.
        if not (-_FAR <= x <= _FAR and -_FAR <= y <= _FAR and -_HIGH <= z <= _HIGH):
            self._refuse(tag, attributes)
        if not (key[1] and -_TURN <= angle <= _TURN and -_TURN <= slope <= _TURN):
            self._refuse(tag, attributes)
        if not -1 <= signals <= _BITS:
            self._refuse(tag, attributes)
        if self._packer.rides(tag, attributes, self._time):
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
            message = f'time="{cut(text)}" must be seconds, h:m:s or d:h:m:s, {values.SECONDS}'
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
        element.text("id")
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


_LEAST = 2_000_000
"""Size of logs below which they are read as quickly as what is cached of them [bytes]."""

_MOST = 2_000_000_000
"""Size of all cached logs above which the oldest are removed [bytes]."""

_MOST_ROWS = 10_000_000
"""Number of rows above which a log is not cached."""

_SAMPLES, _SAMPLE = 16, 65_536
"""Number and size of the samples of a file's content [bytes]."""

_NUMBERS = ("times", "positions", "yaws", "speeds", "slopes", "offsets")
_INDICES = ("lanes", "signals")


class CachedLog(NamedTuple):
    """A log, and what is to be noted whenever it is used."""

    log: TrafficLog
    notes: tuple[str, ...] = ()


def place_of(files: Sequence[Path], question: Iterable[Any]) -> Path | None:
    """Return the folder that keeps what is read of logs; None for small logs.

    Args:
        files: The logs.
        question: What else decides what is read, such as the window.
    """
    digest = hashlib.blake2b(catalog.code_digest("sumo"), digest_size=16)
    digest.update(repr(list(question)).encode())
    total = 0
    try:
        for file in files:
            total += file.stat().st_size
        if total < _LEAST:
            return None
        for file in files:
            _add_file(digest, file)
    except OSError:
        return None  # the reader says what is wrong
    return catalog.cache_root() / "logs" / digest.hexdigest()


def cached_log(place: Path) -> CachedLog | None:
    """Return a log that was cached; None if it is not there or damaged."""
    files = read_folder(place)
    if files is None:
        return None
    with contextlib.suppress(OSError):
        os.utime(place)  # the oldest are removed first
    try:
        return _unpacked(files)
    except (KeyError, ValueError, TypeError):
        return None


def cache_log(place: Path, cached: CachedLog) -> None:
    """Keep a log, unless it is huge, and remove the oldest ones if there are too many."""
    if sum(len(trace.times) for trace in cached.log.traces) > _MOST_ROWS:
        return
    try:
        write_folder(place, _packed(cached))
        make_room(place, _MOST)
    except OSError as error:
        logger.info("%s: the log is not kept (%s)", place, error)


def _packed(cached: CachedLog) -> Files:
    """Return a log as files."""
    log = cached.log
    about = {
        "users": [[t.kind, t.id, t.type_id, len(t.times)] for t in log.traces],
        "lanes": log.lane_names,
        "times": [log.begin, log.end, log.step],
        "changed": dict(log.changed),
        "taken": dict(log.taken),
        "notes": cached.notes,
    }
    arrays = {
        name: np.concatenate([np.empty(0), *(getattr(t, name).ravel() for t in log.traces)])
        for name in _NUMBERS
    } | {
        name: np.concatenate([np.empty(0, np.int64), *(getattr(t, name) for t in log.traces)])
        for name in _INDICES
    }
    files = {name: array.tobytes() for name, array in arrays.items()}
    return {"about.json": json.dumps(about).encode(), **files}


def _unpacked(files: Files) -> CachedLog:
    """Return a log that was cached as files."""
    about = json.loads(files["about.json"])
    arrays: dict[str, Any] = {name: np.frombuffer(files[name]) for name in _NUMBERS}
    arrays |= {name: np.frombuffer(files[name], np.int64) for name in _INDICES}
    arrays["positions"] = arrays["positions"].reshape(-1, 3)
    traces: list[Trace] = []
    start = 0
    for kind, own, type_id, count in about["users"]:
        end = start + count
        parts = {name: array[start:end] for name, array in arrays.items()}
        traces.append(Trace(id=own, kind=kind, type_id=type_id, **parts))
        start = end
    taken = {key: tuple((low, high) for low, high in own) for key, own in about["taken"].items()}
    begin, end, step = about["times"]
    names, changed = tuple(about["lanes"]), about["changed"]
    log = TrafficLog(tuple(traces), names, begin, end, step, changed=changed, taken=taken)
    return CachedLog(log, tuple(about["notes"]))


def _add_file(digest: Any, file: Path) -> None:
    """Add what tells a file from others."""
    state = file.stat()
    digest.update(f"{file.resolve()}\n{state.st_size}\n{state.st_mtime_ns}\n".encode())
    last = max(state.st_size - _SAMPLE, 0)
    with file.open("rb") as stream:
        for number in range(_SAMPLES):
            stream.seek(last * number // (_SAMPLES - 1))
            digest.update(stream.read(_SAMPLE))
