"""Other outputs of SUMO that hold where vehicles are: those of emissions, and the full one.

Their rows have the names of attributes that the vehicle log has. The full output has people and
traffic lights, too (see `signals`).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from sumo3dviz_pt.sumo.formats.format import KINDS, STEP, LogFormat
from sumo3dviz_pt.sumo.stream import Element, may_be_xml, read_elements, root_of

FULL = "full-export"
OUTPUT_ROOTS = ("emission-export", FULL)

_STEPS = {"timestep": "time", "data": "timestep"}
"""Elements of steps, and which of their attributes is the time."""


class OutputFormat(LogFormat):
    """What SUMO writes for `--emission-output` and `--full-output`."""

    def recognises(self, file: Path) -> bool:
        """Whether the root element is that of one of these outputs."""
        return may_be_xml(file) and root_of(file) in OUTPUT_ROOTS

    def elements(self, file: Path) -> Iterator[Element]:
        """Yield the steps and rows of a log in order."""
        for element in read_elements(file, root=OUTPUT_ROOTS, what="an output of SUMO"):
            if element.tag in _STEPS and element.depth == 1:
                time = element.text(_STEPS[element.tag])
                yield Element(STEP, {"time": time}, 1, file, element.line)
            elif element.tag in KINDS and element.depth > 1:
                yield element
