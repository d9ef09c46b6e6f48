"""Meshes, rigid placements, vectors and lines, the shared words of all stages.

The world is right-handed: x east, y north, z up, in metres, float64. A body's own frame has +x
forward, +y left, +z up. Yaw is counter-clockwise from east.

Points along many polylines are found for all of them at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Image = NDArray[np.float32]

Colour = tuple[float, float, float]
"""Linear sRGB primaries; a reflectance in [0, 0.85] or a radiance."""


UNWORN = (1.0, 0.0, 0.0)
"""The `wear` of a road as it was built."""

PAINTS = ((0.62, 0.62, 0.60), (0.60, 0.38, 0.05))
"""White and yellow paint on roads; linear reflectance."""

PANE_KINDS = ("home", "office", "shop", "plain")
"""What may lie behind a pane; a plain one has one colour."""

WALL_REACH = 64.0
"""Height of walls up to which they tell how high above the foot a point lies [m]."""

PANE_SIZES, PANE_STEP = 128, 0.05
"""How many widths and heights of panes are told apart, and their step [m]."""


GRID = 2.0**-20
"""Step of `settled` [m]: about a micrometre, and exact in binary."""

_ROUND_UP = 0.618033988749895
"""Share of a step from which on values are rounded up.

It is not near a half, a third or a quarter, because these are common results, such as middles and
means, and their last bits must not decide.
"""


def settled(values: ArrayLike, step: float = GRID) -> Floats:
    """Return values rounded to a grid, so that they are the same on every processor.

    The last bits of a result can differ between processors, but not a whole step of the grid.
    Comparisons that decide something, such as which of two distances is smaller, use these values.

    Args:
        values: Values of any shape.
        step: Step of the grid; a power of two, so that results are exact.
    """
    return np.asarray(np.floor(np.asarray(values) / step + (1.0 - _ROUND_UP)) * step)


def frozen(values: ArrayLike, dtype: type = np.float64) -> NDArray[Any]:
    """Return the values as a read-only array of the given type: themselves if they are one.

    Whoever makes an array read-only must keep no view of it that can be written.
    """
    if isinstance(values, np.ndarray) and values.dtype == dtype and _is_settled(values):
        return values
    array: NDArray[Any] = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


def _is_settled(array: NDArray[Any]) -> bool:
    """Return whether nothing writes an array's numbers, and they lie as those of a copy would."""
    looked_into: Any = array
    while type(looked_into) is np.ndarray:
        flags = looked_into.flags
        if flags.writeable or not (flags.c_contiguous and flags.aligned):
            return False
        looked_into = looked_into.base
    content = looked_into.obj if isinstance(looked_into, memoryview) else looked_into
    return content is None or isinstance(content, bytes)


def turned(vectors: Floats, matrix: Floats) -> Floats:
    """Multiply vectors, (..., 3), by a matrix, (3, 3), in one order on every processor.

    A library of linear algebra would add in whatever order is fastest on the processor.
    """
    x, y, z = (vectors[..., k, None] * matrix[:, k] for k in range(3))
    return np.asarray(x + y + z)


def product(one: Floats, other: Floats) -> Floats:
    """Return the product of small matrices, (..., k, m) and (..., m, n), added as in `turned`."""
    return np.asarray((one[..., :, :, None] * other[..., None, :, :]).sum(axis=-2))


def _cofactors(matrix: Floats) -> Floats:
    """Return the matrix that transforms normals, not unit length, for that of points, (3, 3)."""
    x, y, z = matrix.T
    # Cross products of y and z, of z and x, and of x and y.
    one, other, after, last = np.array([y, z, x]), np.array([z, x, y]), [1, 2, 0], [2, 0, 1]
    cross = (one[:, after] * other[:, last] - one[:, last] * other[:, after]).T
    return np.asarray(cross * np.sign((x * cross[:, 0]).sum()))


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: Positions, (n, 3) [m].
        faces: Counter-clockwise vertex indices, (m, 3).
        normals: Unit shading normals, (n, 3); None shades flat.
        uvs: Texture coordinates, (n, 2); None where no texture is used.
        wear: Of roads: factor of brightness, share of paint in [0, 1], yellowness of that
            paint in [0, 1], (n, 3); None where nothing is worn or painted. Of panes: where on
            which one a vertex lies, as `library/buildings/panes.py` writes it.
        things: What its faces belong to, in their order: runs of a name, empty where there is
            none, and a number of faces. Empty where nothing has a name.
    """

    vertices: Floats
    faces: Ints
    normals: Floats | None = None
    uvs: Floats | None = None
    wear: Floats | None = None
    things: tuple[tuple[str, int], ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        """Check shapes once, so that stages can trust them."""
        object.__setattr__(self, "vertices", frozen(self.vertices).reshape(-1, 3))
        object.__setattr__(self, "faces", frozen(self.faces, np.int64).reshape(-1, 3))
        for name, width in (("normals", 3), ("uvs", 2), ("wear", 3)):
            values = getattr(self, name)
            if values is None:
                continue
            values = frozen(values).reshape(-1, width)
            if len(values) != len(self.vertices):
                raise ValueError(f"{len(values)} {name} for {len(self.vertices)} vertices")
            object.__setattr__(self, name, values)
        if self.faces.size and not 0 <= self.faces.min() <= self.faces.max() < len(self.vertices):
            raise ValueError("a face names a vertex that does not exist")
        if self.things and sum(count for _, count in self.things) != len(self.faces):
            raise ValueError("things have more or fewer faces than there are")

    @property
    def bounds(self) -> Floats:
        """Lowest and highest corner, (2, 3) [m]; needs at least one vertex."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])


def worn_colours(wear: Floats, mean: Floats) -> Floats:
    """Return the reflectance of worn and painted vertices where no texture is possible.

    Args:
        wear: As in `Mesh`, (n, 3).
        mean: The surface's reflectance, (3,).

    Returns:
        (n, 3).
    """
    white, yellow = np.array(PAINTS)
    paint = white + wear[:, 2:] * (yellow - white)
    return np.asarray(wear[:, :1] * (mean * (1 - wear[:, 1:2]) + paint * wear[:, 1:2]))


def on_faces(vertices: Floats, faces: Ints, corners: Floats) -> Floats:
    """Return places on triangles, (n, 3) [m].

    Args:
        vertices: (v, 3) [m].
        faces: Numbers of each triangle's vertices, (n, 3).
        corners: Weights of the triangles' second and third corner, (n, 2).
    """
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.asarray(a + corners[:, :1] * (b - a) + corners[:, 1:] * (c - a))


def belonging(mesh: Mesh, thing: str) -> Mesh:
    """Return a mesh whose faces all belong to a thing of that name."""
    return replace(mesh, things=((thing, len(mesh.faces)),))


def things_of(meshes: Sequence[Mesh]) -> tuple[tuple[str, int], ...]:
    """Return what the faces of meshes that follow each other belong to; see `Mesh.things`."""
    if not any(mesh.things for mesh in meshes):
        return ()
    return tuple(run for mesh in meshes for run in mesh.things or (("", len(mesh.faces)),))


def merge_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """Join meshes into one; normals, uvs and wear survive where all meshes have them."""
    if len(meshes) == 1:
        return meshes[0]
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])[:-1]

    def joined(name: str, width: int) -> Floats | None:
        parts = [getattr(mesh, name) for mesh in meshes]
        if not parts or any(part is None for part in parts):
            return None
        return np.concatenate(parts).reshape(-1, width)

    if not meshes:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + o for mesh, o in zip(meshes, offsets, strict=True)]),
        joined("normals", 3),
        joined("uvs", 2),
        joined("wear", 3),
        things=things_of(meshes),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Transform:
    """An affine placement, `world_from_body`.

    Attributes:
        matrix: Homogeneous matrix, (4, 4); the last row is 0 0 0 1.
    """

    matrix: Floats

    def __post_init__(self) -> None:
        """Freeze the matrix."""
        object.__setattr__(self, "matrix", frozen(self.matrix).reshape(4, 4))

    @classmethod
    def from_pose(
        cls,
        position: ArrayLike,
        *,
        yaw: float = 0.0,
        pitch: float = 0.0,
        roll: float = 0.0,
        scale: ArrayLike = 1.0,
    ) -> Transform:
        """Return the placement of a body.

        Rotations apply in the order roll, pitch, yaw (aerospace order, z up).

        Args:
            position: Position of its origin, (3,) [m].
            yaw: Counter-clockwise from east [rad].
            pitch: Nose up [rad].
            roll: Right side down [rad].
            scale: Factors along its own axes; one number for all three.
        """
        cy, sy = np.cos(yaw), np.sin(yaw)
        cp, sp = np.cos(pitch), np.sin(pitch)
        cr, sr = np.cos(roll), np.sin(roll)
        about_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
        about_y = np.array([[cp, 0.0, -sp], [0.0, 1.0, 0.0], [sp, 0.0, cp]])
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
        matrix = np.eye(4)
        size = np.broadcast_to(np.asarray(scale, dtype=np.float64), 3)
        matrix[:3, :3] = product(product(about_z, about_y), about_x) * size
        matrix[:3, 3] = np.asarray(position, dtype=np.float64)
        return cls(matrix)

    @property
    def position(self) -> Floats:
        """Position of the body's origin, (3,) [m]."""
        return self.matrix[:3, 3]

    def __matmul__(self, other: Transform) -> Transform:
        """Chain placements: `a_from_b @ b_from_c` is `a_from_c`."""
        return Transform(product(self.matrix, other.matrix))

    def points(self, points: Floats) -> Floats:
        """Transform points, (n, 3) [m], from the body into the world."""
        return turned(points, self.matrix[:3, :3]) + self.matrix[:3, 3]

    def directions(self, directions: Floats) -> Floats:
        """Transform directions, (n, 3), without the translation."""
        return turned(directions, self.matrix[:3, :3])

    def mesh(self, mesh: Mesh) -> Mesh:
        """Transform a mesh; normals use the inverse transpose and stay unit vectors."""
        normals = mesh.normals
        if normals is not None:
            normals = turned(normals, _cofactors(self.matrix[:3, :3]))
            normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        return replace(mesh, vertices=self.points(mesh.vertices), normals=normals)


def unit(vectors: Floats) -> Floats:
    """Scale vectors, (..., n), to length 1; those without a length stay 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))


def arc_length(points: Floats) -> Floats:
    """Return the distance of each vertex along a polyline from its first one.

    Args:
        points: Vertices, (n, 2) or (n, 3) [m], n >= 1; give (n, 2) to measure from above.

    Returns:
        Non-decreasing distances, (n,) [m]; the first is 0.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def area_vectors(vertices: Floats, faces: Ints) -> Floats:
    """Return the cross product of two sides of each triangle, (..., m, 3) [m2].

    It points along the triangle's normal and is as long as twice its area.

    Args:
        vertices: Positions, (..., n, 3) [m].
        faces: Counter-clockwise vertex indices, (m, 3).
    """
    a, b, c = (vertices[..., faces[:, k], :] for k in range(3))
    return np.cross(b - a, c - a)


def areas(vertices: Floats, faces: Ints) -> Floats:
    """Return the areas of triangles, (m,) [m2]; arguments as of `area_vectors`."""
    return np.asarray(0.5 * np.linalg.norm(area_vectors(vertices, faces), axis=-1))


class AlongLines(NamedTuple):
    """Points along polylines, line by line.

    Attributes:
        points: (n, 3) [m].
        sides: The side of its line that each point lies on, from vertex to vertex, (n, 3) [m].
    """

    points: Floats
    sides: Floats


def evenly_along(lines: Sequence[Floats], count: Callable[[Floats], Ints]) -> AlongLines:
    """Return points that divide each polyline evenly, from its first vertex to its last.

    Args:
        lines: Vertices of each, (k, 3) [m], k >= 2.
        count: Gives how many points lines of some lengths from above, (m,) [m], get, (m,) >= 2.
    """
    sizes = np.array([len(line) for line in lines])
    numbers, pieces = [np.zeros(0, np.int64)], [np.zeros((0, 6))]
    # Lines with as many vertices make one array.
    for size in np.unique(sizes):
        chosen = np.flatnonzero(sizes == size)
        points, line = _divided(np.stack([lines[k] for k in chosen.tolist()]), count)
        numbers.append(chosen[line])
        pieces.append(points)
    order = np.argsort(np.concatenate(numbers), kind="stable")
    both = np.concatenate(pieces)[order]
    return AlongLines(both[:, :3], both[:, 3:])


def _divided(lines: Floats, count: Callable[[Floats], Ints]) -> tuple[Floats, Ints]:
    """Points along lines of one size, (m, k, 3), and their sides, (n, 6); and lines, (n,)."""
    sides = np.diff(lines, axis=1)
    lengths = np.linalg.norm(sides[..., :2], axis=2)
    known = np.concatenate([np.zeros((len(lines), 1)), np.cumsum(lengths, axis=1)], axis=1)
    many = np.asarray(count(known[:, -1]), dtype=np.int64)
    line = np.repeat(np.arange(len(lines)), many)
    step = np.arange(len(line)) - np.repeat(np.cumsum(many) - many, many)
    last = step == many[line] - 1
    at = np.where(last, known[line, -1], step * (known[:, -1] / (many - 1))[line])
    # Interpolate between the two vertices around each.
    vertex = (known[line] <= at[:, None]).sum(axis=1) - 1
    side = np.minimum(vertex, sides.shape[1] - 1)
    start, low = lines[line, side], known[line, side]
    span = known[line, side + 1] - low
    slope = sides[line, side] / np.where(span > 0.0, span, 1.0)[:, None]
    points = np.where((at == low)[:, None], start, slope * (at - low)[:, None] + start)
    points[last] = lines[line[last], -1]
    return np.concatenate([points, sides[line, side]], axis=1), line


def from_above(lines: Sequence[Floats]) -> NDArray[shapely.Geometry]:
    """Return polylines, (k, 2 or 3) [m] each, as geometries in the plan, (n,)."""
    if not len(lines):
        return np.zeros(0, dtype=object)
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    flat = np.concatenate([line[:, :2] for line in lines])
    return np.asarray(shapely.linestrings(flat, indices=owner))
