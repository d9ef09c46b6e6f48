"""Keeps an eye out of the body that it rides with: out of heads, bonnets and closed cabins.

References:
    Distance from a point to a triangle: Ericson, Real-Time Collision Detection (2005), 5.1.5.
    Rays and triangles: Moeller and Trumbore, Journal of Graphics Tools 2 (1997).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.cast.drawing import Unit
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.scene import Prototype

CLEAR = 0.17
"""Nothing of the own body is nearer to an eye [m]; springs and steps move it by 2 cm."""

_FREE = 4.0
"""And nothing of it stands straight before an eye within this way [m]."""

_STEP = 0.03
"""Of the search [m]."""


def clear_eye(eye: Floats, body: Body, *, opened: bool) -> Floats:
    """Move an eye forward until its own body is not before it.

    Args:
        eye: In the body's frame, (3,) [m].
        body: The body.
        opened: Whether its first unit is cut away around the eye; the others are drawn whole, and
            a ship's bridge is on the last.

    Returns:
        The first free place, (3,) [m]: at the latest just ahead of the body.
    """
    units = body.assembly.units[1:] if opened else body.assembly.units
    if not units:
        return eye
    corners = np.concatenate([each for unit in units for each in _triangles(body, unit)])
    reach = max(float(corners[..., 0].max()) + CLEAR - eye[0], 0.0)
    # Only what is about as high and as far aside can be near the way.
    across = corners[..., 1:] - eye[1:]
    near = corners[((across.min(axis=1) < CLEAR) & (across.max(axis=1) > -CLEAR)).all(axis=1)]
    for ahead in np.append(np.arange(0.0, reach, _STEP), reach):
        place = eye + np.array([ahead, 0.0, 0.0])
        if not _blocked(place, near) and _distance(place, near) >= CLEAR:
            break
    return np.asarray(place)


def _triangles(body: Body, unit: Unit) -> Iterator[Floats]:
    """All triangles of a unit in all its poses, in the body's frame, (m, 3, 3) each [m]."""
    for vertices, faces in _shapes(unit.prototype):
        scale = body.scale * [unit.stretch, 1.0, 1.0]
        yield (scale * vertices + body.scale * [unit.at, 0.0, 0.0])[faces]


def _shapes(prototype: Prototype) -> Iterator[tuple[Floats, Ints]]:
    """Vertices and faces of a body, once for each of its poses."""
    meshes = [part.mesh for part in prototype.parts]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([m.faces + first for m, first in zip(meshes, starts, strict=False)])
    if prototype.poses is None:
        yield np.concatenate([mesh.vertices for mesh in meshes]), faces
        return
    for vertices in prototype.poses.vertices:
        yield vertices, faces


def _blocked(place: Floats, triangles: Floats) -> bool:
    """Whether a triangle stands straight before a place."""
    a = triangles[:, 0] - place
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    # The ray runs along +x: whether it passes is a matter of y and z alone.
    scale = _cross(first, second)
    flat = np.abs(scale) < 1e-12
    scale = np.where(flat, 1.0, scale)
    u, v = _cross(-a, second) / scale, _cross(first, -a) / scale
    away = a[:, 0] + u * first[:, 0] + v * second[:, 0]
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & ~flat
    return bool((inside & (away > 0.0) & (away < _FREE)).any())


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross product of what vectors are across x, (n, 3); (n,)."""
    return np.asarray(a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1])


def _distance(place: Floats, triangles: Floats) -> float:
    """From a place to the nearest of some triangles [m]."""
    near = (triangles[..., 0].min(axis=1) < place[0] + CLEAR) & (
        triangles[..., 0].max(axis=1) > place[0] - CLEAR
    )
    corners = triangles[near] - place
    if not len(corners):
        return np.inf
    sides = [_to_side(corners[:, k], corners[:, (k + 1) % 3]) for k in range(3)]
    return float(min(*(side.min() for side in sides), _to_inner(corners).min(initial=np.inf)))


def _to_side(a: Floats, b: Floats) -> Floats:
    """From the origin to the nearest points of lines between points, (n, 3); (n,) [m]."""
    way = b - a
    squared = np.maximum((way * way).sum(axis=1), 1e-18)
    share = np.clip(-(a * way).sum(axis=1) / squared, 0.0, 1.0)
    return np.asarray(np.linalg.norm(a + share[:, None] * way, axis=1))


def _to_inner(corners: Floats) -> Floats:
    """From the origin to the planes of those triangles that its foot lies in, (m,) [m]."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    long = np.maximum(np.linalg.norm(normal, axis=1), 1e-18)
    high = (a * normal).sum(axis=1) / long
    foot = high[:, None] * normal / long[:, None]
    inside = np.ones(len(a), dtype=np.bool_)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(end - start, foot - start) * normal).sum(axis=1) >= 0.0
    return np.asarray(np.abs(high[inside]))
