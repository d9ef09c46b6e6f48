"""The wet pane before a driver's eye: drops that bend what is behind them, and wipers.

The eye looks far, so the pane is out of focus. A drop is a small lens that shows much of the
road scene, upside down; a blade leaves dry glass, on which drops settle anew. Where a drop settles,
and when, follows from its place on the pane and from which turn of the wipers it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.falling import Falling, SkyLight, Windscreen
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.render.falling.drops import keys_of, shares
from sumo3dviz_pt.render.falling.strokes import Strokes, Veil, draw

_CELL = 0.014
"""Side of the squares on the pane that hold one drop at a time [m]."""

_SMALLEST, _LARGEST = 0.0009, 0.0052  # radii of drops [m]
_SETTLES = 0.12  # time in which a drop spreads on the glass [s]
_STAYS = 6.0  # time after which a drop that no blade reaches runs off [s]
_WIDE_VIEW = 9.0  # how many times its own size of the scene a drop shows
_STRONG = 0.9  # share of light that comes through a drop instead
_SWEEP = 0.95  # time of a blade's way up and down [s]
_ANGLES = (0.03, 1.75)  # between which it turns, from lying [rad]
_RUBBER, _ARM = (0.009, 0.02), (0.007, 0.05)  # widths [m], and radiance in the sky's
_HELD = 0.62  # share of a blade's reach at which the arm holds it
_BESIDE = 0.03  # how far below the blade its arm begins [m]
_COARSE = 8
_BEHIND = 1.1  # what is seen through the pane is at least so many times as far away
_PUPIL = 0.004  # at least so wide is the hole through which the pane is seen [m]
_SALT = 0x50616E65


@dataclass(frozen=True, slots=True, eq=False)
class _PaneDrops:
    """Drops on the pane.

    Attributes:
        at: Places on it, (n, 2) [m].
        radii: (n,) [m].
        shown: How much of each is there, (n,) in [0, 1].
    """

    at: Floats
    radii: Floats
    shown: Floats


def through_pane(
    radiance: Image, seen: Layers, falling: Falling, light: SkyLight, lens: Lens
) -> Image:
    """Return a picture as it is seen through the wet pane, (h, w, 3).

    Args:
        radiance: With all that falls behind the pane, (h, w, 3).
        seen: `depth` and `hit`.
        falling: Has the pane.
        light: Of the sky.
        lens: Of the camera.
    """
    pane = falling.windscreen
    assert pane is not None
    hit = seen["hit"]
    distance = np.asarray(seen["depth"] / np.maximum(hit, np.float32(1e-6)), np.float32)
    refracted = _refracted(radiance, (distance, hit), falling, pane, lens)
    return _with_blades(refracted, (distance, hit), falling, pane, light, lens)


def _refracted(
    radiance: Image, before: tuple[Image, Image], falling: Falling, pane: Windscreen, lens: Lens
) -> Image:
    """Return a picture with the drops on the pane."""
    height, width = radiance.shape[:2]
    if pane.wet <= 0.0:
        return radiance
    drops = _drops(falling.seed, pane, falling.time)
    middles, away, focal = _projected(drops.at, pane, lens, (width, height))
    radii, blur = drops.radii * focal / away, 0.5 * max(falling.aperture, _PUPIL) * focal / away
    drawn = np.sqrt(radii**2 + blur**2) + 0.5
    good = (middles[0] > -drawn) & (middles[0] < height + drawn) & (drops.shown > 0.0)
    good &= (middles[1] > -drawn) & (middles[1] < width + drawn) & (away > 0.1)
    shown = np.flatnonzero(good)
    if not len(shown):
        return radiance
    strength = _STRONG * drops.shown * (radii / drawn) ** 1.5
    pixel, owner, off = _discs(middles[:, shown], drawn[shown], (width, height))
    apart = np.hypot(*off) / drawn[shown][owner]
    soft = np.clip(blur / drawn, 0.15, 1.0)[shown][owner]
    mask = np.clip((1.0 - apart) / soft, 0.0, 1.0)
    mask *= mask * (3.0 - 2.0 * mask) * strength[shown][owner]
    distance, hit = (each.reshape(-1)[pixel] for each in before)
    through = (1.0 - hit) + hit * (distance > _BEHIND * away[shown][owner])
    mask *= through

    # Through a drop the scene is seen upside down, and much of it.
    row, column = (
        middles[axis, shown][owner] - _WIDE_VIEW * off[axis] * (radii / drawn)[shown][owner]
        for axis in (0, 1)
    )
    lens_light = _sampled(_coarse(radiance), row, column)
    # Drops that overlap count in the order of their squares.
    flat = np.array(radiance, dtype=np.float32).reshape(-1, 3)
    total = np.bincount(pixel, weights=mask, minlength=width * height)
    covered = np.flatnonzero(total > 0.0)
    share = 1.0 - np.exp(-total[covered] / _STRONG * 1.6)
    share = np.minimum(total[covered], share)
    for channel in range(3):
        sums = np.bincount(pixel, weights=mask * lens_light[:, channel], minlength=len(total))
        mean = sums[covered] / total[covered]
        flat[covered, channel] += share * (mean - flat[covered, channel])
    return flat.reshape(radiance.shape)


def _drops(seed: int, pane: Windscreen, time: float) -> _PaneDrops:
    """Return the drops on a pane at a time [s]."""
    across, tall = pane.size
    columns, rows = int(across / _CELL), int(tall / _CELL)
    row, column = (grid.reshape(-1) for grid in np.mgrid[:rows, :columns])
    middle = np.column_stack([(column + 0.5) * _CELL - 0.5 * across, (row + 0.5) * _CELL])
    since, turn = _wiped(middle, pane)
    # Where no blade reaches, drops run off one by one.
    phase = shares(keys_of(seed + _SALT, row, column), 1)[0]
    stay = time / _STAYS + phase
    free = ~np.isfinite(since)
    number = np.where(free, np.floor(stay), turn).astype(np.int64)
    since = np.where(free, (stay - np.floor(stay)) * _STAYS, since)
    chance = shares(keys_of(seed + _SALT, row, column, number, free.astype(np.int64)), 4)
    # Drops settle at any time, as many in each second.
    settled = -np.log1p(-chance[0]) / (pane.wet * _CELL**2)
    age = since - settled
    shown = np.clip(age / _SETTLES, 0.0, 1.0)
    left = np.where(free, (_STAYS - since) / 0.5, 1.0)
    shown *= np.clip(left, 0.0, 1.0)
    radii = _SMALLEST * (_LARGEST / _SMALLEST) ** (chance[3] ** 1.5)
    index = np.flatnonzero(shown > 0.0)
    at = middle + (chance[1:3].T - 0.5) * 0.7 * _CELL
    return _PaneDrops(at[index], radii[index], shown[index])


def _wiped(places: Floats, pane: Windscreen) -> tuple[Floats, Floats]:
    """Return how long ago blades passed places on the pane [s], and the number of that pass.

    Returns:
        (n,) and (n,); infinitely long where none passes.
    """
    side = 1.0 if pane.pivots[0, 0] >= 0.0 else -1.0
    low, high = _ANGLES
    sweep = min(_SWEEP, pane.period)
    now = pane.wiped * pane.period
    since, number = np.full(len(places), np.inf), np.zeros(len(places))
    for pivot in pane.pivots:
        off = places - pivot
        angle = np.arctan2(off[:, 1], -side * off[:, 0])
        apart = np.hypot(*off.T)
        inside = (apart > pane.reach[0]) & (apart < pane.reach[1]) & (angle > low) & (angle < high)
        share = np.clip((angle - low) / (high - low), 0.0, 1.0)
        up = sweep * np.arccos(1.0 - 2.0 * share) / (2.0 * np.pi)
        for way, at in enumerate((up, sweep - up)):
            turns = np.floor((now - at) / pane.period)
            ago = now - at - turns * pane.period
            later = inside & (ago < since)
            since, number = np.where(later, ago, since), np.where(later, 2.0 * turns + way, number)
    return since, number


def blade_angle(pane: Windscreen) -> float:
    """Return how far the blades are turned up from lying [rad]."""
    sweep, now = min(_SWEEP, pane.period), (pane.wiped % 1.0) * pane.period
    low, high = _ANGLES
    share = 0.5 * (1.0 - np.cos(2.0 * np.pi * now / sweep)) if now < sweep else 0.0
    return float(low + (high - low) * share)


def _with_blades(
    radiance: Image,
    before: tuple[Image, Image],
    falling: Falling,
    pane: Windscreen,
    light: SkyLight,
    lens: Lens,
) -> Image:
    """Return a picture with the blades before it, out of focus, also where they rest."""
    height, width = radiance.shape[:2]
    veil = Veil(*before)
    for ends, (thick, pale) in zip(_wiper_ends(pane), (_ARM, _RUBBER), strict=True):
        places, away, focal = _projected(ends.reshape(-1, 2), pane, lens, (width, height))
        places, away = places.reshape(2, -1, 2), away.reshape(-1, 2).mean(axis=1)
        good = np.flatnonzero(away > 0.15)
        spread = float(np.hypot(thick, max(falling.aperture, _PUPIL)))
        wide, cover = spread * focal / np.maximum(away, 0.15), thick / spread
        strokes = Strokes(
            places[:, good, 0],
            places[:, good, 1],
            np.maximum(wide[good], 1.0),
            np.full(len(good), -np.log1p(-0.93 * cover)),
            away[good],
            np.tile(pale * np.array(light.sky), (len(good), 1)),
        )
        draw(veil, strokes)
    return veil.over(radiance)


def _wiper_ends(pane: Windscreen) -> tuple[Floats, Floats]:
    """Return both ends of the wipers' arms, and of their blades, (n, 2, 2) each [m]."""
    turned = blade_angle(pane)
    side = 1.0 if pane.pivots[0, 0] >= 0.0 else -1.0
    along = np.array([-side * np.cos(turned), np.sin(turned)])
    below = np.array([-side * np.sin(turned), -np.cos(turned)])
    roots, (first, last) = pane.pivots[:, None, :], pane.reach
    blades = roots + np.stack([first * along, last * along])
    arms = roots + np.stack([first * along + _BESIDE * below, _HELD * last * along])
    return arms, blades


def _projected(
    at: Floats, pane: Windscreen, lens: Lens, size: tuple[int, int]
) -> tuple[Floats, Floats, float]:
    """Return where places on the pane lie in the picture, how far away, and pixels per radian."""
    frame = pane.camera_from_pane
    seen = at[:, :1] * frame[:3, 0] + at[:, 1:] * frame[:3, 1] + frame[:3, 3]
    places, ahead = lens.project(seen, size)
    away = np.where(ahead, np.linalg.norm(seen, axis=1), 0.01)
    return places, np.asarray(away), 1.0 / lens.pixel_width(size[0])


def _discs(middles: Floats, radii: Floats, size: tuple[int, int]) -> tuple[Ints, Ints, Floats]:
    """Return the pixels of discs: flat numbers, whose each is, and offsets from its middle."""
    width, height = size
    side = 2 * np.ceil(radii).astype(np.int64) + 1
    owner = np.repeat(np.arange(len(side)), side**2)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(side**2) - side**2, side**2)
    first = np.rint(middles).astype(np.int64) - side // 2
    row, column = first[0][owner] + rank // side[owner], first[1][owner] + rank % side[owner]
    off = np.stack([row - middles[0][owner], column - middles[1][owner]])
    inside: Bools = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    inside &= np.hypot(*off) < radii[owner]
    return (row * width + column)[inside], owner[inside], off[:, inside]


def _coarse(radiance: Image) -> Image:
    """Return a picture with fewer pixels, each the mean of a block."""
    height, width = radiance.shape[:2]
    rows, columns = max(height // _COARSE, 1), max(width // _COARSE, 1)
    whole = radiance[: rows * _COARSE, : columns * _COARSE]
    blocks = whole.reshape(rows, min(_COARSE, height), columns, min(_COARSE, width), 3)
    return np.asarray(blocks.mean(axis=(1, 3)))


def _sampled(small: Image, row: Floats, column: Floats) -> Image:
    """Return the light of a picture of fewer pixels at places in the full one, (n, 3)."""
    rows, columns = small.shape[:2]
    # Beyond the picture's edge the scene goes on as inside of it.
    row, column = (_folded(row / _COARSE, rows), _folded(column / _COARSE, columns))
    top = np.minimum(row.astype(np.intp), rows - 1)
    left = np.minimum(column.astype(np.intp), columns - 1)
    return np.asarray(small[top, left])


def _folded(place: Floats, count: int) -> Floats:
    """Return places mirrored at the ends of [0, count)."""
    turned = np.abs(np.mod(place, 2.0 * count))
    return np.minimum(turned, 2.0 * count - turned - 1e-6)
