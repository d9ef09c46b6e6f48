"""What of a scene a shot uses, and what is absent."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import Bsdf, LeftOut, Prototype
from sumo3dviz_pt.shot.crowd import CrowdPlan
from sumo3dviz_pt.world.build import BuiltPlace


def used_materials(
    place: BuiltPlace, prototypes: Collection[Prototype], own: Mapping[str, Bsdf]
) -> dict[str, Bsdf]:
    """Return the materials in use.

    Args:
        place: What stands.
        prototypes: Bodies that are shown.
        own: Materials of users' models.
    """
    used = {part.part.material for part in place.static}
    for prototype in prototypes:
        used |= {part.material for part in (*prototype.parts, *prototype.far)}
    if place.lamps or any(prototype.lamps for prototype in prototypes):
        used.add("signal_lens")
    known = {**place.materials, **own}
    return {name: known[name] for name in sorted(used)}


def absent_users(scenario: Scenario, fleet: Fleet, crowd: CrowdPlan) -> tuple[LeftOut, ...]:
    """Return which road users the log or the view does not have.

    Args:
        scenario: As read.
        fleet: Everyone on the road.
        crowd: How the shot draws them.
    """
    out = []
    kinds = {trace.kind for trace in scenario.traffic.traces}
    if "person" not in kinds:
        out.append(LeftOut("persons", "the log has none in this time"))
    slots = crowd.slots
    unused = sorted(set(fleet.prototypes) - {*slots.near, *slots.far, *slots.deforming})
    if unused:
        spared = sum(fleet.prototypes[name].triangles for name in unused)
        why = "no road user in view of the shot has them"
        out.append(LeftOut(f"{len(unused)} bodies", why, triangles=spared))
    return tuple(out)
