"""What a format of vehicle logs must provide.

Whatever a log looks like in its file, a format turns it into the elements of SUMO's XML log:
`timestep` with the attribute `time`, followed by one `vehicle`, `person` or `container` for
each row of that step, with SUMO's names of attributes and all values as text. A format that
has many rows at hand may pass them on by columns instead.
"""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from typing import NamedTuple

from sumo3dviz_pt.sumo.stream import Element
from sumo3dviz_pt.sumo.values import parse_time

STEP = "timestep"
KINDS = frozenset({"vehicle", "person", "container"})
ATTRIBUTES = frozenset(
    {
        *("id", "x", "y", "z", "angle", "type", "speed", "slope", "pos", "lane", "edge"),
        *("signals", "vehicle", "stage"),
    }
)
"""Attributes of rows that anything is made from."""

Cells = list[str] | list[float]
"""A column of rows: text as SUMO writes it, or numbers that need not be read."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Successive rows of one kind in one step, by columns.

    Attributes:
        kind: `vehicle`, `person` or `container`.
        count: Number of rows, n >= 1.
        columns: Values of all rows by attribute, (n,) each; only `ATTRIBUTES` are there.
        line: Line of the first row in the file, from 1.
        lines: Number of lines of a row.
    """

    kind: str
    count: int
    columns: Mapping[str, Cells]
    line: int
    lines: int = 1

    def attributes(self, row: int) -> dict[str, str]:
        """Return one row as the attributes of its element."""
        return {name: str(cells[row]) for name, cells in self.columns.items()}

    def line_of(self, row: int) -> int:
        """Return the line of a row in the file, from 1."""
        return self.line + row * self.lines


class ElementSink(ABC):
    """Takes the elements of a log while a format reads it; an error that it raises ends that.

    Args:
        begin: First time that is needed; a format may leave out the steps before it [s].

    Attributes:
        begin: First time that is needed [s].
        steps: Times of steps [s]; a format adds those of steps that it leaves out.
        line: Returns the current line of the file, from 1; set by the format.
    """

    def __init__(self, begin: float = -inf) -> None:
        self.begin = begin
        self.steps = array("d")
        self.line: Callable[[], int] = lambda: 1

    @abstractmethod
    def take(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Take the next element; those with unknown tags have no meaning."""

    def take_rows(self, rows: Rows) -> None:
        """Take rows of the current step; a sink overrides this to be faster than row by row."""
        line = self.line
        for row in range(rows.count):
            self.line = partial(rows.line_of, row)
            self.take(rows.kind, rows.attributes(row))
        self.line = line


class Sighting(NamedTuple):
    """A step, or a road user in the step before it.

    Attributes:
        time: Time of a step [s]; None for a road user.
        kind: `vehicle`, `person` or `container`; empty for a step.
        id: Id of the road user as SUMO's XML writes it; empty for a step.
    """

    time: float | None
    kind: bytes = b""
    id: bytes = b""


class LogFormat(ABC):
    """A format of vehicle logs.

    A format defines `recognises` and `elements`. The other methods follow from these, and a
    format overrides them only to be faster.
    """

    @abstractmethod
    def recognises(self, file: Path) -> bool:
        """Whether the content of a file looks like this format; never raises an error."""

    @abstractmethod
    def elements(self, file: Path) -> Iterator[Element]:
        """Yield the steps and rows of a log in order.

        Raises:
            TruncatedError: If the log breaks off.
            InputError: If it cannot be read or is damaged.
        """

    def read(self, file: Path, sink: ElementSink) -> None:
        """Pass the elements of a log to a sink; errors are those of `elements` and the sink."""
        line = 1
        sink.line = lambda: line
        for element in self.elements(file):
            line = element.line
            sink.take(element.tag, element.attributes)

    def sightings(self, file: Path) -> Iterator[Sighting]:
        """Yield steps and road users in order; errors are those of `elements`."""
        for element in self.elements(file):
            if element.tag == STEP:
                try:
                    yield Sighting(parse_time(element.attributes.get("time", "")))
                except ValueError:
                    continue
            elif element.tag in KINDS:
                own = html.escape(element.attributes.get("id", ""))
                yield Sighting(None, element.tag.encode(), own.encode())
