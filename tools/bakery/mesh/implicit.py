"""Shapes as the zero set of a field that is negative inside, and their meshing.

Solids are joined with rounded edges and meshed by dual contouring on a grid with
free spacing, which keeps creases and needs few triangles.

References:
    Ju, Losasso, Schaefer, Warren: Dual contouring of Hermite data, SIGGRAPH 2002,
    doi:10.1145/566654.566586. Rounded operators: hg_sdf library (Mercury, 2015).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, settled

Field = Callable[[Floats, Floats, Floats], Floats]
"""Signed value at points (x, y, z); negative inside, about metric near the surface."""

_STEP = 0.004
_PULL_TO_MEAN = 0.08
_CORNERS = ((-1, -1), (0, -1), (0, 0), (-1, 0))


@dataclass(frozen=True, slots=True, eq=False)
class ProfileCurve:
    """A smooth curve y(x) through given points, constant beyond them.

    Attributes:
        xs: Equally spaced arguments, (n,).
        ys: Values, (n,).
        slopes: Derivatives, (n,).
    """

    xs: Floats
    ys: Floats
    slopes: Floats

    @classmethod
    def through(cls, points: Sequence[Sequence[float]], *, smooth: float) -> ProfileCurve:
        """Interpolate monotonically, then blur with a standard deviation `smooth`.

        The blur removes the kinks in curvature that reflections would show.
        """
        nodes = np.asarray(points, dtype=np.float64)
        margin = 4.0 * smooth + 0.1
        xs = np.arange(nodes[0, 0] - margin, nodes[-1, 0] + margin, _STEP)
        ys = PchipInterpolator(nodes[:, 0], nodes[:, 1])(np.clip(xs, nodes[0, 0], nodes[-1, 0]))
        ys = gaussian_filter1d(ys, smooth / _STEP, mode="nearest")
        return cls(xs, ys, np.gradient(ys, _STEP))

    def __call__(self, x: Floats | float) -> Floats:
        """Return the value at x, same shape."""
        return np.asarray(np.interp(x, self.xs, self.ys))

    def slope(self, x: Floats | float) -> Floats:
        """Return the derivative at x, same shape."""
        return np.asarray(np.interp(x, self.xs, self.slopes))


def values_at(field: Field, points: Floats) -> Floats:
    """Evaluate a field at points, (n, 3) [m], on the grid on which processors agree, (n,) [m]."""
    return settled(field(*points.T))


def intersect(a: Floats, b: Floats, radius: float) -> Floats:
    """Return the field of what lies inside both of two.

    Args:
        a: Signed distances to the first, any shape [m].
        b: Signed distances to the second, same shape [m].
        radius: By which edges are rounded [m].
    """
    inner = np.minimum(np.maximum(a, b), -radius)
    return np.asarray(inner + np.hypot(np.maximum(a + radius, 0.0), np.maximum(b + radius, 0.0)))


def unite(a: Floats, b: Floats, radius: float) -> Floats:
    """Return the field of what lies inside either of two.

    Args:
        a: Signed distances to the first, any shape [m].
        b: Signed distances to the second, same shape [m].
        radius: By which the seam is filleted [m].
    """
    return -intersect(-a, -b, radius)


def rounded_box(x: Floats, y: Floats, half: tuple[float, float], radius: float) -> Floats:
    """Return the signed distance to a rectangle around the origin, any shape [m].

    Args:
        x: Where, any shape [m].
        y: Where, same shape [m].
        half: Half sizes [m].
        radius: Of the corners [m].
    """
    qx, qy = np.abs(x) - half[0] + radius, np.abs(y) - half[1] + radius
    outside = np.hypot(np.maximum(qx, 0.0), np.maximum(qy, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(qx, qy), 0.0) - radius)


def inset_polygon(outline: Floats, distance: float) -> Floats:
    """Move the sides of a counter-clockwise polygon, (n, 2), inwards by a distance."""
    sides = np.roll(outline, -1, axis=0) - outline
    sides = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    inwards = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    before, after = np.roll(inwards, 1, axis=0), inwards
    share = 1.0 + (before * after).sum(axis=1, keepdims=True)
    return np.asarray(outline + distance * (before + after) / np.maximum(share, 0.2))


def polygon(u: Floats, v: Floats, outline: Floats, *, radius: float = 0.0) -> Floats:
    """Return the signed distance to a polygon with rounded corners.

    Args:
        u: First coordinates, any shape [m].
        v: Second coordinates, same shape [m].
        outline: Corners in either sense, (n, 2) [m].
        radius: Corner radius [m].
    """
    corners = np.asarray(outline, dtype=np.float64)
    ahead = np.roll(corners, -1, axis=0)
    if (corners[:, 0] * ahead[:, 1] - ahead[:, 0] * corners[:, 1]).sum() < 0.0:
        corners = corners[::-1]
    if radius > 0.0:
        corners = inset_polygon(corners, radius)
    nearest = np.full(np.shape(u), np.inf)
    inside = np.zeros(np.shape(u), dtype=np.bool_)
    for (au, av), (bu, bv) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        eu, ev, pu, pv = bu - au, bv - av, u - au, v - av
        t = np.clip((pu * eu + pv * ev) / (eu * eu + ev * ev), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(pu - t * eu, pv - t * ev))
        left = eu * pv - ev * pu > 0.0
        inside ^= ((av <= v) & (bv > v) & left) | ((bv <= v) & (av > v) & ~left)
    return np.where(inside, -nearest, nearest) - radius


def gradient(field: Field, points: Floats, *, step: float = 0.002) -> Floats:
    """Return the central differences of a field, (n, 3).

    Args:
        field: The field.
        points: Where, (n, 3) [m].
        step: Distance to either side [m].
    """
    slopes = np.empty_like(points)
    for axis in range(3):
        shift = np.zeros(3)
        shift[axis] = step
        slopes[:, axis] = (field(*(points + shift).T) - field(*(points - shift).T)) / (2 * step)
    return slopes


def project(field: Field, points: Floats, *, reach: float, rounds: int = 2) -> Floats:
    """Move points onto the surface by Newton steps, (n, 3) [m].

    Args:
        field: The field.
        points: Near its surface, (n, 3) [m].
        reach: Longest step [m].
        rounds: Number of steps.
    """
    for _ in range(rounds):
        slopes = gradient(field, points, step=0.003)
        steepness = np.maximum((slopes * slopes).sum(axis=1), 0.25)
        points = points - slopes * np.clip(field(*points.T) / steepness, -reach, reach)[:, None]
    return points


def dual_contour(field: Field, axes: Sequence[Floats]) -> tuple[Floats, Ints]:
    """Mesh the zero set of a field on a rectilinear grid.

    Args:
        field: Negative inside.
        axes: Increasing grid coordinates along x, y and z [m].

    Returns:
        Vertices on the grid of `settled`, (n, 3) [m], and outward triangles, (m, 3).
    """
    grid = np.meshgrid(*axes, indexing="ij")
    values = settled(field(*grid))
    cell_of = _active_cells(values < 0.0)
    cells = np.argwhere(cell_of >= 0)
    sums = _Sums(
        np.zeros((len(cells), 3, 3)),
        np.zeros((len(cells), 3)),
        np.zeros((len(cells), 3)),
        np.zeros(len(cells)),
    )
    quads = [_crossings(field, axes, values, cell_of, axis, sums) for axis in range(3)]
    low = np.stack([axes[k][cells[:, k]] for k in range(3)], axis=1)
    size = np.stack([np.diff(axes[k])[cells[:, k]] for k in range(3)], axis=1)
    mean = sums.point / sums.count[:, None]
    left = sums.ata + _PULL_TO_MEAN * np.eye(3)
    right = (sums.atb + _PULL_TO_MEAN * mean)[..., None]
    vertices = np.clip(np.linalg.solve(left, right)[..., 0], low - 0.2 * size, low + 1.2 * size)
    reach = 0.5 * float(min(np.diff(axis).min() for axis in axes))
    vertices = settled(project(field, vertices, reach=reach))
    return vertices, _split_quads(vertices, np.concatenate(quads))


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """Least-squares sums of the tangent planes that meet in each cell."""

    ata: Floats
    atb: Floats
    point: Floats
    count: Floats


def _active_cells(inside: Bools) -> Ints:
    """Number the cells that the surface passes; others get -1."""
    shape = tuple(n - 1 for n in inside.shape)
    count = np.zeros(shape, dtype=np.int8)
    for corner in np.ndindex(2, 2, 2):
        where = tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True))
        count += inside[where]
    active = (count > 0) & (count < 8)
    numbers = np.full(shape, -1, dtype=np.int64)
    numbers[active] = np.arange(int(active.sum()))
    return numbers


def _crossings(
    field: Field, axes: Sequence[Floats], values: Floats, cell_of: Ints, axis: int, sums: _Sums
) -> Ints:
    """Add the surface points on grid edges along an axis; return the quads around them."""
    low: list[slice] = [slice(None)] * 3
    high: list[slice] = [slice(None)] * 3
    low[axis], high[axis] = slice(0, -1), slice(1, None)
    inside = values < 0.0
    edges = np.argwhere(inside[tuple(low)] != inside[tuple(high)])
    ends = edges.copy()
    ends[:, axis] += 1
    f0, f1 = values[tuple(edges.T)], values[tuple(ends.T)]
    points = np.stack([axes[k][edges[:, k]] for k in range(3)], axis=1)
    points[:, axis] += f0 / (f0 - f1) * np.diff(axes[axis])[edges[:, axis]]
    normals = gradient(field, points, step=0.003)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12
    around = np.stack([_neighbour(cell_of, edges, axis, corner) for corner in _CORNERS], axis=1)
    for cells in around.T:
        known = cells >= 0
        _accumulate(sums, cells[known], points[known], normals[known])
    around[f0 >= 0.0] = around[f0 >= 0.0][:, ::-1]
    return np.asarray(around[(around >= 0).all(axis=1)])


def _neighbour(cell_of: Ints, edges: Ints, axis: int, corner: tuple[int, int]) -> Ints:
    """Return the cells at one corner of grid edges along an axis; -1 outside the grid."""
    cells = edges.copy()
    cells[:, (axis + 1) % 3] += corner[0]
    cells[:, (axis + 2) % 3] += corner[1]
    limits = np.array(cell_of.shape)
    known = ((cells >= 0) & (cells < limits)).all(axis=1)
    return np.where(known, cell_of[tuple(np.clip(cells, 0, limits - 1).T)], -1)


def _accumulate(sums: _Sums, cells: Ints, points: Floats, normals: Floats) -> None:
    """Add tangent planes to the sums of their cells."""
    offsets = (normals * points).sum(axis=1, keepdims=True)
    np.add.at(sums.point, cells, points)
    np.add.at(sums.count, cells, 1.0)
    np.add.at(sums.ata, cells, normals[:, :, None] * normals[:, None, :])
    np.add.at(sums.atb, cells, normals * offsets)


def _split_quads(vertices: Floats, quads: Ints) -> Ints:
    """Cut quads, (m, 4), along their shorter diagonals."""
    first = np.linalg.norm(vertices[quads[:, 0]] - vertices[quads[:, 2]], axis=1)
    second = np.linalg.norm(vertices[quads[:, 1]] - vertices[quads[:, 3]], axis=1)
    short, long = quads[first <= second], quads[first > second]
    return np.concatenate(
        [short[:, [0, 1, 2]], short[:, [0, 2, 3]], long[:, [0, 1, 3]], long[:, [1, 2, 3]]]
    )
