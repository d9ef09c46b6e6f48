"""Clipped box hedges: a dark core whose faces are strewn with leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.polyline import mitres
from sumo3dviz_pt.library.mesh.walls import between
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.vectors import unit

LEAVES_PER_METRE = (1000, 270, 70, 14)
"""Leaves on a metre of hedge at each level of detail."""

LEAF = (0.094, 0.150, 0.042)
"""Reflectance of hornbeam and privet leaves."""

_CORE = (0.036, 0.054, 0.020)
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
        Part(core, "bark", np.tile(_CORE, (len(core.faces), 1))),
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
