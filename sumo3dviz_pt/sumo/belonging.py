"""Checks whether a vehicle log belongs to a network, and in which coordinates it is.

A few rows tell whether it belongs, before all rows are read.

Positions are net coordinates, degrees or without the net's offset. SUMO writes longitudes and
latitudes with `--fcd-output.geo`, but net coordinates where the network has no projection; and
projected coordinates with `--fcd-output.utm`, but net coordinates of persons (SUMO 1.28). So each
kind of road user is judged on its own, by where it is.
"""

from __future__ import annotations

import logging
import math
import re
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import lru_cache
from itertools import islice
from pathlib import Path

import numpy as np
import shapely

from sumo3dviz_pt.errors import ConfigError, InputError, cut
from sumo3dviz_pt.model.geometry import Bools, Floats, from_above
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.sumo.formats import ElementSink, format_of
from sumo3dviz_pt.sumo.formats.format import KINDS
from sumo3dviz_pt.sumo.places import is_projected, net_from_geo
from sumo3dviz_pt.sumo.plausibility.places import LogSample, explanation
from sumo3dviz_pt.sumo.rows import RowsOfUsers, table_of
from sumo3dviz_pt.sumo.stream import chunks
from sumo3dviz_pt.sumo.values import COORDINATE, parse_number

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
    note = f'{len(missing)} of {len(named)} rows name lanes that it does not have, such as "'
    note += f'{cut(common)}"'
    if len(missing) > _MOST * len(named):
        return note
    logger.warning("of the log's rows, %s", note, extra={"once": "unknown lanes"})
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
    near, _ = _lane_tree(network).query(shapely.points(places), predicate="dwithin", distance=_OFF)
    beside = np.zeros(len(places), dtype=np.bool_)
    beside[near] = True
    return beside


@lru_cache(maxsize=1)
def _lane_tree(network: Network) -> shapely.STRtree:
    """Return a tree of the middles of a network's lanes; the last one is kept."""
    return shapely.STRtree(from_above([lane.shape for lane in network.lanes.values()]))


_NEAR = 1000.0
"""Largest distance from the network's box of anything that is part of the scenario [m]."""

_COORDINATES_MOST = 0.9
"""Smallest share of places that must be near the network."""

_DECLARED = re.compile(rb'<fcd-output\.(geo|utm) value="(?:true|1|yes|on|x|t)"')


class Coordinates(Enum):
    """What a log's x and y are."""

    NET = "net coordinates [m]"
    GEO = "longitude and latitude [deg]"
    UTM = "projected coordinates without the net's offset [m]"


def coordinates_of(file: Path, location: Location | None) -> Mapping[str, Coordinates]:
    """Return what x and y are, by kind of road user; a kind that is left out has net coordinates.

    Args:
        file: A vehicle log.
        location: Of its network; None if it is not known.

    Raises:
        MissingExtraError: If they are degrees and the package for projections is not installed.
    """
    if location is None or not any(location.boundary):
        return {}
    rows, declared = first_rows(file), _declared(file)
    systems = {
        kind: _judged(_of_kind(rows, kind), location, declared if kind == "vehicle" else None)
        for kind in dict.fromkeys(rows.kinds)
    }
    return {kind: each for kind, each in systems.items() if each is not Coordinates.NET}


def rows_in_net(rows: LogRows, file: Path, location: Location) -> LogRows:
    """Return some rows of a log with net coordinates as we count them.

    Args:
        rows: As they were read.
        file: The log.
        location: Of its network.
    """
    known = coordinates_of(file, location)
    places = np.array(rows.places).reshape(-1, 2)
    kinds = np.array(rows.kinds)
    for kind in dict.fromkeys(rows.kinds):
        own = kinds == kind
        places[own] = _in_net(places[own], known.get(kind, Coordinates.NET), location)
    return replace(rows, places=[(float(x), float(y)) for x, y in places])


def put_in_net(
    rows: RowsOfUsers, known: Mapping[str, Coordinates], location: Location | None
) -> None:
    """Change packed rows to net coordinates as we count them.

    Args:
        rows: Of the whole log or of a part of it; they change.
        known: As `coordinates_of` gives it.
        location: Of the network.
    """
    if location is None:
        return
    for kind in dict.fromkeys(key[0] for key in rows):
        tables = [table_of(buffer) for key, buffer in rows.items() if key[0] == kind]
        everywhere = np.concatenate([table[:, 1:3] for table in tables])
        places = _in_net(everywhere, known.get(kind, Coordinates.NET), location)
        ends = np.cumsum([len(table) for table in tables])[:-1]
        for table, own in zip(tables, np.split(places, ends), strict=True):
            table[:, 1:3] = own


def _judged(places: Floats, location: Location, declared: Coordinates | None) -> Coordinates:
    """Return what places are.

    Args:
        places: x and y of some rows, (n, 2).
        location: Of the network.
        declared: What the log's configuration says, if it says anything.
    """
    here = _share_near(location.inside(places), location)
    shifted = places + np.array(location.net_offset)
    if declared is Coordinates.UTM or here < _COORDINATES_MOST:
        # Far vehicles are part of some logs, so most places decide.
        moved = _share_near(shifted, location)
        if moved >= _COORDINATES_MOST and (moved > here or declared is Coordinates.UTM):
            return Coordinates.UTM
    degrees = bool((np.abs(places) <= [180.0, 90.0]).all())
    if not degrees or not is_projected(location):
        return Coordinates.NET
    if declared is Coordinates.GEO:
        return declared
    try:
        projected = net_from_geo(places, location)
    except ConfigError:
        if here >= _COORDINATES_MOST:  # a small network, most likely
            return Coordinates.NET
        raise
    return (
        Coordinates.GEO
        if _share_near(projected, location) >= _COORDINATES_MOST
        else Coordinates.NET
    )


def _in_net(places: Floats, coordinates: Coordinates, location: Location) -> Floats:
    """Return net coordinates as we count them, (n, 2) [m]."""
    if coordinates is Coordinates.NET:
        return location.inside(places)
    if coordinates is Coordinates.GEO:
        return net_from_geo(places, location)
    return np.asarray(places + np.array(location.net_offset))


def _share_near(places: Floats, location: Location) -> float:
    """Return the share of places that are near the network's box."""
    box = np.array(location.boundary).reshape(2, 2)
    return float(((places >= box[0] - _NEAR) & (places <= box[1] + _NEAR)).all(axis=1).mean())


def _of_kind(rows: LogRows, kind: str) -> Floats:
    """Return the places of one kind of road user, (n, 2)."""
    return np.array([p for p, own in zip(rows.places, rows.kinds, strict=True) if own == kind])


def _declared(file: Path) -> Coordinates | None:
    """Return what the configuration in a log's head says, if there is one."""
    with suppress(InputError):
        for chunk in islice(chunks(file), 1):
            match = _DECLARED.search(chunk.partition(b"<timestep")[0])
            return Coordinates[match[1].decode().upper()] if match else None
    return None
