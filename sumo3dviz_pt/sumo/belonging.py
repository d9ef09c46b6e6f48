"""Check by a few rows whether a vehicle log belongs to a network, before all rows are read."""

from __future__ import annotations

import logging
import math
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
import shapely

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.polylines import from_above
from sumo3dviz_pt.sumo.bounds import COORDINATE
from sumo3dviz_pt.sumo.formats import ElementSink, format_of
from sumo3dviz_pt.sumo.formats.format import KINDS
from sumo3dviz_pt.sumo.plausibility.places import explanation
from sumo3dviz_pt.sumo.plausibility.sample import LogSample
from sumo3dviz_pt.sumo.values import parse_number

logger = logging.getLogger(__name__)

_ROWS = 2000
"""Largest number of rows that are looked at."""

_ELEMENTS = 250_000
"""Largest number of steps and rows that are read for them."""

_MARGIN = 1000.0
"""Largest distance from the network of anything that is part of the scenario [m]."""

_OFF = 8.0
"""Largest distance of a driving vehicle from a lane's centre; wide lanes need 5 m [m]."""

_DRIVES = 0.5
"""A vehicle that is slower than this may be parked beside the road [m/s]."""

_LEAST = 20
"""Smallest number of rows that can show that a log's positions do not fit."""

_MOST = 0.5
"""Largest share of rows that may name lanes which the network does not have."""

_ON_ROADS = (0.5, 0.1)
"""Smallest share of vehicles on roads, in a log without known lanes and in one with them.

The second is lower because a vehicle that is steered over TraCI may drive anywhere.
"""

OVERRIDE = "or show it nevertheless by scenario.allow_misfit (init --allow-misfit)"
"""What a user can do who wants a log that seems wrong."""

_ADVICE = (
    "use the log of this network, written without --fcd-output.geo and --fcd-output.utm,"
    f" {OVERRIDE}"
)


@dataclass(slots=True)
class LogRows:
    """Some rows of a log.

    Attributes:
        kinds: `vehicle`, `person` or `container`, (n,).
        places: x and y, (n,) pairs [m].
        lanes: Lane or edge ids, empty where none is logged, (n,).
        speeds: NaN where none is logged, (n,) [m/s].
        offsets: Places along the lanes; NaN where none is logged, (n,) [m].
    """

    kinds: list[str] = field(default_factory=list)
    places: list[tuple[float, float]] = field(default_factory=list)
    lanes: list[str] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    offsets: list[float] = field(default_factory=list)

    def add(
        self,
        kind: str,
        place: tuple[float, float],
        lane: str,
        speed: float,
        offset: float = math.nan,
    ) -> None:
        """Add one row.

        Args:
            kind: `vehicle`, `person` or `container`.
            place: x and y [m].
            lane: Lane or edge id, may be empty.
            speed: [m/s], or NaN.
            offset: Place along the lane [m], or NaN.
        """
        self.kinds.append(kind)
        self.places.append(place)
        self.lanes.append(lane)
        self.speeds.append(speed)
        self.offsets.append(offset)


def first_rows(file: Path) -> LogRows:
    """Return the first rows of a log up to what cannot be read, which its reader explains."""
    sink = _FirstRows()
    with suppress(_EnoughError, InputError):
        format_of(file).read(file, sink)
    return sink.rows


class _EnoughError(Exception):
    """There are enough rows."""


class _FirstRows(ElementSink):
    """Keeps the first rows of a log."""

    def __init__(self) -> None:
        super().__init__()
        self.rows = LogRows()
        self._taken = 0

    def take(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Keep a row whose numbers are possible."""
        if tag in KINDS:
            with suppress(KeyError, ValueError):
                place = parse_number(attributes["x"]), parse_number(attributes["y"])
                speed = parse_number(attributes.get("speed", "nan"))
                if all(abs(value) <= COORDINATE.high for value in place):
                    lane = attributes.get("lane") or attributes.get("edge") or ""
                    offset = parse_number(attributes["pos"]) if "pos" in attributes else math.nan
                    self.rows.add(tag, place, lane, speed, offset)
        self._taken += 1
        if len(self.rows.kinds) >= _ROWS or self._taken >= _ELEMENTS:
            raise _EnoughError


def check_belonging(rows: LogRows, network: Network, *, network_file: Path, log: Path) -> None:
    """Refuse a log of another network.

    Args:
        rows: Some rows of the log.
        network: The network that the log should belong to.
        network_file: File of the network, for messages.
        log: File of the log, for messages.

    Raises:
        InputError: If most rows lie far from the network or its roads, or on lanes that it
            does not have.
    """
    if not rows.kinds:
        return
    reason = _elsewhere(rows, network) or _unknown(rows, network) or _astray(rows, network)
    if reason:
        why = _explained(rows, network)
        reason += f" ({why})" if why else ""
        raise misfit(reason, network_file=network_file, log=log)


def misfit(reason: str, *, network_file: Path, log: Path) -> InputError:
    """Return the error that says why a log does not belong to a network.

    Args:
        reason: What does not fit.
        network_file: File of the network.
        log: File of the log.
    """
    message = f"the log does not lie on the network ({network_file.name}): {reason}; {_ADVICE}"
    return InputError(message, file=log)


def _explained(rows: LogRows, network: Network) -> str:
    """Return what may have happened to a log that does not fit, or nothing."""
    drives = _driving(rows)
    count = int(drives.sum())
    if count < _LEAST:
        return ""
    names = list(dict.fromkeys(rows.lanes))
    numbers = {name: number for number, name in enumerate(names)}
    sample = LogSample(
        places=np.column_stack([np.array(rows.places)[drives], np.zeros(count)]),
        moves=np.zeros((count, 2)),
        spans=np.ones(count),
        yaws=np.zeros(count),
        speeds=np.array(rows.speeds)[drives],
        lanes=np.array([numbers[lane] for lane in rows.lanes])[drives],
        offsets=np.array(rows.offsets)[drives],
    )
    return explanation(sample, names, network)


def _driving(rows: LogRows) -> Bools:
    """Return which rows are of vehicles that drive, (n,)."""
    vehicles = np.array([kind == "vehicle" for kind in rows.kinds])
    return np.asarray(vehicles & ~(np.array(rows.speeds) <= _DRIVES))


def _elsewhere(rows: LogRows, network: Network) -> str:
    """Return why rows lie off the network's box, or nothing; kinds may be shifted differently."""
    corners = np.concatenate([lane.shape[:, :2] for lane in network.lanes.values()])
    low, high = corners.min(axis=0) - _MARGIN, corners.max(axis=0) + _MARGIN
    places = np.array(rows.places)
    near = ((places >= low) & (places <= high)).all(axis=1)
    for kind in dict.fromkeys(rows.kinds):
        own = np.array([each == kind for each in rows.kinds])
        if not near[own].any():
            x, y = network.location.outside(places[own][0])
            return f"the first {kind} is at ({x:g}, {y:g})"
    return ""


def _unknown(rows: LogRows, network: Network) -> str:
    """Return why rows are on lanes of another network, or nothing.

    Lanes on junctions do not count, because their ids differ between versions of SUMO.
    """
    named = [lane for lane in rows.lanes if lane and not lane.startswith(":")]
    missing = [lane for lane in named if lane not in network.lanes and lane not in network.edges]
    if not missing:
        return ""
    common, _ = Counter(missing).most_common(1)[0]
    said = f'{len(missing)} of {len(named)} rows name lanes that it does not have, such as "'
    said += f'{cut(common)}"'
    if len(missing) > _MOST * len(named):
        return said
    logger.warning("of the log's rows, %s", said, extra={"once": "unknown lanes"})
    return ""


def _astray(rows: LogRows, network: Network) -> str:
    """Return why driving vehicles are off the roads, or nothing."""
    places = np.array(rows.places)[_driving(rows)]
    if len(places) < _LEAST:
        return ""
    on = int(_beside(places, network).sum())
    if on >= _ON_ROADS[any(lane in network.lanes for lane in rows.lanes)] * len(places):
        return ""
    return f"only {on} of {len(places)} vehicles that drive are on its roads"


def _beside(places: Floats, network: Network) -> Bools:
    """Return which places are near the centre of some lane, (n,)."""
    found, _ = _lane_tree(network).query(shapely.points(places), predicate="dwithin", distance=_OFF)
    beside = np.zeros(len(places), dtype=np.bool_)
    beside[found] = True
    return beside


@lru_cache(maxsize=1)
def _lane_tree(network: Network) -> shapely.STRtree:
    """Return a tree of the middles of a network's lanes; the last one is kept."""
    return shapely.STRtree(from_above([lane.shape for lane in network.lanes.values()]))
