"""Smooth sheets, rings, flat figures and stitches, of which the insides of vehicles are made."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, unit


def sheet(points: Floats, *, normals: Floats | None = None) -> Mesh:
    """Build a smooth surface through a grid of points, (n, m, 3), that faces rows x columns."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, d, c), (a, c, b))])
    if normals is None:
        down, right = np.gradient(points, axis=0), np.gradient(points, axis=1)
        normals = np.cross(down, right)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True) + 1e-20
    return Mesh(points.reshape(-1, 3), faces, normals.reshape(-1, 3))


def ring(middle: Floats, radius: float, thick: float) -> Mesh:
    """Build a ring of round section that faces the driver."""
    across, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return rim(middle, across=radius * across, up=radius * up, thick=thick)


def rim(centre: Floats, *, across: Floats, up: Floats, thick: float) -> Mesh:
    """Build a ring of round section; `across` and `up` reach from its centre to its middle line."""
    turn = np.linspace(0.0, 2.0 * np.pi, 65)[:, None, None]
    section = np.linspace(0.0, 2.0 * np.pi, 12)[None, :, None]
    radius = float(np.linalg.norm(up))
    out = (np.sin(turn) * across + np.cos(turn) * up) / radius
    axis = np.cross(across, up) / radius**2
    normals = np.cos(section) * out - np.sin(section) * axis
    return sheet(centre + radius * out + thick * normals, normals=normals)


def flat(corners: Floats, place: Floats) -> Mesh:
    """Build triangles in an upright plane that faces the driver, (3m, 2) to the right, up."""
    points = np.column_stack([np.zeros(len(corners)), -corners[:, 0], corners[:, 1]]) + place
    faces = np.arange(len(points)).reshape(-1, 3)
    a, b, c = points[faces].transpose(1, 0, 2)
    backwards = np.cross(b - a, c - a)[:, 0] > 0.0
    faces[backwards] = faces[backwards][:, ::-1]
    return Mesh(points, faces, np.broadcast_to([-1.0, 0.0, 0.0], points.shape).copy())


def stitches(seam: Floats, out: Floats, *, size: tuple[float, float]) -> Mesh:
    """Sew a thread along a line: a low ridge from hole to hole.

    Args:
        seam: Where the stitches' middles are, (n, 3) [m].
        out: Unit vectors away from the cloth, (n, 3).
        size: Half length and half width of a stitch [m].
    """
    along = unit(np.gradient(seam, axis=0))
    side = unit(np.cross(out, along))
    a, c = seam - size[0] * along, seam + size[0] * along
    b, d = seam - size[1] * side, seam + size[1] * side
    top = seam + 0.8 * size[1] * out
    corners = np.stack([a, b, c, d, top], axis=1)
    normals = unit(np.stack([out - along, out - side, out + along, out + side, out], axis=1))
    first = 5 * np.arange(len(seam))[:, None, None]
    faces = (first + np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces, normals.reshape(-1, 3))
