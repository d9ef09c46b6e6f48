"""Grass, clipped hedges and far woods.

Blades of grass are triangles, from patches that are made once and laid out many times. Box hedges
have a dark core whose faces are strewn with leaves. Far trees and groves have a dark core in a
cloud of tufts, with a tree's ragged outline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.bands import between, mitres
from sumo3dviz_pt.library.plants.leaves import some_leaves
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes, settled, unit
from sumo3dviz_pt.model.scene import Part

PATCH = 2.0
"""Width of a patch [m]."""

PATCH_BLADES = 2600
"""Blades of a whole patch; its first n are spread as evenly as all of them."""


@dataclass(frozen=True, slots=True, eq=False)
class Blades:
    """Blades of grass.

    Attributes:
        feet: (n, 3) [m].
        turns: Directions that they lean to, (n,) [rad].
        heights: (n,) [m].
        widths: At the foot, (n,) [m].
        leans: Sideways reach of the tip by the height, (n,).
        tints: Reflectance, (n, 3); of a patch: factors on it.
    """

    feet: Floats
    turns: Floats
    heights: Floats
    widths: Floats
    leans: Floats
    tints: Floats


def grass_patch(variant: int) -> Blades:
    """Grow a patch of meadow around the origin: tufts, stalks and gaps.

    Args:
        variant: Number of the patch; its seed.
    """
    rng = np.random.default_rng([71, variant])
    count = PATCH_BLADES
    # Blades of one tuft share its foot, height and colour, about.
    tufts = 260
    tuft = rng.integers(0, tufts, count)
    centre = rng.uniform(-0.5, 0.5, (tufts, 2)) * PATCH
    feet = centre[tuft] + rng.normal(0, 0.045, (count, 2))
    loose = rng.random(count) < 0.45
    feet[loose] = rng.uniform(-0.5, 0.5, (int(loose.sum()), 2)) * PATCH
    feet = (feet + 0.5 * PATCH) % PATCH - 0.5 * PATCH
    heights = 0.085 * rng.uniform(0.6, 1.4, tufts)[tuft] * rng.uniform(0.55, 1.35, count)
    value = rng.uniform(0.85, 1.15, tufts)[tuft] * rng.uniform(0.8, 1.2, count)
    tints = value[:, None] * np.ones(3)
    dry = rng.random(count) < 0.07
    tints[dry] *= [1.4, 1.2, 1.2]
    return Blades(
        np.column_stack([feet, np.zeros(count)]),
        rng.uniform(0, 2 * np.pi, count),
        heights,
        rng.uniform(0.006, 0.012, count),
        rng.uniform(0.15, 0.95, count),
        tints,
    )


def laid(patch: Blades, count: int, *, place: Floats, quarter: int, coarse: float) -> Blades:
    """Lay the first blades of a patch out at a place.

    Args:
        patch: Around the origin.
        count: How many.
        place: Its middle, (2,) [m].
        quarter: Quarter turns.
        coarse: How much wider blades are, because there are fewer.
    """
    c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarter % 4]
    some = slice(0, count)
    turned = patch.feet[some, :2] @ np.array([[c, s], [-s, c]], dtype=np.float64)
    return Blades(
        np.column_stack([turned + place, np.zeros(len(turned))]),
        patch.turns[some] + 0.5 * np.pi * quarter,
        patch.heights[some] * coarse**0.25,
        patch.widths[some] * coarse,
        patch.leans[some],
        patch.tints[some],
    )


def blades_mesh(blades: Blades, *, fine: bool) -> tuple[Mesh, Floats]:
    """Build blades as triangles, and tint each face, (m, 3).

    Args:
        blades: In the world.
        fine: True gives three triangles a blade, bent; False one.
    """
    if not len(blades.feet):
        return merge_meshes([]), np.zeros((0, 3))
    way = np.column_stack([np.cos(blades.turns), np.sin(blades.turns), 0 * blades.turns])
    side = np.column_stack([-way[:, 1], way[:, 0], way[:, 2]]) * 0.5 * blades.widths[:, None]
    tall = blades.heights[:, None]
    lean = blades.leans[:, None] * tall * way
    up = np.array([0.0, 0.0, 1.0])
    foot = blades.feet - 0.012 * up
    tip = foot + lean + tall * (1.0 - 0.28 * blades.leans[:, None]) * up
    if not fine:
        corners, faces = [foot - side, foot + side, tip], [[0, 1, 2]]
    else:
        middle = foot + 0.32 * lean + 0.6 * tall * up
        corners = [foot - side, foot + side, middle - 0.75 * side, middle + 0.75 * side, tip]
        faces = [[0, 1, 2], [1, 3, 2], [2, 3, 4]]
    each = len(corners)
    index = each * np.arange(len(foot))[:, None, None] + np.array(faces)
    # Lawn as a whole is lit like the ground below it, so normals look up.
    normal = 0.85 * up + 0.3 * way
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    mesh = Mesh(
        np.stack(corners, axis=1).reshape(-1, 3),
        index.reshape(-1, 3),
        np.repeat(normal, each, axis=0),
    )
    return mesh, np.repeat(np.clip(blades.tints, 0.004, 0.8), len(faces), axis=0)


LEAVES_PER_METRE = (1000, 270, 70, 14)
"""Leaves on a metre of hedge at each level of detail."""

LEAF = (0.094, 0.150, 0.042)
"""Reflectance of hornbeam and privet leaves."""

_HEDGE_CORE = (0.036, 0.054, 0.020)
_COVER = 1.15  # leaf area by face area
_INSET = 0.05  # how far the core lies inside the clipped faces [m]
_SINK = 0.15  # how deep the core stands in the ground [m]


@dataclass(frozen=True, slots=True)
class HedgeSize:
    """A hedge's cross-section.

    Attributes:
        width: [m].
        height: [m].
    """

    width: float = 0.8
    height: float = 1.35


def hedge(
    line: Floats, size: HedgeSize, *, level: int, rng: np.random.Generator
) -> tuple[Part, ...]:
    """Grow a piece of hedge along a line.

    Args:
        line: Its foot's middle, (n, 3) [m], n >= 2.
        size: Its cross-section.
        level: 0 near (40,000 triangles for 40 m), 1 (11,000), 2 (2,900), 3 far (700).
        rng: Places leaves.

    Returns:
        Core and leaves.
    """
    core = _core(line, size)
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    leaves = max(int(LEAVES_PER_METRE[level] * length), 8)
    strewn, tint = _leaves(line, size, leaves, rng)
    return (
        Part(core, "bark", np.tile(_HEDGE_CORE, (len(core.faces), 1))),
        Part(strewn, "leaf", tint),
    )


def _core(line: Floats, size: HedgeSize) -> Mesh:
    """Build a closed box along the line."""
    half, top = 0.5 * size.width - _INSET, size.height - _INSET
    across = np.column_stack([mitres(line), np.zeros(len(line))])
    up = np.array([0.0, 0.0, 1.0])
    low, high = line - _SINK * up, line + top * up
    corners = [low + half * across, high + half * across, high - half * across, low - half * across]
    count = len(line)
    points = np.concatenate(corners)
    sides = [between(corners[k], corners[(k + 1) % 4]).faces for k in range(4)]
    index = np.arange(4) * count
    faces = []
    for k, side in enumerate(sides):
        other = index[(k + 1) % 4]
        faces.append(np.where(side < count, side + index[k], side - count + other))
    first, last = index, index + count - 1
    caps = [first[[2, 1, 0]], first[[3, 2, 0]], last[[0, 1, 2]], last[[0, 2, 3]]]
    return Mesh(points, np.concatenate([*faces, np.array(caps)]))


def _leaves(
    line: Floats, size: HedgeSize, count: int, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Strew leaves on sides and top, and tint them."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    at = rng.uniform(0.0, steps.sum(), count)
    arc = np.append(0.0, np.cumsum(steps))
    foot = np.stack([np.interp(at, arc, column) for column in line.T], axis=1)
    left = np.column_stack([mitres(line), np.zeros(len(line))])
    across = np.stack([np.interp(at, arc, column) for column in left.T], axis=1)
    place, normal = _around(size, count, rng)
    up = np.array([0.0, 0.0, 1.0])
    centre = foot + place[:, :1] * across + place[:, 1:] * up
    outward = normal[:, :1] * across + normal[:, 1:] * up
    # A clipped face is not smooth: it swells and a few shoots have grown since.
    swell = 0.03 * np.sin(1.9 * at + 3.0 * place[:, 1]) + rng.normal(0, 0.03, count)
    shoots = np.where(rng.random(count) < 0.03, rng.uniform(0, 0.12, count), 0.0)
    centre = centre + (swell + shoots)[:, None] * outward
    area = _COVER * float(steps.sum()) * (2 * size.height + size.width) / count
    edge = np.sqrt(2.0 * area) * rng.uniform(0.75, 1.25, count)[:, None]
    axis = unit(rng.normal(0, 1.0, (count, 3)) + 0.5 * outward + 0.3 * up)
    side = unit(np.cross(axis, outward + 0.8 * rng.normal(0, 1.0, (count, 3))))
    corners = np.stack(
        [
            centre - 0.6 * edge * axis - 0.42 * edge * side,
            centre - 0.6 * edge * axis + 0.42 * edge * side,
            centre + 0.6 * edge * axis,
        ],
        axis=1,
    )
    flat = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    flat *= np.where((flat * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    normals = np.repeat(unit(0.6 * flat + 0.4 * outward), 3, axis=0)
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3), normals)
    return mesh, _tints(place[:, 1] / size.height, at, rng)


def _around(size: HedgeSize, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw places on the cross-section's outline and normals there, (n, 2) each: across, up."""
    half, height = 0.5 * size.width, size.height
    where = rng.uniform(0.0, 2 * height + size.width, count)
    left, right = where < height, where > height + size.width
    place = np.column_stack([where - height - half, np.full(count, height)])
    place[left] = np.column_stack([np.full(left.sum(), -half), where[left]])
    place[right] = np.column_stack([np.full(right.sum(), half), where[right] - height - 2 * half])
    normal = np.column_stack([right.astype(float) - left, ~(left | right)])
    return place, normal


def _tints(share: Floats, at: Floats, rng: np.random.Generator) -> Floats:
    """Draw the reflectance of each leaf, (n, 3): darker at the foot, varied along the hedge."""
    plants = 1.0 + 0.12 * np.sin(1.3 * at + rng.uniform(0, 6.0)) * np.sin(0.37 * at)
    value = rng.uniform(0.7, 1.3, len(share)) * plants * (0.7 + 0.35 * share)
    young = (rng.random(len(share)) ** 4)[:, None] * [0.035, 0.030, 0.004]
    return np.clip(np.array(LEAF) * value[:, None] + young, 0.004, 0.8)


_SIDES = 5
CORE_FACES = 3 * _SIDES
"""Triangles of a core; each tuft has one more."""

_WOODS_CORE = 0.78  # size of the core by that of the crown
_AWAY = 0.25  # cosine between an eye and the back of a tuft that is still seen at the outline
_MOST_EYES = 8  # of a shot that tell which tufts are seen


@dataclass(frozen=True, slots=True, eq=False)
class FarTrees:
    """Trees, or groves of many, far away.

    Attributes:
        feet: (n, 3) [m].
        widths: (n,) [m].
        heights: (n,) [m].
        cones: 1 for conifers, 0 for round crowns, (n,).
        tints: Reflectance of their leaves, (n, 3).
    """

    feet: Floats
    widths: Floats
    heights: Floats
    cones: Floats
    tints: Floats


def far_trees(
    trees: FarTrees, *, tufts: int, rng: np.random.Generator, eyes: Floats | None = None
) -> tuple[Mesh, Floats]:
    """Build far trees as one mesh, and tint each face, (m, 3).

    Args:
        trees: Where and how large.
        tufts: Triangles of the cloud around each core.
        rng: Places them.
        eyes: All cameras, (k, 3) [m]: tufts on the sides that none of them sees are left out.
            None keeps all.
    """
    count = len(trees.feet)
    if not count:
        return merge_meshes([]), np.zeros((0, 3))
    cores, cloud = _cores(trees, rng), _tufts(trees, tufts, rng)
    shade = rng.uniform(0.72, 1.22, (count, tufts, 1))
    bright = (trees.tints[:, None] * shade).reshape(-1, 3)
    if eyes is not None:
        seen = _seen(trees, cloud, eyes)
        cloud, bright = some_leaves(cloud, seen), bright[seen]
    dark = np.repeat(0.62 * trees.tints, CORE_FACES, axis=0)
    tint = np.clip(np.concatenate([dark, bright]), 0.004, 0.8)
    return merge_meshes([cores, cloud]), tint


def _seen(trees: FarTrees, cloud: Mesh, eyes: Floats) -> Bools:
    """Return which tufts do not look away from all eyes, (n,)."""
    assert cloud.normals is not None
    out = cloud.normals[::3].reshape(len(trees.feet), -1, 3)
    facing = np.full(out.shape[:2], -1.0)
    for eye in eyes[:: max(1, -(-len(eyes) // _MOST_EYES))]:
        towards = unit(eye - trees.feet)
        facing = np.maximum(facing, (out * towards[:, None]).sum(axis=-1))
    return np.asarray(settled(facing + _AWAY) > 0.0).ravel()


def _radius(level: Floats, cones: Floats) -> Floats:
    """Return the radius of crowns at heights in [0, 1], by their largest."""
    round_ = np.sqrt(np.clip(1.0 - ((level - 0.52) / 0.52) ** 2, 0.0, 1.0))
    # Low branches and undergrowth fill the foot of a wood's edge.
    round_ = np.where(level < 0.52, np.maximum(round_, 0.82 - 0.2 * level), round_)
    return np.asarray(np.where(cones > 0.5, 1.0 - level, round_))


def _cores(trees: FarTrees, rng: np.random.Generator) -> Mesh:
    """Build domes inside the crowns, which stop the eye from looking through."""
    count = len(trees.feet)
    turn = 2 * np.pi * (np.arange(_SIDES) + rng.random((count, 1))) / _SIDES
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    rings = []
    for level in (0.0, 0.5):
        radius = _WOODS_CORE * 0.5 * trees.widths * _radius(np.full(count, level), trees.cones)
        radius = radius[:, None] * rng.uniform(0.85, 1.1, (count, _SIDES))
        up = np.broadcast_to((_WOODS_CORE * level * trees.heights)[:, None], radius.shape)
        rings.append(np.concatenate([radius[..., None] * circle, up[..., None]], axis=2))
    apex = np.zeros((count, 1, 3))
    apex[:, 0, 2] = 0.88 * trees.heights
    vertices = trees.feet[:, None] + np.concatenate([*rings, apex], axis=1)
    a = np.arange(_SIDES)
    b = (a + 1) % _SIDES
    low, high, top = a, a + _SIDES, np.full(_SIDES, 2 * _SIDES)
    one = np.concatenate(
        [
            np.stack([low, b, b + _SIDES], -1),
            np.stack([low, b + _SIDES, high], -1),
            np.stack([high, b + _SIDES, top], -1),
        ]
    )
    faces = (2 * _SIDES + 1) * np.arange(count)[:, None, None] + one
    outward = vertices - trees.feet[:, None] - [0, 0, 1] * (0.3 * trees.heights)[:, None, None]
    normals = outward / np.linalg.norm(outward, axis=2, keepdims=True)
    return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), normals.reshape(-1, 3))


def _tufts(trees: FarTrees, tufts: int, rng: np.random.Generator) -> Mesh:
    """Build single triangles on the crowns' surfaces."""
    shape = (len(trees.feet), tufts)
    turn = rng.uniform(0, 2 * np.pi, shape)
    level = rng.uniform(0.0, 1.0, shape) ** 0.85
    half, heights = 0.5 * trees.widths[:, None], trees.heights[:, None]
    # Boughs bear clumps of their own: the crown swells here and has gaps there.
    phase = rng.uniform(0, 6.3, (shape[0], 3))[:, None]
    lobes = 1.0 + 0.2 * np.sin(2 * turn + phase[..., 0] + 4.0 * level)
    lobes += 0.17 * np.sin(5 * turn + phase[..., 1]) * np.sin(11.0 * level + phase[..., 2])
    lobes = np.where(trees.cones[:, None] > 0.5, 0.5 + 0.5 * lobes, lobes)
    radius = _radius(level, trees.cones[:, None]) * lobes * rng.uniform(0.82, 1.02, shape)
    flat = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    out = np.concatenate([flat * (0.25 + radius)[..., None], (1.5 * (level - 0.4))[..., None]], 2)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    up = (0.97 * level * heights)[..., None]
    centre = trees.feet[:, None] + np.concatenate([(radius * half)[..., None] * flat, up], axis=-1)
    # As large as needed to cover the crown's surface about once.
    size = np.sqrt(4.2 * half * heights / tufts) * rng.uniform(0.7, 1.3, shape)
    axis = rng.normal(0, 1.0, (*shape, 3))
    axis -= 0.8 * (axis * out).sum(axis=-1, keepdims=True) * out
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    side = np.cross(out, axis)
    side /= np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-9)
    long, wide = 0.62 * size[..., None] * axis, 0.5 * size[..., None] * side
    corners = np.stack([centre - 0.5 * long - wide, centre - 0.5 * long + wide, centre + long], 2)
    normals = np.repeat(out.reshape(-1, 3), 3, axis=0)
    count = shape[0] * tufts
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3), normals)
