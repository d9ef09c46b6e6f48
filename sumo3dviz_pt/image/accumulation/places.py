"""Where what a frame shows lies in another frame, and what is seen there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.accumulation.frames import Motion, TracedFrame, plane_of
from sumo3dviz_pt.model.geometry import Bools, Floats, Image

_LOOSE = np.float32(0.5)  # share by which distances may differ at edges and in leaves
_GAPS = 0.25  # by how much shares of sky may differ, beside chance
_PLAIN = np.float32(0.05)  # added to albedos before their ratio is taken
_MOST_UNLIKE = np.float32(4.0)  # ratio of albedos that is corrected, at most


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where pixels of one frame lie in another.

    Attributes:
        pixels: Their flat indices, (n,); only those that lie inside the other picture.
        taps: Flat indices of the nearest pixels there, (n,).
        here: Distance from this eye, (n,) [m].
        there: Distance from the other eye, (n,) [m].
    """

    pixels: NDArray[np.intp]
    taps: NDArray[np.intp]
    here: Image
    there: Image

    def only(self, which: Bools) -> Places:
        """Return some of them."""
        return Places(self.pixels[which], self.taps[which], self.here[which], self.there[which])


def places_of(wanted: Bools, centre: TracedFrame, other: TracedFrame, motion: Motion) -> Places:
    """Find pixels of a frame in another one.

    Args:
        wanted: Which, (h, w); none of them shows the sky.
        centre: The frame.
        other: The other one.
        motion: From one to the other.
    """
    width, height = size = centre.layers.size
    pixels = np.flatnonzero(wanted)
    here = np.take(centre.distance, pixels)
    points = np.stack([np.take(axis, pixels) for axis in centre.rays]) * here
    moved = _moved(points, np.take(centre.numbers, pixels), motion.placements)
    (row, column), in_front = other.view.lens.project(moved.T.astype(np.float64), size)
    row, column = np.rint(row), np.rint(column)
    inside = in_front & (row >= 0) & (row < height) & (column >= 0) & (column < width)
    taps = row[inside].astype(np.intp) * width + column[inside].astype(np.intp)
    there = np.sqrt(np.einsum("ij,ij->j", moved, moved))
    return Places(pixels[inside], taps, here[inside], there[inside])


def _moved(points: Image, numbers: NDArray[np.intp], placements: Floats) -> Image:
    """Move points, (3, n), each by the placement of its number."""
    turns, shifts = (
        part.astype(np.float32) for part in (placements[:, :3, :3], placements[:, :3, 3])
    )
    moved = turns[0] @ points + shifts[0, :, None]
    riding = np.flatnonzero(numbers)
    if len(riding):
        which = numbers[riding]
        turned = np.einsum("nij,jn->in", turns[which], points[:, riding])
        moved[:, riding] = turned + shifts[which].T
    return np.asarray(moved)


def seen_at(
    places: Places, centre: TracedFrame, other: TracedFrame, motion: Motion
) -> tuple[Places, Image]:
    """Return what another frame shows of a frame's pixels, where it is the same thing.

    Args:
        places: Of the pixels.
        centre: The frame.
        other: The other one.
        motion: From one to the other.

    Returns:
        The places that show the same thing, and their planes, (channels, n).
    """
    away = np.take(other.distance, places.taps)
    pure = np.take(centre.pure, places.pixels) & np.take(other.pure, places.taps)
    room = np.where(pure, np.take(centre.room, places.pixels), _LOOSE * places.there)
    fits = (np.abs(away - places.there) < room) & (away > 0.0)
    fits &= np.take(motion.numbers, places.taps) == np.take(centre.numbers, places.pixels)
    # Gaps between leaves differ from frame to frame, and the sky behind them is bright.
    hit, hit_there = np.take(centre.layers["hit"], places.pixels), other.layers["hit"]
    fits &= np.abs(np.take(hit_there, places.taps) - hit) <= _GAPS + 0.5 / centre.samples
    kept = places.only(fits)
    seen = np.stack([np.take(plane, kept.taps) for plane in other.planes])
    return kept, _as_here(seen, kept, centre)


def _as_here(seen: Image, places: Places, centre: TracedFrame) -> Image:
    """Return what was seen, (channels, n), with this frame's textures and distances."""
    mine = plane_of(centre.planes, "albedo")
    own = np.stack([np.take(plane, places.pixels) for plane in mine])
    radiance, albedo, depth = (plane_of(seen, name) for name in ("radiance", "albedo", "depth"))
    ratio = (own + _PLAIN) / (albedo + _PLAIN)
    radiance *= np.clip(ratio, 1.0 / _MOST_UNLIKE, _MOST_UNLIKE)
    albedo[:] = own
    depth *= places.here / np.maximum(places.there, np.float32(1e-6))
    return seen
