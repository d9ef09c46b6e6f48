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

_RESTING = 0.05
"""Who is logged slower rests [m/s]."""

_CREEPING = 0.3
"""Nor does who drives so slowly after a stop drive on [m/s]."""

_HARDEST = 12.0
"""Nobody brakes or sets off harder [m/s2]."""

_HARD = 5.0
"""Who would brake harder to stop with a sample, and less if half a step later, does so [m/s2]."""

_APART = 0.02
"""Moments of rest lie at least so long after or before a sample [s]."""


def run_along(
    times: Floats,
    stations: Floats,
    speeds: Floats,
    *,
    euler: bool,
    rests: tuple[bool, bool] = (False, False),
) -> Hermite:
    """A smooth, never falling arc length through samples.

    Args:
        times: Strictly increasing, (n,) [s], n >= 2.
        stations: Never falling, (n,) [m].
        speeds: (n,) [m/s]; one that is not finite makes all of them unknown.
        euler: Whether the speeds are no rates.
        rests: Whether it begins and ends at rest.
    """
    rates = np.diff(stations) / np.diff(times)
    known = not euler and bool(np.isfinite(speeds).all())
    slopes = forward_slopes(speeds if known else smooth_slopes(times, stations), rates)
    slopes[[0, -1]] = np.where(rests, 0.0, slopes[[0, -1]])
    return Hermite(times, stations, slopes)


def with_rests(made: Hermite, speeds: Floats, *, euler: bool) -> Hermite:
    """The same with the moments between samples at which somebody comes to rest or sets off.

    At a constant deceleration that is 2 d / v after the sample of speed v, d before the
    place of rest; and likewise where it sets off. Speeds that are no rates tell nothing,
    but where a stop would brake too hard it comes half a step late.

    Args:
        made: From `run_along`.
        speeds: Of the samples, (n,) [m/s].
        euler: Whether the speeds are no rates.
    """
    if euler or not np.isfinite(speeds).all():
        return _late(made)
    times, stations = made.knots, made.values
    rest = speeds < _RESTING
    moving = np.where(rest[1:], speeds[:-1], speeds[1:])
    lengths = np.diff(stations)
    alone = (rest[1:] != rest[:-1]) & (moving > _RESTING) & (lengths > 0.0)
    taken = 2.0 * lengths / np.where(alone, moving, 1.0)
    alone &= (taken < np.diff(times) - _APART) & (taken > _APART) & (moving < _HARDEST * taken)
    stops, starts = alone & rest[1:], alone & rest[:-1]
    if not alone.any():
        return made
    rates = lengths / np.diff(times)
    padded = np.concatenate([rates[:1], rates, rates[-1:]])
    slopes = made.slopes.copy()
    # The limit of the other side stays.
    slopes[:-1][stops] = np.minimum(speeds[:-1], 3.0 * padded[:-2])[stops]
    slopes[1:][starts] = np.minimum(speeds[1:], 3.0 * padded[2:])[starts]
    # Who creeps at rest must not roll back from the moment of rest.
    slopes[1:][stops] = slopes[:-1][starts] = 0.0
    moments = np.concatenate([times[:-1][stops] + taken[stops], times[1:][starts] - taken[starts]])
    places = np.concatenate([stations[1:][stops], stations[:-1][starts]])
    return _with_knots(Hermite(times, stations, slopes), moments, places)


def _late(made: Hermite) -> Hermite:
    """The same, but who would have to brake harder than anyone does stops half a step late.

    In a step of SUMO's Euler integration a vehicle drives at speed v and then stands. To
    meet that it would brake at 2 v / dt or more; braking evenly from the middle of the
    step to the middle of the next, at v / dt as it was simulated, it is v dt / 8 short of
    its place at the sample.
    """
    times, stations = made.knots, made.values
    if len(times) < 3:
        return made
    steps = np.diff(times)
    rates = np.diff(stations) / steps
    braking = rates[:-1] / steps[:-1]
    hard = (2.0 * braking > _HARD) & (braking < _HARD) & (rates[1:] < _CREEPING)
    # Who also sets off within that step only draws up.
    hard[0] = False
    hard[1:] &= rates[:-2] > rates[1:-1] / 2.0
    stops = 1 + np.flatnonzero(hard & (steps[1:] >= steps[:-1] - _APART))
    if not len(stops):
        return made
    speed, step = rates[stops - 1], steps[stops - 1]
    short = stations.copy()
    short[stops] -= speed * step / 8.0
    slopes = forward_slopes(smooth_slopes(times, short), np.diff(short) / steps)
    slopes[[0, -1]] = made.slopes[[0, -1]]
    slopes[stops], slopes[stops + 1] = speed / 2.0, 0.0
    return _with_knots(Hermite(times, short, slopes), times[stops] + step / 2.0, stations[stops])


def _with_knots(made: Hermite, moments: Floats, places: Floats) -> Hermite:
    """The same with further knots at which it rests."""
    order = np.argsort(np.concatenate([made.knots, moments]), kind="stable")
    rest = np.zeros(len(moments))
    pairs = ((made.knots, moments), (made.values, places), (made.slopes, rest))
    return Hermite(*(np.concatenate(pair)[order] for pair in pairs))
