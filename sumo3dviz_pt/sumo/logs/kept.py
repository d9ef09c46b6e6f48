"""Keep vehicle logs that were read, so that the next command need not read them again.

A kept log lies in the user's cache under all that it depends on: the files, the asked window, where
the network lies, and our own code. To hash 700 MB takes longer than to load what was made of them,
so a file counts as the same if its path, its size, its time of change and some samples of its
content are.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.files.kept import Files, keep, make_room, read_whole
from sumo3dviz_pt.model.traffic import Trace, TrafficLog

logger = logging.getLogger(__name__)

_LEAST = 2_000_000
"""Size of logs below which they are read as quickly as what is kept of them [bytes]."""

_MOST = 2_000_000_000
"""Size of all kept logs above which the oldest are removed [bytes]."""

_MOST_ROWS = 10_000_000
"""Number of rows above which a log is not kept."""

_SAMPLES, _SAMPLE = 16, 65_536
"""Number and size of the samples of a file's content [bytes]."""

_NUMBERS = ("times", "positions", "yaws", "speeds", "slopes", "offsets")
_INDICES = ("lanes", "signals")


class KeptLog(NamedTuple):
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


def kept_log(place: Path) -> KeptLog | None:
    """Return a log that was kept; None if it is not there or damaged."""
    files = read_whole(place)
    if files is None:
        return None
    with contextlib.suppress(OSError):
        os.utime(place)  # the oldest are removed first
    try:
        return _unpacked(files)
    except (KeyError, ValueError, TypeError):
        return None


def keep_log(place: Path, kept: KeptLog) -> None:
    """Keep a log, unless it is huge, and remove the oldest ones if there are too many."""
    if sum(len(trace.times) for trace in kept.log.traces) > _MOST_ROWS:
        return
    try:
        keep(place, _packed(kept))
        make_room(place, _MOST)
    except OSError as error:
        logger.info("%s: the log is not kept (%s)", place, error)


def _packed(kept: KeptLog) -> Files:
    """Return a log as files."""
    log = kept.log
    about = {
        "users": [[t.kind, t.id, t.type_id, len(t.times)] for t in log.traces],
        "lanes": log.lane_names,
        "times": [log.begin, log.end, log.step],
        "notes": kept.notes,
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


def _unpacked(files: Files) -> KeptLog:
    """Return a log that was kept as files."""
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
    log = TrafficLog(tuple(traces), tuple(about["lanes"]), *about["times"])
    return KeptLog(log, tuple(about["notes"]))


def _add_file(digest: Any, file: Path) -> None:
    """Add what tells a file from others."""
    state = file.stat()
    digest.update(f"{file.resolve()}\n{state.st_size}\n{state.st_mtime_ns}\n".encode())
    last = max(state.st_size - _SAMPLE, 0)
    with file.open("rb") as stream:
        for number in range(_SAMPLES):
            stream.seek(last * number // (_SAMPLES - 1))
            digest.update(stream.read(_SAMPLE))
