"""Orders of branches, grown all at once, and their bark as tapered tubes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.vectors import unit

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
        """Find places along branches and unit directions there, (n, 3) each; share in [0, 1]."""
        steps = self.points.shape[1] - 1
        place = np.clip(share, 0.0, 1.0) * steps
        index = np.minimum(place.astype(np.int64), steps - 1)
        a, b = self.points[which, index], self.points[which, index + 1]
        direction = unit(b - a)
        return a + (b - a) * (place - index)[:, None], direction


@dataclass(frozen=True, slots=True)
class Manner:
    """How branches of one order grow.

    Attributes:
        bend: Upward bend per step; negative droops.
        wobble: Random change of direction per step.
        flat: Whether they leave to both sides in a plane, not all around.
        thick: Their radius by that of their parent where they leave it.
    """

    bend: float = 0.05
    wobble: float = 0.12
    flat: bool = False
    thick: float = 0.55


def trunk(
    height: float,
    radius: float,
    *,
    rng: np.random.Generator,
    top: float = 0.92,
    crooked: float = 0.007,
) -> Branches:
    """Grow a slightly crooked stem; its foot is 0.3 m deep in the ground.

    Args:
        height: Of the tree [m].
        radius: Above the root flare [m].
        rng: Makes it crooked.
        top: Where the stem ends, as a share of the height.
        crooked: Sideways step between its nine points, as a share of the height.
    """
    z = np.linspace(0.0, top * height, 9)
    wander = np.cumsum(rng.normal(0, crooked * height, (9, 2)), axis=0)
    # A tree stands upright at its foot.
    wander -= wander[:1] + (wander[1:2] - wander[:1]) * np.array([[0.0], *[[1.0]] * 8])
    points = np.column_stack([wander, z])
    points[0, 2] = -0.3
    radii = radius * np.interp(z / height, (0.0, 0.05, 0.5, top), (1.06, 1.0, 0.6, 0.12))
    return Branches(points[None], radii[None], np.array([top * height]))


def children(
    parents: Branches,
    at: Floats,
    lengths: Floats,
    *,
    angles: Floats,
    rng: np.random.Generator,
    manner: Manner,
) -> Branches:
    """Grow the next order of branches.

    Args:
        parents: The order to grow from, n branches.
        at: Where children leave, (n or 1, k) in [0, 1].
        lengths: (n or 1, k) [m].
        angles: Between child and parent, (n or 1, k) [rad].
        rng: Jitters directions.
        manner: How they grow.
    """
    shape = (parents.count, at.shape[1])
    which = np.repeat(np.arange(shape[0]), shape[1])
    share = np.broadcast_to(at, shape).reshape(-1)
    long = np.broadcast_to(lengths, shape).reshape(-1)
    start, along = parents.points_at(which, share)
    turn = _turns(shape, manner, rng).reshape(-1)
    direction = _tilted(along, np.broadcast_to(angles, shape).reshape(-1), turn)
    step = (long / _STEPS)[:, None]
    points = [start]
    for _ in range(_STEPS):
        jitter = rng.normal(0, manner.wobble, direction.shape)
        direction = direction + jitter + [0, 0, manner.bend]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        points.append(points[-1] + direction * step)
    thick = _radius_at(parents, which, share) * manner.thick
    radii = thick[:, None] * np.linspace(1.0, 0.3, _STEPS + 1)
    return Branches(np.stack(points, axis=1), radii, long)


def root_flare(radius: float, *, sides: int, rng: np.random.Generator) -> Mesh:
    """Build the foot of a trunk: wider towards the ground, with buttresses between the roots.

    Args:
        radius: Of the trunk above it [m].
        sides: Facets around.
        rng: Turns and varies the buttresses.
    """
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    lobes = np.cos(4 * turn + rng.uniform(0, 2 * np.pi)) + 0.6 * rng.normal(0, 0.5, sides)
    spread = np.array([2.0, 1.75, 1.35, 1.12, 1.0])
    share = np.array([1.0, 1.0, 0.6, 0.3, 0.05])
    rings = radius * spread[:, None] * (1.0 + 0.13 * share[:, None] * lobes)
    heights = radius * np.array([-1.2, 0.0, 0.8, 2.2, 4.5])
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    vertices = np.concatenate(
        [rings[..., None] * circle, np.broadcast_to(heights[:, None, None], (5, sides, 1))], axis=2
    )
    outward = np.broadcast_to(np.append(circle, np.full((sides, 1), 0.25), axis=1), vertices.shape)
    normals = (outward / np.linalg.norm(outward, axis=2, keepdims=True)).reshape(-1, 3)
    return Mesh(vertices.reshape(-1, 3), _ring_faces(sides, 4), normals)


def bark(orders: Sequence[Branches], sides: Sequence[int], steps: Sequence[int]) -> Mesh:
    """Build tubes around orders of branches, with smooth normals.

    Args:
        orders: From the trunk outwards.
        sides: Facets around, of each order.
        steps: Pieces along, of each order.
    """
    return merge_meshes([_tubes(o, s, n) for o, s, n in zip(orders, sides, steps, strict=True)])


def _turns(shape: tuple[int, int], manner: Manner, rng: np.random.Generator) -> Floats:
    """Draw the angles around the parent at which children leave, (n, k) [rad]."""
    number = np.arange(shape[1])
    if manner.flat:
        return np.asarray(np.pi * (number % 2) + rng.normal(0, 0.2, shape))
    turn = rng.uniform(0, 2 * np.pi, (shape[0], 1)) + _GOLDEN * number
    return np.asarray(turn + rng.normal(0, 0.3, shape))


def _tilted(axis: Floats, angle: Floats, turn: Floats) -> Floats:
    """Return directions at an angle from axes, turned around them, (n, 3)."""
    helper = np.where(np.abs(axis[:, 2:]) > 0.9, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    u = np.cross(axis, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(axis, u)
    side = u * np.cos(turn)[:, None] + v * np.sin(turn)[:, None]
    tilted: Floats = axis * np.cos(angle)[:, None] + side * np.sin(angle)[:, None]
    return tilted


def _radius_at(branches: Branches, which: Ints, share: Floats) -> Floats:
    """Return the radius of branches at shares of their length, (n,) [m]."""
    place = share * (branches.radii.shape[1] - 1)
    index = np.minimum(place.astype(np.int64), branches.radii.shape[1] - 2)
    a, b = branches.radii[which, index], branches.radii[which, index + 1]
    radius: Floats = a + (b - a) * (place - index)
    return radius


def _tubes(branches: Branches, sides: int, steps: int) -> Mesh:
    """Build open tubes around branches, thinned to a number of steps."""
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
    stride = (steps + 1) * sides
    faces = np.arange(branches.count)[:, None, None] * stride + _ring_faces(sides, steps)
    return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), normals.reshape(-1, 3))


def _ring_faces(sides: int, steps: int) -> Ints:
    """Return the triangles between rings of vertices, (2 * sides * steps, 3)."""
    ring = np.arange(sides)
    i = np.arange(steps)[:, None] * sides
    a, b = i + ring, i + (ring + 1) % sides
    pairs = [np.stack([a, b, b + sides], -1), np.stack([a, b + sides, a + sides], -1)]
    return np.concatenate(pairs).reshape(-1, 3)
