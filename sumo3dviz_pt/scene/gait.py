"""Steps of people: how far they have walked tells which phase of a stride they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Piece

_STEP = 0.1
"""Between the places that are added up [s]."""

_FULL_SPEED = 0.5
"""From this speed on people show whole strides; slower ones smaller ones [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Walk:
    """How far somebody has walked.

    Attributes:
        times: Increasing, (n,) [s].
        distances: Walked since the first one, (n,) [m].
    """

    times: Floats
    distances: Floats

    @classmethod
    def of(cls, piece: Piece) -> Walk:
        """Add up the way of a stretch of motion."""
        count = max(2, int(np.ceil((piece.end - piece.begin) / _STEP)) + 1)
        times = np.linspace(piece.begin, piece.end, count)
        steps = np.linalg.norm(np.diff(piece.sample(times).positions[:, :2], axis=0), axis=1)
        return cls(times, np.concatenate([[0.0], np.cumsum(steps)]))

    def phase(self, time: float, *, stride: float, start: float) -> float:
        """Phase of the stride at a time [s], [0, 1).

        Args:
            time: Within the walk [s].
            stride: Length of two steps [m], > 0.
            start: Phase at the walk's beginning, so that not all walk in step.
        """
        return float((start + np.interp(time, self.times, self.distances) / stride) % 1.0)


def effort(speed: float) -> float:
    """How much of a stride is shown at a speed [m/s]: 0 standing, 1 walking."""
    return float(np.clip(speed / _FULL_SPEED, 0.0, 1.0))
