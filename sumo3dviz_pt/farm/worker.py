"""Works at a farm's tasks: claims one, runs its command line, watches it, says how it ended."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.farm.plan import PROGRAM, FarmPlan
from sumo3dviz_pt.farm.state import (
    OVER,
    STOP,
    End,
    FarmState,
    Outcome,
    Try,
    beat,
    finish,
    log_file,
    read_state,
    take,
)
from sumo3dviz_pt.files.atomic import own_folder
from sumo3dviz_pt.installation.dependencies import THREADS
from sumo3dviz_pt.pipeline.films.frames import frame_file
from sumo3dviz_pt.pipeline.films.rendering import SIGNALS, WORKER

log = logging.getLogger(__name__)

_LOOK = 0.2
"""Time between two looks at a command that runs [s]."""

_BEATS = 6
"""Signs of life within a lease."""

_IDLE = 10.0
"""Longest time between two looks at the disk while there is nothing to begin [s]."""

_KERNELS = "DRJIT_CACHE_DIR"
"""Environment variable that names a folder for compiled kernels to Dr.Jit."""

_INTERRUPTED, _WRONG = 130, 2
"""Exit codes of our commands."""


@dataclass(slots=True)
class Orders:
    """What a worker is told while it works.

    Attributes:
        stop: Whether it is to end soon.
        threads: That a command uses; None is the plan's or Slurm's choice, or all.
    """

    stop: bool = False
    threads: int | None = None

    def wait(self, seconds: float) -> None:
        """Wait, but not when it is to end."""
        until = time.monotonic() + seconds
        while not self.stop and time.monotonic() < until:
            time.sleep(min(_LOOK, seconds))


@contextmanager
def listening() -> Iterator[Orders]:
    """Finish the frame that is being rendered, and then end, on Ctrl-C and SIGTERM."""
    orders = Orders()

    def on_signal(*_: object) -> None:
        orders.stop = True

    before = {which: signal.signal(which, on_signal) for which in (signal.SIGINT, *SIGNALS)}
    try:
        yield orders
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)


def work(
    plan: FarmPlan, orders: Orders, *, only: int | None = None, tell: Callable[[str], None]
) -> FarmState:
    """Work until nothing is left to do, or until somebody says stop.

    Args:
        plan: The farm's.
        orders: What it is told meanwhile.
        only: Work at this task only; None is all, one after the other.
        tell: Is told what is begun and how it ended.

    Returns:
        How far the farm is then.

    Raises:
        ConfigError: If others may write to this machine's compiled kernels.
    """
    _kernels(plan)  # before a task is claimed
    pause = _LOOK
    while True:
        state = read_state(plan)
        if state.stopping or orders.stop or _is_over(state, only):
            return state
        ready = [n for n in state.ready() if only in (None, n)]
        if _begun(state, ready, orders, tell):
            pause = _LOOK
            continue
        if only is not None and not ready and not _is_held(state, only):
            return state  # it waits for others
        orders.wait(pause)
        pause = min(2 * pause, _IDLE, plan.lease / _BEATS)


def _is_over(state: FarmState, only: int | None) -> bool:
    """Return whether nothing is left to do."""
    return state.over if only is None else state.states[only] in OVER


def _is_held(state: FarmState, number: int) -> bool:
    """Return whether a worker is at a task."""
    last = state.last(number)
    return last is not None and last.alive(now=time.time(), lease=state.plan.lease)


def _begun(
    state: FarmState, ready: Sequence[int], orders: Orders, tell: Callable[[str], None]
) -> bool:
    """Try the first task that no other worker takes; return whether there was one."""
    plan = state.plan
    for number in ready:
        last = state.last(number)
        if last is not None and last.end is None:
            finish(plan.folder, last, _lost(state, last))
        own = take(plan.folder, number, 1 if last is None else last.number + 1)
        if own is not None:
            tell(f"task {number}, try {own.number}: {_shown(plan, number)}")
            end = _tried(state, own, orders)
            finish(plan.folder, own, end)
            tell(f"task {number}, try {own.number}: {end.outcome}{_blame(end)}")
            return True
    return False


def _shown(plan: FarmPlan, number: int) -> str:
    """Return what a task makes, in a few words."""
    task = plan.tasks[number]
    name = "all films" if task.film is None else Path(plan.films[task.film].path).name
    if task.frames is None:
        return name
    return f"frames {task.frames[0]} to {task.frames[1] - 1} of {name}"


def _blame(end: End) -> str:
    """Return what is wrong, as the end of a line."""
    frame = "" if end.frame is None else f" at frame {end.frame}"
    return f"{frame}: {end.said}" if end.said else frame


def _lost(state: FarmState, last: Try) -> End:
    """Return how a dead worker's try ended: at the first frame that is not there."""
    missing = state.missing(last.task)
    return End(
        Outcome.LOST, missing[0] if missing else None, said=f"the worker on {last.host} died"
    )


def _tried(state: FarmState, own: Try, orders: Orders) -> End:
    """Carry out a task."""
    plan = state.plan
    task = plan.tasks[own.task]
    before = len(state.missing(own.task))
    if task.frames is None:
        return _run(plan, own, task.line(), orders)
    assert task.film is not None
    aside = state.aside[task.film] & frozenset(range(*task.frames))
    if not before and aside:
        return End(Outcome.ASIDE)
    for first, after in parts(task.frames, aside, state.missing(own.task)):
        end = _run(plan, own, task.line((first, after)), orders)
        if end.outcome is not Outcome.DONE:
            return _judged(plan, own, end, before=before, aside=aside)
    return End(Outcome.ASIDE if aside else Outcome.DONE, stored=before)


def parts(
    frames: tuple[int, int], aside: frozenset[int], missing: Sequence[int]
) -> list[tuple[int, int]]:
    """Return the stretches of a task to render: without frames that are set aside.

    Args:
        frames: First and after-last frame of the task.
        aside: Frames that are set aside.
        missing: Frames that are neither there nor set aside.

    Returns:
        First and after-last frame of each; all that hold a missing frame, or all if none does.
    """
    spans: list[tuple[int, int]] = []
    first = frames[0]
    for stop in (*sorted(aside), frames[1]):
        if first < stop:
            spans.append((first, stop))
        first = stop + 1
    needed = [part for part in spans if any(part[0] <= frame < part[1] for frame in missing)]
    return needed or spans


def _judged(plan: FarmPlan, own: Try, end: End, *, before: int, aside: frozenset[int]) -> End:
    """Return how a try ended that stored some frames: the first missing one is to blame."""
    task = plan.tasks[own.task]
    assert task.frames is not None
    folder = plan.frames_of(task)
    missing = [
        number
        for number in range(*task.frames)
        if number not in aside and not frame_file(folder, number).is_file()
    ]
    blamed = end.outcome is Outcome.FAILED and missing
    return End(end.outcome, missing[0] if blamed else None, before - len(missing), end.said)


def _run(plan: FarmPlan, own: Try, words: Sequence[str], orders: Orders) -> End:
    """Run a command line and watch it."""
    path = log_file(plan.folder, own)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as stream:
        begin = stream.seek(0, os.SEEK_END)
        process = subprocess.Popen(
            [*PROGRAM, *words],
            cwd=plan.place,
            env=_environment(plan, orders),
            stdin=subprocess.DEVNULL,
            stdout=stream,
            stderr=subprocess.STDOUT,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            start_new_session=True,  # Ctrl-C comes from the worker, after the frame
        )
        code = _watched(plan, own, process, orders)
        line = _last_line(stream, begin)
    if code == 0:
        return End(Outcome.DONE)
    if code == _INTERRUPTED or orders.stop:
        return End(Outcome.STOPPED)
    if code == _WRONG:
        return End(Outcome.REFUSED, said=line)
    how = f"killed by signal {-code}" if code < 0 else f"exit code {code}"
    return End(Outcome.FAILED, said=line or how)


def _watched(plan: FarmPlan, own: Try, process: subprocess.Popen[bytes], orders: Orders) -> int:
    """Wait for a command; give signs of life; pass on that it is to stop. Returns its exit code."""
    ending, beaten = False, time.monotonic()
    while process.poll() is None:
        if time.monotonic() - beaten > plan.lease / _BEATS:
            beat(plan.folder, own)
            beaten = time.monotonic()
        if not ending and (orders.stop or (plan.folder / STOP).exists()):
            ending = True
            process.send_signal(SIGNALS[-1])
        time.sleep(_LOOK)
    return process.wait()


def _environment(plan: FarmPlan, orders: Orders) -> dict[str, str]:
    """Return the environment of a command: threads, a kernel cache of this machine, its worker."""
    env = {**os.environ, WORKER: str(os.getpid())}
    threads = orders.threads or os.environ.get("SLURM_CPUS_PER_TASK") or plan.engine.threads
    if threads:
        env[THREADS] = str(threads)
    cache = _kernels(plan)
    if cache is not None:
        env[_KERNELS] = str(cache)
    return env


def _kernels(plan: FarmPlan) -> Path | None:
    """Return where this machine keeps compiled kernels; None for the user's own folder.

    Homes are often shared, and processors differ. Kernels are code, so nobody else may write there.

    Raises:
        ConfigError: If somebody else may have.
    """
    if plan.engine.name == "local" or _KERNELS in os.environ:
        return None
    path = Path(tempfile.gettempdir()) / f"sumo3dviz-pt-kernels-{_user()}"
    try:
        return own_folder(path)
    except (ConfigError, OSError) as error:
        raise ConfigError(
            f"compiled kernels cannot be kept in {path} ({error}); remove that, or let"
            f" {_KERNELS} name a folder of your own",
            key="engine",
        ) from error


def _user() -> str:
    """Return who runs this; no other user may write to what is kept."""
    return str(os.getuid()) if sys.platform != "win32" else os.environ.get("USERNAME", "user")


def _last_line(stream: IO[bytes], begin: int) -> str:
    """Return the last that a command said but how far it is."""
    end = stream.seek(0, os.SEEK_END)
    stream.seek(max(begin, end - 20_000))
    text = stream.read().decode("utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines()]
    rest = [line for line in lines if line and not line.endswith(" left")]
    return rest[-1][:500] if rest else ""
