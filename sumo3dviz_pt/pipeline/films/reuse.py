"""Decides which existing frames stay: nothing is overwritten or mixed without an order to.

A folder has a lock that one process at a time holds. The operating system holds it for a file in
the folder and lets go when the process ends, however it ends: so a file that a killed process left
is no lock, and the next process takes it over. The file says which process holds it, for messages
only.
"""

from __future__ import annotations

import json
import logging
import os
import socket
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.pipeline.films.frames import (
    NOTE,
    State,
    account_file,
    film_of,
    frame_file,
    frame_numbers,
    frames_folder,
    is_sequence,
    masters_folder,
    numbered,
    read_account,
    state_of,
    traced_on,
    why_other,
)
from sumo3dviz_pt.pipeline.films.layers import beside, is_written
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.films.overlays import FACTS
from sumo3dviz_pt.pipeline.production import Production

log = logging.getLogger(__name__)

LOCK = "render.lock"
"""The file's name."""

_ON_WINDOWS = sys.platform == "win32"

_FAR = 1 << 30
"""Offset of the byte that Windows locks: far from the text, because locked bytes are unreadable."""


@contextmanager
def held(folder: Path, *, what: str) -> Iterator[None]:
    """Hold a folder's lock.

    Args:
        folder: It exists.
        what: What cannot be done twice at once, such as `film.mp4 is being rendered`.

    Raises:
        ConfigError: If another process holds it; the message says which.
    """
    path = folder / LOCK
    with _taken(path, what) as file:
        file.truncate(0)
        file.write(json.dumps({"pid": os.getpid(), "host": socket.gethostname()}).encode())
        file.flush()
        try:
            yield
        finally:
            if not _ON_WINDOWS:
                path.unlink(missing_ok=True)
    if _ON_WINDOWS:  # no open file can be removed there, and the next one may have it open by now
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _taken(path: Path, what: str) -> BinaryIO:
    """Return the lock's file, open and locked: the one of that name, not one just removed."""
    while True:
        file = path.open("a+b")
        if not _locked(file):
            file.close()
            raise ConfigError(f"{what} by {_holder(path)}: wait for it, or stop it", key="output")
        with suppress(FileNotFoundError):
            if _same(file, path):
                return file
        file.close()


def _same(file: BinaryIO, path: Path) -> bool:
    """Return whether a path still leads to an open file."""
    return os.path.samestat(os.fstat(file.fileno()), path.stat())


def _holder(path: Path) -> str:
    """Return the process that holds a lock, by the lock's file."""
    try:
        known = json.loads(path.read_bytes())
        return f"process {known['pid']} on {known['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"


if sys.platform == "win32":
    import msvcrt

    def _locked(file: BinaryIO) -> bool:
        """Lock an open file, unless another process has."""
        file.seek(_FAR)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _locked(file: BinaryIO) -> bool:
        """Lock an open file, unless another process has."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            log.warning(
                "%s: this file system knows no locks (%s): do not render one film twice at once",
                file.name,
                error.strerror,
            )
        return True


def check_unused(path: Path, order: FilmOrder, *, count: int, also: Sequence[Path] = ()) -> None:
    """Refuse to overwrite a film or frames that exist, unless the order says so.

    Args:
        path: The film, or its numbered pictures.
        order: What was asked for.
        count: Frames of the whole film.
        also: Further files of it.

    Raises:
        ConfigError: If a film is being rendered there, or anything would be overwritten.
    """
    folder = frames_folder(path)
    if order.frames is None and folder.is_dir():
        with alone(path):
            pass
    if order.resume or order.overwrite:
        return
    there = frame_numbers(folder)
    if order.frames is not None:
        first, after = order.frames
        there = [number for number in there if first <= number < after]
    outputs = () if order.frames else (*_outputs(path, order, count), *also)
    used = next((output for output in outputs if output.exists()), None)
    if used is not None or there:
        what = f"{used} exists" if used else f"{folder} holds {counted(len(there), 'frame')} of it"
        raise ConfigError(
            f"{what} already: --resume keeps frames that fit, --overwrite replaces all",
            key="output",
        )


def _outputs(path: Path, order: FilmOrder, count: int) -> Iterator[Path]:
    """Yield all files of a film, beside its frames."""
    yield account_file(path)
    if order.final_exr:
        yield from (frame_file(masters_folder(path), number) for number in range(count))
    if is_sequence(path):
        yield from (numbered(path, number) for number in range(count))
    else:
        yield path


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Keep other processes from rendering a whole film meanwhile; no empty folder stays."""
    folder = frames_folder(path)
    folder.mkdir(exist_ok=True)
    try:
        with held(folder, what=f"{path} is being rendered"):
            yield
    finally:
        with suppress(OSError):
            folder.rmdir()


def missing_frames(
    production: Production,
    folder: Path,
    wanted: Sequence[int],
    order: FilmOrder,
    shared: Mapping[str, Any],
) -> list[int]:
    """Return the numbers of the frames that are to be rendered; says why others are not kept.

    Args:
        production: The film's.
        folder: Of its frames.
        wanted: Numbers of the frames that were asked for.
        order: Whether frames that exist are kept, replaced or neither.
        shared: The account that all frames share.

    Raises:
        ConfigError: If frames would come to lie among those of another film, or among those that
            another device traced.
    """
    if order.frames is not None:
        _check_neighbours(folder, wanted, order, shared)
    if order.resume:
        return _stale(production, folder, wanted, order, shared)
    if order.overwrite:
        for number in frame_numbers(folder) if order.frames is None else wanted:
            frame_file(folder, number).unlink(missing_ok=True)
    return list(wanted)


def _check_neighbours(
    folder: Path, wanted: Sequence[int], order: FilmOrder, shared: Mapping[str, Any]
) -> None:
    """Refuse a part of a film beside parts of another; say so where the order allows it."""
    before = film_of(folder) if set(frame_numbers(folder)) - set(wanted) else None
    if before is None:
        return
    if before.get("key") == shared["key"]:
        _check_device(folder, before, order, shared)
        return
    what = f"{folder} holds frames of another film (what differs: {why_other(before, shared)})"
    if not (order.resume or order.overwrite):
        raise ConfigError(f"{what}; give another output, or --overwrite", key="output")
    log.warning("%s; they have to be rendered anew", what)


def _check_device(
    folder: Path, there: Mapping[str, Any], order: FilmOrder, shared: Mapping[str, Any]
) -> None:
    """Refuse to mix devices in one film, whose pixels differ a little, unless the order says so.

    Args:
        folder: Of the film's frames.
        there: The account of some that are there.
        order: Says whether they may be mixed.
        shared: The account of those to come.
    """
    before, now = traced_on(there), traced_on(shared)
    if before == now:
        return
    what = f"{folder} holds frames that were traced by {before}, and this command traces by {now}"
    if not order.mix_devices:
        raise ConfigError(
            f"{what}: go on with --variant {there.get('variant')} on a machine like the first,"
            " begin anew with --overwrite, or let `render` or `farm` keep both with --mix-devices",
            key="variant",
        )
    log.warning("%s: both stay in one film", what)


def _stale(
    production: Production,
    folder: Path,
    wanted: Sequence[int],
    order: FilmOrder,
    shared: Mapping[str, Any],
) -> list[int]:
    """Return the numbers of frames that are missing, damaged or not what would be rendered now."""
    states: dict[int, State] = {
        number: state_of(
            frame_file(folder, number), shared=shared, time=float(production.times[number])
        )
        for number in wanted
    }
    elsewhere = [number for number, state in states.items() if state == "elsewhere"]
    if elsewhere:
        _check_device(folder, read_account(frame_file(folder, elsewhere[0])), order, shared)
        states |= dict.fromkeys(elsewhere, "done")
    bare = _without_layers(
        production, folder, [n for n, state in states.items() if state == "done"]
    )
    states |= dict.fromkeys(bare, "absent")
    if bare:
        layers = ", ".join(production.job.output.layers)
        log.warning(
            "%s: rendered anew for their layers (%s): %s",
            folder,
            layers,
            counted(len(bare), "frame"),
        )
    counts = Counter(states.values())
    if counts["damaged"]:
        log.warning("%s: rendered anew as damaged: %s", folder, counted(counts["damaged"], "frame"))
    if counts["other"]:
        first = next(number for number in wanted if states[number] == "other")
        log.warning(
            "%s: rendered anew: %s; what differs: %s",
            folder,
            counted(counts["other"], "frame"),
            why_other(read_account(frame_file(folder, first)), shared),
        )
    return [number for number in wanted if states[number] != "done"]


def _without_layers(production: Production, folder: Path, there: Sequence[int]) -> list[int]:
    """Return the numbers of frames that are there without all layers that are asked for."""
    wanted, place = production.job.output.layers, beside(folder)
    if not wanted:
        return []
    return [n for n in there if not is_written(place, n, key=production.key, layers=wanted)]


def discard(folder: Path, wanted: Sequence[int]) -> None:
    """Remove what is left of a film's frames, and nothing else that lies beside them."""
    for file in (*(frame_file(folder, number) for number in wanted), folder / NOTE):
        file.unlink(missing_ok=True)
    (folder / FACTS).unlink(missing_ok=True)
