"""Strips of quads along rings and lines: walls, verges, flat bands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes


def between(top: Floats, bottom: Floats, *, closed: bool = False) -> Mesh:
    """Build quads from one polyline to another.

    Seen with the polyline running to the right and `top` above `bottom`, the quads
    face the viewer.

    Args:
        top: (n, 3) [m].
        bottom: (n, 3) [m].
        closed: Whether the last vertices join the first ones.
    """
    count = len(top)
    start = np.arange(count if closed else count - 1)
    end = (start + 1) % count
    faces = np.concatenate(
        [
            np.stack([start + count, end + count, end], axis=1),
            np.stack([start + count, end, start], axis=1),
        ]
    )
    return Mesh(np.concatenate([top, bottom]), faces)


def walls(rings: Sequence[Floats], bottoms: Sequence[Floats]) -> Mesh:
    """Build walls around rings that run counter-clockwise around what they enclose.

    Args:
        rings: Upper edges, each (n, 3) [m], first vertex not repeated.
        bottoms: Lower edges, as many vertices [m].
    """
    pairs = zip(rings, bottoms, strict=True)
    return merge_meshes([between(top, bottom, closed=True) for top, bottom in pairs])
