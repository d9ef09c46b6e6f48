"""Which emitter a path aims at: by what each gives to the place that is lit.

A table says it by the cells of a grid around what the eye sees. A part of the choice ignores
the place, so that what the table underestimates is aimed at, too.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.render.kernels import aligned

CELLS = 64
"""Rows, and columns, of the grid."""

_BY_PLACE = 0.7
"""Share of the choice that depends on the place."""


class Choice:
    """The chances of a scene's emitters.

    Args:
        count: How many emitters there are.
        placed: Whether the choice depends on the place.
    """

    def __init__(self, count: int, *, placed: bool) -> None:
        self._count, self._placed = count, placed
        self._chances = self._summed = self._grid = mi.Float(0.0)

    def follow(self, weights: Floats, given: Floats, grid: Floats) -> None:
        """Bring the chances to a frame.

        Args:
            weights: How often paths aim at each emitter from anywhere, (count,).
            given: What each gives to each cell, (count, cells), if the place matters.
            grid: x and y of the corner in the renderer's coordinates [m], and cells per metre.
        """
        chances = (weights / weights.sum())[None]
        if self._placed:
            total = given.sum(axis=0)
            by_place = (given / np.where(total > 0.0, total, 1.0)).T
            chances = np.where(
                total[:, None] > 0.0, (1.0 - _BY_PLACE) * chances + _BY_PLACE * by_place, chances
            )
        summed = np.cumsum(chances, axis=1)
        self._chances, self._summed, self._grid = (
            mi.Float(aligned(table, np.float32)) for table in (chances, summed, grid)
        )

    def chance(self, number: Any, place: Any, active: Any) -> Any:
        """Return the chance that paths aim from a place at an emitter, by its number."""
        return dr.gather(mi.Float, self._chances, self._row(place, active) + number, active)

    def pick(self, sample: Any, place: Any, active: Any) -> tuple[Any, Any, Any]:
        """Pick an emitter; return its number, its chance and what is left of the sample.

        Args:
            sample: Two numbers in [0, 1).
            place: That is lit.
            active: Which lanes count.
        """
        row = self._row(place, active)

        def summed(k: Any) -> Any:
            return dr.gather(mi.Float, self._summed, row + mi.UInt32(k), active)

        last = self._count - 1
        number = mi.UInt32(dr.binary_search(0, last, lambda k: summed(k) <= sample.x))
        chance = dr.gather(mi.Float, self._chances, row + number, active)
        low = dr.select(number > 0, summed(dr.maximum(number, 1) - 1), 0.0)
        left = dr.clip((sample.x - low) / chance, 0.0, dr.one_minus_epsilon(mi.Float))
        return number, chance, mi.Point2f(left, sample.y)

    def _row(self, place: Any, active: Any) -> Any:
        """Return where a place's numbers begin."""
        if not self._placed:
            return mi.UInt32(0)
        grid = dr.gather(mi.Vector3f, self._grid, mi.UInt32(0), active)
        column = mi.UInt32(dr.clip((place.x - grid.x) * grid.z, 0.0, CELLS - 1.0))
        row = mi.UInt32(dr.clip((place.y - grid.y) * grid.z, 0.0, CELLS - 1.0))
        return (row * CELLS + column) * self._count
