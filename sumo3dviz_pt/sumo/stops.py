"""Read bus stops from SUMO's additional files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from sumo3dviz_pt.model.traffic import Stop
from sumo3dviz_pt.sumo.bounds import COORDINATE
from sumo3dviz_pt.sumo.stream import read_elements


def read_stops(paths: Iterable[Path]) -> tuple[Stop, ...]:
    """Read the bus stops of additional files; other elements are ignored.

    Args:
        paths: Additional files, plain or gzipped.

    Returns:
        Stops in file order; of several with one id, the first.

    Raises:
        InputError: If a file is damaged or an attribute cannot be understood.
    """
    stops: dict[str, Stop] = {}
    for path in paths:
        for element in read_elements(path, root=(), what="an additional file of SUMO"):
            if element.tag != "busStop" or "lane" not in element.attributes:
                continue
            known = element.attributes
            stop = Stop(
                element.text("id"),
                element.text("lane"),
                element.number("startPos", within=COORDINATE) if "startPos" in known else None,
                element.number("endPos", within=COORDINATE) if "endPos" in known else None,
            )
            stops.setdefault(stop.id, stop)
    return tuple(stops.values())
