"""Steps of people: how far they have walked tells which phase of a stride they show."""

from __future__ import annotations

import numpy as np

_RISE = 0.02
"""Half of a head's way up and down [m]: 3 to 5 cm in all at 1 to 1.5 m/s (Thorstensson, Nilsson,
Carlson and Zomlefer, Acta Physiologica Scandinavica 121, 1984)."""

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


def head_rise(phase: float, share: float) -> float:
    """Return how much higher a walking head is than on average [m]: twice in a stride up and down.

    Args:
        phase: Of the stride, [0, 1); at 0 a heel strikes, and the head is lowest.
        share: How much of a stride is shown, [0, 1].
    """
    return float(-_RISE * share * np.cos(4.0 * np.pi * phase))


def effort(speed: float) -> float:
    """Return how much of a stride is shown at a speed [m/s]: 0 standing, 1 walking."""
    return float(np.clip(speed / _FULL_SPEED, 0.0, 1.0))
