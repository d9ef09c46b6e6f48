"""The land beyond what is built: level, then fields, woods and hills that close the horizon."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, settled
from sumo3dviz_pt.model.vectors import area_vectors, unit
from sumo3dviz_pt.world.land.relief import Relief, field_tints, relief

RADIUS = 20_000.0
"""Where the ground ends, beyond what is built [m]."""

TEXTURED = 260.0
"""How far from what is built the ground shows its texture [m]; beyond, plain colours."""

FAR_GROUND = "far_ground"
"""The material of the ground beyond."""

GREEN = ("grass", "forest", "halloween", "meadow")
"""Words in the names of grounds on which things grow."""

_SEGMENTS = 128


@dataclass(frozen=True, slots=True, eq=False)
class Land:
    """The land around what is built.

    Attributes:
        hull: Convex, around all that is built.
        relief: Of its hills; None where it is flat.
        wooded: Whether forests stand on it.
        seed: Of all chance.
    """

    hull: shapely.Polygon
    relief: Relief | None
    wooded: bool
    seed: int

    @property
    def plain(self) -> bool:
        """Whether nothing stands or rises on it, so that its texture goes to the horizon."""
        return self.relief is None and not self.wooded

    def away(self, points: Floats) -> Floats:
        """Return the distance of points, (n, 2) [m], from the hull, (n,) [m]; 0 inside."""
        return np.asarray(shapely.distance(self.hull, shapely.points(points[:, :2])))

    def heights(self, points: Floats) -> Floats:
        """Return the height of hills at points, (n, 2) [m], as (n,) [m]."""
        if self.relief is None:
            return np.zeros(len(points))
        return self.relief.heights(points[:, :2], self.away(points))


def land_around(outlines: Floats, *, horizon: str, surface: str, seed: int) -> Land:
    """Return the land around what is built.

    Args:
        outlines: Points that the hull must hold, (n, 2) [m], n >= 1.
        horizon: `flat`, `trees`, `hills`, or `auto`: hills on natural grounds.
        surface: The ground's name.
        seed: Of all chance.
    """
    hull = shapely.MultiPoint(settled(outlines)).convex_hull.buffer(30.0, quad_segs=4)
    if horizon == "auto":
        horizon = "flat" if "chess" in surface or surface.startswith("#") else "hills"
    green = any(word in surface for word in GREEN)
    hills = relief(seed + 11) if horizon == "hills" else None
    return Land(hull, hills, green and horizon != "flat", seed)


def built_points(outlines: Floats, boundary: tuple[float, float, float, float]) -> Floats:
    """Return points that the hull of what is built must hold, (n, 2) [m]."""
    if len(outlines):
        return np.asarray(shapely.get_coordinates(union(outlines).convex_hull))
    x0, y0, x1, y1 = boundary
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def land_mesh(land: Land, level: float) -> Mesh:
    """Build rings around the hull's middle, level within it, up to the end of the world.

    Args:
        land: Gives hull and hills.
        level: Height of the plain [m].
    """
    turn = np.linspace(0.0, 2.0 * np.pi, _SEGMENTS, endpoint=False)
    ray = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    centre = np.array(land.hull.centroid.coords[0])
    reach = _reach(land.hull, centre, ray)
    inside = np.array([0.35, 0.7, 0.9])
    near = np.array([0.0, 60.0, 120.0, 190.0, TEXTURED, 340.0, 430.0, 530.0, 640.0, 760.0])
    beyond = np.concatenate([near, np.geomspace(900.0, 9000.0, 26), [12_000.0, RADIUS]])
    radii = np.concatenate([inside[:, None] * reach, beyond[:, None] + reach])
    flat = centre + np.concatenate([np.zeros((1, 2)), (radii[..., None] * ray).reshape(-1, 2)])
    vertices = np.column_stack([flat, level + land.heights(flat)])
    return Mesh(vertices, _polar_faces(len(radii), _SEGMENTS))


def split_far(mesh: Mesh, land: Land) -> tuple[Mesh, Mesh]:
    """Return the mesh's faces near what is built, and those beyond, with smooth normals."""
    away = land.away(mesh.vertices)
    far = np.asarray((away[mesh.faces] > TEXTURED - 1.0).all(axis=1))
    smooth = mesh if mesh.normals is not None else replace(mesh, normals=_normals(mesh))
    return _chosen(smooth, ~far), _chosen(smooth, far)


def far_tints(mesh: Mesh, land: Land, mean: Floats) -> Floats:
    """Return the reflectance of each far face, (m, 3): like the near ground first, then fields.

    Args:
        mesh: The ground far from what is built.
        land: What grows where.
        mean: Reflectance of the near ground, (3,).
    """
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    if not land.wooded:
        return np.tile(mean, (len(middles), 1))
    away = land.away(middles)
    fields = field_tints(middles[:, :2], mean, seed=land.seed + 3, variety=1.0)
    share = smoothstep(TEXTURED, TEXTURED + 150.0, away)[:, None]
    tint = mean + share * (fields - mean)
    if land.relief is not None:
        woods = land.relief.wooded(middles[:, :2], away) * smoothstep(900.0, 2200.0, away)
        # Far woods are too many for single trees: their floor has the crowns' colour.
        tint = tint + 0.8 * woods[:, None] * (np.array([0.045, 0.075, 0.024]) - tint)
    return np.clip(tint, 0.01, 0.8)


def _normals(mesh: Mesh) -> Floats:
    """Area-weighted vertex normals, (n, 3)."""
    areas = area_vectors(mesh.vertices, mesh.faces)
    total = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(total, mesh.faces[:, k], areas)
    return unit(total)


def _chosen(mesh: Mesh, keep: Bools) -> Mesh:
    """Some faces of a mesh, without unused vertices."""
    used, faces = np.unique(mesh.faces[keep], return_inverse=True)
    normals = None if mesh.normals is None else mesh.normals[used]
    return Mesh(mesh.vertices[used], faces.reshape(-1, 3), normals)


def _reach(hull: shapely.Polygon, centre: Floats, rays: Floats) -> Floats:
    """Distance from the centre to the border of a convex polygon along rays, (n,) [m]."""
    ring = shapely.get_coordinates(shapely.orient_polygons(hull).exterior)
    edge = np.diff(ring, axis=0)
    normal = np.column_stack([edge[:, 1], -edge[:, 0]])
    along = rays @ normal.T
    distance = ((ring[:-1] - centre) * normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(along > 1e-9, distance / along, np.inf).min(axis=1))


def _polar_faces(rings: int, segments: int) -> Ints:
    """Triangles of a fan around vertex 0 and of rings around it, facing up, (m, 3)."""
    column = np.arange(segments)
    after = (column + 1) % segments
    fan = np.stack([np.zeros_like(column), 1 + column, 1 + after], axis=1)
    inner = 1 + (np.arange(rings - 1) * segments)[:, None]
    a, b = inner + column, inner + after
    c, d = b + segments, a + segments
    quads = [np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, c, b], -1).reshape(-1, 3)]
    return np.concatenate([fan, *quads])
