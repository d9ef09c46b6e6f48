"""Find roads that cross at one height without a junction: who drives there passes through others.

Maps say which road is the bridge; a network that lost its heights does not.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Edge, Lane, Network

logger = logging.getLogger(__name__)

ROOM = 3.0
"""Roads with less height between them meet [m]; lorries are 4 m high, but decks may be crude."""

_SQUARE = float(np.sin(np.radians(15.0)))
"""Sine of the angle above which lanes cross; others run along each other, as tracks in streets."""

_NO_DRIVERS = frozenset({"pedestrian", "wheelchair", "ship", "aircraft", "cable_car", "subway"})
"""Who walks may cross a road anywhere; the others are above or below it."""


@dataclass(frozen=True, slots=True, eq=False)
class AtGrade:
    """A pair of roads that cross at one height without a junction.

    Attributes:
        first: Id of an edge.
        other: Id of the other.
        place: Where their lanes cross first, (3,) [m].
        height: Between them [m].
    """

    first: str
    other: str
    place: Floats
    height: float


def crossings_at_grade(network: Network) -> tuple[AtGrade, ...]:
    """Return the pairs of roads that cross at one height and share no junction.

    Args:
        network: Of any size.
    """
    lanes = [
        (edge, lane)
        for edge in network.edges.values()
        if edge.function == "normal"
        for lane in edge.lanes
        if len(lane.shape) > 1 and lane.allowed - _NO_DRIVERS
    ]
    if len(lanes) < 2:
        return ()
    pieces, owner = _pieces([lane for _, lane in lanes])
    lines = shapely.linestrings(pieces[..., :2])
    one, two = shapely.STRtree(lines).query(lines, predicate="intersects")
    apart = (owner[one] < owner[two]) & _crosswise(pieces[one], pieces[two])
    found: dict[tuple[str, str], AtGrade] = {}
    for a, b in zip(one[apart].tolist(), two[apart].tolist(), strict=True):
        first, other = lanes[owner[a]][0], lanes[owner[b]][0]
        if (first.id, other.id) in found or _joined(first, other):
            continue
        place, height = _meeting(pieces[a], pieces[b])
        if height < ROOM:
            found[first.id, other.id] = AtGrade(first.id, other.id, place, height)
    return tuple(found.values())


def say_at_grade(network: Network, file: Path) -> None:
    """Note where roads cross at one height, if they do.

    Args:
        network: As read.
        file: Its file.
    """
    found = crossings_at_grade(network)
    if not found:
        return
    first = found[0]
    x, y, _ = network.location.outside(first.place).tolist()
    more = f", and {len(found) - 1} more such pairs" if len(found) > 1 else ""
    logger.warning(
        "%s: `%s` and `%s` cross at (%.0f, %.0f) without a junction and with %.1f m of height"
        " between them%s: who drives there passes through others; give the upper road a height"
        " (z in its shape; for OpenStreetMap data, netconvert --osm.layer-elevation 6), or join"
        " the two in a junction",
        *(file, cut(first.first), cut(first.other), x, y, first.height, more),
        extra={"once": f"roads that cross in {file}"},
    )


def _pieces(lanes: list[Lane]) -> tuple[Floats, Ints]:
    """The straight pieces of lanes, (n, 2, 3) [m], and whose they are, (n,)."""
    pieces = [np.stack([lane.shape[:-1], lane.shape[1:]], axis=1) for lane in lanes]
    owner = np.repeat(np.arange(len(lanes)), [len(some) for some in pieces])
    return np.concatenate(pieces), owner


def _crosswise(some: Floats, others: Floats) -> Floats:
    """Which pieces cross at an angle, not along each other, (n,); pieces are (n, 2, 3) [m]."""
    a, b = (each[:, 1, :2] - each[:, 0, :2] for each in (some, others))
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    return np.asarray(area > _SQUARE * np.hypot(*a.T) * np.hypot(*b.T))


def _joined(first: Edge, other: Edge) -> bool:
    """Whether two edges are one, or meet at a junction."""
    ends = {first.from_junction, first.to_junction}
    return first.id == other.id or bool(ends & {other.from_junction, other.to_junction})


def _meeting(piece: Floats, other: Floats) -> tuple[Floats, float]:
    """Where two pieces, (2, 3) [m], cross, (3,) [m], and the height between them there [m]."""
    way, across = piece[1] - piece[0], other[1] - other[0]
    area = way[0] * across[1] - way[1] * across[0]
    gap = other[0] - piece[0]
    place = piece[0] + (gap[0] * across[1] - gap[1] * across[0]) / area * way
    above = other[0] + (gap[0] * way[1] - gap[1] * way[0]) / area * across
    return place, float(abs(above[2] - place[2]))
