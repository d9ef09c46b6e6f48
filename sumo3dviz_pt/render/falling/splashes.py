"""Crowns of drops that strike wet ground near the camera.

The ground is divided into squares. In each, a number of places flash up one after another, each
somewhere else every time. How high the ground lies there is taken from the picture itself.

References:
    Garg, K., Krishnan, G. and Nayar, S. K., Material based splashing of water drops, EGSR 2007,
    doi:10.2312/EGWR/EGSR07/171-182: crowns are some drop diameters wide and last for tens of
    milliseconds.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.falling import Falling, SkyLight
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.precipitation import drop_speed, rain_sizes
from sumo3dviz_pt.model.ray_planes import planes_of_rays
from sumo3dviz_pt.render.falling.chance import keys_of, shares
from sumo3dviz_pt.render.falling.frames import along, local
from sumo3dviz_pt.render.falling.light import lit
from sumo3dviz_pt.render.falling.seam import laid
from sumo3dviz_pt.render.falling.strokes import Strokes

_LARGE = 1.6
"""Smaller drops leave nothing to be seen [mm]."""

_SQUARE, _TURN, _LIFE = 1.0, 0.5, 0.1  # side [m]; time of a place [s]; of a crown [s]
_FARTHEST = 14.0  # [m]
_WIDE, _HIGH = 7.0, 8.0  # of a crown in diameters of its drop
_DENSE = 0.5  # optical depth of a young crown
_STEP = 12  # of how many rows and columns one tells where the ground lies
_FLAT = 0.7  # how far ground may rise or fall near the camera [m]
_SALT = 0x53706C61

_Pixels = tuple[NDArray[np.intp], NDArray[np.intp]]
"""Rows and columns."""


def splashes(
    falling: Falling, light: SkyLight, seen: Layers, *, lens: Lens, size: tuple[int, int]
) -> Strokes | None:
    """Return the crowns on the ground that a picture shows; None where there are none.

    Args:
        falling: Rain, time, cameras and seed.
        light: Of the sky.
        seen: `depth`, `hit` and perhaps `albedo`.
        lens: Of the camera.
        size: Of the picture [px].
    """
    camera = falling.cameras.mean(axis=0)
    camera[:3, :3] = falling.cameras[0][:3, :3]
    level = _level(seen, camera, lens, size)
    if level is None:
        return None
    events, diameters, ages = _events(falling, camera, all_round=lens.sees_around)
    places = np.column_stack([events, np.full(len(events), level)])

    # The picture tells how high the ground lies where a drop strikes.
    for _ in range(2):
        pixels, ahead = _pixels(places, camera, lens, size)
        heights = _heights(seen, pixels, camera, lens, size)
        places[:, 2] = np.where(np.isfinite(heights), heights, level)
    pixels, ahead = _pixels(places, camera, lens, size)
    away = np.linalg.norm(places - camera[:3, 3], axis=1)
    shown = _distance(seen, pixels)
    good = ahead & (np.abs(places[:, 2] - level) < _FLAT) & (away < _FARTHEST)
    good &= (np.abs(shown - away) < 0.03 * away + 0.03) & _hard(seen, pixels)
    kept = np.flatnonzero(good)
    if not len(kept):
        return None
    places, away = places[kept], away[kept]
    rise = np.sin(np.pi * ages[kept]) * diameters[kept]
    tops = places + np.column_stack([np.zeros((len(kept), 2)), 1e-3 * _HIGH * rise])
    low, middle, high = (
        lens.project(local(each, camera), size)[0] for each in (places, 0.5 * (places + tops), tops)
    )
    per_metre = 1.0 / (lens.pixel_width(size[0]) * away)
    width = 1e-3 * _WIDE * diameters[kept] * (0.5 + 0.5 * ages[kept]) * per_metre
    drawn = np.maximum(width, 1.0)
    length = np.hypot(*(high - low))
    area = width * (1e-3 * _HIGH * rise * per_metre + width)
    cover = area / (drawn * (length + drawn))
    fade = (1.0 - ages[kept]) * np.clip(3.0 * (1.0 - away / _FARTHEST), 0.0, 1.0)
    colours = lit(tops, falling, light, eye=camera[:3, 3], flakes=False)
    crowns = Strokes(low, high, drawn, _DENSE * cover * fade, 0.97 * away, colours)
    return _whole(crowns, middle, lens, size)


def _whole(crowns: Strokes, middle: Floats, lens: Lens, size: tuple[int, int]) -> Strokes:
    """Return strokes, half-way at places (2, n) [px], as pictures that go all around show them."""
    both = laid(crowns.starts, middle, crowns.ends, lens=lens, size=size)
    return replace(crowns.only(both.whose), starts=both.starts, ends=both.ends)


def _events(falling: Falling, camera: Floats, *, all_round: bool) -> tuple[Floats, Floats, Floats]:
    """Return where drops strike, (n, 2) [m], their diameters [mm] and the crowns' ages, [0, 1].

    Args:
        falling: Rain, time and seed.
        camera: Its placement, (4, 4) [m].
        all_round: Whether it sees what is behind it.
    """
    sizes = rain_sizes(falling.rain)
    per_second = float(sizes.above(_LARGE) * drop_speed(_LARGE + 1.0 / sizes.slope))
    count = int(np.ceil(per_second * _SQUARE**2 * _TURN))
    middle = np.floor(camera[:2, 3] / _SQUARE).astype(np.int64)
    reach = np.arange(-int(_FARTHEST / _SQUARE), int(_FARTHEST / _SQUARE) + 1)
    x, y = (grid.reshape(-1) for grid in np.meshgrid(middle[0] + reach, middle[1] + reach))
    if not all_round:
        # Squares behind the camera do not count.
        towards = np.column_stack([x + 0.5, y + 0.5]) * _SQUARE - camera[:2, 3]
        ahead = along(towards, camera[:2, 0]) > -2.0
        x, y = x[ahead], y[ahead]
    squares = np.repeat(np.arange(len(x)), count)
    rank = np.tile(np.arange(count), len(x))
    phase = shares(keys_of(falling.seed + _SALT, x[squares], y[squares], rank), 1)[0]
    turns = falling.time / _TURN + phase
    ages = (turns - np.floor(turns)) * _TURN / _LIFE
    alive = np.flatnonzero(ages < 1.0)
    squares, rank = squares[alive], rank[alive]
    number = np.floor(turns[alive]).astype(np.int64)
    keys = keys_of(falling.seed + _SALT, x[squares], y[squares], rank, number)
    chance = shares(keys, 4)
    kept = np.flatnonzero(chance[3] * count < per_second * _SQUARE**2 * _TURN)
    places = (np.column_stack([x[squares], y[squares]]) + chance[:2].T) * _SQUARE
    return places[kept], sizes.share_at(chance[2], _LARGE, 6.0)[kept], ages[alive][kept]


def _distance(seen: Layers, pixels: _Pixels) -> Floats:
    """Return how far what some pixels show is, (n,) [m]; infinite in the sky."""
    hit = seen["hit"][pixels].astype(np.float64)
    return np.where(hit > 0.5, seen["depth"][pixels] / np.maximum(hit, 1e-6), np.inf)


def _heights(
    seen: Layers, pixels: _Pixels, camera: Floats, lens: Lens, size: tuple[int, int]
) -> Floats:
    """Return how high what some pixels show lies, (n,) [m]; not finite in the sky."""
    rays = planes_of_rays(lens, size)[(slice(None), *pixels)].astype(np.float64)
    with np.errstate(invalid="ignore"):
        return np.asarray(camera[2, 3] + along(rays.T, camera[2, :3]) * _distance(seen, pixels))


def _level(seen: Layers, camera: Floats, lens: Lens, size: tuple[int, int]) -> float | None:
    """Return about how high the ground near the camera lies [m]; None where none is seen."""
    grid = np.mgrid[_STEP // 2 : size[1] : _STEP, _STEP // 2 : size[0] : _STEP]
    few = (grid[0].reshape(-1), grid[1].reshape(-1))
    away, heights = _distance(seen, few), _heights(seen, few, camera, lens, size)
    near = heights[(away < 1.5 * _FARTHEST) & (heights < camera[2, 3] - 0.5)]
    return float(np.percentile(near, 15.0)) if len(near) > 20 else None


def _pixels(
    places: Floats, camera: Floats, lens: Lens, size: tuple[int, int]
) -> tuple[_Pixels, Bools]:
    """Return the pixels that show places, held inside the picture, and whether they are in it."""
    (rows, columns), ahead = lens.project(local(places, camera), size)
    inside = ahead & (rows > -0.5) & (rows < size[1] - 0.5)
    inside &= (columns > -0.5) & (columns < size[0] - 0.5)
    row, column = (np.rint(np.where(inside, each, 0.0)).astype(np.intp) for each in (rows, columns))
    return (row, column), inside


def _hard(seen: Layers, pixels: _Pixels) -> Bools:
    """Return where the ground is no grass, (n,)."""
    if "albedo" not in seen:
        return np.ones(len(pixels[0]), dtype=np.bool_)
    red, green, blue = seen["albedo"][pixels].T
    return np.asarray(green < 1.15 * np.maximum(red, blue) + 0.01)
