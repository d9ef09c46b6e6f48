"""Draws strokes: what small things cover that moved while the shutter was open, in depth.

A stroke takes a share of its pixels' light and gives its own instead. Shares add up as optical
depths do, so the order in which they are laid does not matter. In pictures that go all around, what
leaves at one edge comes in at the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.numbers import eased

_ROOM, _LEAST_ROOM = np.float32(0.02), np.float32(0.02)
"""How softly a surface hides what is behind it: share of the distance, and at least so far [m]."""


class Veil:
    """Collects what covers a picture, and the light that it gives.

    Args:
        distance: Of what each pixel sees, (h, w) [m]; any where it sees the sky.
        hit: Share of the pixel that sees anything but the sky, (h, w).
    """

    def __init__(self, distance: Image, hit: Image) -> None:
        self.size = distance.shape[1], distance.shape[0]
        self.distance, self.hit = distance.reshape(-1), hit.reshape(-1)
        self._depth: Floats = np.zeros(distance.size)
        self._light: Floats = np.zeros((3, distance.size))

    def seen(self, pixels: NDArray[Any], away: Image) -> Image:
        """Return how much of things is not hidden, [0, 1].

        Args:
            pixels: Flat numbers of the pixels that they are before.
            away: Their distances [m].
        """
        before = (self.distance[pixels] - away) / (_ROOM * away + _LEAST_ROOM) + np.float32(0.5)
        hit = self.hit[pixels]
        seen = 1 - hit + hit * np.clip(before, np.float32(0.0), np.float32(1.0))
        return np.asarray(seen, dtype=np.float32)

    def add(self, pixels: Ints, depths: Image, colours: Floats) -> None:
        """Cover pixels.

        Args:
            pixels: Flat numbers, (n,); one may occur many times.
            depths: Optical depths, (n,).
            colours: Radiance that comes instead, (n, 3).
        """
        count = len(self._depth)
        self._depth += np.bincount(pixels, weights=depths, minlength=count)
        for light, colour in zip(self._light, colours.T, strict=True):
            light += np.bincount(pixels, weights=depths * colour, minlength=count)

    def over(self, radiance: Image) -> Image:
        """Return a picture with what covers it, (h, w, 3)."""
        covered = np.flatnonzero(self._depth > 0.0)
        if not len(covered):
            return radiance
        depth = self._depth[covered]
        share = -np.expm1(-depth)
        laid = np.array(radiance, dtype=np.float32).reshape(-1, 3)
        light = self._light[:, covered] * (share / depth)
        laid[covered] = laid[covered] * (1.0 - share)[:, None] + light.T
        return laid.reshape(radiance.shape)


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
    if not lens.kind.goes_round:
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
    near = np.flatnonzero((along < _SHIFTED * long + 1.0) & (aside < _BENT * long + 1.0))
    starts, ends = starts[:, near], ends[:, near]
    if turn is None:
        return Laid(starts, ends, near)
    shifts = np.repeat((0.0, -turn, turn), len(near))
    starts, ends = np.tile(starts, 3), np.tile(ends, 3)
    starts[1] += shifts
    ends[1] += shifts
    return Laid(starts, ends, np.tile(near, 3))


def _beside(starts: Floats, places: Floats, turn: float) -> Floats:
    """Return places, (2, n) [px], with columns that are less than half a turn from `starts`."""
    nearer = places.copy()
    nearer[1] -= turn * np.rint((places[1] - starts[1]) / turn)
    return nearer


WIDEST = 64.0
"""Strokes are at most so wide [px]."""

_THIN = 2.0
"""Up to this width strokes have square ends and no soft edges [px]."""

_SOFT = 0.5
"""Share of the width over which thicker ones fade at their edges."""

_AT_ONCE = 400_000
"""Samples that are worked on together, about."""


@dataclass(frozen=True, slots=True, eq=False)
class Strokes:
    """Strokes in a picture.

    Attributes:
        starts: Row and column of one end, (2, n) [px], whole numbers at pixel centres.
        ends: Of the other end, (2, n) [px].
        widths: At least 1, (n,) [px].
        depths: Optical depth along the middle line, (n,).
        away: Distance from the eye, (n,) [m].
        colours: Radiance, (n, 3).
    """

    starts: Floats
    ends: Floats
    widths: Floats
    depths: Floats
    away: Floats
    colours: Floats

    def only(self, which: Ints | Bools) -> Strokes:
        """Return some of them."""
        return Strokes(
            self.starts[:, which],
            self.ends[:, which],
            self.widths[which],
            self.depths[which],
            self.away[which],
            self.colours[which],
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Lines:
    """Strokes that are longer along an axis of the picture than across it.

    Attributes:
        low: Where each begins along the axis, (n,) [px].
        high: Where it ends, (n,) [px].
        first: Where it begins across the axis, (n,) [px].
        slope: Pixels across for each along, (n,), in [-1, 1].
        half: Half the width, (n,) [px].
    """

    low: Floats
    high: Floats
    first: Floats
    slope: Floats
    half: Floats

    @classmethod
    def of(cls, strokes: Strokes, *, along: int) -> _Lines:
        """Turn strokes such that they run to higher numbers of an axis: 0 rows, 1 columns."""
        starts, ends = strokes.starts, strokes.ends
        back = starts[along] > ends[along]
        low, first = np.where(back, ends[[along, 1 - along]], starts[[along, 1 - along]])
        high, last = np.where(back, starts[[along, 1 - along]], ends[[along, 1 - along]])
        slope = np.clip((last - first) / np.maximum(high - low, 1e-6), -1.0, 1.0)
        return cls(low, high, first, slope, 0.5 * strokes.widths)


def draw(veil: Veil, strokes: Strokes) -> None:
    """Lay strokes over a picture; each is hidden where something is nearer.

    Args:
        veil: To which is added.
        strokes: In any order.
    """
    moves = np.abs(strokes.ends - strokes.starts)
    lying = moves[1] > moves[0]
    # Strokes of about the same width cross the same number of pixels.
    group = np.where(strokes.widths <= _THIN, 0, np.ceil(np.log2(strokes.widths)).astype(int))
    for along, chosen in ((0, ~lying), (1, lying)):
        for number in np.unique(group[chosen]).tolist():
            some = strokes.only(np.flatnonzero(chosen & (group == number)))
            for part in _parts(some, along):
                _draw(veil, part, along=along, thin=number == 0)


def _parts(strokes: Strokes, along: int) -> Iterator[Strokes]:
    """Yield strokes such that not too many samples are worked on together."""
    long = np.abs(strokes.ends[along] - strokes.starts[along]) + strokes.widths + 2.0
    samples = np.cumsum(long * (1.5 * strokes.widths + 2.0))
    cuts = np.searchsorted(samples, np.arange(_AT_ONCE, samples[-1], _AT_ONCE))
    for which in np.split(np.arange(len(long)), cuts):
        if len(which):
            yield strokes.only(which)


def _draw(veil: Veil, strokes: Strokes, *, along: int, thin: bool) -> None:
    """Draw strokes of about one width that run along one axis."""
    lines = _Lines.of(strokes, along=along)
    width, height = veil.size
    long, wide = (height, width) if along == 0 else (width, height)

    # Rows (or columns) of pixels that each stroke crosses.
    begin = np.maximum(np.ceil(lines.low - lines.half - 0.5), 0.0).astype(np.int64)
    end = np.minimum(np.floor(lines.high + lines.half + 0.5), long - 1.0).astype(np.int64)
    counts = np.maximum(end - begin + 1, 0)
    owner = np.repeat(np.arange(len(counts)), counts)
    row = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts - begin, counts)

    # Pixels of each of these around the stroke's middle.
    reach = int(np.ceil(float(strokes.widths.max()) * np.sqrt(2.0))) + 1
    held = row if thin else np.clip(row, lines.low[owner], lines.high[owner])
    middle = lines.first[owner] + lines.slope[owner] * (held - lines.low[owner])
    pixel = np.ceil(middle - 0.5 * reach).astype(np.int64)[:, None] + np.arange(reach)
    off = (pixel - middle[:, None]).astype(np.float32)
    cover = _thin(lines, owner, row, off) if thin else _thick(lines, owner, row, held, off)
    which = np.flatnonzero((cover > 0.0) & (pixel >= 0) & (pixel < wide))
    if not len(which):
        return
    sample = which // reach
    across, down = pixel.reshape(-1)[which], row[sample]
    flat = down * width + across if along == 0 else across * width + down
    owned = owner[sample]
    depths = cover.reshape(-1)[which] * strokes.depths.astype(np.float32)[owned]
    depths *= veil.seen(flat, strokes.away.astype(np.float32)[owned])
    veil.add(flat, depths, strokes.colours[owned])


def _thin(lines: _Lines, owner: Ints, row: Ints, off: Image) -> Image:
    """Return which share of pixels thin strokes cover, (n, pixels), by their middles' offsets."""
    inside = np.minimum(row + 0.5, (lines.high + lines.half)[owner])
    inside -= np.maximum(row - 0.5, (lines.low - lines.half)[owner])
    # A stroke is wider along a row than across itself.
    cut = (2.0 * lines.half * np.sqrt(1.0 + lines.slope**2)).astype(np.float32)[owner, None]
    edge = np.float32(0.5) * (cut + 1) - np.abs(off)
    share = np.clip(edge, np.float32(0.0), np.minimum(cut, 1))
    return np.asarray(share * np.clip(inside, 0.0, 1.0).astype(np.float32)[:, None])


def _thick(lines: _Lines, owner: Ints, row: Ints, held: Floats, off: Image) -> Image:
    """Return which share of pixels thick strokes with round ends cover, (n, pixels)."""
    lean = lines.slope[owner, None]
    # Distances to the line, or to its end where that is nearer.
    past = (row - held)[:, None]
    lower, upper = lines.low[owner, None], lines.high[owner, None]
    foot = held[:, None] + (lean * off + past) / (1.0 + lean * lean)
    foot = np.clip(foot, lower, upper)
    across = off - lean * (foot - held[:, None])
    apart = np.hypot(across, row[:, None] - foot)
    half = lines.half[owner, None]
    soft = np.maximum(2.0 * _SOFT * half, 1.0)
    rise = np.clip((half + 0.5 * soft - apart) / soft, 0.0, 1.0)
    return np.asarray(eased(rise), dtype=np.float32)
