"""Letters, digits and arrows as strokes of our own, and flat figures for signs.

A glyph is a list of polylines on a grid: x from 0 to its width, y from 0 (foot) to 1 (head).
Everything here lies in a plane (u to the reader's right, v up) as triangles, (n, 3, 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh, settled, unit

Line = Sequence[tuple[float, float]]


def _arc(
    centre: tuple[float, float], radii: tuple[float, float], begin: float, end: float
) -> list[tuple[float, float]]:
    """Return points of an elliptic arc between two angles [deg]."""
    turn = np.radians(np.linspace(begin, end, max(3, int(abs(end - begin) / 30) + 1)))
    return [
        (centre[0] + radii[0] * float(np.cos(t)), centre[1] + radii[1] * float(np.sin(t)))
        for t in turn
    ]


_BOWL = _arc((0.27, 0.27), (0.27, 0.27), -180, 180)
_O = [
    *_arc((0.27, 0.73), (0.27, 0.27), 0, 180),
    *_arc((0.27, 0.27), (0.27, 0.27), 180, 360),
    (0.54, 0.73),
]

GLYPHS: Mapping[str, tuple[Line, ...]] = {
    "0": (_O,),
    "1": ([(0.08, 0.78), (0.3, 1.0), (0.3, 0.0)],),
    "2": ([*_arc((0.27, 0.73), (0.26, 0.27), 165, -25), (0.02, 0.0), (0.54, 0.0)],),
    "3": (
        _arc((0.25, 0.76), (0.24, 0.24), 160, -80),
        _arc((0.25, 0.26), (0.28, 0.26), 80, -160),
    ),
    "4": ([(0.42, 0.0), (0.42, 1.0), (0.0, 0.3), (0.56, 0.3)],),
    "5": ([(0.48, 1.0), (0.08, 1.0), (0.05, 0.54), *_arc((0.25, 0.3), (0.28, 0.3), 120, -155)],),
    "6": (_BOWL, [(0.0, 0.27), (0.03, 0.6), (0.2, 0.9), (0.4, 1.0)]),
    "7": ([(0.0, 1.0), (0.54, 1.0), (0.2, 0.0)],),
    "8": (
        _arc((0.27, 0.26), (0.27, 0.26), -180, 180),
        _arc((0.27, 0.76), (0.23, 0.24), -180, 180),
    ),
    "9": (
        _arc((0.27, 0.73), (0.27, 0.27), -180, 180),
        [(0.54, 0.73), (0.51, 0.4), (0.34, 0.1), (0.14, 0.0)],
    ),
    "A": ([(0.0, 0.0), (0.3, 1.0), (0.6, 0.0)], [(0.1, 0.32), (0.5, 0.32)]),
    "B": (
        [(0.0, 0.0), (0.0, 1.0), (0.25, 1.0), *_arc((0.25, 0.76), (0.22, 0.24), 90, -90)],
        [(0.0, 0.52), (0.25, 0.52), *_arc((0.25, 0.26), (0.27, 0.26), 90, -90), (0.0, 0.0)],
    ),
    "C": (_arc((0.3, 0.5), (0.3, 0.5), 50, 310),),
    "D": ([(0.0, 0.0), (0.0, 1.0), *_arc((0.2, 0.5), (0.36, 0.5), 90, -90), (0.0, 0.0)],),
    "E": ([(0.48, 1.0), (0.0, 1.0), (0.0, 0.0), (0.48, 0.0)], [(0.0, 0.52), (0.4, 0.52)]),
    "F": ([(0.48, 1.0), (0.0, 1.0), (0.0, 0.0)], [(0.0, 0.52), (0.4, 0.52)]),
    "G": ([*_arc((0.3, 0.5), (0.3, 0.5), 50, 330), (0.58, 0.46), (0.32, 0.46)],),
    "H": ([(0.0, 0.0), (0.0, 1.0)], [(0.52, 0.0), (0.52, 1.0)], [(0.0, 0.52), (0.52, 0.52)]),
    "I": ([(0.04, 0.0), (0.04, 1.0)],),
    "J": ([(0.4, 1.0), (0.4, 0.25), *_arc((0.2, 0.24), (0.2, 0.24), 0, -170)],),
    "K": ([(0.0, 0.0), (0.0, 1.0)], [(0.52, 1.0), (0.02, 0.42)], [(0.18, 0.6), (0.54, 0.0)]),
    "L": ([(0.0, 1.0), (0.0, 0.0), (0.46, 0.0)],),
    "M": ([(0.0, 0.0), (0.0, 1.0), (0.34, 0.3), (0.68, 1.0), (0.68, 0.0)],),
    "N": ([(0.0, 0.0), (0.0, 1.0), (0.54, 0.0), (0.54, 1.0)],),
    "O": (_arc((0.31, 0.5), (0.31, 0.5), -180, 180),),
    "P": (
        [
            (0.0, 0.0),
            (0.0, 1.0),
            (0.25, 1.0),
            *_arc((0.25, 0.74), (0.25, 0.26), 90, -90),
            (0.0, 0.48),
        ],
    ),
    "R": (
        [
            (0.0, 0.0),
            (0.0, 1.0),
            (0.25, 1.0),
            *_arc((0.25, 0.74), (0.25, 0.26), 90, -90),
            (0.0, 0.48),
        ],
        [(0.26, 0.48), (0.54, 0.0)],
    ),
    "S": (
        [*_arc((0.27, 0.74), (0.26, 0.26), 30, 250), *_arc((0.27, 0.26), (0.27, 0.26), 70, -150)],
    ),
    "T": ([(0.0, 1.0), (0.56, 1.0)], [(0.28, 1.0), (0.28, 0.0)]),
    "U": ([(0.0, 1.0), (0.0, 0.27), *_arc((0.27, 0.27), (0.27, 0.27), 180, 360), (0.54, 1.0)],),
    "V": ([(0.0, 1.0), (0.3, 0.0), (0.6, 1.0)],),
    "W": ([(0.0, 1.0), (0.2, 0.0), (0.4, 0.8), (0.6, 0.0), (0.8, 1.0)],),
    "X": ([(0.0, 0.0), (0.56, 1.0)], [(0.0, 1.0), (0.56, 0.0)]),
    "Y": ([(0.0, 1.0), (0.28, 0.5), (0.56, 1.0)], [(0.28, 0.5), (0.28, 0.0)]),
    "Z": ([(0.0, 1.0), (0.54, 1.0), (0.0, 0.0), (0.54, 0.0)],),
    " ": (),
}
"""Strokes of every character that `lettering` can write."""


def lettering(text: str, *, height: float, weight: float = 0.16, gap: float = 0.26) -> Floats:
    """Write a line of text around the origin as triangles, (n, 3, 2) [m].

    Args:
        text: Of characters in `GLYPHS`.
        height: Of a letter [m].
        weight: Width of strokes, as a share of the height.
        gap: Space between letters, as a share of the height.

    Raises:
        KeyError: If a character has no glyph.
    """
    pieces: list[Floats] = []
    at = 0.0
    for character in text:
        lines = GLYPHS[character]
        wide = max((x for line in lines for x, _ in line), default=0.3)
        inner = 1.0 - weight  # strokes stay within the height
        for line in lines:
            points = np.array(line) * [1.0, inner] + [at, weight / 2]
            pieces.append(ribbon(points, weight))
        at += wide + gap
    if not pieces:
        return np.zeros((0, 3, 2))
    drawn = settled(np.concatenate(pieces))
    low, high = drawn.reshape(-1, 2).min(axis=0), drawn.reshape(-1, 2).max(axis=0)
    centred: Floats = (drawn - [(low[0] + high[0]) / 2, 0.5]) * height
    return centred


def ribbon(points: Floats, width: float) -> Floats:
    """Draw a polyline, (n, 2), with a width: a quad a piece, longer at bends, (m, 3, 2)."""
    points = np.asarray(points, dtype=np.float64)
    step = unit(np.diff(points, axis=0))
    normals = np.column_stack([-step[:, 1], step[:, 0]])
    before, after = np.vstack([normals[:1], normals]), np.vstack([normals, normals[-1:]])
    mitre = (before + after) / np.maximum(1.0 + (before * after).sum(axis=1), 0.4)[:, None]
    left, right = points + mitre * width / 2, points - mitre * width / 2
    quads = np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    # At sharp bends the inner side turns over; what is left of it has no area.
    a, b = faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    faces[twice < 0] = faces[twice < 0][:, ::-1]
    drawn: Floats = faces[np.abs(twice) > 1e-9]
    return drawn


def fan(outline: Iterable[Sequence[float]] | Floats) -> Floats:
    """Cover a convex counter-clockwise outline with triangles, (n, 3, 2)."""
    points = np.asarray(outline, dtype=np.float64)
    return np.stack([[points[0], points[k], points[k + 1]] for k in range(1, len(points) - 1)])


def disc(radius: float, *, centre: tuple[float, float] = (0.0, 0.0), sides: int = 28) -> Floats:
    """Cover a circle with triangles.

    Args:
        radius: [m].
        centre: [m].
        sides: Of the polygon that stands for it.

    Returns:
        (n, 3, 2) [m].
    """
    return fan(regular(radius, sides=sides) + np.array(centre))


def regular(radius: float, *, sides: int, turn: float = 0.0) -> Floats:
    """Return the corners of a regular polygon around the origin.

    Args:
        radius: [m].
        sides: How many.
        turn: Direction of the first corner [rad].

    Returns:
        Counter-clockwise, (n, 2) [m].
    """
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False) + turn
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def ring(outer: Floats, inner: Floats) -> Floats:
    """Cover what lies between two outlines of equally many corners, (n, 3, 2)."""
    after_outer, after_inner = np.roll(outer, -1, axis=0), np.roll(inner, -1, axis=0)
    one = np.stack([outer, after_outer, after_inner], axis=1)
    other = np.stack([outer, after_inner, inner], axis=1)
    return np.concatenate([one, other])


def arrow(length: float, width: float, *, turn: float = 0.0) -> Floats:
    """Draw an arrow around the origin.

    Args:
        length: [m].
        width: Of its head [m].
        turn: From upwards, counter-clockwise [rad].

    Returns:
        Triangles, (n, 3, 2) [m].
    """
    head, half = 0.42 * length, 0.17 * width
    shaft = fan([(-half, -length / 2), (half, -length / 2), (half, length / 2 - head),
                 (-half, length / 2 - head)])  # fmt: skip
    point = fan([(-width / 2, length / 2 - head), (width / 2, length / 2 - head),
                 (0.0, length / 2)])  # fmt: skip
    cos, sin = np.cos(turn), np.sin(turn)
    turned: Floats = np.concatenate([shaft, point]) @ np.array([[cos, sin], [-sin, cos]])
    return turned


def upright(flat: Floats, *, x: float, z: float) -> Mesh:
    """Stand a flat drawing up, so that it looks to -x.

    Args:
        flat: Triangles of the reader's plane, (n, 3, 2) [m].
        x: Where they stand [m].
        z: Height of the plane's origin [m].
    """
    points = flat.reshape(-1, 2)
    vertices = np.column_stack([np.full(len(points), x), -points[:, 0], z + points[:, 1]])
    faces = np.arange(len(points)).reshape(-1, 3)
    return Mesh(vertices, faces, np.tile([-1.0, 0.0, 0.0], (len(points), 1)))
