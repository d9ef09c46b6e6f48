"""Cubic Hermite curves through the samples, with the logged speeds and angles.

This smoother needs no network. SUMO's angle is the direction of the chord from the rear to the
front. In a bend the front's own direction is turned further, by half the body's length times
the curvature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.motion.curves import Hermite, monotone_slopes
from sumo3dviz_pt.motion.samples import LoggedSamples
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.along import run_along
from sumo3dviz_pt.motion.smoothers.front import Front, FrontMotion
from sumo3dviz_pt.motion.smoothers.registry import register

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
    for at, given in ((0, first), (-1, last)):
        if given is not None:
            slopes[at] = given
    return CurveFront(Hermite(samples.times, samples.positions, slopes))


def _directions(samples: LoggedSamples, stations: Floats, *, length: float) -> Floats:
    """Return unit vectors in which the front moves at the samples, (n, 2)."""
    kept = np.concatenate([[0], 1 + np.flatnonzero(np.diff(stations) > _SHORT)])
    yaws = samples.yaws
    if len(kept) > 2:
        bends = np.gradient(yaws[kept], stations[kept])
        lead = np.interp(stations, stations[kept], bends) * length / 2.0
        yaws = yaws + np.clip(lead, -_LARGEST_LEAD, _LARGEST_LEAD)
    ahead = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
    around = np.gradient(samples.positions[:, :2], axis=0)
    backward = (around * ahead).sum(axis=1) < 0.0
    return np.where(backward[:, None], -ahead, ahead)
