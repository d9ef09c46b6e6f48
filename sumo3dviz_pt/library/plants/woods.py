"""Far trees and groves: a dark core in a cloud of tufts, with a tree's ragged outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.plants.clumps import some_leaves
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes, settled
from sumo3dviz_pt.model.vectors import unit

_SIDES = 5
CORE_FACES = 3 * _SIDES
"""Triangles of a core; each tuft has one more."""

_CORE = 0.78  # size of the core by that of the crown
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
        radius = _CORE * 0.5 * trees.widths * _radius(np.full(count, level), trees.cones)
        radius = radius[:, None] * rng.uniform(0.85, 1.1, (count, _SIDES))
        up = np.broadcast_to((_CORE * level * trees.heights)[:, None], radius.shape)
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
