"""Cameras and weather for tests of what falls."""

import numpy as np

from sumo3dviz_pt.model.falling import Falling
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

SIZE = (320, 180)
LENS = Lens.of_degrees(60.0)


def view_from(position=(0.0, 0.0, 2.0), yaw=0.0, pitch=0.0):
    return View(Transform.from_pose(position, yaw=yaw, pitch=pitch), LENS)


def falling_at(time=12.0, *, view=None, exposure=0.01, velocity=(0.0, 0.0, 0.0), **said):
    """What falls before a camera that moves evenly."""
    matrix = (view or view_from()).world_from_camera.matrix
    cameras = np.stack([matrix, matrix])
    for camera, at in zip(cameras, (-0.5, 0.5), strict=True):
        camera[:3, 3] += at * exposure * np.array(velocity)
    return Falling(time, exposure, 7, cameras, **said)
