"""Where what a frame shows lies in another frame, and whether it is in the same light there.

Changed light is told from noise, because shadows, lamps and signals must not lag behind. A
picture's rows are worked on in bands, so that what is computed of each stays in the processor's
cache.

Sums in square windows around every pixel, by few additions of whole rows and columns. A window of
9 pixels is three of 3 side by side; one of 21 is one of 9, one of 3 and one of 9. So wide windows
cost hardly more than narrow ones, and no running sum loses digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.traced import PixelMotion, TracedFrame, plane_of
from sumo3dviz_pt.model.geometry import Bools, Floats, Image

_PIXELS = 150_000
"""About as many has a band: a plane of them takes a third of a processor's second cache."""


@dataclass(frozen=True, slots=True)
class RowBand:
    """Some rows of a picture, and those around them that windows reach.

    Attributes:
        first: Of its own rows.
        after: The row after its last one.
        height: Of the picture [px].
        margin: How far windows reach [px].
    """

    first: int
    after: int
    height: int
    margin: int

    @property
    def own(self) -> slice:
        """Its own rows in the picture."""
        return slice(self.first, self.after)

    @property
    def rows(self) -> slice:
        """All of its rows in the picture."""
        return slice(max(self.first - self.margin, 0), min(self.after + self.margin, self.height))

    @property
    def core(self) -> slice:
        """Its own rows among all of its rows."""
        return slice(self.first - self.rows.start, self.after - self.rows.start)

    def of(self, picture: NDArray[Any]) -> NDArray[Any]:
        """Return its rows of a picture, (h, w), as a flat view."""
        rows: NDArray[Any] = picture[self.rows].reshape(-1)
        return rows

    def among(self, pixels: NDArray[np.intp], width: int) -> NDArray[np.intp]:
        """Return which flat indices of the picture, ascending, lie in its rows, as its own."""
        rows = self.rows
        ends = np.searchsorted(pixels, (rows.start * width, rows.stop * width))
        return np.asarray(pixels[slice(*ends)] - rows.start * width)

    def padded(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values of its rows as if the picture went on beyond its edges as at its edges."""
        above = self.margin - (self.first - self.rows.start)
        below = self.margin - (self.rows.stop - self.after)
        return np.pad(values, ((above, below), (self.margin, self.margin)), mode="edge")


def bands_of(size: tuple[int, int], margin: int) -> Iterator[RowBand]:
    """Yield a picture's bands from above.

    Args:
        size: Of the picture, width and height [px].
        margin: How far windows reach [px].
    """
    width, height = size
    rows = max(_PIXELS // width, 2 * margin)
    for first in range(0, height, rows):
        yield RowBand(first, min(first + rows, height), height, margin)


Values = NDArray[Any]
"""A picture of floats, or of whole numbers."""

WIDEST = 21
"""Side of the widest window [px]."""


def window_sums(values: Values, window: int) -> Values:
    """Return the sum of every square that lies in a picture, (h - side + 1, w - side + 1).

    Args:
        values: (h, w), each side as long as the window or longer.
        window: Side of the squares [px]: 3, 5, 9 or 21.

    Raises:
        ValueError: If the window has another side.
    """
    return _in_rows(_in_rows(values, window).T, window).T


def _in_rows(values: Values, window: int) -> Values:
    """Return the sums of so many rows from each row on, (h - window + 1, w)."""
    three = values[:-2] + values[1:-1]
    three += values[2:]
    if window == 3:
        return three
    if window == 5:
        return _all_of(values[:-4], three[1:-1], values[4:])
    nine = _all_of(three[:-6], three[3:-3], three[6:])
    if window == 9:
        return nine
    if window == WIDEST:
        return _all_of(nine[:-12], three[9:-9], nine[12:])
    raise ValueError(f"no window of {window} pixels")


def _all_of(first: Values, second: Values, third: Values) -> Values:
    """Return the sum of three pictures, with one new array."""
    total = first + second
    total += third
    return np.asarray(total)


def inner(values: Values, margin: int) -> Values:
    """Return a picture without so many pixels at each side."""
    return values[margin:-margin, margin:-margin] if margin else values


Pixels = NDArray[np.intp] | slice
"""Flat indices of some pixels of a band, ascending; or a slice of all of them."""

_MOST = 0.25  # share of a band's pixels from which on all are looked at: that is faster
_LOOSE = np.float32(0.5)  # share by which distances may differ at edges and in leaves
_GAPS = 0.25  # by how much shares of sky may differ, beside chance
_PLAIN = np.float32(0.05)  # added to albedos before their ratio is taken
_MOST_UNLIKE = np.float32(4.0)  # ratio of albedos that is corrected, at most


@dataclass(frozen=True, slots=True, eq=False)
class BandPlaces:
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
    pixels: Pixels, band: RowBand, centre: TracedFrame, other: TracedFrame, motion: PixelMotion
) -> BandPlaces:
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
    return BandPlaces(pixels, marks, taps, inside, here, there)


def _moved(
    points: Image, numbers: NDArray[np.int32], motion: PixelMotion
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
    places: BandPlaces, band: RowBand, centre: TracedFrame, other: TracedFrame
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


def worth_of(places: BandPlaces) -> Image:
    """Return how many samples of their own pixels find in another frame, (n,) in (0, 1].

    What was smaller there has fewer pixels than here: several pixels share one, and its noise would
    be a blotch of theirs, which the denoiser takes for a crumpled surface. Roads and walls that one
    passes are smaller by the third power of their distance, as they are seen more from their side,
    too; blotches are worse than noise of single pixels, and so it is the fourth.
    """
    nearer = places.here / np.maximum(places.there, np.float32(1e-6))
    nearer = np.minimum(nearer, np.float32(1.0), out=nearer)
    nearer *= nearer
    return np.asarray(nearer * nearer)


def _as_here(seen: Image, places: BandPlaces, albedo_here: Image) -> None:
    """Give what was seen, (channels, n), this frame's textures and distances, in place."""
    own = albedo_here.reshape(3, -1)[:, places.pixels]
    radiance, albedo, depth = (plane_of(seen, name) for name in ("radiance", "albedo", "depth"))
    albedo += _PLAIN
    ratio = np.divide(own + _PLAIN, albedo, out=albedo)
    radiance *= np.clip(ratio, 1.0 / _MOST_UNLIKE, _MOST_UNLIKE, out=ratio)
    albedo[:] = own
    depth *= places.here / np.maximum(places.there, np.float32(1e-6))


_NARROW = (9, 5, 3)
"""Sides of the windows in which light is compared, beside the widest [px].

The wide one finds small changes of large areas; narrow ones find thin shadows of cyclists, and
those under far cars.
"""

MARGIN = WIDEST // 2
"""How far windows reach beyond the pixels that are asked for [px]."""

_OF_NINE = np.float32(9 / 8)
"""Variance of values over that of their differences from the mean of nine."""

_SURE, _CERTAIN = np.float32(2.0), np.float32(5.0)
"""Standard errors from which on light may have, and surely has, changed."""

_NEVER_EXACT = np.float32(1e-6)
"""Added to squared standard errors, so that none is zero."""


Counts = NDArray[np.int16]
"""Whole numbers take half the memory, and so half the time."""


def likeness(change: Image, known: Bools) -> Image:
    """Return how far the light of two pictures may be called the same, (h, w) in [0, 1].

    The difference of the logarithms of luminance is averaged around every pixel and compared
    with the standard error of that mean. Textures cancel out in the difference.

    Args:
        change: That difference, with `MARGIN` pixels more at each side, (h + 20, w + 20).
        known: Where it means anything, as large.
    """
    counts = None if known.all() else known.astype(np.int16)
    if counts is not None:
        change = change * known
    count = {window: _count(counts, window) for window in (WIDEST, *_NARROW)}
    mean = _mean(change, WIDEST, count[WIDEST])
    spread = _mean(change * change, WIDEST, count[WIDEST]) - mean * mean
    doubt = _doubt(mean, np.maximum(spread, 0.0, out=spread), count[WIDEST])

    # The spread within a narrow window would count a thin shadow as noise; what differs from the
    # next pixels does not.
    noise = _noise(change, counts, count[_NARROW[0]])
    for window in _NARROW:
        mean = _mean(inner(change, MARGIN - window // 2), window, count[window])
        np.maximum(doubt, _doubt(mean, noise, count[window]), out=doubt)

    np.sqrt(doubt, out=doubt)
    same = (_CERTAIN - doubt) * (1 / (_CERTAIN - _SURE))
    np.clip(same, 0.0, 1.0, out=same)
    return same if counts is None else same * inner(known, MARGIN)


def _doubt(mean: Image, variance: Image, count: Image | np.float32) -> Image:
    """Return the squares of means in units of their standard errors, (h, w).

    Args:
        mean: Of some values.
        variance: Of these values, not negative.
        count: How many values there are.
    """
    error: Image = variance / count
    error += _NEVER_EXACT
    np.multiply(mean, mean, out=mean)
    return np.asarray(np.divide(mean, error, out=mean))


def _mean(values: Image, window: int, count: Image | np.float32) -> Image:
    """Return the means of windows that have so many values, (h, w)."""
    return np.asarray(window_sums(values, window) / count, dtype=np.float32)


def _noise(change: Image, counts: Counts | None, around: Image | np.float32) -> Image:
    """Return the variance of a change's noise around every pixel, (h, w)."""
    wide, narrow = _NARROW[0], _NARROW[-1]
    margin = MARGIN - wide // 2
    count = _count(counts, narrow, more=wide // 2)
    mean = _mean(inner(change, margin - narrow // 2), narrow, count)
    rest = inner(change, margin) - mean
    if counts is not None:
        rest *= inner(counts, margin)
    np.multiply(rest, rest, out=rest)
    return _mean(rest, wide, around) * _OF_NINE


def _count(counts: Counts | None, window: int, *, more: int = 0) -> Image | np.float32:
    """Return how many pixels of each window mean anything; one number where all do.

    Args:
        counts: 1 where a pixel means something, else 0; None if all do.
        window: Side of the window [px].
        more: How many more pixels are asked for at each side [px].
    """
    if counts is None:
        return np.float32(window**2)
    sums = window_sums(inner(counts, MARGIN - window // 2 - more), window)
    # No mean is asked for where nothing is known.
    return np.maximum(sums, 1).astype(np.float32)
