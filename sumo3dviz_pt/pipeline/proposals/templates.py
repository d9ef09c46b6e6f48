"""Chooses a scene template by the roads around a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Network

REACH = 500.0
"""Roads within this distance of a place decide [m]."""

MOTORWAY, CITY, VILLAGE = "highway_day", "city_day", "village_day"
"""The templates that can be chosen."""

_FAST = 75.0 / 3.6  # limit from which a road leads over land [m/s]
_MOST_LOCAL = 12_000.0  # metres of lanes within reach from which a place is a town
_CARS = frozenset({"passenger", "bus", "delivery", "truck"})
_WIDE = 2  # lanes of a direction from which a road is a city's
_WIDE_SHARE = 0.15


@dataclass(frozen=True, slots=True)
class ChosenTemplate:
    """A template and the reason for it.

    Attributes:
        name: Of `scene_templates/scene`.
        why: End of a sentence.
    """

    name: str
    why: str


def choose_template(network: Network, place: Floats) -> ChosenTemplate:
    """Return the template that suits the roads around a place, (2,) or (3,) [m].

    Args:
        network: The road network.
        place: What the cameras look at.
    """
    edges = [edge for edge in network.edges.values() if _is_road(edge)]
    if not edges:
        return ChosenTemplate(VILLAGE, "no cars drive here")
    lines = np.array([shapely.LineString(edge.lanes[0].shape[:, :2]) for edge in edges])
    away = shapely.distance(lines, shapely.Point(place[:2]))
    near = [edge for edge, far in zip(edges, away, strict=True) if far < REACH] or edges
    metres = np.array([lane.length for edge in near for lane in edge.lanes])
    fast = np.array([_is_fast(edge) for edge in near for _ in edge.lanes])
    total = float(metres.sum())
    share = float(metres[fast].sum()) / max(total, 1e-9)
    if share > 0.5:
        return ChosenTemplate(
            MOTORWAY,
            f"{100 * share:.0f} % of the lanes nearby are motorways or faster than 75 km/h",
        )
    names = {edge.id for edge in near}
    lights = {
        link.tls
        for link in network.connections
        if link.tls and link.from_lane.rpartition("_")[0] in names
    }
    if lights:
        some = "a traffic light" if len(lights) == 1 else f"{len(lights)} traffic lights"
        return ChosenTemplate(CITY, f"streets with {some} nearby")
    wide = sum(lane.length for edge in near if _width(edge) >= _WIDE for lane in edge.lanes)
    if wide > _WIDE_SHARE * total:
        return ChosenTemplate(
            CITY, f"{100 * wide / total:.0f} % of the lanes belong to wide streets"
        )
    if total > _MOST_LOCAL:
        return ChosenTemplate(CITY, f"{total / 1000:.0f} km of slow lanes nearby")
    return ChosenTemplate(VILLAGE, "few, slow and narrow roads without traffic lights nearby")


def _is_road(edge: Edge) -> bool:
    """Whether cars drive on an edge between junctions."""
    return edge.function == "normal" and any(lane.allowed & _CARS for lane in edge.lanes)


def _is_fast(edge: Edge) -> bool:
    """Whether an edge is a motorway or a fast road over land."""
    named = "motorway" in edge.type or "trunk" in edge.type
    return named or max(lane.speed for lane in edge.lanes) > _FAST


def _width(edge: Edge) -> int:
    """Number of lanes that cars may use."""
    return sum(1 for lane in edge.lanes if lane.allowed & _CARS)
