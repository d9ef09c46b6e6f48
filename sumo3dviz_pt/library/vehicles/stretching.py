"""Fits bodies to other lengths, and builds the bellows between units of buses, trams and trains.

Only a body's stretch becomes longer, and wheels stay round.

A bellows begins at the middle of the rear face of the unit ahead and runs backwards. Where it is
bent, its centre line is an arc whose chord lies along -x, so that scaling it along x makes it
reach from face to face, whatever the distance between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.model.scene import Part, Poses, Prototype, VehicleLamp

_TURNING = frozenset(["rubber", "rim", "rim_dust", "disc"])
"""Materials of wheels."""

_MOST_SHRINK = 0.35
"""A stretch keeps at least this share of its length."""


@dataclass(frozen=True, slots=True)
class BodyStretch:
    """A part of a body that may be longer or shorter.

    Attributes:
        first: Where it begins, behind the front [m].
        last: Where it ends, behind the front [m].
        factor: How much longer it becomes, > 0.
    """

    first: float
    last: float
    factor: float

    @classmethod
    def to_length(cls, span: tuple[float, float], *, extra: float) -> BodyStretch:
        """Return the stretch that makes a body longer by `extra` [m], or as short as it may be.

        Args:
            span: Where it begins and ends, behind the front [m].
            extra: By how much the body is to become longer, negative for shorter [m].
        """
        length = span[1] - span[0]
        return cls(*span, max((length + extra) / length, _MOST_SHRINK))

    @property
    def gain(self) -> float:
        """By how much the body becomes longer [m]."""
        return (self.factor - 1.0) * (self.last - self.first)

    def moved(self, x: Floats) -> Floats:
        """Return where points at x <= 0, of any shape, come to lie [m]."""
        behind = np.clip(-np.asarray(x), self.first, self.last) - self.first
        return np.asarray(x - (self.factor - 1.0) * behind)

    def moved_point(self, point: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return where one point comes to lie [m]."""
        x, y, z = point
        return float(self.moved(np.array(x))), y, z


def stretched(prototype: Prototype, stretch: BodyStretch, *, name: str) -> Prototype:
    """Return a body whose stretch has another length; all else keeps its shape.

    Args:
        prototype: The body in its own length.
        stretch: What becomes longer.
        name: Of the new body.
    """
    near, far = (
        tuple(replace(part, mesh=_longer(part.mesh, stretch)) for part in parts)
        for parts in (prototype.parts, prototype.far)
    )
    lamps = tuple(_lamp(lamp, stretch) for lamp in prototype.lamps)
    return Prototype(name, near, far, lamps)


def turned_round(mesh: Mesh, length: float) -> Mesh:
    """Turn a mesh by half a circle about the middle of a length [m]."""
    turn = np.array([-1.0, -1.0, 1.0])
    normals = None if mesh.normals is None else mesh.normals * turn
    moved = mesh.vertices * turn - np.array([length, 0.0, 0.0])
    return replace(mesh, vertices=moved, normals=normals)


def round_wheels(
    prototype: Prototype, wheels: Sequence[WheelPlace], *, ratio: float, name: str
) -> Prototype:
    """Return a body whose wheels become round when x is scaled by `ratio` more than z.

    Args:
        prototype: The unscaled body.
        wheels: Where its wheels are.
        ratio: Factor of x over that of z, > 0.
        name: Of the new body.
    """
    near, far = (
        tuple(
            replace(part, mesh=_rounded(part.mesh, wheels, ratio))
            if part.material in _TURNING
            else part
            for part in parts
        )
        for parts in (prototype.parts, prototype.far)
    )
    return replace(prototype, name=name, parts=near, far=far)


def _rounded(mesh: Mesh, wheels: Sequence[WheelPlace], ratio: float) -> Mesh:
    """Squeeze the points of each wheel towards its axle."""
    vertices = mesh.vertices.copy()
    for wheel in wheels:
        away = vertices[:, [0, 2]] - [wheel.at[0], wheel.at[2]]
        own = (np.linalg.norm(away, axis=1) < 1.02 * wheel.radius) & (
            np.sign(vertices[:, 1]) == np.sign(wheel.at[1])
        )
        vertices[own, 0] = wheel.at[0] + away[own, 0] / ratio
    return replace(mesh, vertices=vertices)


def _longer(mesh: Mesh, stretch: BodyStretch) -> Mesh:
    """A mesh with its points moved."""
    vertices = mesh.vertices.copy()
    vertices[:, 0] = stretch.moved(vertices[:, 0])
    return replace(mesh, vertices=vertices)


def _lamp(lamp: VehicleLamp, stretch: BodyStretch) -> VehicleLamp:
    """A lamp on the longer body."""
    return replace(lamp, at=stretch.moved_point(lamp.at))


MOST_BEND = float(np.radians(60.0))
"""Largest angle between the two units, to either side [rad]."""

BENDS = 25
"""Number of shapes from one side to the other, 5 degrees apart."""

_DEPTH = 0.45
"""Depth of a fold as a share of its length."""

_ROUND = 0.16
"""Radius of the corners of the section [m]."""

_CORNER = 3  # points of a corner
_QUARTERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


@dataclass(frozen=True, slots=True)
class Bellows:
    """A bellows as an asset describes it.

    Attributes:
        length: From face to face, straight [m].
        half: Half its width [m].
        low: Height of its floor [m].
        high: Height of its roof [m].
        folds: How many.
    """

    length: float
    half: float
    low: float
    high: float
    folds: int


def bellows(shape: Bellows, *, far: bool = False) -> tuple[Part, Poses]:
    """Build a bellows with its poses: at rest, then bent from most right to most left.

    Args:
        shape: Its measures.
        far: Whether it is seen from far away and needs no folds.
    """
    folds = 2 if far else 2 * shape.folds
    depth = 0.0 if far else _DEPTH * shape.length / shape.folds
    section, outwards = _section(shape)
    # Every flank has points of its own, so that folds show sharp edges.
    edges = np.repeat(np.arange(folds + 1), 2)[1:-1]
    inwards = depth * (edges % 2 == 0)
    rings = section[None] - inwards[:, None, None] * outwards[None]
    slope = np.where(np.arange(len(edges)) // 2 % 2 == 0, 1.0, -1.0) * depth * folds / shape.length
    bends = [0.0, *np.linspace(-MOST_BEND, MOST_BEND, BENDS).tolist()]
    arcs = [_Arc.of(edges / folds, shape.length, bend) for bend in bends]
    vertices = np.stack([arc.points(rings) for arc in arcs])
    normals = np.stack([arc.normals(outwards, slope) for arc in arcs])
    faces = _flank_faces(folds, len(section))
    return Part(Mesh(vertices[0], faces, normals[0]), "bellows_dark"), Poses(vertices, normals)


def bend_phase(bend: float) -> float:
    """Return the phase at which a bellows is bent by an angle [rad], positive to the left."""
    share = (float(np.clip(bend, -MOST_BEND, MOST_BEND)) + MOST_BEND) / (2.0 * MOST_BEND)
    return share * (BENDS - 1) / BENDS


def chord(length: float, bend: float) -> float:
    """Return the straight distance between the ends of a bellows [m] bent by an angle [rad]."""
    half = min(abs(bend), MOST_BEND) / 2.0
    return length * float(np.sinc(half / np.pi))


def _section(shape: Bellows) -> tuple[Floats, Floats]:
    """Points around the section and their outward directions, as (y, z), (m, 2) each."""
    centre = (shape.low + shape.high) / 2.0
    half = np.array([shape.half, (shape.high - shape.low) / 2.0])
    points, normals = [], []
    for quarter in range(4):
        turn = np.pi / 2 * quarter + np.linspace(0.0, np.pi / 2, _CORNER)
        outward = np.column_stack([np.cos(turn), np.sin(turn)])
        points.append((half - _ROUND) * _QUARTERS[quarter] + _ROUND * outward)
        normals.append(outward)
    return np.concatenate(points) + np.array([0.0, centre]), np.concatenate(normals)


def _flank_faces(flanks: int, points: int) -> Ints:
    """Triangles of flanks that each have a ring of points at both edges, outwards, (n, 3)."""
    flank, point = np.meshgrid(np.arange(flanks), np.arange(points), indexing="ij")
    a, b = 2 * flank * points + point, 2 * flank * points + (point + 1) % points
    c, d = a + points, b + points
    return np.stack([a, d, b, a, c, d], axis=-1).reshape(-1, 3)


@dataclass(frozen=True, slots=True, eq=False)
class _Arc:
    """The bent centre line at r rings: places in the plane and headings, (r, 2) and (r,)."""

    places: Floats
    headings: Floats

    @classmethod
    def of(cls, along: Floats, length: float, bend: float) -> _Arc:
        """Bend a line.

        Args:
            along: Where the rings are, as shares of the line, (r,).
            length: Of the line [m].
            bend: Between its ends, positive to the left [rad].
        """
        headings = bend / 2.0 - bend * along
        if abs(bend) < 1e-9:
            return cls(np.column_stack([-length * along, 0.0 * along]), headings)
        x = -length / bend * (np.sin(bend / 2.0) - np.sin(headings))
        y = -length / bend * (np.cos(headings) - np.cos(bend / 2.0))
        return cls(np.column_stack([x, y]), headings)

    def points(self, rings: Floats) -> Floats:
        """Put sections of (y, z), (r, m, 2), at their places, (r m, 3) [m]."""
        left = np.column_stack([-np.sin(self.headings), np.cos(self.headings)])
        points = np.zeros((*rings.shape[:2], 3))
        points[..., :2] = self.places[:, None] + rings[..., :1] * left[:, None]
        points[..., 2] = rings[..., 1]
        return points.reshape(-1, 3)

    def normals(self, outwards: Floats, slopes: Floats) -> Floats:
        """Return unit normals of flanks that rise by slopes, (r,), to the rear; (r m, 3)."""
        ahead = np.column_stack([np.cos(self.headings), np.sin(self.headings)])
        left = np.column_stack([-ahead[:, 1], ahead[:, 0]])
        normals = np.zeros((len(slopes), len(outwards), 3))
        normals[..., :2] = outwards[None, :, :1] * left[:, None]
        normals[..., :2] += (slopes[:, None] * ahead)[:, None]
        normals[..., 2] = outwards[None, :, 1]
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        return normals.reshape(-1, 3)
