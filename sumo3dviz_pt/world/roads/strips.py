"""Lanes as strips between two borders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.mesh.polyline import offset, with_split_bends, without_repeats
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Connection, Edge, Lane, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.roads.style import (
    LaneLook,
    bicycle_surface,
    is_skipped,
    look_of,
    style_of,
)

BoundsXY = tuple[float, float, float, float]
"""x0, y0, x1, y1 [m]."""

_SHARED = 1.0
"""Neighbouring lanes whose borders lie closer than this share one [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """A lane's surface.

    Attributes:
        lane: The lane.
        look: How it is drawn.
        right: Border on its right, (n, 3) [m].
        left: Border on its left, (n, 3) [m].
    """

    lane: Lane
    look: LaneLook
    right: Floats
    left: Floats

    @property
    def quads(self) -> Floats:
        """Corners, counter-clockwise from the right border's start, (n - 1, 4, 3) [m]."""
        right, left = self.right, self.left
        return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)

    @property
    def polygon(self) -> shapely.Geometry:
        """The whole strip from above, valid."""
        ring = np.concatenate([self.right, self.left[::-1]])[:, :2]
        return shapely.make_valid(shapely.Polygon(ring))


def in_region(points: Floats, region: BoundsXY | None, *, margin: float = 0.0) -> bool:
    """Return whether the box around points touches a region.

    Args:
        points: (n, 2 or 3) [m].
        region: A box [m]; None is everywhere.
        margin: By which the points' box is widened [m].
    """
    if region is None or not len(points):
        return region is None
    low, high = points[:, :2].min(axis=0) - margin, points[:, :2].max(axis=0) + margin
    return bool((low <= region[2:]).all() and (high >= region[:2]).all())


def connections_in(network: Network, region: BoundsXY | None) -> tuple[Connection, ...]:
    """Return the connections that begin within a box [m]; None holds all."""
    if region is None:
        return network.connections
    x0, y0, x1, y1 = region

    def inside(connection: Connection) -> bool:
        x, y = network.lanes[connection.from_lane].shape[-1][:2]
        return bool(x0 <= x <= x1 and y0 <= y <= y1)

    return tuple(connection for connection in network.connections if inside(connection))


def distance_to(box: BoundsXY | None, points: Floats) -> Floats:
    """Return the distance from points, (n, 2 or 3), to a box [m], (n,); 0 without a box."""
    if box is None:
        return np.zeros(len(points))
    low, high = np.array(box[:2]), np.array(box[2:])
    outside = np.maximum(np.maximum(low - points[:, :2], points[:, :2] - high), 0.0)
    return np.asarray(np.linalg.norm(outside, axis=1))


def lane_line(lane: Lane) -> Floats:
    """Return a lane's centre line with sharp bends split, (n, 3) [m]."""
    return with_split_bends(without_repeats(lane.shape))


def edge_strips(
    edge: Edge, settings: RoadSettings, *, left_hand: bool = False
) -> tuple[Strip, ...]:
    """Return strips of an edge's lanes from right to left; neighbours share their border exactly.

    Args:
        edge: The edge.
        settings: Surfaces and widths of lanes.
        left_hand: Whether lanes are counted from the left, as left-hand networks do.
    """
    style = style_of(edge.id, settings)
    strips: list[Strip] = []
    for lane in reversed(edge.lanes) if left_hand else edge.lanes:
        line = lane_line(lane)
        if is_skipped(lane) or len(line) < 2 or np.hypot(*np.ptp(line[:, :2], axis=0)) < 0.05:
            continue
        look = look_of(lane, style, bicycle=bicycle_surface(settings))
        right, left = offset(line, -0.5 * look.width), offset(line, 0.5 * look.width)
        before = strips[-1] if strips else None
        shared = None if before is None else _shared_border(before, line, lane)
        if before is not None and shared is not None:
            strips[-1] = Strip(before.lane, before.look, before.right, shared)
            right = shared
        strips.append(Strip(lane, look, np.round(right, 3), np.round(left, 3)))
    return tuple(strips)


def _shared_border(before: Strip, line: Floats, lane: Lane) -> Floats | None:
    """The border between a strip and the lane that follows it, if they touch.

    It goes by the network's widths, because cars keep to the network's centre
    lines even where the scene file makes lanes wider.
    """
    if abs(before.lane.index - lane.index) != 1 or len(before.right) != len(line):
        return None
    sides = [
        offset(lane_line(before.lane), 0.5 * before.lane.width),
        offset(line, -0.5 * lane.width),
    ]
    if np.abs(sides[0][:, :2] - sides[1][:, :2]).max() > _SHARED:
        return None
    return np.round(0.5 * (sides[0] + sides[1]), 3)


def kept_strips(
    edge: Edge, settings: RoadSettings, *, left_hand: bool, memory: Memory
) -> tuple[Strip, ...]:
    """Return what `edge_strips` gives, made once for all choices of roads.

    Args:
        edge: The edge.
        settings: Surfaces and widths of lanes.
        left_hand: Whether lanes are counted from the left.
        memory: Of the network's world.
    """
    make = partial(edge_strips, edge, settings, left_hand=left_hand)
    return memory.by_content.of(("strips", edge.id), make)


def network_strips(
    network: Network, settings: RoadSettings, *, region: BoundsXY | None, memory: Memory
) -> dict[str, tuple[Strip, ...]]:
    """Return strips of all normal edges that touch a region, by edge id.

    Args:
        network: The network.
        settings: Surfaces and widths of lanes.
        region: A box [m]; None is everywhere.
        memory: Of the network's world.
    """
    edges = (edge for edge in network.edges.values() if edge.function in {"normal", "connector"})
    return {
        edge.id: strips
        for edge in edges
        if any(in_region(lane.shape, region, margin=lane.width) for lane in edge.lanes)
        and (strips := kept_strips(edge, settings, left_hand=network.left_hand, memory=memory))
    }


def junction_of(internal_edge_id: str) -> str:
    """Return the junction that an internal edge, crossing or walking area belongs to.

    SUMO writes `:<junction>_<number>`, `:<junction>_c<number>`, `:<junction>_w<number>`.
    """
    return internal_edge_id[1:].rpartition("_")[0]
