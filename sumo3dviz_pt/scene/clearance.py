"""What nothing may grow into or before: the cameras of a scene file.

Trees, houses and street furniture that a scenario did not ask for keep clear of cameras.
All cameras of a scene file count in each of its shots, so that every shot, and the viewer,
shows the same world. Where someone's vehicle goes is no matter of the scene file: cameras
that ride count in their own shot only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.job import CameraSettings, CinematicCamera, EulerianCamera, Job
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.scene.cameras import standing_view
from sumo3dviz_pt.scene.flying import build_flight
from sumo3dviz_pt.scene.needs import Gaze

KEEP_CLEAR = 1.0
"""Distance that objects keep from cameras [m]."""

_STAYS = 60.0
"""A camera that moves less shows one place only [m]."""

_VIEWS = 60
"""Views that stand for a flight, beside its key frames."""


@dataclass(frozen=True, slots=True, eq=False)
class Clearance:
    """Cameras that nothing grows into or before.

    Attributes:
        ways: Where each camera is and looks, over its whole way.
    """

    ways: tuple[Gaze, ...] = ()

    @property
    def places(self) -> Floats:
        """Where cameras are, (n, 3) [m]."""
        return np.concatenate([np.zeros((0, 3)), *(way.positions for way in self.ways)])

    def distances(self, places: Floats) -> Floats:
        """Horizontal distance of places, (k, 2) [m], to the nearest camera; infinite without."""
        if not self.ways:
            return np.full(len(places), np.inf)
        away, _ = cKDTree(self.places[:, :2]).query(places)
        return np.asarray(away, dtype=np.float64)

    @property
    def outlooks(self) -> tuple[Gaze, ...]:
        """The ways of cameras that stay: what they look at must not be hidden."""
        return tuple(w for w in self.ways if np.ptp(w.positions[:, :2], axis=0).max() <= _STAYS)

    def beside(self, way: Gaze) -> Clearance:
        """The same, and one more camera's way."""
        return Clearance((*self.ways, way))


def clearance_of(job: Job) -> Clearance:
    """The ways of all cameras of a scene file that ride in no vehicle.

    Raises:
        ConfigError: If a camera looks at the point where it stands.
    """
    aspect = job.output.size[1] / job.output.size[0]
    found = [_views(camera) for camera in job.cameras.values()]
    return Clearance(tuple(Gaze.of(views, aspect=aspect) for views in found if views))


def _views(camera: CameraSettings) -> list[View]:
    """Views along a camera's way; none of one that rides."""
    if isinstance(camera, EulerianCamera):
        return [standing_view(camera)]
    if not isinstance(camera, CinematicCamera):
        return []
    flight = build_flight(camera)
    keys = [key.time for key in camera.keyframes]
    between = np.linspace(keys[0], keys[-1], _VIEWS) if len(keys) > 1 else keys
    return [flight.view_at(time) for time in sorted({*keys, *map(float, between)})]
