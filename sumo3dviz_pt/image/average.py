"""Averages a frame with what its neighbours saw of the same things in the same light.

What a neighbour saw counts where the same thing is seen in both frames, at the distance that
exact motion tells, and its light has not changed. Where nothing moves before a camera that
stands still, pixels are averaged with themselves; so are the rims of the vehicle that a camera
rides in. Elsewhere the neighbour's nearest pixel is taken, with its texture replaced by that of
this frame: values between pixels would blur it. The sky has no noise and is left alone where the
camera moves. A frame without neighbours comes out as it was.

References:
    Nehab et al., "Accelerating real-time shading with reverse reprojection caching",
    Graphics Hardware 2007, doi:10.2312/EGGH/EGGH07/025-036.
    Schied et al., "Spatiotemporal variance-guided filtering", HPG 2017,
    doi:10.1145/3105762.3105770.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.image.reprojected import (
    MARGIN,
    Pixels,
    RowBand,
    bands_of,
    likeness,
    listed,
    places_of,
    seen_at,
    worth_of,
)
from sumo3dviz_pt.image.traced import (
    PixelMotion,
    TracedFrame,
    all_around,
    layers_of,
    motion_between,
)
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Layers

_MOST_THREADS = 4
"""More wait for memory."""


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
    """What another frame holds of what a band of a frame shows.

    Attributes:
        same: Pixels that correspond to themselves, (h, w).
        pixels: Those that were looked for elsewhere there, n of them.
        hits: Whether these show the same thing there, (n,).
        planes: What is seen of them, (channels, n).
        change: Difference of the logarithms of luminance where there is anything, (h, w).
        worth: How many samples of its own a pixel finds there, (h, w) in (0, 1].
    """

    same: Bools
    pixels: Pixels
    hits: Bools
    planes: Image
    change: Image
    worth: Image

    @property
    def known(self) -> Bools:
        """Where there is anything, (h, w)."""
        known = self.same.copy()
        known.reshape(-1)[self.pixels] |= self.hits
        return known


def accumulated(
    centre: TracedFrame, neighbours: Iterable[TracedFrame], *, threads: int | None = None
) -> Accumulated:
    """Average a frame with its neighbours.

    Neighbours are added in their order, so the number of threads changes no bit.

    Args:
        centre: The frame.
        neighbours: Frames before and after it, of the same size, in any order.
        threads: How many share the work; None goes by the machine.
    """
    threads = threads or min(os.cpu_count() or 1, _MOST_THREADS)
    others = [(other, motion_between(centre, other)) for other in neighbours]
    rims = rims_of(centre, others)
    planes, frames = np.empty_like(centre.planes), np.empty_like(centre.distance)

    def average(band: RowBand) -> None:
        planes[:, band.own], frames[band.own] = _average(band, centre, others, rims)

    with ThreadPoolExecutor(threads) as pool:
        # Threads only read what frames have worked out before.
        list(pool.map(TracedFrame.work_out, [centre, *(other for other, _ in others)]))
        list(pool.map(average, bands_of(centre.layers.size, MARGIN)))
    return Accumulated(centre.layers | layers_of(planes), frames)


def rims_of(centre: TracedFrame, others: Sequence[tuple[TracedFrame, PixelMotion]]) -> Bools:
    """Return the pixels that what rides with a camera covers in part, (h, w).

    These show it in some frames and what is behind it in others, as chance goes, and lie between
    pixels that always show it and such that never do. Alone, each such frame would show mostly
    the one or the other, and the rim would be ragged. A wider band is none: something passes
    before what rides.

    Args:
        centre: The frame.
        others: Its neighbours, and where things went until then.
    """
    riding = [(other, motion) for other, motion in others if motion.riding.any()]
    if not riding:
        return np.zeros(centre.numbers.shape, dtype=bool)
    shown = np.logical_and.reduce([motion.riding for _, motion in riding])[centre.numbers]
    ever, always = shown, shown
    for other, motion in riding:
        shown = motion.riding_there[other.numbers]
        ever, always = ever | shown, always & shown
    return np.asarray(ever & ~always & ~all_around(ever) & ~all_around(~always))


def _average(
    band: RowBand,
    centre: TracedFrame,
    others: Sequence[tuple[TracedFrame, PixelMotion]],
    rims: Bools,
) -> tuple[Image, Image]:
    """Return a band's averaged planes, (channels, h, w), and how many frames they have."""
    total = centre.planes[:, band.own].copy()
    frames = np.ones(total.shape[1:], dtype=np.float32)
    for other, motion in others:
        seen = seen_by(other, centre, motion, band=band, rims=rims)
        share = likeness(band.padded(seen.change), band.padded(seen.known))
        share *= seen.worth[band.core]
        frames += share
        _add(total, seen, other.planes[:, band.own], share=share, core=band.core)
    total /= frames
    return total, frames


def _add(total: Image, seen: Seen, planes: Image, *, share: Image, core: slice) -> None:
    """Add to a band what another frame holds of it.

    Args:
        total: Planes, (channels, h, w), changed in place.
        seen: What it holds, also in rows around.
        planes: The other frame's, where pixels correspond to themselves.
        share: By which it counts, (h, w).
        core: The band's own rows among those around it.
    """
    same = seen.same[core]
    if same.any():
        resting = share * same
        for plane, more in zip(total, planes, strict=True):
            plane += more * resting
    first, after = core.start * share.shape[1], core.stop * share.shape[1]
    own: Pixels = slice(first, after)
    pixels: Pixels = slice(None)
    if not isinstance(seen.pixels, slice):
        own = slice(*np.searchsorted(seen.pixels, (first, after)))
        pixels = seen.pixels[own] - first
    moved = share.reshape(-1)[pixels] * seen.hits[own]
    for plane, more in zip(total.reshape(len(total), -1), seen.planes[:, own], strict=True):
        plane[pixels] += more * moved


def seen_by(
    other: TracedFrame,
    centre: TracedFrame,
    motion: PixelMotion,
    *,
    band: RowBand,
    rims: Bools,
) -> Seen:
    """Return what another frame holds of what a band of a frame shows.

    Args:
        other: The other frame.
        centre: The frame.
        motion: From the frame to the other one.
        band: Rows of the frame.
        rims: As `rims_of` finds them in the whole frame.
    """
    width, _ = centre.layers.size
    # Where nothing moves, pixels correspond, whatever else they see.
    same = _corresponding(band, centre, other, motion)
    if motion.riding.any():
        same |= rims[band.rows]
    change = np.zeros(same.shape, dtype=np.float32)
    if same.any():
        np.subtract(centre.levels[band.rows], other.levels[band.rows], out=change)

    # Elsewhere exact motion tells where things lay.
    wanted = ~same & (centre.distance[band.rows] > 0.0)
    moving = band.among(centre.moving, width)
    wanted.reshape(-1)[moving] &= motion.known[band.of(centre.numbers)[moving]]
    pixels = listed(wanted)
    places = places_of(pixels, band, centre, other, motion)
    hits, planes = seen_at(places, band, centre, other)
    hits &= wanted.reshape(-1)[pixels]
    worth = np.ones(same.shape, dtype=np.float32)
    worth.reshape(-1)[pixels] = np.where(hits, worth_of(places), np.float32(1.0))
    flat = change.reshape(-1)
    moved = band.of(centre.levels)[pixels] - centre.levels_of(planes)
    flat[pixels] = np.where(hits, moved, flat[pixels])
    return Seen(same, pixels, hits, planes, change, worth)


def _corresponding(
    band: RowBand, centre: TracedFrame, other: TracedFrame, motion: PixelMotion
) -> Bools:
    """Return the pixels of a band around which nothing moves in either frame, (h, w)."""
    width, _ = centre.layers.size
    resting = np.full(centre.distance[band.rows].shape, motion.still[0])
    if not motion.still.any():
        return resting
    flat = resting.reshape(-1)
    for frame, still in ((centre, motion.still), (other, motion.still_there)):
        moving = band.among(frame.moving, width)
        flat[moving] = still[band.of(frame.numbers)[moving]]
    return all_around(resting)
