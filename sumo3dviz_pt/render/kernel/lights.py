"""Light that reaches a surface: which emitter a path aims at, and what rays meet by chance.

Sky, sun and the pattern of head lamps are Mitsuba's objects, but called by themselves: such calls
become part of the kernel, while Mitsuba's choice among emitters calls a function of each. Packets
of lanes skip work that none of them wants.

A path aims at an emitter by what it gives to the place that is lit. A table says that by the cells
of a grid around what the eye sees. A part of the choice ignores the place, so that what the table
underestimates is aimed at, too.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.render.kernel.air import Air
from sumo3dviz_pt.render.kernel.lamps import LampTables
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.lights.emitter import WIDE, grid_corner
from sumo3dviz_pt.render.lights.picks import numbers, opaque_point
from sumo3dviz_pt.render.loaded import LoadedScene
from sumo3dviz_pt.render.sky.weathered import SUN_DISTANCE


def where(
    active: Any,
    args: tuple[Any, ...],
    compute: Callable[..., tuple[Any, ...]],
    otherwise: tuple[Any, ...],
) -> tuple[Any, ...]:
    """Return what a function finds for lanes that want it, and other values for the rest.

    Args:
        active: Which lanes want it.
        args: The function's arguments.
        compute: The function; it returns as many values as `otherwise` has.
        otherwise: Values of the other lanes.
    """

    def skipped(*all_given: Any) -> tuple[Any, ...]:
        return all_given[-len(otherwise) :]

    def wanted(*all_given: Any) -> tuple[Any, ...]:
        return compute(*all_given[: -len(otherwise)])

    result: tuple[Any, ...] = dr.if_stmt((*args, *otherwise), active, wanted, skipped)
    return result


CELLS = 64
"""Rows, and columns, of the grid."""

_BY_PLACE = 0.7
"""Share of the choice that depends on the place."""


Power = Callable[[Any, Any, Any], Any]
"""What an emitter gives to a cell, by number of the emitter, column and line of the cell."""


class EmitterChances:
    """The chances of a scene's emitters.

    Args:
        count: How many emitters there are.
        placed: Whether the choice depends on the place.
    """

    def __init__(self, count: int, *, placed: bool) -> None:
        self._count, self._placed = count, placed
        self._chances = self._summed = self._grid = mi.Float(0.0)

    def follow(self, weights: Floats, power: Power, grid: Floats) -> None:
        """Bring the chances to a frame.

        Args:
            weights: How often paths aim at each emitter from anywhere, (count,).
            power: What an emitter gives to a cell by number, column and line, if the place matters.
            grid: x and y of the corner in the renderer's coordinates [m], and cells per metre.
        """
        chances = weights / weights.sum()
        self._grid = numbers(grid)
        if self._placed:
            self._follow_places(numbers(chances), power)
        else:
            self._chances, self._summed = numbers(chances), numbers(np.cumsum(chances))

    def _follow_places(self, weights: Any, power: Power) -> None:
        """Find the chances of each cell, one lane for each; arguments as in `follow`."""
        cell = dr.arange(mi.UInt32, CELLS**2)
        column, line = cell % CELLS, cell // CELLS
        chances, sums = (dr.empty(mi.Float, CELLS**2 * self._count) for _ in range(2))

        def added(each: Callable[[Any, Any], Any]) -> Any:
            """Add up a number of all emitters by theirs and the sum before."""
            start = dr.zeros(mi.UInt32, CELLS**2), dr.zeros(mi.Float, CELLS**2)
            looped = dr.while_loop(
                start, lambda k, _: k < self._count, lambda k, total: (k + 1, each(k, total))
            )
            return looped[1]

        given = added(lambda k, total: total + power(k, column, line))

        def share(k: Any) -> Any:
            weight = dr.gather(mi.Float, weights, k)
            by_place = (1.0 - _BY_PLACE) * weight + _BY_PLACE * power(k, column, line) / given
            return dr.select(given > 0.0, by_place, weight)

        whole = added(lambda k, total: total + share(k))

        def write(k: Any, total: Any) -> Any:
            each = share(k)
            total += each
            dr.scatter(chances, each / whole, cell * self._count + k)
            dr.scatter(sums, total / whole, cell * self._count + k)
            return total

        added(write)
        dr.eval(chances, sums)
        self._chances, self._summed = chances, sums

    def chance(self, number: Any, place: Any, active: Any) -> Any:
        """Return the chance that paths aim from a place at an emitter, by its number."""
        return dr.gather(mi.Float, self._chances, self._row(place, active) + number, active)

    def pick(self, sample: Any, place: Any, active: Any) -> tuple[Any, Any, Any]:
        """Pick an emitter; return its number, its chance and what is left of the sample.

        Args:
            sample: Two numbers in [0, 1).
            place: That is lit.
            active: Which lanes count.
        """
        row = self._row(place, active)

        def summed(k: Any) -> Any:
            return dr.gather(mi.Float, self._summed, row + mi.UInt32(k), active)

        last = self._count - 1
        number = mi.UInt32(dr.binary_search(0, last, lambda k: summed(k) <= sample.x))
        chance = dr.gather(mi.Float, self._chances, row + number, active)
        low = dr.select(number > 0, summed(dr.maximum(number, 1) - 1), 0.0)
        left = dr.clip((sample.x - low) / chance, 0.0, dr.one_minus_epsilon(mi.Float))
        return number, chance, mi.Point2f(left, sample.y)

    def _row(self, place: Any, active: Any) -> Any:
        """Return where a place's numbers begin."""
        if not self._placed:
            return mi.UInt32(0)
        grid = dr.gather(mi.Vector3f, self._grid, mi.UInt32(0), active)
        column = mi.UInt32(dr.clip((place.x - grid.x) * grid.z, 0.0, CELLS - 1.0))
        row = mi.UInt32(dr.clip((place.y - grid.y) * grid.z, 0.0, CELLS - 1.0))
        return (row * CELLS + column) * self._count


FAR = 0.1 * SUN_DISTANCE
"""What rays meet beyond this distance is the sun [m]."""


class LightAim(NamedTuple):
    """A direction towards an emitter.

    Attributes:
        d: Unit.
        distance: To the emitter [m]; inf to the sky.
        pdf: Its density, without the chance of the choice among emitters [1/sr]; 0 where
            there is no light.
        light: Radiance over that density, a colour.
    """

    d: Any
    distance: Any
    pdf: Any
    light: Any


class Lights:
    """The emitters of a loaded scene.

    Args:
        loaded: A scene that shows a frame.
        tables: Of the scene.
        air: What is in the air, or None.

    Attributes:
        beam_names: Of all beams, in their order.
    """

    def __init__(self, loaded: LoadedScene, tables: Tables, air: Air | None = None) -> None:
        self._air = air
        scene, parameters = loaded.scene, loaded.parameters
        self._loaded, self._sky = loaded, scene.environment()
        shapes = [shape for shape in scene.shapes() if shape.id() == "sun"]
        self._sun_shape: Any = shapes[0] if shapes else None
        self._sun: Any = shapes[0].emitter() if shapes else None
        self._lamps = LampTables(loaded.picks, tables) if loaded.picks is not None else None
        self._beams = loaded.running.beams
        self._beam: Any = self._beams.unit() if self._beams is not None else None
        self._pattern = (
            None if self._beams is None else numbers(np.asarray(self._beams.beam.pattern, float))
        )
        # Sky and sun come first, then lamps, then beams: these are the emitters' numbers.
        first = ["sky", *(["sun.emitter"] if self._sun is not None else [])]
        self._first_lamp = len(first)
        lamps = [f"{name}.emitter" for name in tables.lamps]
        self._first_beam = len(first) + len(lamps)
        beams = sorted(k.split(".")[0] for k in _keys(parameters) if _is_beam(k))
        self.beam_names = tuple(beams)
        self._names = (*first, *lamps, *beams)
        self._choice = EmitterChances(len(self._names), placed=self.many)
        self._sky_given = self._light_of_sky()
        self.follow()

    def follow(self) -> None:
        """Bring lamps, beams and how often paths aim at each emitter to this frame."""
        parameters = self._loaded.parameters
        if self._loaded.sky_changes:
            self._sky_given = self._light_of_sky()
        if self._beams is not None:
            self._beam_rows = numbers(self._beams.rows(self.beam_names))
        weights = np.array([_weight(parameters, name) for name in self._names])
        grid = self._grid()
        self._choice.follow(weights, self._powers(grid), grid)

    def _light_of_sky(self) -> float:
        """Return what the sky gives to a place, where that matters."""
        if not self.many:
            return 0.0
        return float(np.pi**2 * np.asarray(self._loaded.parameters["sky.data"]).mean())

    def _grid(self) -> Floats:
        """Return the grid of the choice: x and y of its corner [m], and cells per metre."""
        frame = self._loaded.frame
        assert frame is not None, "show a frame first"
        return np.array([*(grid_corner(frame.view) - frame.origin[:2]), CELLS / WIDE])

    def _powers(self, grid: Floats) -> Power:
        """Return what says what an emitter gives to a cell of a grid."""
        sky = dr.opaque(mi.Float, self._sky_given)
        corner, step = opaque_point(grid[:2]), WIDE / CELLS

        def power(number: Any, column: Any, line: Any) -> Any:
            given = sky
            if self._lamps is not None:
                lamp = (number >= self._first_lamp) & (number < self._first_beam)
                own = dr.select(lamp, number - self._first_lamp, 0)
                from_lamps = self._lamps.given(own, column, line, of=CELLS, active=lamp)
                given = dr.select(lamp, from_lamps, given)
            if self._beams is not None:
                beam = number >= self._first_beam
                place = corner + (mi.Point2f(mi.Float(column), mi.Float(line)) + 0.5) * step
                own = dr.select(beam, number - self._first_beam, 0)
                given = dr.select(beam, self._beam_given(own, place, beam), given)
            return given

        return power

    def _beam_given(self, number: Any, place: Any, active: Any) -> Any:
        """Return what a beam gives to a place on the ground, as lamps' power is counted.

        Args:
            number: Among the beams.
            place: Relative to the renderer's origin, x and y [m].
            active: Which lanes count.
        """
        assert self._beams is not None, "the scene has no beams"
        beam = self._beams.beam
        rows = [dr.gather(mi.Vector4f, self._beam_rows, 4 * number + k, active) for k in range(4)]
        ground = mi.Vector4f(place.x, place.y, rows[3].w, 1.0)
        # The spot's +z looks ahead, +x to its left, and +y up.
        left, up, ahead = (dr.dot(row, ground) for row in rows[:3])
        half, count = float(np.tan(beam.half_angle)), len(beam.pattern)
        wide = dr.maximum(ahead, 1e-6) * half
        across, down = ((0.5 - 0.5 * each / wide) * count for each in (left, up))
        middle = 0.5 * count
        inside = active & (ahead > 0.0) & (dr.abs(across - middle) < middle)
        inside &= dr.abs(down - middle) < middle
        texel = mi.UInt32(dr.select(inside, dr.floor(down) * count + dr.floor(across), 0.0))
        share = dr.gather(mi.Float, self._pattern, texel, inside)
        away = dr.square(left) + dr.square(up) + dr.square(ahead)
        intensity = (rows[3].x + rows[3].y + rows[3].z) * (dr.pi / 3.0)
        return intensity * share / (away + 4.0)

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
        pdf = self._sky.pdf_direction(before, ds, sky) * self._choice.chance(0, before.p, sky)
        pdf = dr.select(sky, pdf, 0.0)
        if self._sun is None:
            return radiance, pdf
        sun = active & hit.is_valid() & (hit.t > FAR)
        si = self._sun_shape.compute_surface_interaction(ray, hit, mi.RayFlags.All, sun)
        # A shape that is asked by itself leaves this out, and from behind the disc is black.
        si.wi = mi.Frame3f(si.n).to_local(-ray.d)
        ds.p, ds.n, ds.uv, ds.dist = si.p, si.n, si.uv, hit.t
        radiance = dr.select(sun, self._sun.eval(si, sun), radiance)
        own = self._sun.pdf_direction(before, ds, sun)
        own *= self._choice.chance(1, before.p, sun)
        return radiance, dr.select(sun, own, pdf)

    @property
    def many(self) -> bool:
        """Whether paths aim at more than sky and sun; lamps by day are only seen."""
        return self._loaded.aimed and len(self._names) > self._first_lamp

    @property
    def lamps(self) -> bool:
        """Whether surfaces may be lamps."""
        return self._lamps is not None

    def shining(self) -> Floats:
        """Return the corners of all faces of lamps that shine, (n, 3, 3) [m]."""
        return self._loaded.shining()

    def glow(self, surface: Any, before: Any, active: Any) -> tuple[Any, Any]:
        """Return the radiance of a lamp that a ray met, and the density of aiming there.

        Args:
            surface: What it met.
            before: Where it started, an interaction.
            active: Which lanes count.
        """
        lamps = self._lamps
        assert lamps is not None, "the scene has no lamps"
        lit = active & (surface.lamps > 0)
        number = surface.lamps - 1
        radiance, pdf = lamps.met(number, surface.si, before, lit)
        chance = self._choice.chance(self._first_lamp + number, before.p, lit)
        return radiance, dr.select(lit, pdf * chance, 0.0)

    def aim(self, place: Any, sample: Any, active: Any) -> tuple[LightAim, Any]:
        """Pick a direction towards an emitter; return it, and if no ray meets it by chance.

        Args:
            place: The lit point.
            sample: Two numbers in [0, 1).
            active: Which lanes count.
        """
        if len(self._names) == 1:
            return self._sky_aim(_interaction(place), sample, active), mi.Bool(False)
        number, chance, sample = self._choice.pick(sample, place, active)
        aim = LightAim(mi.Vector3f(0.0, 0.0, 1.0), mi.Float(0.0), mi.Float(0.0), mi.Color3f(0.0))
        for chosen, maker in self._groups(number):
            aim = _merged(active & chosen, aim, place, sample, number, maker)
        light = aim.light / chance
        if self._air is not None:
            light *= self._air.reach(place, aim.d, aim.distance, aim.distance < FAR)
        scaled = LightAim(aim.d, aim.distance, aim.pdf * chance, light)
        return scaled, number >= self._first_beam

    def _groups(self, number: Any) -> list[tuple[Any, Callable[..., LightAim]]]:
        """Return which lanes aim at each kind of emitter, and what finds a direction there."""
        groups: list[tuple[Any, Callable[..., LightAim]]] = [(number == 0, self._sky_picked)]
        if self._sun is not None:
            groups.append((number == 1, self._sun_picked))
        if self._lamps is not None and self._loaded.aimed:
            lamp = (number >= self._first_lamp) & (number < self._first_beam)
            groups.append((lamp, self._lamp_picked))
        if self.beam_names:
            groups.append((number >= self._first_beam, self._beam_picked))
        return groups

    def _sky_aim(self, it: Any, sample: Any, active: Any) -> LightAim:
        """Pick a direction of the sky."""
        ds, light = self._sky.sample_direction(it, sample, active)
        return LightAim(mi.Vector3f(ds.d), mi.Float(dr.inf), ds.pdf, light)

    def _sky_picked(self, place: Any, sample: Any, number: Any, active: Any) -> LightAim:
        """Pick a direction of the sky; arguments as in `_lamp_picked`."""
        del number
        return self._sky_aim(_interaction(place), sample, active)

    def _sun_picked(self, place: Any, sample: Any, number: Any, active: Any) -> LightAim:
        """Pick a direction of the sun's disc; arguments as in `_lamp_picked`."""
        del number
        ds, light = self._sun.sample_direction(_interaction(place), sample, active)
        return LightAim(mi.Vector3f(ds.d), mi.Float(FAR), ds.pdf, light)

    def _lamp_picked(self, place: Any, sample: Any, number: Any, active: Any) -> LightAim:
        """Pick a direction towards a lamp.

        Args:
            place: The lit point.
            sample: Two numbers in [0, 1).
            number: Of the emitter.
            active: Which lanes count.
        """
        assert self._lamps is not None
        aim = self._lamps.aim(number - self._first_lamp, place, sample, active)
        lit = active & (aim.pdf > 0.0)
        light = dr.select(lit, aim.radiance / aim.pdf, 0.0)
        return LightAim(aim.d, aim.distance, aim.pdf, light)

    def beam_at(self, place: Any, beam: Any, active: Any) -> Any:
        """Return the light of a beam on what faces it at a place, a colour, if nothing hides it.

        Args:
            place: The lit point.
            beam: Its number among the beams.
            active: Which lanes count.
        """
        number = beam + self._first_beam
        aim = self._beam_picked(mi.Point3f(place), mi.Point2f(0.5), number, active)
        return dr.select(active & (aim.pdf > 0.0), aim.light, 0.0)

    def _beam_picked(self, place: Any, sample: Any, number: Any, active: Any) -> LightAim:
        """Find the direction to a head lamp; arguments as in `_lamp_picked`."""
        first = 4 * (number - self._first_beam)
        rows = [dr.gather(mi.Vector4f, self._beam_rows, first + k, active) for k in range(4)]
        axes = [mi.Vector3f(row.x, row.y, row.z) for row in rows[:3]]
        point = mi.Vector3f(place)
        local = _interaction(
            mi.Point3f(*(dr.dot(a, point) + r.w for a, r in zip(axes, rows, strict=False)))
        )
        ds, light = self._beam.sample_direction(local, sample, active)
        d = axes[0] * ds.d.x + axes[1] * ds.d.y + axes[2] * ds.d.z
        colour = mi.Color3f(rows[3].x, rows[3].y, rows[3].z)
        return LightAim(d, ds.dist, dr.select(active, mi.Float(1.0), 0.0), light * colour)


def _merged(
    chosen: Any, aim: LightAim, place: Any, sample: Any, number: Any, maker: Any
) -> LightAim:
    """Put the directions that some lanes want into those of all."""

    def compute(*args: Any) -> tuple[Any, ...]:
        return tuple(maker(*args))

    args = (mi.Point3f(place), mi.Point2f(sample), mi.UInt32(number), mi.Bool(chosen))
    return LightAim(*where(mi.Bool(chosen), args, compute, tuple(aim)))


def _interaction(place: Any) -> Any:
    """Return a point as Mitsuba's interaction, which has nothing else that emitters read."""
    it = dr.zeros(mi.Interaction3f)
    it.p = mi.Point3f(place)
    return it


def _keys(parameters: Any) -> list[str]:
    """Return the names of all parameters."""
    return list(parameters.keys())


def _is_beam(key: str) -> bool:
    """Return whether a parameter is the weight of a beam."""
    return key.startswith("beam_") and key.endswith(".sampling_weight")


def _weight(parameters: Any, name: str) -> float:
    """Return how often paths aim at an emitter."""
    return float(np.asarray(parameters[f"{name}.sampling_weight"]).item())
