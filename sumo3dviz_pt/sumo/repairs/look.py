"""Look for geometry in a network that no map means.

What netconvert writes as a habit is not odd: internal lanes of a point, outlines without any
ground where a road only goes on, and outlines that overlap themselves a little.
"""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Network
from sumo3dviz_pt.sumo.repairs.found import Oddities, Oddity

_SMALL = 0.1
"""Length or width of a lane below which it is odd [m]."""

_REVERSED = np.cos(np.radians(175.0))
"""Cosine of the smallest turn by which a lane doubles back."""

_CROSSED = (0.1, 1.0)
"""Enclosed ground that an outline walks round the wrong way, as a share and [m2], to be odd."""

_NO_GROUND = frozenset({"dead_end", "internal"})
"""Types of junctions that need no outline."""


def look_over(network: Network, oddities: Oddities) -> None:
    """Add what is odd in the geometry of a network.

    Args:
        network: The network, whose lanes all have a shape.
        oddities: What was found before; it grows.
    """
    for edge in network.edges.values():
        for lane in edge.lanes:
            if edge.function == "walkingarea":
                _look_at_area(lane, oddities)
            else:
                _look_at_lane(lane, edge, oddities)
    left_by = {edge.from_junction for edge in network.edges.values()}
    for junction in network.junctions.values():
        joins = bool(junction.incoming_lanes) and junction.id in left_by
        _look_at_junction(junction, oddities, joins=joins)


def _look_at_lane(lane: Lane, edge: Edge, oddities: Oddities) -> None:
    """Add what is odd in a lane that leads from one end to another."""
    if lane.width < _SMALL:
        oddities.add(Oddity.NARROW, lane.id)
    steps = np.diff(lane.shape[:, :2], axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    if lengths.sum() < _SMALL:
        if edge.function != "internal":
            oddities.add(Oddity.SHORT, lane.id)
    elif edge.function == "normal" and _reverses(steps[lengths > 0.0]):
        oddities.add(Oddity.REVERSING, lane.id)


def _reverses(steps: Floats) -> bool:
    """Return whether a way turns back on itself at a vertex; steps are (n, 2) [m], none is 0."""
    ways = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    return bool(((ways[1:] * ways[:-1]).sum(axis=1) < _REVERSED).any())


def _look_at_area(lane: Lane, oddities: Oddities) -> None:
    """Add what is odd in a walking area."""
    if len(lane.shape) < 3:
        oddities.add(Oddity.NO_AREA, lane.id)
    elif _crosses_itself(lane.shape):
        oddities.add(Oddity.CROSSED_AREA, lane.id)


def _look_at_junction(junction: Junction, oddities: Oddities, *, joins: bool) -> None:
    """Add what is odd in the outline of a junction; `joins` tells whether roads go on there."""
    if junction.type in _NO_GROUND:
        return
    if len(junction.outline) < 3:
        if joins:
            oddities.add(Oddity.NO_OUTLINE, junction.id)
    elif _crosses_itself(junction.outline):
        oddities.add(Oddity.CROSSED_JUNCTION, junction.id)


def _crosses_itself(outline: Floats) -> bool:
    """Return whether an outline, (n, 3) [m], walks round much of its ground the wrong way."""
    polygon = shapely.Polygon(outline[:, :2])
    if polygon.is_valid:
        return False
    ground = shapely.make_valid(polygon).area
    lost = abs(ground - polygon.area)
    return bool(lost > _CROSSED[1] and lost > _CROSSED[0] * ground)
