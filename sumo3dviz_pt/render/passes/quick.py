"""Quick pictures of a scene that is held open: one sample a pixel.

A film's session renders one size with all that a preset needs. The viewer wants a small picture
at once while the camera flies, and a better one when it stands still. So a large picture is
made of parts of the small one's size, each seen through a lens that is shifted aside, and no
step takes longer than a small picture. Depth and hits, which the haze needs, are traced with
the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.model.scene import FrameState, View
from sumo3dviz_pt.render.convert import WHOLE, PicturePart, part_parameters, sensor_entry
from sumo3dviz_pt.render.kernel.by_kernel import ByKernel
from sumo3dviz_pt.render.kernel.integrator import Limits
from sumo3dviz_pt.render.kernels import load
from sumo3dviz_pt.render.passes import by_path
from sumo3dviz_pt.render.passes.finish import denoise
from sumo3dviz_pt.render.session import Session

Size = tuple[int, int]

_FIRST_SURFACE = 1
"""Length of paths that only find what guides the denoiser."""


def parts_of(count: int) -> tuple[PicturePart, ...]:
    """Return all parts of a picture that is cut into `count` rows and columns, row by row."""
    return tuple(PicturePart(row, column, count) for row in range(count) for column in range(count))


class Quick:
    """Takes quick pictures of a session's scene."""

    def __init__(self, session: Session, size: Size) -> None:
        """Make sensors.

        Args:
            session: That holds the scene; it must show a frame before any picture is taken.
            size: Width, height of a picture, or of each part of a larger one [px].
        """
        self._session, self._size = session, size
        self._sensor = load(sensor_entry(size, pixels="rgb", sampler="independent", spp=1))

    def show(self, frame: FrameState) -> None:
        """Bring everyone on the road to a frame's state."""
        self._session.show(frame)
        self._kernel.followed()

    def glimpse(self, view: View, *, seed: int, part: PicturePart = WHOLE) -> Layers:
        """Trace one sample a pixel: `radiance`, `depth` and `hit`.

        Args:
            view: Of the camera; everything else is as it was last shown.
            seed: Of this sample.
            part: Of the picture; parts and wholes have the same size in pixels.
        """
        quality = self._session.settings.quality
        limits = Limits(quality.max_depth, quality.rr_depth, self._session.limit)
        guide = by_path.as_guides(self._traced(view, part, spp=1, seed=seed, limits=limits))
        return Layers({"radiance": guide["capped"], "depth": guide["depth"], "hit": guide["hit"]})

    def hazed(self, seen: Layers, view: View) -> Image:
        """Return the radiance of a picture with the scene's haze, if it has any, (h, w, 3)."""
        return self._session.hazed(seen, view)

    def smooth(self, seen: Layers, view: View, *, seed: int) -> Layers:
        """Return a picture without noise, by albedo and normals that are traced for it.

        Args:
            seen: The mean of some samples.
            view: Of their camera.
            seed: Of what is traced.
        """
        parts = parts_of(seen.size[0] // self._size[0])
        layers = joined([self._guided(view, part, seed) for part in parts])
        albedo, normal = layers.get("albedo"), layers.get("normal")
        clean = denoise(seen["radiance"], quality="high", albedo=albedo, normal=normal)
        return seen | {"radiance": clean}

    def _guided(self, view: View, part: PicturePart, seed: int) -> Layers:
        """Trace what guides the denoiser."""
        spp = by_path.guide_spp(self._session.settings.quality)
        own = seed + part.row * part.of + part.column
        limits = Limits(_FIRST_SURFACE, _FIRST_SURFACE)
        return self._traced(view, part, spp=spp, seed=own, limits=limits)

    def _traced(
        self, view: View, part: PicturePart, *, spp: int, seed: int, limits: Limits
    ) -> Layers:
        """Trace a part of a camera's picture."""
        sensor, kernel = self._aimed(view, part), self._kernel.current()
        eye = kernel.eye(sensor, view, part=part)
        return kernel.trace(sensor, eye, spp=spp, seed=seed, limits=limits)

    @property
    def _kernel(self) -> ByKernel:
        """What traces."""
        kernel = self._session.by_kernel
        assert kernel is not None, "this variant does not compile"
        return kernel

    def _aimed(self, view: View, part: PicturePart) -> Any:
        """Aim the sensor such that it sees a part of a camera's picture."""
        parameters = mi.traverse(self._sensor)
        origin = self._session.loaded.origin
        assert origin is not None, "show a frame first"
        for name, value in part_parameters(view, origin, part).items():
            parameters[name] = value
        parameters.update()
        return self._sensor


def joined(parts: Sequence[Layers]) -> Layers:
    """Join parts, as `parts_of` orders them, to one picture."""
    return merged(parts, _whole)


def _whole(*parts: Image) -> Image:
    """Join a layer's parts, row by row, to one array."""
    count = round(len(parts) ** 0.5)
    rows = [np.concatenate(parts[k : k + count], axis=1) for k in range(0, len(parts), count)]
    return np.concatenate(rows, axis=0)


def jpeg(pixels: np.ndarray[Any, np.dtype[np.uint8]], *, quality: int = 85) -> bytes:
    """Encode 8-bit sRGB pixels, (h, w, 3), as a JPEG file."""
    stream = mi.MemoryStream()
    bitmap = mi.Bitmap(np.ascontiguousarray(pixels), mi.Bitmap.PixelFormat.RGB)
    bitmap.write(stream, mi.Bitmap.FileFormat.JPEG, quality)
    return bytes(stream.raw_buffer())
