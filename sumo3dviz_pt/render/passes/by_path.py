"""Frames by Mitsuba's path tracer, with a short pass for what guides denoiser, haze and cap.

The short pass finds distances and hits for haze and cap, and guides for the denoiser.

A thin integrator around Mitsuba's path tracer caps every sample, against fireflies. Mitsuba's
`path` has no clamp, and a cap on the mean of n samples lets n times more through. What the cap
takes is a layer beside the picture. So it can be given back where an emitter is seen directly,
reported, and added again for an uncapped picture. The cap takes no measurable time (2.69 against
2.67 CPU-s, 480x270, 16 spp).

By night, lamps that are seen directly are left out and traced by themselves with many samples.
Most are smaller than a pixel: with four samples they went on and off from frame to frame, and
their glare with them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Channels, Layers
from sumo3dviz_pt.render.kernels import Integrator, load, traced
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.passes.samples import Accumulator, capped, pass_seed
from sumo3dviz_pt.render.settings import AfterPass, Clock, RenderSettings, Traced
from sumo3dviz_pt.render.sky.weathered import SUN_DISTANCE


def is_guided(quality: Quality) -> bool:
    """Return whether a denoiser is guided by albedo and normals."""
    return quality.guides and quality.denoise != "none"


PICTURE = frozenset({"radiance", "capped", "lost"})
"""Layers that are found without the pass."""


def is_needed(quality: Quality, *, hazy: bool, layers: Collection[str]) -> bool:
    """Return whether a frame needs the pass at all.

    Args:
        quality: What the picture needs.
        hazy: Whether the scene has haze.
        layers: Those that are wanted besides.
    """
    needs = (hazy and quality.haze) or quality.denoise != "none" or quality.cap is not None
    return needs or not PICTURE.issuperset(layers)


def guide_spp(quality: Quality) -> int:
    """Return the samples of the pass: a quarter of the picture's, between 4 and 16.

    With fewer, haze is noisy where far ground meets the sky.
    """
    return min(max(quality.spp // 4, 4), 16)


LAMP_SPP = 16
"""Samples of a pass over lamps that are seen directly; more at once would take more memory."""


def lamp_passes(quality: Quality) -> int:
    """Return the passes over such lamps: up to eight times as many samples as the picture has.

    They cost little: paths end at the first surface.
    """
    return min(max(quality.spp // 4, 1), 4)


class _Aov(NamedTuple):
    """A layer of the first surface.

    Attributes:
        name: In Mitsuba's integrator `aov`.
        channels: How many it has there.
    """

    name: str
    channels: int


SURFACE = {"albedo": _Aov("albedo", 3), "normal": _Aov("sh_normal", 3)}
"""What the pass finds of the first surface, by the layer's name; one more needs only a row."""

_DISTANCE = Channels({"depth": slice(0, 1), "hit": slice(3, 4)}, 4)
"""Of the integrator `depth` on an `rgba` film: grey distances, and a share of hits as alpha."""

_EMISSION = Channels({"emitted": slice(0, 3)}, 4)
"""Of `_LAMPS` on an `rgba` film."""

_DEPTH: Mapping[str, Any] = {"type": "depth"}

_GUIDES_LAMPS: Mapping[str, Any] = {"type": "path", "max_depth": 1}
"""Sees what emits, and only that: paths end at the first surface."""


def guide_integrator(
    quality: Quality, *, jit: bool, lamps: bool = False, layers: Collection[str] = ()
) -> Integrator:
    """Load the integrator of the pass, for an `rgba` film.

    Args:
        quality: Says what is needed.
        jit: Whether the variant compiles. In others the pass only finds distances, because
            every `aov` sample waits for Python's lock there: it took five times as long as
            the picture.
        lamps: Whether it also finds where lamps are seen directly.
        layers: Those that are wanted besides what the quality needs.
    """
    surface_wanted = not SURFACE.keys().isdisjoint(layers)
    if not jit or not (is_guided(quality) or lamps or surface_wanted):
        return Integrator(load(_DEPTH), _DISTANCE)
    nested, channels = {"depth": _DEPTH}, _DISTANCE
    if lamps:
        nested, channels = {**nested, "lamps": _GUIDES_LAMPS}, channels + _EMISSION
    aovs = ",".join(f"{layer}:{aov.name}" for layer, aov in SURFACE.items())
    surface = Channels.in_order(**{layer: aov.channels for layer, aov in SURFACE.items()})
    return Integrator(load({"type": "aov", "aovs": aovs, **nested}), channels + surface)


def lamp_integrator() -> Integrator:
    """Load what finds `emitted` in a pass of its own, for an `rgba` film."""
    return Integrator(load(_GUIDES_LAMPS), _EMISSION)


def found_by(integrators: Iterable[Integrator]) -> set[str]:
    """Return the layers that `as_guides` makes of what the pass's integrators trace."""
    names = {name for integrator in integrators for name in integrator.channels.places}
    return names | {"lamp"} if "emitted" in names else names


def as_guides(traced: Layers) -> Layers:
    """Prepare what the pass found: the sun is no surface, and lamps are marked.

    Args:
        traced: `depth` and `hit`; `emitted`, `albedo` and `normal` if they were traced.

    Returns:
        The same layers with `hit` in [0, 1]; and `lamp` where there is `emitted`.
    """
    depth, hit = traced["depth"], np.clip(traced["hit"], 0.0, 1.0)
    # The sun's disc is an object only in the renderer: a ray that meets it has hit no surface.
    hit = np.where(depth > 0.1 * SUN_DISTANCE, 0.0, hit)
    if "emitted" not in traced:
        return traced | {"hit": hit}
    lit = traced["emitted"].max(axis=-1) > 0.0
    return traced | {"hit": hit, "lamp": (lit & (hit >= 1.0)).astype(np.float32)}


def uncapped(seen: Layers) -> Bools | None:
    """Return where emitters are seen directly, (h, w); None where no guides were traced."""
    if "hit" not in seen:
        return None
    return np.asarray((seen["hit"] < 1.0) | (seen.get("lamp", np.zeros(1)) > 0.0))


def excess(seen: Layers) -> Image:
    """Return what lamps that are seen directly emit, or what the cap took of it, (h, w, 3)."""
    if "glow" in seen:
        return seen["glow"]
    lost, lamp = seen["lost"], seen.get("lamp")
    return np.zeros_like(lost) if lamp is None else lost * lamp[..., None]


_PLUGIN = "sumo3dviz_capped"
_CAPPED_LAMPS = "sumo3dviz_lamps_seen"


def register_capped() -> None:
    """Make the integrators known to the active JIT variant."""

    class CappedIntegrator(mi.SamplingIntegrator):  # type: ignore[misc]
        """Path tracing with samples cut to a limit; hues stay."""

        def __init__(self, props: Any) -> None:
            mi.SamplingIntegrator.__init__(self, props)
            # Opaque: as a literal, every exposure would compile a kernel of its own.
            self.limit = dr.opaque(mi.Float, props["limit"])
            self.path = props["path"]
            self.direct = bool(props["direct"])

        def sample(
            self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True
        ) -> tuple[Any, Any, list[Any]]:
            radiance, valid, _ = self.path.sample(scene, sampler, ray, medium, active)
            sound = dr.all(dr.isfinite(radiance))
            if not self.direct:
                # The difference may be slightly negative by rounding.
                radiance = dr.maximum(radiance - _emitted(scene, ray, active), 0.0)
            peak = dr.maximum(dr.max(radiance), 1e-30)
            within = radiance * dr.minimum(1.0, self.limit / peak)
            # Mitsuba's film with more channels than colours turns NaN into black; Inf gets
            # through, so NaN and Inf travel as Inf in what is lost, and are counted.
            lost = dr.select(sound, radiance - within, np.inf)
            return dr.select(sound, within, 0.0), valid, list(lost)

        def aov_names(self) -> list[str]:
            return ["lost.R", "lost.G", "lost.B"]

    class LampsSeen(mi.SamplingIntegrator):  # type: ignore[misc]
        """What the first surface emits, and nothing else."""

        def sample(
            self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True
        ) -> tuple[Any, Any, list[Any]]:
            del sampler, medium
            return _emitted(scene, ray, active), mi.Mask(active), []

    mi.register_integrator(_PLUGIN, lambda props: CappedIntegrator(props))
    mi.register_integrator(_CAPPED_LAMPS, lambda props: LampsSeen(props))


def _emitted(scene: Any, ray: Any, active: Any) -> Any:
    """Return what the first surface on a ray emits; nothing where a ray ends in the sky."""
    hit = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
    lit = hit.is_valid() & hit.shape.is_emitter() & active
    # Few rays meet a lamp, so the surface's details are computed for those alone.
    si = hit.compute_surface_interaction(ray, mi.RayFlags.All, lit)
    return dr.select(lit, si.emitter(scene, lit).eval(si, lit), 0.0)


def path_integrator(*, max_depth: int, rr_depth: int) -> Integrator:
    """Load Mitsuba's path tracer; it finds `radiance`.

    Args:
        max_depth: Most segments of a path.
        rr_depth: Segments after which paths may end by chance.
    """
    plugin = load({"type": "path", "max_depth": max_depth, "rr_depth": rr_depth})
    return Integrator(plugin, Channels.in_order(radiance=3))


def capped_integrator(path: Integrator, limit: float, *, direct: bool = True) -> Integrator:
    """Load the path tracer with samples cut to a limit; it finds `capped` and `lost`.

    Args:
        path: Mitsuba's path tracer.
        limit: Highest channel value of a sample, scene units.
        direct: Whether lamps that are seen directly are in the picture.
    """
    plugin = {"type": _PLUGIN, "limit": float(limit), "path": path.plugin, "direct": direct}
    return Integrator(load(plugin), Channels.in_order(capped=3, lost=3))


def lamps_seen() -> Integrator:
    """Load what traces lamps that are seen directly, and nothing else; it finds `emitted`."""
    return Integrator(load({"type": _CAPPED_LAMPS}), Channels.in_order(emitted=3))


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
        self._guide_integrator = guide_integrator(
            quality, jit=jit, lamps=lamps, layers=settings.layers
        )
        self._lamp_guide = lamp_integrator() if lamps and not jit else None
        self._lamp_integrator = lamps_seen() if apart else None

    @property
    def finds(self) -> Collection[str]:
        """Layers that it can find besides the picture's."""
        guiding = [one for one in (self._guide_integrator, self._lamp_guide) if one is not None]
        names = found_by(guiding)
        if self._lamp_integrator is not None:
            names |= {"glow"}
        return names | set(SURFACE) if self._jit else names

    def trace(self, seed: int, after_pass: AfterPass | None) -> Traced:
        """Trace what the scene shows, in all passes of a frame."""
        with self._clock.phase("guides"):
            layers = self._guides(seed)
        with self._clock.phase("render"):
            return Traced(layers, self._passes(seed, uncapped(layers), after_pass))

    def _guides(self, seed: int) -> Layers:
        """Trace what guides denoiser, haze and cap, or is wanted; nothing where none is."""
        quality = self._settings.quality
        if not is_needed(quality, hazy=self._hazy, layers=self._settings.layers):
            return Layers()
        scene, spp = self._loaded.scene, guide_spp(quality)
        sensor = scene.sensors()[1]
        own = seed ^ 0x5BD1E995
        layers = traced(scene, self._guide_integrator, sensor, spp, own)
        if self._lamp_guide is not None:
            layers |= traced(scene, self._lamp_guide, sensor, spp, own)
        layers = as_guides(layers)
        if self._lamp_integrator is not None:
            layers |= {"glow": self._glow(seed)}
        return layers

    def _glow(self, seed: int) -> Image:
        """Trace lamps that are seen directly, (h, w, 3)."""
        scene, spp, own = self._loaded.scene, LAMP_SPP, seed ^ 0x3C6EF372
        integrator = self._lamp_integrator
        assert integrator is not None
        images = [
            traced(scene, integrator, scene.sensors()[0], spp, pass_seed(own, number))
            for number in range(lamp_passes(self._settings.quality))
        ]
        return np.asarray(np.mean([image["emitted"] for image in images], axis=0))

    def _passes(self, seed: int, exempt: Bools | None, after_pass: AfterPass | None) -> Accumulator:
        """Render all passes of a frame; the cap does not count where pixels are exempt."""
        scene, settings = self._loaded.scene, self._settings
        accumulator = Accumulator(exempt, white=settings.white)
        for number in range(settings.passes):
            own = pass_seed(seed, number)
            values = traced(scene, self._integrator, scene.sensors()[0], settings.pass_spp, own)
            accumulator.add(*self._split(values))
            if after_pass is not None:
                after_pass(number + 1, settings.passes)
        return accumulator

    def _split(self, traced: Layers) -> tuple[Image, Image]:
        """Split a pass into what stays and what the cap took; scalar variants cap whole passes."""
        if "lost" in traced:
            return traced["capped"], traced["lost"]
        limit = np.inf if self._jit else self._settings.limit
        return capped(traced["radiance"], limit)
