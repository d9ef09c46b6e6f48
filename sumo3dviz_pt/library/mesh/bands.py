"""Painted bands along a polyline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.polyline import mitres
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.vectors import arc_length


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """A strip of constant width beside a polyline.

    Attributes:
        right: Right edge, (n, 3) [m].
        left: Left edge, (n, 3) [m].
        stations: Where each vertex lies along a reference line, (n,) [m], increasing.
    """

    right: Floats
    left: Floats
    stations: Floats

    def quads(self, start: float, end: float) -> Floats:
        """Cut quads between two stations.

        Args:
            start: [m], clamped.
            end: [m], clamped.

        Returns:
            Corners counter-clockwise from the right edge's start, (k, 4, 3) [m];
            k is 0 where nothing lies between.
        """
        low, high = max(start, self.stations[0]), min(end, self.stations[-1])
        if high - low < 0.02:
            return np.zeros((0, 4, 3))
        inner = self.stations[(self.stations > low + 1e-6) & (self.stations < high - 1e-6)]
        at = np.concatenate([[low], inner, [high]])
        found = np.empty((len(at) - 1, 4, 3))
        for line, first, second in ((self.right, 0, 1), (self.left, 3, 2)):
            for axis in range(3):
                values = np.interp(at, self.stations, line[:, axis])
                found[:, first, axis], found[:, second, axis] = values[:-1], values[1:]
        return found

    def dashes(self, *, dash: float, gap: float) -> Floats:
        """Cut the quads of a dashed line, (k, 4, 3) [m]; it starts with half a gap.

        Args:
            dash: [m], > 0.
            gap: [m], > 0.
        """
        starts = np.arange(self.stations[0] + 0.5 * gap, self.stations[-1], dash + gap)
        pieces = [self.quads(start, start + dash) for start in starts]
        return np.concatenate([np.zeros((0, 4, 3)), *pieces])

    def whole(self) -> Floats:
        """Cut the quads of the whole band, (k, 4, 3) [m]."""
        return self.quads(self.stations[0], self.stations[-1])


def band_along(line: Floats, *, right: float, left: float, reference: Floats | None = None) -> Band:
    """Lay a band beside a line.

    Args:
        line: Vertices without repeats, (n, 3) [m], n >= 2.
        right: Lateral place of its right edge, positive to the left [m].
        left: Lateral place of its left edge, > right [m].
        reference: A line with as many vertices along which stations are measured,
            so that dashes on several lines stay side by side; None is the line itself.
    """
    across = np.column_stack([mitres(line), np.zeros(len(line))])
    measured = line if reference is None or len(reference) != len(line) else reference
    stations = np.maximum.accumulate(arc_length(measured[:, :2]) + np.arange(len(line)) * 1e-9)
    return Band(line + right * across, line + left * across, stations)


def on_lane(points: Floats, middle: Floats) -> Floats:
    """Carry points from a lane's own plane onto it.

    Args:
        points: Station along it and offset to the left, (..., 2) [m].
        middle: Its middle line, (n, 3) [m], n >= 2.

    Returns:
        (..., 3) [m].
    """
    band = band_along(middle, right=0.0, left=1.0)
    foot, unit = (
        np.stack([np.interp(points[..., 0], band.stations, c) for c in line.T], axis=-1)
        for line in (band.right, band.left - band.right)
    )
    return np.asarray(foot + points[..., 1:] * unit)
