"""What a network tells of the land around its roads: centre, suburb, village, country, motorway.

Nothing but roads is known: how many there are around a place, how wide and how fast they are,
where they meet, where lights, footways and bus stops are, and where streets end blindly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, settled
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.traffic import Stop
from sumo3dviz_pt.world.roads.strips import is_footway
from sumo3dviz_pt.world.street.places import drives

Character = Literal["centre", "suburb", "village", "country", "motorway"]
"""What stands beside a road, from closed rows of houses to nothing."""

URBAN = frozenset({"centre", "suburb"})
"""Where streets have pavements."""

_CELL = 100.0  # streets are counted on a grid of cells of this size [m]
_REACH = 2.01  # and within so many of them, which are 13 hectares
_HECTARES = 13.0
_LEAST = 0.62  # share of that land that counts at the rim of a network, though it tells nothing
_SAMPLE = 25.0  # distance of points that stand for streets [m]
_BLIND = 130.0  # longer streets that end blindly leave the network [m]
_MAIN = 0.12  # what speaks for a town beside a wide street that has footways of its own
_USUAL = 200.0  # metres of streets on a hectare: those of squares of 100 m [m]

_WEIGHTS = {
    "lights": (0.16, 3.0),
    "stops": (0.06, 3.0),
    "walks": (0.25, 1.0),
    "wide": (0.25, 1.0),
    "blind": (-0.06, 4.0),
}
"""What speaks for a town beside the density of its streets: how much each counts, and up to how
many of them. Footways and wide streets count by their share."""

_LIMITS: tuple[tuple[float, Character], ...] = (
    (0.92, "centre"),
    (0.40, "suburb"),
    (0.21, "village"),
)
"""From which sum on a place is what."""

_STREET, _ROAD, _MOTORWAY = 61.0 / 3.6, 76.0 / 3.6, 105.0 / 3.6
"""Limits above which nobody lives in rows at the kerb, in gardens beside it, at all [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Street:
    """An edge on which cars drive.

    Attributes:
        edge: The edge.
        middle: (2,) [m].
        length: Of what counts of it: half where another edge leads back [m].
        points: That stand for it, (n, 2) [m].
        walked: Whether it has a footway.
        lanes: How many carry cars.
    """

    edge: Edge
    middle: Floats
    length: float
    points: Floats
    walked: bool
    lanes: int

    @property
    def is_fast(self) -> bool:
        """Whether it is a motorway, or a wide and fast road without footways."""
        edge = self.edge
        named = "motorway" in edge.type or "trunk" in edge.type
        wide = self.lanes > 1 and not self.walked and edge.told_speed > _ROAD
        return named or wide or edge.told_speed > _MOTORWAY


def characters_of(network: Network, stops: Sequence[Stop] = ()) -> Mapping[str, Character]:
    """Return what stands beside each edge on which cars drive.

    Args:
        network: The roads.
        stops: Those of buses tell where people live.
    """
    streets = _streets(network)
    if not streets:
        return {}
    sums = _sums(network, streets, stops)
    fast = np.array([street.is_fast for street in streets])
    return {
        street.edge.id: "motorway" if quick else _character(street, float(total))
        for street, total, quick in zip(streets, sums, fast, strict=True)
    }


def _character(street: _Street, total: float) -> Character:
    """What a road that is no motorway runs through."""
    total += _MAIN if street.walked and street.lanes > 1 else 0.0
    what: Character = next((name for least, name in _LIMITS if total >= least), "country")
    speed = street.edge.told_speed
    if speed > _ROAD:
        return "country"
    return "suburb" if what == "centre" and speed > _STREET else what


def _streets(network: Network) -> list[_Street]:
    """All edges on which cars drive, by id."""
    ends = {(edge.from_junction, edge.to_junction) for edge in network.edges.values()}
    streets = []
    for _, edge in sorted(network.edges.items()):
        roads = [lane for lane in edge.lanes if drives(lane)]
        if edge.function != "normal" or not roads:
            continue
        line = shapely.LineString(roads[0].shape[:, :2])
        count = max(round(line.length / _SAMPLE), 1)
        at = (np.arange(count) + 0.5) * line.length / count
        points = settled(shapely.get_coordinates(shapely.line_interpolate_point(line, at)))
        double = (edge.to_junction, edge.from_junction) in ends
        walked = any(is_footway(lane) for lane in edge.lanes)
        middle = points[count // 2]
        length = line.length * (0.5 if double else 1.0)
        streets.append(_Street(edge, middle, length, points, walked, len(roads)))
    return streets


def _sums(network: Network, streets: Sequence[_Street], stops: Sequence[Stop]) -> Floats:
    """How much speaks for a town around each street, (n,)."""
    slow = [street for street in streets if not street.is_fast]
    points = np.concatenate([np.zeros((0, 2)), *(street.points for street in slow)])
    count = [len(street.points) for street in slow]
    length = np.repeat([street.length / len(street.points) for street in slow], count)
    walked = np.repeat([street.walked for street in slow], count)
    wide = np.repeat([street.lanes > 1 for street in slow], count)
    at = np.array([street.middle for street in streets])
    metres = _nearby(points, length, at)
    signs = {
        "lights": _nearby(*_counted(_lights(network)), at),
        "stops": _nearby(*_counted(_stops(network, stops)), at),
        "blind": _nearby(*_counted(_blind(network, slow)), at),
        "walks": _nearby(points, length * walked, at) / np.maximum(metres, 1.0),
        "wide": _nearby(points, length * wide, at) / np.maximum(metres, 1.0),
    }
    sums = metres / (_USUAL * _HECTARES * _covered(points, at))
    for name, (weight, most) in _WEIGHTS.items():
        sums = sums + weight * np.minimum(signs[name], most)
    return settled(sums)


def _counted(places: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Places, (n, 2) [m], each of which counts as one."""
    return np.array(places, dtype=np.float64).reshape(-1, 2), np.ones(len(places))


def _nearby(places: Floats, weights: Floats, at: Floats) -> Floats:
    """Sum of the weights of places, (n, 2) [m], around others, (m, 2) [m], by cells of a grid."""
    if not len(places):
        return np.zeros(len(at))
    keys, own = np.unique(np.floor(places / _CELL).astype(np.int64), axis=0, return_inverse=True)
    sums = np.bincount(own.ravel(), weights=weights)
    asked, back = np.unique(np.floor(at / _CELL).astype(np.int64), axis=0, return_inverse=True)
    tree = cKDTree(keys.astype(np.float64))
    near = [sorted(tree.query_ball_point(cell, _REACH)) for cell in asked.astype(np.float64)]
    return np.asarray(np.array([sums[some].sum() for some in near])[back.ravel()])


def _covered(points: Floats, at: Floats) -> Floats:
    """Which share of the land around places, (n, 2) [m], a network tells of, at least `_LEAST`."""
    hull = shapely.MultiPoint(points).convex_hull.buffer(_CELL / 2.0)
    asked, back = np.unique(np.floor(at / _CELL).astype(np.int64), axis=0, return_inverse=True)
    steps = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 2), axis=-1).reshape(-1, 2)
    steps = steps[np.hypot(*steps.T) < _REACH]
    cells = ((asked[:, None] + steps + 0.5) * _CELL).reshape(-1, 2)
    shapely.prepare(hull)
    inside = shapely.contains_xy(hull, cells).reshape(len(asked), len(steps)).mean(axis=1)
    return np.asarray(np.maximum(inside, _LEAST)[back.ravel()])


def _lights(network: Network) -> list[Floats]:
    """Where junctions with traffic lights are."""
    return [
        junction.position[:2]
        for _, junction in sorted(network.junctions.items())
        if junction.type.startswith("traffic_light")
    ]


def _stops(network: Network, stops: Sequence[Stop]) -> list[Floats]:
    """Where buses stop."""
    lanes = [network.lanes.get(stop.lane) for stop in stops if stop.kind == "bus"]
    return [lane.shape[:, :2].mean(axis=0) for lane in lanes if lane is not None]


def _blind(network: Network, streets: Sequence[_Street]) -> list[Floats]:
    """Where short streets end blindly."""
    arms: dict[str, set[str]] = {}
    for street in streets:
        edge = street.edge
        arms.setdefault(edge.from_junction, set()).add(edge.to_junction)
        arms.setdefault(edge.to_junction, set()).add(edge.from_junction)
    ends = {
        name
        for street in streets
        if street.length < _BLIND
        for name in (street.edge.from_junction, street.edge.to_junction)
        if len(arms[name]) == 1
    }
    return [network.junctions[name].position[:2] for name in sorted(ends & set(network.junctions))]
