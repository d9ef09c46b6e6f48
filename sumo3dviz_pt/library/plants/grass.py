"""Blades of grass as triangles, from patches that are made once and laid out many times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes

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
