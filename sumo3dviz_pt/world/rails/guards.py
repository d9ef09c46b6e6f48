"""Tells the signals of railways from those of streets.

A network has one list of signalled connections. By the type of the junction that they
lead into they belong to a street's traffic light, to a level crossing with its barriers,
or to a rail signal.
"""

from __future__ import annotations

from typing import Literal

from sumo3dviz_pt.model.network import Connection, Junction, Lane, Network
from sumo3dviz_pt.world.roads.strips import junction_of
from sumo3dviz_pt.world.roads.style import RAIL_CLASSES

Guard = Literal["street", "level crossing", "rail signal"]
"""What stops the traffic of a connection."""

LEVEL_CROSSING, RAIL_SIGNAL = "rail_crossing", "rail_signal"

TRAINS = RAIL_CLASSES - {"tram", "cable_car"}
"""vClasses that run on ballast."""

_GUARDS: dict[str, Guard] = {LEVEL_CROSSING: "level crossing", RAIL_SIGNAL: "rail signal"}


def guard_of(network: Network, link: Connection) -> Guard:
    """Return what stops the traffic of a signalled connection."""
    junction = _junction_ahead(network, link)
    return "street" if junction is None else _GUARDS.get(junction.type, "street")


def only_rails(lane: Lane) -> bool:
    """Return whether nothing but rail vehicles may use a lane."""
    return bool(lane.allowed) and lane.allowed <= RAIL_CLASSES


def at_level_crossing(network: Network, crossing_id: str) -> bool:
    """Return whether people cross at a level crossing, where nothing is painted for them."""
    junction = network.junctions.get(junction_of(crossing_id))
    return junction is not None and junction.type == LEVEL_CROSSING


def _junction_ahead(network: Network, link: Connection) -> Junction | None:
    """The junction that a connection leads through."""
    edge = network.edges[network.lanes[link.from_lane].edge_id]
    key = junction_of(edge.id) if edge.id.startswith(":") else edge.to_junction
    return network.junctions.get(key)
