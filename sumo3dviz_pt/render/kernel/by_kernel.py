"""Frames by our own kernel, which finds all layers with the picture."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.render.clock import Clock
from sumo3dviz_pt.render.kernel.integrator import CHANNELS, FIRST, Kernel, Limits
from sumo3dviz_pt.render.kernels import tracer
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.passes import guides
from sumo3dviz_pt.render.passes.build import Accumulator, pass_seed
from sumo3dviz_pt.render.passes.capped import lamps_seen
from sumo3dviz_pt.render.settings import AfterPass, RenderSettings, Traced


class ByKernel:
    """Traces frames by our own kernel.

    Args:
        loaded: The scene.
        settings: How to render.
        clock: Measures the passes.
    """

    def __init__(self, loaded: LoadedScene, settings: RenderSettings, *, clock: Clock) -> None:
        self._loaded, self._clock = loaded, clock
        self._kernel: Kernel | None = None
        self.use(settings)

    def use(self, settings: RenderSettings) -> None:
        """Render by other settings from now on, with the same layers."""
        self._settings = settings
        self._numbered = not FIRST.places.keys().isdisjoint(settings.layers)
        self._apart = self._loaded.aimed and settings.quality.cap is not None
        self._lamps = lamps_seen() if self._apart else None
        self._trace_lamps = tracer(recorded=settings.frozen)

    @property
    def finds(self) -> Collection[str]:
        """Layers that it can find besides the picture's."""
        lamps = {"emitted", "lamp"} if self._loaded.aimed else set()
        return {*CHANNELS.places, *FIRST.places, *lamps, *(["glow"] if self._apart else [])}

    def trace(self, seed: int, after_pass: AfterPass | None) -> Traced:
        """Trace what the scene shows, in all passes of a frame."""
        settings = self._settings
        with self._clock.phase("render"):
            kernel = self._followed()
            passes = self._passes(kernel, seed, after_pass)
            found = guides.as_guides(merged(passes, lambda *them: np.mean(them, axis=0)))
            found |= {name: passes[0][name] for name in FIRST.places if name in found}
            if self._apart:
                found |= {"glow": self._glow(seed)}
            accumulator = Accumulator(guides.uncapped(found), white=settings.white)
            for traced in passes:
                accumulator.add(traced["capped"], traced["lost"])
        return Traced(found, accumulator, kernel.movers)

    def _followed(self) -> Kernel:
        """Return the kernel, at what the scene shows."""
        kernel = self._kernel
        if kernel is None or kernel.scene is not self._loaded.scene:
            kernel = Kernel(self._loaded, self._settings.pixel, numbered=self._numbered)
            self._kernel = kernel
        else:
            kernel.follow()
        return kernel

    def _passes(self, kernel: Kernel, seed: int, after_pass: AfterPass | None) -> list[Layers]:
        """Trace all passes."""
        settings, sensor = self._settings, self._loaded.scene.sensors()[0]
        quality = settings.quality
        limits = Limits(quality.max_depth, quality.rr_depth, settings.limit, direct=not self._apart)
        passes = []
        for number in range(settings.passes):
            own = pass_seed(seed, number)
            passes.append(kernel.trace(sensor, spp=settings.pass_spp, seed=own, limits=limits))
            if after_pass is not None:
                after_pass(number + 1, settings.passes)
        return passes

    def _glow(self, seed: int) -> Image:
        """Trace lamps that are seen directly, (h, w, 3)."""
        scene, spp, own = self._loaded.scene, guides.LAMP_SPP, seed ^ 0x3C6EF372
        assert self._lamps is not None
        images = [
            self._trace_lamps(scene, self._lamps, scene.sensors()[0], spp, pass_seed(own, number))
            for number in range(guides.lamp_passes(self._settings.quality))
        ]
        return np.asarray(np.mean([image["emitted"] for image in images], axis=0))
