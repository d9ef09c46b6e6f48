"""Add heights of the road to logs without z in a network that has hills."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, frozen
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.polylines import evenly_along
from sumo3dviz_pt.model.traffic import Trace

_SPACING = 2.0
"""Distance between the points that stand for a lane [m]."""


def with_heights(traces: tuple[Trace, ...], network: Network) -> tuple[Trace, ...]:
    """Put traces onto the road if the log has no z but the network has.

    Args:
        traces: Traces as read.
        network: The roads.

    Returns:
        The same traces if the network is flat or any sample has a height, else traces
        with the z of the nearest lane [m].
    """
    hilly = any(lane.shape[:, 2].any() for lane in network.lanes.values())
    if not hilly or any(trace.positions[:, 2].any() for trace in traces):
        return traces
    points = _lane_points(network)
    tree = cKDTree(points[:, :2])
    return tuple(
        replace(trace, positions=_lifted(trace.positions, points[:, 2], tree)) for trace in traces
    )


def _lifted(positions: Floats, heights: Floats, tree: cKDTree) -> Floats:
    """Return positions at the heights of their nearest points, weighted by inverse distance."""
    # A lane has at least two points, so there always is a second one.
    distances, nearest = tree.query(positions[:, :2], k=[1, 2])
    weights = 1.0 / (np.asarray(distances) + 1e-6)
    z = (weights * heights[nearest]).sum(axis=1) / weights.sum(axis=1)
    return frozen(np.column_stack([positions[:, :2], z]))


def _lane_points(network: Network) -> Floats:
    """Return points along all lanes, at most `_SPACING` apart, (n, 3) [m]."""
    shapes = [lane.shape for lane in network.lanes.values()]
    return evenly_along(shapes, lambda long: np.maximum(np.ceil(long / _SPACING) + 1, 2)).points
