"""Flat roofs with parapets over any plan, gabled roofs over rectangles."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.shapes.facade import FAR, NEAR
from sumo3dviz_pt.shapes.shell import Shell

_SLAB = np.array([0.0, 0.0, 0.16])  # thickness of a roof [m]


def flat_roof(plan: Floats, height: float, *, parapet: float, level: int) -> Shell:
    """A deck behind a parapet.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m]; convex or not.
        height: Of the deck and the walls below [m].
        parapet: Height above the deck [m].
        level: Level of detail; from afar only the parapet's outside is kept.
    """
    top = height + parapet
    deck = {"deck": _cap(plan, height if level != FAR else top)}
    outer = upright(plan, height, top)
    if level == FAR or len(plan) > 8:
        return {"deck": _cap(plan, top), "wall": outer}
    inner = _shrunk(plan, 0.3)
    edge = np.stack(
        [
            _at(plan, top),
            _at(np.roll(plan, -1, axis=0), top),
            _at(np.roll(inner, -1, axis=0), top),
            _at(inner, top),
        ],
        axis=1,
    )
    return {
        **deck,
        "wall": np.concatenate([outer, upright(inner, height, top)[:, ::-1]]),
        "trim": edge,
    }


def gable_roof(
    plan: Floats, height: float, *, pitch: float, ridge_along_first: bool, level: int
) -> Shell:
    """Two slopes with overhanging eaves, and the gables below them.

    Args:
        plan: Counter-clockwise corners of a rectangle, (4, 2) [m].
        height: Of the walls [m].
        pitch: Of the slopes [rad].
        ridge_along_first: Whether the ridge runs along the side from the first corner.
        level: Level of detail.
    """
    a, b, c, d = plan if ridge_along_first else np.roll(plan, -1, axis=0)
    across = (d - a) / np.linalg.norm(d - a)
    along = (b - a) / np.linalg.norm(b - a)
    half = float(np.linalg.norm(d - a)) / 2
    rise, over = half * np.tan(pitch), 0.4 if level != FAR else 0.0
    drop = over * np.tan(pitch)
    ridge = [(a + d) / 2 - over * along, (b + c) / 2 + over * along]
    left = [a - over * (across + along), b - over * (across - along)]
    right = [c + over * (across + along), d + over * (across - along)]
    z, low = height + rise, height - drop
    slopes = np.array(
        [
            [[*left[0], low], [*left[1], low], [*ridge[1], z], [*ridge[0], z]],
            [[*right[0], low], [*right[1], low], [*ridge[0], z], [*ridge[1], z]],
        ]
    )
    gables = np.array(
        [
            [[*d, height], [*a, height], [*(a + d) / 2, z], [*(a + d) / 2, z]],
            [[*b, height], [*c, height], [*(b + c) / 2, z], [*(b + c) / 2, z]],
        ]
    )
    if level != NEAR:
        return {"roof": slopes, "wall": gables}
    return {"roof": slopes + _SLAB, "wall": gables, "trim": _eaves(slopes)}


def _eaves(slopes: Floats) -> Floats:
    """Underside and edges of a roof slab 0.16 m thick, (n, 4, 3)."""
    under = slopes[:, ::-1]
    edges = [
        np.stack([slopes[:, i], slopes[:, j], slopes[:, j] + _SLAB, slopes[:, i] + _SLAB], axis=1)
        for i, j in ((0, 1), (1, 2), (3, 0))
    ]
    return np.concatenate([under, *edges])


def upright(plan: Floats, low: float, high: float) -> Floats:
    """Upright faces along a closed plan, outside out, (n, 4, 3)."""
    after = np.roll(plan, -1, axis=0)
    return np.stack([_at(plan, low), _at(after, low), _at(after, high), _at(plan, high)], axis=1)


def _at(plan: Floats, height: float) -> Floats:
    """Plan points at a height, (n, 3)."""
    return np.column_stack([plan, np.full(len(plan), height)])


def _shrunk(plan: Floats, distance: float) -> Floats:
    """Convex plan moved inwards; right for right angles, near enough for others."""
    before, after = np.roll(plan, 1, axis=0) - plan, np.roll(plan, -1, axis=0) - plan
    before /= np.linalg.norm(before, axis=1, keepdims=True)
    after /= np.linalg.norm(after, axis=1, keepdims=True)
    return plan + distance * (before + after)


def _cap(plan: Floats, height: float) -> Floats:
    """The plan as triangles (quads whose last corners coincide), (n, 4, 3)."""
    if len(plan) == 4:
        return _at(plan, height)[None]
    import mapbox_earcut

    ends = np.array([len(plan)], dtype=np.uint32)
    corners = mapbox_earcut.triangulate_float64(plan, ends).reshape(-1, 3).astype(np.int64)
    return _at(plan, height)[corners[:, [0, 1, 2, 2]]]
