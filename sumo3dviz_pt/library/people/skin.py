"""Pieces of a figure: skin, garments and what is carried, bound to the bones beneath.

Every limb, head, shoe and garment is a rounded body: a stack of rings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.sparse import csr_matrix

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.library.people.posture import BONES, BodyMeasures, joints
from sumo3dviz_pt.model.geometry import Colour, Floats, Ints, Mesh, area_vectors, frozen, unit
from sumo3dviz_pt.model.scene import OWN, Part, Poses

_COLUMNS = 8


class Counts(NamedTuple):
    """How finely a surface of rings is modelled.

    Attributes:
        rings: How many rings it has.
        points: How many points each ring has.
    """

    rings: int
    points: int

    def with_rings(self, rings: int) -> Counts:
        """Return counts of as many points on another number of rings, at least two."""
        return Counts(max(2, rings), self.points)


@dataclass(frozen=True, slots=True, eq=False)
class Stack:
    """Rings over one another, interpolated smoothly from row to row.

    Attributes:
        rows: x and y of the ring's middle, reach to the front, reach to the back, half
            width, height of the front, height of the back [m], and the exponent of the
            superellipse, (n, 8).
    """

    rows: Floats

    def __post_init__(self) -> None:
        """Freeze the rows and check their width."""
        object.__setattr__(self, "rows", frozen(self.rows).reshape(-1, _COLUMNS))

    @property
    def last(self) -> float:
        """Level of the top row; the bottom row has level 0."""
        return float(len(self.rows) - 1)

    def points(self, levels: Floats, angles: Floats) -> Floats:
        """Return points on the surface.

        Args:
            levels: Positions between rows, any shape; 1.5 is midway from row 1 to row 2.
            angles: From the front to the left, same shape [rad].

        Returns:
            Points, (..., 3) [m].
        """
        rows = PchipInterpolator(np.arange(len(self.rows)), self.rows, axis=0)(
            np.clip(levels, 0.0, self.last)
        )
        x, y, front, back, half, low, high, power = np.moveaxis(rows, -1, 0)
        c, s = np.cos(angles), np.sin(angles)
        along = np.sign(c) * np.abs(c) ** (2.0 / power)
        across = np.sign(s) * np.abs(s) ** (2.0 / power)
        height = high + (low - high) * 0.5 * (1.0 + c)
        return np.stack(
            [x + np.where(c > 0, front, back) * along, y + half * across, height], axis=-1
        )

    def grid(self, levels: Floats | int, angles: Floats | int) -> Floats:
        """Return rings of points, (k, m, 3) [m].

        Args:
            levels: Of the rings, or how many from bottom to top.
            angles: Of each ring's points, or how many [rad].
        """
        if isinstance(levels, int):
            levels = np.linspace(0.0, self.last, levels)
        if isinstance(angles, int):
            angles = turns(angles)
        return self.points(*np.meshgrid(levels, angles, indexing="ij"))


def turns(count: int, *, offset: float = 0.0) -> Floats:
    """Return equal angles around a ring, (count,) [rad]; `offset` counts steps."""
    return 2.0 * np.pi * (np.arange(count) + offset) / count


def swollen(rings: Floats) -> Floats:
    """Widen coarse rings, (k, m, 3), until they enclose what the curves through them do."""
    count = rings.shape[1]
    if count > 6:
        return rings
    middle = rings.mean(axis=1, keepdims=True)
    factor = np.sqrt(2.0 * np.pi / (count * np.sin(2.0 * np.pi / count)))
    return np.asarray(middle + (rings - middle) * [factor, factor, 1.0])


def _ring_faces(rows: int, columns: int) -> Ints:
    """Return the outward triangles of rings that run counter-clockwise seen from above, (m, 3)."""
    halves = np.split(grid_faces(rows, columns, closed=True), 2)
    # The two triangles of a quad follow each other, so that colours can be given by quad.
    return np.stack(halves, axis=1).reshape(-1, 3)


def closed(rings: Floats, *, bottom: bool, top: bool) -> tuple[Floats, Ints]:
    """Join rings and close their ends; triangles of lids come last, the bottom's first.

    Args:
        rings: From bottom to top, counter-clockwise seen from above, (k, m, 3) [m].
        bottom: Whether the first ring gets a lid.
        top: Whether the last ring gets a lid.

    Returns:
        Vertices, (n, 3) [m], and outward triangles, (m, 3).
    """
    rows, columns = rings.shape[:2]
    vertices, faces = [rings.reshape(-1, 3)], [_ring_faces(rows, columns)]
    here = np.arange(columns)
    after = (here + 1) % columns
    count = rows * columns
    if bottom:
        vertices.append(rings[0].mean(axis=0, keepdims=True))
        faces.append(np.stack([after, here, np.full(columns, count)], axis=1))
        count += 1
    if top:
        vertices.append(rings[-1].mean(axis=0, keepdims=True))
        base = (rows - 1) * columns
        faces.append(np.stack([base + here, base + after, np.full(columns, count)], axis=1))
    return np.concatenate(vertices), np.concatenate(faces)


def interpolated(values: Floats | float, table: Sequence[tuple[float, float]]) -> Floats:
    """Interpolate a table (argument, value) smoothly; it is constant beyond its ends."""
    nodes = np.array(table)
    clipped = np.clip(values, nodes[0, 0], nodes[-1, 0])
    return np.asarray(PchipInterpolator(nodes[:, 0], nodes[:, 1])(clipped))


def rope(path: Floats, radii: Floats, count: int, *, flat: Floats | None = None) -> Floats:
    """Lay rings around a bent line, from its first point on, (k, count, 3) [m].

    Args:
        path: (k, 3) [m].
        radii: (k,) [m].
        count: Points of a ring.
        flat: Direction in which the rings are a third as thick, (k, 3) or (3,), or None.
    """
    along = unit(np.gradient(path, axis=0))
    helper = np.array([1.0, 0.0, 0.0]) if flat is None else np.asarray(flat)
    first = unit(helper - (along * helper).sum(axis=1, keepdims=True) * along)
    second = np.cross(along, first)
    turn = turns(count, offset=0.5)[None, :, None]
    thin = 1.0 if flat is None else 0.34
    ring = thin * np.cos(turn) * first[:, None] + np.sin(turn) * second[:, None]
    return np.asarray(path[:, None] + radii[:, None, None] * ring)


@dataclass(frozen=True, slots=True, eq=False)
class Crease:
    """How cloth folds where two bones bend against each other.

    Attributes:
        bones: Both, by their names.
        offsets: What the vertices move by at rest when they are bent by a radian, (n, 3) [m].
    """

    bones: tuple[str, str]
    offsets: Floats


@dataclass(frozen=True, slots=True, eq=False)
class SkinPart:
    """A closed or covered surface that follows the bones.

    Attributes:
        vertices: At rest, (n, 3) [m].
        faces: Outward, (m, 3).
        weights: How much each bone carries each vertex, (n, bones); rows sum to 1.
        material: A name of the scene's materials.
        tint: Reflectance of each face, (m, 3); None takes the wearer's colour.
        sway: How much a vertex follows the leg that is further forward (1) or
            backward (-1), (n,), for skirts; None for all else.
        role: Which of a person's colours its tint is a factor of; empty for none.
        shade: Factor of the reflectance of each face, (m,), or None.
        creases: Where it creases as joints bend.
        slopes: Of wrinkles that are only seen by how they catch light: what tilts the normals at
            rest, (n, 3), or None.
    """

    vertices: Floats
    faces: Ints
    weights: Floats
    material: str
    tint: Floats | None = None
    sway: Floats | None = None
    role: str = ""
    shade: Floats | None = None
    creases: tuple[Crease, ...] = ()
    slopes: Floats | None = None


@dataclass(frozen=True, slots=True)
class Cloth:
    """What a piece is made of.

    Attributes:
        material: A name of the scene's materials.
        colour: Its reflectance, or None for the wearer's colour.
        role: Which of a person's colours it varies with; empty for none.
    """

    material: str
    colour: Colour | None = None
    role: str = ""

    def tint(self, faces: int) -> Floats | None:
        """Return the reflectance of a number of faces, (faces, 3); None for the wearer's colour."""
        return None if self.colour is None else np.tile(np.array(self.colour), (faces, 1))


def sewn(shape: tuple[Floats, Ints], weights: Floats, cloth: Cloth) -> SkinPart:
    """Make a piece of one cloth.

    Args:
        shape: Vertices, (n, 3) [m], and outward faces, (m, 3).
        weights: How much each bone carries each vertex, (n, bones).
        cloth: What it is made of.
    """
    vertices, faces = shape
    role = OWN if cloth.colour is None else cloth.role
    return SkinPart(vertices, faces, weights, cloth.material, cloth.tint(len(faces)), role=role)


def carried(shape: tuple[Floats, Ints], bone: str, cloth: Cloth) -> SkinPart:
    """Make a stiff piece that one bone carries.

    Args:
        shape: Vertices, (n, 3) [m], and outward faces, (m, 3).
        bone: One of `BONES`.
        cloth: What it is made of.
    """
    return sewn(shape, weighed(len(shape[0]), {bone: 1.0}), cloth)


def weighed(count: int, shares: Mapping[str, Floats | float]) -> Floats:
    """Return the weights of shares by bone, (count, bones); rows sum to 1."""
    weights = np.zeros((count, len(BONES)))
    for bone, share in shares.items():
        weights[:, BONES.index(bone)] += share
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def trunk_weights(body: BodyMeasures, points: Floats) -> Floats:
    """Return the weights of points on the trunk, (n, bones)."""
    h, (_, y, z) = body.height, points.T
    chest = body.rise(0.565, 0.655, z)
    neck = 0.8 * body.rise(0.845, 0.885, z)
    arm = 0.42 * smoothstep(0.068 * h, 0.120 * h, np.abs(y)) * body.rise(0.74, 0.80, z)
    left = smoothstep(-0.05 * h, 0.05 * h, y)
    # The seat only gives way to the thighs at its lower sides.
    thigh = 0.55 * body.rise(0.535, 0.455, z)
    pelvis = (1.0 - chest) * (1.0 - thigh)
    upper = chest * (1.0 - arm) * (1.0 - neck)
    return weighed(
        len(points),
        {
            "pelvis": pelvis,
            "thigh_l": (1.0 - chest) * thigh * left,
            "thigh_r": (1.0 - chest) * thigh * (1.0 - left),
            "chest": upper,
            "head": chest * neck,
            "upper_arm_l": chest * (1.0 - neck) * arm * (y > 0),
            "upper_arm_r": chest * (1.0 - neck) * arm * (y <= 0),
        },
    )


def skirt_weights(body: BodyMeasures, points: Floats) -> tuple[Floats, Floats]:
    """Return the weights of a skirt's points, (n, bones), and how they sway, (n,)."""
    weights = trunk_weights(body, points)
    h, (x, y, z) = body.height, points.T
    low = body.rise(0.53, 0.42, z)[:, None]
    left = smoothstep(-0.075 * h, 0.075 * h, y)
    knee = 0.35 * body.rise(0.33, 0.22, z)
    legs = weighed(
        len(points),
        {
            "thigh_l": left * (1.0 - knee),
            "thigh_r": (1.0 - left) * (1.0 - knee),
            "shank_l": left * knee,
            "shank_r": (1.0 - left) * knee,
        },
    )
    sway = low[:, 0] * np.clip(x / (0.05 * h), -1.0, 1.0)
    return weights * (1.0 - low) + legs * low, sway


def arm_weights(body: BodyMeasures, points: Floats, side: str) -> Floats:
    """Return the weights of points on an arm above the hand, (n, bones).

    Args:
        body: Measures of the person.
        points: (n, 3) [m].
        side: `l` or `r`.
    """
    h, rest = body.height, joints(body)
    shoulder, elbow = rest[f"upper_arm_{side}"], rest[f"forearm_{side}"]
    length = float(np.linalg.norm(elbow - shoulder))
    along = (points - shoulder) @ (elbow - shoulder) / length
    chest = 0.75 * smoothstep(0.055 * h, -0.030 * h, along)
    lower = smoothstep(length - 0.030 * h, length + 0.030 * h, along)
    return weighed(
        len(points),
        {
            "chest": chest,
            f"upper_arm_{side}": (1.0 - chest) * (1.0 - lower),
            f"forearm_{side}": (1.0 - chest) * lower,
        },
    )


def leg_weights(body: BodyMeasures, points: Floats, side: str, *, foot: float = 0.5) -> Floats:
    """Return the weights of points on a leg, (n, bones).

    Args:
        body: Measures of the person.
        points: (n, 3) [m].
        side: `l` or `r`.
        foot: The foot's share at the ankle.
    """
    z = points[:, 2]
    pelvis = 0.8 * body.rise(0.485, 0.55, z)
    lower = body.rise(0.315, 0.255, z)
    ankle = foot * body.rise(0.085, 0.03, z)
    return weighed(
        len(points),
        {
            "pelvis": pelvis,
            f"thigh_{side}": (1.0 - pelvis) * (1.0 - lower),
            f"shank_{side}": lower * (1.0 - ankle),
            f"foot_{side}": lower * ankle,
        },
    )


def spaced(first: float, end: float, count: int, *, joint: float, near: float) -> Floats:
    """Return places from one to another that are denser about a joint and towards the end.

    Args:
        first: Where they begin [m].
        end: Where they end [m].
        count: How many they are.
        joint: Where the limb bends [m].
        near: How far about it they are dense [m].
    """
    table = np.linspace(first, end, 200)
    density = 1.0 + 1.6 * np.exp(-(((table - joint) / near) ** 2))
    reached = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    even = np.interp(np.linspace(0.0, reached[-1], count - 1), reached, table)
    # The last band is a hem.
    return np.append(even[:-1], [end - 0.016 * np.sign(end - first), end])


def hemmed(rings: Floats, *, depth: float = 0.012, at_top: bool = False) -> Floats:
    """Add a ring inside the first (or last), so that an open end shows thickness.

    Args:
        rings: (k, m, 3) [m].
        depth: How far inside the new ring lies [m].
        at_top: Whether the last ring is open, not the first.
    """
    edge, beside = (rings[-1], rings[-2]) if at_top else (rings[0], rings[1])
    middle = edge.mean(axis=0)
    out = np.linalg.norm(edge - middle, axis=1, keepdims=True)
    inner = middle + (edge - middle) * np.maximum(1.0 - depth / out, 0.3)
    inner = inner + 0.3 * (beside - edge)
    return np.concatenate([rings, inner[None]] if at_top else [inner[None], rings])


def tube_piece(rings: Floats, weights: Floats, cloth: Cloth, *, lids: str = "") -> SkinPart:
    """Make a piece from rings, (k, m, 3).

    Args:
        rings: From bottom to top, counter-clockwise seen from above.
        weights: Of the rings' vertices, (k m, bones).
        cloth: What it is made of.
        lids: `bottom`, `top`, both or none: which ends are closed.
    """
    vertices, faces = closed(rings, bottom="bottom" in lids, top="top" in lids)
    count = rings.shape[1]
    rows = [weights]
    if "bottom" in lids:
        rows.append(weights[:count].mean(axis=0, keepdims=True))
    if "top" in lids:
        rows.append(weights[-count:].mean(axis=0, keepdims=True))
    return sewn((vertices, faces), np.concatenate(rows), cloth)


def dressed(pieces: Sequence[SkinPart], bones: Floats) -> tuple[tuple[Part, ...], Poses]:
    """Join pieces by material and pose them.

    Args:
        pieces: Of a whole figure, at rest.
        bones: Matrices of each pose, (poses, bones, 3, 4).

    Returns:
        Parts in their first pose, and all poses.
    """
    groups: dict[tuple[str, str], list[SkinPart]] = {}
    for piece in pieces:
        groups.setdefault((piece.material, piece.role), []).append(piece)
    parts, points, directions = [], [], []
    for (material, role), members in groups.items():
        posed = [_posed(piece, bones) for piece in members]
        vertices = np.concatenate([p[0] for p in posed], axis=1)
        normals = np.concatenate([p[1] for p in posed], axis=1)
        starts = np.cumsum([0, *(len(piece.vertices) for piece in members)])[:-1]
        faces = np.concatenate(
            [piece.faces + start for piece, start in zip(members, starts, strict=True)]
        )
        plain = all(piece.tint is None and piece.shade is None for piece in members)
        tint = None if plain else np.concatenate([_shaded(piece) for piece in members])
        parts.append(Part(Mesh(vertices[0], faces, normals[0]), material, tint, role))
        points.append(vertices)
        directions.append(normals)
    return tuple(parts), Poses(np.concatenate(points, axis=1), np.concatenate(directions, axis=1))


def _shaded(piece: SkinPart) -> Floats:
    """Return the tints of a piece with its shades, (m, 3)."""
    tint = np.ones((len(piece.faces), 3)) if piece.tint is None else piece.tint
    return tint if piece.shade is None else tint * piece.shade[:, None]


def _posed(piece: SkinPart, bones: Floats) -> tuple[Floats, Floats]:
    """Return the vertices and normals of a piece in each pose, (poses, n, 3) each."""
    mixed = np.einsum("nb,pbij->pnij", piece.weights, bones, optimize=True)
    rest = np.broadcast_to(piece.vertices, (len(bones), *piece.vertices.shape))
    for crease in piece.creases:
        rest = rest + np.minimum(_bend(bones, crease.bones), 1.5)[:, None, None] * crease.offsets
    points = (mixed[..., :3] @ rest[..., None])[..., 0] + mixed[..., 3]
    if piece.sway is not None:
        points[..., 0] += _swayed(piece, bones, points[..., 0])
    normals = smooth_normals(points, piece.faces)
    if piece.slopes is None:
        return points, normals
    tilt = (mixed[..., :3] @ piece.slopes[None, :, :, None])[..., 0]
    tilt = tilt - (tilt * normals).sum(axis=2, keepdims=True) * normals
    return points, unit(normals - tilt)


def _bend(bones: Floats, pair: tuple[str, str]) -> Floats:
    """Return the angle between two bones in each pose, (poses,) [rad]."""
    one, other = (bones[:, BONES.index(name), :, :3] for name in pair)
    cosine = 0.5 * (np.einsum("pij,pij->p", one, other) - 1.0)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _swayed(piece: SkinPart, bones: Floats, x: Floats) -> Floats:
    """Return how far a skirt's front follows the forward leg and its back the other, (poses, n)."""
    assert piece.sway is not None
    thighs = np.stack([bones[:, BONES.index(f"thigh_{side}")] for side in ("l", "r")])
    reach = np.einsum("spj,nj->spn", thighs[:, :, 0, :3], piece.vertices) + thighs[:, :, 0, 3:]
    forward = np.maximum(reach.max(axis=0) - x, 0.0) * np.maximum(piece.sway, 0.0)
    backward = np.maximum(x - reach.min(axis=0), 0.0) * np.maximum(-piece.sway, 0.0)
    return np.asarray(0.8 * (forward - backward))


def smooth_normals(points: Floats, faces: Ints) -> Floats:
    """Return vertex normals weighted by area, (poses, n, 3)."""
    areas = area_vectors(points, faces)
    rows, columns = faces.reshape(-1), np.repeat(np.arange(len(faces)), 3)
    spread = csr_matrix((np.ones(len(rows)), (rows, columns)), (points.shape[1], len(faces)))
    normals = np.stack([spread @ area for area in areas])
    return np.asarray(normals / (np.linalg.norm(normals, axis=2, keepdims=True) + 1e-20))
