"""Reads SUMO's dump of all lanes (`--netstate-dump`), which holds where on a lane each vehicle is.

The network tells where that is. People are at an edge; they are put on its right-most lane, on
which SUMO lets them walk where there is a footway.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.sumo.stream import Element, read_elements

LANE_ROOTS = ("netstate", "sumo-netstate")


def log_of_lanes(file: Path, network: Network) -> str:
    """Return a dump of all lanes as a vehicle log.

    Raises:
        InputError: If the file is damaged, or a lane is not in the network.
    """
    text = io.StringIO()
    writer = csv.writer(text, delimiter=";", lineterminator="\n")
    writer.writerow(("time", "id", "x", "y", "z", "angle", "speed", "lane", "pos", "edge", "tag"))
    places = _Places(network)
    for time, element, lane, edge in _rows(file):
        own = places.lane(element, lane, edge)
        pos = element.number("pos")
        (x, y, z), angle = places.at(own, pos)
        speed = element.attributes.get("speed", "")
        numbers = (f"{x:.3f}", f"{y:.3f}", f"{z:.3f}", f"{angle:.3f}", speed)
        where = (lane, f"{pos:.2f}", edge)
        writer.writerow((time, element.text("id"), *numbers, *where, element.tag))
    return text.getvalue()


def _rows(file: Path) -> Iterator[tuple[str, Element, str, str]]:
    """Yield time, row, lane and edge of everyone; a person has no lane."""
    time = lane = edge = ""
    for element in read_elements(file, root=LANE_ROOTS, what="a dump of SUMO's lanes"):
        if element.tag == "timestep":
            time = element.text("time")
        elif element.tag == "edge":
            edge, lane = element.text("id"), ""
        elif element.tag == "lane":
            lane = element.text("id")
        elif element.tag == "vehicle":
            yield time, element, lane, edge
        elif element.tag == "person":
            yield time, element, "", edge


class _Places:
    """Where places along lanes are."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._known: dict[str, tuple[Floats, Floats]] = {}

    def lane(self, element: Element, lane: str, edge: str) -> Lane:
        """Return the lane of a row; of people, the right-most of an edge."""
        name = lane or f"{edge}_0"
        own = self._network.lanes.get(name)
        if own is None:
            raise element.error(
                f"the network has no lane {name!r}; give network and dump of one simulation"
            )
        return own

    def at(self, lane: Lane, pos: float) -> tuple[tuple[float, float, float], float]:
        """Return the point at a place along a lane [m], and SUMO's angle there [deg]."""
        if lane.id not in self._known:
            steps = np.linalg.norm(np.diff(lane.shape[:, :2], axis=0), axis=1)
            self._known[lane.id] = lane.shape, np.concatenate([[0.0], np.cumsum(steps)])
        shape, along = self._known[lane.id]
        at = float(np.clip(pos * along[-1] / max(lane.length, 1e-6), 0.0, along[-1]))
        x, y, z = (float(np.interp(at, along, axis)) for axis in shape.T)
        part = int(np.clip(np.searchsorted(along, at, side="left") - 1, 0, len(shape) - 2))
        dx, dy = (shape[part + 1, :2] - shape[part, :2]).tolist()
        return (x, y, z), float(np.degrees(np.arctan2(dx, dy)) % 360.0)
