"""Whether it is so dark that lamps are lit."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.job.settings import Lights
from sumo3dviz_pt.model.scene import Sky

LIGHTING_UP = float(np.radians(-1.0))
"""Elevation of the sun below which lamps are lit [rad]: about 300 lx are left."""


def is_dark(sky: Sky, lights: Lights = "auto") -> bool:
    """Return whether lamps are lit and light something.

    Args:
        sky: The environment; one from a file has no sun and counts as day.
        lights: The scene file's word: `auto` goes by the sun.
    """
    if lights != "auto":
        return lights == "on"
    return sky.sun_direction is not None and float(sky.sun_direction[2]) < np.sin(LIGHTING_UP)
