"""Frames by our own kernel, which finds all layers with the picture."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.render.clock import Clock
from sumo3dviz_pt.render.kernel.integrator import CHANNELS, FIRST, Kernel, Limits
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.passes import guides
from sumo3dviz_pt.render.passes.build import Accumulator, pass_seed
from sumo3dviz_pt.render.settings import AfterPass, RenderSettings, Traced

GLOW_SPP = 64
"""Samples of lamps that are seen directly, where there may be one."""


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

    @property
    def finds(self) -> Collection[str]:
        """Layers that it can find besides the picture's."""
        lamps = {"emitted", "lamp"} if self._loaded.aimed else set()
        return {*CHANNELS.places, *FIRST.places, *lamps, *(["glow"] if self._apart else [])}

    def trace(self, seed: int, after_pass: AfterPass | None) -> Traced:
        """Trace what the scene shows, in all passes of a frame."""
        settings = self._settings
        with self._clock.phase("render"):
            kernel = self.followed()
            passes = self._passes(kernel, seed, after_pass)
            found = guides.as_guides(merged(passes, lambda *them: np.mean(them, axis=0)))
            found |= {name: passes[0][name] for name in FIRST.places if name in found}
            if self._apart:
                found |= {"glow": self._glow(kernel, seed)}
            accumulator = Accumulator(guides.uncapped(found), white=settings.white)
            for traced in passes:
                accumulator.add(traced["capped"], traced["lost"])
        return Traced(found, accumulator, kernel.movers)

    def current(self) -> Kernel:
        """Return the kernel as it last followed the scene, or a new one for another scene."""
        kernel = self._kernel
        known = kernel is not None and kernel.scene is self._loaded.scene
        return kernel if known and kernel is not None else self.followed()

    def followed(self) -> Kernel:
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

    def _glow(self, kernel: Kernel, seed: int) -> Image:
        """Trace lamps that are seen directly, (h, w, 3)."""
        frame, sensor = self._loaded.frame, self._loaded.scene.sensors()[0]
        assert frame is not None, "show a frame first"
        return kernel.glow(sensor, frame.view, spp=GLOW_SPP, seed=seed ^ 0x3C6EF372)
