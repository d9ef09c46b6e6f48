"""Colours of speeds, from slow to fast: red, orange, yellow, light blue, blue.

People who do not tell red from green tell these apart; the ends are the traffic engineer's habit
that red is slow.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.job.overlays import SpeedScale
from sumo3dviz_pt.overlays.canvas import Rgba

_STEPS = np.array(
    # red, green, blue
    [
        [214, 40, 40],
        [247, 127, 0],
        [252, 211, 77],
        [125, 190, 230],
        [40, 110, 200],
    ],
    dtype=np.float64,
)


def speed_colour(speed: float, scale: SpeedScale, *, alpha: float = 1.0) -> Rgba:
    """Return the colour of a speed.

    Args:
        speed: [m/s]; beyond the scale the colours of its ends hold.
        scale: Between which speeds colours run.
        alpha: Opacity, [0, 1].
    """
    share = (speed - scale.slowest) / (scale.fastest - scale.slowest)
    place = float(np.clip(np.nan_to_num(share), 0.0, 1.0)) * (len(_STEPS) - 1)
    red, green, blue = (
        round(float(np.interp(place, np.arange(len(_STEPS)), _STEPS[:, channel])))
        for channel in range(3)
    )
    return red, green, blue, round(255 * alpha)
