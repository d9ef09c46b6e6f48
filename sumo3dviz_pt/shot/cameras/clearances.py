"""Chooses the cameras of a scene file that must keep a clear view."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.model.camera_path import CameraPath
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.shot.cameras.build import build_camera
from sumo3dviz_pt.world.placement.clearance import Clearance

_VIEWS = 60
"""Views that stand for the way of a camera that moves, beside those at its moments."""


def clearance_of(
    cameras: Iterable[CameraSettings], *, aspect: float, location: Location = UNPLACED
) -> Clearance:
    """Return the ways of all cameras that ride in no vehicle and want a clear view.

    Args:
        cameras: All of a scene file.
        aspect: Height / width of the picture.
        location: From where the world's places are counted.

    Raises:
        ConfigError: If a camera looks at the point where it stands.
    """
    found = [_views(camera, location) for camera in clearing(cameras)]
    return Clearance(tuple(CameraPath.of(views, aspect=aspect) for views in found if views))


def clearing(cameras: Iterable[CameraSettings]) -> list[CameraSettings]:
    """Return those cameras that ride in no vehicle and want a clear view."""
    return [camera for camera in cameras if getattr(camera, "clear_view", False)]


def _views(settings: CameraSettings, location: Location) -> list[View]:
    """Views along a camera's way."""
    camera = build_camera(settings, fleet=Fleet((), (), (), {}, location=location))
    moments = camera.moments()
    between = np.linspace(moments[0], moments[-1], _VIEWS) if len(moments) > 1 else moments
    return [camera.view_at(time) for time in sorted({*moments, *map(float, between)})]
