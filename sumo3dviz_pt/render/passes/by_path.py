"""Frames by Mitsuba's path tracer, with a short pass for what guides denoiser, haze and cap."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.render.clock import Clock
from sumo3dviz_pt.render.kernels import traced
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.passes import guides
from sumo3dviz_pt.render.passes.build import Accumulator, capped, pass_seed
from sumo3dviz_pt.render.passes.capped import capped_integrator, lamps_seen, path_integrator
from sumo3dviz_pt.render.settings import AfterPass, RenderSettings, Traced


class ByPath:
    """Traces frames by integrators of Mitsuba.

    Args:
        loaded: The scene.
        settings: How to render.
        jit: Whether the variant compiles.
        hazy: Whether the scene has haze.
        clock: Measures the passes.
    """

    def __init__(
        self,
        loaded: LoadedScene,
        settings: RenderSettings,
        *,
        jit: bool,
        hazy: bool,
        clock: Clock,
    ) -> None:
        self._loaded, self._settings, self._jit = loaded, settings, jit
        self._hazy, self._clock = hazy, clock
        quality = settings.quality
        path = path_integrator(max_depth=quality.max_depth, rr_depth=quality.rr_depth)
        in_kernel = jit and quality.cap is not None
        apart = in_kernel and loaded.aimed
        self._integrator = (
            capped_integrator(path, settings.limit, direct=not apart) if in_kernel else path
        )
        lamps = loaded.aimed and not apart
        self._guide_integrator = guides.guide_integrator(
            quality, jit=jit, lamps=lamps, layers=settings.layers
        )
        self._lamp_guide = guides.lamp_integrator() if lamps and not jit else None
        self._lamp_integrator = lamps_seen() if apart else None

    @property
    def finds(self) -> Collection[str]:
        """Layers that it can find besides the picture's."""
        guiding = [one for one in (self._guide_integrator, self._lamp_guide) if one is not None]
        found = guides.found_by(guiding)
        if self._lamp_integrator is not None:
            found |= {"glow"}
        return found | set(guides.SURFACE) if self._jit else found

    def trace(self, seed: int, after_pass: AfterPass | None) -> Traced:
        """Trace what the scene shows, in all passes of a frame."""
        with self._clock.phase("guides"):
            found = self._guides(seed)
        with self._clock.phase("render"):
            return Traced(found, self._passes(seed, guides.uncapped(found), after_pass))

    def _guides(self, seed: int) -> Layers:
        """Trace what guides denoiser, haze and cap, or is wanted; nothing where none is."""
        quality = self._settings.quality
        if not guides.is_needed(quality, hazy=self._hazy, layers=self._settings.layers):
            return Layers()
        scene, spp = self._loaded.scene, guides.guide_spp(quality)
        sensor = scene.sensors()[1]
        own = seed ^ 0x5BD1E995
        found = traced(scene, self._guide_integrator, sensor, spp, own)
        if self._lamp_guide is not None:
            found |= traced(scene, self._lamp_guide, sensor, spp, own)
        found = guides.as_guides(found)
        if self._lamp_integrator is not None:
            found |= {"glow": self._glow(seed)}
        return found

    def _glow(self, seed: int) -> Image:
        """Trace lamps that are seen directly, (h, w, 3)."""
        scene, spp, own = self._loaded.scene, guides.LAMP_SPP, seed ^ 0x3C6EF372
        integrator = self._lamp_integrator
        assert integrator is not None
        images = [
            traced(scene, integrator, scene.sensors()[0], spp, pass_seed(own, number))
            for number in range(guides.lamp_passes(self._settings.quality))
        ]
        return np.asarray(np.mean([image["emitted"] for image in images], axis=0))

    def _passes(self, seed: int, exempt: Bools | None, after_pass: AfterPass | None) -> Accumulator:
        """Render all passes of a frame; the cap does not count where pixels are exempt."""
        scene, settings = self._loaded.scene, self._settings
        accumulator = Accumulator(exempt, white=settings.white)
        for number in range(settings.passes):
            own = pass_seed(seed, number)
            found = traced(scene, self._integrator, scene.sensors()[0], settings.pass_spp, own)
            accumulator.add(*self._split(found))
            if after_pass is not None:
                after_pass(number + 1, settings.passes)
        return accumulator

    def _split(self, traced: Layers) -> tuple[Image, Image]:
        """Split a pass into what stays and what the cap took; scalar variants cap whole passes."""
        if "lost" in traced:
            return traced["capped"], traced["lost"]
        limit = np.inf if self._jit else self._settings.limit
        return capped(traced["radiance"], limit)
