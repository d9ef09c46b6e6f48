"""Quick pictures of a scene that is held open: one sample a pixel.

A film's session renders one size with all that a preset needs. The viewer wants a small picture
at once while the camera flies, and a better one when it stands still. So a large picture is
made of parts of the small one's size, each seen through a lens that is shifted aside. One
recording serves both, and no step takes longer than a small picture. Depth and hits, which the
haze needs, are traced with the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Channels, Layers, merged
from sumo3dviz_pt.model.scene import FrameState, View
from sumo3dviz_pt.render.integrator import Integrator
from sumo3dviz_pt.render.kernels import load, settle, tracer
from sumo3dviz_pt.render.passes import guides
from sumo3dviz_pt.render.passes.capped import path_integrator
from sumo3dviz_pt.render.passes.denoise import denoise
from sumo3dviz_pt.render.sensors import WHOLE, PicturePart, part_parameters, sensor_entry
from sumo3dviz_pt.render.session import Session
from sumo3dviz_pt.render.sky.entries import SUN_DISTANCE

Size = tuple[int, int]

_PLUGIN = "sumo3dviz_quick"
_CHANNELS = Channels.in_order(radiance=3, depth=1, hit=1)
"""What the integrator finds: the radiance, then its `aov_names`."""


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
        _register()
        quality = session.settings.quality
        path = path_integrator(max_depth=quality.max_depth, rr_depth=quality.rr_depth)
        plugin = load({"type": _PLUGIN, "limit": session.limit, "path": path.plugin})
        self._integrator = Integrator(plugin, _CHANNELS)
        self._guides = guides.guide_integrator(quality, jit=True)
        self._sensor, self._guiding = (_sensor(size, pixels=pixels) for pixels in ("rgb", "rgba"))
        self._trace, self._trace_guides = tracer(recorded=True), tracer(recorded=True)

    def show(self, frame: FrameState) -> None:
        """Bring everyone on the road to a frame's state."""
        self._session.show(frame)

    def glimpse(self, view: View, *, seed: int, part: PicturePart = WHOLE) -> Layers:
        """Trace one sample a pixel: `radiance`, `depth` and `hit`.

        Args:
            view: Of the camera; everything else is as it was last shown.
            seed: Of this sample.
            part: Of the picture; parts and wholes have the same size in pixels.
        """
        sensor = self._aimed(self._sensor, view, part)
        return self._trace(self._session.loaded.scene, self._integrator, sensor, 1, seed)

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
        found = joined([self._guided(view, part, seed) for part in parts])
        albedo, normal = found.get("albedo"), found.get("normal")
        clean = denoise(seen["radiance"], quality="high", albedo=albedo, normal=normal)
        return seen | {"radiance": clean}

    def _guided(self, view: View, part: PicturePart, seed: int) -> Layers:
        """Trace what guides the denoiser."""
        sensor = self._aimed(self._guiding, view, part)
        spp = guides.guide_spp(self._session.settings.quality)
        own = seed + part.row * part.of + part.column
        return self._trace_guides(self._session.loaded.scene, self._guides, sensor, spp, own)

    def _aimed(self, sensor: Any, view: View, part: PicturePart) -> Any:
        """Aim a sensor such that it sees a part of a camera's picture."""
        parameters = mi.traverse(sensor)
        origin = self._session.loaded.origin
        assert origin is not None, "show a frame first"
        for name, value in part_parameters(view, origin, part).items():
            parameters[name] = value
        parameters.update()
        return sensor


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


def _sensor(size: Size, *, pixels: str) -> Any:
    """Make a pinhole camera that the scene does not hold."""
    sensor = load(sensor_entry(size, pixels=pixels, sampler="independent", spp=1))
    settle(sensor)
    return sensor


def _register() -> None:
    """Make the integrator known to the active JIT variant."""

    class QuickIntegrator(mi.SamplingIntegrator):  # type: ignore[misc]
        """Capped path tracing, with the distance of what is seen."""

        def __init__(self, props: Any) -> None:
            mi.SamplingIntegrator.__init__(self, props)
            self.limit = dr.opaque(mi.Float, props["limit"])
            self.path = props["path"]

        def sample(
            self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True
        ) -> tuple[Any, Any, list[Any]]:
            radiance, valid, _ = self.path.sample(scene, sampler, ray, medium, active)
            radiance = dr.select(dr.all(dr.isfinite(radiance)), dr.maximum(radiance, 0.0), 0.0)
            peak = dr.maximum(dr.max(radiance), 1e-30)
            first = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
            # A ray that meets the sun's disc has hit no surface.
            seen = first.is_valid() & (first.t < 0.1 * SUN_DISTANCE)
            depth = dr.select(seen, first.t, 0.0)
            capped = radiance * dr.minimum(1.0, self.limit / peak)
            return capped, valid, [depth, dr.select(seen, mi.Float(1.0), 0.0)]

        def aov_names(self) -> list[str]:
            return ["depth", "hit"]

    mi.register_integrator(_PLUGIN, lambda props: QuickIntegrator(props))
