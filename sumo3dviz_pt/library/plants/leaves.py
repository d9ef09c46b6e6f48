"""Real outlines for leaves near an eye: each card of foliage becomes a twig of small ones.

Cards stand for many leaves. From near they would show as such, so those within reach are
exchanged for leaves as large as real ones, of the same area, colour and light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.vectors import unit

LEAF = 0.085
"""Length of a leaf [m]."""

OUTLINE = 12.0
"""Up to this distance leaves have an outline of six triangles, beyond they are diamonds [m]."""

_SHARP = 10.0  # from this distance on leaves grow with it, as pixels do [m]
_MOST = 14  # leaves of one card
_NEEDLE = 3.2  # cards this many times longer than wide bear needles
_ASIDE = 0.62  # how far leaves lie from their twig, by half the card's width

_HALF_WIDTH = 0.39  # of a leaf, by its length

# Half outlines from stalk to tip: along and across, by a leaf's length and half width.
_OVATE = np.array([[-0.5, 0.0], [-0.33, 0.78], [-0.02, 1.0], [0.27, 0.62], [0.5, 0.0]])
_DIAMOND = np.array([[-0.5, 0.0], [-0.05, 1.0], [0.5, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Cards:
    """Cards of a crown.

    Attributes:
        centres: (n, 3) [m].
        along: From stalk to tip, (n, 3) [m].
        across: From side to side, (n, 3) [m].
        areas: (n,) [m2].
        normals: That light sees, (n, 3).
        tints: (n, 3).
        each: Triangles of a card: 1, or 2 for folded ones.
    """

    centres: Floats
    along: Floats
    across: Floats
    areas: Floats
    normals: Floats
    tints: Floats
    each: int


def cards_of(mesh: Mesh, tint: Floats) -> Cards:
    """Find the cards in foliage as `foliage.foliage` makes it.

    Args:
        mesh: Triangles of their own corners, or diamonds of four corners and two triangles.
        tint: Of each face, (m, 3).
    """
    each = 2 if len(mesh.vertices) == 2 * len(mesh.faces) else 1
    corners = mesh.vertices.reshape(-1, 2 + each, 3)
    if each == 2:
        along, across = corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 3]
    else:
        along = corners[:, 2] - 0.5 * (corners[:, 0] + corners[:, 1])
        across = corners[:, 1] - corners[:, 0]
    areas = 0.5 * np.linalg.norm(np.cross(along, across), axis=1)
    normals = np.zeros_like(mesh.vertices) if mesh.normals is None else mesh.normals
    light = normals.reshape(-1, 2 + each, 3).mean(axis=1)
    return Cards(corners.mean(axis=1), along, across, areas, light, tint[::each], each)


def wanted(cards: Cards, away: Floats) -> Ints:
    """Count the leaves that each card should be for an eye at a distance, (n,); 0 keeps the card.

    Args:
        cards: The cards.
        away: Distances, (n,) [m].
    """
    size = LEAF * np.maximum(away / _SHARP, 1.0)
    count = np.clip(np.round(cards.areas / (0.5 * size**2)), 1, _MOST)
    long, wide = np.linalg.norm(cards.along, axis=1), np.linalg.norm(cards.across, axis=1)
    coarse = (count > 1) | (away < OUTLINE)
    return np.where(coarse & (long < _NEEDLE * wide), count, 0).astype(np.int64)


def triangles(counts: Ints, away: Floats) -> Ints:
    """Count the triangles of cards that become leaves, (n,)."""
    return np.asarray(counts * np.where(away < OUTLINE, 6, 2))


def with_leaves(
    mesh: Mesh, tint: Floats, counts: Ints, *, outlined: Bools, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Exchange some cards of foliage for leaves.

    Args:
        mesh: As for `cards_of`.
        tint: Of each face, (m, 3).
        counts: Leaves of each card, (n,); 0 keeps the card.
        outlined: Which cards get leaves with a full outline, (n,).
        rng: Places and turns them.
    """
    cards = cards_of(mesh, tint)
    kept = np.repeat(counts == 0, cards.each)
    used, faces = np.unique(mesh.faces[kept], return_inverse=True)
    normals = None if mesh.normals is None else mesh.normals[used]
    meshes = [Mesh(mesh.vertices[used], faces.reshape(-1, 3), normals)]
    tints = [tint[kept]]
    for half, some in ((_OVATE, outlined), (_DIAMOND, ~outlined)):
        which = np.repeat(np.flatnonzero(some), counts[some])
        if not len(which):
            continue
        made = _leaves(cards, which, counts, half, rng)
        meshes.append(made)
        value = rng.uniform(0.86, 1.14, (len(which), 1))
        per_leaf = len(made.faces) // len(which)
        tints.append(np.repeat(np.clip(cards.tints[which] * value, 0.004, 0.8), per_leaf, axis=0))
    return merge_meshes(meshes), np.concatenate(tints)


def _leaves(
    cards: Cards, which: Ints, counts: Ints, half: Floats, rng: np.random.Generator
) -> Mesh:
    """Build leaves on both sides of their cards' middles; together as large as the card."""
    total = len(which)
    along, across = cards.along[which], cards.across[which]
    long = np.linalg.norm(along, axis=1, keepdims=True)
    wide = np.linalg.norm(across, axis=1, keepdims=True)
    share = rng.uniform(-0.5, 0.5, (total, 1))
    side = np.where(rng.random((total, 1)) < 0.5, -1.0, 1.0)
    ahead = rng.uniform(0.1, 1.0, (total, 1)) * along / np.maximum(long, 1e-9)
    aside = rng.uniform(0.3, 1.0, (total, 1)) * side * across / np.maximum(wide, 1e-9)
    axis = unit(unit(ahead + aside) + rng.normal(0, 0.38, (total, 3)))
    up = unit(cards.normals[which] + rng.normal(0, 0.45, (total, 3)))
    flat = unit(np.cross(axis, up))
    # Area of an outline by its squared length.
    fill = 2.0 * _HALF_WIDTH * float(np.trapezoid(half[:, 1], half[:, 0]))
    size = np.sqrt(cards.areas[which] / counts[which] / fill) * rng.uniform(0.8, 1.2, total)
    twig = (counts[which] > 1)[:, None]
    centre = cards.centres[which] + twig * (share * along + 0.5 * _ASIDE * side * across)
    centre = centre + twig * rng.normal(0, 0.2, (total, 3)) * wide
    tall, broad = size[:, None] * axis, _HALF_WIDTH * size[:, None] * flat
    fold = 0.16 * size[:, None] * up
    rim = [centre + u * tall + s * v * broad + v * fold for s, u, v in _rim(half)]
    corners = np.stack(rim, axis=1)
    n, mid = len(rim), len(half) - 1
    rib = [[0, k, k + 1] for k in range(1, mid)]
    other = [0, *range(n - 1, mid - 1, -1)]
    faces = rib + [[other[0], other[k + 1], other[k]] for k in range(1, len(other) - 1)]
    index = n * np.arange(total)[:, None, None] + np.array(faces)
    light = unit(0.55 * up + 0.45 * cards.normals[which])
    return Mesh(corners.reshape(-1, 3), index.reshape(-1, 3), np.repeat(light, n, axis=0))


def _rim(half: Floats) -> list[tuple[float, float, float]]:
    """Return side, along and across of all corners: from the stalk over one side, the tip, back."""
    first = [(1.0, float(u), float(v)) for u, v in half]
    return first + [(-1.0, float(u), float(v)) for u, v in half[-2:0:-1]]
