"""Turns drops and flakes into strokes: where they were seen while the shutter was open.

References:
    Garg, K. and Nayar, S. K., Vision and rain, International Journal of Computer Vision 75,
    2007, doi:10.1007/s11263-006-0028-6: the share of a pixel's light that a drop takes is the
    time that it is before the pixel over the exposure.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.falling import Cabin, Falling, SkyLight
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.render.falling.field import NEAR, NEAREST, Drops
from sumo3dviz_pt.render.falling.frames import local
from sumo3dviz_pt.render.falling.kinds import Reach
from sumo3dviz_pt.render.falling.light import lit
from sumo3dviz_pt.render.falling.seam import laid
from sumo3dviz_pt.render.falling.strokes import WIDEST, Strokes

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
    kept = np.flatnonzero((depths > 1e-5) & (length < _LONGEST * size[0]))
    colours = lit(middle[kept], falling, light, eye=eye, flakes=drops.flakes)
    return Strokes(starts[:, kept], ends[:, kept], drawn[kept], depths[kept], away[kept], colours)


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
    kept = np.flatnonzero(good)
    return drops.only(kept), starts[:, kept], ends[:, kept]


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
    share = np.clip(share, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))
