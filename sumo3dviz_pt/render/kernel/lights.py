"""Light that reaches a surface: which emitter a path aims at, and what rays meet by chance.

Sky and sun are Mitsuba's objects, but asked for by themselves: calls of single objects become
part of the kernel, while Mitsuba's choice among emitters calls a function of each.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.sky.entries import SUN_DISTANCE

FAR = 0.1 * SUN_DISTANCE
"""What rays meet beyond this distance is the sun [m]."""


class Aim(NamedTuple):
    """A direction towards an emitter.

    Attributes:
        d: Unit.
        distance: How far nothing may stand in between [m].
        pdf: Its density, with the chance of the choice among emitters [1/sr]; 0 where there
            is no light.
        light: Radiance over that density, a colour.
        delta: Whether no ray meets this emitter by chance.
    """

    d: Any
    distance: Any
    pdf: Any
    light: Any
    delta: Any


class Lights:
    """The emitters of a loaded scene.

    Args:
        loaded: A scene that shows a frame.
    """

    def __init__(self, loaded: LoadedScene) -> None:
        scene = loaded.scene
        self._sky = scene.environment()
        shapes = [shape for shape in scene.shapes() if shape.id() == "sun"]
        self._sun_shape = shapes[0] if shapes else None
        self._sun = shapes[0].emitter() if shapes else None
        self._loaded = loaded
        self.follow()

    def follow(self) -> None:
        """Read how often paths aim at each emitter in this frame."""
        parameters = self._loaded.parameters
        names = ["sky"] + (["sun.emitter"] if self._sun is not None else [])
        weights = np.array([float(parameters[f"{name}.sampling_weight"]) for name in names])
        chances = weights / weights.sum()
        self._chances = mi.Float(aligned(chances, np.float32))

    def _chance(self, number: int) -> Any:
        """Return the chance that paths aim at an emitter, by its number."""
        return dr.gather(mi.Float, self._chances, mi.UInt32(number))

    def met(self, hit: Any, ray: Any, before: Any, active: Any) -> tuple[Any, Any]:
        """Return the radiance of what a ray ends in, and the density of aiming there.

        Args:
            hit: Mitsuba's preliminary intersection.
            ray: The ray.
            before: Where it started, an interaction.
            active: Which lanes count: those that met no surface.
        """
        sky = active & ~hit.is_valid()
        ds = dr.zeros(mi.DirectionSample3f)
        ds.d = ray.d
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wi = -ray.d
        radiance = dr.select(sky, self._sky.eval(si, sky), 0.0)
        pdf = dr.select(sky, self._sky.pdf_direction(before, ds, sky) * self._chance(0), 0.0)
        if self._sun is None:
            return radiance, pdf
        sun = active & hit.is_valid() & (hit.t > FAR)
        si = self._sun_shape.compute_surface_interaction(ray, hit, mi.RayFlags.All, sun)
        ds.p, ds.n, ds.uv, ds.dist = si.p, si.n, si.uv, hit.t
        radiance = dr.select(sun, self._sun.eval(si, sun), radiance)
        own = self._sun.pdf_direction(before, ds, sun) * self._chance(1)
        return radiance, dr.select(sun, own, pdf)

    def aim(self, it: Any, sample: Any, active: Any) -> Aim:
        """Pick a direction towards an emitter.

        Args:
            it: The lit point.
            sample: Two numbers in [0, 1).
            active: Which lanes count.
        """
        chance = self._chance(0)
        if self._sun is None:
            return self._sky_aim(it, sample, active)
        to_sky = sample.x < chance
        left = dr.select(to_sky, sample.x / chance, (sample.x - chance) / (1.0 - chance))
        sample = mi.Point2f(dr.clip(left, 0.0, dr.one_minus_epsilon(mi.Float)), sample.y)
        sky = self._sky_aim(it, sample, active & to_sky)
        ds, light = self._sun.sample_direction(it, sample, active & ~to_sky)
        own = self._chance(1)
        return Aim(
            dr.select(to_sky, sky.d, ds.d),
            dr.select(to_sky, sky.distance, FAR),
            dr.select(to_sky, sky.pdf, ds.pdf * own),
            dr.select(to_sky, sky.light, light / own),
            mi.Bool(False),
        )

    def _sky_aim(self, it: Any, sample: Any, active: Any) -> Aim:
        """Pick a direction of the sky."""
        ds, light = self._sky.sample_direction(it, sample, active)
        own = self._chance(0)
        return Aim(ds.d, mi.Float(dr.inf), ds.pdf * own, light / own, mi.Bool(False))
