"""Where lamps may be seen directly: only there are many samples traced for them.

Most lamps are smaller than a pixel and need many samples, but all together they cover a small
part of a picture. So every face of a lamp that shines is projected, and rays are traced through
the pixels around it.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View

_NEAREST = 0.01  # faces that reach behind the eye are cut here [m]
_BEYOND = 1e6  # projected points are kept within this of the picture [px]


def covered(corners: Floats, view: View, size: tuple[int, int]) -> Bools:
    """Return the pixels that triangles may cover, (h, w); others are surely free of them.

    Args:
        corners: In the network's coordinates, (n, 3, 3) [m].
        view: Of the camera.
        size: Width, height [px].
    """
    width, height = size
    seen = (corners - view.position) @ view.world_from_camera.matrix[:3, :3]
    there = np.zeros((height, width), dtype=np.bool_)
    for part, lens in view.lens.halves(size):
        there[part] = _covered(seen, lens, view.lens.eye_size(size))
    return there


def _covered(seen: Floats, lens: Lens, size: tuple[int, int]) -> Bools:
    """Return the pixels of one eye's picture that triangles may cover, (h, w).

    Args:
        seen: Corners in the camera's frame, (n, 3, 3) [m].
        lens: Of the eye.
        size: Width, height [px].
    """
    width, height = size
    if lens.is_straight:
        seen = seen[(seen[..., 0] > _NEAREST).any(axis=1)]
    row, column = _spans(seen, lens, size)
    inside = (row[1] >= 0) & (row[0] < height) & (column[1] >= 0) & (column[0] < width)
    top, bottom = np.clip(row[:, inside], 0, height - 1)
    left, right = np.clip(column[:, inside], 0, width - 1)
    # Each rectangle is written by its corners; sums along both axes fill it.
    edges = np.zeros((height + 1, width + 1), np.int32)
    for rows, columns, sign in (
        (top, left, 1),
        (top, right + 1, -1),
        (bottom + 1, left, -1),
        (bottom + 1, right + 1, 1),
    ):
        np.add.at(edges, (rows, columns), sign)
    return np.asarray(edges.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0)


def _spans(seen: Floats, lens: Lens, size: tuple[int, int]) -> tuple[Ints, Ints]:
    """Return the first and last rows, and columns, of triangles in a picture, (2, n) each.

    Args:
        seen: Corners in the camera's frame, (n, 3, 3) [m].
        lens: Of one eye.
        size: Width, height [px].
    """
    if lens.is_straight:
        low, high = _ends_ahead(seen, lens, size)
    else:
        low, high = _ends_around(seen, lens, size)
    # Whole numbers are at pixels' centres; one pixel more is kept for rounding.
    room = 1.0 + _blur(seen, lens, size[0])
    spans = np.clip(np.stack([np.floor(low) - room, np.ceil(high) + room]), -_BEYOND, _BEYOND)
    return spans[:, 0].astype(int), spans[:, 1].astype(int)


def _ends_ahead(seen: Floats, lens: Lens, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the first, and the last row and column of triangles before a plane picture, (2, n)."""
    # Where an edge of a face passes the eye, it lies between the face's corners.
    cut = seen.copy()
    cut[..., 0] = _NEAREST
    places = lens.project(np.concatenate([seen, cut], axis=1), size)[0]
    ahead = seen[..., 0] > _NEAREST
    reaches_behind = (~ahead).max(axis=1, keepdims=True)
    counts = np.concatenate([ahead, np.broadcast_to(reaches_behind, ahead.shape)], axis=1)
    low = np.where(counts, places, np.inf).min(axis=-1)
    high = np.where(counts, places, -np.inf).max(axis=-1)
    return low, high


def _ends_around(seen: Floats, lens: Lens, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the same for other pictures, whose lines are curves and may go round behind."""
    places = lens.project(seen, size)[0]
    low, high = places.min(axis=-1), places.max(axis=-1)
    # Lamps are small: where one takes up much of the picture, it is near, or cut by its edge.
    wide = (high - low > 0.25 * np.array(size[::-1])[:, None]).any(axis=0)
    bend = 0.25 * (high - low).max(axis=0)
    return np.where(wide, -np.inf, low - bend), np.where(wide, np.inf, high + bend)


def _blur(seen: Floats, lens: Lens, width: int) -> Floats:
    """Return the radius into which a lens blurs triangles, (n,) [px]."""
    if lens.aperture == 0.0:
        return np.zeros(len(seen))
    away = np.maximum(np.linalg.norm(seen, axis=-1).min(axis=1, initial=np.inf), 0.1)
    apart = np.abs(1.0 / away - 1.0 / lens.focus)
    return np.asarray(np.ceil(lens.aperture * apart / lens.pixel_width(width)))
