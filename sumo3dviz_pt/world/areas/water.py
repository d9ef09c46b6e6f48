"""Lakes and rivers: a surface below the ground, a bank around it, walls below roads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.materials.by_key import KERB, planar_uvs
from sumo3dviz_pt.library.materials.named import principled
from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract
from sumo3dviz_pt.library.mesh.triangulate import triangulate_many
from sumo3dviz_pt.library.mesh.walls import between
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Bsdf, Part
from sumo3dviz_pt.world.areas.covers import WaterLook, land_covers, waves_file
from sumo3dviz_pt.world.placement.surroundings import HeightAt

MATERIAL = "water"
"""The material of its surface."""

_STILL = 4.0  # ground that differs more in height around it lets water flow [m]
_UNDER = 0.5  # how far the surface goes on below banks and walls [m]
_FOOT = 0.15  # depth of the foot of banks below the surface [m]
_STEP = 8.0  # distance of points at which the bank takes the ground's height [m]
_EARTH = np.array([[0.105, 0.095, 0.058], [0.090, 0.098, 0.046], [0.125, 0.108, 0.075]])
_GROUND = 0.03  # how far the ground lies below roads [m]
_BRIDGE = 1.5  # roads that much above the ground are bridges without walls [m]


@dataclass(frozen=True, slots=True, eq=False)
class Pool:
    """A body of water.

    Attributes:
        id: Unique.
        shape: Its outline at the height of the ground [m].
    """

    id: str
    shape: shapely.Geometry


def water_depth() -> float:
    """Return how far water lies below the road beside it [m]."""
    return land_covers().water.depth + _GROUND


def water_parts(
    pool: Pool,
    look: WaterLook,
    *,
    height_at: HeightAt,
    near: tuple[float, float],
) -> list[Part]:
    """Build the surface of water and the bank around it.

    Args:
        pool: The water.
        look: Its depth, and the width of banks.
        height_at: Height of the ground.
        near: A point of the network [m] near which texture coordinates are small.
    """
    shape = shapely.segmentize(pool.shape, _STEP)
    level_at = _levels(shape, look.depth, height_at)
    # The surface goes on below the banks, so that no gap shows.
    wide = polygon_parts(shapely.buffer(shape, _UNDER, join_style="mitre"))
    made = triangulate_many(wide)
    points = np.column_stack([made.vertices, level_at(made.vertices)])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    uvs = planar_uvs(points, tile=look.waves.tile, near=near)
    parts = [Part(Mesh(points, made.faces, up, uvs), MATERIAL)]
    bank = _bank(shape, look.bank, level_at, height_at)
    if len(bank.faces):
        rng = np.random.default_rng(len(bank.faces))
        tint = _EARTH[rng.integers(0, len(_EARTH), len(bank.faces))]
        parts.append(Part(bank, "bark", tint * rng.uniform(0.85, 1.15, (len(tint), 1))))
    return parts


def _levels(
    shape: shapely.Geometry, depth: float, height_at: HeightAt
) -> Callable[[Floats], Floats]:
    """The height of the surface at places: one for still water, else below the ground there."""
    heights = height_at(shapely.get_coordinates(shape))
    if float(np.ptp(heights)) < _STILL:
        level = float(heights.min()) - depth
        return lambda places: np.full(len(places), level)
    return lambda places: height_at(places) - depth


def _bank(
    shape: shapely.Geometry,
    width: float,
    level_at: Callable[[Floats], Floats],
    height_at: HeightAt,
) -> Mesh:
    """A slope from the ground down to below the surface, inside the outline."""
    inner = shapely.buffer(shape, -width, quad_segs=2)
    if inner.area < 0.4 * shape.area:
        inner = shapely.buffer(shape, -0.2 * width, quad_segs=2)
    band = polygon_parts(subtract(shape, [shapely.segmentize(inner, _STEP)]))
    made = triangulate_many(band)
    rim = shapely.distance(shapely.boundary(shape), shapely.points(made.vertices)) < 1e-3
    low = level_at(made.vertices) - _FOOT
    z = np.where(rim, height_at(made.vertices) + 0.01, low)
    return Mesh(np.column_stack([made.vertices, z]), made.faces)


def shore_walls(
    pools: Sequence[Pool],
    outline: Sequence[shapely.Geometry],
    *,
    depth: float,
    height_at: HeightAt,
    road_at: HeightAt,
) -> list[Part]:
    """Build walls from the edges of roads that cross water down into it.

    Args:
        pools: All water.
        outline: What is paved.
        depth: Of the water's surface below the ground [m].
        height_at: Height of the ground.
        road_at: Height of the nearest road.
    """
    meshes = []
    for pool in pools:
        low, high = np.reshape(pool.shape.bounds, (2, 2))
        near = shapely.clip_by_rect(list(outline), *(low - 5.0), *(high + 5.0))
        for area in (area for area in near if not area.is_empty):
            edge = shapely.boundary(shapely.buffer(area, 0.1, join_style="mitre"))
            crossing = shapely.line_merge(shapely.intersection(edge, pool.shape))
            for line in shapely.get_parts(crossing).tolist():
                if line.geom_type == "LineString" and line.length > 0.3:
                    meshes += _walls(line, depth, height_at, road_at)
    return [Part(merge_meshes(meshes), KERB)] if meshes else []


def _walls(
    line: shapely.LineString, depth: float, height_at: HeightAt, road_at: HeightAt
) -> list[Mesh]:
    """A wall along a line, seen from both sides; none below bridges."""
    places = shapely.get_coordinates(shapely.segmentize(line, _STEP))
    ground = height_at(places)
    if float(np.max(road_at(places) - ground)) > _BRIDGE:
        return []
    top = np.column_stack([places, np.maximum(ground + 0.02, road_at(places) - 0.08)])
    foot = np.column_stack([places, ground - depth - 0.5])
    return [between(top, foot), between(top[::-1], foot[::-1])]


def water_material(look: WaterLook, *, textured: bool) -> Bsdf:
    """Describe the surface of water: dark below a reflection that small waves break.

    Args:
        look: Its numbers.
        textured: False leaves the waves out.
    """
    still = principled(look.colour, roughness=look.roughness, specular=look.specular)
    if not textured:
        return still
    waves = {"type": "bitmap", "filename": waves_file(), "raw": True}
    return {"type": "normalmap", "normalmap": waves, "bsdf": still}
