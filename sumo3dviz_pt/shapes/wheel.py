"""Wheels: tyre, rim with spokes or a disc, and darkness behind."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sumo3dviz_pt.model.geometry import Mesh, merge_meshes
from sumo3dviz_pt.shapes.car_recipe import WheelRecipe
from sumo3dviz_pt.shapes.solids import lathe, shaded

_SEGMENTS = 28


def build_wheel(recipe: WheelRecipe) -> Mapping[str, Mesh]:
    """A wheel around the y axis with its outer face towards +y.

    Returns:
        Meshes by material, centred on the axle.
    """
    return {"rubber": _tyre(recipe), "rim": _rim(recipe), "trim": _inside(recipe)}


def well_shell(radius: float, span: tuple[float, float], *, lowest: float) -> Mesh:
    """The inside of a wheel well above the axle: an arch and a wall behind it.

    Args:
        radius: Of the arch [m].
        span: y of the wall and of the open end [m].
        lowest: Where the arch ends, above the axle [m].
    """
    begin = float(np.arcsin(lowest / radius))
    turn = np.linspace(begin, np.pi - begin, 17)
    x, z = radius * np.cos(turn), radius * np.sin(turn)
    arch = [np.stack([x, np.full_like(x, y), z], axis=1) for y in span]
    vertices = np.concatenate(arch)
    a = np.arange(16)
    quads = [(a, a + 1, a + 18), (a, a + 18, a + 17)]
    wall = np.stack([np.zeros(15, dtype=int), a[1:] + 1, a[1:]], axis=1)
    faces = np.concatenate([np.stack(q, axis=1) for q in quads] + [wall])
    return shaded(vertices, faces, crease=0.5)


def _tyre(recipe: WheelRecipe) -> Mesh:
    """Tread and side walls."""
    r, w, rim = recipe.radius, recipe.width / 2.0, recipe.radius * recipe.rim
    wall = r - rim
    profile = [
        (rim - 0.03, -0.85 * w),
        (rim + 0.3 * wall, -w),
        (r - 0.25 * wall, -0.98 * w),
        (r, -0.78 * w),
        (r, 0.78 * w),
        (r - 0.25 * wall, 0.98 * w),
        (rim + 0.3 * wall, w),
        (rim, 0.90 * w),
        (rim, 0.78 * w),
    ]
    return lathe(profile, segments=_SEGMENTS, crease=0.75)


def _inside(recipe: WheelRecipe) -> Mesh:
    """A dark disc behind the spokes and one that closes the wheel's back."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    front = lathe([(rim - 0.012, 0.25 * w), (0.0, 0.25 * w)], segments=_SEGMENTS)
    back = lathe([(0.0, -0.85 * w), (rim - 0.02, -0.85 * w)], segments=_SEGMENTS // 2)
    return merge_meshes([front, back])


def _rim(recipe: WheelRecipe) -> Mesh:
    """Lip, barrel, hub and spokes, or a disc."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    lip = lathe(
        [
            (rim + 0.006, 0.88 * w),
            (rim + 0.004, 0.93 * w),
            (rim - 0.014, 0.90 * w),
            (rim - 0.022, 0.70 * w),
            (rim - 0.030, 0.25 * w),
        ],
        segments=_SEGMENTS,
        crease=0.9,
    )
    if recipe.spokes == 0:
        disc = [
            (rim - 0.012, 0.80 * w),
            (0.80 * rim, 0.62 * w),
            (0.62 * rim, 0.74 * w),
            (0.30 * rim, 0.70 * w),
            (0.24 * rim, 0.90 * w),
            (0.0, 0.92 * w),
        ]
        return merge_meshes([lip, lathe(disc, segments=_SEGMENTS, crease=0.5)])
    hub = lathe(
        [
            (0.075, 0.45 * w),
            (0.072, 0.66 * w),
            (0.034, 0.72 * w),
            (0.030, 0.78 * w),
            (0.0, 0.80 * w),
        ],
        segments=14,
        crease=0.5,
    )
    turns = 2.0 * np.pi * np.arange(recipe.spokes) / recipe.spokes
    return merge_meshes([lip, hub, *(_spoke(recipe, turn) for turn in turns)])


def _spoke(recipe: WheelRecipe, turn: float) -> Mesh:
    """A bar with bevelled edges from the hub to the rim."""
    rim, w = recipe.radius * recipe.rim, recipe.width / 2.0
    radii = np.array([0.045, 0.5 * rim, rim - 0.012])
    face = w * np.array([0.70, 0.66, 0.84])
    wide = 0.5 * recipe.spoke_width * np.array([0.72, 0.78, 1.0])
    # Across the spoke: back edge, bevel, flat face, bevel, back edge.
    across = np.array([-1.0, -1.0, -0.66, 0.66, 1.0, 1.0])
    depth = np.array([-0.40 * w, -0.012, 0.0, 0.0, -0.012, -0.40 * w])
    x = across[None, :] * wide[:, None]
    y = face[:, None] + depth[None, :]
    r = np.broadcast_to(radii[:, None], x.shape)
    c, s = np.cos(turn), np.sin(turn)
    vertices = np.stack([r * s + x * c, y, r * c - x * s], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(2), np.arange(5), indexing="ij")
    a = (i * 6 + j).reshape(-1)
    faces = np.concatenate([np.stack([a, a + 7, a + 1], 1), np.stack([a, a + 6, a + 7], 1)])
    return shaded(vertices, faces, crease=0.5)
