"""Bodies of buses, trucks and trains: rounded outlines in plan, stacked in height."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.solids import by_material, shaded
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh

MaterialMesh = tuple[str, Mesh]
"""Material and mesh."""


@dataclass(frozen=True, slots=True)
class StackLevel:
    """One outline of a stack and what the band above it is made of.

    Attributes:
        z: Height [m].
        front: x of the front end [m].
        rear: x of the rear end, below `front` [m].
        half: Half width [m].
        side: Material of the band above along the sides.
        ends: Material of the band above at the front; the rear where `rear_end` is empty.
        rear_end: Material of the band above at the rear.
        pillar: Material of the band above in the narrow columns of the sides.
    """

    z: float
    front: float
    rear: float
    half: float
    side: str = "paint"
    ends: str = ""
    rear_end: str = ""
    pillar: str = ""


def stack(
    levels: Sequence[StackLevel], *, radius: float, segments: int, windows: Sequence[float] = ()
) -> list[MaterialMesh]:
    """Loft a body through outlines and close it at the top and bottom.

    Args:
        levels: From the ground up, at least two.
        radius: Of the vertical edges [m].
        segments: Facets per vertical edge, at least 1.
        windows: Middles of the pillars along the sides as shares of the length, (0, 1).

    Returns:
        One mesh for each material.
    """
    plan, kinds = _plan(levels[0], radius, segments, windows)
    rings = np.concatenate([_placed(plan, level, radius) for level in levels])
    count = len(plan)
    band, k = np.meshgrid(np.arange(len(levels) - 1), np.arange(count), indexing="ij")
    a, b = band * count + k, band * count + (k + 1) % count
    quads = np.stack([a, b, b + count, a + count], axis=-1).reshape(-1, 4)
    names = [_material(levels[i], kind) for i in range(len(levels) - 1) for kind in kinds]
    fan = np.array([(0, j + 1, j) for j in range(1, count - 1)])
    lid = fan[:, ::-1] + count * (len(levels) - 1)
    faces = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]], fan, lid])
    owners = [*names, *names, *["trim"] * len(fan), *[levels[-1].side] * len(lid)]
    return _split(rings, faces, owners)


def _split(vertices: Floats, faces: Ints, owners: Sequence[str]) -> list[MaterialMesh]:
    """Shade faces together, then part them by material."""
    pieces = []
    names = np.array(owners)
    for name in sorted(set(owners)):
        pieces.append((name, shaded(vertices, faces[names == name], crease=0.75)))
    return list(by_material(pieces).items())


def _material(level: StackLevel, kind: str) -> str:
    """Return the material of one column of the band above a level."""
    choice = {
        "front": level.ends or level.side,
        "rear": level.rear_end or level.ends or level.side,
        "pillar": level.pillar or level.side,
    }
    return choice.get(kind, level.side)


def _plan(
    level: StackLevel, radius: float, segments: int, windows: Sequence[float]
) -> tuple[Floats, list[str]]:
    """Return the outline in shares, (n, 4): along, across, corner x and y; and its sides' kinds.

    It starts at the front's left corner, runs along the left side to the rear, and
    comes back along the right side.
    """
    length = level.front - level.rear
    turn = np.linspace(0.0, np.pi / 2, segments + 1)
    corner = [(0.0, 1.0, np.cos(t) - 1.0, np.sin(t) - 1.0) for t in turn]
    pillar = 0.045 / length
    side = [(share, 1.0, 0.0, 0.0) for w in windows for share in (w - pillar, w + pillar)]
    back = [(1.0, 1.0, 1.0 - np.sin(t), np.cos(t) - 1.0) for t in turn]
    left = [*corner, *side, *back]
    right = [(along, -1.0, x, -y) for along, _, x, y in reversed(left)]
    front = ["front"] * segments
    columns = ["side"] + [kind for _ in windows for kind in ("pillar", "side")]
    rear = ["rear"] * segments
    half = [*front, *columns, *rear]
    return np.array([*left, *right]), [*half, "rear", *half[::-1], "front"]


def _placed(plan: Floats, level: StackLevel, radius: float) -> Floats:
    """Place the outline at one level, (n, 3) [m]."""
    x = level.front - plan[:, 0] * (level.front - level.rear) + radius * plan[:, 2]
    y = plan[:, 1] * level.half + radius * plan[:, 3]
    return np.stack([x, y, np.full_like(x, level.z)], axis=1)
