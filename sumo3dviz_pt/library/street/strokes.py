"""Strokes, arrows and flat figures for signs.

Everything here lies in a plane (u to the reader's right, v up) as triangles, (n, 3, 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, unit


def ribbon(points: Floats, width: float) -> Floats:
    """Draw a polyline, (n, 2), with a width: a quad a piece, longer at bends, (m, 3, 2)."""
    points = np.asarray(points, dtype=np.float64)
    step = unit(np.diff(points, axis=0))
    normals = np.column_stack([-step[:, 1], step[:, 0]])
    before, after = np.vstack([normals[:1], normals]), np.vstack([normals, normals[-1:]])
    if len(points) > 3 and np.allclose(points[0], points[-1]):  # a closed line has no ends
        before[0], after[-1] = normals[-1], normals[0]
    mitre = (before + after) / np.maximum(1.0 + (before * after).sum(axis=1), 0.4)[:, None]
    left, right = points + mitre * width / 2, points - mitre * width / 2
    quads = np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    # At sharp bends the inner side turns over; what is left of it has no area.
    a, b = faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    faces[twice < 0] = faces[twice < 0][:, ::-1]
    drawn: Floats = faces[np.abs(twice) > 1e-9]
    return drawn


def fan(outline: Iterable[Sequence[float]] | Floats) -> Floats:
    """Cover a convex counter-clockwise outline with triangles, (n, 3, 2)."""
    points = np.asarray(outline, dtype=np.float64)
    return np.stack([[points[0], points[k], points[k + 1]] for k in range(1, len(points) - 1)])


def disc(radius: float, *, centre: tuple[float, float] = (0.0, 0.0), sides: int = 28) -> Floats:
    """Cover a circle with triangles.

    Args:
        radius: [m].
        centre: [m].
        sides: Of the polygon that stands for it.

    Returns:
        (n, 3, 2) [m].
    """
    return fan(regular(radius, sides=sides) + np.array(centre))


def regular(radius: float, *, sides: int, turn: float = 0.0) -> Floats:
    """Return the corners of a regular polygon around the origin.

    Args:
        radius: [m].
        sides: How many.
        turn: Direction of the first corner [rad].

    Returns:
        Counter-clockwise, (n, 2) [m].
    """
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False) + turn
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def ring(outer: Floats, inner: Floats) -> Floats:
    """Cover what lies between two outlines of equally many corners, (n, 3, 2)."""
    after_outer, after_inner = np.roll(outer, -1, axis=0), np.roll(inner, -1, axis=0)
    one = np.stack([outer, after_outer, after_inner], axis=1)
    other = np.stack([outer, after_inner, inner], axis=1)
    return np.concatenate([one, other])


def arrow(length: float, width: float, *, turn: float = 0.0) -> Floats:
    """Draw an arrow around the origin.

    Args:
        length: [m].
        width: Of its head [m].
        turn: From upwards, counter-clockwise [rad].

    Returns:
        Triangles, (n, 3, 2) [m].
    """
    head, half = 0.42 * length, 0.17 * width
    shaft = fan([(-half, -length / 2), (half, -length / 2), (half, length / 2 - head),
                 (-half, length / 2 - head)])  # fmt: skip
    point = fan([(-width / 2, length / 2 - head), (width / 2, length / 2 - head),
                 (0.0, length / 2)])  # fmt: skip
    cos, sin = np.cos(turn), np.sin(turn)
    turned: Floats = np.concatenate([shaft, point]) @ np.array([[cos, sin], [-sin, cos]])
    return turned


def upright(flat: Floats, *, x: float, z: float) -> Mesh:
    """Stand a flat drawing up, so that it looks to -x.

    Args:
        flat: Triangles of the reader's plane, (n, 3, 2) [m].
        x: Where they stand [m].
        z: Height of the plane's origin [m].
    """
    points = flat.reshape(-1, 2)
    vertices = np.column_stack([np.full(len(points), x), -points[:, 0], z + points[:, 1]])
    faces = np.arange(len(points)).reshape(-1, 3)
    return Mesh(vertices, faces, np.tile([-1.0, 0.0, 0.0], (len(points), 1)))
