"""The centre line along a chain of lanes, its corners rounded.

SUMO's lanes are polylines. An average along their length makes them smooth to the second
derivative, but moves them inward in bends. So the average is taken twice over: what the
first one took away is averaged too, and added ("twicing"). For a polyline all of it has a
closed form: each corner bends the line within reach of it, and nothing else changes.

References:
    J. W. Tukey, Exploratory Data Analysis, 1977, chapter 16 (twicing): 2 K - K * K has no
    second moment, so that arcs stay where they are. The plain triangle of 2 m that shared
    facts on motion, section 5.2, recommend moves a bend of 8 m by 4 cm and costs half the
    heading's accuracy at the same jerk (docs/internals.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.motion.ways import Ways

TIGHTEST, WIDEST = 2.25, 10.0
"""Half the width of the triangle that averages, at corners and at faint bends [m]."""

_BEND = 0.3
"""Width times bend: a corner is cut by a tenth of it, 3 cm, where it is not tight [m]."""

REACH = 2.0 * WIDEST
"""What is further from a bend is as the polyline is [m]."""

_TOUCHING = 1e-6
"""Points of a track at least so far apart [m]."""

_STRAIGHT = 1e-5
"""Fainter bends are none [rad]."""

_GAP = 0.3
"""Lanes whose ends are further apart do not join [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Bends:
    """Corners that are rounded alike.

    Attributes:
        stations: Rising, (n,) [m].
        bends: Change of tangent, (n, 3).
        widths: Half the width of the triangle at each, (n,) [m].
        reach: Twice the largest of them [m].
    """

    stations: Floats
    bends: Floats
    widths: Floats
    reach: float

    def add(self, stations: Floats, points: Floats, tangents: Floats) -> None:
        """Round points and tangents, (m, 3) each, in place."""
        first = np.searchsorted(self.stations, stations - self.reach, side="right")
        last = np.searchsorted(self.stations, stations + self.reach, side="left")
        for step in range(int((last - first).max(initial=0))):
            near = np.flatnonzero(first + step < last)
            corner = first[near] + step
            away = stations[near] - self.stations[corner]
            moved, turned = _rounded(np.abs(away), self.widths[corner])
            bends = self.bends[corner]
            points[near] += moved[:, None] * bends
            tangents[near] += np.where(away < 0.0, -turned, turned)[:, None] * bends


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A rounded polyline over its stations.

    Attributes:
        stations: Strictly increasing, (n,) [m], n >= 2.
        points: (n, 3) [m].
        tangents: Of the stretches, (n - 1, 3).
        bends: At the inner points, tight ones and faint ones.
    """

    stations: Floats
    points: Floats
    tangents: Floats = field(init=False)
    bends: tuple[_Bends, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Derive what every question needs."""
        tangents = np.diff(self.points, axis=0) / np.diff(self.stations)[:, None]
        turned = np.diff(tangents, axis=0)
        size = np.linalg.norm(turned, axis=1)
        widths = np.clip(_BEND / np.maximum(size, 1e-9), TIGHTEST, WIDEST)
        groups = []
        for chosen in (widths == TIGHTEST, (widths > TIGHTEST) & (size > _STRAIGHT)):
            if chosen.any():
                reach = 2.0 * float(widths[chosen].max())
                groups.append(
                    _Bends(self.stations[1:-1][chosen], turned[chosen], widths[chosen], reach)
                )
        object.__setattr__(self, "tangents", tangents)
        object.__setattr__(self, "bends", tuple(groups))

    def corners_at(self, stations: Floats) -> tuple[Floats, Floats]:
        """Points and derivatives of the polyline itself, as SUMO sees it, (m, 3) each."""
        index = np.searchsorted(self.stations[1:-1], stations, side="right")
        tangents = self.tangents[index]
        return self.points[index] + (stations - self.stations[index])[:, None] * tangents, tangents

    def at(self, stations: Floats) -> tuple[Floats, Floats]:
        """Points and derivatives by station, (m, 3) each; straight on beyond both ends."""
        points, tangents = self.corners_at(stations)
        for bends in self.bends:
            bends.add(stations, points, tangents)
        return points, tangents


def _rounded(away: Floats, widths: Floats) -> tuple[Floats, Floats]:
    """What rounding adds to a ramp that begins at 0 by distance from there, and its rate, (n,).

    A ramp averaged with the B-spline of order 2 or 4 (the triangle, and the triangle
    twice) exceeds itself by truncated powers of the distance.
    """
    share = away / widths
    near, far = np.maximum(1.0 - share, 0.0), np.maximum(2.0 - share, 0.0)
    moved = near**3 / 3.0 - (far**5 - 4.0 * near**5) / 120.0
    turned = (far**4 - 4.0 * near**4) / 24.0 - near**2
    return widths * moved, turned


def track_along(ways: Ways, lanes: Sequence[tuple[str, float]]) -> Track:
    """The centre line along lanes.

    Lanes that do not join are joined by straight lines over twice the gap to both sides.

    Args:
        ways: The lanes.
        lanes: Each lane and the station of its beginning, in order.
    """
    stations = [ways.stations(name) + begin for name, begin in lanes]
    points = [ways.lane(name).shape for name, _ in lanes]
    for number in range(len(lanes) - 1):
        gap = float(np.linalg.norm(points[number + 1][0, :2] - points[number][-1, :2]))
        if gap > _GAP:
            _join(stations, points, number, trim=2.0 * gap)
    along = np.concatenate(stations)
    # Where one lane ends the next begins; of two points at one station the first counts.
    kept = np.concatenate([[True], along[1:] > np.maximum.accumulate(along)[:-1] + _TOUCHING])
    return Track(along[kept], np.concatenate(points)[kept])


def _join(stations: list[Floats], points: list[Floats], number: int, *, trim: float) -> None:
    """Cut both lanes at a joint, by no more than half of each."""
    for lane, begin in ((number, True), (number + 1, False)):
        along, shape = stations[lane], points[lane]
        cut = min(trim, (along[-1] - along[0]) / 2.0)
        at = along[-1] - cut if begin else along[0] + cut
        spot = np.array([[np.interp(at, along, axis) for axis in shape.T]])
        kept = along < at if begin else along > at
        parts = ([along[kept], [at]], [shape[kept], spot])
        stations[lane], points[lane] = (np.concatenate(p if begin else p[::-1]) for p in parts)
