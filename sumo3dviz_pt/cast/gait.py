"""Steps of people: how far they have walked tells which phase of a stride they show."""

from __future__ import annotations

import numpy as np

_FULL_SPEED = 0.5
"""From this speed on people show whole strides; slower ones smaller ones [m/s]."""


def stride_phase(travelled: float, *, stride: float, start: float) -> float:
    """Return the phase of the stride, [0, 1): it depends on the way only, so that no foot slides.

    Args:
        travelled: How far a person has walked [m].
        stride: Length of two steps [m], > 0.
        start: Phase at the walk's beginning, so that not all walk in step.
    """
    return float((start + travelled / stride) % 1.0)


def effort(speed: float) -> float:
    """Return how much of a stride is shown at a speed [m/s]: 0 standing, 1 walking."""
    return float(np.clip(speed / _FULL_SPEED, 0.0, 1.0))
