"""Orders of branches, grown all at once, and their bark as tapered tubes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes

_STEPS = 6
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # golden angle [rad]


@dataclass(frozen=True, slots=True, eq=False)
class Branches:
    """All branches of one order as polylines.

    Attributes:
        points: (n, steps + 1, 3) [m].
        radii: At each point, (n, steps + 1) [m].
        lengths: (n,) [m].
    """

    points: Floats
    radii: Floats
    lengths: Floats

    @property
    def count(self) -> int:
        """How many branches there are."""
        return len(self.points)

    def points_at(self, which: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Places along branches and unit directions there, (n, 3) each; share in [0, 1]."""
        steps = self.points.shape[1] - 1
        place = np.clip(share, 0.0, 1.0) * steps
        index = np.minimum(place.astype(np.int64), steps - 1)
        a, b = self.points[which, index], self.points[which, index + 1]
        direction = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1, keepdims=True), 1e-12)
        return a + (b - a) * (place - index)[:, None], direction


def trunk(height: float, radius: float, *, rng: np.random.Generator) -> Branches:
    """A slightly crooked stem; its foot is wider and 0.3 m deep in the ground."""
    z = np.linspace(0.0, 0.92 * height, 9)
    wander = np.cumsum(rng.normal(0, 0.008 * height, (9, 2)), axis=0)
    wander -= wander[:1]
    points = np.column_stack([wander, z])
    points[0, 2] = -0.3
    radii = radius * np.interp(z / height, (0.0, 0.05, 0.5, 0.92), (1.5, 1.0, 0.6, 0.15))
    return Branches(points[None], radii[None], np.array([height]))


def children(
    parents: Branches,
    at: Floats,
    lengths: Floats,
    *,
    angles: Floats,
    rng: np.random.Generator,
    bend: float = 0.05,
) -> Branches:
    """Grow the next order of branches.

    Args:
        parents: The order to grow from, n branches.
        at: Where children leave, (n or 1, k) in [0, 1].
        lengths: (n or 1, k) [m].
        angles: Between child and parent, (n or 1, k) [rad].
        rng: Jitters directions.
        bend: Upward bend per step; negative droops.
    """
    shape = (parents.count, at.shape[1])
    which = np.repeat(np.arange(shape[0]), shape[1])
    share = np.broadcast_to(at, shape).reshape(-1)
    long = np.broadcast_to(lengths, shape).reshape(-1)
    start, along = parents.points_at(which, share)
    turn = rng.uniform(0, 2 * np.pi, (shape[0], 1)) + _GOLDEN * np.arange(shape[1])
    turn = (turn + rng.normal(0, 0.3, shape)).reshape(-1)
    angle = np.broadcast_to(angles, shape).reshape(-1)
    direction = _tilted(along, angle, turn)
    step = (long / _STEPS)[:, None]
    points = [start]
    for _ in range(_STEPS):
        direction = direction + rng.normal(0, 0.12, direction.shape) + [0, 0, bend]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        points.append(points[-1] + direction * step)
    thick = _radius_at(parents, which, share) * 0.55
    radii = thick[:, None] * np.linspace(1.0, 0.3, _STEPS + 1)
    return Branches(np.stack(points, axis=1), radii, long)


def bark(orders: Sequence[Branches], sides: Sequence[int], steps: Sequence[int]) -> Mesh:
    """Tubes around orders of branches, with smooth normals.

    Args:
        orders: From the trunk outwards.
        sides: Facets around, of each order.
        steps: Pieces along, of each order.
    """
    return merge_meshes([_tubes(o, s, n) for o, s, n in zip(orders, sides, steps, strict=True)])


def _tilted(axis: Floats, angle: Floats, turn: Floats) -> Floats:
    """Directions at an angle from axes, turned around them, (n, 3)."""
    helper = np.where(np.abs(axis[:, 2:]) > 0.9, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    u = np.cross(axis, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(axis, u)
    side = u * np.cos(turn)[:, None] + v * np.sin(turn)[:, None]
    tilted: Floats = axis * np.cos(angle)[:, None] + side * np.sin(angle)[:, None]
    return tilted


def _radius_at(branches: Branches, which: Ints, share: Floats) -> Floats:
    """Radius of branches at shares of their length, (n,) [m]."""
    place = share * (branches.radii.shape[1] - 1)
    index = np.minimum(place.astype(np.int64), branches.radii.shape[1] - 2)
    a, b = branches.radii[which, index], branches.radii[which, index + 1]
    radius: Floats = a + (b - a) * (place - index)
    return radius


def _tubes(branches: Branches, sides: int, steps: int) -> Mesh:
    """Open tubes around branches, thinned to a number of steps."""
    keep = np.round(np.linspace(0, branches.points.shape[1] - 1, steps + 1)).astype(np.int64)
    points, radii = branches.points[:, keep], branches.radii[:, keep]
    along = np.gradient(points, axis=1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    # One helper direction per branch, so that the rings of a tube do not twist.
    mean = along.mean(axis=1, keepdims=True)
    helper = np.where(np.abs(mean[..., 2:]) > 0.8, [[[1.0, 0.0, 0.0]]], [[[0.0, 0.0, 1.0]]])
    u = np.cross(along, helper)
    u /= np.linalg.norm(u, axis=2, keepdims=True)
    v = np.cross(along, u)
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    normals = u[:, :, None] * np.cos(turn) + v[:, :, None] * np.sin(turn)
    vertices = points[:, :, None] + radii[:, :, None, None] * normals
    ring = np.arange(sides)
    i = np.arange(steps)[:, None] * sides
    a, b = i + ring, i + (ring + 1) % sides
    one = np.concatenate([np.stack([a, b, b + sides], -1), np.stack([a, b + sides, a + sides], -1)])
    stride = (steps + 1) * sides
    faces = np.arange(branches.count)[:, None, None] * stride + one.reshape(-1, 3)
    return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), normals.reshape(-1, 3))
