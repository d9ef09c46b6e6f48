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


def accumulated(centre: TracedFrame, neighbours: Iterable[TracedFrame]) -> Accumulated:
    """Average a frame with its neighbours.

    Args:
        centre: The frame.
        neighbours: Frames before and after it, of the same size, in any order.
    """
    total, weight = centre.planes.copy(), np.ones(centre.distance.shape, dtype=np.float32)
    for other in neighbours:
        seen, known = seen_by(other, centre)
        if not known.any():
            continue
        levels = other.levels if seen is other.planes else centre.levels_of(seen)
        share = likeness(centre.levels - levels, known)
        for plane, more in zip(total, seen, strict=True):
            plane += more * share
        weight += share
    total /= weight
    return Accumulated(centre.layers | layers_of(total), weight)


def seen_by(other: TracedFrame, centre: TracedFrame) -> tuple[Image, Bools]:
    """Return what another frame holds of what a frame shows.

    Args:
        other: The other frame.
        centre: The frame.

    Returns:
        Its planes in the frame's pixels, (channels, h, w), and where they hold anything, (h, w).
    """
    motion = motion_between(centre, other)

    # Where nothing moves, pixels correspond, whatever else they see.
    same = np.zeros(centre.distance.shape, dtype=bool)
    if motion.still.any():
        resting = np.append(motion.still, False)[motion.numbers]
        same = all_around(resting & motion.still[centre.numbers])
    if same.all():
        return other.planes, same

    # Elsewhere exact motion tells where things lay.
    wanted = ~same & motion.known[centre.numbers] & (centre.distance > 0.0)
    places = places_of(wanted, centre, other, motion)
    places, found = seen_at(places, centre, other, motion)
    seen = other.planes.copy() if same.any() else np.zeros_like(other.planes)
    seen.reshape(len(seen), -1)[:, places.pixels] = found
    same.reshape(-1)[places.pixels] = True
    return seen, same
