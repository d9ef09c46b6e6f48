"""Of some directions to emitters, a path takes the one that is likely to matter most.

Candidates are picked as single directions would be, each from its own part of all emitters; one
of them stays, in proportion to the light that the surface sends on if nothing is in the way,
and only for that one a shadow ray is traced.
What all candidates bring on average is what the one brings that stays, so nothing is biased.

References:
    Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR 2005.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.kernel.lights import Aim, Lights
from sumo3dviz_pt.render.kernel.surface import Surface

FIRST, LATER = 8, 1
"""Candidates of a path's first surface, which the eye sees, and of all others."""

_BROKEN = 1e20  # worth of light that is NaN or Inf: it must be found and counted


@dataclass(slots=True)
class _Kept:
    """The candidate that stays so far.

    Attributes:
        number: Candidates that were looked at.
        d: As all of the following, of an `Aim`.
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
) -> tuple[Aim, Any]:
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

    def step(kept: _Kept, sampler: Any) -> Any:
        _look(kept, lights, surface, sampler, count=count, active=active)
        return kept, sampler

    kept = dr.while_loop(
        (_nothing(), sampler), lambda kept, _: kept.number < count, step, label="candidates"
    )[0]
    found = kept.worth > 0.0
    share = dr.select(found, kept.total / (kept.worth * mi.Float(count)), 0.0)
    pdf = dr.select(found, kept.pdf, 0.0)
    return Aim(kept.d, kept.distance, pdf, kept.light * share), kept.delta


def _nothing() -> _Kept:
    """Return what is kept before there is a candidate."""
    number, none = mi.UInt32(0), mi.Float(0.0)
    ahead, dark = mi.Vector3f(0.0, 0.0, 1.0), mi.Color3f(0.0)
    return _Kept(
        number, ahead, mi.Float(none), mi.Float(none), dark, mi.Bool(False), mi.Float(none), none
    )


def _look(
    kept: _Kept, lights: Lights, surface: Surface, sampler: Any, *, count: Any, active: Any
) -> None:
    """Look at one more candidate of so many, which may stay instead of the one before."""
    chance = sampler.next_2d(active)
    # Each candidate has its own part of all emitters.
    chance.x = (mi.Float(kept.number) + chance.x) / mi.Float(count)
    si = surface.si
    aim, delta = lights.aim(si.p, chance, active)
    answer = mi.luminance(surface.finish.respond(si.wi, si.to_local(aim.d)).value)
    # What Mitsuba's own materials answer is not asked here.
    answer = dr.select(surface.foreign, dr.abs(dr.dot(aim.d, si.n)), answer)
    worth = mi.luminance(aim.light) * answer
    worth = dr.select(dr.isfinite(worth), worth, _BROKEN)
    worth = dr.select(aim.pdf > 0.0, worth, 0.0)
    kept.total += worth
    stays = sampler.next_1d(active) * kept.total < worth
    kept.d = dr.select(stays, aim.d, kept.d)
    kept.distance = dr.select(stays, aim.distance, kept.distance)
    kept.pdf = dr.select(stays, aim.pdf, kept.pdf)
    kept.light = dr.select(stays, aim.light, kept.light)
    kept.delta = dr.select(stays, delta, kept.delta)
    kept.worth = dr.select(stays, worth, kept.worth)
    kept.number += 1
