"""What the layers of a frame are, found by the session that has just rendered it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.image.layers.boxes import SURFACES, Box2d, Box3d, box_3d, boxes_2d
from sumo3dviz_pt.image.layers.flow import flow_of
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints
from sumo3dviz_pt.model.scene import FrameState, Mover, Prototype
from sumo3dviz_pt.model.things import SKY, Thing

if TYPE_CHECKING:
    from sumo3dviz_pt.render.facts import Facts
    from sumo3dviz_pt.render.session import Session
    from sumo3dviz_pt.shot.build import Shot

_OWNED = frozenset({"ids", "instance", "semantic", "flow", "boxes2d", "boxes3d"})
"""Layers for which it must be known whose a pixel is."""

_SIDE = 4
"""Rays a pixel, along each of its sides, that tell coverage."""


def rays_for(wanted: Collection[str]) -> set[str]:
    """Return what rays through pixels' centres are asked for some layers."""
    rays = {"depth", "normals", "albedo"} & {*wanted}
    if _OWNED & {*wanted}:
        rays |= {"depth", "face", "instance"}
    if "flow" in wanted:
        rays.add("corners")
    return rays


@dataclass(frozen=True, eq=False)
class FrameFacts:
    """What a frame shows, by which its layers are made.

    Attributes:
        shot: What is shown.
        session: That has just rendered the frame.
        frame: What it shows.
        wanted: Layers that are asked for.
    """

    shot: Shot
    session: Session
    frame: FrameState
    wanted: frozenset[str]

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width, height [px]."""
        return self.session.settings.size

    @cached_property
    def facts(self) -> Facts:
        """What pixels' centres show."""
        return self.session.facts(rays_for(self.wanted))

    @cached_property
    def things(self) -> tuple[Thing, ...]:
        """All things that some pixel shows, in the order of `owner`; the first is the sky."""
        from sumo3dviz_pt.shot.things import thing_of

        ego = self.frame.view.rides_in
        return tuple(thing_of(name, self.shot.fleet, ego=ego) for name in self._owner[1])

    @property
    def owner(self) -> Ints:
        """Which of the things each pixel shows, (h, w)."""
        return self._owner[0]

    @cached_property
    def _owner(self) -> tuple[Ints, tuple[str, ...]]:
        """Which thing each pixel shows, (h, w), and the names of those that are seen."""
        names: dict[str, int] = {SKY: 0}
        return self._renumbered(self.facts, names), tuple(names)

    def _renumbered(self, facts: Facts, names: dict[str, int]) -> Ints:
        """Return which thing each pixel shows, (h, w); things that are new join the names."""
        assert facts.owner is not None, "ask for owners"
        places = np.zeros(len(facts.names), np.int64)
        for number in np.flatnonzero(np.bincount(facts.owner.ravel())).tolist():
            if number:
                name = self.thing_of(facts.names[number])
                places[number] = names.setdefault(name, len(names))
        return places[facts.owner]

    def thing_of(self, part: str) -> str:
        """Return the name of the thing that a part of what moves, or what stands, belongs to."""
        return self._movers[part].id if part in self._movers else part

    @cached_property
    def _movers(self) -> Mapping[str, Mover]:
        """Everything that moves, by its name."""
        frame = self.frame
        return {mover.name: mover for mover in (*frame.everyone, *frame.fixtures)}

    @property
    def numbers(self) -> Any:
        """Instance number of each pixel, (h, w)."""
        return np.array([thing.number for thing in self.things], np.uint32)[self.owner]

    @property
    def classes(self) -> Any:
        """Id of each pixel's class, (h, w)."""
        return np.array([thing.label_id for thing in self.things], np.uint8)[self.owner]

    def flow(self, after: FrameState) -> tuple[Image, Bools]:
        """Return the flow to another frame, (h, w, 2) [px], and where it is known."""
        from sumo3dviz_pt.render.facts import carried, points_of

        facts, view = self.facts, self.frame.view
        points = points_of(facts, self.frame, self.size)
        moved, known = carried(facts, self.session.loaded, (self.frame, after), points)
        sky = facts.found["depth"] <= 0.0
        flow, ahead = flow_of(moved, view.directions(self.size), sky, view=after.view)
        flow[~known] = 0.0
        return flow, known & ahead

    def coverage(self) -> tuple[list[Ints], tuple[str, ...]]:
        """Return which thing several places of every pixel show, (h, w) each, and their names."""
        names: dict[str, int] = {"": 0}
        found = []
        for row, column in np.ndindex(_SIDE, _SIDE):
            at = ((column + 0.5) / _SIDE, (row + 0.5) / _SIDE)
            rays = {"depth", "face", "instance"}
            facts = self.session.facts(rays, at=at, owners=self.facts.owners)
            found.append(self._renumbered(facts, names))
        return found, tuple(names)

    @cached_property
    def boxes_2d(self) -> tuple[Box2d, ...]:
        """Boxes around the pixels of all things that have an outline of their own."""
        boxes = boxes_2d(self.owner, [thing.name for thing in self.things])
        kinds = {thing.name: thing for thing in self.things}
        return tuple(box for box in boxes if _is_boxed(kinds[box.name]))

    @cached_property
    def boxes_3d(self) -> tuple[Box3d, ...]:
        """Boxes around all road users that some pixel shows, without the one ridden in."""
        seen = {thing.name for thing in self.things}
        return tuple(
            box_3d(mover.id, mover.part, _bounds(self._prototype(mover)), mover.world_from_body)
            for mover in self.frame.everyone
            if mover.id in seen
            and mover.id != self.frame.view.rides_in
            and (not mover.part or mover.part.removeprefix("unit").isdecimal())
        )

    def _prototype(self, mover: Mover) -> Prototype:
        """Return the body of a mover."""
        return self.shot.data.prototypes[mover.prototype]

    @cached_property
    def lit(self) -> tuple[str, ...]:
        """Names of all lamps that are lit, of those that can change and are in the scene."""
        data, found = self.shot.data, set()
        for some in data.lamps:
            if some.radiance is None:
                shines = np.asarray(self.frame.lamps[some.id]).max(axis=1) > 0.0
                lamps = zip(some.lamps, shines.tolist(), strict=True)
                found |= {f"{some.id}:{lamp}" for lamp, lit in lamps if lit}
        for mover in self.frame.everyone:
            roles = {lamp.role for lamp in self._prototype(mover).lamps}
            found |= {f"{mover.id}/{role}" for role in mover.lit & roles}
        return tuple(sorted(found))


def _is_boxed(thing: Thing) -> bool:
    """Return whether a thing has a box: a road user, or what has a name and an outline."""
    return ":" in thing.name and thing.label not in SURFACES


def _bounds(body: Prototype) -> Floats:
    """Return the lowest and highest corner of a body, in all of its poses, (2, 3) [m]."""
    if body.poses is not None:
        points = body.poses.vertices.reshape(-1, 3)
    else:
        points = np.concatenate([part.mesh.vertices for part in body.parts])
    return np.stack([points.min(axis=0), points.max(axis=0)])
