"""Renders a film's frames one by one, all at once or as the film asks for them.

A frame can be finished before its process ends, so that no work is lost. Clusters and service
managers ask a process to end by SIGTERM (on Windows: Ctrl-Break) some time before they kill it. A
frame that is being rendered is finished first; else the work is broken off at once. In both cases
it ends as by Ctrl-C.
"""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import closing, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sumo3dviz_pt.image.exr import PROVENANCE, write_exr
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.films.frames import FINISHED_AT_ONCE, frame_file
from sumo3dviz_pt.pipeline.films.traced import traced_by, write_traced
from sumo3dviz_pt.pipeline.production import Production, opened

if TYPE_CHECKING:
    from sumo3dviz_pt.model.scene import FrameState
    from sumo3dviz_pt.pipeline.films.layers import LayerWriter
    from sumo3dviz_pt.render.session import Session


WORKER = "SUMO3DVIZ_PT_WORKER"
"""Environment variable with the process that watches this one; it ends soon after that one."""

SIGNALS = [getattr(signal, name) for name in ("SIGTERM", "SIGBREAK") if hasattr(signal, name)]
"""Signals that ask a process to end; the last one is that which other processes can send here."""


@dataclass(slots=True)
class _Asked:
    """Whether the process was asked to end, and whether a frame is to be finished first."""

    asked: bool = False
    busy: bool = False


_ASKED: ContextVar[_Asked | None] = ContextVar("asked", default=None)


@contextmanager
def stoppable() -> Iterator[None]:
    """Finish a frame when the process is asked to end within the `with` statement.

    Raises:
        KeyboardInterrupt: After the frame, or at once where none is being rendered.
    """
    state = _Asked()

    def on_signal(*_: object) -> None:
        state.asked = True
        if not state.busy:
            raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    before = {which: signal.signal(which, on_signal) for which in SIGNALS if main}
    token = _ASKED.set(state)
    try:
        yield
    finally:
        _ASKED.reset(token)
        for which, handler in before.items():
            signal.signal(which, handler)


@contextmanager
def whole_frame() -> Iterator[None]:
    """Finish what is within the `with` statement before the process ends.

    Raises:
        KeyboardInterrupt: Afterwards, if the process was asked to end meanwhile.
    """
    state = _ASKED.get()
    if state is None:
        yield
        return
    state.busy = True
    try:
        yield
    finally:
        state.busy = False
    if state.asked or _left_alone():
        raise KeyboardInterrupt


def _left_alone() -> bool:
    """Return whether the worker that watched this process has died; never true on Windows."""
    worker = os.environ.get(WORKER, "")
    return worker.isdecimal() and os.getppid() != int(worker) and os.name == "posix"


_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class FrameDone:
    """How far a film is after a frame.

    Attributes:
        done: Frames that exist now.
        total: Frames that were asked for.
        seconds_left: Estimate of the wall time left [s].
        kept: True if the frame was there already.
        cpu: CPU-seconds by phase; empty if kept.
    """

    done: int
    total: int
    seconds_left: float
    kept: bool
    cpu: dict[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """A film's frames on disk, and what is needed to make those that are missing.

    Attributes:
        production: What they show.
        folder: Where they go.
        wanted: Their numbers.
        missing: The numbers of those that are to be rendered, ascending.
        shared: The account that they share.
        on_frame: Called after every frame.
    """

    production: Production
    folder: Path
    wanted: Sequence[int]
    missing: Sequence[int]
    shared: Mapping[str, Any]
    on_frame: Callable[[FrameDone], None] | None

    @property
    def files(self) -> list[Path]:
        """All of their files."""
        return [frame_file(self.folder, number) for number in self.wanted]

    @property
    def layers(self) -> LayerWriter | None:
        """What writes the film's layers; None where none are asked for."""
        if not self.production.job.output.layers:
            return None
        from sumo3dviz_pt.pipeline.films.layers import LayerWriter

        return LayerWriter.beside(self.folder, self.production)

    def _shown(self) -> Production:
        """Return what the renderer shows: where layers are asked for, all faces have names."""
        if not self.production.job.output.layers:
            return self.production
        from sumo3dviz_pt.shot.picking import with_things

        return replace(self.production, shot=with_things(self.production.shot))

    def rendered(self, cpu: dict[str, float]) -> Generator[int, None, None]:
        """Render what is missing; yield each number when its frame is stored.

        While a frame is traced, the one before it is written, and what the next one shows is
        found. Whatever ends the work, each frame that was traced is stored.

        Args:
            cpu: CPU-seconds by phase, to which is added.
        """
        if not self.missing:
            return
        started = time.monotonic()
        # Leaving the pools waits for what they still write.
        with opened(self._shown()) as session, _one_thread() as ahead, _one_thread() as files:
            announce(Doing.RENDER, len(self.wanted) - len(self.missing), len(self.wanted))
            traced = self._traced(session, ahead, files)
            for count, (number, spent, stored) in enumerate(_one_late(traced), start=1):
                stored.result()
                for phase, seconds in spent.items():
                    cpu[phase] = cpu.get(phase, 0.0) + seconds
                self._tell_rendered(count, time.monotonic() - started, spent)
                yield number

    def _traced(
        self, session: Session, ahead: Executor, files: Executor
    ) -> Iterator[tuple[int, dict[str, float], Future[None]]]:
        """Trace what is missing, and let each frame be stored beside the next one.

        Args:
            session: That traces.
            ahead: Finds what the next frame shows.
            files: Writes frames, in order.

        Yields:
            Each frame's number, CPU-seconds by phase, and what becomes true when it is stored.
        """
        production, layers = self.production, self.layers
        times = [float(production.times[number]) for number in self.missing]
        coming = ahead.submit(production.frame_at, times[0])
        for number, after in zip(self.missing, [*times[1:], None], strict=True):
            with whole_frame():
                frame = coming.result()
                # Layers ask the shot themselves, and a shot answers one at a time.
                if after is not None and layers is None:
                    coming = ahead.submit(production.frame_at, after)
                write = _rendered_frame(production, session, number, frame, self.shared)
                stored = files.submit(write, frame_file(self.folder, number))
                if layers is not None:
                    layers.write(session, number)
                    coming = coming if after is None else ahead.submit(production.frame_at, after)
                spent = dict(session.clock.seconds)
            yield number, spent, stored

    def _tell_rendered(self, count: int, seconds: float, spent: dict[str, float]) -> None:
        """Say that some frames are rendered.

        Args:
            count: How many.
            seconds: Wall time that they took [s].
            spent: CPU-seconds of the last one, by phase.
        """
        done = len(self.wanted) - len(self.missing) + count
        announce(Doing.RENDER, done, len(self.wanted))
        left = seconds / count * (len(self.missing) - count)
        self._tell(FrameDone(done, len(self.wanted), left, kept=False, cpu=spent))

    def passing(self, cpu: dict[str, float]) -> Generator[Path, None, None]:
        """Yield all files in order, each when those exist that help it; drop what none needs.

        A frame whose file was yielded is read at once, but its account is asked for again when its
        picture is there, a few frames later.

        Only frames that were rendered here go: what took another run's time stays until there is
        a film. So memory and disk hold a window, however long the film is.

        Args:
            cpu: As in `rendered`.
        """
        window = self.production.quality.accumulate
        pending, own = deque(self.missing), set(self.missing)
        with closing(self.rendered(cpu)) as rendering:
            for number in self.wanted:
                while pending and pending[0] <= number + window:
                    pending.popleft()
                    next(rendering)
                yield frame_file(self.folder, number)
                done = number - window - FINISHED_AT_ONCE
                if done in own:
                    frame_file(self.folder, done).unlink()

    @contextmanager
    def turns(self, cpu: dict[str, float], *, discard: bool) -> Iterator[Iterable[Path]]:
        """Give all files in order; those that do not stay are rendered as they are asked for.

        Args:
            cpu: As in `rendered`.
            discard: Whether they do not stay; else they are there already.
        """
        if not discard:
            yield self.files
            return
        with closing(self.passing(cpu)) as files:
            yield files

    def tell_kept(self) -> None:
        """Say how many frames were there before."""
        there = len(self.wanted) - len(self.missing)
        if there:
            self._tell(FrameDone(there, len(self.wanted), 0.0, kept=True, cpu={}))

    def _tell(self, event: FrameDone) -> None:
        """Say how far the film is."""
        if self.on_frame is not None:
            self.on_frame(event)


def _one_thread() -> ThreadPoolExecutor:
    """Return a thread that does one thing after the other."""
    return ThreadPoolExecutor(max_workers=1)


def _one_late(frames: Iterator[_T]) -> Iterator[_T]:
    """Go through frames such that each comes when the next one was traced."""
    last: list[_T] = []
    for frame in frames:
        yield from last
        last = [frame]
    yield from last


def _rendered_frame(
    production: Production,
    session: Session,
    number: int,
    frame: FrameState,
    shared: Mapping[str, Any],
) -> Callable[[Path], None]:
    """Render one frame; return what writes its file.

    Args:
        production: Whose frame it is.
        session: That renders it.
        number: Of the frame.
        frame: What it shows.
        shared: The account that all frames share.
    """
    samples = session.samples(frame)
    half, helped = production.job.output.half, "ids" in samples.layers
    account = {
        **shared,
        "frame": number,
        "time": float(production.times[number]),
        "capped_share": round(samples.tally.capped_share, 6),
        "nonfinite": samples.tally.nonfinite,
        "stored": "traced" if helped else "finished",
    }
    if helped:
        traced, how = traced_by(session, samples, frame), session.finishing_of(frame)
        return lambda path: write_traced(path, traced, how, account=account, half=half)
    finished = {"radiance": session.finish(samples, frame)}
    text = {PROVENANCE: json.dumps(account, sort_keys=True)}
    return lambda path: write_exr(path, finished, half=half, attributes=text)
