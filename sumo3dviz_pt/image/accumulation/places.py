"""Where what a band of a frame shows lies in another frame, and what is seen there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.accumulation.bands import Band
from sumo3dviz_pt.image.accumulation.frames import Motion, TracedFrame, plane_of
from sumo3dviz_pt.model.geometry import Bools, Floats, Image

Pixels = NDArray[np.intp] | slice
"""Flat indices of some pixels of a band, ascending; or a slice of all of them."""

_MOST = 0.25  # share of a band's pixels from which on all are looked at: that is faster
_LOOSE = np.float32(0.5)  # share by which distances may differ at edges and in leaves
_GAPS = 0.25  # by how much shares of sky may differ, beside chance
_PLAIN = np.float32(0.05)  # added to albedos before their ratio is taken
_MOST_UNLIKE = np.float32(4.0)  # ratio of albedos that is corrected, at most


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where pixels of a band lie in another frame.

    Attributes:
        pixels: Which these are, n of the band's.
        marks: What they would have there as `TracedFrame.marks`, were they not pure, (n,).
        taps: Flat indices of the nearest pixels there, (n,).
        inside: Whether they lie in the other picture; their taps mean nothing elsewhere, (n,).
        here: Distance from this eye, (n,) [m].
        there: Distance from the other eye, (n,) [m].
    """

    pixels: Pixels
    marks: NDArray[np.int32]
    taps: NDArray[np.intp]
    inside: Bools
    here: Image
    there: Image


def listed(wanted: Bools) -> Pixels:
    """Return the pixels of a band that are looked at: those wanted, or all if these are many."""
    count = np.count_nonzero(wanted)
    return slice(None) if count > _MOST * wanted.size else np.flatnonzero(wanted)


def places_of(
    pixels: Pixels, band: Band, centre: TracedFrame, other: TracedFrame, motion: Motion
) -> Places:
    """Find pixels of a frame in another one.

    Args:
        pixels: Which of the band's.
        band: Rows of the frame.
        centre: The frame.
        other: The other one.
        motion: From one to the other.
    """
    width, height = size = centre.layers.size
    here = band.of(centre.distance)[pixels]
    points = centre.rays[:, band.rows].reshape(3, -1)[:, pixels] * here
    moved, marks = _moved(points, band.of(centre.numbers)[pixels], motion)
    (row, column), ahead = other.view.lens.project(moved.T, size)
    row, column = np.rint(row, out=row), np.rint(column, out=column)
    in_row, in_column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
    inside = ahead & (in_row == row) & (in_column == column)
    taps = in_row.astype(np.intp)
    taps *= width
    taps += in_column.astype(np.intp)
    there = np.sqrt(np.einsum("ij,ij->j", moved, moved))
    return Places(pixels, marks, taps, inside, here, there)


def _moved(
    points: Image, numbers: NDArray[np.int32], motion: Motion
) -> tuple[Image, NDArray[np.int32]]:
    """Move points, (3, n), each as the part of its number; return them and their marks there."""
    placements: Floats = motion.placements
    turns, shifts = (
        part.astype(np.float32) for part in (placements[:, :3, :3], placements[:, :3, 3])
    )
    moved = turns[0] @ points
    moved += shifts[0, :, None]
    marks = np.zeros(len(numbers), dtype=np.int32)
    riding = np.flatnonzero(numbers)
    if len(riding):
        which = numbers[riding]
        turned = np.einsum("nij,jn->in", turns[which], points[:, riding])
        moved[:, riding] = turned + shifts[which].T
        marks[riding] = 2 * motion.there[which]
    return moved, marks


def seen_at(
    places: Places, band: Band, centre: TracedFrame, other: TracedFrame
) -> tuple[Bools, Image]:
    """Return what another frame shows of a frame's pixels, where it is the same thing.

    Args:
        places: Of the pixels.
        band: Rows of the frame.
        centre: The frame.
        other: The other one.

    Returns:
        Whether places show the same thing, (n,); and their planes, (channels, n).
    """
    seen = np.take(other.planes.reshape(len(other.planes), -1), places.taps, axis=1)
    away = np.take(other.distance, places.taps)
    unlike = np.take(other.marks, places.taps) ^ places.marks
    pure = (unlike == 1) & band.of(centre.pure)[places.pixels]
    room = np.where(pure, band.of(centre.room)[places.pixels], _LOOSE * places.there)
    fits = places.inside & (unlike & ~1 == 0) & (away > 0.0)
    away -= places.there
    fits &= np.abs(away, out=away) < room
    # Gaps between leaves differ from frame to frame, and the sky behind them is bright.
    gaps = plane_of(seen, "hit")[0] - band.of(centre.layers["hit"])[places.pixels]
    fits &= np.abs(gaps, out=gaps) <= _GAPS + 0.5 / centre.samples
    _as_here(seen, places, plane_of(centre.planes, "albedo")[:, band.rows])
    return fits, seen


def _as_here(seen: Image, places: Places, albedo_here: Image) -> None:
    """Give what was seen, (channels, n), this frame's textures and distances, in place."""
    own = albedo_here.reshape(3, -1)[:, places.pixels]
    radiance, albedo, depth = (plane_of(seen, name) for name in ("radiance", "albedo", "depth"))
    albedo += _PLAIN
    ratio = np.divide(own + _PLAIN, albedo, out=albedo)
    radiance *= np.clip(ratio, 1.0 / _MOST_UNLIKE, _MOST_UNLIKE, out=ratio)
    albedo[:] = own
    depth *= places.here / np.maximum(places.there, np.float32(1e-6))
