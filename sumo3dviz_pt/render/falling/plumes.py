"""Draws spray: soft balls that cover what is behind them, in depth.

Balls are smooth, so they are added up in a small picture for each span of distances; only what
hides them is looked at in the full one.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.ndimage import zoom

from sumo3dviz_pt.model.falling import Falling, SkyLight
from sumo3dviz_pt.model.geometry import Floats, Image, Ints
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.render.falling.frames import local
from sumo3dviz_pt.render.falling.light import lit
from sumo3dviz_pt.render.falling.seam import laid
from sumo3dviz_pt.render.falling.veil import Veil

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
