"""Where lamps may be seen directly: only there are many samples traced for them.

Most lamps are smaller than a pixel and need many samples, but all together they cover a small
part of a picture. So every face of a lamp that shines is projected, and rays are traced through
the pixels around it.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
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
    seen = seen[(seen[..., 0] > _NEAREST).any(axis=1)]
    row, column = _spans(seen, view, size)
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


def _spans(seen: Floats, view: View, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the first and last rows, and columns, of triangles in a picture, (2, n) each.

    Args:
        seen: Corners in the camera's frame, (n, 3, 3) [m].
        view: Of the camera.
        size: Width, height [px].
    """
    # Where an edge of a face passes the eye, it lies between the face's corners.
    cut = seen.copy()
    cut[..., 0] = _NEAREST
    places = view.lens.project(np.concatenate([seen, cut], axis=1), size)[0]
    ahead = seen[..., 0] > _NEAREST
    reaches_behind = (~ahead).max(axis=1, keepdims=True)
    counts = np.concatenate([ahead, np.broadcast_to(reaches_behind, ahead.shape)], axis=1)
    low = np.where(counts, places, np.inf).min(axis=-1)
    high = np.where(counts, places, -np.inf).max(axis=-1)
    # Whole numbers are at pixels' centres; one pixel more is kept for rounding.
    spans = np.clip(np.stack([np.floor(low) - 1, np.ceil(high) + 1]), -_BEYOND, _BEYOND)
    return spans[:, 0].astype(int), spans[:, 1].astype(int)
