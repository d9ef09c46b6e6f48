"""Where a shot's camera is and looks, and what lies in its view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, settled
from sumo3dviz_pt.model.scene import View

AROUND = 60.0
"""What is nearer than this is kept even behind the camera: shadows, reflections [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class CameraPath:
    """Where a shot's camera is and looks, over n times.

    Attributes:
        positions: (n, 3) [m].
        forwards: Unit viewing directions, (n, 3).
        half_angles: Half the diagonal opening angle, (n,) [rad].
    """

    positions: Floats
    forwards: Floats
    half_angles: Floats

    @classmethod
    def of(cls, views: Sequence[View], *, aspect: float) -> CameraPath:
        """Collect views; `aspect` is height / width."""
        return cls(
            settled([view.position for view in views]),
            np.stack([view.forward for view in views]),
            np.array([view.lens.half_diagonal(aspect) for view in views]),
        )

    @classmethod
    def all_round(cls, positions: Floats) -> CameraPath:
        """Eyes at positions, (n, 3) [m], that see in all directions."""
        ahead = np.tile([1.0, 0.0, 0.0], (len(positions), 1))
        return cls(positions, ahead, np.full(len(positions), np.pi))

    @property
    def eyes(self) -> Floats | None:
        """Where the cameras are, (n, 3) [m]; None if they may also look or go anywhere else."""
        anywhere = not len(self.positions) or bool((self.half_angles >= np.pi).any())
        return None if anywhere else self.positions

    def slice(self, part: slice) -> CameraPath:
        """Return some of the times."""
        return CameraPath(self.positions[part], self.forwards[part], self.half_angles[part])


def in_view(camera_path: CameraPath, points: Floats, *, radius: float | Floats) -> Bools:
    """Return which balls can be seen at which times.

    Args:
        camera_path: n times.
        points: Centres, (k, 3) or, one for each time, (k, n, 3) [m].
        radius: Of the balls, shadow included; one, or (k, 1) [m].

    Returns:
        (k, n); also true for what is nearer than `AROUND`.
    """
    return _within(camera_path, points, radius=radius, around=AROUND + radius)


def in_picture(camera_path: CameraPath, points: Floats, *, radius: float | Floats) -> Bools:
    """Return which balls lie in a picture; what is near, but beside or behind, does not count.

    Args:
        camera_path: n times.
        points: Centres, (k, 3) or, one for each time, (k, n, 3) [m].
        radius: Of the balls; one, or (k, 1) [m].

    Returns:
        (k, n).
    """
    return _within(camera_path, points, radius=radius, around=radius)


def _within(
    camera_path: CameraPath, points: Floats, *, radius: float | Floats, around: float | Floats
) -> Bools:
    """Which balls reach into the viewing cone or lie nearer than a distance, (k, n)."""
    centres = points[:, None, :] if points.ndim == 2 else points
    towards = centres - camera_path.positions
    distance = np.linalg.norm(towards, axis=-1)
    with np.errstate(invalid="ignore"):
        cosine = np.einsum("knc,nc->kn", towards, camera_path.forwards) / np.maximum(distance, 1e-9)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        ball = np.arcsin(np.clip(radius / np.maximum(distance, 1e-9), 0.0, 1.0))
        near = settled(distance - around) < 0.0
        return np.asarray(near | (settled(angle - camera_path.half_angles - ball) < 0.0))
