"""A scene held by Mitsuba and rendered frame by frame, and what each pixel's centre shows.

Centres tell depth, surface and owner without light. A session changes as frames are rendered: its
movers, lamps and kernels are those of the frame that it rendered last.
"""

from __future__ import annotations

import gc
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints
from sumo3dviz_pt.model.layers import Layers, MovingPart
from sumo3dviz_pt.model.scene import FrameState, Haze, Mover, SceneData, View
from sumo3dviz_pt.model.weather import Weather
from sumo3dviz_pt.render.backend import Backend, check_movers, traces_by_optix, watched
from sumo3dviz_pt.render.coated import register_coated
from sumo3dviz_pt.render.convert import sensor_entry
from sumo3dviz_pt.render.draped import register_draped
from sumo3dviz_pt.render.kernel.by_kernel import ByKernel
from sumo3dviz_pt.render.kernel.integrator import CENTRE, Kernel
from sumo3dviz_pt.render.kernel.tables import Owners
from sumo3dviz_pt.render.kernels import free_buffers
from sumo3dviz_pt.render.lights.emitter import register_lamps
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.paint import register_paint, register_stained
from sumo3dviz_pt.render.passes import by_path
from sumo3dviz_pt.render.passes.by_path import ByPath, register_capped
from sumo3dviz_pt.render.passes.finish import Finishing, finished, hazed
from sumo3dviz_pt.render.passes.samples import Tally, frame_seed, report
from sumo3dviz_pt.render.rooms import register_rooms
from sumo3dviz_pt.render.settings import AfterPass, Clock, Traced, Tracer
from sumo3dviz_pt.render.settings import RenderSettings as RenderSettings
from sumo3dviz_pt.render.sky.baked import SkyMap, cached_sky, sky_light
from sumo3dviz_pt.render.sky.weathered import (
    WeatheredSky,
    sky_entry,
    sky_weight,
    sun_entry,
    update_sky,
)
from sumo3dviz_pt.render.textures import register_untiled

OWNERS = ("depth", "face", "instance")
"""What must be asked for to know whose a pixel is."""


@dataclass(frozen=True, slots=True, eq=False)
class PixelFacts:
    """What one place of each pixel shows.

    Attributes:
        layers: What was asked for, by the names of `RAYS` in `render/kernel/integrator.py`, as
            arrays (h, w) or (h, w, c).
        owner: Number at each pixel of the thing that stands, or the part of what moves, (h, w);
            0 where there is none. None where nobody asked for `OWNERS`.
        owners: Names of all numbers.
    """

    layers: Mapping[str, Any]
    owner: Ints | None = None
    owners: Owners | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """By number; of parts such as `vehicle:flow_0.3/wheel2`. The first is empty."""
        return ("",) if self.owners is None else self.owners.names


def facts_of(
    kernel: Kernel,
    loaded: LoadedScene,
    wanted: Collection[str],
    *,
    at: tuple[float, float] = CENTRE,
    owners: Owners | None = None,
) -> PixelFacts:
    """Find what each pixel of the frame that is shown shows.

    Args:
        kernel: Of the scene, at that frame.
        loaded: The scene.
        wanted: Names of `RAYS` in `render/kernel/integrator.py`.
        at: Where in the pixels, in widths and heights of one.
        owners: Of that frame, where they are known already.
    """
    sensor, frame = loaded.scene.sensors()[0], loaded.frame
    assert frame is not None, "show a frame first"
    facts = kernel.met_through(sensor, frame.view, wanted, at)
    if not {*OWNERS} <= {*wanted}:
        return PixelFacts(facts)
    owners = owners or kernel.owners(loaded)
    owner = owners.of(facts["depth"], facts["face"], facts["instance"])
    return PixelFacts(facts, owner, owners)


def points_of(facts: PixelFacts, frame: FrameState, size: tuple[int, int]) -> Floats:
    """Return what each pixel shows in the network's coordinates, (h, w, 3) [m].

    The sky is the eye itself, as its depth is 0.

    Args:
        facts: With `depth`.
        frame: That was shown.
        size: Width, height [px].
    """
    return np.asarray(frame.view.points(facts.layers["depth"], size))


def carried(
    facts: PixelFacts, loaded: LoadedScene, frames: tuple[FrameState, FrameState], points: Floats
) -> tuple[Floats, Bools]:
    """Return where all that pixels show is in another frame, (h, w, 3) [m], and if that is known.

    What stands stays. Bodies that keep their shape move rigidly, and their wheels turn. Of those
    that take poses, as walking people, and of plants in wind the very place on the body's face is
    followed. Unknown is what is not drawn in the other frame.

    Args:
        facts: With `OWNERS` and `corners`.
        loaded: The scene, at the first frame.
        frames: The frame that was shown, and the other.
        points: From `points_of`.
    """
    before, after = (_by_name(frame) for frame in frames)
    assert facts.owner is not None and facts.owners is not None, "ask for `OWNERS`"
    moved, known = points.copy(), np.ones(points.shape[:2], dtype=np.bool_)
    for number in np.unique(facts.owner).tolist():
        name = facts.names[number]
        if name not in before:
            continue
        here = facts.owner == number
        then = after.get(name)
        if then is None:
            known[here] = False
        elif loaded.takes_poses(before[name]):
            face = facts.layers["face"][here]
            own = facts.owners.own_faces(face)
            moved[here] = loaded.place_on(then, own, facts.layers["corners"][here])
        else:
            step = then.world_from_body.matrix @ np.linalg.inv(before[name].world_from_body.matrix)
            moved[here] = points[here] @ step[:3, :3].T + step[:3, 3]
    for name, (first, faces) in facts.owners.windswept.items():
        plants, face = loaded.plants(name), facts.layers["face"].astype(np.int64) - first
        here = (face >= 0) & (face < faces) & (facts.layers["depth"] > 0.0)
        if plants is not None and here.any():
            moved[here] = plants.place_on(frames[1], face[here], facts.layers["corners"][here])
    return moved, known


def _by_name(frame: FrameState) -> dict[str, Mover]:
    """Return everything that moves in a frame, by its name."""
    return {mover.name: mover for mover in (*frame.everyone, *frame.fixtures)}


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """One frame.

    Attributes:
        layers: Those that the settings name.
        tally: NaNs, negatives and capped energy.
        cpu: CPU-seconds by phase: load, update, render, guides, denoise.
        movers: What moves, if the layer `ids` was wanted: its number k is the k-th of these.
    """

    layers: Layers
    tally: Tally
    cpu: dict[str, float]
    movers: tuple[MovingPart, ...] = ()

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
            `hit`, `albedo`, `normal`, `emitted`, `lamp`, `glow`, `ids`, `first_depth`.
        tally: As in `Rendered`.
        movers: As in `Rendered`.
    """

    layers: Layers
    tally: Tally
    movers: tuple[MovingPart, ...] = ()

    @property
    def distance(self) -> Image:
        """Of what each pixel sees, along its ray, (h, w) [m]; inf where it is the sky."""
        depth, hit = self.layers["depth"], self.layers["hit"]
        return np.where(hit > 0.5, depth / np.maximum(hit, 1e-6), np.inf)

    @property
    def apart(self) -> Layers:
        """The layers; light of lamps that are seen directly is `excess`, where there may be any."""
        if self.layers.keys().isdisjoint({"glow", "lamp"}):
            return self.layers
        excess = by_path.excess(self.layers)
        return self.layers | {"radiance": self.layers["radiance"] - excess, "excess": excess}


class Session:
    """A scene in Mitsuba. Use it as a context manager: only one can live at a time.

    Args:
        scene: What does not change from frame to frame.
        backend: The variant of Mitsuba.
        settings: How to render.

    Attributes:
        by_kernel: Traces by our own kernel; None in variants that do not compile.
        frame: That was traced last; None before.

    Raises:
        ConfigError: If a layer is wanted that cannot be traced.
    """

    def __init__(self, scene: SceneData, backend: Backend, settings: RenderSettings) -> None:
        self.data, self.backend, self.settings = scene, backend, settings
        self.clock = Clock()
        self.frame: FrameState | None = None
        with self.clock.phase("load"):
            if backend.jit:
                register_paint()
                register_coated()
                register_stained()
                register_rooms()
                register_capped()
                register_lamps()
                register_untiled(settings.pixel)
                register_draped()
            self.loaded = LoadedScene(scene, jit=backend.jit)
            self._weathered: WeatheredSky | None = None
            if scene.weather is not None:
                self._weathered = WeatheredSky(scene.sky, scene.weather)
            self._weight = 0.0  # that of the first sky stays
            self._show_sky(None if scene.weather is None else scene.weather.first)
            free_buffers()
            self._tracer: Tracer | None = None
            self.by_kernel: ByKernel | None = None
            if backend.jit:
                self.by_kernel = ByKernel(self.loaded, settings, clock=self.clock)
            self._use_quality()

    def _sky_of(self, weather: Weather | None) -> SkyMap:
        """Return the sky of a frame's weather, and tell the scene of its air."""
        if self._weathered is None or weather is None:
            return cached_sky(self.data.sky)
        sky, self.loaded.veil = self._weathered.at(weather)
        return sky

    @property
    def sky(self) -> SkyMap:
        """The sky that is shown: made anew, as its map is large and Mitsuba holds a copy."""
        return self._sky_of(self._sky_weather)

    def _show_sky(self, weather: Weather | None) -> None:
        """Make sky and sun of a frame's weather for Mitsuba, and keep what finishing needs."""
        sky, self._sky_weather = self._sky_of(weather), weather
        self._weight = self._weight or sky_weight(sky, lamps=self.loaded.aimed)
        self._horizon, self._sky_light = sky.horizon, sky_light(sky)
        self._lights = {"sky": sky_entry(sky, self._weight), **sun_entry(sky, self._weight)}

    def __enter__(self) -> Session:
        """Start to use the scene."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give everything back, so that another session compiles the same kernels."""
        self._lights, self._tracer, self.by_kernel = {}, None, None
        self.loaded.close()
        gc.collect()
        free_buffers()

    def activate(self) -> None:
        """Make this session's variant the active one again, after another session's."""
        mi.set_variant(self.backend.variant)

    def render(self, frame: FrameState, *, after_pass: AfterPass | None = None) -> Rendered:
        """Render one frame.

        Args:
            frame: What differs from frame to frame.
            after_pass: Called with passes done and passes in all.

        Raises:
            RenderError: If the frame cannot be rendered or holds too many NaNs.
        """
        samples = self.samples(frame, after_pass=after_pass)
        every = samples.layers | {"radiance": self.finish(samples, frame)}
        layers = Layers({name: every[name] for name in self.settings.layers})
        return Rendered(layers, samples.tally, dict(self.clock.seconds), samples.movers)

    def samples(self, frame: FrameState, *, after_pass: AfterPass | None = None) -> Samples:
        """Trace one frame; arguments and errors as in `render`."""
        clock = self.clock
        # Loading is charged to the first frame only.
        loading = clock.seconds.get("load", 0.0) if self.loaded.scene is None else 0.0
        clock.seconds = {"load": loading}
        try:
            seed = frame_seed(self.settings.seed, frame.time)
            assert self._tracer is not None, "the session was closed"
            with watched(self.backend.variant):
                layers, passes, movers = self._traced(frame, seed, after_pass)
        except RuntimeError as error:
            raise RenderError(
                f"Mitsuba ({self.backend.variant}) failed at {frame.time:.12g} s: {error}"
            ) from error
        shown, variant = self.loaded.frame, self.backend.variant
        if traces_by_optix(variant) and shown is not None and "ids" in layers:
            check_movers(self.loaded.scene, shown, layers["ids"], variant=variant)
        report(passes.tally, frame.time)
        within, lost = passes.means()
        mean, glow = passes.mean(), layers.get("glow")
        if glow is not None:
            lost, mean = lost + glow, mean + glow
        means = {"capped": within, "lost": lost, "radiance": mean}
        return Samples(layers | means, passes.tally, movers)

    def _traced(self, frame: FrameState, seed: int, after_pass: AfterPass | None) -> Traced:
        """Trace a frame, at one moment or at all of its exposure.

        Raises:
            ConfigError: If the tracer has no lens or shutter of our own.
        """
        assert self._tracer is not None, "the session was closed"
        self.frame = frame
        ours = self.by_kernel if self._tracer is self.by_kernel else None
        if ours is None and (frame.exposure or not frame.view.lens.is_pinhole):
            raise ConfigError(
                "only our own kernel has lenses other than pinholes, and shutters: take the variant"
                " llvm or cuda, and a quality with `tracer: kernel`",
                key="cameras",
            )
        if ours is not None and frame.exposure:
            return ours.expose(frame.exposure, self.show, seed, after_pass)
        with self.clock.phase("update"):
            self.show(frame)
        return self._tracer.trace(seed, after_pass)

    def facts(
        self,
        wanted: Collection[str],
        *,
        at: tuple[float, float] = CENTRE,
        owners: Owners | None = None,
    ) -> PixelFacts:
        """Find what each pixel of the frame that was traced last shows.

        Args:
            wanted: Names of `RAYS` in `render/kernel/integrator.py`.
            at: Where in the pixels, in widths and heights of one.
            owners: Of that frame, where they are known already.

        Raises:
            ConfigError: If the variant does not compile.
        """
        if self.by_kernel is None:
            raise ConfigError(
                f"the variant {self.backend.variant} has no layers; take llvm", key="output.layers"
            )
        with self.clock.phase("layers"), watched(self.backend.variant):
            # After an exposure the scene is at its last moment, and layers show the middle.
            frame = self.frame
            passed = frame is not None and bool(frame.exposure) and frame is not self.loaded.frame
            if passed and frame is not None:
                self.show(frame)
            # Mitsuba's `path` does not bring our tables to the frame.
            ours = self._tracer is self.by_kernel and not passed
            kernel = self.by_kernel.current() if ours else self.by_kernel.followed()
            return facts_of(kernel, self.loaded, wanted, at=at, owners=owners)

    def finish(self, samples: Samples, frame: FrameState, *, denoiser: str | None = None) -> Image:
        """Denoise, then lay haze over the picture.

        Args:
            samples: From `samples`.
            frame: The same frame.
            denoiser: Instead of the quality's.

        Returns:
            Radiance, (h, w, 3).
        """
        how = self.finishing_of(frame)
        if denoiser is not None:
            how = replace(how, denoiser=denoiser)
        if how.denoiser != "none":
            # What tracing took makes room for the denoiser.
            free_buffers()
        with self.clock.phase("denoise"):
            seen = samples.layers if how.denoiser == "none" else samples.apart
            return finished(seen, frame.view, how)

    def hazed(self, seen: Layers, view: View) -> Image:
        """Return the radiance of a picture with the scene's haze, if quality and scene have any.

        Args:
            seen: `radiance`; `depth` and `hit` where there is haze.
            view: Of the picture's camera.
        """
        frame = self.loaded.frame
        how = self.finishing_of(None if frame is None else frame.as_seen_from(view))
        return hazed(seen, view, how)

    def finishing_of(self, frame: FrameState | None) -> Finishing:
        """Return how a frame's picture is finished with this quality.

        Args:
            frame: That was traced last; None is one before which nothing falls.
        """
        quality = self.settings.quality
        haze = self._haze() if quality.haze else None
        how = Finishing(
            quality.denoise,
            quality.guides,
            quality.raw_share,
            haze,
            self._horizon,
            grainy_sky=self._lit_air,
        )
        falling = None if frame is None else frame.falling()
        return how if falling is None else replace(how, falling=falling, light=self._sky_light)

    def _haze(self) -> Haze | None:
        """Return the frame's haze; fog's visibility counts the haze in."""
        haze, frame = self.data.haze, self.loaded.frame
        if haze is None or frame is None or frame.weather is None:
            return haze
        fog = frame.weather.fog.extinction if frame.weather.fog is not None else 0.0
        red, green, blue = (max(each - fog, 0.0) for each in haze.extinction)
        return Haze((red, green, blue), frame.weather.falls if self._lit_air else 0.0)

    @property
    def _lit_air(self) -> bool:
        """Whether lamps light what is in the air."""
        return self.loaded.misty and self.loaded.aimed

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
        """Make what traces; it must find all layers that are wanted."""
        if self.by_kernel is not None:
            self.by_kernel.use(self.settings)
        ours = self.by_kernel if self.settings.quality.tracer == "kernel" else None
        apart = ours is not None and not traces_by_optix(self.backend.variant)
        if self.loaded.apart != apart:
            self.loaded.drop()
        self.loaded.apart = apart
        self._tracer = self._by_path() if ours is None else ours
        names = by_path.PICTURE | set(self._tracer.finds)
        for name in self.settings.layers:
            if name not in names:
                raise ConfigError(
                    f"layer {name!r} cannot be traced with this scene, quality and variant"
                    f" ({self.backend.variant}){did_you_mean(name, names)}"
                )

    def _by_path(self) -> ByPath:
        """Make what traces by Mitsuba's path tracer."""
        self._refuse_weather()
        hazy = self.data.haze is not None or self.data.weather is not None
        return ByPath(self.loaded, self.settings, jit=self.backend.jit, hazy=hazy, clock=self.clock)

    def _refuse_weather(self) -> None:
        """Refuse weather where Mitsuba's path tracer is all that there is."""
        weather = self.data.weather
        if weather is not None and weather.is_seen:
            raise ConfigError(
                f"only our own kernel traces weather, and {self.backend.variant} with this quality"
                " does not have it; install libLLVM (see doctor), or leave weather out",
                key="weather",
            )

    @property
    def limit(self) -> float:
        """Highest channel value of a sample."""
        return self.settings.limit

    def show(self, frame: FrameState) -> None:
        """Bring the scene to a frame's state."""
        size, quality = self.settings.size, self.settings.quality
        spp = by_path.guide_spp(quality)
        sensors = {
            "sensor": sensor_entry(
                size, pixels="rgb", sampler=quality.sampler, spp=self.settings.pass_spp
            ),
            "guide": sensor_entry(size, pixels="rgba", sampler="multijitter", spp=spp),
        }
        if self.loaded.sky_changes:
            self._follow_weather(frame.weather)
        self.loaded.show(frame, {**sensors, **self._lights})

    def _follow_weather(self, weather: Weather | None) -> None:
        """Bring sky and sun to a frame's weather."""
        if weather == self._sky_weather:
            return
        self._show_sky(weather)
        if self.loaded.parameters is not None:
            update_sky(self.loaded.parameters, self._lights)
