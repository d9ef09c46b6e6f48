"""Trees that grow from a seed: branches as tapered tubes, leaves as real triangles.

All branches of one order grow at once. Leaves on twigs have normals and tints of their own, and are
no pictures with a mask: real triangles cost less in a path tracer and do not look like cards. From
level to level leaves get fewer and larger, so that their total area and the crown's outline stay.

References:
    Golden angle of phyllotaxis: P. Prusinkiewicz, A. Lindenmayer: The Algorithmic Beauty of
    Plants, 1990, section 4.1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from sumo3dviz_pt.library.plants.species import SHRUBS, SPECIES, Species, bare, leafy, twiggy
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, area_vectors, areas, merge_meshes, unit
from sumo3dviz_pt.model.scene import Part

_STEPS = 6
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # golden angle [rad]


@dataclass(frozen=True, slots=True, eq=False)
class Branches:
    """All branches of one order as polylines.

    Attributes:
        points: (n, steps + 1, 3) [m].
        radii: At each point, (n, steps + 1) [m].
        lengths: (n,) [m].
    """

    points: Floats
    radii: Floats
    lengths: Floats

    @property
    def count(self) -> int:
        """How many branches there are."""
        return len(self.points)

    def points_at(self, which: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Find places along branches and unit directions there, (n, 3) each; share in [0, 1]."""
        steps = self.points.shape[1] - 1
        place = np.clip(share, 0.0, 1.0) * steps
        index = np.minimum(place.astype(np.int64), steps - 1)
        a, b = self.points[which, index], self.points[which, index + 1]
        direction = unit(b - a)
        return a + (b - a) * (place - index)[:, None], direction


@dataclass(frozen=True, slots=True)
class Manner:
    """How branches of one order grow.

    Attributes:
        bend: Upward bend per step; negative droops.
        wobble: Random change of direction per step.
        flat: Whether they leave to both sides in a plane, not all around.
        thick: Their radius by that of their parent where they leave it.
    """

    bend: float = 0.05
    wobble: float = 0.12
    flat: bool = False
    thick: float = 0.55


def trunk(
    height: float,
    radius: float,
    *,
    rng: np.random.Generator,
    top: float = 0.92,
    crooked: float = 0.007,
) -> Branches:
    """Grow a slightly crooked stem; its foot is 0.3 m deep in the ground.

    Args:
        height: Of the tree [m].
        radius: Above the root flare [m].
        rng: Makes it crooked.
        top: Where the stem ends, as a share of the height.
        crooked: Sideways step between its nine points, as a share of the height.
    """
    z = np.linspace(0.0, top * height, 9)
    wander = np.cumsum(rng.normal(0, crooked * height, (9, 2)), axis=0)
    # A tree stands upright at its foot.
    wander -= wander[:1] + (wander[1:2] - wander[:1]) * np.array([[0.0], *[[1.0]] * 8])
    points = np.column_stack([wander, z])
    points[0, 2] = -0.3
    radii = radius * np.interp(z / height, (0.0, 0.05, 0.5, top), (1.06, 1.0, 0.6, 0.12))
    return Branches(points[None], radii[None], np.array([top * height]))


def children(
    parents: Branches,
    at: Floats,
    lengths: Floats,
    *,
    angles: Floats,
    rng: np.random.Generator,
    manner: Manner,
) -> Branches:
    """Grow the next order of branches.

    Args:
        parents: The order to grow from, n branches.
        at: Where children leave, (n or 1, k) in [0, 1].
        lengths: (n or 1, k) [m].
        angles: Between child and parent, (n or 1, k) [rad].
        rng: Jitters directions.
        manner: How they grow.
    """
    shape = (parents.count, at.shape[1])
    which = np.repeat(np.arange(shape[0]), shape[1])
    share = np.broadcast_to(at, shape).reshape(-1)
    long = np.broadcast_to(lengths, shape).reshape(-1)
    start, along = parents.points_at(which, share)
    turn = _turns(shape, manner, rng).reshape(-1)
    direction = _tilted(along, np.broadcast_to(angles, shape).reshape(-1), turn)
    step = (long / _STEPS)[:, None]
    points = [start]
    for _ in range(_STEPS):
        jitter = rng.normal(0, manner.wobble, direction.shape)
        direction = direction + jitter + [0, 0, manner.bend]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        points.append(points[-1] + direction * step)
    thick = _radius_at(parents, which, share) * manner.thick
    radii = thick[:, None] * np.linspace(1.0, 0.3, _STEPS + 1)
    return Branches(np.stack(points, axis=1), radii, long)


def root_flare(radius: float, *, sides: int, rng: np.random.Generator) -> Mesh:
    """Build the foot of a trunk: wider towards the ground, with buttresses between the roots.

    Args:
        radius: Of the trunk above it [m].
        sides: Facets around.
        rng: Turns and varies the buttresses.
    """
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    lobes = np.cos(4 * turn + rng.uniform(0, 2 * np.pi)) + 0.6 * rng.normal(0, 0.5, sides)
    spread = np.array([2.0, 1.75, 1.35, 1.12, 1.0])
    share = np.array([1.0, 1.0, 0.6, 0.3, 0.05])
    rings = radius * spread[:, None] * (1.0 + 0.13 * share[:, None] * lobes)
    heights = radius * np.array([-1.2, 0.0, 0.8, 2.2, 4.5])
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    vertices = np.concatenate(
        [rings[..., None] * circle, np.broadcast_to(heights[:, None, None], (5, sides, 1))], axis=2
    )
    outward = np.broadcast_to(np.append(circle, np.full((sides, 1), 0.25), axis=1), vertices.shape)
    normals = (outward / np.linalg.norm(outward, axis=2, keepdims=True)).reshape(-1, 3)
    return Mesh(vertices.reshape(-1, 3), _ring_faces(sides, 4), normals)


def bark(orders: Sequence[Branches], sides: Sequence[int], steps: Sequence[int]) -> Mesh:
    """Build tubes around orders of branches, with smooth normals.

    Args:
        orders: From the trunk outwards.
        sides: Facets around, of each order.
        steps: Pieces along, of each order.
    """
    return merge_meshes([_tubes(o, s, n) for o, s, n in zip(orders, sides, steps, strict=True)])


def _turns(shape: tuple[int, int], manner: Manner, rng: np.random.Generator) -> Floats:
    """Draw the angles around the parent at which children leave, (n, k) [rad]."""
    number = np.arange(shape[1])
    if manner.flat:
        return np.asarray(np.pi * (number % 2) + rng.normal(0, 0.2, shape))
    turn = rng.uniform(0, 2 * np.pi, (shape[0], 1)) + _GOLDEN * number
    return np.asarray(turn + rng.normal(0, 0.3, shape))


def _tilted(axis: Floats, angle: Floats, turn: Floats) -> Floats:
    """Return directions at an angle from axes, turned around them, (n, 3)."""
    helper = np.where(np.abs(axis[:, 2:]) > 0.9, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    u = np.cross(axis, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(axis, u)
    side = u * np.cos(turn)[:, None] + v * np.sin(turn)[:, None]
    tilted: Floats = axis * np.cos(angle)[:, None] + side * np.sin(angle)[:, None]
    return tilted


def _radius_at(branches: Branches, which: Ints, share: Floats) -> Floats:
    """Return the radius of branches at shares of their length, (n,) [m]."""
    place = share * (branches.radii.shape[1] - 1)
    index = np.minimum(place.astype(np.int64), branches.radii.shape[1] - 2)
    a, b = branches.radii[which, index], branches.radii[which, index + 1]
    radius: Floats = a + (b - a) * (place - index)
    return radius


def _tubes(branches: Branches, sides: int, steps: int) -> Mesh:
    """Build open tubes around branches, thinned to a number of steps."""
    keep = np.round(np.linspace(0, branches.points.shape[1] - 1, steps + 1)).astype(np.int64)
    points, radii = branches.points[:, keep], branches.radii[:, keep]
    along = np.gradient(points, axis=1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    # One helper direction per branch, so that the rings of a tube do not twist.
    mean = along.mean(axis=1, keepdims=True)
    helper = np.where(np.abs(mean[..., 2:]) > 0.8, [[[1.0, 0.0, 0.0]]], [[[0.0, 0.0, 1.0]]])
    u = np.cross(along, helper)
    u /= np.linalg.norm(u, axis=2, keepdims=True)
    v = np.cross(along, u)
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    normals = u[:, :, None] * np.cos(turn) + v[:, :, None] * np.sin(turn)
    vertices = points[:, :, None] + radii[:, :, None, None] * normals
    stride = (steps + 1) * sides
    faces = np.arange(branches.count)[:, None, None] * stride + _ring_faces(sides, steps)
    return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), normals.reshape(-1, 3))


def _ring_faces(sides: int, steps: int) -> Ints:
    """Return the triangles between rings of vertices, (2 * sides * steps, 3)."""
    ring = np.arange(sides)
    i = np.arange(steps)[:, None] * sides
    a, b = i + ring, i + (ring + 1) % sides
    pairs = [np.stack([a, b, b + sides], -1), np.stack([a, b + sides, a + sides], -1)]
    return np.concatenate(pairs).reshape(-1, 3)


_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Crown:
    """Twigs and what leaf normals bend towards.

    Attributes:
        twigs: Of one tree.
        hubs: Centre of the clump that each twig belongs to, (n, 3) [m].
        core: Lowest and highest point of the axis that the crown grows around [m].
        bounds: Lowest and highest corner of all leaves, whatever their number, (2, 3) [m].
    """

    twigs: Branches
    hubs: Floats
    core: tuple[float, float]
    bounds: Floats


def crown(kind: Species, branches: Branches, twigs: Branches) -> Crown:
    """Gather what the leaves of a tree grow on.

    Args:
        kind: Its species.
        branches: The order before the last.
        twigs: The last order, all twigs of a branch in a row.
    """
    per_branch = twigs.count // branches.count
    middle = branches.points[:, branches.points.shape[1] // 2]
    hubs = np.repeat(middle - [0.0, 0.0, 0.02 * kind.height], per_branch, axis=0)
    places = twigs.points.reshape(-1, 3)
    margin = kind.stray * kind.height + 0.01 * kind.height
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    low[2] = max(low[2], 0.012 * kind.height)
    axis = (kind.clear * kind.height, 0.72 * kind.height)
    return Crown(twigs, hubs, axis, np.stack([low, high]))


BENT, HARDLY = 0.5, 0.2
"""How far normals of leaves are bent towards those of clump and crown: of large leaves that stand
for many, and of leaves about as large as real ones, which the light tells apart."""


def foliage(
    kind: Species,
    grown: Crown,
    *,
    leaves: int,
    folded: bool,
    rng: np.random.Generator,
    bent: float = BENT,
) -> tuple[Mesh, Floats]:
    """Grow leaves along the twigs, and tint each face.

    Their total area and bounds do not depend on their number: fewer leaves are larger.

    Args:
        kind: The species.
        grown: What they grow on.
        leaves: Their number, >= 12.
        folded: True gives diamonds of two triangles, False single triangles.
        rng: Places and turns them.
        bent: How far their normals are bent towards those of clump and crown, in [0, 1].
    """
    # Every twig gets its share, in the same order at every level of detail.
    twig = rng.permutation(grown.twigs.count)[np.arange(leaves) % grown.twigs.count]
    foot, along = grown.twigs.points_at(twig, rng.uniform(kind.begin, 1.0, leaves))
    spread = rng.normal(0, kind.stray * kind.height, (leaves, 3))
    # Bundles stand for many leaves, so they may not be as slender as single ones.
    slender = 1.4 + (kind.slender - 1.4) * np.clip(leaves / 12_000, 0.12, 1.0) ** 0.35
    size = np.sqrt(kind.area * kind.height**2 / leaves * 2.0) * rng.uniform(0.7, 1.3, leaves)
    width, length = size / np.sqrt(slender), size * np.sqrt(slender)
    axis = unit(along + kind.turn * rng.normal(0, 1.0, (leaves, 3)) - kind.hang * _UP)
    facing = rng.normal(0, 0.8, (leaves, 3)) + 0.9 * _UP
    across = unit(np.cross(axis, facing))
    centres = foot + spread + 0.3 * axis * length[:, None]
    along, across = axis * length[:, None], across * width[:, None]
    mesh = _within(_leaves(centres, along, across, folded), grown.bounds)
    # Chance and the fit to the bounds change the area: a second round puts that right.
    share = np.sqrt(kind.area * kind.height**2 / float(areas(mesh.vertices, mesh.faces).sum()))
    mesh = _within(_leaves(centres, share * along, share * across, folded), grown.bounds)
    per_leaf = 2 if folded else 1
    of_vertices = np.repeat(twig, len(mesh.vertices) // leaves)
    normals = _soft_normals(mesh, grown, of_vertices, bent)
    tint = _tints(kind, grown, centres, twig, rng)
    return Mesh(mesh.vertices, mesh.faces, normals), np.repeat(tint, per_leaf, axis=0)


def _leaves(centres: Floats, along: Floats, across: Floats, folded: bool) -> Mesh:
    """Build folded diamonds of two triangles, or single triangles of the same area."""
    first = np.arange(len(centres))[:, None]
    if not folded:
        base = centres - along / 2
        corners = np.stack([base - across / 2, base + across / 2, centres + along / 2], axis=1)
        return Mesh(corners.reshape(-1, 3), np.arange(3 * len(centres)).reshape(-1, 3))
    fold = 0.16 * unit(np.cross(along, across)) * np.linalg.norm(across, axis=1)[:, None]
    middle = centres - 0.08 * along
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


def _within(mesh: Mesh, bounds: Floats) -> Mesh:
    """Stretch a mesh a little so that its bounds are the given ones."""
    low, high = mesh.bounds
    share = (mesh.vertices - low) / np.maximum(high - low, 1e-9)
    return Mesh(bounds[0] + share * (bounds[1] - bounds[0]), mesh.faces)


def _soft_normals(mesh: Mesh, grown: Crown, twig: Ints, bent: float) -> Floats:
    """Bend leaf normals towards those of clump and crown, which hides how few leaves there are."""
    flat = unit(area_vectors(mesh.vertices, mesh.faces))
    normals = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(normals, mesh.faces[:, k], flat)
    core = np.zeros_like(mesh.vertices)
    core[:, 2] = np.clip(mesh.vertices[:, 2], *grown.core)
    of_crown = unit(mesh.vertices - core)
    of_clump = unit(mesh.vertices - grown.hubs[twig])
    outward = unit(0.55 * of_clump + 0.45 * of_crown)
    normals = unit(normals)
    # A normal and its opposite mean the same leaf: take the one that looks outwards.
    normals *= np.where((normals * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    return unit((1.0 - bent) * normals + bent * outward)


def _tints(
    kind: Species, grown: Crown, centres: Floats, twig: Ints, rng: np.random.Generator
) -> Floats:
    """Draw the reflectance of each leaf: darker inside, yellower at young tips, (n, 3)."""
    count = len(centres)
    half = 0.5 * np.ptp(grown.bounds, axis=0)
    away = (centres - grown.bounds.mean(axis=0)) / np.maximum(half, 1e-9)
    depth = np.clip(np.linalg.norm(away * [1.0, 1.0, 0.8], axis=1), 0.0, 1.0)
    of_twig = rng.uniform(0.86, 1.14, grown.twigs.count)[twig]
    value = rng.uniform(0.78, 1.22, count) * of_twig * (0.84 + 0.32 * depth)
    tint = np.array(kind.leaf) * value[:, None]
    warm = rng.random(count) ** 3
    tint += np.array([0.030, 0.014, 0.0]) * (warm * kind.leaf[1] / 0.19)[:, None]
    return np.asarray(np.clip(tint, 0.004, 0.8))


__all__ = ["LEVELS", "SHRUBS", "SPECIES", "Species", "fine_tree", "tree"]


@dataclass(frozen=True, slots=True)
class _PlantDetail:
    """What a level of detail spends: leaves, and facets and steps of each bark order.

    Outer orders that would take more than `wood` triangles hide among the leaves.
    Shrubs are small, so they get half as many leaves.
    """

    leaves: int
    sides: tuple[int, ...]
    steps: tuple[int, ...]
    folded: bool
    wood: int
    flare: int = 0


_DETAILS = (
    _PlantDetail(21_000, (10, 5, 3, 3), (8, 5, 3, 1), True, 11_000, 16),
    _PlantDetail(8400, (8, 4, 3), (6, 4, 2), False, 4000, 10),
    _PlantDetail(3400, (6, 3), (5, 3), False, 900, 7),
    _PlantDetail(1750, (5, 3), (4, 2), False, 500),
    _PlantDetail(700, (3,), (3,), False, 100),
    _PlantDetail(240, (3,), (2,), False, 100),
)

LEVELS = len(_DETAILS)
"""Levels of detail: 0 within reach, 5 far."""

_USUAL = 1.8  # length of most leaves, by their width
_NEEDLE = 4.0  # leaves this many times longer than wide are needles

_KNOWN: Mapping[str, Species] = MappingProxyType({**SPECIES, **SHRUBS})


def tree(
    species: str,
    *,
    seed: int,
    level: int = 0,
    height: float | None = None,
    season: str = "summer",
) -> tuple[Part, ...]:
    """Grow a tree or a shrub; the same seed gives the same crown at every level of detail.

    Args:
        species: A key of `SPECIES` or `SHRUBS`.
        seed: Of its shape.
        level: 0 within reach (about 50,000 triangles), 1 near (11,000), 2 (4,000), 3 middle
            (2,000), 4 far (700), 5 farther (260); shrubs have half of that.
        height: [m]; default the species' usual one.
        season: `winter` leaves twigs instead of leaves; colours are summer's.

    Returns:
        Bark and foliage; the foot stands at the origin, 0.3 m deep in the ground.
    """
    kind, detail = _KNOWN[species], _DETAILS[level]
    orders = _skeleton(kind, np.random.default_rng(seed))
    grown = crown(kind, orders[2], orders[3])
    # Crowns grow as chance has it; the highest twig decides what one metre is.
    scale = (height or kind.height) / float(grown.bounds[1, 2])
    winter = bare(kind, season)
    grows = twiggy(kind) if winter else leafy(kind, season)
    # Needles are too narrow to be folded, so there may be twice as many.
    folded = detail.folded and grows.slender < _NEEDLE
    count = detail.leaves * (2 if detail.folded and not folded and not winter else 1)
    count //= 2 if species in SHRUBS else 1
    leaves, tint = foliage(
        grows, grown, leaves=count, folded=folded, rng=np.random.default_rng([seed, 1])
    )
    wood, colours = _wood(kind, orders, detail, np.random.default_rng([seed, 2]))
    return (
        Part(_scaled(wood, scale), "bark", colours),
        Part(_scaled(leaves, scale), "leaf", tint),
    )


_MOST_LEAVES = 220_000
_VARIED = 0.4  # by how much small leaves differ in brightness, beside what large ones do
_WOOD = ((0.05, 0), (0.10, 1), (np.inf, 2))  # up to which leaf [m] bark has which level of detail


def fine_tree(species: str, *, seed: int, leaf: float, season: str = "summer") -> tuple[Part, ...]:
    """Grow the same tree or shrub with leaves of a wanted size.

    Args:
        species: A key of `SPECIES` or `SHRUBS`.
        seed: Of its shape.
        leaf: Their mean length [m]; needles of the same area are longer. Crowns that would need
            more than 220,000 of them have larger ones.
        season: As of `tree`; not when the plant is bare.

    Returns:
        Bark and foliage, as of `tree`.
    """
    kind = _KNOWN[species]
    orders = _skeleton(kind, np.random.default_rng(seed))
    grown = crown(kind, orders[2], orders[3])
    scale = kind.height / float(grown.bounds[1, 2])
    grows = leafy(kind, season)
    count = fine_leaves(species, leaf=leaf, season=season)
    dice = np.random.default_rng([seed, 1])
    leaves, tint = foliage(grows, grown, leaves=count, folded=False, rng=dice, bent=HARDLY)
    # Old and young, dull and glossy leaves: each is seen by itself.
    tint = np.clip(tint * dice.uniform(1 - _VARIED, 1 + _VARIED, (len(tint), 1)), 0.004, 0.8)
    detail = _DETAILS[next(level for most, level in _WOOD if leaf <= most)]
    wood, colours = _wood(kind, orders, detail, np.random.default_rng([seed, 2]))
    return (
        Part(_scaled(wood, scale), "bark", colours),
        Part(_scaled(leaves, scale), "leaf", tint),
    )


def fine_leaves(species: str, *, leaf: float, season: str = "summer") -> int:
    """Return how many leaves `fine_tree` grows, each a triangle."""
    grows = leafy(_KNOWN[species], season)
    # Triangles of half length by width each, as slender as usual leaves are.
    each = 0.5 * leaf**2 / min(grows.slender, _USUAL)
    return int(np.clip(grows.area * grows.height**2 / each, 12, _MOST_LEAVES))


def _skeleton(kind: Species, rng: np.random.Generator) -> tuple[Branches, ...]:
    """Grow trunk, boughs, branches and twigs."""
    stem = trunk(
        kind.height,
        kind.girth * kind.height,
        rng=rng,
        top=kind.top,
        crooked=0.055 * kind.wobble,
    )
    orders = [stem, _boughs(kind, stem, rng)]
    for count, share_of in zip(kind.fork, (0.5, 0.5), strict=True):
        parent = orders[-1]
        at = np.linspace(0.25, 1.0, count)[None] + rng.normal(0, 0.04, (parent.count, count))
        grown = parent.lengths[:, None] * share_of * (1.25 - 0.7 * at)
        angles = rng.uniform(0.5, 1.05, at.shape)
        manner = Manner(kind.bend, kind.wobble, kind.flat)
        at = np.clip(at, 0.1, 1.0)
        orders.append(children(parent, at, grown, angles=angles, rng=rng, manner=manner))
    return tuple(orders)


def _boughs(kind: Species, stem: Branches, rng: np.random.Generator) -> Branches:
    """Grow what leaves the trunk: in a spiral, or in whorls one above the other."""
    number = np.arange(kind.boughs) // kind.whorl * kind.whorl + 0.5 * (kind.whorl - 1)
    share = (number + 0.5) / kind.boughs + rng.normal(0, 0.004, kind.boughs)
    share = np.clip(share, 0.0, 1.0)
    along = (kind.clear + (0.97 * kind.top - kind.clear) * share) / kind.top
    lengths = kind.reach * kind.height * np.interp(share, np.linspace(0, 1, 5), kind.crown)
    lengths = lengths * rng.uniform(0.8, 1.15, kind.boughs)
    angles = np.interp(share, (0, 1), kind.rise) + rng.normal(0, 0.1, kind.boughs)
    manner = Manner(kind.bend, kind.wobble, thick=kind.thick)
    return children(stem, along[None], lengths[None], angles=angles[None], rng=rng, manner=manner)


def _wood(
    kind: Species, orders: tuple[Branches, ...], detail: _PlantDetail, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Build the bark of trunk and branches, and tint each face."""
    each = [
        2 * order.count * n * m
        for order, n, m in zip(orders, detail.sides, detail.steps, strict=False)
    ]
    count = max(int((np.cumsum(each) <= detail.wood).sum()), 1)
    wood = bark(orders[:count], detail.sides[:count], detail.steps[:count])
    if detail.flare:
        foot = root_flare(kind.girth * kind.height, sides=detail.flare, rng=rng)
        wood = merge_meshes([wood, foot])
    height = wood.vertices[wood.faces].mean(axis=1)[:, 2] / kind.height
    colours = np.tile(np.array(kind.bark), (len(wood.faces), 1))
    if kind.upper_bark is not None:
        upper = np.clip((height - 0.25) / 0.25, 0.0, 1.0)[:, None]
        colours = colours * (1 - upper) + np.array(kind.upper_bark) * upper
    colours = colours * rng.uniform(0.85, 1.15, (len(colours), 1))
    # Moss and splashed soil darken the foot.
    colours *= np.clip(0.72 + 8.0 * height, 0.72, 1.0)[:, None]
    dark = rng.random(len(colours)) < kind.marks
    return wood, np.where(dark[:, None], 0.5 * colours, colours)


def _scaled(mesh: Mesh, scale: float) -> Mesh:
    """Enlarge a mesh about the origin."""
    return Mesh(mesh.vertices * scale, mesh.faces, mesh.normals)
