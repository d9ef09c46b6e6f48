"""Removes triangles that a surface can do without, keeping its material borders.

References:
    Garland, Heckbert: Surface simplification using quadric error metrics, SIGGRAPH
    1997, doi:10.1145/258734.258849; here with half-edge collapses, so that every
    vertex that stays is one that lay on the surface.
"""

from __future__ import annotations

import heapq

import numpy as np

from bakery.mesh.cutting import Surface
from sumo3dviz_pt.model.geometry import Floats, Ints, area_vectors

_BORDER_WEIGHT = 30.0
_SLIVER = 1e-8

Vector = tuple[float, float, float]


def simplify(surface: Surface, *, faces: int, largest: float = 0.004) -> Surface:
    """Collapse edges until a number of faces is reached.

    Args:
        surface: A manifold with or without open borders.
        faces: Number of triangles to aim at.
        largest: Collapses that would move the surface further are left out [m].

    Returns:
        A surface whose material borders and open borders lie where they lay.
    """
    work = _Simplification(surface)
    left = len(surface.faces)
    while work.heap and left > faces:
        cost, u, v, stamp = heapq.heappop(work.heap)
        if stamp != work.stamps[u] + work.stamps[v] or not (work.around[u] and work.around[v]):
            continue
        if cost > largest * largest * work.weight_of(u, v):
            continue
        if work.may_collapse(u, v):
            left -= work.collapse(u, v)
    return work.surface()


class _Simplification:
    """Connectivity and quadrics of a surface that is being simplified."""

    def __init__(self, surface: Surface) -> None:
        self.points: list[Vector] = [tuple(p) for p in surface.vertices.tolist()]
        self.faces: list[list[int] | None] = surface.faces.tolist()
        self.tags = surface.tags
        self.border = set(_open_vertices(surface.faces).tolist())
        self.around: list[set[int]] = [set() for _ in self.points]
        for number, face in enumerate(surface.faces.tolist()):
            for vertex in face:
                self.around[vertex].add(number)
        quadrics, areas = _quadrics(surface)
        self.quadrics: list[list[float]] = quadrics.tolist()
        self.areas: list[float] = areas.tolist()
        self.stamps = [0] * len(self.points)
        self.heap: list[tuple[float, int, int, int]] = []
        sides = np.sort(_sides(surface.faces), axis=1)
        for u, v in np.unique(sides, axis=0).tolist():
            self.offer(u, v)

    def weight_of(self, u: int, v: int) -> float:
        """Return the area that the quadrics of two vertices stand for [m2]."""
        return self.areas[u] + self.areas[v]

    def offer(self, u: int, v: int) -> None:
        """Put an edge into the queue, in its cheaper direction."""
        q = [a + b for a, b in zip(self.quadrics[u], self.quadrics[v], strict=True)]
        to_v, to_u = _error(q, self.points[v]), _error(q, self.points[u])
        stamp = self.stamps[u] + self.stamps[v]
        if to_v <= to_u:
            heapq.heappush(self.heap, (to_v, u, v, stamp))
        else:
            heapq.heappush(self.heap, (to_u, v, u, stamp))

    def neighbours(self, u: int) -> set[int]:
        """Return the vertices joined with u by an edge."""
        return {v for number in self.around[u] for v in self.corners(number)} - {u}

    def corners(self, number: int) -> list[int]:
        """Return the vertices of a face that is still there."""
        face = self.faces[number]
        assert face is not None
        return face

    def may_collapse(self, u: int, v: int) -> bool:
        """Say whether moving u to v keeps the surface a manifold and turns no face over."""
        shared = self.around[u] & self.around[v]
        if len(self.neighbours(u) & self.neighbours(v)) != len(shared):
            return False
        # An open border stays in place: its vertices only move along it.
        if u in self.border and (v not in self.border or len(shared) != 1):
            return False
        target = self.points[v]
        for number in self.around[u] - shared:
            corners = [self.points[w] for w in self.corners(number)]
            moved = [target if w == u else self.points[w] for w in self.corners(number)]
            if not _keeps_side(_normal(*corners), _normal(*moved)):
                return False
        return True

    def collapse(self, u: int, v: int) -> int:
        """Move u to v; return how many faces vanish."""
        shared = self.around[u] & self.around[v]
        for number in shared:
            for vertex in self.corners(number):
                self.around[vertex].discard(number)
            self.faces[number] = None
        for number in self.around[u]:
            self.faces[number] = [v if w == u else w for w in self.corners(number)]
            self.around[v].add(number)
        self.around[u] = set()
        self.quadrics[v] = [a + b for a, b in zip(self.quadrics[u], self.quadrics[v], strict=True)]
        self.areas[v] += self.areas[u]
        self.stamps[v] += 1 + self.stamps[u]
        for w in sorted(self.neighbours(v)):
            self.offer(v, w)
        return len(shared)

    def surface(self) -> Surface:
        """Return the surface that is left."""
        alive = [number for number, face in enumerate(self.faces) if face is not None]
        faces = np.array([self.faces[number] for number in alive], dtype=np.int64)
        used, renumbered = np.unique(faces, return_inverse=True)
        vertices = np.array([self.points[v] for v in used.tolist()])
        return Surface(vertices, renumbered.reshape(-1, 3), self.tags[alive])


def _sides(faces: Ints) -> Ints:
    """Return the directed edges of all faces, (3m, 2), face by face within each third."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _open_vertices(faces: Ints) -> Ints:
    """Find the vertices on edges that only one face has."""
    sides = np.sort(_sides(faces), axis=1)
    unique, uses = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(np.unique(unique[uses == 1]))


def _quadrics(surface: Surface) -> tuple[Floats, Floats]:
    """Return the vertices' quadrics as upper triangles, (n, 10), and their areas, (n,) [m2]."""
    a = surface.vertices[surface.faces[:, 0]]
    normals = area_vectors(surface.vertices, surface.faces)
    doubled = np.linalg.norm(normals, axis=1)
    normals /= doubled[:, None] + 1e-20
    quadrics = np.zeros((len(surface.vertices), 10))
    areas = np.zeros(len(surface.vertices))
    planes = _planes(normals, a, doubled / 6.0)
    for k in range(3):
        np.add.at(quadrics, surface.faces[:, k], planes)
        np.add.at(areas, surface.faces[:, k], doubled / 6.0)
    _add_borders(surface, normals, quadrics)
    return quadrics, areas


def _planes(normals: Floats, points: Floats, weights: Floats) -> Floats:
    """Return the quadrics of weighted planes, (m, 10)."""
    plane = np.column_stack([normals, -(normals * points).sum(axis=1)])
    rows, columns = np.triu_indices(4)
    return np.asarray(weights[:, None] * plane[:, rows] * plane[:, columns])


def _add_borders(surface: Surface, normals: Floats, quadrics: Floats) -> None:
    """Hold edges between materials and open edges in place by planes through them."""
    sides = _sides(surface.faces)
    low, high = sides.min(axis=1), sides.max(axis=1)
    keys = low * len(surface.vertices) + high
    tags, owner = np.tile(surface.tags, 3), np.tile(np.arange(len(surface.faces)), 3)
    _, first, inverse, uses = np.unique(
        keys, return_index=True, return_inverse=True, return_counts=True
    )
    mixed = (tags != tags[first][inverse]) | (uses[inverse] == 1)
    border = np.zeros(len(first), dtype=np.bool_)
    border[inverse[mixed]] = True
    chosen = border[inverse]
    start, end = surface.vertices[low[chosen]], surface.vertices[high[chosen]]
    across = np.cross(end - start, normals[owner[chosen]])
    length = np.linalg.norm(across, axis=1)
    weights = _BORDER_WEIGHT * length * length
    planes = _planes(across / (length[:, None] + 1e-20), start, weights)
    for ends in (low[chosen], high[chosen]):
        np.add.at(quadrics, ends, planes)


def _error(q: list[float], p: Vector) -> float:
    """Return the quadric error of a point."""
    x, y, z = p
    return max(
        0.0,
        (
            q[0] * x * x
            + 2.0 * (q[1] * x * y + q[2] * x * z + q[3] * x)
            + q[4] * y * y
            + 2.0 * (q[5] * y * z + q[6] * y)
            + q[7] * z * z
            + 2.0 * q[8] * z
            + q[9]
        ),
    )


def _normal(a: Vector, b: Vector, c: Vector) -> Vector:
    """Return the normal of a triangle, as long as twice its area."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def _keeps_side(before: Vector, after: Vector) -> bool:
    """Say whether a face stays a face and does not turn by more than about 60 degrees."""
    dot = sum(a * b for a, b in zip(before, after, strict=True))
    old = sum(a * a for a in before)
    new = sum(a * a for a in after)
    if new < _SLIVER * _SLIVER:
        return False
    return old < _SLIVER * _SLIVER or dot > 0.5 * float(np.sqrt(old * new))
