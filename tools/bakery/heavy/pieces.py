"""Pieces fixed to the shells of heavy vehicles: blocks, plates, rods, tanks, sheets, texts.

Everything is made in the recipe's frame (d, y, z) and turned round by `build.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
from shapely.geometry import Polygon

from bakery.heavy.letters import letter_runs
from bakery.heavy.lofts import far_foil, far_loft, foil, loft, outward, skin
from bakery.heavy.recipe import Fitting
from sumo3dviz_pt.library.mesh.planar import grid_faces, triangulate
from sumo3dviz_pt.library.mesh.solids import (
    bevelled,
    box,
    lathe,
    mirrored,
    moved,
    shaded,
    superellipsoid,
    tube,
)
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes

Ground = Callable[[str, Floats], float]
"""Coordinate of the surface along a view, at a point (d, y, z) whose own there is ignored."""

_SIGNS = {"front": -1.0, "rear": 1.0, "left": 1.0, "right": -1.0, "side": 1.0, "top": 1.0}


def build_piece(piece: Fitting, ground: Ground) -> Iterator[Mesh]:
    """Build all copies of a piece, in the frame (d, y, z).

    Args:
        piece: From the recipe.
        ground: The surface that pieces cling to.
    """
    for number in range(piece.repeat):
        offset = number * np.asarray(piece.step)
        for mesh in _clung(piece, offset, ground):
            yield mesh
            if piece.mirror:
                yield mirrored(mesh)


def _clung(piece: Fitting, offset: Floats, ground: Ground) -> Iterator[Mesh]:
    """One copy, put on the surface where it clings to one."""
    if not piece.cling:
        yield moved(_KINDS[piece.kind](piece), *offset)
        return
    axis = {"front": 0, "rear": 0, "top": 2}.get(piece.cling, 1)
    if piece.kind == "rod":
        points = np.asarray(piece.outline, dtype=np.float64) + offset
        points[:, axis] += [ground(piece.cling, point) for point in points]
        yield tube(points, radius=piece.round, sides=5)
        return
    if piece.kind == "text":
        for mesh in _letters(piece):
            yield _set_down(moved(mesh, *offset), piece.cling, axis, ground)
        return
    yield _set_down(moved(_KINDS[piece.kind](piece), *offset), piece.cling, axis, ground)


def _set_down(mesh: Mesh, view: str, axis: int, ground: Ground) -> Mesh:
    """Shift a mesh along an axis by where the surface is at its middle."""
    shift = np.zeros(3)
    shift[axis] = ground(view, mesh.bounds.mean(axis=0))
    return moved(mesh, *shift)


def _block(piece: Fitting) -> Mesh:
    """A box with bevelled edges."""
    return bevelled(piece.low, piece.high, bevel=piece.round)


def _plate(piece: Fitting) -> Mesh:
    """An outline drawn out along its view, between the two ends of `span`."""
    flat, faces = triangulate(Polygon(piece.outline))
    count = len(flat)
    first, last = sorted(piece.span)
    ring = np.arange(count)
    after = np.roll(ring, -1)
    outline = np.asarray(Polygon(piece.outline).exterior.coords)
    area = float((outline[:-1, 0] * outline[1:, 1] - outline[1:, 0] * outline[:-1, 1]).sum())
    if area < 0.0:
        ring, after = after, ring
    walls = [
        np.stack([ring, after, after + count], 1),
        np.stack([ring, after + count, ring + count], 1),
    ]
    solid = np.concatenate([faces[:, ::-1], faces + count, *walls])
    uvw = np.concatenate(
        [
            np.column_stack([flat, np.full(count, first)]),
            np.column_stack([flat, np.full(count, last)]),
        ]
    )
    return _from_plane(uvw, solid, piece.view, crease=0.5)


def _from_plane(uvw: Floats, faces: Ints, view: str, *, crease: float) -> Mesh:
    """Turn (u, v, w), where w is the coordinate along the view, into (d, y, z)."""
    u, v, w = uvw.T
    if view == "top":
        return shaded(np.column_stack([u, v, w]), faces, crease=crease)
    if view in ("front", "rear"):
        return shaded(np.column_stack([w, u, v]), faces, crease=crease)
    return shaded(np.column_stack([u, w, v]), faces[:, ::-1], crease=crease)


def _rod(piece: Fitting) -> Mesh:
    """A tube along a path."""
    return tube(np.asarray(piece.outline), radius=piece.round, sides=6)


def _turned(piece: Fitting) -> Mesh:
    """A profile turned around an axis through `low`; `view` names the axis d, y or z."""
    most = max(r for r, _ in piece.outline)
    segments = 8 if most < 0.06 else 12 if most < 0.2 else 20 if most < 0.6 else 32
    mesh = lathe(piece.outline, segments=segments, crease=0.6)
    turn = {"y": [0, 1, 2], "d": [1, 2, 0], "z": [2, 0, 1]}.get(piece.view, [0, 1, 2])
    assert mesh.normals is not None
    turned = Mesh(mesh.vertices[:, turn], mesh.faces, mesh.normals[:, turn])
    return moved(turned, *piece.low)


def _dome(piece: Fitting) -> Mesh:
    """A rounded body that fills a box."""
    low, high = np.asarray(piece.low), np.asarray(piece.high)
    body = superellipsoid((0.5 * (high - low)).tolist(), squareness=3.5, segments=10, rings=4)
    return moved(body, *(0.5 * (low + high)))


def _sheet(piece: Fitting) -> Mesh:
    """A wavy sheet with its outer face towards the view, as curtains and shutters are."""
    amplitude, along, upwards = piece.waves.height, piece.waves.along, piece.waves.upwards
    axis = {"front": 0, "rear": 0, "top": 2}.get(piece.view, 1)
    u_axis, v_axis = (1, 2) if axis == 0 else (0, 2) if axis == 1 else (0, 1)
    low, high = np.asarray(piece.low), np.asarray(piece.high)
    u = _wave_steps(low[u_axis], high[u_axis], along)
    v = _wave_steps(low[v_axis], high[v_axis], upwards)
    grid_u, grid_v = np.meshgrid(u, v, indexing="ij")
    lift = amplitude * _waves(grid_u - low[u_axis], along) * _waves(grid_v - low[v_axis], upwards)
    points = np.empty((*grid_u.shape, 3))
    points[..., u_axis], points[..., v_axis] = grid_u, grid_v
    sign = _SIGNS[piece.view]
    points[..., axis] = (high if sign > 0 else low)[axis] + sign * (lift - amplitude)
    rows, columns = grid_u.shape
    i, j = (
        k.reshape(-1)
        for k in np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    )
    a, b, c, e = (
        i * columns + j,
        (i + 1) * columns + j,
        (i + 1) * columns + j + 1,
        i * columns + j + 1,
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, e], 1)])
    # In (u, v) this is counter-clockwise; (d, z) and its likes are seen from -y.
    mirror = (axis == 1) != (sign < 0)
    return shaded(points.reshape(-1, 3), faces[:, ::-1] if mirror else faces, crease=0.8)


def _wave_steps(low: float, high: float, pitch: float) -> Floats:
    """Places of a sheet's vertices: three to a wave, or the ends where there is none."""
    if pitch > high - low:
        return np.array([low, high])
    return np.linspace(low, high, 3 * max(1, round((high - low) / pitch)) + 1)


def _waves(u: Floats, pitch: float) -> Floats:
    """Bulges between fixed lines, 0 to 1; one without a pitch."""
    span = float(u.max())
    if pitch > span:
        return np.ones_like(u)
    pitch = span / max(1, round(span / pitch))
    return np.asarray(np.abs(np.sin(np.pi * u / pitch)) ** 0.8)


def _text(piece: Fitting) -> Mesh:
    """Letters of flat dots between `low` and `high`, at the outer end along the view."""
    return merge_meshes(_letters(piece))


def _letters(piece: Fitting) -> list[Mesh]:
    """The blocks of a text."""
    low, high = np.asarray(piece.low), np.asarray(piece.high)
    axis = {"front": 0, "rear": 0}.get(piece.view, 1)
    u_axis = 1 - axis
    runs, columns, rows = letter_runs(piece.text)
    pitch = min((high[u_axis] - low[u_axis]) / columns, (high[2] - low[2]) / rows)
    middle = 0.5 * (low + high)
    # Read from left to right: towards +y from ahead, -y from behind, +d from the left.
    forward = {"front": 1.0, "rear": -1.0, "left": 1.0, "side": 1.0, "right": -1.0}[piece.view]
    sign = _SIGNS[piece.view]
    # Lit dots stand apart, painted ones do not.
    thick = 0.84 if piece.material.startswith("lamp") else 1.0
    blocks = []
    for row, begin, end in runs:
        ends = middle[u_axis] + forward * pitch * (np.array([begin, end]) - 0.5 * columns)
        first, last = low.copy(), high.copy()
        first[u_axis], last[u_axis] = ends.min(), ends.max()
        first[2] = middle[2] + pitch * (0.5 * rows - row - 0.5 - 0.5 * thick)
        last[2] = first[2] + thick * pitch
        blocks.append(_face(first, last, axis, sign))
    return blocks


def _face(low: Floats, high: Floats, axis: int, sign: float) -> Mesh:
    """The one side of a box that looks along an axis."""
    corners = np.stack([low, low, high, high])
    u_axis = 1 - axis
    corners[:, u_axis] = [low[u_axis], high[u_axis], high[u_axis], low[u_axis]]
    corners[:, 2] = [low[2], low[2], high[2], high[2]]
    corners[:, axis] = (high if sign > 0 else low)[axis]
    mesh = shaded(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    assert mesh.normals is not None
    if mesh.normals[0, axis] * sign > 0:
        return mesh
    return Mesh(mesh.vertices, mesh.faces[:, ::-1], -mesh.normals)


def _mudguard(piece: Fitting) -> Mesh:
    """A bent strip over a wheel: `low` is the axle, `span` the two |y|, `outline` angles."""
    begin, end = (np.radians(angle) for angle, _ in piece.outline[:2])
    turn = np.linspace(begin, end, 11)
    radii = (piece.round, piece.round + 0.02)
    first, last = sorted(piece.span)
    ring = [
        np.stack([-r * np.cos(turn), np.full_like(turn, y), r * np.sin(turn)], axis=1)
        for r, y in ((radii[0], first), (radii[0], last), (radii[1], last), (radii[1], first))
    ]
    vertices = np.stack(ring, axis=1).reshape(-1, 3)
    quads = grid_faces(11, 4, closed=True)
    caps = np.array([[0, 3, 2], [0, 2, 1], [40, 41, 42], [40, 42, 43]])
    mesh = shaded(vertices, outward(vertices, np.concatenate([quads, caps])), crease=0.6)
    return moved(mesh, *piece.low)


_KINDS: Mapping[str, Callable[[Fitting], Mesh]] = {
    "block": _block,
    "plate": _plate,
    "rod": _rod,
    "turned": _turned,
    "dome": _dome,
    "sheet": _sheet,
    "text": _text,
    "mudguard": _mudguard,
    "loft": loft,
    "skin": skin,
    "foil": foil,
}

_COARSE: Mapping[str, Callable[[Fitting], Mesh]] = {
    "loft": far_loft,
    "foil": far_foil,
    "skin": skin,
}
"""Kinds that no box looks like from afar."""


def build_far_piece(piece: Fitting, ground: Ground) -> Iterator[Mesh]:
    """Build all copies of a piece for the far level: most kinds as the boxes around them.

    Args:
        piece: From the recipe.
        ground: The surface that pieces cling to.
    """
    if piece.kind not in _COARSE:
        for mesh in build_piece(piece, ground):
            low, high = mesh.bounds
            yield box(low.tolist(), high.tolist())
        return
    for number in range(piece.repeat):
        mesh = moved(_COARSE[piece.kind](piece), *(number * np.asarray(piece.step)))
        yield mesh
        if piece.mirror:
            yield mirrored(mesh)
