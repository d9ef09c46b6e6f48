"""Which streets are a city's: sampled, with what decides whether houses stand beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.nearest import Nearest
from sumo3dviz_pt.world.placement.tiles import edges_in

FASTEST = 61.0 / 3.6
"""On faster roads nobody lives at the kerb [m/s]."""

AROUND = 200.0
"""Radius within which streets are counted [m]."""

_DENSE = 2200.0  # metres of streets within that radius make a town [m]
_NOISE = 16.0  # distance from fast roads [m]


@dataclass(frozen=True, slots=True, eq=False)
class Streets:
    """Sampled streets and what they are."""

    tree: Nearest
    city: Bools
    main: Bools
    walks: Bools
    fast: shapely.Geometry

    def fit(self, places: Floats, reach: float) -> Bools:
        """Return whether places, (n, 2) [m], lie at a city street, not farther than a reach [m]."""
        away, nearest = self.tree.query(places)
        good = self.city[nearest] & (away < reach)
        if not self.fast.is_empty:
            shapely.prepare(self.fast)
            good &= ~shapely.contains_xy(self.fast, places)
        return np.asarray(good)


def streets_in(network: Network, box: shapely.Polygon, memory: Memory) -> Streets | None:
    """Sample the streets in a box.

    Args:
        network: The road network.
        box: Upright [m].
        memory: Of the network's world.

    Returns:
        None where no street runs.
    """
    points, rank, length, fast = [], [], [], []
    for edge in edges_in(network, box, memory):
        roads = [lane for lane in edge.lanes if lane.allowed & {"passenger", "bus", "delivery"}]
        if edge.function != "normal" or not roads:
            continue
        line = shapely.LineString(roads[0].shape[:, :2])
        at = np.linspace(0.0, line.length, max(int(line.length / 5.0), 1) + 1)
        quick = _is_fast(edge)
        fast += [_beyond(network, edge, end) for end in (0, -1)]
        walks = any(lane.allowed and lane.allowed <= {"pedestrian"} for lane in edge.lanes)
        if quick:
            fast.append(line.buffer(_width(edge) + _NOISE, cap_style="flat"))
        for lane in edge.lanes:  # all lanes, so that the nearest point is the nearest street's
            track = shapely.LineString(lane.shape[:, :2])
            spots = shapely.line_interpolate_point(track, at / line.length, normalized=True)
            points.append(shapely.get_coordinates(spots))
            rank += [(not quick, len(roads) > 1, walks)] * len(at)
            own = lane is roads[0]
            length += [line.length / len(at) * own] * len(at)
    if not points:
        return None
    places, kinds = settled(np.concatenate(points)), np.array(rank, dtype=np.bool_)
    tree = Nearest(places)
    total = _density(places, np.array(length) * kinds[:, 0])
    city = kinds[:, 0] & (kinds[:, 2] | (total > _DENSE))
    return Streets(tree, city, kinds[:, 1], kinds[:, 2], shapely.union_all(fast))


def _density(places: Floats, length: Floats) -> Floats:
    """Metres of streets around places, (n,), counted on a grid of cells."""
    cell = np.floor(places / AROUND).astype(np.int64)
    keys, own = np.unique(cell, axis=0, return_inverse=True)
    sums = np.bincount(own.ravel(), weights=length)
    near = cKDTree(keys.astype(np.float64)).query_ball_point(keys, 1.01)
    mean = np.array([sums[some].sum() / 5.0 for some in near])
    return np.asarray(mean[own.ravel()] * np.pi)  # a disc has pi cells of its radius


def _width(edge: Edge) -> float:
    """Of all lanes of an edge [m]."""
    return sum(lane.width for lane in edge.lanes)


def _beyond(network: Network, edge: Edge, end: int) -> shapely.Geometry:
    """Where a road that ends at the network's rim would go on."""
    junction = network.junctions.get(edge.to_junction if end else edge.from_junction)
    if junction is None or junction.type != "dead_end":
        return shapely.Polygon()
    shape = edge.lanes[0].shape[:, :2]
    step = shape[-1] - shape[-2] if end else shape[0] - shape[1]
    away = shape[end] + 60.0 * step / max(float(np.hypot(*step)), 1e-6)
    return shapely.LineString([shape[end], away]).buffer(_width(edge) + 1.0, cap_style="flat")


def _is_fast(edge: Edge) -> bool:
    """Whether a road is too fast for houses."""
    named = any(word in edge.type for word in ("motorway", "trunk"))
    return named or edge.told_speed > FASTEST
