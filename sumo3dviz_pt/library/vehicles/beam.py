"""The low beam of a head lamp, as a map of luminous intensity.

Only its upper edge is sharp. To the sides it fades over tens of degrees. Downwards it falls so
fast that the road gets about 10 to 15 lx from 2 to 10 m ahead, and less nearer to the car.

References:
    UN Regulation No. 112, class B, tables of the passing beam: the limits at the points that
    tests/unit/library/vehicles/test_beam.py checks.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.model.geometry import Floats, Image

PEAK = 18_000.0
"""Largest intensity of one lamp [cd]: usual for halogen and LED lamps on the market."""

HALF_ANGLE = float(np.radians(52.0))
"""From straight ahead to the map's edge [rad]."""

_FADE = (34.0, 51.0)
"""Between these angles from straight ahead all light fades out [deg]."""

_CUTOFF = -0.57
"""Below straight ahead: one per cent [deg]."""


def low_beam(across: Floats, up: Floats) -> Floats:
    """Return the luminous intensity of one lamp in right-hand traffic.

    Args:
        across: Angles to the right of straight ahead [deg].
        up: Angles above straight ahead, of the same shape [deg].

    Returns:
        [cd], of that shape.
    """
    rise = np.clip(across * np.tan(np.radians(15.0)), 0.0, 2.0)
    below = _CUTOFF + rise - up
    edge = smoothstep(0.0, 0.25, below)
    deep = np.maximum(below, 0.0)
    depth = 0.8 * np.exp(-deep / 2.2) + 0.2 * np.exp(-deep / 5.0)
    spread = 0.6 * np.exp(-((across / 7.0) ** 2)) + 0.4 * np.exp(-((across / 26.0) ** 2))
    # Less light goes to the left, where oncoming drivers sit.
    shielded = 1.0 - 0.42 / (1.0 + np.exp((across + 1.5) / 0.5))
    stray = 170.0 * np.exp(-np.abs(below) / 5.0) * np.exp(-((across / 26.0) ** 2))
    return np.asarray((PEAK * edge * depth * spread * shielded + stray) * _faded(across, up))


def beam_pattern(size: int = 1024, *, left_hand: bool = False) -> Image:
    """Return the beam as a share of its peak on a grid of equal steps of the angles' tangents.

    Args:
        size: Rows and columns; rows from above to below, columns from left to right.
        left_hand: Whether oncoming traffic is on the right.

    Returns:
        (size, size), in [0, 1].
    """
    edge = np.tan(HALF_ANGLE)
    steps = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    right, high = np.meshgrid(edge * steps, -edge * steps)
    across = np.degrees(np.arctan(right))
    up = np.degrees(np.arctan2(high, np.hypot(1.0, right)))
    pattern = low_beam(-across if left_hand else across, up) / PEAK
    return np.asarray(pattern, dtype=np.float32)


def _faded(across: Floats, up: Floats) -> Floats:
    """How much of the light is left at an angle from straight ahead, [0, 1]."""
    cosine = np.cos(np.radians(across)) * np.cos(np.radians(up))
    low, high = _FADE
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return 1.0 - smoothstep(low, high, angle)
