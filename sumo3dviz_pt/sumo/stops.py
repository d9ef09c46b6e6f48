"""Read stops of buses, trains and containers, and charging stations, from additional files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from sumo3dviz_pt.model.traffic import Stop, StopKind
from sumo3dviz_pt.sumo.bounds import COORDINATE
from sumo3dviz_pt.sumo.stream import Element, read_elements

KINDS: Mapping[str, StopKind] = {
    "busStop": "bus",
    "trainStop": "train",
    "containerStop": "container",
    "chargingStation": "charging",
}
"""Elements that are stops, and what they are for."""


def read_stops(paths: Iterable[Path]) -> tuple[Stop, ...]:
    """Read the stops of additional files; other elements are ignored.

    Args:
        paths: Additional files, plain or gzipped.

    Returns:
        Stops in file order; of several with one kind and id, the first.

    Raises:
        InputError: If a file is damaged or an attribute cannot be understood.
    """
    stops: dict[tuple[str, str], Stop] = {}
    for path in paths:
        for element in read_elements(path, root=(), what="an additional file of SUMO"):
            if element.tag not in KINDS or "lane" not in element.attributes:
                continue
            stop = Stop(
                element.text("id"),
                element.text("lane"),
                position_in(element, "startPos"),
                position_in(element, "endPos"),
                KINDS[element.tag],
                tuple(element.text("lines", "").replace(",", " ").split()),
            )
            stops.setdefault((stop.kind, stop.id), stop)
    return tuple(stops.values())


def position_in(element: Element, key: str) -> float | None:
    """Return a position on a lane, [m]; None where the element has none.

    Raises:
        InputError: If it is no number.
    """
    return element.number(key, within=COORDINATE) if key in element.attributes else None
