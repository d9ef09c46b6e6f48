"""A frame as it was traced, which is what neighbours can use of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.model.scene import View

PICTURES = ("radiance", "albedo", "normal", "hit")
"""Layers that are averaged as they are."""

_EXACT = 1e-9  # how far a placement may lie from another that counts as the same


@dataclass(frozen=True, slots=True, eq=False)
class TracedFrame:
    """A frame as it was traced, neither denoised nor hazed.

    Attributes:
        layers: `radiance`, `ids`, `first_depth`; `depth`, `hit`, `albedo` and `normal` where they
            are known; see `model/layers.py`.
        view: Of the camera.
        parts: What the numbers of `ids` stand for, from 1 on.
    """

    layers: Layers
    view: View
    parts: tuple[MovingPart, ...] = ()

    @property
    def ids(self) -> Image:
        """Numbers of what moves, 0 for the rest, (h, w)."""
        return self.layers["ids"]

    @property
    def distance(self) -> Image:
        """Of what the first sample met, along its ray, (h, w) [m]; 0 is the sky."""
        return self.layers["first_depth"]


def relative_motions(centre: TracedFrame, other: TracedFrame) -> tuple[Floats, Bools]:
    """Return where things went from one frame to another, in the frames of the two cameras.

    Placements are combined in double precision, so that the results are right wherever the
    network lies.

    Args:
        centre: A frame.
        other: Another one.

    Returns:
        For what stands, then for each part of the first frame: the placement that takes a point
        from the first camera's frame to the second's, (1 + parts, 4, 4); and whether the part is
        in both frames and keeps its shape, (1 + parts,).
    """
    to_other = np.linalg.inv(other.view.world_from_camera.matrix)
    from_centre = centre.view.world_from_camera.matrix
    there = {part.name: part.world_from_part for part in other.parts}
    motions = np.tile(to_other @ from_centre, (1 + len(centre.parts), 1, 1))
    known = np.ones(len(motions), dtype=bool)
    for number, part in enumerate(centre.parts, start=1):
        now, then = part.world_from_part, there.get(part.name)
        if now is None or then is None:
            known[number] = False
        elif not np.array_equal(now.matrix, then.matrix):
            moved = then.matrix @ np.linalg.inv(now.matrix)
            motions[number] = to_other @ moved @ from_centre
    return motions, known


def stays(motions: Floats) -> Bools:
    """Return which placements change nothing, (n,)."""
    return np.asarray(np.abs(motions - np.eye(4)).max(axis=(1, 2)) < _EXACT)


def common_numbers(centre: TracedFrame, other: TracedFrame) -> Image:
    """Return another frame's ids as numbers of this frame's parts, (h, w); -1 for strangers."""
    names = {part.name: number for number, part in enumerate(centre.parts, start=1)}
    numbers = [0, *(names.get(part.name, -1) for part in other.parts)]
    return np.array(numbers, dtype=np.float32)[other.ids.astype(np.intp)]


def all_around(mask: Bools) -> Bools:
    """Return where a mask holds in all of 3 x 3 pixels, (h, w)."""
    return np.asarray(minimum_filter(mask, 3, mode="nearest"))


def any_around(mask: Bools) -> Bools:
    """Return where a mask holds in any of 3 x 3 pixels, (h, w)."""
    return np.asarray(maximum_filter(mask, 3, mode="nearest"))
