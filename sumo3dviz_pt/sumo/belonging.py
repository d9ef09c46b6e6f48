"""Whether a vehicle log was written with a network: a few rows tell, before all are read."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np
import shapely

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.sumo.bounds import COORDINATE
from sumo3dviz_pt.sumo.stream import CHUNK, feed

logger = logging.getLogger(__name__)

_ROWS = 2000
"""So many rows are looked at."""

_BYTES = 32 * CHUNK
"""At most so much of a log is read for them."""

_MARGIN = 1000.0
"""How far off the network something may still be part of the scenario [m]."""

_OFF = 8.0
"""Nobody who drives is farther from all lanes' centres: sublanes and wide lanes need 5 [m]."""

_DRIVES = 0.5
"""Slower vehicles may be parked beside the road [m/s]."""

_LEAST = 20
"""Rows that are needed to say that a log's places do not fit."""

_MOST = 0.5
"""Share of rows that may name lanes that are not there."""

_ON_ROADS = (0.5, 0.1)
"""Share of vehicles that are on roads at least, without known lanes and with them: who is steered
from outside may drive anywhere."""

_ADVICE = "use the log of this network, written without --fcd-output.geo and --fcd-output.utm"


@dataclass(slots=True)
class LogRows:
    """Some rows of a log.

    Attributes:
        kinds: `vehicle`, `person` or `container`, (n,).
        places: x and y, (n,) pairs [m].
        lanes: Lane or edge ids, empty where none is logged, (n,).
        speeds: NaN where none is logged, (n,) [m/s].
    """

    kinds: list[str] = field(default_factory=list)
    places: list[tuple[float, float]] = field(default_factory=list)
    lanes: list[str] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)

    def add(self, kind: str, place: tuple[float, float], lane: str, speed: float) -> None:
        """One more."""
        self.kinds.append(kind)
        self.places.append(place)
        self.lanes.append(lane)
        self.speeds.append(speed)


def first_rows(file: Path) -> LogRows:
    """The first rows of a log; none of what cannot be read, which its reader explains."""
    rows = LogRows()
    parser = expat.ParserCreate()

    def start(tag: str, attributes: Mapping[str, str]) -> None:
        if tag in ("vehicle", "person", "container"):
            with suppress(KeyError, ValueError):
                place = float(attributes["x"]), float(attributes["y"])
                speed = float(attributes.get("speed", "nan"))
                if all(abs(value) <= COORDINATE.high for value in place):
                    lane = attributes.get("lane") or attributes.get("edge") or ""
                    rows.add(tag, place, lane, speed)
        if len(rows.kinds) >= _ROWS or parser.CurrentByteIndex > _BYTES:
            raise _EnoughError

    parser.StartElementHandler = start
    with suppress(_EnoughError, InputError):
        feed(parser, file)
    return rows


class _EnoughError(Exception):
    """There are enough rows."""


def check_belonging(rows: LogRows, network: Network, *, network_file: Path, log: Path) -> None:
    """Refuse a log of another network.

    Args:
        rows: Some of the log.
        network: That it should be of.
        network_file: Where that was read.
        log: The log.

    Raises:
        InputError: If most rows lie far from the network or its roads, or on lanes that it
            does not have.
    """
    if not rows.kinds:
        return
    reason = _elsewhere(rows, network) or _unknown(rows, network) or _astray(rows, network)
    if reason:
        raise misfit(reason, network_file=network_file, log=log)


def misfit(reason: str, *, network_file: Path, log: Path) -> InputError:
    """Say why a log is not of a network."""
    message = f"the log does not lie on the network ({network_file.name}): {reason}; {_ADVICE}"
    return InputError(message, file=log)


def _elsewhere(rows: LogRows, network: Network) -> str:
    """Why rows lie off the network's box: SUMO may shift vehicles but not persons."""
    corners = np.concatenate([lane.shape[:, :2] for lane in network.lanes.values()])
    low, high = corners.min(axis=0) - _MARGIN, corners.max(axis=0) + _MARGIN
    places = np.array(rows.places)
    near = ((places >= low) & (places <= high)).all(axis=1)
    for kind in dict.fromkeys(rows.kinds):
        own = np.array([each == kind for each in rows.kinds])
        if not near[own].any():
            x, y = places[own][0]
            return f"the first {kind} is at ({x:g}, {y:g})"
    return ""


def _unknown(rows: LogRows, network: Network) -> str:
    """Why rows are on lanes of another network; those on junctions differ between versions."""
    named = [lane for lane in rows.lanes if lane and not lane.startswith(":")]
    missing = [lane for lane in named if lane not in network.lanes and lane not in network.edges]
    if not missing:
        return ""
    common, _ = Counter(missing).most_common(1)[0]
    said = f'{len(missing)} of {len(named)} rows name lanes that it does not have, such as "'
    said += f'{cut(common)}"'
    if len(missing) > _MOST * len(named):
        return said
    logger.warning("of the log's rows, %s", said)
    return ""


def _astray(rows: LogRows, network: Network) -> str:
    """Why vehicles that drive are off the roads."""
    drives = [
        kind == "vehicle" and not speed <= _DRIVES
        for kind, speed in zip(rows.kinds, rows.speeds, strict=True)
    ]
    places = np.array(rows.places)[drives]
    if len(places) < _LEAST:
        return ""
    on = int(_beside(places, network).sum())
    if on >= _ON_ROADS[any(lane in network.lanes for lane in rows.lanes)] * len(places):
        return ""
    return f"only {on} of {len(places)} vehicles that drive are on its roads"


def _beside(places: Floats, network: Network) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which places are beside the centre of some lane, (n,)."""
    tree = shapely.STRtree(
        [shapely.LineString(lane.shape[:, :2]) for lane in network.lanes.values()]
    )
    found, _ = tree.query(shapely.points(places), predicate="dwithin", distance=_OFF)
    beside = np.zeros(len(places), dtype=np.bool_)
    beside[found] = True
    return beside
