"""Lays what falls and flies over a finished picture: strokes, crowns, soft balls of spray.

Drops and flakes leave strokes where they were seen while the shutter was open.

Drops that strike wet ground near the camera leave crowns. The ground is divided into squares. In
each, a number of places flash up one after another, each somewhere else every time. How high the
ground lies there is taken from the picture itself.

Spray is soft balls that cover what is behind them, in depth. Balls are smooth, so they are added up
in a small picture for each span of distances; only what hides them is looked at in the full one.

References:
    Garg, K. and Nayar, S. K., Vision and rain, International Journal of Computer Vision 75,
    2007, doi:10.1007/s11263-006-0028-6: the share of a pixel's light that a drop takes is the
    time that it is before the pixel over the exposure.
    Garg, K., Krishnan, G. and Nayar, S. K., Material based splashing of water drops, EGSR 2007,
    doi:10.2312/EGWR/EGSR07/171-182: crowns are some drop diameters wide and last for tens of
    milliseconds.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from sumo3dviz_pt.model.falling import Cabin, Falling, SkyLight, drop_speed, rain_sizes
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.lens import Lens, planes_of_rays
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.falling import drops as kinds
from sumo3dviz_pt.render.falling.drops import (
    NEAR,
    NEAREST,
    Drops,
    Reach,
    drops_before,
    keys_of,
    shares,
)
from sumo3dviz_pt.render.falling.light import along, lit, local
from sumo3dviz_pt.render.falling.pane import through_pane
from sumo3dviz_pt.render.falling.strokes import WIDEST, Strokes, Veil, draw, laid

_FASTEST_ROLL = 0.2
"""Who moves down the picture nearly as fast as rows are read is drawn out at most five times."""

_LONGEST = 2.0
"""Longer strokes, in widths of the picture, pass close by the lens."""


def strokes_of(
    drops: Drops,
    falling: Falling,
    far: Reach,
    light: SkyLight,
    *,
    lens: Lens,
    size: tuple[int, int],
) -> Strokes:
    """Return what drops or flakes leave in a picture.

    Args:
        drops: In the world.
        falling: Cameras, lamps, exposure.
        far: How far they are drawn.
        light: Of the sky.
        lens: Of the camera.
        size: Of the picture [px].
    """
    drops, starts, ends = _projected(drops, falling, lens=lens, size=size)
    middle = 0.5 * (drops.first + drops.last)
    eye = falling.cameras[:, :3, 3].mean(axis=0)
    away = np.linalg.norm(middle - eye, axis=1)
    width = drops.diameters / away * far.focal
    faded = drops.shown * _near(away) * _far(drops, away, far) * np.exp(-falling.fog * away)

    # A thing out of focus is spread, and its cover with it.
    blur = falling.aperture * far.focal * np.abs(1.0 / away - 1.0 / falling.focus)
    drawn = np.clip(np.sqrt(width**2 + blur**2), 1.0, WIDEST)
    length = np.hypot(*(ends - starts))
    face = 0.25 * np.pi * width**2
    cover = np.minimum(face / (length * drawn + 0.25 * np.pi * drawn**2), 0.98)
    stronger = 1.0 if drops.flakes else falling.strength
    depths = -np.log1p(-cover) * faded * stronger
    seen = np.flatnonzero((depths > 1e-5) & (length < _LONGEST * size[0]))
    colours = lit(middle[seen], falling, light, eye=eye, flakes=drops.flakes)
    return Strokes(starts[:, seen], ends[:, seen], drawn[seen], depths[seen], away[seen], colours)


def _projected(
    drops: Drops, falling: Falling, *, lens: Lens, size: tuple[int, int]
) -> tuple[Drops, Floats, Floats]:
    """Return the drops that are in the picture, and where they begin and end, (2, n) [px]."""
    opening, closing = (
        local(places, camera)
        for places, camera in zip((drops.first, drops.last), falling.cameras, strict=True)
    )
    starts, before = lens.project(opening, size)
    ends, after = lens.project(closing, size)
    middles, _ = lens.project(0.5 * (opening + closing), size)
    strokes = laid(starts, middles, ends, lens=lens, size=size)
    starts, ends = _rolled(strokes.starts, strokes.ends, falling, rows=size[1])
    drops = drops.only(strokes.whose)
    away = (np.linalg.norm(opening + closing, axis=1) * 0.5)[strokes.whose]
    good = (before & after)[strokes.whose] & (away > NEAREST)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    room = np.minimum(0.02 * size[0] / np.maximum(away, NEAREST), 0.5 * WIDEST) + 2.0
    for axis, count in ((0, size[1]), (1, size[0])):
        good &= (high[axis] > -room) & (low[axis] < count + room)
    if falling.cabin is not None:
        good &= ~inside(falling.cabin, 0.5 * (drops.first + drops.last))
    shown = np.flatnonzero(good)
    return drops.only(shown), starts[:, shown], ends[:, shown]


def _rolled(starts: Floats, ends: Floats, falling: Falling, *, rows: int) -> tuple[Floats, Floats]:
    """Return strokes, (2, n) [px] each, as a rolling shutter sees them: each row at its own time.

    Args:
        starts: Where they begin if all rows are seen with the middle one.
        ends: Where they end.
        falling: Has the shutter.
        rows: Of the picture.
    """
    if falling.rolling == 0.0:
        return starts, ends
    # A thing in row r moves on until r is seen, and may be in another row then.
    speeds = (ends - starts) / falling.exposure
    by_row = falling.rolling / rows
    slower = np.maximum(1.0 - speeds[0] * by_row, _FASTEST_ROLL)
    late = [by_row * (places[0] + 0.5 - 0.5 * rows) / slower for places in (starts, ends)]
    return starts + speeds * late[0], ends + speeds * late[1]


def inside(cabin: Cabin, places: Floats) -> Bools:
    """Return whether places, (n, 3) [m], lie in the vehicle around the camera."""
    frame = cabin.world_from_body
    length, width, height = cabin.size
    seen = local(places, frame)
    within = (seen[:, 0] < 0.0) & (seen[:, 0] > -length) & (np.abs(seen[:, 1]) < 0.5 * width)
    return np.asarray(within & (seen[:, 2] > 0.0) & (seen[:, 2] < height))


def _near(away: Floats) -> Floats:
    """Return how much of drops is drawn that come close to the lens."""
    return _smooth((away - NEAREST) / (NEAR - NEAREST))


def _far(drops: Drops, away: Floats, far: Reach) -> Floats:
    """Return how much of drops is drawn that are far away: all within half of the reach."""
    end = far.end(drops.diameters, drops.speeds)
    return _smooth(2.0 * (1.0 - away / end))


def _smooth(share: Floats) -> Floats:
    """Return a smooth step from 0 to 1 of shares."""
    return np.asarray(eased(np.clip(share, 0.0, 1.0)))


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
    index = np.flatnonzero(good)
    if not len(index):
        return None
    places, away = places[index], away[index]
    rise = np.sin(np.pi * ages[index]) * diameters[index]
    tops = places + np.column_stack([np.zeros((len(index), 2)), 1e-3 * _HIGH * rise])
    low, middle, high = (
        lens.project(local(each, camera), size)[0] for each in (places, 0.5 * (places + tops), tops)
    )
    per_metre = 1.0 / (lens.pixel_width(size[0]) * away)
    width = 1e-3 * _WIDE * diameters[index] * (0.5 + 0.5 * ages[index]) * per_metre
    drawn = np.maximum(width, 1.0)
    length = np.hypot(*(high - low))
    area = width * (1e-3 * _HIGH * rise * per_metre + width)
    cover = area / (drawn * (length + drawn))
    fade = (1.0 - ages[index]) * np.clip(3.0 * (1.0 - away / _FARTHEST), 0.0, 1.0)
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
    event = np.flatnonzero(chance[3] * count < per_second * _SQUARE**2 * _TURN)
    places = (np.column_stack([x[squares], y[squares]]) + chance[:2].T) * _SQUARE
    return places[event], sizes.share_at(chance[2], _LARGE, 6.0)[event], ages[alive][event]


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


_SPANS = (0.5, 6.0, 9.0, 13.5, 20.0, 30.0, 45.0, 70.0, 110.0)
"""Distances between which balls are taken together [m]."""

_COARSE = 4
"""Pixels of the full picture along a side of one of the small picture."""

_END = 2.5
"""Radii at which a ball ends."""

_FAINT = 1e-4

_LIT_FROM = 1.5
"""Lamps light a ball as if they were at least so far from its middle [m]."""


def draw_puffs(
    veil: Veil, falling: Falling, light: SkyLight, *, lens: Lens, size: tuple[int, int]
) -> None:
    """Lay spray over a picture.

    Args:
        veil: To which is added.
        falling: Has the puffs, cameras and lamps.
        light: Of the sky.
        lens: Of the camera.
        size: Of the picture [px].
    """
    puffs, camera = falling.puffs, falling.cameras.mean(axis=0)
    camera[:3, :3] = falling.cameras[0][:3, :3]
    seen = local(puffs.at, camera)
    away = np.linalg.norm(seen, axis=1)
    places, ahead = lens.project(seen, size)
    # A ball on the seam of a picture that goes all around is seen at both of its ends.
    both = laid(places, places, places, lens=lens, size=size)
    whose, places = both.whose, both.starts
    away, ahead, puffs = away[whose], ahead[whose], puffs.only(whose)
    radii = puffs.radii / np.maximum(away, 1e-3) / lens.pixel_width(size[0])
    room = _END * radii
    good = ahead & (places[0] > -room) & (places[0] < size[1] + room)
    good &= (places[1] > -room) & (places[1] < size[0] + room)
    # Whoever drives through spray is not shut in by it.
    depths = puffs.depths * np.clip(away / (2.0 * puffs.radii) - 0.5, 0.0, 1.0)
    colours = lit(puffs.at, falling, light, eye=camera[:3, 3], flakes=True, closest=_LIT_FROM)
    for low, high in pairwise(_SPANS):
        which = np.flatnonzero(good & (away >= low) & (away < high))
        if len(which):
            planes = np.column_stack([np.ones(len(which)), away[which], puffs.radii[which]])
            planes = np.column_stack([planes, colours[which]]) * depths[which, None]
            _draw(veil, places[:, which], radii[which], planes)


def _draw(veil: Veil, places: Floats, radii: Floats, planes: Floats) -> None:
    """Lay balls of about the same distance over a picture.

    Args:
        veil: To which is added.
        places: Row and column of each middle, (2, n) [px].
        radii: (n,) [px].
        planes: Optical depth of each, and what is weighted by it: distance, radius, radiance,
            (n, 6).
    """
    width, height = veil.size
    rows, columns = -(-height // _COARSE), -(-width // _COARSE)
    small = np.zeros((6, rows, columns))
    middles, wide = (places + 0.5) / _COARSE - 0.5, np.maximum(radii / _COARSE, 0.5)
    for (row, column), radius, values in zip(middles.T, wide, planes, strict=True):
        down, across = _around(row, radius, rows), _around(column, radius, columns)
        if len(down) and len(across):
            one, other = _bell((down - row) / radius), _bell((across - column) / radius)
            patch = small[:, down[0] : down[-1] + 1, across[0] : across[-1] + 1]
            patch += values[:, None, None] * (one[:, None] * other[None, :])
    covered = small[0] > _FAINT
    if not covered.any():
        return
    # The part of the full picture that anything covers.
    lines, posts = np.flatnonzero(covered.any(axis=1)), np.flatnonzero(covered.any(axis=0))
    box = (slice(lines[0], lines[-1] + 1), slice(posts[0], posts[-1] + 1))
    full = np.stack([zoom(p[box], _COARSE, order=1, grid_mode=True, mode="nearest") for p in small])
    top, left = _COARSE * lines[0], _COARSE * posts[0]
    full = full[:, : height - top, : width - left].astype(np.float32)
    _lay(veil, full, top, left)


def _around(middle: float, radius: float, count: int) -> Ints:
    """Return the rows or columns that a ball reaches."""
    first = max(int(np.ceil(middle - _END * radius)), 0)
    return np.arange(first, min(int(np.floor(middle + _END * radius)), count - 1) + 1)


def _bell(offset: Floats) -> Floats:
    """Return a bell curve that ends at `_END`."""
    last = np.exp(-0.5 * _END**2)
    return np.asarray(np.maximum(np.exp(-0.5 * offset**2) - last, 0.0) / (1.0 - last))


def _lay(veil: Veil, full: Image, top: int, left: int) -> None:
    """Lay planes over a part of the picture, as far as nothing hides them."""
    inside = np.flatnonzero(full[0].reshape(-1) > _FAINT)
    flat = full.reshape(6, -1)[:, inside]
    rows, columns = np.divmod(inside, full.shape[2])
    pixels = (rows + top) * veil.size[0] + columns + left
    depth, mean = flat[0], flat[1:] / flat[0]
    before = (veil.distance[pixels] - mean[0]) / np.maximum(mean[1], np.float32(0.05))
    shown = 1.0 / (1.0 + np.exp(np.clip(-1.7 * before, -30.0, 30.0)))
    hit = veil.hit[pixels]
    veil.add(pixels, depth * (1.0 - hit + hit * shown), mean[2:].T)


_SPLASHING = 2.0
"""Rain from which on it splashes [mm/h]."""


def with_falling(
    radiance: Image, seen: Layers, view: View, falling: Falling, light: SkyLight
) -> Image:
    """Return a picture with all that falls and flies before it, (h, w, 3).

    Args:
        radiance: Finished, (h, w, 3).
        seen: `depth` and `hit`, and perhaps `albedo`.
        view: Of the camera.
        falling: What falls.
        light: Of the sky.
    """
    lens, size = view.lens, seen.size
    if lens.stereo == "none":
        return _laid(radiance, seen, lens, falling, light)
    whole = np.array(radiance, dtype=np.float32)
    for part, eye in lens.halves(size):
        half = Layers({name: layer[part] for name, layer in seen.items()})
        whole[part] = _laid(radiance[part], half, eye, falling, light)
    return whole


def _laid(radiance: Image, seen: Layers, lens: Lens, falling: Falling, light: SkyLight) -> Image:
    """Return one eye's picture with all that falls and flies before it."""
    size, hit = seen.size, seen["hit"]
    veil = Veil(np.asarray(seen["depth"] / np.maximum(hit, np.float32(1e-6)), np.float32), hit)
    if len(falling.puffs.at):
        draw_puffs(veil, falling, light, lens=lens, size=size)
    if falling.rain > _SPLASHING:
        crowns = splashes(falling, light, seen, lens=lens, size=size)
        if crowns is not None:
            draw(veil, crowns)
    for name, matter in kinds.MATTERS.items():
        rate = getattr(falling, name)
        if rate > 0.0:
            drops, far = drops_before(falling, matter(), rate, lens=lens, size=size)
            draw(veil, strokes_of(drops, falling, far, light, lens=lens, size=size))
    laid = veil.over(radiance)
    if falling.windscreen is None:
        return laid
    return through_pane(laid, seen, falling, light, lens)
