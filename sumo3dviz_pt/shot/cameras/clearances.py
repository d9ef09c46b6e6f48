"""Chooses the cameras of a scene file that must keep a clear view."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sumo3dviz_pt.job.settings import (
    CameraSettings,
    CinematicCamera,
    EulerianCamera,
    LagrangianCamera,
)
from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.shot.cameras.build import standing_view
from sumo3dviz_pt.shot.cameras.flying import build_flight
from sumo3dviz_pt.world.placement.clearance import Clearance

_VIEWS = 60
"""Views that stand for a flight, beside its key frames."""


def clearance_of(cameras: Iterable[CameraSettings], *, aspect: float) -> Clearance:
    """Return the ways of all cameras that ride in no vehicle and want a clear view.

    Args:
        cameras: All of a scene file.
        aspect: Height / width of the picture.

    Raises:
        ConfigError: If a camera looks at the point where it stands.
    """
    found = [_views(camera) for camera in clearing(cameras)]
    return Clearance(tuple(CameraPath.of(views, aspect=aspect) for views in found if views))


def clearing(
    cameras: Iterable[CameraSettings],
) -> list[EulerianCamera | CinematicCamera]:
    """Return those cameras that ride in no vehicle and want a clear view."""
    return [
        camera
        for camera in cameras
        if not isinstance(camera, LagrangianCamera) and camera.clear_view
    ]


def _views(camera: EulerianCamera | CinematicCamera) -> list[View]:
    """Views along a camera's way."""
    if isinstance(camera, EulerianCamera):
        return [standing_view(camera)]
    flight = build_flight(camera)
    keys = [key.time for key in camera.keyframes]
    between = np.linspace(keys[0], keys[-1], _VIEWS) if len(keys) > 1 else keys
    return [flight.view_at(time) for time in sorted({*keys, *map(float, between)})]
