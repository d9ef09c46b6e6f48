"""Motorway guard rails: a W-beam on posts along a polyline.

References:
    Beam 0.31 m high and 0.08 m deep with its middle 0.60 m above the ground, posts
    each 4 m: as of EN 1317 type A rails.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sumo3dviz_pt.library.buildings.shell import box
from sumo3dviz_pt.library.mesh.grids import grid_faces
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.vectors import arc_length, unit

STEP = 2.0
"""Distance between the points of a fence's line [m]; every other one has a post."""

_RAMP = 9.0  # length over which an end comes down [m]
_BURIED = 0.80  # how far it comes down: deeper than the beam's lower half [m]
_NEAR = np.array(
    [
        (0.0, -0.155),
        (0.02, -0.135),
        (0.08, -0.115),
        (0.08, -0.06),
        (0.012, -0.025),
        (0.012, 0.025),
        (0.08, 0.06),
        (0.08, 0.115),
        (0.02, 0.135),
        (0.0, 0.155),
    ]
)
_FAR = np.array([(0.04, -0.155), (0.04, 0.155)])


def fence(line: Floats, drop: Floats, *, sides: Sequence[int] = (1,), level: int = 0) -> Mesh:
    """Build a piece of guard rail with normals.

    Args:
        line: Smooth line at steps of `STEP`, (n, 3) [m], n >= 2.
        drop: How far the beam is lowered at each point, (n,) [m]; see `end_drop`.
        sides: Beams on the left (1), on the right (-1), or on both.
        level: 0 for the full profile, 1 for a flat beam on posts, 2 without posts.
    """
    keep = thinned(line, level)
    across = leftward(line)
    profile = _NEAR if level == 0 else _FAR
    parts = [_beam(line[keep], across[keep] * side, drop[keep], profile) for side in sides]
    if level < 2:
        # The last post belongs to the next piece, unless the rail ends here.
        posts = np.arange(0, len(line) if drop[-1] > 0.5 else len(line) - 1, 2)
        parts.append(_posts(line[posts], across[posts], drop[posts]))
    return merge_meshes(parts)


def resampled(line: Floats) -> Floats:
    """Lay a smooth curve through a polyline's points, (m, k) [m], in steps of about `STEP`.

    Tangents are those of the polyline weighted by the opposite segments' lengths, so
    that long straight pieces stay straight.

    Args:
        line: (n, 2) or (n, 3) [m], with at least two different points.

    Raises:
        ValueError: If all points are the same.
    """
    line = np.asarray(line, dtype=np.float64)
    line = line[np.append(True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6)]
    if len(line) < 2:
        raise ValueError("a fence needs two different points")
    knots = arc_length(line)
    slopes = np.diff(line, axis=0) / np.diff(knots)[:, None]
    weight = np.diff(knots)
    inner = (slopes[:-1] * weight[1:, None] + slopes[1:] * weight[:-1, None]) / (
        weight[1:] + weight[:-1]
    )[:, None]
    curve = CubicHermiteSpline(knots, line, np.vstack([slopes[:1], inner, slopes[-1:]]))
    # An even number of pieces puts a post at both ends.
    pieces = 2 * max(round(knots[-1] / STEP / 2), 1)
    points: Floats = curve(np.linspace(0.0, knots[-1], pieces + 1))
    return points


def end_drop(line: Floats) -> Floats:
    """Return how far the beam of a whole rail comes down towards both ends, (n,) [m].

    Both ends go into the ground, as rails must that have no other terminal.
    """
    distance = arc_length(line)
    total = distance[-1]
    ramp = min(_RAMP, total / 3)
    share = np.clip(np.minimum(distance, total - distance) / ramp, 0.0, 1.0)
    drop: Floats = _BURIED * (1.0 - share * share * (3.0 - 2.0 * share))
    return drop


def leftward(line: Floats) -> Floats:
    """Horizontal unit normals to the left, (n, 3)."""
    along = np.gradient(line, axis=0)
    left = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(line))])
    return unit(left)


def thinned(line: Floats, level: int) -> Ints:
    """Return the numbers of the points that a level of detail keeps, (m,)."""
    return np.unique(np.append(np.arange(0, len(line), (1, 2, 4)[level]), len(line) - 1))


def _beam(line: Floats, across: Floats, sink: Floats, profile: Floats) -> Mesh:
    """Sweep the profile along the line; normals are smooth over it."""
    centre = line + 0.06 * across
    centre[:, 2] += 0.60 - sink
    up = np.array([0.0, 0.0, 1.0])
    vertices = centre[:, None] + profile[:, :1] * across[:, None] + profile[:, 1:] * up
    slope = np.gradient(profile, axis=0)
    normal = np.stack([slope[:, 1], -slope[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normals = normal[:, :1] * across[:, None] + normal[:, 1:] * up
    count, k = len(line), len(profile)
    faces = grid_faces(count, k)
    # Face the way the normals do, on either side of the line.
    if np.cross(line[1] - line[0], across[0])[2] < 0:
        faces = faces[:, ::-1]
    return Mesh(vertices.reshape(-1, 3), faces, normals.reshape(-1, 3))


def _posts(line: Floats, across: Floats, sink: Floats) -> Mesh:
    """Build upright boxes with flat normals; posts of lowered ends are as low as the beam."""
    faces = box((-0.05, -0.03, -0.5), (0.05, 0.03, 0.72), skip="b")
    along = np.column_stack([across[:, 1], -across[:, 0], np.zeros(len(across))])
    tall = 0.70 - sink
    quads = np.broadcast_to(faces, (len(line), *faces.shape)).copy()
    quads[..., 2] = np.minimum(quads[..., 2], tall[:, None, None])
    placed = (
        line[:, None, None]
        + quads[..., :1] * along[:, None, None]
        + quads[..., 1:2] * across[:, None, None]
        + quads[..., 2:] * [0.0, 0.0, 1.0]
    ).reshape(-1, 4, 3)
    normals = np.cross(placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0])
    normals = unit(normals)
    index = 4 * np.arange(len(placed))[:, None]
    corners = (index + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)
    return Mesh(placed.reshape(-1, 3), corners, np.repeat(normals, 4, axis=0))
