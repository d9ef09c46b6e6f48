"""Rounded bodies, skins on them and wings, for vehicles that no box or shell is like.

All are made in the recipe's frame (d, y, z), as in `recipe.py`.

References:
    Thickness of wings: the four-digit NACA sections (Jacobs, Ward and Pinkerton 1933, NACA
    Report 460), with a closed trailing edge.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bakery.heavy.recipe import Fitting
from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.library.mesh.solids import shaded
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, settled

_SIDES = ((0.06, 8), (0.3, 14), (1.2, 20), (np.inf, 32))
"""Facets around a loft whose largest half size is below the first number [m]."""

_LARGE = 1.0
"""Half size from which a loft keeps more of its facets at the far level [m]."""

_FAR_SIDES = (8, 14)  # facets around a loft at the far level, small or large
_FAR_RINGS = (6, 10)  # rings along it, at most

_TURN = np.radians(12.0)
"""A skin's facets turn by no more than this around its body."""

_CHORD = (1.0, 0.7, 0.4, 0.2, 0.08, 0.02, 0.0)
"""Places of a wing's points along its chord, from the trailing edge."""

_FAR_CHORD = (1.0, 0.3, 0.0)


def loft(piece: Fitting) -> Mesh:
    """Build a closed rounded body from its sections (d, y, z, half width, half height, exponent).

    A section of no size is a tip. An exponent of 2 is an ellipse, of 4 nearly a rectangle.
    """
    rows = np.asarray(piece.outline, dtype=np.float64)
    size = float(rows[:, 3:5].max())
    sides = next(count for most, count in _SIDES if size < most)
    return _body(rows, sides)


def far_loft(piece: Fitting) -> Mesh:
    """Build the same body with few facets."""
    rows = np.asarray(piece.outline, dtype=np.float64)
    large = int(rows[:, 3:5].max() >= _LARGE)
    if len(rows) > _FAR_RINGS[large]:
        kept = np.linspace(0, len(rows) - 1, _FAR_RINGS[large]).round().astype(np.int64)
        rows = rows[kept]
    return _body(rows, _FAR_SIDES[large])


def skin(piece: Fitting) -> Mesh:
    """Build a part of a loft's surface, such as a window, that lies a little before it.

    `outline` holds the loft's sections; `low` and `high` are two corners: d, the angle from
    the top to the left [deg], and in `low` how far it lies before the loft [m].
    """
    rows = np.asarray(piece.outline, dtype=np.float64)
    (first, begin, lift), (last, end, _) = piece.low, piece.high
    between = rows[(rows[:, 0] > first + 1e-6) & (rows[:, 0] < last - 1e-6), 0]
    along = np.concatenate([[first], between, [last]])
    steps = max(1, int(np.ceil(np.radians(abs(end - begin)) / _TURN - 1e-9)))
    turn = np.radians(np.linspace(begin, end, steps + 1))
    sections = np.column_stack([np.interp(along, rows[:, 0], column) for column in rows.T])
    sections[:, 3:5] += lift
    points = _rings(sections, turn)
    faces = grid_faces(len(along), len(turn), closed=False)
    return shaded(points.reshape(-1, 3), faces[:, ::-1], crease=0.9)


def foil(piece: Fitting) -> Mesh:
    """Build a wing, a fin or a blade from its stations (d, y, z, chord, thickness / chord).

    `d` is that of the leading edge; all sections are square to the line from the first to
    the last station.
    """
    return _wing(piece.outline, _CHORD)


def far_foil(piece: Fitting) -> Mesh:
    """Build the same wing with few facets."""
    return _wing(piece.outline, _FAR_CHORD)


def _body(rows: Floats, sides: int) -> Mesh:
    """Rings joined to a closed body; rings without a size are one point."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    vertices = _rings(rows, turn).reshape(-1, 3)
    ring = np.arange(len(rows)).repeat(sides)
    tips = (rows[:, 3:5].max(axis=1) < 1e-9)[ring]
    numbers = np.where(tips, ring * sides, np.arange(len(vertices)))
    faces = numbers[grid_faces(len(rows), sides, closed=True)]
    return shaded(vertices, outward(vertices, np.concatenate([faces, *_caps(rows, sides)])))


def _rings(rows: Floats, turn: Floats) -> Floats:
    """Points of sections at angles from the top to the left, (n, t, 3) [m]."""
    d, y, z, half, up, power = (rows[:, k, None] for k in range(6))
    sine, cosine = np.sin(turn), np.cos(turn)
    # Exactly on the axes.
    sine, cosine = sine.round(12), cosine.round(12)
    across = np.sign(sine) * np.abs(sine) ** (2.0 / power)
    upwards = np.sign(cosine) * np.abs(cosine) ** (2.0 / power)
    full = np.broadcast_to
    shape = (len(rows), len(turn))
    return settled(np.stack([full(d, shape), y + half * across, z + up * upwards], axis=-1))


def _caps(rows: Floats, sides: int) -> list[Ints]:
    """Faces over both ends, none over a tip; they look inward, as those of the sides do."""
    fan = np.arange(1, sides - 1)
    cap = np.stack([np.zeros_like(fan), fan, fan + 1], axis=1)
    first, last = (rows[k, 3:5].max() > 1e-9 for k in (0, -1))
    return [*([cap[:, ::-1]] if first else []), *([cap + (len(rows) - 1) * sides] if last else [])]


def _wing(stations: Sequence[Sequence[float]], chord: Sequence[float]) -> Mesh:
    """Sections joined to a closed wing."""
    rows = np.asarray(stations, dtype=np.float64)
    span = rows[-1, 1:3] - rows[0, 1:3]
    span = span / np.hypot(*span)
    up = np.array([-span[1], span[0]])
    x = np.asarray(chord)
    half = 5.0 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    half[0] = 0.0
    # Around a section: above from the trailing to the leading edge, then back below.
    along = np.concatenate([x, x[-2:0:-1]])
    lift = np.concatenate([half, -half[-2:0:-1]])
    d = rows[:, 0, None] + rows[:, 3, None] * along
    offset = (rows[:, 3] * rows[:, 4])[:, None] * lift
    y, z = (rows[:, k, None] + offset * up[k - 1] for k in (1, 2))
    count = len(along)
    vertices = settled(np.stack([d, y, z], axis=-1).reshape(-1, 3))
    faces = np.concatenate(
        [grid_faces(len(rows), count, closed=True), *_caps(rows[:, [0, 1, 2, 3, 3]], count)]
    )
    return shaded(vertices, outward(vertices, faces), crease=0.6)


def outward(vertices: Floats, faces: Ints) -> Ints:
    """Turn all faces of a closed mesh if it is inside out."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    inside_out = float((a * np.cross(b, c)).sum()) < 0.0
    return faces[:, ::-1] if inside_out else faces
