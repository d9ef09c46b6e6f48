"""Pieces of motion whose path is known exactly: a straight line, then a circle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.trajectory import Motion


@dataclass(frozen=True)
class PathPiece:
    """A front that goes at a speed along a line which bends into a circle.

    Attributes:
        speed: At the begin [m/s].
        curvature: From the way 0 on, positive to the left [1/m]; before, the path is straight.
        start: Where on the path the piece begins [m]; far after 0, all is a circle.
        grade: Climb per metre.
        length: Of the chord that tells the heading [m].
        gain: Acceleration [m/s^2].
    """

    speed: float = 10.0
    curvature: float = 0.0
    start: float = 0.0
    grade: float = 0.0
    length: float = 5.0
    gain: float = 0.0
    begin: float = 0.0
    end: float = 20.0
    yaw: float = 0.0

    def way(self, times):
        """Since the begin [m]."""
        since = np.asarray(times) - self.begin
        return self.speed * since + 0.5 * self.gain * since**2

    def point(self, ways):
        """Points of the path, (..., 3) [m]."""
        ways = np.asarray(ways, dtype=float)
        bent, straight = np.maximum(ways, 0.0), np.minimum(ways, 0.0)
        k = self.curvature
        x, y = (bent, 0.0 * bent) if k == 0 else (np.sin(k * bent) / k, (1 - np.cos(k * bent)) / k)
        x = x + straight
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.stack([c * x - s * y, s * x + c * y, self.grade * ways], axis=-1)

    def sample(self, times):
        times = np.asarray(times, dtype=float)
        ways = self.way(times)
        at = self.start + ways
        fronts = self.point(at)
        chord = fronts - self.point(at - self.length)
        return Motion(
            np.ones(len(times), dtype=bool),
            fronts,
            np.arctan2(chord[:, 1], chord[:, 0]),
            np.arctan2(chord[:, 2], np.hypot(chord[:, 0], chord[:, 1])),
            self.speed + self.gain * (times - self.begin),
            ways,
        )

    def trail(self, times, distances):
        at = self.start + self.way(np.asarray(times, dtype=float))
        return self.point(at[:, None] - np.asarray(distances)[None])
