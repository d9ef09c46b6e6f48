"""A scene held by Mitsuba and rendered frame by frame: the package's only mutable object."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass, replace

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Layers, merged
from sumo3dviz_pt.model.scene import FrameState, SceneData, View
from sumo3dviz_pt.render.backend import Backend
from sumo3dviz_pt.render.clock import Clock
from sumo3dviz_pt.render.integrator import Integrator
from sumo3dviz_pt.render.kernel.integrator import Kernel, Limits
from sumo3dviz_pt.render.kernels import tracer
from sumo3dviz_pt.render.lights.emitter import register_lamps
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.materials.paint import register_paint
from sumo3dviz_pt.render.materials.stained import register_stained
from sumo3dviz_pt.render.materials.untiled import PIXEL, register_untiled
from sumo3dviz_pt.render.passes import guides
from sumo3dviz_pt.render.passes.build import (
    Accumulator,
    Tally,
    capped,
    frame_seed,
    pass_seed,
    report,
)
from sumo3dviz_pt.render.passes.capped import (
    capped_integrator,
    lamps_seen,
    path_integrator,
    register_capped,
)
from sumo3dviz_pt.render.passes.denoise import denoise, mixed
from sumo3dviz_pt.render.passes.haze import apply_haze, horizon_behind
from sumo3dviz_pt.render.sensors import sensor_entry
from sumo3dviz_pt.render.sky.entries import sky_entry, sky_weight, sun_entry
from sumo3dviz_pt.render.sky.map import SkyMap, bake_sky


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """How to render.

    Attributes:
        size: Width, height [px].
        quality: Samples, depth, denoiser, cap.
        seed: The film's seed.
        white: Radiance that the film shows as white, scene units.
        frozen: Whether frames replay one recording (films); a still does not pay for it.
        pixel: Angle of a pixel, by which textures are filtered [rad].
        layers: What `Session.render` returns; see `model/layers.py`. Those that the quality does
            not need are traced, too.
        kernel: Whether variants that compile trace by our own kernel instead of Mitsuba's path
            tracer.
    """

    size: tuple[int, int]
    quality: Quality
    seed: int
    white: float = 1.0
    frozen: bool = False
    pixel: float = PIXEL
    layers: tuple[str, ...] = ("radiance",)
    kernel: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """One frame.

    Attributes:
        layers: Those that the settings name.
        tally: NaNs, negatives and capped energy.
        cpu: CPU-seconds by phase: load, update, render, guides, denoise.
    """

    layers: Layers
    tally: Tally
    cpu: dict[str, float]

    @property
    def radiance(self) -> Image:
        """The picture: linear sRGB primaries, scene units, (h, w, 3)."""
        return self.layers["radiance"]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """One frame before denoiser and haze.

    Attributes:
        layers: `capped`; `lost`, here with lamps that were traced by themselves; `radiance`, which
            is `capped`, but the plain mean where an emitter is seen directly. As needed: `depth`,
            `hit`, `albedo`, `normal`, `emitted`, `lamp`, `glow`.
        tally: As in `Rendered`.
    """

    layers: Layers
    tally: Tally

    @property
    def distance(self) -> Image:
        """Of what each pixel sees, along its ray, (h, w) [m]; inf where it is the sky."""
        depth, hit = self.layers["depth"], self.layers["hit"]
        return np.where(hit > 0.5, depth / np.maximum(hit, 1e-6), np.inf)


class Session:
    """A scene in Mitsuba. Use it as a context manager: only one can live at a time.

    Args:
        scene: What does not change from frame to frame.
        backend: The variant of Mitsuba.
        settings: How to render.

    Raises:
        ConfigError: If a layer is wanted that cannot be traced.
    """

    def __init__(self, scene: SceneData, backend: Backend, settings: RenderSettings) -> None:
        self.data, self.backend, self.settings = scene, backend, settings
        self.clock = Clock()
        with self.clock.phase("load"):
            if backend.jit:
                register_paint()
                register_stained()
                register_capped()
                register_lamps()
                register_untiled(settings.pixel)
            self.sky: SkyMap = bake_sky(scene.sky)
            self.loaded = LoadedScene(scene, jit=backend.jit)
            weight = sky_weight(self.sky, lamps=self.loaded.aimed)
            self._lights = {"sky": sky_entry(self.sky, weight), **sun_entry(self.sky, weight)}
            self._kernel: Kernel | None = None
            self._use_quality()

    def __enter__(self) -> Session:
        """Start to use the scene."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give everything back, so that another session compiles the same kernels."""
        self._trace = self._trace_guides = self._trace_lamps = tracer(recorded=False)
        self._lights, self._kernel = {}, None
        self.loaded.close()
        gc.collect()

    def activate(self) -> None:
        """Make this session's variant the active one again, after another session's."""
        mi.set_variant(self.backend.variant)

    def render(
        self, frame: FrameState, *, after_pass: Callable[[int, int], None] | None = None
    ) -> Rendered:
        """Render one frame.

        Args:
            frame: What differs from frame to frame.
            after_pass: Called with passes done and passes in all.

        Raises:
            RenderError: If the frame cannot be rendered or holds too many NaNs.
        """
        samples = self.samples(frame, after_pass=after_pass)
        found = samples.layers | {"radiance": self.finish(samples, frame)}
        layers = Layers({name: found[name] for name in self.settings.layers})
        return Rendered(layers, samples.tally, dict(self.clock.seconds))

    def samples(
        self, frame: FrameState, *, after_pass: Callable[[int, int], None] | None = None
    ) -> Samples:
        """Trace one frame; arguments and errors as in `render`."""
        clock = self.clock
        # Loading is charged to the first frame only.
        loading = clock.seconds.get("load", 0.0) if self.loaded.scene is None else 0.0
        clock.seconds = {"load": loading}
        try:
            with clock.phase("update"):
                self.show(frame)
            seed = frame_seed(self.settings.seed, frame.time)
            if self.settings.kernel and self.backend.jit:
                with clock.phase("render"):
                    found, sum_of = self._by_kernel(seed, after_pass)
            else:
                with clock.phase("guides"):
                    found = self._guides(seed)
                with clock.phase("render"):
                    sum_of = self._passes(seed, guides.uncapped(found), after_pass)
        except RuntimeError as error:
            raise RenderError(
                f"Mitsuba ({self.backend.variant}) failed at {frame.time:g} s: {error}"
            ) from error
        report(sum_of.tally, frame.time)
        kept, lost = sum_of.means()
        glow = found.get("glow", np.float32(0.0))
        means = {"capped": kept, "lost": lost + glow, "radiance": sum_of.mean() + glow}
        return Samples(found | means, sum_of.tally)

    def finish(self, samples: Samples, frame: FrameState, *, denoiser: str | None = None) -> Image:
        """Denoise, then lay haze over the picture.

        Args:
            samples: From `samples`.
            frame: The same frame.
            denoiser: Instead of the quality's.

        Returns:
            Radiance, (h, w, 3).
        """
        layers, denoiser = samples.layers, denoiser or self.settings.quality.denoise
        radiance = layers["radiance"]
        with self.clock.phase("denoise"):
            if denoiser != "none":
                # Lamps are so bright that the denoiser would smear them.
                excess = guides.excess(layers)
                radiance = radiance - excess
                # Layers may be here because they are wanted, not as guides.
                known = layers if self.settings.quality.guides else Layers()
                albedo, normal = known.get("albedo"), known.get("normal")
                smooth = denoise(radiance, quality=denoiser, albedo=albedo, normal=normal)
                share = self.settings.quality.raw_share
                radiance = mixed(smooth, radiance, hit=layers["hit"], share=share) + excess
            return self.hazed(layers | {"radiance": radiance}, frame.view)

    def hazed(self, seen: Layers, view: View) -> Image:
        """Return the radiance of a picture with the scene's haze, if quality and scene have any.

        Args:
            seen: `radiance`; `depth` and `hit` where there is haze.
            view: Of the picture's camera.
        """
        haze, radiance = self.data.haze, seen["radiance"]
        if haze is None or not self.settings.quality.haze:
            return radiance
        behind = horizon_behind(self.sky.horizon, view, seen.size)
        return apply_haze(radiance, haze, depth=seen["depth"], hit=seen["hit"], behind=behind)

    def retune(self, quality: Quality, *, seed: int) -> None:
        """Go on with another quality and seed; only another sampler loads the scene anew.

        Raises:
            ConfigError: If a layer is wanted that cannot be traced with this quality.
        """
        before = self.settings.quality
        self.settings = replace(self.settings, quality=quality, seed=seed)
        if quality == before:
            return
        self._use_quality()
        if quality.sampler != before.sampler:
            self.loaded.drop()

    def _use_quality(self) -> None:
        """Make integrators, sensors and the functions that trace."""
        quality = self.settings.quality
        path = path_integrator(max_depth=quality.max_depth, rr_depth=quality.rr_depth)
        in_kernel = self.backend.jit and quality.cap is not None
        apart = in_kernel and self.loaded.aimed
        self._integrator = (
            capped_integrator(path, self.limit, direct=not apart) if in_kernel else path
        )
        lamps = self.loaded.aimed and not apart
        jit = self.backend.jit
        self._guide_integrator = guides.guide_integrator(
            quality, jit=jit, lamps=lamps, layers=self.settings.layers
        )
        self._lamp_guide = guides.lamp_integrator() if lamps and not jit else None
        self._lamp_integrator = lamps_seen() if apart else None
        self._check_layers()
        # Each pass has its own recording: a shared one would be recorded anew whenever another
        # integrator uses it.
        self._trace, self._trace_guides, self._trace_lamps = (
            tracer(recorded=self.settings.frozen) for _ in range(3)
        )

    def _check_layers(self) -> None:
        """Raise a ConfigError if a layer is wanted that is not traced."""
        guiding = [one for one in (self._guide_integrator, self._lamp_guide) if one is not None]
        found = guides.PICTURE | guides.found_by(guiding)
        if self._lamp_integrator is not None:
            found |= {"glow"}
        if self.backend.jit:
            found |= set(guides.SURFACE)
        for name in self.settings.layers:
            if name not in found:
                raise ConfigError(
                    f"layer {name!r} cannot be traced with this scene, quality and variant"
                    f" ({self.backend.variant}){did_you_mean(name, found)}"
                )

    @property
    def limit(self) -> float:
        """Highest channel value of a sample."""
        cap = self.settings.quality.cap
        return np.inf if cap is None else cap * self.settings.white

    @property
    def _pass_spp(self) -> int:
        """Samples per pass: the preset's, but never more than in all."""
        quality = self.settings.quality
        return min(quality.pass_spp, quality.spp)

    def show(self, frame: FrameState) -> None:
        """Bring the scene to a frame's state."""
        size, quality = self.settings.size, self.settings.quality
        spp = guides.guide_spp(quality)
        sensors = {
            "sensor": sensor_entry(size, pixels="rgb", sampler=quality.sampler, spp=self._pass_spp),
            "guide": sensor_entry(size, pixels="rgba", sampler="multijitter", spp=spp),
        }
        self.loaded.show(frame, {**sensors, **self._lights})

    def _guides(self, seed: int) -> Layers:
        """Trace what guides denoiser, haze and cap, or is wanted; nothing where none is."""
        quality = self.settings.quality
        hazy = self.data.haze is not None
        if not guides.is_needed(quality, hazy=hazy, layers=self.settings.layers):
            return Layers()
        scene, spp = self.loaded.scene, guides.guide_spp(quality)
        sensor = scene.sensors()[1]
        own = seed ^ 0x5BD1E995
        found = self._trace_guides(scene, self._guide_integrator, sensor, spp, own)
        if self._lamp_guide is not None:
            found |= self._trace_guides(scene, self._lamp_guide, sensor, spp, own)
        found = guides.as_guides(found)
        if self._lamp_integrator is not None:
            found |= {"glow": self._glow(self._lamp_integrator, seed)}
        return found

    def _glow(self, integrator: Integrator, seed: int) -> Image:
        """Trace lamps that are seen directly, (h, w, 3)."""
        scene, spp, own = self.loaded.scene, guides.LAMP_SPP, seed ^ 0x3C6EF372
        images = [
            self._trace_lamps(scene, integrator, scene.sensors()[0], spp, pass_seed(own, number))
            for number in range(guides.lamp_passes(self.settings.quality))
        ]
        return np.asarray(np.mean([image["emitted"] for image in images], axis=0))

    def _passes(
        self,
        seed: int,
        exempt: Bools | None,
        after_pass: Callable[[int, int], None] | None,
    ) -> Accumulator:
        """Render all passes of a frame; the cap does not count where pixels are exempt."""
        scene = self.loaded.scene
        accumulator = Accumulator(exempt, white=self.settings.white)
        count = -(-self.settings.quality.spp // self._pass_spp)
        for number in range(count):
            own = pass_seed(seed, number)
            traced = self._trace(scene, self._integrator, scene.sensors()[0], self._pass_spp, own)
            accumulator.add(*self._split(traced))
            if after_pass is not None:
                after_pass(number + 1, count)
        return accumulator

    def _by_kernel(
        self, seed: int, after_pass: Callable[[int, int], None] | None
    ) -> tuple[Layers, Accumulator]:
        """Trace all passes of a frame by our own kernel, which finds the guides, too."""
        if self._kernel is None or self._kernel.scene is not self.loaded.scene:
            self._kernel = Kernel(self.loaded, self.settings.pixel)
        else:
            self._kernel.follow()
        quality, sensor = self.settings.quality, self.loaded.scene.sensors()[0]
        apart = self._lamp_integrator is not None
        limits = Limits(quality.max_depth, quality.rr_depth, self.limit, direct=not apart)
        count = -(-quality.spp // self._pass_spp)
        passes = []
        for number in range(count):
            own = pass_seed(seed, number)
            passes.append(self._kernel.trace(sensor, spp=self._pass_spp, seed=own, limits=limits))
            if after_pass is not None:
                after_pass(number + 1, count)
        found = guides.as_guides(merged(passes, lambda *them: np.mean(them, axis=0)))
        if self._lamp_integrator is not None:
            found = found | {"glow": self._glow(self._lamp_integrator, seed)}
        accumulator = Accumulator(guides.uncapped(found), white=self.settings.white)
        for traced in passes:
            accumulator.add(traced["capped"], traced["lost"])
        return found, accumulator

    def _split(self, traced: Layers) -> tuple[Image, Image]:
        """Split a pass into what stays and what the cap took; scalar variants cap whole passes."""
        if "lost" in traced:
            return traced["capped"], traced["lost"]
        limit = np.inf if self.backend.jit else self.limit
        return capped(traced["radiance"], limit)
