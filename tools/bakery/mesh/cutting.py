"""Exact cuts of a triangle surface by other fields, and its shading normals.

A window or a lamp is not a piece laid on the body: the body's triangles are split
along the outline, and those inside get another material. Normals come from the
field of the body, so a coarse surface still shades smoothly and keeps its creases.

Fields are compared on the grid of `settled`, and new vertices lie on it, so that every
processor cuts the same faces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bakery.mesh.implicit import Field, gradient, project, values_at
from sumo3dviz_pt.library.mesh.shading import share_normals
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, area_vectors, settled

_CLEAR = 2e-4
_PULL = 0.003
_ROUNDS = 4
_SHORTEST = 0.022
_NEAR = 0.2
"""Faces with no corner so close to a curve are not touched by it [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A triangle surface whose faces carry material numbers.

    Attributes:
        vertices: (n, 3) [m].
        faces: (m, 3).
        tags: Material number of each face, (m,).
    """

    vertices: Floats
    faces: Ints
    tags: Ints

    @property
    def centroids(self) -> Floats:
        """Middles of the faces, (m, 3) [m]."""
        return np.asarray(self.vertices[self.faces].mean(axis=1))

    @property
    def face_normals(self) -> Floats:
        """Unit normals of the faces, (m, 3)."""
        normals = area_vectors(self.vertices, self.faces)
        return np.asarray(normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-20))


def refine(surface: Surface, curve: Field, body: Field, *, tolerance: float) -> Surface:
    """Halve edges near a curve until straight cuts follow it closely.

    Args:
        surface: What is to be cut.
        curve: Zero on the curve, about metric.
        body: Field of the body; new vertices move onto it.
        tolerance: Largest bend of the curve within an edge [m].
    """
    for _ in range(_ROUNDS):
        faces = surface.faces[_touched(surface, curve)]
        pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
        pairs = np.unique(pairs, axis=0)
        ends = surface.vertices[pairs]
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        values = values_at(curve, surface.vertices)
        bend = values_at(curve, ends.mean(axis=1)) - values[pairs].mean(axis=1)
        pairs = pairs[(length > _SHORTEST) & (np.abs(bend) > tolerance)]
        if len(pairs) == 0:
            break
        surface = _halve(surface, pairs, body, reach=0.02)
    return surface


def _touched(surface: Surface, curve: Field) -> Bools:
    """Find faces in which the curve changes its sign, sampled at seven points, (m,)."""
    near: Bools = np.any(
        (np.abs(values_at(curve, surface.vertices)) < _NEAR)[surface.faces], axis=1
    )
    corners = surface.vertices[surface.faces[near]]
    samples = np.concatenate(
        [corners, 0.5 * (corners + np.roll(corners, 1, axis=1)), corners.mean(1, keepdims=True)], 1
    )
    signs = values_at(curve, samples.reshape(-1, 3)).reshape(-1, 7) < 0.0
    near[near] = signs.any(axis=1) & ~signs.all(axis=1)
    return near


def _halve(surface: Surface, pairs: Ints, body: Field, *, reach: float) -> Surface:
    """Split the given edges, (k, 2) sorted vertex pairs, in all faces that have them."""
    count = len(surface.vertices)
    middles = settled(project(body, surface.vertices[pairs].mean(axis=1), reach=reach))
    keys = pairs[:, 0] * count + pairs[:, 1]
    sides = np.stack([surface.faces, np.roll(surface.faces, -1, axis=1)], axis=2)
    wanted = sides.min(axis=2) * count + sides.max(axis=2)
    at = np.clip(np.searchsorted(keys, wanted), 0, len(keys) - 1)
    middle = np.where(keys[at] == wanted, at + count, -1)
    faces, sources = _halved_faces(surface.faces, middle)
    return Surface(np.concatenate([surface.vertices, middles]), faces, surface.tags[sources])


def _halved_faces(faces: Ints, middle: Ints) -> tuple[Ints, Ints]:
    """Split sides of triangles; `middle` holds their new vertices or -1, (m, 3).

    Returns:
        Faces and the number of the face each comes from.
    """
    marked = (middle >= 0).sum(axis=1)
    # Turn each face so that its split sides come first and run on.
    single = np.where(marked == 1, (middle >= 0).argmax(axis=1), 0)
    turn = np.where(marked == 2, ((middle < 0).argmax(axis=1) + 1) % 3, single)
    order = (turn[:, None] + np.arange(3)) % 3
    (a, b, c), (p, q, r) = (np.take_along_axis(x, order, 1).T for x in (faces, middle))
    patterns = (
        ((a, b, c),),
        ((a, p, c), (p, b, c)),
        ((p, b, q), (a, p, q), (a, q, c)),
        ((a, p, r), (p, b, q), (r, q, c), (p, q, r)),
    )
    numbers = np.arange(len(faces))
    made = [
        (np.stack(triangle, axis=1)[marked == count], numbers[marked == count])
        for count, pattern in enumerate(patterns)
        for triangle in pattern
    ]
    return np.concatenate([m[0] for m in made]), np.concatenate([m[1] for m in made])


def split(surface: Surface, curve: Field) -> Surface:
    """Split all faces along the zero set of a curve."""
    values = values_at(curve, surface.vertices)
    values = np.where(np.abs(values) < _CLEAR, _CLEAR, values)
    inside = values[surface.faces] < 0.0
    count = inside.sum(axis=1)
    mixed = (count == 1) | (count == 2)
    if not mixed.any():
        return surface
    faces, inside = surface.faces[mixed], inside[mixed]
    # The odd corner lies alone on its side of the curve.
    odd = np.where(count[mixed] == 1, inside.argmax(axis=1), (~inside).argmax(axis=1))
    a, b, c = np.take_along_axis(faces, (odd[:, None] + np.arange(3)) % 3, axis=1).T
    edges = np.sort(np.concatenate([np.stack([a, b], 1), np.stack([a, c], 1)]), axis=1)
    unique, where = np.unique(edges, axis=0, return_inverse=True)
    where = where.ravel() + len(surface.vertices)
    points = _roots(curve, surface.vertices[unique], values[unique])
    ab, ac = where[: len(faces)], where[len(faces) :]
    parts = [np.stack(t, axis=1) for t in ((a, ab, ac), (ab, b, c), (ab, c, ac))]
    tags = surface.tags[mixed]
    return Surface(
        np.concatenate([surface.vertices, points]),
        np.concatenate([surface.faces[~mixed], *parts]),
        np.concatenate([surface.tags[~mixed], tags, tags, tags]),
    )


def _roots(curve: Field, ends: Floats, values: Floats) -> Floats:
    """Find where a curve crosses segments, (k, 2, 3) [m], given its values at their ends."""
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    f_low, f_high = values[:, 0].copy(), values[:, 1].copy()
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    for _ in range(4):
        share = low + (high - low) * f_low / (f_low - f_high)
        value = values_at(curve, start + along * share[:, None])
        left = (value < 0.0) == (f_low < 0.0)
        low, f_low = np.where(left, share, low), np.where(left, value, f_low)
        high, f_high = np.where(left, high, share), np.where(left, f_high, value)
    gap = f_low - f_high
    share = low + (high - low) * f_low / np.where(np.abs(gap) < 1e-12, 1.0, gap)
    return settled(start + along * np.clip(share, 0.0, 1.0)[:, None])


def retag(surface: Surface, inside: Bools, tag: int, over: tuple[int, ...]) -> Surface:
    """Give faces another tag where they are inside and carry one of some tags.

    Args:
        surface: The surface.
        inside: Which faces are meant, (m,).
        tag: The new tag.
        over: Tags that it replaces.
    """
    chosen = inside & np.isin(surface.tags, over)
    return Surface(surface.vertices, surface.faces, np.where(chosen, tag, surface.tags))


def corner_normals(body: Field, surface: Surface, *, crease: float = 0.45) -> tuple[Ints, Floats]:
    """Take shading normals from the gradient of the body's field.

    Gradients are taken a little inside each corner, so that each side of a crease
    gets its own.

    Args:
        body: The field.
        surface: Its surface.
        crease: Corners of a vertex share a mean if they agree within this angle [rad].

    Returns:
        Vertex of each corner, (3m,), and its unit normal, (3m, 3).
    """
    corners = surface.vertices[surface.faces]
    inwards = corners.mean(axis=1, keepdims=True) - corners
    length = np.linalg.norm(inwards, axis=2, keepdims=True) + 1e-12
    near = corners + inwards * np.minimum(0.3, _PULL / length)
    normals = gradient(body, near.reshape(-1, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    owner = surface.faces.reshape(-1)
    normals = share_normals(owner, normals, crease=crease)
    # A shading normal far off its face's would be drawn black.
    flat = np.repeat(surface.face_normals, 3, axis=0)
    astray = (normals * flat).sum(axis=1) < 0.3
    return owner, np.where(astray[:, None], flat, normals)
