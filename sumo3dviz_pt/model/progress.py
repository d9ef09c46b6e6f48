"""Progress of long work: which step begins, and how far it is.

Work announces its steps much as it logs. A function that listens receives them, without a
parameter in every call between the two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum


class Doing(StrEnum):
    """The steps of long work, in the words that people read."""

    READ = "reading the simulation"
    SCOUT = "looking for cameras"
    BUILD = "building the scene"
    OPEN = "loading the scene into the renderer"
    RENDER = "rendering"
    HEAR = "making the sound"
    ENCODE = "encoding the film"
    MEASURE = "measuring"
    DRAW = "drawing"
    SIMULATE = "running the simulation"
    WRITE = "writing"


@dataclass(frozen=True, slots=True)
class ProgressEvent:
    """A step that begins, or how far it is.

    Attributes:
        doing: The step.
        done: Number of frames, passes or other parts that are done.
        total: Number of all parts; 0 where nothing is counted.
        what: What is rendered, measured or made, where there are several.
    """

    doing: Doing
    done: int = 0
    total: int = 0
    what: str = ""

    def __str__(self) -> str:
        words = f"{self.doing} {self.what}".rstrip()
        if not self.total:
            return words
        return f"{words}{',' if self.what else ''} {self.done} of {self.total}"


Listener = Callable[[ProgressEvent], None]


def _silent(_: ProgressEvent) -> None:
    """Ignore events, where no function listens."""


_LISTENER: ContextVar[Listener] = ContextVar("listener", default=_silent)


@contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """Pass the progress events of this thread to a function within the `with` statement."""
    before = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(before)


def announce(doing: Doing, done: int = 0, total: int = 0, *, what: str = "") -> None:
    """Pass an event to the function that listens, if there is one.

    Args:
        doing: The step of the work.
        done: Number of parts that are done.
        total: Number of all parts; 0 where nothing is counted.
        what: What is rendered, measured or made, where there are several.
    """
    _LISTENER.get()(ProgressEvent(doing, done, total, what))
