"""How a camera is aimed: by angles, or at a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.settings import EulerianCamera, KeyFrame
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.network import UNPLACED, Location

_NEAREST = 1e-6
"""A target must be further away than this [m]."""


@dataclass(frozen=True, slots=True)
class Aim:
    """A viewing direction with its tilt.

    Attributes:
        yaw: Counter-clockwise from east [rad].
        pitch: Upwards [rad].
        roll: Clockwise as the viewer sees it [rad].
    """

    yaw: float
    pitch: float
    roll: float = 0.0

    def placed(self, position: Floats) -> Transform:
        """Return `world_from_camera` of an eye at a position, (3,) [m]."""
        return Transform.from_pose(position, yaw=self.yaw, pitch=self.pitch, roll=self.roll)


def aim_of(settings: EulerianCamera | KeyFrame, location: Location = UNPLACED) -> Aim:
    """Return the aim that settings ask for.

    Args:
        settings: In SUMO's coordinates.
        location: From where ours are counted.

    Raises:
        ConfigError: If the camera is to look at the point where it stands.
    """
    roll = float(np.radians(settings.roll))
    if settings.look_at is not None:
        subject, eye = location.inside([settings.look_at, settings.position])
        return aim_at(subject - eye, roll=roll)
    assert settings.heading is not None
    yaw = np.pi / 2 - np.radians(settings.heading)
    return Aim(float(yaw), float(np.radians(settings.pitch)), roll)


def aim_at(direction: Floats, *, roll: float = 0.0) -> Aim:
    """Aim along a direction, (3,); straight up or down, north is the picture's top or foot.

    Raises:
        ConfigError: If the direction vanishes.
    """
    level = float(np.hypot(direction[0], direction[1]))
    if np.hypot(level, direction[2]) < _NEAREST:
        raise ConfigError("look_at is the camera's own position", key="cameras")
    yaw = np.arctan2(direction[1], direction[0]) if level > _NEAREST else np.pi / 2
    return Aim(float(yaw), float(np.arctan2(direction[2], level)), roll)
