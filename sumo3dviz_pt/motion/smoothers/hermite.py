"""Straight lines and cubic Hermite curves through the samples, and the way along a path.

Straight lines at constant speed are the baseline for other smoothers. Hermite curves take the
logged speeds and angles, and need no network. SUMO's angle is the direction of the chord from the
rear to the front. In a bend the front's own direction is turned further, by half the body's length
times the curvature.

The station, the distance along the path, is a cubic Hermite curve over time. Its slopes are the
logged speeds where these are rates, else those of the spline through the stations. They are limited
so that nothing rolls back, creeps while it stands, or overshoots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.front import (
    Front,
    FrontMotion,
    Hermite,
    forward_slopes,
    monotone_slopes,
    smooth_slopes,
)
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.registry import register

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


@dataclass(frozen=True, slots=True, eq=False)
class LinearFront:
    """The front on straight lines.

    Attributes:
        times: (n,) [s].
        positions: (n, 3) [m].
        remarks: What was noticed.
    """

    times: Floats
    positions: Floats
    remarks: tuple[Remark, ...] = ()

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return float(self.times[-1])

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        rates = np.diff(self.positions, axis=0) / np.diff(self.times)[:, None]
        index = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(rates) - 1)
        positions = self.positions[index] + (times - self.times[index])[:, None] * rates[index]
        return FrontMotion(positions, np.linalg.norm(rates[index], axis=1))


@register("linear")
def linear(samples: LoggedSamples, setting: Setting) -> Front:
    """Join samples by straight lines."""
    del setting  # only positions count
    return LinearFront(samples.times, samples.positions)


_LARGEST_LEAD = np.radians(30.0)
"""Largest angle between the body's heading and the direction of its front [rad]."""

_SHORT = 0.2
"""Samples nearer to one another than this say nothing about a bend [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class CurveFront:
    """The front on a curve through its samples.

    Attributes:
        curve: Positions over time.
        remarks: What was noticed.
    """

    curve: Hermite
    remarks: tuple[Remark, ...] = ()

    @property
    def begin(self) -> float:
        """First sample's time [s]."""
        return float(self.curve.knots[0])

    @property
    def end(self) -> float:
        """Last sample's time [s]."""
        return float(self.curve.knots[-1])

    def at(self, times: Floats) -> FrontMotion:
        """Return where the front is at times within [begin, end], (n,) [s]."""
        positions, rates = self.curve.at(times)
        return FrontMotion(positions, np.linalg.norm(rates, axis=1))


@register("hermite")
def hermite(samples: LoggedSamples, setting: Setting) -> Front:
    """Join samples by curves."""
    return bridge(samples, setting)


def bridge(
    samples: LoggedSamples,
    setting: Setting,
    *,
    first: Floats | None = None,
    last: Floats | None = None,
) -> CurveFront:
    """Join samples by curves whose velocities at both ends may be given.

    Args:
        samples: n samples, n >= 2.
        setting: Says what the speeds mean and how long the body is.
        first: Velocity at the first sample, (3,) [m/s]; None takes what the log says.
        last: Velocity at the last sample, (3,) [m/s]; None takes what the log says.
    """
    # Level velocities: speed along the samples times direction.
    steps = np.diff(samples.positions[:, :2], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    stations = np.concatenate([[0.0], np.cumsum(lengths)])
    along = run_along(
        samples.times, stations, samples.speeds, euler=setting.euler, rests=setting.rests
    )
    ahead = _directions(samples, stations, length=setting.length)
    slopes = np.empty_like(samples.positions)
    slopes[:, :2] = along.slopes[:, None] * ahead
    slopes[:, 2] = monotone_slopes(samples.times, samples.positions[:, 2])
    # A road user that enters or leaves the log on a slope climbs there already.
    grades = np.diff(samples.positions[:, 2]) / np.maximum(lengths, 1e-9)
    slopes[[0, -1], 2] = along.slopes[[0, -1]] * grades[[0, -1]]
    for at, velocity in ((0, first), (-1, last)):
        if velocity is not None:
            slopes[at] = velocity
    return CurveFront(Hermite(samples.times, samples.positions, slopes))


def _directions(samples: LoggedSamples, stations: Floats, *, length: float) -> Floats:
    """Return unit vectors in which the front moves at the samples, (n, 2)."""
    apart = np.concatenate([[0], 1 + np.flatnonzero(np.diff(stations) > _SHORT)])
    yaws = samples.yaws
    if len(apart) > 2:
        bends = np.gradient(yaws[apart], stations[apart])
        lead = np.interp(stations, stations[apart], bends) * length / 2.0
        yaws = yaws + np.clip(lead, -_LARGEST_LEAD, _LARGEST_LEAD)
    ahead = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    around = np.gradient(samples.positions[:, :2], axis=0)
    backward = (around * ahead).sum(axis=1) < 0.0
    return np.where(backward[:, None], -ahead, ahead)
