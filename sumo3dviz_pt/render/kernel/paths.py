"""Follows paths through a scene: a loop that Dr.Jit records once for all of them.

It finds what Mitsuba's `path` finds, within chance: light of emitters that paths aim at and of
those that they meet, weighted by the power heuristic, with roulette.

Of some directions to emitters, a path takes the one that is likely to matter most. Each candidate
is picked as a single direction would be, from its own part of all emitters. One of them stays, in
proportion to the light that the surface sends on if nothing is in the way, and only for that one a
shadow ray is traced. On average it brings what all candidates bring, so nothing is biased.

References:
    Veach, "Robust Monte Carlo Methods for Light Transport Simulation", thesis, Stanford 1997.
    Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR 2005.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.render.kernel.air import Air, Solids
from sumo3dviz_pt.render.kernel.halos import Halos
from sumo3dviz_pt.render.kernel.lights import FAR, LightAim, Lights
from sumo3dviz_pt.render.kernel.lobes import CERTAIN
from sumo3dviz_pt.render.kernel.rows import MaterialKind
from sumo3dviz_pt.render.kernel.surface import Surface, Surfaces

FIRST, LATER = 8, 1
"""Candidates of a path's first surface, which the eye sees, and of all others."""

_BROKEN = 1e20  # worth of light that is NaN or Inf: it must be found and counted


@dataclass(slots=True)
class _BestSoFar:
    """The candidate that stays so far.

    Attributes:
        number: Candidates that were looked at.
        d: As all of the following, of an `LightAim`.
        distance: Its distance.
        pdf: Its density.
        light: Its light.
        delta: Whether no ray meets its emitter by chance.
        worth: What it brings if nothing is in the way.
        total: What all candidates bring together.
    """

    number: Any
    d: Any
    distance: Any
    pdf: Any
    light: Any
    delta: Any
    worth: Any
    total: Any


def aimed(
    lights: Lights, surface: Surface, sampler: Any, *, primary: Any, active: Any
) -> tuple[LightAim, Any]:
    """Pick a direction towards an emitter; return it, and if no ray meets it by chance.

    Args:
        lights: The emitters.
        surface: What is lit.
        sampler: Where chance comes from.
        primary: Whether it is a path's first surface.
        active: Which lanes count.
    """
    si = surface.si
    if not lights.many:
        return lights.aim(si.p, sampler.next_2d(active), active)
    count = dr.select(primary, mi.UInt32(FIRST), mi.UInt32(LATER))

    def step(best: _BestSoFar, sampler: Any) -> Any:
        _look(best, lights, surface, sampler, count=count, active=active)
        return best, sampler

    choice = dr.while_loop(
        (_nothing(), sampler), lambda best, _: best.number < count, step, label="candidates"
    )[0]
    valid = choice.worth > 0.0
    share = dr.select(valid, choice.total / (choice.worth * mi.Float(count)), 0.0)
    pdf = dr.select(valid, choice.pdf, 0.0)
    return LightAim(choice.d, choice.distance, pdf, choice.light * share), choice.delta


def _nothing() -> _BestSoFar:
    """Return what is kept before there is a candidate."""
    number, none = mi.UInt32(0), mi.Float(0.0)
    ahead, dark = mi.Vector3f(0.0, 0.0, 1.0), mi.Color3f(0.0)
    return _BestSoFar(
        number, ahead, mi.Float(none), mi.Float(none), dark, mi.Bool(False), mi.Float(none), none
    )


def _look(
    best: _BestSoFar, lights: Lights, surface: Surface, sampler: Any, *, count: Any, active: Any
) -> None:
    """Look at one more candidate of so many, which may stay instead of the one before."""
    chance = sampler.next_2d(active)
    # Each candidate has its own part of all emitters.
    chance.x = (mi.Float(best.number) + chance.x) / mi.Float(count)
    si = surface.si
    aim, delta = lights.aim(si.p, chance, active)
    answer = mi.luminance(surface.finish.respond(si.wi, si.to_local(aim.d)).value)
    # What Mitsuba's own materials answer is not asked here.
    answer = dr.select(surface.foreign, dr.abs(dr.dot(aim.d, si.n)), answer)
    worth = mi.luminance(aim.light) * answer
    worth = dr.select(dr.isfinite(worth), worth, _BROKEN)
    worth = dr.select(aim.pdf > 0.0, worth, 0.0)
    best.total += worth
    stays = sampler.next_1d(active) * best.total < worth
    best.d = dr.select(stays, aim.d, best.d)
    best.distance = dr.select(stays, aim.distance, best.distance)
    best.pdf = dr.select(stays, aim.pdf, best.pdf)
    best.light = dr.select(stays, aim.light, best.light)
    best.delta = dr.select(stays, delta, best.delta)
    best.worth = dr.select(stays, worth, best.worth)
    best.number += 1


_LIKELIEST = 0.95  # that a path goes on, by roulette
_SHORT = 1.0 - 9e-4  # share of the way to a lamp that must be free


class Bounds(NamedTuple):
    """How long paths are, and how bright, as arrays of Dr.Jit; see `integrator.Limits`."""

    most: Any
    roulette: Any
    cap: Any
    direct: Any


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """What paths go through.

    Attributes:
        solids: All that rays may meet.
        surfaces: Find what rays met.
        lights: The emitters.
        air: What is in the air, or None.
        halos: Lamps whose light it scatters, or None.
        mirrors: Whether lamps that a mirror shows count as seen directly.
    """

    solids: Solids
    surfaces: Surfaces
    lights: Lights
    air: Air | None = None
    halos: Halos | None = None
    mirrors: bool = False


@dataclass(slots=True)
class _FirstMet:
    """What a path met first.

    Attributes:
        hit: 1 where it is a surface, else 0.
        distance: To the surface [m]; else 0.
        albedo: Its reflectance; in a mirror, that of what the mirror shows.
        normal: Its unit shading normal; in a mirror, that of what the mirror shows.
        emitted: Its own light.
        mover: Number of the moving part that it belongs to; 0 for what stands.
    """

    hit: Any
    distance: Any
    albedo: Any
    normal: Any
    emitted: Any
    mover: Any


@dataclass(slots=True)
class _Path:
    """A path while it is followed.

    Attributes:
        active: Whether it goes on.
        ray: Its next segment.
        depth: Segments that lie behind.
        light: What was found.
        through: What reaches the eye of light that is found next.
        before: Where the ray starts.
        density: Of the ray's direction [1/sr].
        eta: Product of the indices of refraction that it went through.
        seen: What it met first.
    """

    active: Any
    ray: Any
    depth: Any
    light: Any
    through: Any
    before: Any
    density: Any
    eta: Any
    seen: _FirstMet


class _Scattered(NamedTuple):
    """What a surface does with light.

    Attributes:
        value: BSDF times the cosine towards an emitter, a colour.
        pdf: Chance to go there [1/sr].
        d: Where the path goes on, unit.
        density: Of that direction [1/sr].
        weight: BSDF times the cosine over the density, a colour.
        eta: Relative index of refraction there.
        albedo: Reflectance.
    """

    value: Any
    pdf: Any
    d: Any
    density: Any
    weight: Any
    eta: Any
    albedo: Any


def followed(
    place: Place, sampler: Any, ray: Any, bounds: Bounds, tile: Any = None
) -> tuple[list[Any], list[Any]]:
    """Follow paths; return each one's channels, in the order of the integrator's.

    The second list is what the first sample of a pixel is asked for.

    Args:
        place: What they go through.
        sampler: Where chance comes from.
        ray: Their first segments.
        bounds: How long and how bright they are.
        tile: Part of the picture that they belong to, where there are halos.
    """
    chance = None
    if place.halos is not None:
        chance = mi.Vector3f(*sampler.next_2d(), sampler.next_1d())
    number, colour = mi.Float(0.0), mi.Color3f(0.0)
    seen = _FirstMet(
        hit=mi.Float(number),
        distance=mi.Float(number),
        # Air that nothing is seen through is as pale a guide as things in fog.
        albedo=mi.Color3f(colour) if place.air is None else mi.Color3f(1.0),
        normal=mi.Vector3f(0.0),
        emitted=mi.Color3f(colour),
        mover=mi.Float(number),
    )
    path = _Path(
        active=mi.Bool(True),
        ray=mi.Ray3f(ray),
        depth=mi.UInt32(0),
        light=mi.Color3f(0.0),
        through=mi.Color3f(1.0),
        before=mi.Point3f(0.0),
        density=mi.Float(1.0),
        eta=mi.Float(1.0),
        seen=seen,
    )

    def step(path: _Path, sampler: Any) -> tuple[_Path, Any]:
        _stepped(path, sampler, place, bounds)
        return path, sampler

    path, _ = dr.while_loop((path, sampler), lambda path, _: path.active, step, label="paths")
    seen = path.seen
    if place.halos is not None:
        path.light += place.halos.along(
            place.solids, ray, seen.distance, tile, chance=chance, beside=mi.luminance(path.light)
        )
    emitted = [*seen.emitted] if place.lights.lamps else []
    of_all = [
        *_capped(path.light, bounds.cap),
        seen.distance,
        seen.hit,
        *seen.albedo,
        *seen.normal,
        *emitted,
    ]
    return of_all, [seen.mover, seen.distance] if place.surfaces.numbered else []


def emitted_along(place: Place, ray: Any) -> Any:
    """Return the light of lamps that are the first surface on a ray or in a mirror, a colour."""
    surface, clear, light = _lamps_along(place, ray, mi.Bool(True))
    if not place.mirrors:
        return light
    si, mirror = surface.si, surface.there & surface.finish.mirror
    bounce = surface.finish.bounce(si.wi, mi.Float(0.0), mi.Point2f(0.5))
    shown = _lamps_along(place, si.spawn_ray(si.to_world(bounce.wo)), mirror)[2]
    return light + dr.select(mirror, clear * bounce.weight * shown, 0.0)


def _lamps_along(place: Place, ray: Any, active: Any) -> tuple[Surface, Any, Any]:
    """Return what a ray meets first, the share of its light that passes, and light of lamps."""
    hit = place.solids.nearest(ray, True, active)
    surface = place.surfaces.met(hit, ray, active)
    before = dr.zeros(mi.Interaction3f)
    light = _as_seen(place.lights.glow(surface, before, surface.there)[0], surface)
    clear = mi.Color3f(1.0)
    if place.air is not None:
        clear = place.air.through(ray.o, ray.d, surface.si.t, surface.there)
    return surface, clear, light * clear


def _stepped(path: _Path, sampler: Any, place: Place, bounds: Bounds) -> None:
    """Follow a path's next segment, and find where it goes on."""
    ray, primary = path.ray, path.depth == 0
    hit = place.solids.nearest(ray, primary, path.active)
    surface = place.surfaces.met(hit, ray, path.active)
    clear = _veiled(path, surface, place.air)
    si, on = surface.si, surface.there & (path.depth + 1 < bounds.most)
    emitted = _met(path, hit, surface, place, bounds.direct)
    aim, delta = aimed(place.lights, surface, sampler, primary=primary, active=on)
    chance = (sampler.next_1d(on), sampler.next_2d(on))
    scattered = _scattered(surface, hit, ray, aim.d, chance, place.surfaces.kinds)

    # Light of the emitter that the path aims at.
    share = dr.select(delta, 1.0, _heuristic(aim.pdf, scattered.pdf))
    gain = path.through * scattered.value * aim.light * share
    # NaN is neither equal to 0 nor different from it here; it must be found and counted.
    lit = on & (aim.pdf > 0.0) & ~dr.all(gain == 0.0)
    lit &= ~place.solids.hide(_shadow_ray(si, aim), lit)
    path.light = dr.select(lit, path.light + gain, path.light)

    first = surface.there & primary
    _note(path.seen, first, surface, emitted, *_guides(surface, scattered.albedo, clear))
    if place.surfaces.numbered:
        _number(path.seen, place.surfaces.mover(hit, surface, first), first)

    # Where the path goes on, and whether.
    path.ray = si.spawn_ray(scattered.d)
    path.before, path.density = mi.Point3f(si.p), scattered.density
    path.depth = dr.select(surface.there, path.depth + 1, path.depth)
    path.eta *= scattered.eta
    through = path.through * scattered.weight
    brightest = dr.max(through)
    likely = dr.minimum(brightest * dr.square(path.eta), _LIKELIEST)
    late = path.depth >= bounds.roulette
    lucky = sampler.next_1d(on) < likely
    path.through = dr.select(late, through * dr.rcp(likely), through)
    path.active = on & (~late | lucky) & ~dr.all(path.through == 0.0)


def _shadow_ray(si: Any, aim: LightAim) -> Any:
    """Return the ray that tells whether an emitter is hidden.

    Rays start some centimetres off their surface, so one to a lamp must be aimed from there: a
    parallel ray would miss the lamp and end in the housing behind it.
    """
    ray = si.spawn_ray(aim.d)
    near = aim.distance < FAR
    to = si.p + aim.d * dr.select(near, aim.distance, 1.0) - ray.o
    away = dr.norm(to)
    ray.d = dr.select(near, to / away, ray.d)
    ray.maxt = dr.select(near, away * _SHORT, aim.distance)
    return ray


def _met(path: _Path, hit: Any, surface: Surface, place: Place, direct: Any) -> Any:
    """Add the light of what a path met; return that of a lamp."""
    before, lights = dr.zeros(mi.Interaction3f), place.lights
    before.p = path.before
    primary = path.depth == 0
    radiance, aimed = lights.met(hit, path.ray, before, path.active & ~surface.there)
    weight = dr.select(primary, 1.0, _heuristic(path.density, aimed))
    path.light = dr.fma(path.through, radiance * weight, path.light)
    if not lights.lamps:
        return mi.Color3f(0.0)
    radiance, aimed = lights.glow(surface, before, surface.there)
    radiance = dr.select(primary, _as_seen(radiance, surface), radiance)
    weight = dr.select(primary, 1.0, _heuristic(path.density, aimed))
    seen = primary
    if place.mirrors:
        # Only behind a mirror there is no normal yet.
        seen |= (path.depth == 1) & dr.all(path.seen.normal == 0.0)
    weight = dr.select(seen & ~direct, 0.0, weight)
    path.light = dr.fma(path.through, radiance * weight, path.light)
    return radiance


def _as_seen(radiance: Any, surface: Surface) -> Any:
    """Return a lamp's radiance as the eye sees it: lit rooms are not as bright everywhere."""
    return radiance if surface.shine is None else radiance * surface.shine


def _veiled(path: _Path, surface: Surface, air: Air | None) -> Any:
    """Add the light of the air before what a path met, and dim all behind; return what passes."""
    if air is None:
        return None
    ray = path.ray
    clear = air.through(ray.o, ray.d, surface.si.t, surface.there)
    path.light = dr.fma(path.through, air.light(ray.d) * (1.0 - clear), path.light)
    path.through *= clear
    return clear


def _guides(surface: Surface, albedo: Any, clear: Any) -> tuple[Any, Any]:
    """Return a surface's reflectance and normal as guides: as pale and flat as the fog before it.

    Args:
        surface: The surface.
        albedo: Its own reflectance.
        clear: Share of its light that passes the air before it, or None without air.
    """
    normal = mi.Vector3f(surface.si.sh_frame.n)
    if clear is None:
        return albedo, normal
    return dr.lerp(1.0, albedo, clear), normal * clear


def _note(
    seen: _FirstMet, first: Any, surface: Surface, emitted: Any, albedo: Any, normal: Any
) -> None:
    """Keep what a path met first.

    In a mirror the reflectance and normal are those of the first thing which is none: the pane
    itself is flat and grey, and would tell the denoiser nothing.
    """
    seen.hit = dr.select(first, 1.0, seen.hit)
    seen.distance = dr.select(first, surface.si.t, seen.distance)
    seen.emitted = dr.select(first, emitted, seen.emitted)
    if surface.finish.lobes.mirrors:
        first = surface.there & ~surface.finish.mirror & dr.all(seen.normal == 0.0)
    seen.albedo = dr.select(first, albedo, seen.albedo)
    seen.normal = dr.select(first, normal, seen.normal)


def _number(seen: _FirstMet, mover: Any, first: Any) -> None:
    """Keep which moving part a path met first."""
    seen.mover = dr.select(first, mover, seen.mover)


def _scattered(
    surface: Surface, hit: Any, ray: Any, d: Any, chance: Any, kinds: MaterialKind
) -> _Scattered:
    """Return what a surface does with light.

    Args:
        surface: The surface.
        hit: Mitsuba's preliminary intersection.
        ray: That met it.
        d: Unit vector to an emitter.
        chance: One number in [0, 1), and two.
        kinds: All that is special about the scene's materials.
    """
    si, finish = surface.si, surface.finish
    response = finish.respond(si.wi, si.to_local(d))
    bounce = finish.bounce(si.wi, *chance)
    ours = _Scattered(
        *response, si.to_world(bounce.wo), bounce.pdf, bounce.weight, mi.Float(1.0), finish.colour
    )
    if MaterialKind.FOREIGN not in kinds:
        return ours
    theirs = _by_mitsuba(surface.foreign, hit, ray, d, chance)
    pairs = zip(theirs, ours, strict=True)
    return _Scattered(*(dr.select(surface.foreign, a, b) for a, b in pairs))


def _by_mitsuba(foreign: Any, hit: Any, ray: Any, d: Any, chance: Any) -> _Scattered:
    """Return what Mitsuba's own materials do with light; arguments as in `_scattered`."""
    si = hit.compute_surface_interaction(ray, mi.RayFlags.All, foreign)
    bsdf = si.bsdf()
    wo = si.to_local(d)
    context = mi.BSDFContext()
    value, pdf, sample, weight = bsdf.eval_pdf_sample(context, si, wo, *chance, foreign)
    delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
    albedo = bsdf.eval_diffuse_reflectance(si, foreign)
    density = dr.select(delta, CERTAIN, sample.pdf)
    onwards = si.to_world(sample.wo)
    return _Scattered(value, pdf, onwards, density, weight, sample.eta, albedo)


def _heuristic(a: Any, b: Any) -> Any:
    """Return the weight of a sample of density a, where b could have found it, too."""
    a2 = dr.square(a)
    weight = a2 / (a2 + dr.square(b))
    return dr.select(dr.isfinite(weight), weight, 0.0)


def _capped(light: Any, cap: Any) -> list[Any]:
    """Return what stays of samples and what the cap takes; NaN and Inf are taken as Inf."""
    sound = dr.all(dr.isfinite(light))
    peak = dr.maximum(dr.max(light), 1e-30)
    light_within = light * dr.minimum(1.0, cap / peak)
    lost = dr.select(sound, light - light_within, np.inf)
    return [*dr.select(sound, light_within, 0.0), *lost]
