"""What long work tells about itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class Doing(StrEnum):
    """What is being done, in the words that people read, in the order in which it is done."""

    READ = "reading the simulation"
    BUILD = "building the scene"
    OPEN = "loading the scene into the renderer"
    RENDER = "rendering"
    ENCODE = "encoding the film"


@dataclass(frozen=True, slots=True)
class News:
    """A step that begins, or how far it is.

    Attributes:
        doing: The step.
        done: Frames, passes or whatever it counts that are done.
        total: Of them in all; 0 where nothing is counted.
    """

    doing: Doing
    done: int = 0
    total: int = 0


Tell = Callable[[News], None]


def silent(_: News) -> None:
    """Tell nobody."""
