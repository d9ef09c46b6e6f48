"""Where road users stand and ships float: on what is drawn, whatever heights the log gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.grounded import grounded
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.world.areas.build import covers_ground
from sumo3dviz_pt.world.areas.water import water_depth
from sumo3dviz_pt.world.build import BuiltPlace, World


def on_what_is_drawn(fleet: Fleet, place: BuiltPlace, world: World) -> Fleet:
    """Return a fleet on the roads and on the water that are drawn.

    Args:
        fleet: At the log's heights.
        place: What is built around the cameras.
        world: What exists.
    """
    if place.surface is not None:
        fleet = fleet.grounded(place.surface.rise_at)
    if not covers_ground(world.job):
        return fleet
    depth = water_depth()

    def down(points: Floats) -> Floats:
        """How far the water lies above lanes of ships, (n,) [m]."""
        return np.full(len(points), -depth)

    trajectories = tuple(
        grounded(trajectory, down, length=0.0) if body.vclass == "ship" else trajectory
        for trajectory, body in zip(fleet.trajectories, fleet.bodies, strict=True)
    )
    return replace(fleet, trajectories=trajectories)
