"""Whether light has changed between two frames, told from noise.

Shadows, lamps and signals must not lag behind. The difference of the logarithms of luminance is
averaged around every pixel and compared with the standard error of that mean. Textures cancel out
in the difference.

Windows are sums of columns of sums of rows; four of them, side by side, share what they have in
common, so wide windows cost hardly more than narrow ones, and no running sum loses digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.averaging.places import Found
from sumo3dviz_pt.render.averaging.records import count

WIDEST = 21
"""Side of the widest window [px]."""

_NARROW = (9, 5, 3)
"""Sides of the windows in which light is compared, beside the widest [px].

The wide one finds small changes of large areas; narrow ones find thin shadows of cyclists, and
those under far cars.
"""

_REACH, _AROUND = WIDEST // 2, _NARROW[0] // 2
"""How far windows of light reach, and that of its noise, which asks for windows of 3 [px]."""

_TOGETHER = 4
"""How many windows side by side are summed at once: they share most of their values."""

_OF_NINE = 9 / 8
"""Variance of values over that of their differences from the mean of nine."""

_SURE, _CERTAIN = 2.0, 5.0
"""Standard errors from which on light may have, and surely has, changed."""

_NEVER_EXACT = 1e-6
"""Added to squared standard errors, so that none is zero."""


def window_sums(values: Sequence[Any], window: int) -> list[Any]:
    """Return the sums of four windows that begin at successive values.

    Args:
        values: Three more than the window has, or more.
        window: How many are summed.
    """
    more = _TOGETHER - 1
    if window <= _TOGETHER:
        return [sum(values[k + 1 : k + window], start=values[k]) for k in range(_TOGETHER)]
    shared = sum(values[more + 1 : window], start=values[more])
    return [
        sum((*values[k:more], *values[window : window + k]), start=shared) for k in range(_TOGETHER)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Doubts:
    """What tells changed light from noise, in a picture and four pixels around it.

    Attributes:
        means: Squared doubt of the widest window, then means of the narrow ones, by fours.
        squares: Squared difference from the mean of nine, and the narrow windows' counts; pairs.
        noise: Sums of these squares in squares of nine, at their first pixels.
        area: What is summed.
    """

    means: Any
    squares: Any
    noise: Any
    area: _Area

    @classmethod
    def of(cls, found: Found, size: tuple[int, int]) -> Doubts:
        """Sum what was found of a picture of a size [px] in another one."""
        area = _Area(*size)
        means, squares = _in_columns(_in_rows(found.change, area), area)
        return cls(means, squares, _noise(squares, area), area)

    def likeness(self) -> Any:
        """Return how far the light of both pictures may be called the same, in [0, 1]."""
        width = count(self.area.width)
        pixel = dr.arange(mi.UInt32, self.area.width * self.area.height)
        row = pixel // width
        first = row * count(self.area.wide) + (pixel - row * width)
        own = first + _AROUND * count(self.area.wide) + _AROUND
        doubt, *means = dr.gather(mi.Vector4f, self.means, own)
        counts = _Counts.told(dr.gather(mi.Vector2f, self.squares, own).y)
        variance = _OF_NINE * dr.gather(mi.Float, self.noise, first) / counts.nine
        for mean, values in zip(means, (counts.nine, counts.five, counts.three), strict=True):
            doubt = dr.maximum(doubt, _doubt(mean, variance, values))
        return dr.clip((_CERTAIN - dr.sqrt(doubt)) / (_CERTAIN - _SURE), 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class _Area:
    """A picture and a border around it, as wide as windows of noise reach.

    Attributes:
        width: Of the picture [px].
        height: The same.
    """

    width: int
    height: int

    @property
    def wide(self) -> int:
        """Its columns, in whole groups."""
        return _whole(self.width + 2 * _AROUND)

    @property
    def high(self) -> int:
        """Its rows, in whole groups."""
        return _whole(self.height + 2 * _AROUND)


def _whole(pixels: int) -> int:
    """Return the next multiple of how many windows are summed together."""
    return -(-pixels // _TOGETHER) * _TOGETHER


def _clamped(index: Any, first: int, last: int) -> Any:
    """Return places from a first one on, in a picture that goes on as at its edges."""
    place = mi.Int32(index) + first
    return mi.UInt32(dr.clip(place, 0, dr.opaque(mi.Int32, last)))


def _doubt(mean: Any, variance: Any, values: Any) -> Any:
    """Return how surely means differ from 0: the squares of their distances in standard errors.

    Args:
        mean: The means.
        variance: Of the values that they are of.
        values: How many these are.
    """
    return mean * mean / (variance / values + _NEVER_EXACT)


@dataclass(frozen=True, slots=True, eq=False)
class _Counts:
    """How many pixels of narrow windows mean anything, at least 1; three in one number.

    Single precision holds whole numbers to 24 bits: 8 for windows of 9, 6 for those of 5, 5 for
    those of 3, and the rest for pixels themselves. No digit overflows where rows are summed.
    """

    nine: Any
    five: Any
    three: Any

    @staticmethod
    def joined(nine: Any, five: Any, three: Any, own: Any) -> Any:
        """Return sums of rows in one number."""
        return nine + 256.0 * (five + 64.0 * (three + 32.0 * own))

    @staticmethod
    def own(joined: Any) -> Any:
        """Return whether pixels themselves mean anything, 1 or 0."""
        return mi.Float(mi.UInt32(joined) >> 19)

    @classmethod
    def of(cls, nine: Any, five: Any, three: Any) -> _Counts:
        """Return the counts of windows, given sums over 9, 5 and 3 rows of joined numbers."""
        digits = (
            mi.UInt32(nine) & 255,
            mi.UInt32(five) >> 8 & 63,
            mi.UInt32(three) >> 14 & 31,
        )
        return cls(*(dr.maximum(mi.Float(digit), 1.0) for digit in digits))

    @classmethod
    def told(cls, joined: Any) -> _Counts:
        """Return the counts that are joined in one number."""
        return cls.of(joined, joined, joined)

    @property
    def together(self) -> Any:
        """All in one number."""
        return _Counts.joined(self.nine, self.five, self.three, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class _RowSums:
    """Sums of rows, by fours.

    Attributes:
        widest: Sum of changes, of their squares, how many there are; the change itself.
        narrow: Sums of nine, five and three changes; how many these are.
    """

    widest: Any
    narrow: Any


def _in_rows(change: Any, area: _Area) -> _RowSums:
    """Sum changes, pairs with 1 where they mean something, along a picture's rows."""
    groups = area.height * (area.wide // _TOGETHER)
    index = dr.arange(mi.UInt32, groups)
    row = index // count(area.wide // _TOGETHER)
    first, begin = row * count(area.width), (index * _TOGETHER) - row * count(area.wide)
    values = [
        dr.gather(
            mi.Vector2f,
            change,
            first + _clamped(begin, k - _AROUND - _REACH, area.width - 1),
        )
        for k in range(WIDEST + _TOGETHER - 1)
    ]
    every = window_sums(values, WIDEST)
    squares = window_sums([value.x * value.x for value in values], WIDEST)
    sums = [window_sums(values[_REACH - window // 2 :], window) for window in _NARROW]
    here = values[_REACH:]

    def of(k: int) -> tuple[Any, Any]:
        narrow = [each[k] for each in sums]
        nine, five, three = (each.y for each in narrow)
        counts = _Counts.joined(nine, five, three, here[k].y)
        return (
            mi.Vector4f(every[k].x, squares[k], every[k].y, here[k].x),
            mi.Vector4f(*(each.x for each in narrow), counts),
        )

    places = [index * _TOGETHER + k for k in range(_TOGETHER)]
    room = [dr.empty(mi.Float, 4 * _TOGETHER * groups) for _ in range(2)]
    return _RowSums(*_written(room, of, places))


def _written(
    room: Sequence[Any], values: Callable[[int], tuple[Any, ...]], places: Sequence[Any]
) -> Sequence[Any]:
    """Write values at several places into arrays, and work them out."""
    for k, place in enumerate(places):
        for array, value in zip(room, values(k), strict=True):
            dr.scatter(array, value, place, mode=dr.ReduceMode.Permute)
    dr.eval(room)
    return room


def _in_columns(rows: _RowSums, area: _Area) -> tuple[Any, Any]:
    """Sum sums of rows along columns; see `Doubts`."""
    groups = (area.high // _TOGETHER) * area.wide
    index, width = dr.arange(mi.UInt32, groups), count(area.wide)
    block = index // width
    column = index - block * width
    begin = block * _TOGETHER

    def column_of(sums: Any, window: int) -> list[Any]:
        more, above = window + _TOGETHER - 1, _AROUND + window // 2
        places = (_clamped(begin, k - above, area.height - 1) for k in range(more))
        return [dr.gather(mi.Vector4f, sums, place * width + column) for place in places]

    widest, narrow = column_of(rows.widest, WIDEST), column_of(rows.narrow, _NARROW[0])
    every = window_sums(widest, WIDEST)
    sums = [window_sums(narrow[_AROUND - window // 2 :], window) for window in _NARROW]

    def of(k: int) -> tuple[Any, Any]:
        values = dr.maximum(every[k].z, 1.0)
        mean = every[k].x / values
        spread = dr.maximum(every[k].y / values - mean * mean, 0.0)
        counts = _Counts.of(*(each[k].w for each in sums))
        means = (
            sums[0][k].x / counts.nine,
            sums[1][k].y / counts.five,
            sums[2][k].z / counts.three,
        )
        # The spread within a narrow window would count a thin shadow as noise; what differs from
        # the next pixels does not.
        rest = (widest[_REACH + k].w - means[-1]) * _Counts.own(narrow[_AROUND + k].w)
        return (
            mi.Vector4f(_doubt(mean, spread, values), *means),
            mi.Vector2f(rest * rest, counts.together),
        )

    places = [(begin + k) * width + column for k in range(_TOGETHER)]
    room = [dr.empty(mi.Float, size * _TOGETHER * groups) for size in (4, 2)]
    means, squares = _written(room, of, places)
    return means, squares


def _noise(squares: Any, area: _Area) -> Any:
    """Sum squared differences in squares of nine pixels, at the first of each.

    Squares that reach beyond what was summed hold nothing that anybody asks for.
    """
    wide, rows = area.wide, area.high
    nine, width = _NARROW[0], count(wide)
    more, last = nine + _TOGETHER - 1, count(rows * wide - 1)

    # Along rows, some places at a time, then along columns.
    index = dr.arange(mi.UInt32, rows * wide // _TOGETHER)
    places = [dr.minimum(index * _TOGETHER + k, last) for k in range(more)]
    sums = window_sums([dr.gather(mi.Float, squares, 2 * place) for place in places], nine)
    room = [dr.empty(mi.Float, rows * wide)]
    (in_rows,) = _written(room, lambda k: (sums[k],), places[:_TOGETHER])
    block = index // width
    column = index - block * width
    places = [dr.minimum((block * _TOGETHER + k) * width + column, last) for k in range(more)]
    totals = window_sums([dr.gather(mi.Float, in_rows, place) for place in places], nine)
    room = [dr.empty(mi.Float, rows * wide)]
    (noise,) = _written(room, lambda k: (totals[k],), places[:_TOGETHER])
    return noise
