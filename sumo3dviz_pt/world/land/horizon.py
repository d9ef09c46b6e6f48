"""The land beyond what is built: fields, hills and woods that close the horizon.

Heights of hills and colours of fields are functions of the place. Tree lines and forests are cheap
far trees.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Literal

import numpy as np
import shapely
from scipy import ndimage
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.mesh.noise import Spectrum, fractal, smoothstep
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.library.plants.greenery import CORE_FACES, FarTrees, far_trees
from sumo3dviz_pt.model.camera import CameraPath, in_mirrors, in_picture
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh, area_vectors, settled, unit
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Poi, Polygon

_TILE = 14_000.0  # the relief repeats after this far [m]
_FIELD = 210.0  # width of a field [m]
_SIZE = 256
_EDGE: Literal["grid-wrap"] = "grid-wrap"  # it repeats


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Noise over the plane, as coefficients of cubic splines.

    Attributes:
        swell: Hills, (n, n); their values lie in about [-2, 2].
        woods: Where forests stand, (n, n), in the same range.
    """

    swell: Floats
    woods: Floats

    def heights(self, points: Floats, away: Floats) -> Floats:
        """Return height above the plain, (n,) [m], never below it.

        Level near what is built, then low hills, and from 5 km on ridges that
        close the horizon also for eyes high above the roads.

        Args:
            points: (n, 2) [m].
            away: Distance from what is built, (n,) [m].
        """
        share = np.clip(0.5 + 0.27 * _sampled(self.swell, points, _TILE), 0.0, 1.0)
        rolling = 62.0 * smoothstep(450.0, 1900.0, away) * share
        ridges = 170.0 * smoothstep(1500.0, 5200.0, away) * (0.45 + 0.55 * share)
        return np.asarray(rolling + ridges)

    def wooded(self, points: Floats, away: Floats) -> Floats:
        """Return how likely a place bears forest, (n,) in [0, 1]; hills more than plains."""
        bias = 0.9 * smoothstep(500.0, 3000.0, away) - 0.55
        value = _sampled(self.woods, points, 2300.0) + bias
        return smoothstep(-0.12, 0.12, value)


@lru_cache(maxsize=4)
def relief(seed: int) -> Relief:
    """Return the relief of a seed; the same everywhere and always."""
    swell = fractal((_SIZE, _SIZE), Spectrum(2.0, 4.0, 60.0), seed=seed)
    woods = fractal((_SIZE, _SIZE), Spectrum(1.6, 3.0, 60.0), seed=seed + 1)
    return Relief(*(ndimage.spline_filter(noise, order=3, mode=_EDGE) for noise in (swell, woods)))


def field_tints(points: Floats, mean: Floats, *, seed: int, variety: float) -> Floats:
    """Reflectance of the fields that places lie in, (n, 3).

    Args:
        points: (n, 2) [m].
        mean: Reflectance of the ground nearby, (3,).
        seed: Of their colours.
        variety: 0 gives the mean everywhere, 1 meadows, crops and stubble.
    """
    # Strips of land lie askew, or they would show the axes of the grid.
    x, y = points.T
    turned = np.column_stack([0.86 * x - 0.51 * y, 0.51 * x + 0.86 * y])
    cell = np.floor(settled(turned / [_FIELD, 0.6 * _FIELD])).astype(np.int64)
    number = (cell[:, 0] * 73_856_093) ^ (cell[:, 1] * 19_349_663)
    pick = np.random.default_rng(seed).random(4096)[number % 4096]
    palette = np.array(
        [[1.0, 1.0, 1.0], [0.82, 0.9, 0.85], [1.25, 1.12, 1.05], [1.9, 1.35, 1.6], [0.9, 1.08, 0.8]]
    )
    factor = palette[(pick * len(palette)).astype(np.int64)]
    return np.asarray(mean * (1.0 + variety * (factor - 1.0)))


def _sampled(splines: Floats, points: Floats, tile: float) -> Floats:
    """Periodic noise at places, smoothly interpolated, (n,)."""
    at = points.T / tile * len(splines)
    heights = ndimage.map_coordinates(splines, at, order=3, mode=_EDGE, prefilter=False)
    return np.asarray(heights)


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
    return chosen_faces(smooth, ~far), chosen_faces(smooth, far)


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


def chosen_faces(mesh: Mesh, keep: Bools) -> Mesh:
    """Some faces of a mesh, without unused vertices."""
    used, faces = np.unique(mesh.faces[keep], return_inverse=True)
    normals = None if mesh.normals is None else mesh.normals[used]
    uvs = None if mesh.uvs is None else mesh.uvs[used]
    return Mesh(mesh.vertices[used], faces.reshape(-1, 3), normals, uvs)


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


LINE_TUFTS, GROVE_TUFTS = 110, 34
"""Triangles around the core of a single tree, and of a grove farther away."""

MOST = 24_000
"""Triangles of the tree line, and again of the groves, at most."""

_LEAVES = np.array([[0.088, 0.140, 0.040], [0.070, 0.122, 0.036], [0.050, 0.088, 0.036]])
_CLEAR = 45.0  # distance from objects and cameras [m]
_NEAREST = 230.0  # closer to a camera they would not pass for trees [m]
_GROVE = 2.6  # width of a grove by that of a tree


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """What woods must leave free, and the cameras that look at them.

    Attributes:
        taken: Objects and cameras, (n, 2) [m].
        camera_path: Where the cameras look, or None: then everything counts as seen.
    """

    taken: Floats
    camera_path: CameraPath | None = None


def woods(land: Land, *, height_at: Callable[[Floats], Floats], room: Room) -> tuple[Part, ...]:
    """Build a tree line at the fields' edge and groves on the hills behind.

    Args:
        land: What grows where.
        height_at: Height of the ground.
        room: What they leave free; what no camera sees is left out.
    """
    if not land.wooded:
        return ()
    rng = np.random.default_rng(land.seed + 29)
    eyes = None if room.camera_path is None else room.camera_path.eyes
    parts = []
    for places, scale, tufts in (
        (_line(land, rng), 1.0, LINE_TUFTS),
        (_groves(land, rng), _GROVE, GROVE_TUFTS),
    ):
        trees = grown(places, height_at(places), scale, rng)
        trees = _far_woods_chosen(trees, room, MOST // (CORE_FACES + tufts))
        mesh, tint = far_trees(trees, tufts=tufts, rng=rng, eyes=eyes)
        if len(mesh.faces):
            parts.append(Part(mesh, "leaf", tint))
    return tuple(parts)


def occupied(pois: Sequence[Poi], polygons: Sequence[Polygon], eyes: Floats) -> Floats:
    """Return where woods must not stand: objects and cameras, (n, 2) [m].

    Args:
        pois: All points of interest.
        polygons: All polygons and lines.
        eyes: Cameras, (k, 3) [m].
    """
    points = np.array([poi.position for poi in pois], dtype=np.float64).reshape(-1, 2)
    return np.concatenate([points, *(item.shape[:, :2] for item in polygons), eyes[:, :2]])


def _line(land: Land, rng: np.random.Generator) -> Floats:
    """Places in a broken belt around the hull, nearest first, (n, 2) [m]."""
    belt = land.hull.buffer(300.0, quad_segs=8).exterior
    at = np.arange(0.0, belt.length, 6.5)
    spine = shapely.get_coordinates(shapely.line_interpolate_point(belt, at))
    # The belt swings in and out, so that it is no circle.
    centre = np.array(land.hull.centroid.coords[0])
    outward = (spine - centre) / np.linalg.norm(spine - centre, axis=1, keepdims=True)
    phase = rng.uniform(0, 6.28, 3)
    swing = sum(
        np.sin(at / length + p) for length, p in zip((170.0, 73.0, 39.0), phase, strict=True)
    )
    places = spine + outward * (45.0 * swing + rng.normal(0, 14.0, len(at)))[:, None]
    hedged = np.sin(at / 260.0 + phase[1]) + 0.6 * np.sin(at / 97.0 + phase[2]) > -0.45
    return np.asarray(places[hedged & (land.away(places) > 180.0)])


def _groves(land: Land, rng: np.random.Generator) -> Floats:
    """Places of groves in wooded land, nearest first, (n, 2) [m]."""
    cover = land.relief or relief(land.seed + 11)
    x0, y0, x1, y1 = land.hull.buffer(2600.0).bounds
    step = max(30.0, float(np.hypot(x1 - x0, y1 - y0)) / 190.0)
    x, y = np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step))
    places = np.column_stack([x.ravel(), y.ravel()])
    places = places + rng.uniform(-0.45, 0.45, places.shape) * step
    away = land.away(places)
    likely = cover.wooded(places, away) > rng.uniform(0.2, 0.8, len(places))
    keep = likely & (away > 420.0) & (away < 2600.0)
    return np.asarray(places[keep][np.argsort(away[keep], kind="stable")])


def _far_woods_chosen(trees: FarTrees, room: Room, most: int) -> FarTrees:
    """Trees that stand free and in the picture, the nearest to a camera."""
    feet = trees.feet
    keep = np.ones(len(feet), dtype=np.bool_)
    if len(room.taken) and len(feet):
        distance, _ = cKDTree(room.taken).query(feet[:, :2])
        keep &= np.asarray(distance) > _CLEAR
    rank = np.arange(len(feet))
    if room.camera_path is not None and len(feet):
        seen = in_picture(room.camera_path, feet, radius=40.0)
        seen |= in_mirrors(room.camera_path, feet, radius=40.0)
        keep &= seen.any(axis=1)
        eyes = np.asarray(cKDTree(room.camera_path.positions[:, :2]).query(feet[:, :2])[0])
        keep &= eyes > _NEAREST
        rank = np.argsort(eyes, kind="stable")
    index = rank[keep[rank]][:most]
    columns = (getattr(trees, field.name)[index] for field in fields(FarTrees))
    return FarTrees(*columns)


def grown(places: Floats, ground: Floats, scale: float, rng: np.random.Generator) -> FarTrees:
    """Return trees or groves with sizes and colours drawn by chance.

    Args:
        places: (n, 2) [m].
        ground: Its height there, (n,) [m].
        scale: Width by that of a tree.
        rng: Source of chance.
    """
    count = len(places)
    cones = (rng.random(count) < 0.22).astype(np.float64)
    heights = rng.uniform(8.0, 15.0, count) * (1.0 + 0.25 * cones) * min(scale, 1.25)
    widths = rng.uniform(8.5, 14.0, count) * (1.0 - 0.4 * cones) * scale
    which = np.where(cones > 0.5, 2, rng.integers(0, 2, count))
    tints = _LEAVES[which] * rng.uniform(0.8, 1.2, (count, 1))
    feet = np.column_stack([places, ground - 0.2])
    return FarTrees(feet, widths, heights, cones, tints)
