"""Averages a frame with what its neighbours saw of the same things in the same light.

What a neighbour saw counts where the same thing is seen in both frames, at the distance that
exact motion tells, and its light has not changed. Where nothing moves before a camera that
stands still, pixels are averaged with themselves. Elsewhere the neighbour's nearest pixel is
taken, with its texture replaced by that of this frame: values between pixels would blur it. The
sky has no noise and is left alone where the camera moves. A frame without neighbours comes out
as it was.

References:
    Nehab et al., "Accelerating real-time shading with reverse reprojection caching",
    Graphics Hardware 2007, doi:10.2312/EGGH/EGGH07/025-036.
    Schied et al., "Spatiotemporal variance-guided filtering", HPG 2017,
    doi:10.1145/3105762.3105770.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.image.accumulation.frames import (
    TracedFrame,
    all_around,
    layers_of,
    motion_between,
)
from sumo3dviz_pt.image.accumulation.light import likeness
from sumo3dviz_pt.image.accumulation.places import places_of, seen_at
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Layers


@dataclass(frozen=True, slots=True, eq=False)
class Accumulated:
    """A frame with its neighbours' help.

    Attributes:
        layers: The frame's, those that neighbours know better replaced.
        frames: How many frames' worth of samples each pixel has, (h, w), at least 1.
    """

    layers: Layers
    frames: Image


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What another frame holds of what a frame shows.

    Attributes:
        same: Pixels that correspond to themselves, (h, w).
        pixels: Flat indices of others that lie elsewhere there, (n,).
        planes: What is seen of these, (channels, n).
    """

    same: Bools
    pixels: NDArray[np.intp]
    planes: Image

    @property
    def known(self) -> Bools:
        """Where there is anything, (h, w)."""
        known = self.same.copy()
        known.reshape(-1)[self.pixels] = True
        return known


def accumulated(centre: TracedFrame, neighbours: Iterable[TracedFrame]) -> Accumulated:
    """Average a frame with its neighbours.

    Args:
        centre: The frame.
        neighbours: Frames before and after it, of the same size, in any order.
    """
    total, weight = centre.planes.copy(), np.ones(centre.distance.shape, dtype=np.float32)
    flat = total.reshape(len(total), -1)
    for other in neighbours:
        seen = seen_by(other, centre)
        share = likeness(_change(seen, centre, other), seen.known)
        weight += share
        if seen.same.any():
            resting = share * seen.same
            for plane, more in zip(total, other.planes, strict=True):
                plane += more * resting
        moved = np.take(share, seen.pixels)
        for plane, more in zip(flat, seen.planes, strict=True):
            plane[seen.pixels] += more * moved
    total /= weight
    return Accumulated(centre.layers | layers_of(total), weight)


def _change(seen: Seen, centre: TracedFrame, other: TracedFrame) -> Image:
    """Return the difference of the logarithms of luminance, (h, w)."""
    change = np.zeros_like(centre.levels)
    if seen.same.any():
        np.subtract(centre.levels, other.levels, out=change, where=seen.same)
    moved = np.take(centre.levels, seen.pixels) - centre.levels_of(seen.planes)
    change.reshape(-1)[seen.pixels] = moved
    return change


def seen_by(other: TracedFrame, centre: TracedFrame) -> Seen:
    """Return what another frame holds of what a frame shows.

    Args:
        other: The other frame.
        centre: The frame.
    """
    motion = motion_between(centre, other)

    # Where nothing moves, pixels correspond, whatever else they see.
    same = np.zeros(centre.distance.shape, dtype=bool)
    if motion.still.any():
        resting = np.append(motion.still, False)[motion.numbers]
        same = all_around(resting & motion.still[centre.numbers])

    # Elsewhere exact motion tells where things lay.
    wanted = ~same & motion.known[centre.numbers] & (centre.distance > 0.0)
    places, planes = seen_at(places_of(wanted, centre, other, motion), centre, other, motion)
    return Seen(same, places.pixels, planes)
