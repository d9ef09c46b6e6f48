"""How far a farm is and which worker has which task, from the files on disk only.

Every worker and `farm status` see the same. A try of a task is a file `tries/000012.003.json` (task
12, third try) that only one worker can make, because it is opened exclusively. Its time of change
is the worker's sign of life. How the try ended is a second file, `tries/000012.003.end.json`. Both
are made once and never changed. So nothing is ever taken from a worker: whichever goes on with a
dead worker's task ends that try, and makes the next.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.farm.plan import FarmPlan, FarmTask

TRIES = "tries"
"""Folder of the tries, in the farm's."""

_END = ".end.json"

_LATEST = 1e11  # no try begins after that [s, since 1970]


class Outcome(StrEnum):
    """How a try ended, in the words of its file."""

    DONE = "done"
    ASIDE = "aside"
    """All is there but frames that are set aside."""
    FAILED = "failed"
    LOST = "lost"
    """Its worker died."""
    STOPPED = "stopped"
    """Somebody asked for it; nothing is wrong."""
    REFUSED = "refused"
    """The command says that what it is asked for is wrong: no other try would go better."""


@dataclass(frozen=True, slots=True)
class End:
    """How a try ended.

    Attributes:
        outcome: In a word.
        frame: The frame that it ended at; None where none is to blame.
        stored: How many frames it stored.
        said: The last that the command said.
    """

    outcome: Outcome
    frame: int | None = None
    stored: int = 0
    said: str = ""


@dataclass(frozen=True, slots=True)
class Try:
    """A try of a task.

    Attributes:
        task: The task's number.
        number: Of the try, from 1.
        host: The machine that it runs on.
        pid: The worker's process there.
        began: When [s, since 1970].
        beat: The worker's last sign of life [s, since 1970].
        end: How it ended; None while nobody has said so.
    """

    task: int
    number: int
    host: str
    pid: int
    began: float
    beat: float
    end: End | None = None

    def alive(self, *, now: float, lease: float) -> bool:
        """Return whether its worker is at it.

        Args:
            now: The time [s, since 1970].
            lease: Time without a sign of life after which a worker counts as dead [s].
        """
        if self.end is not None:
            return False
        if self.host == this_host() and not _runs(self.pid):
            return False
        return now - self.beat < lease


@cache
def this_host() -> str:
    """Return a name of this machine; within a container, of that."""
    try:
        space = f" {Path('/proc/self/ns/pid').stat().st_ino}"
    except OSError:
        space = ""
    return f"{socket.gethostname()}{space}"


def take(folder: Path, task: int, number: int) -> Try | None:
    """Begin a try of a task, unless another worker has.

    Args:
        folder: The farm's.
        task: The task's number.
        number: Of the try.

    Returns:
        The try, or None if it is another's.
    """
    path = _file(folder, task, number)
    path.parent.mkdir(parents=True, exist_ok=True)
    now = time.time()
    own = Try(task, number, this_host(), os.getpid(), now, now)
    content = {"host": own.host, "pid": own.pid, "began": own.began}
    return own if _made(path, content) else None


def beat(folder: Path, own: Try) -> None:
    """Give a sign of life."""
    with suppress(OSError):  # a file system that is away for a moment; the next one will do
        os.utime(_file(folder, own.task, own.number))


def finish(folder: Path, one: Try, end: End) -> bool:
    """Say how a try ended; return whether nobody had said so before."""
    path = _file(folder, one.task, one.number)
    return _made(path.with_name(path.stem + _END), asdict(end))


def tries_in(folder: Path) -> dict[int, list[Try]]:
    """Return the tries of each task that has any, in order."""
    tries: dict[int, list[Try]] = {}
    place = folder / TRIES
    names = sorted(path.name for path in place.glob("*.json"))
    ended = {name for name in names if name.endswith(_END)}
    for name in names:
        if name in ended:
            continue
        stem = name.removesuffix(".json")
        task, _, number = stem.partition(".")
        if task.isdecimal() and number.isdecimal():
            end = stem + _END
            one = _read(place / name, int(task), int(number), place / end if end in ended else None)
            tries.setdefault(one.task, []).append(one)
    return tries


def forget(folder: Path, task: int) -> None:
    """Forget all tries of a task, so that it begins anew; their logs stay."""
    for path in sorted((folder / TRIES).glob(f"{task:06d}.*.json"), reverse=True):
        path.unlink(missing_ok=True)


def log_file(folder: Path, one: Try) -> Path:
    """Return where what the command says is kept."""
    return folder / "logs" / f"{one.task:06d}.{one.number:03d}.txt"


def _file(folder: Path, task: int, number: int) -> Path:
    """Return the file of a try."""
    return folder / TRIES / f"{task:06d}.{number:03d}.json"


def _made(path: Path, content: Mapping[str, Any]) -> bool:
    """Make a file that does not exist; return whether it did not."""
    try:
        with path.open("x", encoding="utf-8") as stream:
            json.dump(content, stream)
    except FileExistsError:
        return False
    return True


def _read(path: Path, task: int, number: int, ended: Path | None) -> Try:
    """Return a try by its files; one that is being written has no host yet."""
    known = _json(path)
    try:
        changed = path.stat().st_mtime
    except OSError:
        changed = 0.0
    with _intact(path):
        pid, began = int(known.get("pid", 0)), float(known.get("began", changed))
        if not 0 <= pid < 2**31 or not 0.0 <= began < _LATEST:
            raise ValueError(f"process {pid}, begun at {began:g}")
    end = None
    if ended is not None:
        with _intact(ended):
            end = _end(_json(ended))
    return Try(task, number, str(known.get("host", "")), pid, began, changed, end)


@contextmanager
def _intact(path: Path) -> Iterator[None]:
    """Say in one sentence what is wrong with a file of a try."""
    try:
        yield
    except (ArithmeticError, TypeError, ValueError) as error:
        raise InputError(
            f"the note of a try is damaged ({cut(str(error))}); remove it, and go on with"
            " `sumo3dviz-pt farm resume`",
            file=path,
        ) from error


def _end(known: Mapping[str, Any]) -> End:
    """Return an end by its file; one that is being written is told by the next look."""
    try:
        outcome = Outcome(known["outcome"])
    except KeyError:
        return End(Outcome.STOPPED)
    frame = known.get("frame")
    return End(
        outcome,
        None if frame is None else int(frame),
        int(known.get("stored", 0)),
        str(known.get("said", "")),
    )


def _json(path: Path) -> Mapping[str, Any]:
    """Return what a file holds; nothing while it is being written."""
    try:
        content = json.loads(path.read_bytes())
    except (OSError, RecursionError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _runs(pid: int) -> bool:
    """Return whether a process of this machine runs; where that cannot be asked, it does."""
    if sys.platform == "win32":  # os.kill would end it
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:  # it belongs to somebody else
        return True
    return not _is_zombie(pid)


def _is_zombie(pid: int) -> bool:
    """Return whether a process has ended and only its parent has not asked for its exit code."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    return text.rpartition(")")[2].split()[:1] == ["Z"]


STOP = "stop"
"""A file in the farm's folder: as long as it is there, nobody begins anything."""

_IN_A_ROW = 3
"""So many frames set aside one after the other, with none stored between them, are no accident."""

_UNDONE = (Outcome.FAILED, Outcome.LOST)


class TaskState(StrEnum):
    """What becomes of a task, in the words of `farm status`."""

    WAITING = "waiting"
    """For tasks that come first."""
    READY = "ready"
    RUNNING = "running"
    DONE = "done"
    ASIDE = "incomplete"
    """Frames of it are set aside."""
    FAILED = "failed"
    BLOCKED = "blocked"
    """A task that comes first will not be done."""


OVER = frozenset({TaskState.DONE, TaskState.ASIDE, TaskState.FAILED, TaskState.BLOCKED})
"""States that nothing but `farm resume` changes."""


@dataclass(frozen=True)
class FarmState:
    """How far a farm is.

    Attributes:
        plan: What it does.
        tries: Of each task that has any, in order.
        states: Of each task.
        present: Numbers of the frames that exist, of each film.
        aside: Numbers of the frames that are set aside, of each film.
        stopping: Whether nobody is to begin anything.
    """

    plan: FarmPlan
    tries: Mapping[int, Sequence[Try]]
    states: Sequence[TaskState]
    present: Sequence[frozenset[int]]
    aside: Sequence[frozenset[int]]
    stopping: bool

    @property
    def over(self) -> bool:
        """Whether nothing is left to do, or to be done by anybody."""
        return all(state in OVER for state in self.states)

    @property
    def complete(self) -> bool:
        """Whether everything was made."""
        return all(state is TaskState.DONE for state in self.states)

    @property
    def frames(self) -> tuple[int, int]:
        """Frames that exist, and all."""
        total = sum(film.frames for film in self.plan.films)
        return sum(map(len, self.present)), total

    def ready(self) -> list[int]:
        """Return the numbers of the tasks that can be begun."""
        return [n for n, state in enumerate(self.states) if state is TaskState.READY]

    def missing(self, number: int) -> list[int]:
        """Return which frames of a task are neither there nor set aside."""
        return _missing(self.plan.tasks[number], self.present, self.aside)

    def last(self, number: int) -> Try | None:
        """Return a task's last try."""
        tries = self.tries.get(number)
        return tries[-1] if tries else None

    def why(self, number: int) -> str:
        """Return what a task that failed said last."""
        ends = [one.end for one in self.tries.get(number, ()) if one.end is not None]
        said = [end.said for end in ends if end.outcome in (*_UNDONE, Outcome.REFUSED) and end.said]
        return said[-1] if said else "its worker died"


def read_state(plan: FarmPlan, *, now: float | None = None) -> FarmState:
    """Return how far a farm is.

    Args:
        plan: What it does.
        now: The time [s, since 1970]; default the clock's.
    """
    now = time.time() if now is None else now
    tries = tries_in(plan.folder)
    films = range(len(plan.films))
    present = [_present(plan, film) for film in films]
    aside = [_aside(plan, tries, film) for film in films]
    alone = [
        _state(plan, task, tries.get(number, []), now=now, whole=not _missing(task, present, aside))
        for number, task in enumerate(plan.tasks)
    ]
    _keep_developed(plan, alone, tries)
    states: list[TaskState] = []
    for task, own in zip(plan.tasks, alone, strict=True):
        states.append(_after([states[need] for need in task.needs], own))
    return FarmState(plan, tries, states, present, aside, (plan.folder / STOP).exists())


def _present(plan: FarmPlan, film: int) -> frozenset[int]:
    """Return the numbers of a film's frames that exist."""
    count = plan.films[film].frames
    try:
        with os.scandir(plan.place / plan.films[film].folder) as entries:
            stems = [Path(e.name).stem for e in entries if e.name.endswith(".exr") and e.is_file()]
    except OSError:
        return frozenset()
    return frozenset(int(stem) for stem in stems if stem.isdecimal() and int(stem) < count)


def _aside(plan: FarmPlan, tries: Mapping[int, Sequence[Try]], film: int) -> frozenset[int]:
    """Return the numbers of a film's frames that failed too often."""
    counts = Counter(
        one.end.frame
        for number in plan.rendering()
        if plan.tasks[number].film == film
        for one in tries.get(number, ())
        if one.end is not None and one.end.outcome in _UNDONE and one.end.frame is not None
    )
    return frozenset(frame for frame, count in counts.items() if count >= plan.tries)


def _missing(
    task: FarmTask, present: Sequence[frozenset[int]], aside: Sequence[frozenset[int]]
) -> list[int]:
    """Return which frames of a task are neither there nor set aside."""
    if task.frames is None or task.film is None:
        return []
    there = present[task.film] | aside[task.film]
    return [number for number in range(*task.frames) if number not in there]


def _state(
    plan: FarmPlan, task: FarmTask, tries: Sequence[Try], *, now: float, whole: bool
) -> TaskState:
    """Return what becomes of a task, as if nothing came before it.

    Args:
        plan: The farm's.
        task: The task.
        tries: Its own, in order.
        now: The time [s, since 1970].
        whole: Whether all of its frames are there, or set aside.
    """
    if tries and tries[-1].alive(now=now, lease=plan.lease):
        return TaskState.RUNNING
    outcomes = {one.end.outcome for one in tries if one.end is not None}
    if Outcome.REFUSED in outcomes or _is_hopeless(plan, tries):
        return TaskState.FAILED
    if whole and Outcome.ASIDE in outcomes:
        return TaskState.ASIDE
    if whole and Outcome.DONE in outcomes:
        return TaskState.DONE
    return TaskState.READY


def _is_hopeless(plan: FarmPlan, tries: Sequence[Try]) -> bool:
    """Return whether a task fails whatever frame it begins with, or without any to blame."""
    failed: Counter[int | None] = Counter()
    row = 0
    for end in (one.end for one in tries if one.end is not None):
        if end.stored:
            row = 0
        if end.outcome in _UNDONE:
            failed[end.frame] += 1
            row += end.frame is not None and failed[end.frame] == plan.tries
        if row >= _IN_A_ROW or failed[None] >= plan.tries:
            return True
    return False


def _after(before: Sequence[TaskState], own: TaskState) -> TaskState:
    """Return a task's state, by those of the tasks that come first."""
    if own is not TaskState.READY:
        return own
    if any(state in OVER and state is not TaskState.DONE for state in before):
        return TaskState.BLOCKED
    if any(state is not TaskState.DONE for state in before):
        return TaskState.WAITING
    return own


def _keep_developed(
    plan: FarmPlan, states: list[TaskState], tries: Mapping[int, Sequence[Try]]
) -> None:
    """Count tasks as done whose frames are gone because their film is made."""
    for number, task in enumerate(plan.tasks):
        ends = [one.end for one in tries.get(number, ()) if one.end is not None]
        if task.frames is None and any(end.outcome is Outcome.DONE for end in ends):
            states[number] = TaskState.DONE
            for need in task.needs:
                states[need] = TaskState.DONE
