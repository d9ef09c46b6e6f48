"""Averages a frame with what its neighbours saw of the same things in the same light.

What a neighbour saw counts where the same thing is seen in both frames, at the distance that
exact motion tells, and its light has not changed. Where nothing moves before a camera that
stands still, pixels are averaged with themselves; so are the rims of the vehicle that a camera
rides in. Elsewhere the neighbour's nearest pixel is taken, with its texture replaced by that of
this frame: values between pixels would blur it. The sky has no noise and is left alone where the
camera moves. A frame without neighbours comes out as it was.

All of it is done where frames are traced, by kernels of Dr.Jit: on a processor or on a GPU.

References:
    Nehab et al., "Accelerating real-time shading with reverse reprojection caching",
    Graphics Hardware 2007, doi:10.2312/EGGH/EGGH07/025-036.
    Schied et al., "Spatiotemporal variance-guided filtering", HPG 2017,
    doi:10.1145/3105762.3105770.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.render.averaging.likeness import Doubts
from sumo3dviz_pt.render.averaging.places import (
    NOWHERE,
    Found,
    Neighbour,
    as_here,
    found_by,
    rims_of,
)
from sumo3dviz_pt.render.averaging.records import HeldFrame, Records
from sumo3dviz_pt.render.backend import choose_backend


@dataclass(frozen=True, slots=True, eq=False)
class Accumulated:
    """A frame with its neighbours' help.

    Attributes:
        layers: The frame's, those that neighbours know better replaced.
        frames: How many frames' worth of samples each pixel has, (h, w), at least 1.
    """

    layers: Layers
    frames: Image


class Averager:
    """Averages frames of a film; those that help several are brought to the device once.

    Raises:
        RenderError: If no variant of Mitsuba that compiles works here.
    """

    def __init__(self) -> None:
        if "scalar" in (mi.variant() or "scalar") and not choose_backend().jit:
            raise RenderError(
                "only the variants llvm and cuda average frames with those around them; llvm needs"
                " libLLVM: sumo3dviz-pt doctor --install"
            )
        self._records = Records()

    def accumulated(self, centre: TracedFrame, neighbours: Sequence[TracedFrame]) -> Accumulated:
        """Average a frame with its neighbours.

        Args:
            centre: The frame.
            neighbours: Frames before and after it, of the same size, in any order.
        """
        size = width, height = centre.layers.size
        if not neighbours:
            return Accumulated(centre.layers, np.ones((height, width), np.float32))
        here, others = self._brought(centre, neighbours)
        rims, sums = rims_of(others, here), _Sums.of(here)
        for other in others:
            found = found_by(other, here, rims)
            sums = sums.with_seen(other.held, here, found, Doubts.of(found, size).likeness())
        return sums.means(centre)

    def rims(self, centre: TracedFrame, neighbours: Sequence[TracedFrame]) -> Bools | None:
        """Return the rims of what rides with a camera, (h, w), as `rims_of` finds them."""
        here, others = self._brought(centre, neighbours)
        rims = rims_of(others, here)
        return None if rims is None else np.array(rims).reshape(centre.numbers.shape)

    def _brought(
        self, centre: TracedFrame, neighbours: Sequence[TracedFrame]
    ) -> tuple[HeldFrame, list[Neighbour]]:
        """Bring frames to the device."""
        here, *others = self._records.hold([centre, *neighbours])
        return here, [Neighbour.of(other, here) for other in others]


def accumulated(centre: TracedFrame, neighbours: Sequence[TracedFrame]) -> Accumulated:
    """Average a frame with its neighbours, and keep nothing for others; see `Averager`."""
    return Averager().accumulated(centre, neighbours)


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """Sums of what frames saw of each pixel, each as far as it counts.

    Attributes:
        light: Of radiance.
        hit: Of shares of samples that hit something.
        albedo: Of reflectance.
        depth: Of distances.
        normal: Of normals.
        frames: By how many frames these are sums.
    """

    light: Any
    hit: Any
    albedo: Any
    depth: Any
    normal: Any
    frames: Any

    @classmethod
    def of(cls, held: HeldFrame) -> _Sums:
        """Begin with a frame, which counts once."""
        frames = mi.Float(1.0)
        return cls(held.light, held.hit, held.albedo, held.depth, held.normal, frames)

    @property
    def all(self) -> tuple[Any, ...]:
        """All sums."""
        return self.light, self.hit, self.albedo, self.depth, self.normal, self.frames

    def with_seen(self, other: HeldFrame, centre: HeldFrame, found: Found, likeness: Any) -> _Sums:
        """Return sums with what another frame saw.

        Args:
            other: The other frame.
            centre: The frame.
            found: Which of its pixels the other one shows.
            likeness: Of the light in both.
        """
        there = found.taps != NOWHERE
        share = likeness * _worth_of(found.ratios)
        # The sky, and what is hidden there, cost nothing; nor do pixels that stay where they are.
        seen = (other.light, other.hit, other.albedo, other.depth, other.normal)
        moved = there & (found.ratios > 0.0)
        light, hit, albedo, depth, normal = dr.if_stmt(
            (found.taps, found.ratios, centre.albedo, seen),
            moved,
            _seen_elsewhere,
            lambda _, __, ___, seen: seen,
        )
        share = dr.select(there, share, 0.0)
        sums = _Sums(
            self.light + share * light,
            self.hit + share * hit,
            self.albedo + share * albedo,
            self.depth + share * depth,
            self.normal + share * normal,
            self.frames + share,
        )
        dr.eval(sums.all)
        return sums

    def means(self, frame: TracedFrame) -> Accumulated:
        """Return the means of a frame."""
        layers = {
            "radiance": dr.ravel(self.light / self.frames),
            "albedo": dr.ravel(self.albedo / self.frames),
            "normal": dr.ravel(self.normal / self.frames),
            "hit": self.hit / self.frames,
            "depth": self.depth / self.frames,
        }
        dr.eval(layers)
        pictures = {
            name: np.array(values).reshape(frame.layers[name].shape)
            for name, values in layers.items()
        }
        frames = np.array(self.frames).reshape(frame.numbers.shape)
        return Accumulated(frame.layers | pictures, frames)


def _seen_elsewhere(tap: Any, ratio: Any, albedo_here: Any, seen: Any) -> Any:
    """Return what another frame saw in other pixels, with this frame's texture and distance."""
    light, hit, albedo, depth, normal = (dr.gather(type(plane), plane, tap) for plane in seen)
    return as_here(light, albedo, albedo_here), hit, mi.Vector3f(albedo_here), depth * ratio, normal


def _worth_of(ratio: Any) -> Any:
    """Return how many samples of their own pixels find in another frame, in (0, 1].

    What was smaller there has fewer pixels than here: several pixels share one, and its noise would
    be a blotch of theirs, which the denoiser takes for a crumpled surface. Roads and walls that one
    passes are smaller by the third power of their distance, as they are seen more from their side,
    too; blotches are worse than noise of single pixels, and so it is the fourth.

    Args:
        ratio: Distances here over distances there; negative where pixels correspond to themselves.
    """
    square = dr.square(dr.minimum(ratio, 1.0))
    return square * square
