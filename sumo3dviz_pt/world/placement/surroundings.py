"""What static objects are placed by: ground, lanes, cameras, chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.camera_path import CameraPath, in_mirrors, in_picture, in_view
from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.lane_index import LaneIndex, build_lane_index

_SINK = 0.05  # how far the ground lies below the nearest road [m]
_USUAL = 100.0  # distance that counts where no camera is known [m]

HeightAt = Callable[[Floats], Floats]
"""Height of the ground at places, (n, 2) [m], as (n,) [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What objects are placed by.

    Attributes:
        index: The network's lanes.
        height_at: Height of the ground.
        viewpoints: Where cameras are during the shot, (n, 3) [m]; n may be 0.
        seed: Of all chance.
        camera_path: Where cameras look, or None: then everything counts as seen.
        clearance: Cameras that nothing grows into or before.
        dark: Whether lamps are lit.
        memory: What was built of the world.
        season: What leaves look like.
    """

    index: LaneIndex
    height_at: HeightAt
    viewpoints: Floats
    seed: int
    camera_path: CameraPath | None = None
    clearance: Clearance = field(default_factory=Clearance)
    dark: bool = False
    memory: Memory = field(default_factory=Memory)
    season: str = "summer"

    @property
    def eyes(self) -> Floats | None:
        """Where the cameras are, (n, 3) [m]; None if that is not known."""
        return None if self.camera_path is None else self.camera_path.eyes

    def distances(self, places: Floats) -> Floats:
        """Return the distance in plan of places, (n, 2) [m], to the nearest camera, (n,) [m].

        It is 100 m without cameras.
        """
        if not len(self.viewpoints):
            return np.full(len(places), _USUAL)
        away, _ = cKDTree(self.viewpoints[:, :2]).query(places[:, :2])
        return settled(away)

    def seen(self, places: Floats, *, radius: float) -> Bools:
        """Return which balls around places, (n, 2) [m], some camera may see, shadows included."""
        if self.camera_path is None or not len(places):
            return np.ones(len(places), dtype=np.bool_)
        centres = np.column_stack([places, self.height_at(places)])
        return np.asarray(in_view(self.camera_path, centres, radius=radius).any(axis=1))

    def pictured(self, places: Floats, *, radius: float, by: CameraPath | None = None) -> Bools:
        """Return which balls around places, (n, 2) [m], lie in a camera's picture or its mirrors.

        Args:
            places: On the ground.
            radius: Of the balls [m].
            by: The camera; default: any of the shot's.
        """
        camera_path = by or self.camera_path
        if camera_path is None or not len(places):
            return np.ones(len(places), dtype=np.bool_)
        centres = np.column_stack([places, self.height_at(places)])
        seen = in_picture(camera_path, centres, radius=radius)
        if camera_path.behind is not None:
            seen |= in_mirrors(camera_path, centres, radius=radius)
        return np.asarray(seen.any(axis=1))


def surroundings(
    lanes: Network | LaneIndex,
    *,
    seed: int,
    viewpoints: Floats | None = None,
    camera_path: CameraPath | None = None,
    height_at: HeightAt | None = None,
    clearance: Clearance | None = None,
) -> Surroundings:
    """Return what objects of a network are placed by.

    Args:
        lanes: The roads that houses face; they give heights unless those are given.
        seed: Of sizes, models and colours.
        viewpoints: Cameras of the shot, (n, 3) [m]; default the camera path's, else none.
        camera_path: Where the cameras look; what they never see is left out.
        height_at: Height of the ground; default a little below the nearest road.
        clearance: Cameras that nothing grows into or before; default those of the shot.
    """
    index = lanes if isinstance(lanes, LaneIndex) else build_lane_index(lanes)
    if viewpoints is None:
        viewpoints = np.zeros((0, 3)) if camera_path is None else camera_path.positions
    ground = height_at or (lambda places: index.heights(places) - _SINK)
    points = settled(viewpoints).reshape(-1, 3)
    if clearance is None:
        way = camera_path or CameraPath.all_round(points)
        clearance = Clearance((way,)) if len(way.positions) else Clearance()
    return Surroundings(index, ground, points, seed, camera_path=camera_path, clearance=clearance)
