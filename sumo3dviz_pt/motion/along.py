"""How far along its way a road user is at any time.

References:
    shared facts on motion, section 5.3: cubic Hermite with the logged speeds where they
    are rates, else with the slopes of the spline through the places; limited, so that
    nobody ever rolls back, creeps while standing or overshoots.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.curves import Hermite, forward_slopes, smooth_slopes


def run_along(times: Floats, stations: Floats, speeds: Floats, *, euler: bool) -> Hermite:
    """A smooth, never falling arc length through samples.

    Args:
        times: Strictly increasing, (n,) [s], n >= 2.
        stations: Never falling, (n,) [m].
        speeds: (n,) [m/s]; one that is not finite makes all of them unknown.
        euler: Whether the speeds are no rates.
    """
    rates = np.diff(stations) / np.diff(times)
    known = not euler and bool(np.isfinite(speeds).all())
    slopes = speeds if known else smooth_slopes(times, stations)
    return Hermite(times, stations, forward_slopes(slopes, rates))
