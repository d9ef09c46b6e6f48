"""Shows how far long work is and how long it will still take, from its first second on.

Work is a sequence of steps with expected durations, estimated before any of it is done. What they
really took corrects the expectation of those to come, and so does a step that is late; a step that
counts is judged by its own pace. Where other programs keep the processor, our share of it tells
before a step is late.

The constants are what two cores of a shared server needed for `ronda`, `crossing`, Barcelona,
Bologna and Bad Hersfeld, see docs/internals/forecasts.md; those of `check` follow from what a bench
measured (`tests/bench/checks.py`).
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, NamedTuple, TextIO

from sumo3dviz_pt.job.settings import Job, Quality
from sumo3dviz_pt.model.progress import Doing, ProgressEvent, heard_by
from sumo3dviz_pt.pipeline.costs import TYPICAL_TRIANGLES, Rates, cost_of, rates_of
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.heard import is_heard
from sumo3dviz_pt.pipeline.films.orders import FilmOrder, shots_of, wanted_frames
from sumo3dviz_pt.pipeline.production import Request, scenario_files
from sumo3dviz_pt.pipeline.scene_file import quality_preset

if TYPE_CHECKING:
    from tqdm import tqdm


_TRUST = 10.0
"""Weight of the expectation against what was measured, as seconds of work that took as expected."""

_BRIEF = 1.0
"""Time within which our share of the processor says little [s]."""

_OWN = frozenset({Doing.READ, Doing.SCOUT, Doing.BUILD})
"""What a thread of our own does, which never waits but for the processor."""

_UNUSUAL = 3
"""Number of frames at the beginning that take longer than others."""

_MEMORY = 30
"""Number of last frames that tell the pace."""

_PROGRESS_FIRST = 0.8
"""Nothing is said about work that takes less [s]."""

_GATHER, _GATHER_PER_TIME, _WRITE = 6.0, 0.03, 6.0
"""What exports take: everything that stands, each time of the traffic, and the file [s]."""

_SAID_EVERY = 10.0
"""Time between two lines where lines cannot be overwritten [s]."""

_DRAWN_EVERY = 0.5
"""Time between two drawings of a bar, where lines can be overwritten [s]."""


@dataclass(frozen=True, slots=True)
class WorkStep:
    """A part of the work.

    Attributes:
        doing: What.
        seconds: How long it should take [s].
    """

    doing: Doing
    seconds: float


class _Count(NamedTuple):
    """How many of the things that a step counts were done at a time [s]."""

    time: float
    done: int


@dataclass(slots=True)
class WorkCourse:
    """How far work is.

    Attributes:
        steps: All that it consists of, in order.
        began: When it began, by any clock [s].
        busy: Tells the processor's time that our process took until now [s]; None if unknown.
    """

    steps: Sequence[WorkStep]
    began: float
    busy: Callable[[], float] | None = None
    _at: int = 0
    _step_began: float = field(default=0.0)
    _busy_before: float = field(default=0.0)
    _counts: list[_Count] = field(default_factory=list)
    _event: ProgressEvent | None = None

    def __post_init__(self) -> None:
        """Begin the first step with the work."""
        self._step_began = self.began
        self._busy_before = 0.0 if self.busy is None else self.busy()

    def hear(self, event: ProgressEvent, now: float) -> None:
        """Take in an event of the work at a time [s]."""
        following = range(self._at, len(self.steps))
        place = next((k for k in following if self.steps[k].doing is event.doing), None)
        if place is None:
            return  # a part of the step that is being done
        if place != self._at:
            self._at, self._step_began, self._counts = place, now, []
        if event.total:
            self._counts = [*self._counts[-_MEMORY:], _Count(now, event.done)]
        self._event = event

    def seconds_left(self, now: float) -> float:
        """Return the estimate of the time left [s]."""
        later = sum(step.seconds for step in self.steps[self._at + 1 :])
        return self._step_left(now) + self._slowness(now) * later

    def share(self, now: float) -> float:
        """Return the share of the whole time that is over, in [0, 1]."""
        over = now - self.began
        return over / max(over + self.seconds_left(now), 1e-9)

    def words(self) -> str:
        """Return what is being done."""
        doing, event = self.steps[self._at].doing, self._event
        return str(doing if event is None else event)

    def _slowness(self, now: float) -> float:
        """Return how much longer than expected work takes."""
        expected = sum(step.seconds for step in self.steps[: self._at])
        before = (self._step_began - self.began + _TRUST) / (expected + _TRUST)
        if self._counts:
            return before
        # A step that is late will have been slow, too, however long it still takes.
        expected += self.steps[self._at].seconds
        late = (now - self.began + _TRUST) / (expected + _TRUST)
        return max(before, late, self._crowding(now))

    def _crowding(self, now: float) -> float:
        """Return how much longer work takes since others want the processor; 0 if unknown."""
        if self.busy is None or self.steps[self._at].doing not in _OWN:
            return 0.0
        busy = self.busy() - self._busy_before
        return (now - self.began + _BRIEF) / (busy + _BRIEF)

    def _step_left(self, now: float) -> float:
        """Return the estimate for what is being done [s]."""
        expected = self.steps[self._at].seconds * self._slowness(now)
        if not self._counts or self._event is None:
            over = now - self._step_began
            # A late step is expected to need a quarter more of its time, not to be done at once.
            return max(expected - over, 0.25 * over)
        counted, todo = self._counts[-1].time, self._event.total - self._event.done
        pace = self._pace()
        if pace is None:
            pace = expected / max(self._event.total - self._counts[0].done, 1)
        return max(pace * todo - (now - counted), pace * max(todo - 1, 0))

    def _pace(self) -> float | None:
        """Return what one of the counted things takes [s]; None while it is unknown."""
        lengths = [
            (later.time - earlier.time) / (later.done - earlier.done)
            for earlier, later in pairwise(self._counts)
            if later.done > earlier.done
        ]
        # The first ones compile and record, which later ones do not.
        usual = lengths[_UNUSUAL:]
        return median(usual) if usual else None


@contextmanager
def followed(
    name: str, steps: Sequence[WorkStep], *, stream: TextIO | None = None
) -> Iterator[None]:
    """Show how far the work within the `with` statement is.

    Args:
        name: What comes out.
        steps: What has to be done, with expected durations.
        stream: Where it is shown; default standard error.
    """
    shown = _Redrawing(
        name, WorkCourse(steps, time.monotonic(), time.process_time), stream or sys.stderr
    )
    shown.start()
    try:
        with heard_by(shown.hear):
            yield
    finally:
        shown.close()


def can_redraw(stream: TextIO) -> bool:
    """Return whether lines can be overwritten: on terminals and in notebooks."""
    return stream.isatty() or _in_notebook()


class _Redrawing:
    """Shows how far work is, again and again, in a thread of its own until it is closed."""

    def __init__(self, name: str, course: WorkCourse, stream: TextIO) -> None:
        self._name, self._course, self._stream = name, course, stream
        self._lock, self._over = threading.Lock(), threading.Event()
        self._bar: tqdm[None] | None = _bar(name, stream) if can_redraw(stream) else None
        self._thread = threading.Thread(target=self._run, name="progress", daemon=True)

    def start(self) -> None:
        """Show it from the first second on, but nothing of what is over or refused before."""
        self._thread.start()

    def hear(self, event: ProgressEvent) -> None:
        """Take in an event."""
        with self._lock:
            self._course.hear(event, time.monotonic())

    def close(self) -> None:
        """Stop showing anything."""
        self._over.set()
        self._thread.join()
        if self._bar is not None:
            self._bar.close()

    def _run(self) -> None:
        pause = _PROGRESS_FIRST
        while not self._over.wait(pause):
            self._draw()
            pause = _DRAWN_EVERY if self._bar is not None else _SAID_EVERY

    def _draw(self) -> None:
        with self._lock:
            now = time.monotonic()
            words, left = self._course.words(), self._course.seconds_left(now)
            share = self._course.share(now)
        text = f"{words}, about {clock(left)} left"
        if self._bar is None:
            self._stream.write(f"{self._name}: {text}\n")
            self._stream.flush()
            return
        self._bar.n = round(100 * share)
        self._bar.set_postfix_str(text, refresh=True)


def _in_notebook() -> bool:
    """Return whether this program is a notebook's kernel; nothing is imported to find out."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return hasattr(shell, "kernel")


def _bar(name: str, stream: TextIO) -> tqdm[None]:
    """Return a bar of the terminal's or the notebook's kind."""
    from tqdm.auto import tqdm as bar

    shape = "{desc}: {percentage:3.0f} % |{bar}| {elapsed}{postfix}"
    made: tqdm[None] = bar(total=100, desc=name, file=stream, leave=False, bar_format=shape)
    return made


def clock(seconds: float) -> str:
    """Return a duration as people read it: 0:07, 12:30, 2:05:00."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


_READ, _READ_PER_MB = 0.5, 0.07
"""Reading logs [s]: always, and for each megabyte of them."""

_BUILD, _BUILD_PER_MB = 9.0, 20.0
"""Building the scene [s]: always, and for each megabyte of the network."""

REACHED = 1.5
"""Of a larger network cameras reach no more than so many megabytes."""

CHECKS = Path(__file__).with_name("checks.json")
"""What `check` takes [CPU-s]: always, and for each megabyte of the network; a bench writes it."""

_LATER = 0.25
"""Share of that which all shots but the first take: those near each other share a place."""

_OPEN = 2.5
"""Giving the scene to the renderer [s]."""

_EXPECTATIONS_FIRST = 8.0
"""What a first picture takes beyond a later one: all is moved, recorded, compiled [s]."""

_PILOT = 60.0
"""Choosing samples by measured pictures [s]."""

_ENCODE, _ENCODE_PER_MEGAPIXEL = 0.3, 0.05
"""Encoding a film [s]: always, and for each million pixels of all its frames."""

_HEAR = 2.0
"""Making the sound of a second of film [s]: of fifty sources."""

_LEAST_PACKED = 18
"""A file of gzip has at least a head and a tail of so many bytes."""


def film_steps(job: Job, request: Request, order: FilmOrder) -> tuple[WorkStep, ...]:
    """Return the steps of `render_film`, shot by shot.

    Args:
        job: The scene file.
        request: The command's choices.
        order: Which shots, when, and where to.

    Raises:
        ConfigError, InputError: As `render_film`.
    """
    applied = request.applied(job)
    size = applied.output.size
    steps: list[WorkStep] = []
    for shot, path in shots_of(job, request, order):
        count = len(order.pace(job, shot).times(shot))
        quality = quality_preset(applied.quality, spp=request.spp, together=count > 1)
        wanted = wanted_frames(order.frames, count)
        folder = frames_folder(path)
        missing = [n for n in wanted if not (order.resume and frame_file(folder, n).exists())]
        rendering = _rendering(quality, size, frames=len(missing), rates=rates_of(request.variant))
        making = [WorkStep(Doing.RENDER, rendering), *_sounding(applied, order, len(wanted))]
        if order.discard_frames:  # frames are rendered as the film takes them
            making.reverse()
        steps += [*opening_steps(job), *_pilot(request), *making]
        megapixels = len(wanted) * size[0] * size[1] / 1e6
        steps.append(WorkStep(Doing.ENCODE, _ENCODE + _ENCODE_PER_MEGAPIXEL * megapixels))
    return tuple(steps)


def _sounding(job: Job, order: FilmOrder, frames: int) -> tuple[WorkStep, ...]:
    """Return the step of making a film's sound; none where it has none."""
    if order.frames is not None or not is_heard(job):
        return ()
    return (WorkStep(Doing.HEAR, _HEAR * frames / float(job.output.fps)),)


def still_steps(job: Job, request: Request) -> tuple[WorkStep, ...]:
    """Return the steps of `render_still`.

    Raises:
        ConfigError, InputError: As `render_still`.
    """
    applied = request.applied(job)
    quality = quality_preset(applied.quality, spp=request.spp)
    rates = rates_of(request.variant)
    rendering = _rendering(quality, applied.output.size, frames=1, rates=rates)
    return (*opening_steps(job), *_pilot(request), WorkStep(Doing.RENDER, rendering))


def _pilot(request: Request) -> tuple[WorkStep, ...]:
    """Return the step in which samples are chosen, if a pilot is asked for."""
    return (WorkStep(Doing.MEASURE, _PILOT),) if request.wish else ()


def reading_step(job: Job) -> WorkStep:
    """Return the step in which a simulation is read; errors as in `building_steps`."""
    logs = scenario_files(job).trajectories
    return WorkStep(Doing.READ, _READ + _READ_PER_MB * _megabytes(logs))


def building_steps(job: Job) -> tuple[WorkStep, ...]:
    """Return the steps until a shot of a scene is built.

    Raises:
        ConfigError, InputError: If the simulation's files are not there.
    """
    build = _BUILD + _BUILD_PER_MB * min(network_megabytes(job), REACHED)
    return (reading_step(job), WorkStep(Doing.BUILD, build))


def checking_steps(job: Job) -> tuple[WorkStep, ...]:
    """Return the steps of `check_scene`; errors as in `building_steps`."""
    constants = json.loads(CHECKS.read_text(encoding="utf-8"))
    reached = min(network_megabytes(job), REACHED)
    whole = constants["always"] + constants["per_megabyte"] * reached
    # What is read and built first, then a step or two for each further shot.
    shots = len(job.shots or job.cameras)
    later = _LATER * whole / max(shots - 1, 1) if shots > 1 else 0.0
    first = whole - later * (shots - 1)
    read = min(reading_step(job).seconds, 0.5 * first)
    again = (WorkStep(Doing.READ, 0.0), WorkStep(Doing.BUILD, later))
    return (WorkStep(Doing.READ, read), WorkStep(Doing.BUILD, first - read), *(shots - 1) * again)


def export_steps(job: Job, times: int) -> tuple[WorkStep, ...]:
    """Return the steps of an export of so many times; errors as in `building_steps`."""
    gathered = _GATHER + _GATHER_PER_TIME * times
    return (*building_steps(job), WorkStep(Doing.MEASURE, gathered), WorkStep(Doing.WRITE, _WRITE))


def network_megabytes(job: Job) -> float:
    """Return how long a scene's network is as text; errors as in `building_steps`."""
    return _megabytes([scenario_files(job).network])


def opening_steps(job: Job) -> tuple[WorkStep, ...]:
    """Return the steps until a shot can be rendered; errors as in `building_steps`."""
    return (*building_steps(job), WorkStep(Doing.OPEN, _OPEN))


def _rendering(quality: Quality, size: tuple[int, int], *, frames: int, rates: Rates) -> float:
    """Return the wall time of a shot's frames [s]."""
    costs = [
        cost_of(quality, size=size, triangles=TYPICAL_TRIANGLES, frames=count, rates=rates)
        for count in (0, frames)
    ]
    later = costs[1].wall_seconds - costs[0].wall_seconds
    return later + (_EXPECTATIONS_FIRST if frames else 0.0)


def _megabytes(paths: Iterable[Path]) -> float:
    """Return how long files are when they are unpacked."""
    return sum(_length(path) for path in paths if path.is_file()) / 1e6


def _length(path: Path) -> int:
    """Return how many bytes a file has when it is unpacked.

    The last four bytes of gzip say it of its last member, up to 4 GB; it is no shorter than it is
    packed.
    """
    packed = path.stat().st_size
    if path.suffix != ".gz" or packed < _LEAST_PACKED:
        return packed
    with path.open("rb") as stream:
        stream.seek(-4, os.SEEK_END)
        return max(int.from_bytes(stream.read(4), "little"), packed)
