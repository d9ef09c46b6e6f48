"""Leaves on twigs as real triangles, their normals and tints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.plants.branches import Branches
from sumo3dviz_pt.library.plants.species import Species
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.model.vectors import area_vectors, areas, unit

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


def foliage(
    kind: Species, grown: Crown, *, leaves: int, folded: bool, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """Grow leaves along the twigs, and tint each face.

    Their total area and bounds do not depend on their number: fewer leaves are larger.

    Args:
        kind: The species.
        grown: What they grow on.
        leaves: Their number, >= 12.
        folded: True gives diamonds of two triangles, False single triangles.
        rng: Places and turns them.
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
    normals = _soft_normals(mesh, grown, np.repeat(twig, len(mesh.vertices) // leaves))
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


def _soft_normals(mesh: Mesh, grown: Crown, twig: Ints) -> Floats:
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
    return unit(0.5 * normals + 0.5 * outward)


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
