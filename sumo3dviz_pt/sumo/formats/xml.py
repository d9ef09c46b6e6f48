"""SUMO's own vehicle log: floating car data (FCD) in XML, plain or gzipped."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import inf
from pathlib import Path
from xml.parsers import expat

from sumo3dviz_pt.sumo.formats.format import ElementSink, LogFormat, Sighting
from sumo3dviz_pt.sumo.formats.forward import FastForward
from sumo3dviz_pt.sumo.formats.regular import RegularSteps
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
