"""The nearest of many points; of those that are equally near, the first."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.model.geometry import Floats, Ints, settled

_ASKED = 4
"""Points that are looked at; places in a plane seldom have more nearest ones."""


class Nearest:
    """An index of points that gives the same nearest points on every machine.

    SciPy's tree gives any of several points that are equally near, which rounding decides.
    That happens: lanes that begin where others end have points in common, and many a house
    stands in the middle between two streets.
    """

    def __init__(self, points: Floats) -> None:
        """Index points, (n, 2) [m], n >= 1."""
        places, self._first = np.unique(settled(points), axis=0, return_index=True)
        self._tree = cKDTree(places)

    def query(self, places: Floats) -> tuple[Floats, Ints]:
        """Return distances of places, (m, 2) [m], to the nearest points, and their indices."""
        count = min(_ASKED, len(self._first))
        away, found = self._tree.query(settled(places), k=range(1, count + 1))
        away, first = settled(away), self._first[found]
        nearest = away.min(axis=1)
        equal = np.where(away == nearest[:, None], first, np.iinfo(np.int64).max)
        return nearest, np.asarray(equal.min(axis=1), dtype=np.int64)
