"""Quads on the road whose wear and paint change across them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import GRID, areal, polygon_parts, triangulate_many
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.world.roads.cells import Polygons

_SAME_AREA = 1e-4
"""Quads that lost less of their area [m2] than this count as whole."""

_SLIMMEST = 120.0
"""Quads are cut until they are at most this many times longer than wide.

Mitsuba finds the place in a triangle from differences of products in single precision:
a thousand times longer than wide, it finds NaN.
"""

_THINNEST = 0.25 / _SLIMMEST
"""Triangles less high than this share of their longest side are left out."""


@dataclass(frozen=True, slots=True, eq=False)
class Graded:
    """Triangles with a wear at every vertex.

    Attributes:
        vertices: (n, 3) [m].
        faces: Counter-clockwise, (m, 3).
        wear: As in `Mesh`, (n, 3).
    """

    vertices: Floats
    faces: Ints
    wear: Floats


NOTHING = Graded(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros((0, 3)))
"""No triangles."""


def joined(pieces: Sequence[Graded]) -> Graded:
    """Return several pieces as one."""
    pieces = [piece for piece in pieces if len(piece.faces)]
    if not pieces:
        return NOTHING
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])[:-1]
    return Graded(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate([p.faces + start for p, start in zip(pieces, starts, strict=True)]),
        np.concatenate([piece.wear for piece in pieces]),
    )


def columns(quads: Floats, shares: Floats) -> Floats:
    """Return points across quads, at their starts and ends.

    Args:
        quads: Corners, counter-clockwise from the right border's start, (n, 4, 3) [m].
        shares: Places from the right border (0) to the left one (1), (n, k).

    Returns:
        (n, 2, k, 3) [m].
    """
    start, end = quads[:, [0, 3]], quads[:, [1, 2]]
    rows = np.stack([start, end], axis=1)
    right, left = rows[:, :, :1], rows[:, :, 1:]
    return np.asarray(right + shares[:, None, :, None] * (left - right))


def graded_quads(quads: Floats, shares: Floats, wear: Floats) -> Graded:
    """Return whole quads, cut lengthwise into columns.

    Args:
        quads: As in `columns`.
        shares: Increasing, as in `columns`, (n, k).
        wear: Of each column at the quad's start and end, (n, 2, k, 3).
    """
    points = columns(quads, shares)
    count, _, width, _ = points.shape
    corner = np.arange(count * 2 * width).reshape(count, 2, width)
    a, b = corner[:, 0, :-1], corner[:, 1, :-1]
    c, d = corner[:, 1, 1:], corner[:, 0, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=-2)
    flat = points.reshape(-1, 3)
    return Graded(flat, _with_area(flat, faces.reshape(-1, 3)), wear.reshape(-1, 3))


def clipped(piece: Graded, polygon: shapely.Geometry | Polygons) -> Graded:
    """Return the part of some triangles that lies on a polygon, seen from above.

    Args:
        piece: The triangles.
        polygon: One for all triangles, or one for each, (m,).
    """
    corners = piece.vertices[piece.faces]
    triangles = shapely.polygons(corners[..., :2])
    shared = shapely.intersection(triangles, polygon, grid_size=GRID)
    parts = [(part, k) for k, one in enumerate(shared) for part in polygon_parts(one)]
    flat, faces, owner = triangulate_many([part for part, _ in parts])
    if not len(faces):
        return NOTHING
    face = np.array([k for _, k in parts])[owner]
    weights = _barycentric(flat, corners[face])
    vertices = (weights[..., None] * corners[face]).sum(axis=1)
    wear = (weights[..., None] * piece.wear[piece.faces][face]).sum(axis=1)
    return Graded(np.column_stack([flat, vertices[:, 2]]), _with_area(flat, faces), wear)


def graded_on(quads: Floats, shares: Floats, wear: Floats, *, polygons: Polygons) -> Graded:
    """Return quads where they are whole, and what is left of those that were cut.

    Args:
        quads: As in `columns`.
        shares: As in `graded_quads`.
        wear: As in `graded_quads`.
        polygons: What is left of each quad from above, (n,).
    """
    if not len(quads):
        return NOTHING
    left = shapely.area(polygons)
    intact = whole_quads(quads, polygons)
    whole, _ = _shortened(quads[intact], shares[intact], wear[intact])
    cut = ~intact & (left > _SAME_AREA)
    if not cut.any():
        return joined([whole])
    piece, quad = _shortened(quads[cut], shares[cut], wear[cut])
    # Where borders run along the end of a quad, lines come with the areas.
    areas = np.array([areal(shape) for shape in polygons[cut]], dtype=object)
    return joined([whole, clipped(piece, areas[quad])])


def whole_quads(quads: Floats, polygons: Polygons) -> Bools:
    """Return which quads, (n, 4, 3) [m], are whole in what is left of them, (n,)."""
    x, y = quads[..., 0], quads[..., 1]
    whole = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1))
    left = shapely.area(polygons)
    return np.asarray((whole - left < _SAME_AREA) & (left > _SAME_AREA))


def _shortened(quads: Floats, shares: Floats, wear: Floats) -> tuple[Graded, Ints]:
    """As `graded_quads`, of quads cut across until none is too slim; and each face's quad."""
    # Into how many rows each quad must be cut.
    sides = np.linalg.norm((quads[:, [1, 2]] - quads[:, [0, 3]])[..., :2], axis=-1).max(axis=1)
    width = np.linalg.norm((quads[:, [3, 2]] - quads[:, [0, 1]])[..., :2], axis=-1).max(axis=1)
    column = width * np.diff(shares, axis=1).min(axis=1)
    rows = np.maximum(np.ceil(sides / np.maximum(_SLIMMEST * column, 0.05)), 1).astype(np.int64)
    # Cut quads and wear into these rows.
    index = np.repeat(np.arange(len(quads)), rows)
    step = np.arange(len(index)) - np.repeat(np.cumsum(rows) - rows, rows)
    low = (step / rows[index])[:, None, None]
    high = ((step + 1) / rows[index])[:, None, None]
    start, end = quads[index][:, [0, 3]], quads[index][:, [1, 2]]
    near, far = start + low * (end - start), start + high * (end - start)
    cut = np.stack([near[:, 0], far[:, 0], far[:, 1], near[:, 1]], axis=1)
    first, last = wear[index][:, 0], wear[index][:, 1]
    between = np.stack([first + low * (last - first), first + high * (last - first)], axis=1)
    piece = graded_quads(cut, shares[index], between)
    return piece, index[piece.faces[:, 0] // (2 * shares.shape[1])]


def _with_area(vertices: Floats, faces: Ints) -> Ints:
    """Counter-clockwise faces that are no slivers.

    A quad inside a sharp bend folds over, and its piece there would face down; slivers
    have no area once they are single floats.
    """
    corners = vertices[faces][..., :2]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    return np.asarray(faces[twice > _THINNEST * longest**2])


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """Weights of a triangle's corners, (m, 3) each; for points, (m, 2), seen from above."""
    a, b, c = (corners[:, k, :2] for k in range(3))
    first, second, away = b - a, c - a, points - a
    twice = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    u = (away[:, 0] * second[:, 1] - away[:, 1] * second[:, 0]) / twice
    v = (first[:, 0] * away[:, 1] - first[:, 1] * away[:, 0]) / twice
    return np.stack([1.0 - u - v, u, v], axis=1)
