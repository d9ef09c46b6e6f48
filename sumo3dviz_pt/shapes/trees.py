"""Trees that grow from a seed: branches as tapered tubes, leaves as real triangles.

No picture of a leaf with a mask: real triangles cost less in a path tracer and do
not look like cards. From level to level leaves get fewer and larger, so that their
total area and the crown's outline stay.

References:
    Branching angles, lengths and leaf reflectances: the project's look study; golden
    angle of phyllotaxis: P. Prusinkiewicz, A. Lindenmayer: The Algorithmic Beauty of
    Plants, 1990, section 4.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Colour, Part
from sumo3dviz_pt.shapes.branches import Branches, bark, children, trunk


@dataclass(frozen=True, slots=True)
class Species:
    """How a tree grows. Lengths are shares of its height.

    Attributes:
        height: Usual height [m].
        girth: Radius of the trunk at the ground.
        clear: Where the crown begins.
        reach: Length of the longest boughs.
        crown: Envelope of bough lengths at crown heights 0, 1/4, 1/2, 3/4, 1.
        rise: Angle between boughs and trunk, lowest and highest bough [rad].
        boughs: How many leave the trunk.
        droop: Downward bend of twigs per step.
        leaf: Reflectance of the leaves.
        area: One-sided leaf area per squared height.
        slender: Length of a leaf by its width.
        scatter: How far leaves turn away from their twig's direction.
        bark: Material of trunk and boughs.
        foliage: Material of the leaves.
    """

    height: float
    girth: float
    clear: float
    reach: float
    crown: tuple[float, float, float, float, float]
    rise: tuple[float, float]
    boughs: int
    droop: float
    leaf: Colour
    area: float
    slender: float = 1.8
    scatter: float = 0.7
    bark: str = "bark"
    foliage: str = "leaf"


SPECIES: Mapping[str, Species] = {
    "maple": Species(
        9.0,
        0.019,
        0.22,
        0.38,
        (0.65, 1.0, 1.0, 0.8, 0.4),
        (1.15, 0.55),
        14,
        0.02,
        (0.105, 0.2, 0.042),
        2.4,
    ),
    "poplar": Species(
        15.0,
        0.012,
        0.08,
        0.17,
        (0.7, 1.0, 1.0, 0.85, 0.4),
        (0.55, 0.25),
        30,
        -0.10,
        (0.11, 0.2, 0.05),
        0.62,
    ),
    "birch": Species(
        11.0,
        0.012,
        0.20,
        0.27,
        (0.8, 1.0, 0.9, 0.65, 0.3),
        (1.0, 0.5),
        20,
        0.10,
        (0.13, 0.22, 0.045),
        0.95,
        bark="bark_pale",
    ),
    "pine": Species(
        12.0,
        0.014,
        0.10,
        0.27,
        (1.0, 0.80, 0.57, 0.33, 0.08),
        (1.6, 1.1),
        40,
        0.0,
        (0.07, 0.125, 0.045),
        1.25,
        slender=9.0,
        scatter=0.25,
    ),
}
"""By name. Heights are those of street trees, not of old forest trees."""


@dataclass(frozen=True, slots=True)
class _Detail:
    """What a level of detail spends: leaves, and facets and steps of each bark order.

    Few leaves stand for bundles, so they may not be as slender as single ones.
    """

    leaves: int
    sides: tuple[int, ...]
    steps: tuple[int, ...]
    folded: bool
    slender: float


_UP = np.array([0.0, 0.0, 1.0])
_DETAILS = (
    _Detail(12_000, (10, 6, 3), (8, 6, 4), True, 9.0),
    _Detail(3500, (8, 5, 3), (7, 4, 3), True, 7.0),
    _Detail(1700, (6, 4), (6, 3), True, 5.0),
    _Detail(800, (5, 3), (5, 3), True, 4.0),
    _Detail(240, (3,), (3,), False, 2.0),
)


def tree(
    species: str, *, seed: int, level: int = 0, height: float | None = None
) -> tuple[Part, ...]:
    """Grow a tree; the same seed gives the same crown at every level of detail.

    Args:
        species: A key of `SPECIES`.
        seed: Of its shape.
        level: 0 within reach (about 27,000 triangles), 1 near (11,000), 2 (4,000), 3 middle
            (2,000), 4 far (260).
        height: [m]; default the species' usual one.

    Returns:
        Bark and foliage; the foot stands at the origin, 0.3 m deep in the ground.
    """
    kind, detail = SPECIES[species], _DETAILS[level]
    orders = _skeleton(kind, np.random.default_rng(seed))
    # Crowns grow as chance has it; the highest twig decides what one metre is.
    scale = (height or kind.height) / float(orders[-1].points[..., 2].max())
    wood = bark(orders[: len(detail.sides)], detail.sides, detail.steps)
    foliage, tint = _foliage(kind, orders[-1], detail, np.random.default_rng([seed, 1]))
    return (
        Part(_scaled(wood, scale), kind.bark),
        Part(_scaled(foliage, scale), kind.foliage, tint),
    )


def _skeleton(kind: Species, rng: np.random.Generator) -> tuple[Branches, ...]:
    """Trunk, boughs, branches and twigs."""
    stem = trunk(kind.height, kind.girth * kind.height, rng=rng)
    share = (np.arange(kind.boughs) + 0.5) / kind.boughs
    along = kind.clear + (0.98 - kind.clear) * share
    lengths = kind.reach * kind.height * np.interp(share, np.linspace(0, 1, 5), kind.crown)
    angles = np.interp(share, (0, 1), kind.rise) + rng.normal(0, 0.1, kind.boughs)
    boughs = children(
        stem,
        along[None],
        lengths[None] * rng.uniform(0.8, 1.15, (1, kind.boughs)),
        angles=angles[None],
        rng=rng,
        bend=-kind.droop,
    )
    orders = [stem, boughs]
    for count, share_of in ((6, 0.5), (4, 0.5)):
        parent = orders[-1]
        at = np.linspace(0.3, 1.0, count)[None] + rng.normal(0, 0.04, (parent.count, count))
        grown = parent.lengths[:, None] * share_of * (1.2 - 0.55 * at)
        spread = rng.uniform(0.5, 1.05, at.shape)
        orders.append(
            children(parent, np.clip(at, 0.1, 1.0), grown, angles=spread, rng=rng, bend=-kind.droop)
        )
    return tuple(orders)


def _foliage(
    kind: Species, twigs: Branches, detail: _Detail, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Leaves along the twigs, and the tint of each face."""
    count = detail.leaves
    chosen = rng.integers(0, twigs.count, count)
    at = rng.uniform(0.2, 1.0, count)
    centres, along = twigs.points_at(chosen, at)
    size = np.sqrt(kind.area * kind.height**2 / count * 2.0) * rng.uniform(0.75, 1.25, count)
    slender = min(kind.slender, detail.slender)
    width, length = size / np.sqrt(slender), size * np.sqrt(slender)
    centres = centres + rng.normal(
        0, 0.14 * kind.scatter * kind.reach * kind.height, (count, 3)
    ) * [1, 1, 0.7]
    centres[:, 2] = np.maximum(centres[:, 2], 0.04 * kind.height)
    axis = _unit(along + kind.scatter * (rng.normal(0, 1.0, (count, 3)) - 0.35 * _UP))
    facing = rng.normal(0, 0.8, (count, 3)) + 0.9 * _UP
    across = _unit(np.cross(axis, facing))
    mesh = _leaves(centres, axis * length[:, None], across * width[:, None], detail.folded)
    mesh = Mesh(mesh.vertices, mesh.faces, _soft_normals(mesh, kind))
    depth = _depth(centres, kind)
    tint = np.array(kind.leaf) * rng.uniform(0.8, 1.2, (count, 1)) * (0.75 + 0.35 * depth[:, None])
    tint += np.array([0.018, 0.008, 0.0]) * rng.random((count, 1))
    return mesh, np.repeat(tint, 2 if detail.folded else 1, axis=0)


def _leaves(centres: Floats, along: Floats, across: Floats, folded: bool) -> Mesh:
    """Folded diamonds of two triangles, or single triangles of the same area."""
    first = np.arange(len(centres))[:, None]
    if not folded:
        corners = np.stack(
            [
                centres - along / 2 - across / 2,
                centres - along / 2 + across / 2,
                centres + along / 2,
            ],
            axis=1,
        )
        return Mesh(corners.reshape(-1, 3), np.arange(3 * len(centres)).reshape(-1, 3))
    fold = 0.12 * _unit(np.cross(along, across)) * np.linalg.norm(across, axis=1)[:, None]
    middle = centres - 0.05 * along
    corners = np.stack(
        [
            centres - along / 2,
            middle + across / 2 + fold,
            centres + along / 2,
            middle - across / 2 + fold,
        ],
        axis=1,
    )
    faces = 4 * first + np.array([0, 2, 1, 0, 3, 2])
    return Mesh(corners.reshape(-1, 3), faces.reshape(-1, 3))


def _soft_normals(mesh: Mesh, kind: Species) -> Floats:
    """Leaf normals bent towards the crown's own, which hides how few leaves there are."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    flat = _unit(np.cross(b - a, c - a))
    normals = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(normals, mesh.faces[:, k], flat)
    outward = _unit(mesh.vertices - _core(mesh.vertices, kind))
    normals = _unit(normals)
    # A normal and its opposite mean the same leaf: take the one that looks outwards.
    normals *= np.where((normals * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    return _unit(0.45 * normals + 0.55 * outward)


def _core(points: Floats, kind: Species) -> Floats:
    """Points on the trunk's axis that the crown grows around, (n, 3)."""
    low, high = kind.clear * kind.height, 0.8 * kind.height
    core = np.zeros_like(points)
    core[:, 2] = np.clip(points[:, 2] - 0.12 * kind.height, low, high)
    return core


def _depth(points: Floats, kind: Species) -> Floats:
    """0 at the trunk, 1 at the crown's outside; inner leaves see less sky and are darker."""
    distance = np.hypot(points[:, 0], points[:, 1]) / (kind.reach * kind.height)
    depth: Floats = np.clip(distance + np.maximum(points[:, 2] / kind.height - 0.6, 0.0), 0.0, 1.0)
    return depth


def _scaled(mesh: Mesh, scale: float) -> Mesh:
    """The mesh enlarged about the origin."""
    return Mesh(mesh.vertices * scale, mesh.faces, mesh.normals)


def _unit(vectors: Floats) -> Floats:
    """Vectors of length 1, (n, 3)."""
    unit: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    return unit
