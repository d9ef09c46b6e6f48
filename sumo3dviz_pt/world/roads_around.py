"""Roads around a camera: where they are built, and how much of them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.placement.road_choice import RoadChoice
from sumo3dviz_pt.world.roads.build import RoadParts, build_roads, with_plain
from sumo3dviz_pt.world.roads.strips import BoundsXY

if TYPE_CHECKING:
    from sumo3dviz_pt.world.build import World

ROAD_REACH = 2500.0
"""Roads farther from every eye than this vanish in the haze [m]."""

_GRID = 250.0
"""Where roads end is a multiple of this [m]."""

_WIDEST = 100.0
"""Roads reach no farther beyond the middles of lanes [m]."""


def region_of(world: World, camera_path: CameraPath) -> BoundsXY | None:
    """Return where roads and signals are built; None is everywhere.

    It ends at lines of a grid, so that most cameras of a scene share their roads.
    """
    path = np.array(path_box(camera_path))
    low = np.floor((path[:2] - ROAD_REACH) / _GRID) * _GRID
    high = np.ceil((path[2:] + ROAD_REACH) / _GRID) * _GRID
    first, last = world.memory.of(("extent",), partial(_extent, world.scenario.network))
    if (low <= first).all() and (high >= last).all():
        return None
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _extent(network: Network) -> Floats:
    """The south-western and the north-eastern corner of all that is drawn, (2, 2) [m]."""
    shapes = [lane.shape for lane in network.lanes.values()]
    shapes += [junction.outline for junction in network.junctions.values()]
    points = np.concatenate([np.zeros((0, 2)), *(shape[:, :2] for shape in shapes)])
    if not len(points):
        return np.zeros((2, 2))
    # Lanes are wider than their middles.
    return np.stack([points.min(axis=0) - _WIDEST, points.max(axis=0) + _WIDEST])


def path_box(camera_path: CameraPath) -> BoundsXY:
    """Return the box around a camera's way [m]."""
    low, high = camera_path.positions.min(axis=0), camera_path.positions.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def roads_around(world: World, choice: RoadChoice, camera_path: CameraPath) -> RoadParts:
    """Build roads in detail, and beyond them what shows no more than its surface.

    Args:
        world: What exists.
        choice: Which roads are built.
        camera_path: Where the camera is; wear is finer near it.

    Raises:
        ConfigError: If a surface is unknown.
    """
    settings, textured = world.job.roads, world.job.textured
    memory = world.memory.within("chosen", *choice.name)
    roads = build_roads(
        choice.detailed,
        settings,
        textured=textured,
        region=choice.region,
        focus=path_box(camera_path),
        memory=memory,
    )
    if choice.plain is None:
        return roads
    return with_plain(roads, choice.plain, settings, textured=textured, memory=memory)
