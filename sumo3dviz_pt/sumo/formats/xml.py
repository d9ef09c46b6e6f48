"""SUMO's own vehicle log in XML: by a parser, or faster where it is regular.

The log is floating car data (FCD), plain or gzipped. It may be cut between two `<timestep` tags
without harm to the XML around them. So steps before the wanted window are dropped as bytes, which
is ten times faster than parsing them.

SUMO writes every row on a line of its own, with the same attributes in the same order and nothing
that needs unescaping. Such a step is cut at its quotation marks, and the pieces between them are
compared with those of the first row; that is several times faster than parsing. A step that is
written in any other way is left to the parser, so the result is the same.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path
from xml.parsers import expat

from sumo3dviz_pt.sumo.formats.format import (
    ATTRIBUTES,
    KINDS,
    STEP,
    ElementSink,
    LogFormat,
    Rows,
    Sighting,
)
from sumo3dviz_pt.sumo.stream import (
    Element,
    check_root,
    chunks,
    feed,
    may_be_xml,
    read_elements,
    root_of,
)
from sumo3dviz_pt.sumo.values import parse_time

_FORWARD_OPEN = b"<timestep"
_FORWARD_CLOSE = b"</fcd-export"
_TIME = re.compile(rb"""<timestep\s[^>]*?\btime\s*=\s*["']([^"'>]*)["']""")


class FastForward:
    """A filter for the chunks of a log; drops steps until the window begins.

    Args:
        begin: First time that is needed [s].
        steps: Times of steps [s]; those of dropped steps are added.

    Attributes:
        lines: Number of lines that were dropped.
    """

    def __init__(self, begin: float, steps: array[float]) -> None:
        self.lines = 0
        self._begin = begin
        self._steps = steps
        self._tail = b""
        self._dropping = False
        self._done = False

    def __call__(self, chunk: bytes) -> bytes:
        """Return the part of the next chunk that must be parsed."""
        if self._done:
            return chunk
        data = self._tail + chunk
        whole = _end_of_whole_tags(data)
        self._tail = data[whole:]
        head, start = b"", 0
        if not self._dropping:
            # Everything before the first step, the root element above all, is kept.
            start = _index(data, _FORWARD_OPEN, 0, whole)
            head = data[:start]
            self._dropping = start < whole
        rest = self._first_needed(data, start, whole)
        self.lines += data.count(b"\n", start, rest)
        self._done = rest < whole
        return head + data[rest:] if self._done else head

    def _first_needed(self, data: bytes, start: int, end: int) -> int:
        """Return where the first step of the window begins, or the log ends; else `end`."""
        at = _index(data, _FORWARD_OPEN, start, end)
        while at < end:
            time = _time_of(data, at)
            if time is None or time >= self._begin:
                return at
            self._steps.append(time)
            at = _index(data, _FORWARD_OPEN, at + 1, end)
        return _index(data, _FORWARD_CLOSE, start, end)


def _end_of_whole_tags(data: bytes) -> int:
    """Return where an unfinished tag begins at the end of the data."""
    last = data.rfind(b"<")
    return len(data) if last < 0 or data.find(b">", last) >= 0 else last


def _index(data: bytes, word: bytes, start: int, end: int) -> int:
    at = data.find(word, start, end)
    return end if at < 0 else at


def _time_of(data: bytes, at: int) -> float | None:
    """Return the time of a step [s], or None where only the parser can tell it."""
    match = _TIME.match(data, at)
    try:
        return parse_time(match[1].decode("ascii")) if match else None
    except ValueError:
        return None


_REGULAR_OPEN, _REGULAR_CLOSE = b"<timestep", b"</timestep>"
_STEP = re.compile(r'[ \n]*<timestep time="([^"<]*)"(/?)>')
_ROW = re.compile(r'([ \n]*)<(vehicle|person|container)((?: [A-Za-z][A-Za-z0-9_.-]*="[^"<]*")+)/>')
_NAMES = re.compile(r' ([A-Za-z][A-Za-z0-9_.-]*)="')
_ENCODING = re.compile(rb"""encoding\s*=\s*["']([^"']*)["']""")

_SPECIAL = bytes({*range(32), ord("&")} - {ord("\n")})
"""Characters that a parser changes or refuses."""

_LONGEST_HEAD = 1 << 22
"""Number of bytes in which the first step must begin; a configuration has thousands."""


@dataclass(frozen=True, slots=True)
class _Layout:
    """How the rows of one kind are written.

    Attributes:
        kind: `vehicle`, `person` or `container`.
        names: Names of the attributes in order.
        head: Text before the first value.
        between: Texts before the other values of a row, and between rows, (n,) for n attributes.
        lines: Number of lines of a row.
    """

    kind: str
    names: tuple[str, ...]
    head: str
    between: tuple[str, ...]
    lines: int

    def rows(self, body: str, line: int) -> Rows | None:
        """Return the rows of a text; None if it is not written in this way.

        Args:
            body: Rows of one kind and what lies between them.
            line: Line of the file in which the text begins.
        """
        parts = body.split('"')
        width = 2 * len(self.names)
        count, rest = divmod(len(parts) - 1, width)
        tail = parts.pop()
        if rest or not count or parts[0] != self.head or tail[:2] != "/>" or tail[2:].strip(" \n"):
            return None
        if parts[2::2] != (list(self.between) * count)[:-1]:
            return None
        before = self.head.count("\n")
        lines = before + (count - 1) * self.lines + tail.count("\n")
        # A value that holds a line's end or the begin of a tag is for the parser.
        if body.count("<") != count or body.count("\n") != lines:
            return None
        columns = {
            name: parts[2 * at + 1 :: width]
            for at, name in enumerate(self.names)
            if name in ATTRIBUTES
        }
        return Rows(self.kind, count, columns, line + before, self.lines)


class RegularSteps:
    """A sieve that passes regularly written steps to a sink and leaves the rest to a parser.

    Args:
        sink: Where the elements go.
        forward: What drops the steps before the wanted window; None if nothing is dropped.

    Attributes:
        line: Line of what is passed to the sink; None while a parser passes elements to it.
    """

    def __init__(self, sink: ElementSink, forward: FastForward | None = None) -> None:
        self.line: int | None = None
        self._sink = sink
        self._forward = forward
        self._layouts: dict[str, _Layout] = {}
        self._waiting: list[bytes] = []
        self._seam = b""
        self._begun = False
        self._given_up = False
        self._taken = self._parsed = 0

    @property
    def lines(self) -> int:
        """Number of lines that need not be parsed."""
        return self._taken + (self._forward.lines if self._forward else 0)

    def left(self, chunk: bytes) -> Iterator[bytes]:
        """Yield what must be parsed of the next chunk."""
        chunk = self._forward(chunk) if self._forward else chunk
        self._waiting.append(chunk)
        seam = self._seam + chunk
        self._seam = seam[1 - len(_REGULAR_CLOSE) :]
        if self._begun and _REGULAR_OPEN not in seam and _REGULAR_CLOSE not in seam:
            return  # in the middle of a long step
        data = self._joined()
        at = 0
        if not self._begun and not self._given_up:
            at = data.find(_REGULAR_OPEN)
            if at < 0 and len(data) < _LONGEST_HEAD:
                self._waiting = [data]
                return
            self._begun, self._given_up = at >= 0, at < 0 or not _plain_head(data[:at])
            at = max(at, 0)
            yield from self._parse(data[:at])
        while not self._given_up:
            end = _end_of_step(data, at)
            if end < 0:
                self._waiting = [data[at:]]
                return
            yield from self._step(data[at:end])
            at = end
        self._begun = False
        yield from self._parse(data[at:])

    def rest(self) -> Iterator[bytes]:
        """Yield what must be parsed after the last chunk."""
        yield from self._parse(self._joined())

    def _joined(self) -> bytes:
        """Return what was not taken yet, and forget it."""
        data = b"".join(self._waiting)
        self._waiting.clear()
        return data

    def _parse(self, data: bytes) -> Iterator[bytes]:
        """Leave some bytes to the parser."""
        self.line = None
        self._parsed += data.count(b"\n")
        if data:
            yield data

    def _step(self, data: bytes) -> Iterable[bytes]:
        """Take a step, or leave it to the parser."""
        line = 1 + self._parsed + self.lines
        step = self._rows(data, line)
        if step is None:
            # Where a comment or section ends can be told only by parsing all.
            self._given_up = b"<!" in data or b"<?" in data
            return self._parse(data)
        time, runs = step
        self.line = line + data.count(b"\n", 0, data.find(b"<"))
        self._sink.take(STEP, {"time": time})
        for rows in runs:
            self.line = rows.line
            self._sink.take_rows(rows)
        self._taken += data.count(b"\n")
        self.line = None
        return ()

    def _rows(self, data: bytes, line: int) -> tuple[str, list[Rows]] | None:
        """Return the time and the rows of a step; None if they are not written regularly."""
        if len(data.translate(None, _SPECIAL)) != len(data):
            return None
        try:
            text = data.decode()
        except UnicodeDecodeError:
            return None
        match = _STEP.match(text)
        if match is None:
            return None
        body = text[match.end() : -len(_REGULAR_CLOSE)]
        if match[2] or not body.strip(" \n"):
            return (match[1], []) if not match[2] or match.end() == len(text) else None
        runs = self._runs(body, line + text.count("\n", 0, match.end()))
        return None if runs is None else (match[1], runs)

    def _runs(self, body: str, line: int) -> list[Rows] | None:
        """Return the rows of a step by kind, in order; None if they are not written regularly."""
        runs: list[Rows] = []
        for text in _by_kind(body):
            rows = self._run(text, line)
            if rows is None:
                return None
            runs.append(rows)
            line += text.count("\n")
        return runs

    def _run(self, body: str, line: int) -> Rows | None:
        """Return rows of one kind; the way of writing is learned from the first row."""
        start = body[: body.find('"')]
        layout = self._layouts.get(start)
        rows = None if layout is None else layout.rows(body, line)
        if rows is None:
            layout = _layout(body)
            if layout is None or layout == self._layouts.get(start):
                return None
            self._layouts[start] = layout
            rows = layout.rows(body, line)
        return rows


def _plain_head(head: bytes) -> bool:
    """Whether what comes before the first step leaves nothing open that changes its meaning."""
    encoding = _ENCODING.search(head[:200])
    return (
        (encoding is None or encoding[1].upper() in (b"UTF-8", b"US-ASCII"))
        and head.rfind(b"<!--") <= head.rfind(b"-->")
        and b"<![" not in head
        and b"<!DOCTYPE" not in head
    )


def _end_of_step(data: bytes, at: int) -> int:
    """Return where the step ends that begins at or after a place; -1 if it is not there yet."""
    start = data.find(_REGULAR_OPEN, at)
    close = data.find(b">", start)
    if start < 0 or close < 0:
        return -1
    if data[close - 1 : close] == b"/":
        return close + 1
    end = data.find(_REGULAR_CLOSE, close)
    return end + len(_REGULAR_CLOSE) if end >= 0 else -1


def _by_kind(body: str) -> Iterator[str]:
    """Yield the parts of a step whose rows are of one kind; each begins where a line ends."""
    tags = [f"<{kind} " for kind in KINDS]
    places = {tag: at for tag in tags if (at := body.find(tag)) >= 0}
    start = 0
    while len(places) > 1:
        (_, tag), (end, _) = sorted((at, tag) for tag, at in places.items())[:2]
        cut = max(body.rfind("\n", start, end), start)
        yield body[start:cut]
        start = cut
        places[tag] = body.find(tag, end)
        if places[tag] < 0:
            del places[tag]
    yield body[start:]


def _layout(body: str) -> _Layout | None:
    """Return how rows are written, judging from the first one."""
    match = _ROW.match(body)
    if match is None:
        return None
    names = _NAMES.findall(match[3])
    if len(set(names)) < len(names):
        return None
    space = match[1]
    start = f"{space}<{match[2]} {names[0]}="
    # Rows begin as the first one does; only the space before the first may differ.
    others = re.match(r"[ \n]*<", body[match.end() :])
    joint = f"/>{others[0][:-1] if others else space}<{match[2]} {names[0]}="
    between = (*(f" {name}=" for name in names[1:]), joint)
    return _Layout(match[2], tuple(names), start, between, joint.count("\n"))


_ROOT = "fcd-export"
_WHAT = "a vehicle log of SUMO (--fcd-output)"
_TAGS = re.compile(
    rb"""<timestep\s[^>]*?\btime\s*=\s*["']([^"'>]*)["']"""
    rb"""|<(vehicle|person|container)\s(?:[^>]*?\s)?id\s*=\s*["']([^"'>]*)["']"""
)


class XmlFormat(LogFormat):
    """XML with the root element `<fcd-export>`."""

    def recognises(self, file: Path) -> bool:
        """Whether a file is XML with the right root element."""
        return may_be_xml(file) and root_of(file) == _ROOT

    def elements(self, file: Path) -> Iterator[Element]:
        """Yield all elements, the root included."""
        return read_elements(file, root=_ROOT, what=_WHAT)

    def read(self, file: Path, sink: ElementSink) -> None:
        """Pass elements to the sink; of regular steps rows, of others what the parser finds."""
        parser = expat.ParserCreate()
        early = FastForward(sink.begin, sink.steps) if sink.begin > -inf else None
        steps = RegularSteps(sink, early)

        def line() -> int:
            return parser.CurrentLineNumber + steps.lines if steps.line is None else steps.line

        def start(tag: str, attributes: dict[str, str]) -> None:
            check_root(Element(tag, attributes, 0, file, line()), (_ROOT,), _WHAT)
            parser.StartElementHandler = sink.take

        sink.line = line
        parser.StartElementHandler = start
        feed(parser, file, sieve=steps)

    def sightings(self, file: Path) -> Iterator[Sighting]:
        """Yield steps and road users by a search of the bytes, which need not be parsed."""
        rest = b""
        for chunk in chunks(file):
            data = rest + chunk
            whole = data.rfind(b">") + 1
            for match in _TAGS.finditer(data, 0, whole):
                if match[1] is None:
                    yield Sighting(None, match[2], match[3])
                    continue
                try:
                    yield Sighting(parse_time(match[1].decode("ascii", errors="replace")))
                except ValueError:
                    continue
            rest = data[whole:]
