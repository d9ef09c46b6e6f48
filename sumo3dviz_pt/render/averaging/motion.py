"""Where things went from one frame to another, as a camera sees them.

Placements are combined in double precision, so that they are right wherever the network lies, and
handed to the device in single precision relative to the camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.model.traced import TracedFrame

_EXACT = 1e-9  # how far a placement may lie from another that counts as the same
_ABOUT = 3e-4  # the same for what rides with a camera: less than a pixel, half a metre away


@dataclass(frozen=True, eq=False)
class PixelMotion:
    """Where things went from one frame to another.

    Attributes:
        placements: From the first camera's frame to the second's, for what stands, then for each
            part of the first frame, (1 + parts, 4, 4).
        known: Whether a part is in both frames and keeps its shape, (1 + parts,).
        there: Numbers of these parts in the second frame, (1 + parts,); -1 for strangers.
        back: Numbers of the second frame's parts in the first one, (1 + its parts,); the same.
    """

    placements: Floats
    known: Bools
    there: NDArray[np.int32]
    back: NDArray[np.int32]

    @cached_property
    def still(self) -> Bools:
        """Which parts are where they were, as the camera sees them, (1 + parts,)."""
        return np.asarray(self.known & (self._moved < _EXACT))

    @cached_property
    def riding(self) -> Bools:
        """Which parts go with a camera that moves, (1 + parts,); never what stands."""
        riding = self.known & (self._moved < _ABOUT) & ~self.still[0]
        riding[0] = False
        return np.asarray(riding)

    def in_second(self, which: Bools) -> Bools:
        """Return for the second frame's parts what holds for the first one's."""
        return np.asarray(np.append(which, False)[self.back])

    @cached_property
    def _moved(self) -> Floats:
        """By how much placements differ from none, (1 + parts,) [m, rad]."""
        return np.asarray(np.abs(self.placements - np.eye(4)).max(axis=(1, 2)))


def motion_between(centre: TracedFrame, other: TracedFrame) -> PixelMotion:
    """Return where things went from one frame to another."""
    to_other = np.linalg.inv(other.view.world_from_camera.matrix)
    from_centre = centre.view.world_from_camera.matrix
    standing = to_other @ from_centre
    if np.array_equal(other.view.world_from_camera.matrix, from_centre):
        standing = np.eye(4)
    there = {part.name: part.world_from_part for part in other.parts}
    placements = np.tile(standing, (1 + len(centre.parts), 1, 1))
    known = np.ones(len(placements), dtype=bool)
    for number, part in enumerate(centre.parts, start=1):
        now, then = part.world_from_part, there.get(part.name)
        if now is None or then is None:
            known[number] = False
        elif not np.array_equal(now.matrix, then.matrix):
            moved = then.matrix @ np.linalg.inv(now.matrix)
            placements[number] = to_other @ moved @ from_centre
    return PixelMotion(placements, known, _numbers_in(other, centre), _numbers_in(centre, other))


def _numbers_in(frame: TracedFrame, others: TracedFrame) -> NDArray[np.int32]:
    """Return which numbers another frame's parts have in a frame, (1 + parts,); -1 if none."""
    names = {part.name: number for number, part in enumerate(frame.parts, start=1)}
    numbers = [0, *(names.get(part.name, -1) for part in others.parts)]
    return np.array(numbers, dtype=np.int32)


def placements_of(motion: PixelMotion) -> Image:
    """Return what kernels need of a frame's parts, (1 + parts, 16).

    Three rows of a placement, then whether it is known, twice the part's number there (negative for
    strangers), whether it is still, and whether it rides with the camera.
    """
    table = np.empty((len(motion.known), 16), np.float32)
    table[:, :12] = motion.placements[:, :3].reshape(-1, 12)
    facts = (motion.known, 2 * motion.there, motion.still, motion.riding)
    table[:, 12:] = np.stack(facts, axis=1)
    return table
