"""Shows how far long work is and how long it will still take, from its first second on.

Work is a sequence of steps with expected durations. What they really took corrects the
expectation of those to come, and so does a step that is late; a step that counts is judged by
its own pace. Where other programs keep the processor, our share of it tells before a step is late.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median
from typing import TYPE_CHECKING, NamedTuple, TextIO

from sumo3dviz_pt.model.news import Doing, News, heard_by

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

_FIRST = 0.8
"""Nothing is said about work that takes less [s]."""

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
    _news: News | None = None

    def __post_init__(self) -> None:
        """Begin the first step with the work."""
        self._step_began = self.began
        self._busy_before = 0.0 if self.busy is None else self.busy()

    def hear(self, news: News, now: float) -> None:
        """Take in news of the work at a time [s]."""
        following = range(self._at, len(self.steps))
        place = next((k for k in following if self.steps[k].doing is news.doing), None)
        if place is None:
            return  # a part of the step that is being done
        if place != self._at:
            self._at, self._step_began, self._counts = place, now, []
        if news.total:
            self._counts = [*self._counts[-_MEMORY:], _Count(now, news.done)]
        self._news = news

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
        doing, news = self.steps[self._at].doing, self._news
        return str(doing if news is None else news)

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
        if not self._counts or self._news is None:
            over = now - self._step_began
            # A late step is expected to need a quarter more of its time, not to be done at once.
            return max(expected - over, 0.25 * over)
        counted, todo = self._counts[-1].time, self._news.total - self._news.done
        pace = self._pace()
        if pace is None:
            pace = expected / max(self._news.total - self._counts[0].done, 1)
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

    def hear(self, news: News) -> None:
        """Take in news."""
        with self._lock:
            self._course.hear(news, time.monotonic())

    def close(self) -> None:
        """Stop showing anything."""
        self._over.set()
        self._thread.join()
        if self._bar is not None:
            self._bar.close()

    def _run(self) -> None:
        pause = _FIRST
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
