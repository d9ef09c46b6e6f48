"""The ground between roads: its height, and points along the borders of roads that shape it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import spatial

from sumo3dviz_pt.library.mesh.polyline import densified, mitres
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.vectors import unit
from sumo3dviz_pt.world.land.horizon import Land
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.levels import Levels, levels_of

STEP, _MOST_SAMPLES = 3.0, 30_000
"""Distance of points along borders [m], and how many there may be, about."""

_LOCAL, _AMBIENT, _ODD = 150.0, 120.0, 2.0
"""Roads within the first distance [m] of a crossing of levels are compared with the usual height
within the second one [m]; those that differ by more than the third [m] do not shape the ground."""

HeightAt = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Points along the borders of roads.

    Attributes:
        points: On the border, (n, 3) [m].
        outward: Unit vectors away from the road, (n, 2).
    """

    points: Floats
    outward: Floats


def ground_between(roads: RoadLayout, network: Network, land: Land) -> HeightAt:
    """Return the height of the ground as if no road were far above or below it.

    Args:
        roads: What is built.
        network: All roads.
        land: Its hills.
    """
    shaping = shaping_of(roads, network)

    def height_at(places: Floats) -> Floats:
        """Return height of the ground, (n, 2) -> (n,) [m]."""
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        return blended(flat, shaping) + land.heights(flat)

    return height_at


def shaping_of(roads: RoadLayout, network: Network) -> Floats:
    """Return points of roads that shape the ground, (n, 3) [m], which the layout's memory keeps."""

    def found() -> Floats:
        levels = levels_of(roads)
        return _shaping(border_samples(levels), network, levels)

    return roads.memory.of(("what shapes the ground",), found)


def border_samples(levels: Levels) -> Samples:
    """Return points along all borders of a road surface, at most about 3 m apart."""
    total = sum(
        float(np.linalg.norm(np.diff(border.line[:, :2], axis=0), axis=1).sum())
        for border in levels.borders
    )
    step = max(STEP, total / _MOST_SAMPLES)
    points, outward = [np.zeros((0, 3))], [np.zeros((0, 2))]
    for border in levels.borders:
        line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
        dense = densified(line, step)
        dense = dense[:-1] if border.closed else dense
        points.append(dense)
        outward.append(-unit(mitres(dense, closed=border.closed)))
    return Samples(np.concatenate(points), np.concatenate(outward))


def _shaping(samples: Samples, network: Network, levels: Levels) -> Floats:
    """Points of roads that shape the ground, (n, 3) [m]: neither bridges nor underpasses.

    Near crossings of levels, roads far from the usual height around are left out.
    """
    lanes = np.concatenate([lane.shape for lane in network.lanes.values()])
    known = np.concatenate([samples.points, lanes])
    shared = levels.crossings.shared
    if not len(shared):
        return known
    # Find what lies near crossings.
    centres = shapely.get_coordinates(shapely.centroid(shared))
    away, _ = spatial.cKDTree(centres).query(known[:, :2])
    near = np.flatnonzero(np.asarray(away) < _LOCAL)
    # Compare it with the usual height around, to which odd heights count less each time.
    step = max(len(known) // 6000, 1)
    around = known[::step]
    pairs = spatial.cKDTree(known[near, :2]).query_ball_tree(
        spatial.cKDTree(around[:, :2]), 1.5 * _AMBIENT
    )
    odd = np.array(
        [
            abs(_usual(around[found], known[k]) - known[k, 2]) > _ODD
            for k, found in zip(near, pairs, strict=True)
        ],
        dtype=np.bool_,
    )
    return np.delete(known, near[odd], axis=0) if not odd.all() else known


def _usual(around: Floats, place: Floats) -> float:
    """The usual height around a place [m]: a mean that odd heights hardly change."""
    if not len(around):
        return float(place[2])
    away = ((around[:, :2] - place[:2]) ** 2).sum(axis=1)
    near = np.exp(-0.5 * away / (0.5 * _AMBIENT) ** 2) + 1e-9
    order = np.argsort(around[:, 2], kind="stable")
    share = np.cumsum(near[order])
    middle = float(around[order, 2][np.searchsorted(share, 0.5 * share[-1])])
    weight = near / (1.0 + (around[:, 2] - middle) ** 2)
    return float((weight * around[:, 2]).sum() / weight.sum())


def blended(flat: Floats, shaping: Floats) -> Floats:
    """Return inverse-distance heights of the nearest roads.

    Args:
        flat: Places, (n, 2) [m].
        shaping: What `shaping_of` gave.

    Returns:
        (n,) [m].
    """
    count = min(16, len(shaping))
    away, near = (
        np.asarray(v).reshape(len(flat), count)
        for v in spatial.cKDTree(shaping[:, :2]).query(flat, k=count)
    )
    weights = 1.0 / (away**2 + 4.0)
    return np.asarray((weights * shaping[near, 2]).sum(axis=1) / weights.sum(axis=1))
