"""Meshes and materials of land covers: areas, what is drawn on them, and slabs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.materials import (
    TINT,
    mean_reflectance,
    metres_per_tile,
    planar_uvs,
    surface_bsdf,
)
from sumo3dviz_pt.library.mesh.bands import walls
from sumo3dviz_pt.library.mesh.planar import polygon_parts
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Bsdf, Part
from sumo3dviz_pt.world.areas.covers import MATERIAL, WATER, Area, LandCovers, water_material
from sumo3dviz_pt.world.areas.drape import GroundFaces
from sumo3dviz_pt.world.areas.patterns import PatternShapes
from sumo3dviz_pt.world.placement.surroundings import HeightAt

LIFT, LINES = 0.012, 0.020
"""How far areas, and what is drawn on them, lie above the ground [m]."""

AREA = "area:"
"""Materials of surfaces that take the colour of each face begin with this."""


@dataclass(frozen=True, slots=True, eq=False)
class LaidArea:
    """Ground with one cover.

    Attributes:
        cover: The cover's name.
        colour: Mean linear reflectance; None leaves the surface's own.
        shape: In plan [m].
        lift: Above the ground [m].
        area: The scenario's, or None for gardens.
    """

    cover: str
    colour: Colour | None
    shape: shapely.Geometry
    lift: float
    area: Area | None = None


def cover_parts(
    laid: Sequence[LaidArea], covers: LandCovers, faces: GroundFaces, origin: tuple[float, float]
) -> list[Part]:
    """Build areas on the ground, in their surfaces and colours.

    Args:
        laid: The areas.
        covers: The table.
        faces: The ground's triangles.
        origin: A point of the network [m] near which texture coordinates are small.
    """
    parts = []
    for some in laid:
        surface = MATERIAL if some.cover == WATER else covers.covers[some.cover].surface
        mesh = faces.draped([some.shape], lift=some.lift).mesh
        if not len(mesh.faces):
            continue
        if surface == MATERIAL:
            uvs = planar_uvs(mesh.vertices, tile=covers.water.waves.tile, near=origin)
            parts.append(Part(replace(mesh, uvs=uvs), MATERIAL))
            continue
        uvs = planar_uvs(mesh.vertices, tile=metres_per_tile(surface), near=origin)
        parts.append(_tinted(replace(mesh, uvs=uvs), surface, some.colour))
    return parts


def pattern_parts(
    drawn: Sequence[PatternShapes],
    faces: GroundFaces,
    height_at: HeightAt,
    origin: tuple[float, float],
) -> list[Part]:
    """Build what is drawn on areas, flat or as low blocks.

    Args:
        drawn: The shapes.
        faces: The ground's triangles.
        height_at: Height of the ground.
        origin: A point of the network [m] near which texture coordinates are small.
    """
    parts = []
    for some in drawn:
        lift = some.height or (LINES if some.surface is None else 0.5 * (LIFT + LINES))
        sheet = faces.draped(some.shapes, lift=lift).mesh
        meshes = [sheet]
        if some.height:
            meshes = [replace(sheet, normals=None), *_sides(some, height_at)]
        mesh = merge_meshes(meshes)
        if some.surface is not None:
            uvs = planar_uvs(mesh.vertices, tile=metres_per_tile(some.surface), near=origin)
            parts.append(_tinted(replace(mesh, uvs=uvs), some.surface, some.colour))
        else:
            tint = np.tile(some.colour, (len(mesh.faces), 1))
            parts.append(Part(replace(mesh, normals=None), "wall", tint))
    return [part for part in parts if len(part.mesh.faces)]


def _sides(some: PatternShapes, height_at: HeightAt) -> list[Mesh]:
    """Walls below the tops of blocks."""
    rings, feet = [], []
    for shape in some.shapes:
        for part in polygon_parts(shape):
            whole = shapely.orient_polygons(shapely.segmentize(part, 12.0))
            for ring in (whole.exterior, *whole.interiors):
                flat = shapely.get_coordinates(ring)[:-1]
                foot = np.column_stack([flat, height_at(flat) - 0.05])
                rings.append(foot + np.array([0.0, 0.0, some.height + 0.05]))
                feet.append(foot)
    return [walls(rings, feet)] if rings else []


def _tinted(mesh: Mesh, surface: str, colour: Colour | None) -> Part:
    """A mesh that shows a surface in a colour."""
    tint: Floats = mean_reflectance(surface) if colour is None else np.array(colour)
    return Part(mesh, f"{AREA}{surface}", np.tile(tint, (len(mesh.faces), 1)))


def coloured(part: Part) -> Part:
    """Return a slab in its surface's own colour; any other part as it is."""
    if not part.material.startswith(AREA):
        return part
    return _tinted(part.mesh, part.material.removeprefix(AREA), None)


def is_own(material: str) -> bool:
    """Return whether `cover_material` describes a material."""
    return material == MATERIAL or material.startswith(AREA)


def cover_material(name: str, covers: LandCovers) -> Bsdf:
    """Return the material of a surface that takes the colour of each face, or of water."""
    if name == MATERIAL:
        return water_material(covers.water, textured=True)
    entry = catalog.find("surfaces", name.removeprefix(AREA))
    bsdf = surface_bsdf(entry)
    # Meadows have patches of other colours; what has a colour of its own has none.
    texture = {k: v for k, v in bsdf["base_color"].items() if k not in ("wear", "patches")}
    roughness = bsdf["roughness"]
    stained = {
        "type": "stained",
        "texture": texture,
        "tint": TINT,
        "mean": [float(value) for value in entry.meta["albedo"]],
    }
    if not isinstance(roughness, float | int):
        roughness = float(roughness.get("roughness", 0.8))
    return {**bsdf, "base_color": stained, "roughness": roughness}
