"""Road users stand on the road that is drawn, whatever heights the log gives them.

Their places from above stay SUMO's. Only heights change, and how steeply bodies point up or
down: front and rear of each body stand on the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Trajectory

Rise = Callable[[Floats], Floats]
"""How far the drawn surface lies above points, (n, 3) -> (n,) [m]."""

_AROUND = np.linspace(-0.9, 0.9, 7)
"""Heights are means over these places before and behind a point [m], so that edges of the
surface are felt as tyres and springs feel them; ..."""

_WEIGHTS = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0]) / 16.0

_MOST_OFF = 0.04
"""... but they stay within this distance of the surface [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundedPiece:
    """A stretch of motion on the drawn surface.

    Attributes:
        piece: The stretch at the log's heights.
        rise: How far the drawn surface lies above points.
        length: Of the body [m]; 0 of those that stay upright.
    """

    piece: MotionPiece
    rise: Rise
    length: float

    @property
    def begin(self) -> float:
        """First time at which the road user exists [s]."""
        return self.piece.begin

    @property
    def end(self) -> float:
        """Last time at which it exists [s]."""
        return self.piece.end

    def sample(self, times: Floats) -> Motion:
        """Return motion at times within [begin, end], (n,) [s]."""
        motion = self.piece.sample(times)
        front = motion.positions
        ahead = np.column_stack([np.cos(motion.yaws), np.sin(motion.yaws), np.tan(motion.pitches)])
        ups = self._mean_rise(front, ahead)
        pitches = motion.pitches
        if self.length:
            level = self.length * np.cos(pitches)
            behind = self._mean_rise(front - level[:, None] * ahead, ahead)
            pitches = np.arctan(np.tan(pitches) + (ups - behind) / level)
        return replace(motion, positions=_lifted(front, ups), pitches=pitches)

    def trail(self, times: Floats, distances: Floats) -> Floats:
        """Return points behind the front, (n, k, 3) [m]; see `MotionPiece.trail`."""
        points = self.piece.trail(times, distances)
        flat = points.reshape(-1, 3)
        return _lifted(flat, self.rise(flat)).reshape(points.shape)

    def _mean_rise(self, points: Floats, ahead: Floats) -> Floats:
        """The mean rise around points, (n,) [m], along directions, (n, 3)."""
        around = points[:, None] + _AROUND[:, None] * ahead[:, None]
        rises = self.rise(around.reshape(-1, 3)).reshape(-1, len(_AROUND))
        here = rises[:, len(_AROUND) // 2]
        return np.asarray(here + _MOST_OFF * np.tanh((rises @ _WEIGHTS - here) / _MOST_OFF))


def grounded(trajectory: Trajectory, rise: Rise, *, length: float) -> Trajectory:
    """Return a trajectory on the drawn surface.

    Args:
        trajectory: At the log's heights.
        rise: How far the drawn surface lies above points, (n, 3) -> (n,) [m].
        length: Of the body [m]; 0 of those that stay upright.
    """
    pieces = tuple(GroundedPiece(piece, rise, length) for piece in trajectory.pieces)
    return replace(trajectory, pieces=pieces)


def _lifted(points: Floats, ups: Floats) -> Floats:
    """Points, (n, 3), moved up, (n,) [m]."""
    return np.column_stack([points[:, :2], points[:, 2] + ups])
