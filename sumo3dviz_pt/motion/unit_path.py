"""The path that units of a vehicle follow: the driven one, straighter where the log is straight.

SUMO's vehicles change lanes without turning. In a jam, the path of such a change lies across the
lanes, and a lorry's short tractor on it would stand across them, too. So each step of the path
is turned to within some degrees of the angles that are logged around it. Chords of such a path
keep within the same degrees, whatever the units' lengths, and units still turn only as they drive.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.alignment import STEADY
from sumo3dviz_pt.motion.driven import Driven
from sumo3dviz_pt.motion.samples import LoggedSamples, wrapped

_MOST = np.radians(18.0)
"""Where the angles logged around it are steady, the path is no farther from any of them [rad]."""

_LOOSER = 6.0
"""It may be this many times farther as they differ by more than that: in bends it is as driven."""

_AROUND = 0.5
"""The angle of each place is logged while the body is over it, and this many lengths about it."""

_FAR = 100.0
"""Longer than any vehicle on a road [m]."""

_PARTS = 17
"""Number of points of a step that is turned, or is beside one."""

_POINT = 1e-6
"""Shorter steps lead nowhere [m]."""


@dataclass(frozen=True, eq=False)
class UnitPath:
    """A path that is straighter than the driven one, as seen from its end.

    Attributes:
        driven: The driven path.
        samples: What is logged.
        length: Length over which the body follows its front [m].
    """

    driven: Driven
    samples: LoggedSamples
    length: float

    @cached_property
    def shifts(self) -> tuple[Floats, Floats] | None:
        """How far it has led aside from the driven one; None where it is the same.

        Distances travelled, rising, (n,) [m], and what was gained by then, (n, 2) [m]. Only of
        vehicles that bend does anybody ask.
        """
        driven = self.driven
        ways = np.concatenate(
            [driven.past_travelled[:1] - _FAR, driven.past_travelled[:-1], driven.travelled]
        )
        gained = _gained(ways, driven, self.samples, self.length)
        if not gained.any():
            return None
        # Between two knots a quick move aside is bent, so look there more closely.
        turned = np.convolve(gained.any(axis=1), [1, 1, 1], mode="same") > 0
        parts = np.linspace(ways[:-1][turned], ways[1:][turned], _PARTS).ravel()
        ways = np.union1d(ways, parts)
        gained = _gained(ways, driven, self.samples, self.length)
        return ways, np.concatenate([np.zeros((1, 2)), np.cumsum(gained, axis=0)])

    def straightened(self, points: Floats, travelled: Floats, ways: Floats) -> Floats:
        """Return points of the driven path as units follow it from a front that stays.

        Args:
            points: Of k places on each of n paths, (n, k, 3) [m].
            travelled: Distances that the fronts have travelled, (n,) [m].
            ways: Distances travelled at the points, (n, k) [m].
        """
        if self.shifts is None:
            return points
        known, shifts = self.shifts
        moved = points.copy()
        for axis, values in enumerate(shifts.T):
            aside = np.interp(travelled, known, values)[:, None]
            moved[..., axis] -= aside - np.interp(ways, known, values)
        return moved


def _gained(ways: Floats, driven: Driven, samples: LoggedSamples, length: float) -> Floats:
    """Return what each step of a path gains as it is turned to where the log heads.

    Args:
        ways: Distances travelled at the ends of n - 1 steps, rising, (n,) [m].
        driven: The driven path.
        samples: What is logged.
        length: Length over which the body follows its front [m].

    Returns:
        Aside and ahead, (n - 1, 2) [m]; 0 where it stays.
    """
    steps = np.diff(driven.points_at(ways)[:, :2], axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    middle, most = _logged_around(ways, driven, samples, length)
    away = wrapped(np.arctan2(steps[:, 1], steps[:, 0]) - middle)
    kept = middle + np.clip(away, -most, most)
    straight = lengths[:, None] * np.column_stack([np.cos(kept), np.sin(kept)])
    far = (np.abs(away) > most) & (lengths > _POINT)
    return np.where(far[:, None], straight - steps, 0.0)


def _logged_around(
    ways: Floats, driven: Driven, samples: LoggedSamples, length: float
) -> tuple[Floats, Floats]:
    """Return the middle of the angles logged around each step, and how far it may be from it.

    Args:
        ways: Distances travelled at the ends of n - 1 steps, rising, (n,) [m].
        driven: The driven path.
        samples: What is logged.
        length: Length over which the body follows its front [m].

    Returns:
        Both (n - 1,) [rad].
    """
    known = np.interp(samples.times, driven.knots, driven.travelled)
    # An angle is the chord's, so it tells of the path one length back.
    first = np.searchsorted(known, ways[:-1] - _AROUND * length, side="right") - 1
    last = np.searchsorted(known, ways[1:] + (1.0 + _AROUND) * length) + 1
    spans = np.column_stack([np.maximum(first, 0), np.minimum(last, len(known))]).ravel()
    # One more, because the end of a span is an index, too.
    yaws = np.append(samples.yaws, samples.yaws[-1])
    low, high = np.minimum.reduceat(yaws, spans)[::2], np.maximum.reduceat(yaws, spans)[::2]
    spread = high - low
    most = _MOST - spread / 2.0 + _LOOSER * np.maximum(spread - STEADY, 0.0)
    return (low + high) / 2.0, most
