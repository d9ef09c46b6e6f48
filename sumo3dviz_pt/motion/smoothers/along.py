"""How far along its path a road user is at any time.

The distance along the path, the station, is a cubic Hermite curve over time. Its slopes are the
logged speeds where these are rates, else those of the spline through the stations. They are
limited so that nothing rolls back, creeps while it stands, or overshoots.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.curves import Hermite, forward_slopes, smooth_slopes

_RESTING = 0.05
"""A road user that is logged slower than this rests [m/s]."""

_CREEPING = 0.3
"""A vehicle that drives slower than this after a hard stop has stopped [m/s]."""

_HARDEST = 12.0
"""No vehicle brakes or sets off harder than this [m/s2]."""

_HARD = 5.0
"""A vehicle that would brake harder than this to stop at a sample stops half a step later,
if it then brakes less hard [m/s2]."""

_APART = 0.02
"""Shortest time between a sample and a moment at which a rest begins or ends [s]."""


def run_along(
    times: Floats,
    stations: Floats,
    speeds: Floats,
    *,
    euler: bool,
    rests: tuple[bool, bool] = (False, False),
) -> Hermite:
    """Return a smooth, never falling station over time.

    Args:
        times: Times of the samples, strictly increasing, (n,) [s], n >= 2.
        stations: Stations of the samples, never falling, (n,) [m].
        speeds: Logged speeds, (n,) [m/s]; if one is not finite, none is used.
        euler: Whether the speeds are backward differences, not rates.
        rests: Whether the motion begins, and whether it ends, at rest.
    """
    rates = np.diff(stations) / np.diff(times)
    known = not euler and bool(np.isfinite(speeds).all())
    slopes = forward_slopes(speeds if known else smooth_slopes(times, stations), rates)
    slopes[[0, -1]] = np.where(rests, 0.0, slopes[[0, -1]])
    return Hermite(times, stations, slopes)


def with_rests(made: Hermite, speeds: Floats, *, euler: bool) -> Hermite:
    """Return the same curve with the moments between samples at which a rest begins or ends.

    A vehicle that passes a sample at speed v and comes to rest a distance d further on stops
    2 d / v after that sample if it brakes evenly. Setting off is the same in reverse. Where the
    speeds are not rates they do not tell these moments; then only a stop that would need
    too hard braking is put half a step later.

    Args:
        made: Stations over time, from `run_along`.
        speeds: Logged speeds of the samples, (n,) [m/s].
        euler: Whether the speeds are backward differences, not rates.
    """
    if euler or not np.isfinite(speeds).all():
        return _late(made)
    # Find the steps in which one end rests and the other moves.
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
    # The moving end gets its logged speed; the step on its other side still limits that.
    rates = lengths / np.diff(times)
    padded = np.concatenate([rates[:1], rates, rates[-1:]])
    slopes = made.slopes.copy()
    slopes[:-1][stops] = np.minimum(speeds[:-1], 3.0 * padded[:-2])[stops]
    slopes[1:][starts] = np.minimum(speeds[1:], 3.0 * padded[2:])[starts]
    # From the moment of rest on nothing moves, even where the log creeps.
    slopes[1:][stops] = slopes[:-1][starts] = 0.0
    # Add the moments of rest as knots.
    moments = np.concatenate([times[:-1][stops] + taken[stops], times[1:][starts] - taken[starts]])
    places = np.concatenate([stations[1:][stops], stations[:-1][starts]])
    return _with_knots(Hermite(times, stations, slopes), moments, places)


def _late(made: Hermite) -> Hermite:
    """Return the same curve with stops half a step later where they would brake too hard.

    In one step of SUMO's Euler integration a vehicle drives at speed v, and in the next it
    stands. To show exactly that it would brake at 2 v / dt or more. Braking evenly from the
    middle of the step to the middle of the next, at v / dt as SUMO simulated it, the vehicle is
    v dt / 8 short of its position at the sample.
    """
    times, stations = made.knots, made.values
    if len(times) < 3:
        return made
    # Find the samples at which a vehicle stops too hard.
    steps = np.diff(times)
    rates = np.diff(stations) / steps
    braking = rates[:-1] / steps[:-1]
    hard = (2.0 * braking > _HARD) & (braking < _HARD) & (rates[1:] < _CREEPING)
    # A vehicle that also sets off within that step only moves up in a queue.
    hard[0] = False
    hard[1:] &= rates[:-2] > rates[1:-1] / 2.0
    stops = 1 + np.flatnonzero(hard & (steps[1:] >= steps[:-1] - _APART))
    if not len(stops):
        return made
    # Let it brake from the middle of one step to the middle of the next.
    speed, step = rates[stops - 1], steps[stops - 1]
    short = stations.copy()
    short[stops] -= speed * step / 8.0
    slopes = forward_slopes(smooth_slopes(times, short), np.diff(short) / steps)
    slopes[[0, -1]] = made.slopes[[0, -1]]
    slopes[stops], slopes[stops + 1] = speed / 2.0, 0.0
    return _with_knots(Hermite(times, short, slopes), times[stops] + step / 2.0, stations[stops])


def _with_knots(made: Hermite, moments: Floats, places: Floats) -> Hermite:
    """Return the same curve with further knots at which it rests."""
    order = np.argsort(np.concatenate([made.knots, moments]), kind="stable")
    rest = np.zeros(len(moments))
    pairs = ((made.knots, moments), (made.values, places), (made.slopes, rest))
    return Hermite(*(np.concatenate(pair)[order] for pair in pairs))
