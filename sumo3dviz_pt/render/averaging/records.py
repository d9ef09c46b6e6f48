"""Traced frames on the device, as averaging reads them.

Of a film's frames each is brought to the device once, however many others it helps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.lens import Lens, planes_of_rays
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.render.kernels import aligned

NEAR, NEAR_SHARE = 0.02, 0.01
"""How far distances of one surface may differ [m], and as a share."""

GRAZING = 0.05
"""Least cosine by which a surface stretches a pixel."""

DARK = 0.02
"""Share of white that is added before logarithms, so that black has one."""


def number(value: float) -> Any:
    """Return a number that is no part of a kernel's code."""
    return dr.opaque(mi.Float, float(value))


def count(value: int) -> Any:
    """Return a whole number that is no part of a kernel's code."""
    return dr.opaque(mi.UInt32, int(value))


def on_device(values: Image) -> Any:
    """Return numbers on the device, flat."""
    return mi.Float(aligned(values, np.float32))


def level_of(light: Any, weights: Sequence[Any]) -> Any:
    """Return the logarithm of the luminance of radiance, with weights for the scene's white."""
    red, green, blue = weights
    luminance = red * light.x + green * light.y + blue * light.z
    return dr.log(dr.maximum(luminance, 0.0) + DARK)


def weights_of(frame: TracedFrame) -> list[Any]:
    """Return by what a frame's radiance counts in its luminance, where white is 1."""
    return [number(one / frame.white) for one in LUMINANCE]


@dataclass(frozen=True, slots=True, eq=False)
class HeldFrame:
    """A frame on the device; all arrays have a number for each pixel.

    Attributes:
        frame: The frame.
        rays: Through its pixels' middles, in the camera's frame.
        light: Radiance.
        hit: Share of samples that hit something.
        albedo: Of what they hit.
        depth: Mean distance of the samples, 0 where they miss [m].
        normal: Shading normal.
        distance: Of what is seen, along the ray [m]; 0 is the sky.
        room: How far distances within a pixel, or to a neighbour's, may differ [m].
        mark: Twice the number of what moves, and one more where the pixel is pure: where all
            samples met about the same as its first.
        level: Logarithm of luminance.
    """

    frame: TracedFrame
    rays: Any
    light: Any
    hit: Any
    albedo: Any
    depth: Any
    normal: Any
    distance: Any
    room: Any
    mark: Any
    level: Any

    @classmethod
    def of(cls, frame: TracedFrame, rays: Any) -> HeldFrame:
        """Bring a frame to the device.

        Args:
            frame: The frame.
            rays: Of its lens.
        """
        light, albedo, normal = (
            dr.unravel(mi.Vector3f, on_device(frame.layers[name]))
            for name in ("radiance", "albedo", "normal")
        )
        hit, depth, first, ids = (
            on_device(frame.layers[name]) for name in ("hit", "depth", "first_depth", "ids")
        )
        # A surface that is seen from its side is stretched along the ray. Fog shortens normals, so
        # there distances may differ more; fog hides what that lets through.
        turn = [
            mi.Vector3f(*(number(one) for one in column))
            for column in frame.view.world_from_camera.matrix[:3, :3].T.tolist()
        ]
        towards = turn[0] * rays.x + turn[1] * rays.y + turn[2] * rays.z
        facing = dr.clip(dr.abs(dr.dot(towards, normal)), GRAZING, 1.0)
        slope = dr.sqrt(1.0 - facing * facing) / facing
        pixel = number(frame.view.lens.pixel_angle(frame.layers.size[0]))
        room = NEAR + first * (NEAR_SHARE + pixel * slope)

        # A mean lies nearer to the middle of the pixel, if all samples met one surface.
        seen = first > 0.0
        one = (dr.abs(depth - first * hit) < room) & (hit > 0.99)
        pure = dr.select(seen, one, hit < 0.01)
        distance = dr.select(pure & seen, depth / dr.maximum(hit, 1e-6), first)
        mark = 2 * mi.UInt32(ids) + dr.select(pure, mi.UInt32(1), mi.UInt32(0))
        level = level_of(light, weights_of(frame))
        known = (light, hit, albedo, depth, normal, distance, room, mark, level)
        dr.eval(known)
        return cls(frame, rays, *known)


class Records:
    """Frames on the device: those that were asked for last."""

    def __init__(self) -> None:
        self._held: dict[int, HeldFrame] = {}
        self._planes: Image | None = None
        self._rays: Any = None

    def hold(self, frames: Sequence[TracedFrame]) -> list[HeldFrame]:
        """Return frames on the device, and forget all others."""
        self._held = {
            key: held
            for key, held in self._held.items()
            if any(held.frame is frame for frame in frames)
        }
        for frame in frames:
            if id(frame) not in self._held:
                rays = self._rays_of(frame.view.lens, frame.layers.size)
                self._held[id(frame)] = HeldFrame.of(frame, rays)
        return [self._held[id(frame)] for frame in frames]

    def _rays_of(self, lens: Lens, size: tuple[int, int]) -> Any:
        """Return the rays of a lens; most films have one for all frames."""
        planes = planes_of_rays(lens, size)
        if self._planes is not planes:
            self._planes, self._rays = planes, mi.Vector3f(*(on_device(one) for one in planes))
        return self._rays
