"""Fits bodies to other lengths: only their stretch becomes longer, and wheels stay round."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.library.vehicles.parts import WheelPlace
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.lamps import VehicleLamp
from sumo3dviz_pt.model.scene import Prototype

_TURNING = frozenset(["rubber", "rim", "disc"])
"""Materials of wheels."""

_MOST_SHRINK = 0.35
"""A stretch keeps at least this share of its length."""


@dataclass(frozen=True, slots=True)
class BodyStretch:
    """A part of a body that may be longer or shorter.

    Attributes:
        first: Where it begins, behind the front [m].
        last: Where it ends, behind the front [m].
        factor: How much longer it becomes, > 0.
    """

    first: float
    last: float
    factor: float

    @classmethod
    def to_length(cls, span: tuple[float, float], *, extra: float) -> BodyStretch:
        """Return the stretch that makes a body longer by `extra` [m], or as short as it may be.

        Args:
            span: Where it begins and ends, behind the front [m].
            extra: By how much the body is to become longer, negative for shorter [m].
        """
        length = span[1] - span[0]
        return cls(*span, max((length + extra) / length, _MOST_SHRINK))

    @property
    def gain(self) -> float:
        """By how much the body becomes longer [m]."""
        return (self.factor - 1.0) * (self.last - self.first)

    def moved(self, x: Floats) -> Floats:
        """Return where points at x <= 0, of any shape, come to lie [m]."""
        behind = np.clip(-np.asarray(x), self.first, self.last) - self.first
        return np.asarray(x - (self.factor - 1.0) * behind)

    def moved_point(self, point: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return where one point comes to lie [m]."""
        x, y, z = point
        return float(self.moved(np.array(x))), y, z


def stretched(prototype: Prototype, stretch: BodyStretch, *, name: str) -> Prototype:
    """Return a body whose stretch has another length; all else keeps its shape.

    Args:
        prototype: The body in its own length.
        stretch: What becomes longer.
        name: Of the new body.
    """
    near, far = (
        tuple(replace(part, mesh=_longer(part.mesh, stretch)) for part in parts)
        for parts in (prototype.parts, prototype.far)
    )
    lamps = tuple(_lamp(lamp, stretch) for lamp in prototype.lamps)
    return Prototype(name, near, far, lamps)


def turned_round(mesh: Mesh, length: float) -> Mesh:
    """Turn a mesh by half a circle about the middle of a length [m]."""
    turn = np.array([-1.0, -1.0, 1.0])
    normals = None if mesh.normals is None else mesh.normals * turn
    moved = mesh.vertices * turn - np.array([length, 0.0, 0.0])
    return replace(mesh, vertices=moved, normals=normals)


def round_wheels(
    prototype: Prototype, wheels: Sequence[WheelPlace], *, ratio: float, name: str
) -> Prototype:
    """Return a body whose wheels become round when x is scaled by `ratio` more than z.

    Args:
        prototype: The unscaled body.
        wheels: Where its wheels are.
        ratio: Factor of x over that of z, > 0.
        name: Of the new body.
    """
    near, far = (
        tuple(
            replace(part, mesh=_rounded(part.mesh, wheels, ratio))
            if part.material in _TURNING
            else part
            for part in parts
        )
        for parts in (prototype.parts, prototype.far)
    )
    return replace(prototype, name=name, parts=near, far=far)


def _rounded(mesh: Mesh, wheels: Sequence[WheelPlace], ratio: float) -> Mesh:
    """Squeeze the points of each wheel towards its axle."""
    vertices = mesh.vertices.copy()
    for wheel in wheels:
        away = vertices[:, [0, 2]] - [wheel.at[0], wheel.at[2]]
        own = (np.linalg.norm(away, axis=1) < 1.02 * wheel.radius) & (
            np.sign(vertices[:, 1]) == np.sign(wheel.at[1])
        )
        vertices[own, 0] = wheel.at[0] + away[own, 0] / ratio
    return replace(mesh, vertices=vertices)


def _longer(mesh: Mesh, stretch: BodyStretch) -> Mesh:
    """A mesh with its points moved."""
    vertices = mesh.vertices.copy()
    vertices[:, 0] = stretch.moved(vertices[:, 0])
    return replace(mesh, vertices=vertices)


def _lamp(lamp: VehicleLamp, stretch: BodyStretch) -> VehicleLamp:
    """A lamp on the longer body."""
    return replace(lamp, at=stretch.moved_point(lamp.at))
