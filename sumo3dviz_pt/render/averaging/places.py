"""Where what a frame shows lies in other frames, and whether these show the same thing there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.render.averaging.motion import PixelMotion, motion_between, placements_of
from sumo3dviz_pt.render.averaging.records import (
    HeldFrame,
    count,
    level_of,
    number,
    on_device,
    weights_of,
)
from sumo3dviz_pt.render.kernel.eye import DrJitMath

NOWHERE = 0xFFFFFFFF
"""For the pixel of another frame where that shows nothing of it."""

SAME_PIXEL = -1.0
"""For the ratio of distances where pixels correspond to themselves."""

_LOOSE = 0.5  # share by which distances may differ at edges and in leaves
_GAPS = 0.25  # by how much shares of sky may differ, beside chance
_PLAIN = 0.05  # added to albedos before their ratio is taken
_MOST_UNLIKE = 4.0  # ratio of albedos that is corrected, at most


class _Bending(DrJitMath):
    """What places are worked out with: distortion does not turn back outside of the picture.

    Args:
        end: Slope from which on slopes are only moved.
    """

    def __init__(self, end: Any) -> None:
        self._end = end

    def stretch(self, slopes: Any, distortion: Any) -> Any:
        """Return the factor by which distortion stretches slopes."""
        inside = dr.minimum(slopes, self._end)
        factor = super().stretch(inside, distortion)
        moved = inside * factor + (slopes - inside)
        return dr.select(slopes > self._end, moved / dr.maximum(slopes, 1e-9), factor)


@dataclass(frozen=True, slots=True)
class _EyeNumbers:
    """What places hang on; see `EyeNumbers` in `model/projections.py`."""

    distortion: Any
    shift: Any


class Projection:
    """Where things lie in a picture.

    Args:
        lens: What it is seen with; of a picture of both eyes, the left one's.
        size: Width, height of the picture [px].
    """

    def __init__(self, lens: Lens, size: tuple[int, int]) -> None:
        self._lens, self._size = next(lens.halves(size))[1], lens.eye_size(size)

    def of(self, point: Any) -> tuple[Any, Any, Any]:
        """Return row and column of points in the camera's frame, and whether they can be seen."""
        lens, (width, height) = self._lens, self._size
        across, upwards = (number(edge) for edge in lens.edges(height / width))
        bent = tuple(map(number, lens.distortion)) if any(lens.distortion) else None
        shift = number(lens.shift) if lens.shift else 0.0
        numbers = _EyeNumbers(bent, shift)
        left, up = lens.kind.places(_Bending(number(lens.turning)), numbers, tuple(point))
        row = 0.5 * (number(height) * (1.0 - up / upwards) - 1.0)
        column = 0.5 * (number(width) * (1.0 - left / across) - 1.0)
        return row, column, mi.Bool(True) if lens.kind.sees_behind else point.x > 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Neighbour:
    """Another frame, and where things went until then.

    Attributes:
        held: The frame.
        motion: From the centre to it.
        placements: See `placements_of`, flat.
        seconds: Whether its own parts are still; whether they ride with the camera; one by one.
    """

    held: HeldFrame
    motion: PixelMotion
    placements: Any
    seconds: tuple[Any, Any]

    @classmethod
    def of(cls, held: HeldFrame, centre: HeldFrame) -> Neighbour:
        """Return a frame as the neighbour of another one."""
        motion = motion_between(centre.frame, held.frame)
        still, riding = (motion.in_second(which) for which in (motion.still, motion.riding))
        seconds = mi.Bool(still.tolist()), mi.Bool(riding.tolist())
        return cls(held, motion, on_device(placements_of(motion)), seconds)

    @property
    def has_riders(self) -> bool:
        """Whether anything rides with the camera."""
        return bool(self.motion.riding.any())

    def resting(self, centre: HeldFrame) -> Any:
        """Return where what is seen in both frames is where it was."""
        here = dr.gather(mi.Float, self.placements, (centre.mark >> 1) * 16 + 14)
        return (here > 0.0) & dr.gather(mi.Bool, self.seconds[0], self.held.mark >> 1)

    def riding_here(self, centre: HeldFrame) -> Any:
        """Return where parts of the centre ride with the camera."""
        return dr.gather(mi.Float, self.placements, (centre.mark >> 1) * 16 + 15) > 0.0

    def riding_there(self) -> Any:
        """Return where parts of this frame do."""
        return dr.gather(mi.Bool, self.seconds[1], self.held.mark >> 1)

    def placed(self, point: Any, part: Any) -> tuple[Any, Any, Any]:
        """Return where points of parts are in this frame, if that is known, and their marks."""
        x, y, z, facts = (dr.gather(mi.Vector4f, self.placements, 4 * part + k) for k in range(4))
        ends = (row.x * point.x + row.y * point.y + row.z * point.z + row.w for row in (x, y, z))
        return mi.Vector3f(*ends), (part == 0) | (facts.x > 0.0), facts.y


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What another frame holds of what a frame shows, for each pixel.

    Attributes:
        change: Difference of the logarithms of luminance where there is anything, and 1 there,
            else 0; pairs.
        taps: Which pixels of the other frame these are; `NOWHERE` where there is nothing.
        ratios: Distances here over distances there, or `SAME_PIXEL`.
    """

    change: Any
    taps: Any
    ratios: Any


def found_by(neighbour: Neighbour, centre: HeldFrame, rims: Any | None) -> Found:
    """Return what another frame holds of what a frame shows.

    Args:
        neighbour: The other frame.
        centre: The frame.
        rims: From `rims_of`.
    """
    pixel = dr.arange(mi.UInt32, dr.width(centre.level))
    # Where nothing moves, pixels correspond, whatever else they see.
    same = _at_rest(neighbour, centre, pixel)
    if rims is not None and neighbour.has_riders:
        same |= rims
    # Elsewhere exact motion tells where things lay.
    fits, tap, level, ratio = dr.if_stmt(
        (
            centre.rays * centre.distance,
            centre.distance,
            centre.room,
            centre.mark,
            centre.hit,
            centre.albedo,
            pixel,
            neighbour.held.level,
        ),
        ~same & (centre.distance > 0.0),
        partial(_found_elsewhere, centre, neighbour),
        _found_there,
    )
    there_is = same | fits
    change = mi.Vector2f(centre.level - level, 1.0)
    found = Found(
        dr.ravel(dr.select(there_is, change, 0.0)), dr.select(there_is, tap, NOWHERE), ratio
    )
    dr.eval(found.change, found.taps, found.ratios)
    return found


def _at_rest(neighbour: Neighbour, centre: HeldFrame, pixel: Any) -> Any:
    """Return the pixels around which nothing moves in either frame."""
    if not neighbour.motion.still.any():
        return mi.Bool(False)
    resting = neighbour.resting(centre)
    dr.eval(resting)
    return everywhere(resting, around(pixel, centre.frame.layers.size))


def _found_there(*args: Any) -> tuple[Any, Any, Any, Any]:
    """Return what another frame holds in the very pixels; see `_found_elsewhere`."""
    *_, pixel, level = args
    return mi.Bool(False), mi.UInt32(pixel), mi.Float(level), mi.Float(SAME_PIXEL)


def _found_elsewhere(
    centre: HeldFrame, neighbour: Neighbour, point: Any, here: Any, *seen: Any
) -> tuple[Any, Any, Any, Any]:
    """Return whether another frame shows what pixels show, in which pixels, how bright, how far.

    Args:
        centre: The frame.
        neighbour: The other frame.
        point: What pixels show, in the camera's frame [m].
        here: How far that is [m].
        seen: Room, mark, hits and albedo of the pixels; more is not needed.
    """
    room, mark, hit, albedo, *_ = seen
    held, (width, height) = neighbour.held, centre.frame.layers.size
    moved, known, mark_there = neighbour.placed(point, mark >> 1)
    row, column, ahead = Projection(held.frame.view.lens, (width, height)).of(moved)
    row, column = dr.round(row), dr.round(column)
    ahead &= (row >= 0.0) & (row < number(height)) & (column >= 0.0) & (column < number(width))
    wanted = ahead & known
    tap = mi.UInt32(dr.select(wanted, row, 0.0)) * count(width)
    tap += mi.UInt32(dr.select(wanted, column, 0.0))
    away = dr.norm(moved)

    # It must be the same thing, at the same distance, with as many gaps.
    there = dr.gather(mi.UInt32, held.mark, tap)
    fits = wanted & (mark_there >= 0.0)
    fits &= there >> 1 == mi.UInt32(dr.maximum(mark_there, 0.0)) >> 1
    both = (mark & there & 1) == 1
    distance = dr.gather(mi.Float, held.distance, tap)
    apart = dr.abs(distance - away)
    fits &= (distance > 0.0) & (apart < dr.select(both, room, _LOOSE * away))
    # Gaps between leaves differ from frame to frame, and the sky behind them is bright.
    gaps = dr.abs(dr.gather(mi.Float, held.hit, tap) - hit)
    fits &= gaps <= _GAPS + number(0.5 / centre.frame.samples)
    light, albedo_there = (dr.gather(mi.Vector3f, one, tap) for one in (held.light, held.albedo))
    level = level_of(as_here(light, albedo_there, albedo), weights_of(centre.frame))
    return fits, tap, level, here / dr.maximum(away, 1e-6)


def as_here(light: Any, albedo: Any, albedo_here: Any) -> Any:
    """Return the radiance that another frame saw, with this frame's texture."""
    ratio = (albedo_here + _PLAIN) / (albedo + _PLAIN)
    return light * dr.clip(ratio, 1.0 / _MOST_UNLIKE, _MOST_UNLIKE)


def rims_of(neighbours: Sequence[Neighbour], centre: HeldFrame) -> Any | None:
    """Return the pixels that what rides with a camera covers in part; None if nothing does.

    These show it in some frames and what is behind it in others, as chance goes, and lie between
    pixels that always show it and such that never do. Alone, each such frame would show mostly
    the one or the other, and the rim would be ragged. A wider band is none: something passes
    before what rides.

    Args:
        neighbours: The other frames.
        centre: The frame.
    """
    riding = [one for one in neighbours if one.has_riders]
    if not riding:
        return None
    shown = mi.Bool(True)
    for one in riding:
        shown &= one.riding_here(centre)
    ever, always = mi.Bool(shown), mi.Bool(shown)
    for one in riding:
        rider = one.riding_there()
        ever |= rider
        always &= rider
        dr.eval(ever, always)
    never = ~always
    dr.eval(ever, never)
    near = around(dr.arange(mi.UInt32, dr.width(ever)), centre.frame.layers.size)
    rims = ever & never & ~everywhere(ever, near) & ~everywhere(never, near)
    dr.eval(rims)
    return rims


def everywhere(mask: Any, pixels: Sequence[Any]) -> Any:
    """Return whether a mask holds in all of some pixels."""
    held = mi.Bool(True)
    for pixel in pixels:
        held &= dr.gather(mi.Bool, mask, pixel)
    return held


def around(pixel: Any, size: tuple[int, int]) -> list[Any]:
    """Return the 3 x 3 pixels around pixels, in a picture that goes on as at its edges."""
    width, last_column, last_row = count(size[0]), count(size[0] - 1), count(size[1] - 1)
    row = pixel // width
    column = pixel - row * width
    columns = (dr.maximum(column, 1) - 1, column, dr.minimum(column + 1, last_column))
    rows = (dr.maximum(row, 1) - 1, row, dr.minimum(row + 1, last_row))
    return [y * width + x for y in rows for x in columns]
