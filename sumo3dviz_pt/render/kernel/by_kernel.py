"""Frames by our own kernel, which finds all layers with the picture.

A picture's samples are shared out among the moments of an exposure, and what they see is summed.
Every row is seen at equally many moments, and gets its share of the samples at each. So a moving
shutter costs what the scene's own changes cost, and no further samples.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from sumo3dviz_pt.model.falling import reflected_share, reflection_samples
from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.layers import Layers, MovingPart, PixelArea, merged
from sumo3dviz_pt.model.scene import FrameState, Moment, View
from sumo3dviz_pt.render.kernel.eye import PaneEye
from sumo3dviz_pt.render.kernel.integrator import CHANNELS, FIRST, Kernel, Limits
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.passes import by_path
from sumo3dviz_pt.render.passes.finish import denoise
from sumo3dviz_pt.render.passes.samples import Accumulator, pass_seed
from sumo3dviz_pt.render.settings import AfterPass, Clock, RenderSettings, Traced

WHOLE_HEIGHT = (0.0, 1.0)


@dataclass(frozen=True, slots=True)
class PassOrder:
    """What is traced of a picture at one moment.

    Attributes:
        seed: Of its first pass.
        spp: Samples of a pass.
        passes: How many there are.
        glow_spp: Samples of lamps that are seen directly.
        band: First and last row, shares of the picture's height.
    """

    seed: int
    spp: int
    passes: int
    glow_spp: int
    band: tuple[float, float] = WHOLE_HEIGHT

    def of_moment(self, number: int, moment: Moment) -> PassOrder:
        """Return the order of one of many moments; each has seeds of its own."""
        seed = pass_seed(self.seed, number * self.passes)
        return replace(self, seed=seed, band=moment.rows)

    def rows(self, height: int) -> slice:
        """Return the rows that are traced of a picture so high [px]."""
        first, last = (round(share * height) for share in self.band)
        return slice(first, last)


def whole_order(settings: RenderSettings, seed: int, *, glow_spp: int) -> PassOrder:
    """Return what is traced of a picture that is seen at one moment."""
    return PassOrder(seed, settings.pass_spp, settings.passes, glow_spp)


def shared_order(
    settings: RenderSettings, seed: int, *, glow_spp: int, moments: Sequence[Moment]
) -> PassOrder:
    """Return what is traced of a picture at each moment of an exposure.

    The samples of all moments are as many as the quality has, or one more for each moment where
    they cannot be shared out evenly.
    """
    count = moments_of_a_row(moments)
    spp = -(-settings.quality.spp // count)
    of_pass = min(settings.quality.pass_spp, spp)
    return PassOrder(seed, of_pass, -(-spp // of_pass), max(1, -(-glow_spp // count)))


def moments_of_a_row(moments: Sequence[Moment]) -> int:
    """Return at how many moments each row is seen."""
    return round(sum(last - first for first, last in (moment.rows for moment in moments)))


@dataclass(slots=True)
class MeanOfRows:
    """Averages layers of bands of rows.

    Attributes:
        height: Of the whole picture [px].
    """

    height: int
    _sums: dict[str, Floats] = field(default_factory=dict)
    _counts: dict[str, Floats] = field(default_factory=dict)

    def add(self, layers: Layers, rows: slice) -> None:
        """Add what was found in some rows; the layers have only these."""
        for name, layer in layers.items():
            if name not in self._sums:
                self._sums[name] = np.zeros((self.height, *layer.shape[1:]))
                self._counts[name] = np.zeros(self.height)
            self._sums[name][rows] += layer
            self._counts[name][rows] += 1.0

    def means(self) -> Layers:
        """Return the mean of all rows."""
        means = {}
        for name, sums in self._sums.items():
            counts = self._counts[name].reshape(-1, *(1,) * (sums.ndim - 1))
            means[name] = np.asarray(sums / np.maximum(counts, 1.0), np.float32)
        return Layers(means)


_MORE = 2
"""Further passes over mirrors for each pass over the picture."""

_MIRRORED = 0x2545F491
"""Of the seeds of further passes."""

GLOW_SPP = 64
"""Samples of lamps that are seen directly, where there may be one."""

_OF_LARGE = 4
"""Share of them that large lamps get, at least."""


@dataclass(frozen=True, slots=True, eq=False)
class _Reflected:
    """What a pane shows of what lies under it.

    Attributes:
        view: The eye behind it.
        light: Radiance as if it reflected all, (h, w, 3).
    """

    view: View
    light: Image


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
        order = whole_order(self._settings, seed, glow_spp=GLOW_SPP)
        with self._clock.phase("render"):
            kernel = self.followed()
            passes = self._passes(kernel, order, after_pass)
            whole = passes[0] if len(passes) == 1 else merged(passes, _mean)
            layers = by_path.as_guides(whole)
            layers |= {name: passes[0][name] for name in FIRST.places if name in layers}
            if self._apart:
                layers |= {"glow": self._glow(kernel, order)}
            layers |= self._through_pane(self._reflected(kernel, order), layers)
            accumulator = Accumulator(by_path.uncapped(layers), white=self._settings.white)
            for traced in passes:
                accumulator.add(traced["capped"], traced["lost"])
        return Traced(layers, accumulator, kernel.movers)

    def expose(
        self,
        moments: Sequence[Moment],
        show: Callable[[FrameState], None],
        seed: int,
        after_moment: AfterPass | None,
    ) -> Traced:
        """Trace a picture that is seen at several moments; each gets its share of the samples.

        What moves has the numbers and depths of the moment in the middle.

        Args:
            moments: Of the exposure; every row is seen at equally many.
            show: Brings the scene to a frame's state.
            seed: Of the frame.
            after_moment: Called with moments done and all there are.
        """
        settings, means = self._settings, MeanOfRows(self._settings.size[1])
        shared = shared_order(settings, seed, glow_spp=GLOW_SPP, moments=moments)
        numbers = MeanOfRows(settings.size[1])
        movers: tuple[MovingPart, ...] = ()
        reflected: _Reflected | None = None
        for number, moment in enumerate(moments):
            order = shared.of_moment(number, moment)
            rows = order.rows(settings.size[1])
            with self._clock.phase("update"):
                show(moment.frame)
            with self._clock.phase("render"):
                kernel = self.followed()
                for one in self._passes(kernel, order, None):
                    means.add(one, rows)
                if self._apart:
                    means.add(Layers({"glow": self._glow(kernel, order)[rows]}), rows)
                if number == len(moments) // 2:
                    movers, reflected = kernel.movers, self._reflected(kernel, order)
                    numbers.add(Layers({k: one[k] for k in FIRST.places if k in one}), rows)
            if after_moment is not None:
                after_moment(number + 1, len(moments))
        layers = by_path.as_guides(means.means() | numbers.means())
        layers |= self._through_pane(reflected, layers)
        accumulator = Accumulator(by_path.uncapped(layers), white=settings.white)
        accumulator.add(layers["capped"], layers["lost"])
        return Traced(layers, accumulator, movers)

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

    def _passes(
        self, kernel: Kernel, order: PassOrder, after_pass: AfterPass | None
    ) -> list[Layers]:
        """Trace all passes of what the scene shows, or of a band of its picture's rows."""
        settings, sensor = self._settings, self._loaded.scene.sensors()[0]
        quality, eye = settings.quality, kernel.eye(sensor, self._view)
        limits = Limits(quality.max_depth, quality.rr_depth, settings.limit, direct=not self._apart)
        rows, width = order.rows(settings.size[1]), settings.size[0]
        trace = partial(kernel.trace, sensor, eye, spp=order.spp, limits=limits)
        areas = self._mirror_areas(kernel, rows)
        passes = []
        for number in range(order.passes):
            own = pass_seed(order.seed, number)
            traced = trace(seed=own, area=PixelArea((rows.start, rows.stop), (0, width)))
            for area in areas:
                more = [
                    trace(seed=own ^ pass_seed(_MIRRORED, again), area=area)
                    for again in range(_MORE)
                ]
                traced = with_more(traced, more, area.below(rows.start))
            passes.append(traced)
            if after_pass is not None:
                after_pass(number + 1, order.passes)
        return passes

    def _mirror_areas(self, kernel: Kernel, rows: slice) -> list[PixelArea]:
        """Return where mirrors are seen in some rows, if they need more samples there.

        They do where frames are averaged with those around, which does not help mirrors.
        """
        if kernel.mirrors is None or not self._settings.quality.accumulate:
            return []
        areas = kernel.mirrors.areas(self._view, self._settings.size)
        parts = (area.within(rows.start, rows.stop) for area in areas)
        return [part for part in parts if part is not None]

    def _glow(self, kernel: Kernel, order: PassOrder) -> Image:
        """Trace lamps that are seen directly, (h, w, 3)."""
        sensor, seed = self._loaded.scene.sensors()[0], order.seed ^ 0x3C6EF372
        spp = order.glow_spp
        # Large lamps get no fewer samples than all else.
        few = min(spp, max(-(-spp // _OF_LARGE), order.spp * order.passes))
        return kernel.glow(sensor, self._view, spp=spp, few=few, seed=seed, band=order.band)

    def _reflected(self, kernel: Kernel, order: PassOrder) -> _Reflected | None:
        """Trace what a pane before the eye shows of what lies under it; None without a pane."""
        view, quality = self._view, self._settings.quality
        if view.pane is None:
            return None
        sensor = self._loaded.scene.sensors()[0]
        spp = reflection_samples(order.spp * order.passes)
        eye = PaneEye(kernel.eye(sensor, view), view.pane, self._origin)
        limits = Limits(quality.max_depth, quality.rr_depth, self._settings.limit)
        seen = kernel.trace(sensor, eye, spp=spp, seed=order.seed ^ 0x1B873593, limits=limits)
        light = np.nan_to_num(seen["capped"])
        if quality.denoise != "none":
            guides_of = {"albedo": seen["albedo"], "normal": seen["normal"]}
            light = denoise(light, quality=quality.denoise, **guides_of)
        return _Reflected(view, light)

    def _through_pane(self, reflected: _Reflected | None, layers: Layers) -> Layers:
        """Return what a pane adds to a picture, and the share that it lets through.

        Args:
            reflected: What it shows, if there is one.
            layers: `depth` and `hit` of the picture behind it.
        """
        if reflected is None or reflected.view.pane is None:
            return Layers()
        view, hit = reflected.view, layers["hit"]
        distance = np.where(hit > 0.5, layers["depth"] / np.maximum(hit, 1e-6), np.inf)
        directions = view.directions(layers.size)
        share = reflected_share(reflected.view.pane, view.position, directions, distance)
        return Layers({"reflected": share[..., None] * reflected.light, "passed": 1.0 - share})

    @property
    def _origin(self) -> Floats:
        """The renderer's, in the network's coordinates, (3,) [m]."""
        assert self._loaded.origin is not None, "show a frame first"
        return self._loaded.origin

    @property
    def _view(self) -> View:
        """What the frame that is shown is seen with."""
        frame = self._loaded.frame
        assert frame is not None, "show a frame first"
        return frame.view


def with_more(picture: Layers, more: Sequence[Layers], area: PixelArea) -> Layers:
    """Return the mean of a picture and of more passes over an area of it.

    Args:
        picture: One pass.
        more: As many samples each.
        area: Of the picture.
    """
    merged = {}
    for name, layer in picture.items():
        merged[name] = layer
        if name not in FIRST.places:
            merged[name] = layer.copy()
            sums = np.add.reduce([one[name] for one in more])
            merged[name][area.slices] = (layer[area.slices] + sums) / (1 + len(more))
    return Layers(merged)


def _mean(*pictures: Image) -> Image:
    """Return the mean of some pictures of one size."""
    return np.asarray(np.mean(pictures, axis=0))
