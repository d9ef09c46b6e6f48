"""Chooses a scene template by the roads around a place, and what stands there.

A limit alone tells little: SUMO's type map for OpenStreetMap gives roads of which it knows none
100 km/h (27.78 m/s).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import kind_of

REACH = 500.0
"""Roads within this distance of a place decide [m]."""

MOTORWAY, CITY, VILLAGE = "highway_day", "city_day", "village_day"
"""The templates that can be chosen."""

_FAST = 75.0 / 3.6  # limit from which a road leads over land [m/s]
_MOTORWAYS = 105.0 / 3.6  # limit from which it is no street [m/s]
_MOST_LOCAL = 12_000.0  # metres of lanes within reach from which a place is a town
_CARS = frozenset({"passenger", "bus", "delivery", "truck"})
_WIDE = 2  # lanes of a direction from which a road is a city's
_WIDE_SHARE = 0.15
_WALKED = 0.25  # share of lanes with footways from which people walk there
_CLOSE = 150.0  # distance of junctions in a town, at most [m]
_WALKERS = frozenset({"pedestrian"})


@dataclass(frozen=True, slots=True)
class ChosenTemplate:
    """A template and the reason for it.

    Attributes:
        name: Of `scene_templates/scene`.
        why: End of a sentence.
    """

    name: str
    why: str


def choose_template(
    network: Network, place: Floats, polygons: Sequence[Polygon] = ()
) -> ChosenTemplate:
    """Return the template that suits the roads around a place, (2,) or (3,) [m].

    Args:
        network: The road network.
        place: What the cameras look at.
        polygons: The scenario's; buildings among them tell of a town.
    """
    edges = [edge for edge in network.edges.values() if _is_road(edge)]
    if not edges:
        return ChosenTemplate(VILLAGE, "no cars drive here")
    lines = np.array([shapely.LineString(edge.lanes[0].shape[:, :2]) for edge in edges])
    away = shapely.distance(lines, shapely.Point(place[:2]))
    near = [edge for edge, far in zip(edges, away, strict=True) if far < REACH] or edges
    town = _town(network, near, place, polygons)
    motorway = _motorway(near, town)
    if motorway is not None:
        return motorway
    if town.lights:
        some = "a traffic light" if town.lights == 1 else f"{town.lights} traffic lights"
        return ChosenTemplate(CITY, f"streets with {some} nearby")
    total = town.metres
    wide = sum(lane.length for edge in near if _width(edge) >= _WIDE for lane in edge.lanes)
    if wide > _WIDE_SHARE * total:
        return ChosenTemplate(
            CITY, f"{100 * wide / total:.0f} % of the lanes belong to wide streets"
        )
    if total > _MOST_LOCAL:
        return ChosenTemplate(CITY, f"{total / 1000:.0f} km of slow lanes nearby")
    return ChosenTemplate(VILLAGE, "few, slow and narrow roads without traffic lights nearby")


@dataclass(frozen=True, slots=True)
class _Town:
    """What tells a town from open land.

    Attributes:
        metres: Of lanes.
        walked: Share of them with a footway or a crossing beside them.
        lights: Number of traffic lights.
        spacing: Usual distance between junctions at which roads meet [m].
        houses: Number of buildings.
    """

    metres: float
    walked: float
    lights: int
    spacing: float
    houses: int

    @property
    def signs(self) -> list[str]:
        """What speaks for a town, in words."""
        found = []
        if self.walked > _WALKED:
            found.append(f"{100 * self.walked:.0f} % of the lanes have footways")
        if self.lights:
            found.append("there are traffic lights")
        if self.spacing < _CLOSE:
            found.append(f"junctions are {self.spacing:.0f} m apart")
        if self.houses:
            found.append("there are buildings")
        return found


def _town(
    network: Network, near: Sequence[Edge], place: Floats, polygons: Sequence[Polygon]
) -> _Town:
    """Return what the edges near a place, and what stands there, tell of a town."""
    metres = {edge.id: sum(lane.length for lane in edge.lanes) for edge in near}
    crossed = {
        name
        for edge in network.edges.values()
        if edge.function == "crossing"
        for name in edge.crossed_edges
    }
    total = max(sum(metres.values()), 1e-9)
    walked = sum(metres[edge.id] for edge in near if edge.id in crossed or _has_footway(edge))
    lights = {
        link.tls
        for link in network.connections
        if link.tls and link.from_lane.rpartition("_")[0] in metres
    }
    arms: dict[str, set[str]] = {}
    for edge in near:
        arms.setdefault(edge.from_junction, set()).add(edge.to_junction)
        arms.setdefault(edge.to_junction, set()).add(edge.from_junction)
    meet = [edge for edge in near if len(arms[edge.from_junction]) > 2]
    meet = [edge for edge in meet if len(arms[edge.to_junction]) > 2]
    spacing = float(np.median([edge.lanes[0].length for edge in meet])) if meet else np.inf
    return _Town(total, walked / total, len(lights), spacing, _houses(polygons, place))


def _motorway(near: Sequence[Edge], town: _Town) -> ChosenTemplate | None:
    """Return the motorway's template if most lanes are fast, and no town says otherwise."""
    named = sum(lane.length for edge in near if _is_named(edge) for lane in edge.lanes)
    fast = sum(lane.length for edge in near if _is_fast(edge) for lane in edge.lanes)
    if fast <= 0.5 * town.metres:
        return None
    # One of these stands beside a motorway, too; a name says what a limit only hints at.
    if named <= 0.5 * town.metres and len(town.signs) > 1:
        return None
    return ChosenTemplate(
        MOTORWAY,
        f"{100 * fast / town.metres:.0f} % of the lanes nearby are motorways or faster than"
        " 75 km/h",
    )


def _is_road(edge: Edge) -> bool:
    """Whether cars drive on an edge between junctions."""
    return edge.function == "normal" and any(lane.allowed & _CARS for lane in edge.lanes)


def _is_named(edge: Edge) -> bool:
    """Whether a map calls an edge a motorway or something alike, or its limit can mean no other."""
    return "motorway" in edge.type or "trunk" in edge.type or edge.told_speed > _MOTORWAYS


def _is_fast(edge: Edge) -> bool:
    """Whether an edge is a motorway or a fast road over land."""
    return _is_named(edge) or (edge.told_speed > _FAST and not _has_footway(edge))


def _has_footway(edge: Edge) -> bool:
    """Whether a lane of an edge is for people on foot alone."""
    return any(lane.allowed == _WALKERS for lane in edge.lanes)


def _houses(polygons: Sequence[Polygon], place: Floats) -> int:
    """Number of buildings within reach of a place."""
    return sum(
        1
        for item in polygons
        if kind_of(item.type, item.source) == "buildings"
        and float(np.hypot(*(item.shape[:, :2] - place[:2]).T).min(initial=np.inf)) < REACH
    )


def _width(edge: Edge) -> int:
    """Number of lanes that cars may use."""
    return sum(1 for lane in edge.lanes if lane.allowed & _CARS)
