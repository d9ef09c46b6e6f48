"""Find out whether a log's positions are net coordinates, degrees or without the net's offset.

SUMO writes longitudes and latitudes with `--fcd-output.geo`, but net coordinates where the network
has no projection; and projected coordinates with `--fcd-output.utm`, but net coordinates of
persons (SUMO 1.28). So each kind of road user is judged on its own, by where it is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from enum import Enum
from itertools import islice
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.sumo.belonging import LogRows, first_rows
from sumo3dviz_pt.sumo.places.projection import is_projected, net_from_geo
from sumo3dviz_pt.sumo.stream import chunks
from sumo3dviz_pt.sumo.traces import RowsOfUsers, table_of

_NEAR = 1000.0
"""Largest distance from the network's box of anything that is part of the scenario [m]."""

_MOST = 0.9
"""Smallest share of places that must be near the network."""

_SAID = re.compile(rb'<fcd-output\.(geo|utm) value="(?:true|1|yes|on|x|t)"')


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
    rows, said = first_rows(file), _said(file)
    found = {
        kind: _judged(_of_kind(rows, kind), location, said if kind == "vehicle" else None)
        for kind in dict.fromkeys(rows.kinds)
    }
    return {kind: each for kind, each in found.items() if each is not Coordinates.NET}


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


def _judged(places: Floats, location: Location, said: Coordinates | None) -> Coordinates:
    """Return what places are.

    Args:
        places: x and y of some rows, (n, 2).
        location: Of the network.
        said: What the log's configuration says, if it says anything.
    """
    here = _share_near(location.inside(places), location)
    shifted = places + np.array(location.net_offset)
    if said is Coordinates.UTM or here < _MOST:
        # Far vehicles are part of some logs, so most places decide.
        moved = _share_near(shifted, location)
        if moved >= _MOST and (moved > here or said is Coordinates.UTM):
            return Coordinates.UTM
    degrees = bool((np.abs(places) <= [180.0, 90.0]).all())
    if not degrees or not is_projected(location):
        return Coordinates.NET
    if said is Coordinates.GEO:
        return said
    try:
        projected = net_from_geo(places, location)
    except ConfigError:
        if here >= _MOST:  # a small network, most likely
            return Coordinates.NET
        raise
    return Coordinates.GEO if _share_near(projected, location) >= _MOST else Coordinates.NET


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


def _said(file: Path) -> Coordinates | None:
    """Return what the configuration in a log's head says, if there is one."""
    with suppress(InputError):
        for chunk in islice(chunks(file), 1):
            found = _SAID.search(chunk.partition(b"<timestep")[0])
            return Coordinates[found[1].decode().upper()] if found else None
    return None
