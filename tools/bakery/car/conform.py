"""Places and pieces that follow a car's body: bars, and where something lies on it.

Points are given as in a recipe (see `recipe.py`); the results lie in the body's frame, with
x = -d.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from bakery.car.body import CarShape
from bakery.mesh.implicit import gradient
from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.library.mesh.solids import shaded
from sumo3dviz_pt.model.geometry import Floats, Mesh, settled

_MARCHES = 60  # steps of a ray towards the body
_HALVINGS = 14  # of the step that enters it
_LONGEST_RUN = 2.6  # of a ray [m]
_FLIP = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True)
class CarFineness:
    """How finely a car is made.

    Attributes:
        spacing: Of the body's grid where it bends [m].
        faces: Of half the body after simplification.
        step: Between the sections of bars [m].
        sides: Facets of round pieces.
        gap: Depth of shut lines [m].
        bevels: Whether bars have bevelled edges.
    """

    spacing: float
    faces: int
    step: float
    sides: int
    gap: float = 0.0
    bevels: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class BodySpots:
    """Places on a body.

    Attributes:
        points: In the body's frame, (n, 3) [m].
        normals: Unit, outward, (n, 3).
    """

    points: Floats
    normals: Floats


def land(shape: CarShape, view: str, path: ArrayLike) -> BodySpots:
    """Return where rays along a view first meet the body.

    Args:
        shape: The body.
        view: Of a panel.
        path: Points as those of an outline, (n, 2) [m].
    """
    u, v = np.asarray(path, dtype=np.float64).T
    start, way = _rays(shape, view, u, v)
    run = np.zeros(len(u))
    last = run.copy()
    for _ in range(_MARCHES):
        value = shape.field(*(start + run[:, None] * way).T)
        outside = value > 0.0
        if not outside.any():
            break
        last = np.where(outside, run, last)
        run = np.where(
            outside, np.minimum(run + np.clip(0.6 * value, 4e-4, 0.1), _LONGEST_RUN), run
        )
    for _ in range(_HALVINGS):
        middle = 0.5 * (last + run)
        outside = shape.field(*(start + middle[:, None] * way).T) > 0.0
        last, run = np.where(outside, middle, last), np.where(outside, run, middle)
    points = start + run[:, None] * way
    normals = gradient(shape.field, points, step=0.004)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    return BodySpots(points * _FLIP, normals * _FLIP)


def _rays(shape: CarShape, view: str, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Starts, (n, 3), and direction, (3,), of the rays of a view in (d, y, z)."""
    recipe = shape.recipe
    fixed = np.zeros_like(u)
    if view == "side":
        return np.stack([u, fixed + shape.half + 0.25, v], axis=1), np.array([0.0, -1.0, 0.0])
    if view == "top":
        return np.stack([u, v, fixed + recipe.height + 0.2], axis=1), np.array([0.0, 0.0, -1.0])
    begin, sign = (-0.15, 1.0) if view == "front" else (recipe.length + 0.15, -1.0)
    return np.stack([fixed + begin, u, v], axis=1), np.array([sign, 0.0, 0.0])


def resampled(path: Sequence[Sequence[float]], step: float) -> Floats:
    """Add points to a polyline until no two are further apart than a step [m]."""
    points = np.asarray(path, dtype=np.float64)
    pieces = [points[:1]]
    for a, b in pairwise(points):
        count = max(1, int(np.ceil(settled(np.hypot(*(b - a)) / step))))
        pieces.append(a + (b - a) * np.linspace(0.0, 1.0, count + 1)[1:, None])
    return np.concatenate(pieces)


def bar(
    spots: BodySpots, width: float, *, height: float, depth: float, bevelled: bool = False
) -> Mesh:
    """Build a closed bar along places on a body.

    Args:
        spots: Along its middle line, at least two.
        width: Across [m].
        height: Of its face over the body [m].
        depth: Of its back under the body [m].
        bevelled: Whether its outer edges are bevelled.
    """
    points, normals = spots.points, spots.normals
    along = np.gradient(points, axis=0)
    across = np.cross(normals, along)
    across /= np.linalg.norm(across, axis=1, keepdims=True) + 1e-12
    bevel = min(0.25 * width, 0.5 * (height + depth), 0.004)
    section: list[tuple[float, float, float]]
    section = [(-1, 0, -depth), (-1, 0, height), (1, 0, height), (1, 0, -depth)]
    if bevelled:
        edges = [(-1, 0, height - bevel), (-1, 1, height), (1, -1, height), (1, 0, height - bevel)]
        section = [section[0], *edges, section[3]]
    rings = [
        points + (side * width / 2 + inwards * bevel) * across + level * normals
        for side, inwards, level in section
    ]
    vertices = np.stack(rings, axis=1).reshape(-1, 3)
    return closed(vertices, len(points), len(section))


def closed(vertices: Floats, rows: int, columns: int) -> Mesh:
    """Build a solid from rings of vertices, with flat ends.

    Args:
        vertices: Ring after ring in either sense, (rows * columns, 3) [m].
        rows: Number of rings.
        columns: Vertices of a ring.
    """
    hull = grid_faces(rows, columns, closed=True)
    fan = np.array([(0, k + 1, k) for k in range(1, columns - 1)])
    faces = np.concatenate([hull, fan, fan[:, ::-1] + (rows - 1) * columns])
    corners = vertices[faces] - vertices.mean(axis=0)
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return shaded(vertices, faces if volume > 0.0 else faces[:, ::-1], crease=0.5)
