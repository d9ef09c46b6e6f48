"""Path tracing in one kernel: radiance, and all layers of the first surface, summed by pixel.

It finds what Mitsuba's `path` finds, within chance: sampling of emitters and of materials,
weighted by the power heuristic, and roulette.

References:
    Veach, "Robust Monte Carlo Methods for Light Transport Simulation", thesis, Stanford 1997.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.layers import Channels, Layers
from sumo3dviz_pt.render.kernel.lights import Lights
from sumo3dviz_pt.render.kernel.rows import Kind
from sumo3dviz_pt.render.kernel.surface import Surfaces
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.loaded import LoadedScene

CHANNELS = Channels.in_order(capped=3, lost=3, depth=1, hit=1, albedo=3, normal=3)
"""What the kernel finds."""

_MOST_LANES = 1 << 22  # at once; each takes 56 bytes
_LIKELIEST = 0.95  # that a path goes on, by roulette


@dataclass(frozen=True, slots=True)
class Depth:
    """How long paths are.

    Attributes:
        most: Most segments of a path.
        roulette: Segments after which paths may end by chance.
    """

    most: int
    roulette: int


class Kernel:
    """Traces pictures of a loaded scene.

    Args:
        loaded: A scene that shows a frame.
        pixel: Angle of a pixel [rad].
    """

    def __init__(self, loaded: LoadedScene, pixel: float) -> None:
        self._loaded = loaded
        self.scene = loaded.scene
        self._tables = Tables(loaded)
        self.surfaces = Surfaces(self._tables, pixel)
        self.lights = Lights(loaded)

    def follow(self) -> None:
        """Bring everything to what the loaded scene shows."""
        self._tables.follow()
        self.lights.follow()

    def trace(
        self, sensor: Any, *, spp: int, seed: int, depth: Depth, limit: float
    ) -> Layers:
        """Trace one pass.

        Args:
            sensor: One of Mitsuba's, with its sampler.
            spp: Samples of a pixel.
            seed: Of the pass.
            depth: How long paths are.
            limit: Highest channel value of a sample; inf for no cap.
        """
        width, height = (int(size) for size in sensor.film().crop_size())
        rows = max(1, min(height, _MOST_LANES // (width * spp)))
        most, roulette = (dr.opaque(mi.UInt32, n) for n in (depth.most, depth.roulette))
        cap = dr.opaque(mi.Float, min(limit, float(np.finfo(np.float32).max)))
        found = []
        for top in range(0, height, rows):
            count = min(rows, height - top)
            sampler = sensor.sampler().clone()
            lanes = width * count * spp
            sampler.set_sample_count(spp)
            sampler.set_samples_per_wavefront(spp)
            own = (seed + 0x9E3779B9 * top) % 2**32
            sampler.seed(dr.opaque(mi.UInt32, own), lanes)
            ray = _ray(sensor, sampler, spp=spp, top=top, size=(width, height))
            out = _path(self, sampler, ray, most, roulette, cap)
            dr.schedule(out)
            sums = [dr.block_sum(channel, spp) * (1.0 / spp) for channel in out]
            found.append(np.stack([np.array(one).reshape(count, width) for one in sums], -1))
        return CHANNELS.layers(np.concatenate(found).astype(np.float32, copy=False))


def _ray(sensor: Any, sampler: Any, *, spp: int, top: int, size: tuple[int, int]) -> Any:
    """Return the rays of all samples of some rows; samples of a pixel are neighbours."""
    width, height = (dr.opaque(mi.UInt32, one) for one in size)
    index = dr.arange(mi.UInt32, sampler.wavefront_size())
    pixel = index // dr.opaque(mi.UInt32, spp)
    row = pixel // width
    jitter = sampler.next_2d()
    column = mi.Float(pixel - row * width) + jitter.x
    row = mi.Float(row + dr.opaque(mi.UInt32, top)) + jitter.y
    place = mi.Point2f(column / mi.Float(width), row / mi.Float(height))
    return sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))[0]


def _heuristic(a: Any, b: Any) -> Any:
    """Return the weight of a sample of density a, where b could have found it, too."""
    a2 = dr.square(a)
    weight = a2 / (a2 + dr.square(b))
    return dr.select(dr.isfinite(weight), weight, 0.0)


@dr.syntax  # type: ignore[untyped-decorator]
def _path(kernel: Any, sampler: Any, ray: Any, most: Any, roulette: Any, cap: Any) -> list[Any]:
    """Follow paths; return the channels of each sample."""
    ray = mi.Ray3f(ray)
    result, through = mi.Color3f(0.0), mi.Color3f(1.0)
    depth, active = mi.UInt32(0), mi.Bool(True)
    before, density = dr.zeros(mi.Interaction3f), mi.Float(1.0)
    hit, distance = mi.Float(0.0), mi.Float(0.0)
    albedo, normal = mi.Color3f(0.0), mi.Vector3f(0.0)
    while dr.hint(active, max_iterations=-1, label="paths"):
        # What does the ray meet?
        found = kernel.scene.ray_intersect_preliminary(ray, depth == 0, active=active)
        surface = kernel.surfaces.met(found, ray, active)
        si, there = surface.si, surface.there
        first = there & (depth == 0)
        hit = dr.select(first, 1.0, hit)
        distance = dr.select(first, si.t, distance)
        albedo = dr.select(first, surface.finish.colour, albedo)
        normal = dr.select(first, mi.Vector3f(si.sh_frame.n), normal)

        # Light of what ends the path.
        radiance, aimed = kernel.lights.met(found, ray, before, active & ~there)
        weight = dr.select(depth == 0, 1.0, _heuristic(density, aimed))
        result = dr.fma(through, radiance * weight, result)

        # Light of an emitter that the path aims at.
        on = there & (depth + 1 < most)
        aim = kernel.lights.aim(si, sampler.next_2d(on), on)
        lit = on & (aim.pdf > 0.0)
        wo = si.to_local(aim.d)
        response = surface.finish.respond(si.wi, wo)
        bounce = surface.finish.bounce(si.wi, sampler.next_1d(on), sampler.next_2d(on))
        share = dr.select(aim.delta, 1.0, _heuristic(aim.pdf, response.pdf))
        gain = through * response.value * aim.light * share
        lit &= dr.any(gain != 0.0)
        shadow = si.spawn_ray(aim.d)
        shadow.maxt = aim.distance
        lit &= ~kernel.scene.ray_test(shadow, lit)
        result = dr.select(lit, result + gain, result)

        # Where does the path go on?
        ray = si.spawn_ray(si.to_world(bounce.wo))
        through = through * bounce.weight
        before.p, before.n, before.t = si.p, si.n, si.t
        density = bounce.pdf
        depth = dr.select(there, depth + 1, depth)
        brightest = dr.max(through)
        likely = dr.minimum(brightest, _LIKELIEST)
        late = depth >= roulette
        lucky = sampler.next_1d(on) < likely
        through = dr.select(late, through * dr.rcp(likely), through)
        active = on & (~late | lucky) & (brightest != 0.0)

    sound = dr.all(dr.isfinite(result))
    peak = dr.maximum(dr.max(result), 1e-30)
    kept = result * dr.minimum(1.0, cap / peak)
    lost = dr.select(sound, result - kept, np.inf)
    kept = dr.select(sound, kept, 0.0)
    return [*kept, *lost, distance, hit, *albedo, *normal]
