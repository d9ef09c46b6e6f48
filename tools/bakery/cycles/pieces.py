"""Pieces of two-wheelers as recipes give them.

Their origin is on the ground below the front of the front wheel; +x is ahead, +y on the left [m].
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.mesh.solids import box, lathe, mirrored, moved, shaded, tube
from sumo3dviz_pt.library.people.skin import closed, rope
from sumo3dviz_pt.library.vehicles.cycles.parts import Fineness, Point, arc, band, facing
from sumo3dviz_pt.library.vehicles.cycles.parts import loft as lofted
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Mesh

Count = int | tuple[int, int]
"""How many of something, or how many near and far."""

_MIDDLE: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Box(RecipeValue):
    """A box.

    Attributes:
        material: Of all of it.
        low: Its lowest corner [m].
        high: Its highest corner [m].
    """

    kind: Literal["box"]
    material: str
    low: Point
    high: Point

    def mesh(self, fine: Fineness, side: float) -> Mesh:
        """Build the box, or the one opposite where `side` is -1."""
        y = sorted((side * self.low[1], side * self.high[1]))
        return box((self.low[0], y[0], self.low[2]), (self.high[0], y[1], self.high[2]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Tube(RecipeValue):
    """A bent tube.

    Attributes:
        material: Of all of it.
        path: Its middle line [m].
        radius: Of all of it, or at each point of the path [m].
        sides: Facets around it; without a number as many as the level has.
        more: Facets beyond those of the level.
    """

    kind: Literal["tube"]
    material: str
    path: tuple[Point, ...]
    radius: float | tuple[float, ...]
    sides: int | None = None
    more: int = 0

    def mesh(self, fine: Fineness, side: float) -> Mesh:
        """Build the tube, or the one opposite where `side` is -1."""
        path = [_beside(point, side) for point in self.path]
        return tube(path, radius=self.radius, sides=self.sides or fine.sides + self.more)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rope(RecipeValue):
    """A bent tube with round ends and a smooth run of radii, such as a silencer.

    Attributes:
        material: Of all of it.
        path: Its middle line [m].
        radius: At each point of the path [m].
        sides: Facets around it.
    """

    kind: Literal["rope"]
    material: str
    path: tuple[Point, ...]
    radius: tuple[float, ...]
    sides: int

    def mesh(self, fine: Fineness, side: float) -> Mesh:
        """Build the rope, or the one opposite where `side` is -1."""
        path = np.array([_beside(point, side) for point in self.path])
        rings = rope(path, np.array(self.radius), self.sides)
        vertices, faces = closed(rings, bottom=True, top=True)
        return shaded(vertices, faces, crease=0.6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Loft(RecipeValue):
    """A rounded body along x.

    Attributes:
        material: Of all of it.
        sections: As those of `parts.loft`.
        rings: Rings along it.
        sides: Points of a ring.
        at: By how much it is shifted [m].
    """

    kind: Literal["loft"]
    material: str
    sections: tuple[tuple[float, float, float, float, float, float], ...]
    rings: Count
    sides: Count
    at: Point = _MIDDLE

    def mesh(self, fine: Fineness, side: float) -> Mesh:
        """Build the body, or the one opposite where `side` is -1."""
        rings, sides = _count(self.rings, fine), _count(self.sides, fine)
        mesh = lofted(self.sections, rings=rings, sides=sides)
        return mesh if self.at == _MIDDLE else moved(mesh, *_beside(self.at, side))


@dataclass(frozen=True, slots=True, kw_only=True)
class Turned(RecipeValue):
    """A body of revolution.

    Attributes:
        material: Of all of it.
        profile: Radius and place along the axis [m].
        segments: Facets around it.
        at: Where the profile begins [m].
        facing: Where the axis looks: to the left, ahead or behind.
        pitch: By how much it looks up [rad].
        mirrored: Whether it looks to the right instead, at the opposite place.
        crease: Angle above which an edge stays sharp [rad].
    """

    kind: Literal["turned"]
    material: str
    profile: tuple[tuple[float, float], ...]
    segments: int
    at: Point
    facing: Literal["left", "front", "rear"] = "left"
    pitch: float = 0.0
    mirrored: bool = False
    crease: float = 0.7

    def mesh(self, fine: Fineness, side: float) -> Mesh:
        """Build the body, or the one opposite where `side` is -1."""
        mesh, at = lathe(self.profile, segments=self.segments, crease=self.crease), self.at
        if self.facing == "left":
            placed = moved(mesh, *_beside(at, side))
            return mirrored(placed) if self.mirrored else placed
        yaw = np.pi if self.facing == "rear" else 0.0
        return facing(mesh, _beside(at, side), yaw=yaw, pitch=self.pitch)


@dataclass(frozen=True, slots=True, kw_only=True)
class Guard(RecipeValue):
    """A mudguard: a strip along an arc over a wheel.

    Attributes:
        material: Of all of it.
        at: Middle of the wheel [m].
        radius: Of the arc [m].
        turn: Angles of its ends from ahead upwards [deg].
        count: Points along the arc.
        half: Half its width [m].
        thick: Its thickness [m].
    """

    kind: Literal["guard"]
    material: str
    at: Point
    radius: float
    turn: tuple[float, float]
    count: int
    half: float
    thick: float

    def mesh(self, fine: Fineness, side: float) -> Mesh:
        """Build the mudguard, or the one opposite where `side` is -1."""
        path = arc(_beside(self.at, side), self.radius, *self.turn, self.count)
        return band(path, half=self.half, thick=self.thick)


Solid = Annotated[Box | Tube | Rope | Loft | Turned | Guard, Field(discriminator="kind")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair(RecipeValue):
    """Pieces on the left that are there on the right as well.

    Attributes:
        pieces: Those on the left.
    """

    kind: Literal["pair"]
    pieces: tuple[Solid, ...]


Item = Annotated[Box | Tube | Rope | Loft | Turned | Guard | Pair, Field(discriminator="kind")]
"""An entry in a recipe's list of pieces."""


def shaped(items: Iterable[Item], fine: Fineness) -> Iterator[MaterialMesh]:
    """Build pieces of a recipe; those of a pair first on the left, then on the right."""
    for item in items:
        if isinstance(item, Pair):
            for side in (1.0, -1.0):
                yield from ((solid.material, solid.mesh(fine, side)) for solid in item.pieces)
        else:
            yield item.material, item.mesh(fine, 1.0)


def _beside(point: Point, side: float) -> Point:
    """A point, or where `side` is -1 the one opposite."""
    return point[0], side * point[1], point[2]


def _count(count: Count, fine: Fineness) -> int:
    """How many at a level."""
    if isinstance(count, int):
        return count
    return count[0] if fine.small else count[1]
