"""Where what a frame shows lies in another frame, by exact motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.image.accumulation.frames import TracedFrame
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints

_FAR = 1e9  # sky counts as so far away, where no eye's movement matters [m]


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where pixels of one frame lie in another.

    Attributes:
        pixels: Their flat indices, (n,); only those that lie inside the other picture.
        row: In the other picture, whole numbers at pixel centres, (n,) [px].
        column: Likewise.
        distance: From the other eye, (n,) [m]; 0 is the sky.
        ahead: From this eye, likewise.
    """

    pixels: Ints
    row: Image
    column: Image
    distance: Image
    ahead: Image


def places_of(wanted: Bools, centre: TracedFrame, other: TracedFrame, motions: Floats) -> Places:
    """Find pixels of a frame in another one.

    Args:
        wanted: Which, (h, w).
        centre: The frame.
        other: The other one.
        motions: From camera to camera, for each number of `ids`, as in `relative_motions`.
    """
    size = centre.layers.size
    pixels = np.flatnonzero(wanted)
    ahead = centre.distance.reshape(-1)[pixels]
    sky = ahead <= 0.0
    reach = np.where(sky, np.float32(_FAR), ahead)
    rays = centre.view.lens.rays(size).astype(np.float32).reshape(-1, 3)[pixels]
    points = _moved(rays * reach[:, None], centre.ids.reshape(-1)[pixels], motions)
    (row, column), in_front = other.view.lens.project(points.astype(np.float64), size)
    inside = in_front & (row > -0.5) & (row < size[1] - 0.5)
    inside &= (column > -0.5) & (column < size[0] - 0.5)
    distance = np.sqrt(np.einsum("ij,ij->i", points, points))
    distance = np.where(sky, np.float32(0.0), distance)
    found = (row, column, distance, ahead)
    return Places(pixels[inside], *(one[inside].astype(np.float32) for one in found))


def _moved(points: Image, numbers: Image, motions: Floats) -> Image:
    """Move points, (n, 3), each by the placement of its number."""
    own = motions.astype(np.float32)
    moved: Image = points @ own[0, :3, :3].T + own[0, :3, 3]
    riding = np.flatnonzero(numbers > 0)
    which = own[numbers[riding].astype(np.intp)]
    moved[riding] = np.einsum("nij,nj->ni", which[:, :3, :3], points[riding]) + which[:, :3, 3]
    return moved
