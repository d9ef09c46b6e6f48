"""Buildings as quads by role, painted last: geometry is shared, colours are not.

A shell maps a role (`wall`, `plinth`, `roof`, `window`, ...) to quads, (n, 4, 3) [m],
counter-clockwise seen from outside; a quad whose last corners coincide is a triangle.
A palette says what a role is made of.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from sumo3dviz_pt.library.buildings.panes import PANE, pane_places
from sumo3dviz_pt.model.geometry import WALL_REACH, Colour, Floats, Mesh, area_vectors, unit
from sumo3dviz_pt.model.scene import Part

Shell = Mapping[str, Floats]
"""Quads by role, (n, 4, 3) [m]."""

Palette = Mapping[str, tuple[str, Colour | None]]
"""Material and, where it is tinted, colour of each role."""

BELOW = "_below"
"""What the role of a wall below openings ends with."""

_FLAT = np.concatenate([np.arange(3), [0, 2, 3]])
_TILES = 1024.0  # texture coordinates lie within half as many tiles of 0


def joined(shells: Iterable[Shell]) -> dict[str, Floats]:
    """Join shells; roles keep the order of their first appearance, empty ones go."""
    by_role: dict[str, list[Floats]] = {}
    for shell in shells:
        for role, quads in shell.items():
            if len(quads):
                by_role.setdefault(role, []).append(np.asarray(quads, np.float64).reshape(-1, 4, 3))
    return {role: np.concatenate(quads) for role, quads in by_role.items()}


def stood_up(shell: Shell, start: Floats, end: Floats) -> dict[str, Floats]:
    """Stand a flat wall up between two points of a plan.

    Args:
        shell: Quads in (along, inward, up) [m], along from `start` to `end`.
        start: Left end seen from outside, (2,) [m].
        end: Right end seen from outside, (2,) [m].
    """
    along = (end - start) / np.linalg.norm(end - start)
    inward = np.array([-along[1], along[0]])
    placed = {}
    for role, quads in shell.items():
        plan = start + quads[..., :1] * along + quads[..., 1:2] * inward
        placed[role] = np.concatenate([plan, quads[..., 2:]], axis=-1)
    return placed


def rectangles(
    u0: ArrayLike, u1: ArrayLike, z0: ArrayLike, z1: ArrayLike, *, inward: float = 0.0
) -> Floats:
    """Build upright rectangles in wall coordinates; arguments broadcast.

    Args:
        u0: Where they begin along the wall, (n,) [m].
        u1: Where they end.
        z0: Heights of their lower edges, (n,) [m].
        z1: Of their upper edges.
        inward: How far they lie behind the wall's face [m].

    Returns:
        (n, 4, 3) [m].
    """
    sides = [np.atleast_1d(np.asarray(side)) for side in (u0, u1, z0, z1)]
    quads = np.empty((*np.broadcast(*sides).shape, 4, 3))
    quads[..., 1] = inward
    # Corners run round from the lower one at the beginning.
    for corner, (u, z) in enumerate(((0, 2), (1, 2), (1, 3), (0, 3))):
        quads[..., corner, 0], quads[..., corner, 2] = sides[u], sides[z]
    return quads


def box(low: Sequence[float], high: Sequence[float], *, skip: str = "b") -> Floats:
    """Build the faces of an axis-aligned box between two corners, (n, 4, 3) [m].

    Args:
        low: Lowest corner (x, y, z) [m].
        high: Highest corner [m].
        skip: Faces to leave out: b(ottom), t(op), and x, X, y, Y for its low and high sides.
    """
    (x, y, z), (X, Y, Z) = low, high  # noqa: N806 - capitals mark the high side
    sides = {
        "b": [(x, y, z), (x, Y, z), (X, Y, z), (X, y, z)],
        "t": [(x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)],
        "y": [(x, y, z), (X, y, z), (X, y, Z), (x, y, Z)],
        "Y": [(X, Y, z), (x, Y, z), (x, Y, Z), (X, Y, Z)],
        "X": [(X, y, z), (X, Y, z), (X, Y, Z), (X, y, Z)],
        "x": [(x, Y, z), (x, y, z), (x, y, Z), (x, Y, Z)],
    }
    return np.array([side for name, side in sides.items() if name not in skip], dtype=np.float64)


def paint(
    shell: Shell,
    palette: Palette,
    *,
    tiles: Mapping[str, float] | None = None,
    shift: float = 0.0,
    office: bool = False,
) -> tuple[Part, ...]:
    """Turn a shell into parts, one per material.

    Args:
        shell: Quads by role.
        palette: Says for every role of the shell what it is made of.
        tiles: Metres per tile of materials with a texture; they get texture coordinates.
        shift: Moves textures, so that not all buildings have the same stains [tiles].
        office: Whether offices lie behind its windows, and no homes.
    """
    scales = tiles or {}
    ends = _ends(shell)
    quads: dict[str, list[Floats]] = {}
    tints: dict[str, list[Floats]] = {}
    places: dict[str, list[Floats]] = {}
    for role, corners in shell.items():
        material, colour = palette[role]
        quads.setdefault(material, []).append(corners)
        tint = np.broadcast_to(np.ones(3) if colour is None else colour, (len(corners), 3))
        tints.setdefault(material, []).append(tint)
        if material == PANE or material.startswith("lamp:"):
            own = pane_places(corners, role, office=office)
            places.setdefault(material, []).append(own)
        elif material in scales:
            places.setdefault(material, []).append(_weather(corners, ends, role))
    tinted = {material for material, colour in palette.values() if colour is not None}
    parts = []
    for material, some in quads.items():
        corners = np.concatenate(some)
        colours = np.concatenate(tints[material]) if material in tinted else None
        uvs = None
        if material in scales:
            uvs = upright_uvs(corners, tile=scales[material]) + np.array([shift, 0.0])
        wear = np.concatenate(places[material]) if material in places else None
        parts.append(_part(material, corners, colours, uvs, wear))
    return tuple(parts)


def _ends(shell: Shell) -> tuple[float, float]:
    """Return where the walls of a shell begin and end [m]."""
    walls = [quads[..., 2] for role, quads in shell.items() if role in ("wall", "base", "front")]
    if not walls:
        return 0.0, WALL_REACH
    return min(float(z.min()) for z in walls), max(float(z.max()) for z in walls)


def _weather(quads: Floats, ends: tuple[float, float], role: str) -> Floats:
    """Return what the corners of walls tell of how they weather, (n, 4, 3) in [0, 1]."""
    foot, top = ends
    z = quads[..., 2]
    drip = np.broadcast_to([0.0, 0.0, 1.0, 1.0] if role.endswith(BELOW) else 0.0, z.shape)
    high = [(z - foot) / WALL_REACH, np.maximum(top - z, 0.0) / WALL_REACH]
    return np.asarray(np.clip(np.stack([*high, drip], axis=-1), 0.0, 1.0))


def upright_uvs(quads: Floats, *, tile: float) -> Floats:
    """Lay texture coordinates along and up each quad, (n, 4, 2); `tile` in metres.

    Neighbouring quads of one plane fit together, as brick courses must.
    """
    # Diagonals, because one of a quad's two triangles may have no area.
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    normal = unit(normal)
    along = np.stack([-normal[:, 1], normal[:, 0], np.zeros(len(normal))], axis=1)
    level = np.linalg.norm(along, axis=1) < 0.04
    along[level] = (1.0, 0.0, 0.0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    up = np.cross(normal, along)
    u, v = (np.einsum("nkc,nc->nk", quads, axis) for axis in (along, up))
    uvs = np.stack([u, v], axis=-1) / tile
    # The renderer's coordinates have 24 bits, so far from the network's origin whole tiles go.
    return np.asarray(uvs - _TILES * np.rint(uvs[:, :1] / _TILES))


def _part(
    material: str, quads: Floats, tint: Floats | None, uvs: Floats | None, wear: Floats | None
) -> Part:
    """Triangulate quads of one material and drop what has no area."""
    faces = (4 * np.arange(len(quads))[:, None] + _FLAT).reshape(-1, 3)
    vertices = quads.reshape(-1, 3)
    solid = np.linalg.norm(area_vectors(vertices, faces), axis=1) > 1e-8
    each = None if tint is None else np.repeat(tint, 2, axis=0)[solid]
    flat = None if uvs is None else uvs.reshape(-1, 2)
    return Part(Mesh(vertices, faces[solid], None, flat, wear), material, each)
