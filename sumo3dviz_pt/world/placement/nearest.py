"""The nearest of many points; of those that are equally near, the first."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, Ints, settled

_ASKED = 4
"""Places in a plane seldom have more nearest points than these."""


class Nearest:
    """Points that can be asked, the same everywhere.

    A tree of points gives any of those that are equally near, and a last bit chooses. Lanes
    that begin where others end have points in common, and many a house stands in the middle
    between two streets.
    """

    def __init__(self, points: Floats) -> None:
        """Index points, (n, 2) [m], n >= 1."""
        places, self._first = np.unique(settled(points), axis=0, return_index=True)
        self._tree = cKDTree(places)

    def query(self, places: Floats) -> tuple[Floats, Ints]:
        """Distances of places, (m, 2) [m], from their nearest points, and which these are, (m,)."""
        count = min(_ASKED, len(self._first))
        away, found = self._tree.query(settled(places), k=range(1, count + 1))
        away, first = settled(away), self._first[found]
        nearest = away.min(axis=1)
        equal = np.where(away == nearest[:, None], first, np.iinfo(np.int64).max)
        return nearest, np.asarray(equal.min(axis=1), dtype=np.int64)
