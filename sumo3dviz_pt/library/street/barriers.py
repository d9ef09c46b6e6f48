"""Barriers along lines: guard rails, concrete, noise barriers, chain link, boards.

All functions take a smooth line at steps of `fence.STEP`, (n, 3) [m], and a level of detail from 0
(near) to 2, and give parts in the frame of the line. A guard rail is a motorway's: a W-beam on
posts.

References:
    Beam 0.31 m high and 0.08 m deep with its middle 0.60 m above the ground, posts
    each 4 m: as of EN 1317 type A rails.
    F-shape of concrete barriers, 0.81 m high on a foot of 0.6 m with breaks at 75 mm and
    255 mm above that: FHWA Report RD-77-4, 1976.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sumo3dviz_pt.library.buildings.shell import box
from sumo3dviz_pt.library.materials import coloured
from sumo3dviz_pt.library.mesh.planar import grid_faces
from sumo3dviz_pt.model.geometry import Colour, Floats, Ints, Mesh, arc_length, merge_meshes, unit
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.scene import Part

STEP = 2.0
"""Distance between the points of a fence's line [m]; every other one has a post."""

_RAMP = 9.0  # length over which an end comes down [m]
_BURIED = 0.80  # how far it comes down: deeper than the beam's lower half [m]
_NEAR = np.array(
    [
        (0.0, -0.155),
        (0.02, -0.135),
        (0.08, -0.115),
        (0.08, -0.06),
        (0.012, -0.025),
        (0.012, 0.025),
        (0.08, 0.06),
        (0.08, 0.115),
        (0.02, 0.135),
        (0.0, 0.155),
    ]
)
_FAR = np.array([(0.04, -0.155), (0.04, 0.155)])


def fence(line: Floats, drop: Floats, *, sides: Sequence[int] = (1,), level: int = 0) -> Mesh:
    """Build a piece of guard rail with normals.

    Args:
        line: Smooth line at steps of `STEP`, (n, 3) [m], n >= 2.
        drop: How far the beam is lowered at each point, (n,) [m]; see `end_drop`.
        sides: Beams on the left (1), on the right (-1), or on both.
        level: 0 for the full profile, 1 for a flat beam on posts, 2 without posts.
    """
    keep = thinned(line, level)
    across = leftward(line)
    profile = _NEAR if level == 0 else _FAR
    parts = [_beam(line[keep], across[keep] * side, drop[keep], profile) for side in sides]
    if level < 2:
        # The last post belongs to the next piece, unless the rail ends here.
        posts = np.arange(0, len(line) if drop[-1] > 0.5 else len(line) - 1, 2)
        parts.append(_posts(line[posts], across[posts], drop[posts]))
    return merge_meshes(parts)


def resampled(line: Floats) -> Floats:
    """Lay a smooth curve through a polyline's points, (m, k) [m], in steps of about `STEP`.

    Tangents are those of the polyline weighted by the opposite segments' lengths, so
    that long straight pieces stay straight.

    Args:
        line: (n, 2) or (n, 3) [m], with at least two different points.

    Raises:
        ValueError: If all points are the same.
    """
    line = np.asarray(line, dtype=np.float64)
    line = line[np.append(True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6)]
    if len(line) < 2:
        raise ValueError("a fence needs two different points")
    knots = arc_length(line)
    slopes = np.diff(line, axis=0) / np.diff(knots)[:, None]
    weight = np.diff(knots)
    inner = (slopes[:-1] * weight[1:, None] + slopes[1:] * weight[:-1, None]) / (
        weight[1:] + weight[:-1]
    )[:, None]
    curve = CubicHermiteSpline(knots, line, np.vstack([slopes[:1], inner, slopes[-1:]]))
    # An even number of pieces puts a post at both ends.
    pieces = 2 * max(round(knots[-1] / STEP / 2), 1)
    points: Floats = curve(np.linspace(0.0, knots[-1], pieces + 1))
    return points


def end_drop(line: Floats) -> Floats:
    """Return how far the beam of a whole rail comes down towards both ends, (n,) [m].

    Both ends go into the ground, as rails must that have no other terminal.
    """
    distance = arc_length(line)
    total = distance[-1]
    ramp = min(_RAMP, total / 3)
    share = np.clip(np.minimum(distance, total - distance) / ramp, 0.0, 1.0)
    drop: Floats = _BURIED * (1.0 - eased(share))
    return drop


def leftward(line: Floats) -> Floats:
    """Horizontal unit normals to the left, (n, 3)."""
    along = np.gradient(line, axis=0)
    left = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(line))])
    return unit(left)


def thinned(line: Floats, level: int) -> Ints:
    """Return the numbers of the points that a level of detail keeps, (m,)."""
    return np.unique(np.append(np.arange(0, len(line), (1, 2, 4)[level]), len(line) - 1))


def _beam(line: Floats, across: Floats, sink: Floats, profile: Floats) -> Mesh:
    """Sweep the profile along the line; normals are smooth over it."""
    centre = line + 0.06 * across
    centre[:, 2] += 0.60 - sink
    up = np.array([0.0, 0.0, 1.0])
    vertices = centre[:, None] + profile[:, :1] * across[:, None] + profile[:, 1:] * up
    slope = np.gradient(profile, axis=0)
    normal = np.stack([slope[:, 1], -slope[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normals = normal[:, :1] * across[:, None] + normal[:, 1:] * up
    count, k = len(line), len(profile)
    faces = grid_faces(count, k)
    # Face the way the normals do, on either side of the line.
    if np.cross(line[1] - line[0], across[0])[2] < 0:
        faces = faces[:, ::-1]
    return Mesh(vertices.reshape(-1, 3), faces, normals.reshape(-1, 3))


def _posts(line: Floats, across: Floats, sink: Floats) -> Mesh:
    """Build upright boxes with flat normals; posts of lowered ends are as low as the beam."""
    faces = box((-0.05, -0.03, -0.5), (0.05, 0.03, 0.72), skip="b")
    along = np.column_stack([across[:, 1], -across[:, 0], np.zeros(len(across))])
    tall = 0.70 - sink
    quads = np.broadcast_to(faces, (len(line), *faces.shape)).copy()
    quads[..., 2] = np.minimum(quads[..., 2], tall[:, None, None])
    placed = (
        line[:, None, None]
        + quads[..., :1] * along[:, None, None]
        + quads[..., 1:2] * across[:, None, None]
        + quads[..., 2:] * [0.0, 0.0, 1.0]
    ).reshape(-1, 4, 3)
    normals = np.cross(placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0])
    normals = unit(normals)
    index = 4 * np.arange(len(placed))[:, None]
    corners = (index + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)
    return Mesh(placed.reshape(-1, 3), corners, np.repeat(normals, 4, axis=0))


_CONCRETE: Colour = (0.34, 0.335, 0.32)
_PANELS: Sequence[Colour] = ((0.13, 0.17, 0.125), (0.145, 0.18, 0.135), (0.12, 0.16, 0.12))
_F_SHAPE = ((0.30, -0.15), (0.30, 0.075), (0.19, 0.33), (0.115, 0.79), (0.095, 0.81))
_TAPER = 4.0  # length over which a concrete barrier comes down at its ends [m]
_NOISE = 3.0  # height of a noise barrier [m]
_LOW = 1.5  # height of the fences [m]
_WIRE = 0.004


def concrete(line: Floats, *, level: int = 0, ends: tuple[bool, bool] = (True, True)) -> list[Part]:
    """Build a concrete barrier; at the ends of the whole barrier it comes down.

    Args:
        line: (n, 3) [m].
        level: Of detail.
        ends: Whether the piece's begin and end are those of the whole barrier.
    """
    half = _F_SHAPE if level == 0 else (_F_SHAPE[0], _F_SHAPE[2], _F_SHAPE[-1])
    profile = np.array([*half, *((-x, z) for x, z in half[::-1])])
    rise = _taper(line, ends)
    thin = thinned(line, level)
    mesh = swept(line[thin], profile, rise=rise[thin])
    # Elements of 6 m differ a little, as castings do.
    shade = 1.0 + 0.09 * (((_nearest(mesh, line) // 3) * 7 % 5) / 2.0 - 1.0)
    return [Part(mesh, "sign", np.array(_CONCRETE) * shade[:, None])]


def noise(line: Floats, *, level: int = 0, ends: tuple[bool, bool] = (True, True)) -> list[Part]:
    """Build a noise barrier: a concrete foot, absorbing panels with ridges, steel posts each 4 m.

    Args:
        line: (n, 3) [m].
        level: Of detail.
        ends: Not used: it ends as it runs on, with a post.
    """
    del ends
    thin = thinned(line, level)
    foot = swept(line[thin], _slab(0.07, -0.3, 0.45))
    panels = swept(line[thin], _ridges(level))
    tint = np.array(_PANELS)[(_nearest(panels, line) // 6) * 2 % 3]
    parts = [coloured(foot, _CONCRETE), Part(panels, "sign", tint)]
    if level < 2:
        every = np.arange(0, len(line), 2)
        posts = upright_boxes(line[every], (-0.09, -0.11, -0.5), (0.09, 0.11, _NOISE + 0.04))
        parts.append(Part(posts, "galvanised"))
    return parts


def chain_link(
    line: Floats, *, level: int = 0, ends: tuple[bool, bool] = (True, True)
) -> list[Part]:
    """Build a wire fence 1.5 m high: posts, top and bottom wires and, nearby, the mesh itself.

    Args:
        line: (n, 3) [m].
        level: Of detail.
        ends: Not used: it ends as it runs on, with a post.
    """
    del ends
    parts: list[Mesh] = []
    posts = np.arange(0, len(line), (1, 1, 2)[level])
    parts.append(upright_boxes(line[posts], (-0.02, -0.02, -0.4), (0.02, 0.02, _LOW + 0.05)))
    heights = ((0.1, _LOW), (0.1, 0.45, 0.8, 1.15, _LOW), (_LOW,))[level]
    parts += [swept(line, _slab(0.006, z - 0.006, z + 0.006)) for z in heights]
    panel = [Part(merge_meshes(parts), "galvanised")]
    if level == 0:
        panel.append(Part(_wires(line), "steel"))
    return panel


def boards(line: Floats, *, level: int = 0, ends: tuple[bool, bool] = (True, True)) -> list[Part]:
    """Build a wooden fence 1.2 m high: posts, two rails, upright boards.

    Args:
        line: (n, 3) [m].
        level: Of detail.
        ends: Not used: it ends as it runs on, with a post.
    """
    del ends
    if level == 2:
        return [Part(swept(line, _slab(0.02, 0.08, 1.15)), "street_wood")]
    each = (0.14, 0.5)[level]
    at, yaw = _along(line, each)
    wide = 0.36 * each
    meshes = [swept(line, _slab(0.02, z - 0.05, z + 0.05, shift=-0.03)) for z in (0.35, 0.95)]
    meshes.append(upright_boxes(at, (-wide, 0.0, 0.08), (wide, 0.022, 1.2), yaws=yaw))
    meshes.append(upright_boxes(line, (-0.05, -0.13, -0.4), (0.05, -0.05, 1.1)))
    return [Part(merge_meshes(meshes), "street_wood")]


MODELS: Mapping[str, Callable[..., list[Part]]] = {
    "concrete_barrier": concrete,
    "noise_barrier": noise,
    "chain_link": chain_link,
    "wooden": boards,
}
"""Builders of every model that is not a guard rail."""


def swept(line: Floats, profile: Floats, *, rise: Floats | None = None) -> Mesh:
    """Sweep a closed profile along a line and close its ends.

    Args:
        line: (n, 3) [m].
        profile: Convex or not, star-shaped about its first edge's side; counter-clockwise
            or clockwise (to the left, up), (k, 2) [m], without repetition.
        rise: Factor of heights above the ground at each point, (n,).
    """
    across = leftward(line)
    area = 0.5 * float(
        (
            profile[:, 0] * np.roll(profile[:, 1], -1) - np.roll(profile[:, 0], -1) * profile[:, 1]
        ).sum()
    )
    if area < 0:
        profile = profile[::-1]
    tall = np.ones(len(line)) if rise is None else rise
    count, k = len(line), len(profile)
    up = np.where(profile[:, 1] > 0, profile[:, 1] * tall[:, None], profile[:, 1])
    rings = line[:, None] + profile[:, :1] * across[:, None]
    rings[..., 2] += up
    i, j = np.meshgrid(np.arange(count - 1), np.arange(k), indexing="ij")
    after = (j + 1) % k
    # Every side has corners of its own: profiles have edges.
    quads = np.stack(
        [rings[i, j], rings[i, after], rings[i + 1, after], rings[i + 1, j]], axis=2
    ).reshape(-1, 4, 3)
    caps = [(rings[0], slice(None, None, -1)), (rings[-1], slice(None))]
    meshes = [quad_mesh(quads)]
    for ring, order in caps:
        meshes.append(_cap(ring[order]))
    return merge_meshes(meshes)


def quad_mesh(quads: Floats) -> Mesh:
    """Turn flat quads, (n, 4, 3) [m], into triangles with normals; what has no area goes."""
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    corners = quads[:, faces].reshape(-1, 3, 3)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(cross, axis=1)
    solid = size > 1e-8
    normals = np.repeat(cross[solid] / size[solid, None], 3, axis=0)
    vertices = corners[solid].reshape(-1, 3)
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), normals)


def upright_boxes(
    line: Floats,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    *,
    yaws: Floats | None = None,
) -> Mesh:
    """Build a box at every point of a line; x runs along it and y to its left.

    Args:
        line: (n, 3) [m].
        low: Lowest corner in the frame of a point [m].
        high: Highest corner [m].
        yaws: Directions at the points [rad], if the points do not tell.
    """
    if yaws is None:
        across = leftward(line)
    else:
        across = np.column_stack([-np.sin(yaws), np.cos(yaws), 0.0 * yaws])
    along = np.column_stack([across[:, 1], -across[:, 0], 0.0 * across[:, 0]])
    faces = box(low, high, skip="b")
    quads = (
        line[:, None, None]
        + faces[..., :1] * along[:, None, None]
        + faces[..., 1:2] * across[:, None, None]
        + faces[..., 2:] * [0.0, 0.0, 1.0]
    )
    return quad_mesh(quads.reshape(-1, 4, 3))


def _nearest(mesh: Mesh, line: Floats) -> Ints:
    """Find the point of the line that is nearest to the middle of each face, (m,)."""
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    away = np.linalg.norm(middles[:, None, :2] - line[None, :, :2], axis=2)
    return np.asarray(np.argmin(away, axis=1))


def _slab(half: float, low: float, high: float, *, shift: float = 0.0) -> Floats:
    """Outline a rectangular profile, counter-clockwise, (4, 2) [m]."""
    return np.array(
        [(shift - half, low), (shift + half, low), (shift + half, high), (shift - half, high)]
    )


def _ridges(level: int) -> Floats:
    """Outline the profile of noise panels: boards of half a metre with grooves between them."""
    if level:
        return _slab(0.06, 0.45, _NOISE)
    side: list[tuple[float, float]] = []
    for z in np.arange(0.45, _NOISE - 0.1, 0.51):
        top = min(z + 0.51, _NOISE)
        side += [(0.035, z), (0.035, z + 0.03), (0.06, z + 0.05), (0.06, top - 0.02)]
    side += [(0.075, _NOISE - 0.02), (0.075, _NOISE)]
    return np.array([*side, *((-x, z) for x, z in side[::-1])])


def _cap(ring: Floats) -> Mesh:
    """Close the end of a profile with strips between opposite corners."""
    half = len(ring) // 2
    quads = [[ring[i], ring[i + 1], ring[-2 - i], ring[-1 - i]] for i in range(half - 1)]
    return quad_mesh(np.array(quads))


def _taper(line: Floats, ends: tuple[bool, bool]) -> Floats:
    """Return the factor of a concrete barrier's height along its line, (n,)."""
    at = arc_length(line)
    rise = np.ones(len(line))
    if ends[0]:
        rise = np.minimum(rise, 0.25 + 0.75 * at / _TAPER)
    if ends[1]:
        rise = np.minimum(rise, 0.25 + 0.75 * (at[-1] - at) / _TAPER)
    return rise


def _along(line: Floats, each: float) -> tuple[Floats, Floats]:
    """Space points along a line, (m, 3) [m], and return the directions there [rad]."""
    step = np.diff(line, axis=0)
    knots = arc_length(line)
    at = np.arange(each / 2, knots[-1], each)
    points = np.column_stack([np.interp(at, knots, column) for column in line.T])
    which = np.clip(np.searchsorted(knots, at) - 1, 0, len(step) - 1)
    return points, np.arctan2(step[which, 1], step[which, 0])


def _wires(line: Floats) -> Mesh:
    """Build the mesh of a wire fence: two families of slanted wires as narrow quads."""
    at, yaw = _along(line, 0.12)
    tall = _LOW - 0.1
    along = np.column_stack([np.cos(yaw), np.sin(yaw), 0.0 * yaw])
    quads = []
    for side in (1.0, -1.0):
        foot = at + np.array([0.0, 0.0, 0.1])
        head = foot + side * 0.5 * tall * along + [0.0, 0.0, tall]
        # Wires that would leave the fence at its ends stop where it does.
        wide = _WIRE * along
        quads.append(np.stack([foot, foot + wide, head + wide, head], axis=1))
    return quad_mesh(np.concatenate(quads))
