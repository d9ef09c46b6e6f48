"""Names for all faces of what stands, where somebody asks what pixels show."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.model.things import Thing, thing_named
from sumo3dviz_pt.world.placement.things import thing_at
from sumo3dviz_pt.world.roads.owners import RoadOwners

if TYPE_CHECKING:
    from sumo3dviz_pt.shot.build import Shot

_ROADS = ("road/", "markings/", "rails/")


def with_things(shot: Shot) -> Shot:
    """Return the same shot; every face of what stands belongs to a thing.

    Objects have names from the beginning. Faces of roads get those of their edges and junctions
    here, and whatever still has none that of its part.
    """
    data, owners = shot.data, shot.road_owners
    assert owners is not None, "was not made by `ShotBuilder`"
    static = tuple(_named(part, owners) for part in data.static)
    lamps = tuple(_named_lamps(some) for some in data.lamps)
    return replace(shot, data=replace(data, static=static, lamps=lamps))


def thing_of(name: str, fleet: Fleet, *, ego: str | None = None) -> Thing:
    """Return the thing of a name, with its class.

    Args:
        name: Of a road user, or of what stands.
        fleet: Everyone on the road.
        ego: Name of the road user that the camera rides in.
    """
    vclass = fleet.body(name).vclass if name in fleet.places else ""
    return thing_named(name, vclass=vclass, ego=name == ego)


def _named(static: StaticPart, owners: RoadOwners) -> StaticPart:
    """Return a part whose faces all have names."""
    mesh, things = static.part.mesh, static.part.mesh.things
    if not things and static.id.startswith(_ROADS):
        things = owners.things(static.id, mesh)
    named = _filled(replace(mesh, things=things), _name_of(static))
    return replace(static, part=replace(static.part, mesh=named))


def _name_of(static: StaticPart) -> str:
    """Return the name of a part's faces that have none: its id, without a number at its end."""
    if "/court/" in static.id:  # courts are numbered as a camera sees them
        return thing_at("court", static.part.mesh.bounds.mean(axis=0)[:2])
    head, _, last = static.id.rpartition("/")
    return head if last.isdecimal() else static.id


def _named_lamps(lamps: LampSet) -> LampSet:
    """Return a lamp set whose faces all have names."""
    return replace(lamps, mesh=_filled(lamps.mesh, lamps.id))


def _filled(mesh: Mesh, name: str) -> Mesh:
    """Return a mesh with a name where it has none."""
    runs = mesh.things or (("", len(mesh.faces)),)
    return replace(mesh, things=tuple((thing or name, count) for thing, count in runs))
