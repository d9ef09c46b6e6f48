"""Strokes in pictures that go all around: what leaves at one edge comes in at the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.lens import Lens

_BENT, _SHIFTED = 0.1, 0.35
"""Shares of a stroke's length by which its middle may lie beside the line between its ends, and off
the line's middle along it, where the camera comes nearer."""


class Laid(NamedTuple):
    """Strokes in a picture.

    Attributes:
        starts: Row and column of one end, (2, n) [px].
        ends: Of the other end, (2, n) [px].
        whose: Which of the given strokes each is, (n,).
    """

    starts: Floats
    ends: Floats
    whose: Ints


def turn_of(lens: Lens, size: tuple[int, int]) -> float | None:
    """Return how many columns a whole turn takes [px]; None where columns do not go around."""
    if lens.projection != "equirectangular":
        return None
    return size[0] / lens.turn


def laid(
    starts: Floats, middles: Floats, ends: Floats, *, lens: Lens, size: tuple[int, int]
) -> Laid:
    """Return strokes as they are seen with a lens: each on both sides of a seam that it crosses.

    Where straight things are not seen straight, at a zenith or right behind a fisheye, ends lie
    far apart in the picture though they do not in the world; such strokes are left out.

    Args:
        starts: Where one end is projected, (2, n) [px].
        middles: Where the place half-way is, (2, n) [px].
        ends: Where the other end is, (2, n) [px].
        lens: Of one eye.
        size: Of its picture [px].
    """
    every = np.arange(starts.shape[1])
    if not lens.sees_around:
        return Laid(starts, ends, every)
    turn = turn_of(lens, size)
    if turn is not None:
        middles, ends = (_beside(starts, places, turn) for places in (middles, ends))
    line, off = ends - starts, middles - 0.5 * (starts + ends)
    long = np.hypot(*line)
    towards = line / np.maximum(long, 1e-9)
    along, aside = (
        np.abs((off * towards).sum(axis=0)),
        np.abs(off[0] * towards[1] - off[1] * towards[0]),
    )
    kept = np.flatnonzero((along < _SHIFTED * long + 1.0) & (aside < _BENT * long + 1.0))
    starts, ends = starts[:, kept], ends[:, kept]
    if turn is None:
        return Laid(starts, ends, kept)
    shifts = np.repeat((0.0, -turn, turn), len(kept))
    starts, ends = np.tile(starts, 3), np.tile(ends, 3)
    starts[1] += shifts
    ends[1] += shifts
    return Laid(starts, ends, np.tile(kept, 3))


def _beside(starts: Floats, places: Floats, turn: float) -> Floats:
    """Return places, (2, n) [px], with columns that are less than half a turn from `starts`."""
    nearer = places.copy()
    nearer[1] -= turn * np.rint((places[1] - starts[1]) / turn)
    return nearer
