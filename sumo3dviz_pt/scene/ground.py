"""The ground around the roads, out to beyond the horizon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.job import GroundSettings
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import Bsdf, Part, StaticPart
from sumo3dviz_pt.scene.materials import MATERIALS
from sumo3dviz_pt.scene.roads_layout import RoadLayout
from sumo3dviz_pt.scene.surfaces import (
    KERB,
    metres_per_tile,
    planar_uvs,
    surface_material,
)
from sumo3dviz_pt.scene.terrain import retaining_walls, terrain
from sumo3dviz_pt.shapes.grids import polar_grid

RADIUS = 20_000.0
"""Where the ground ends [m]; the Earth's horizon for an eye at 30 m."""

DROP = 0.03
"""How far level ground lies below the road surface [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundParts:
    """The ground, ready for the scene.

    Attributes:
        static: Its meshes.
        materials: Their materials by name.
        height_at: Height of the ground at places, (n, 2) -> (n,) [m].
    """

    static: tuple[StaticPart, ...]
    materials: dict[str, Bsdf]
    height_at: Callable[[Floats], Floats]


def build_ground(
    settings: GroundSettings, network: Network, *, roads: RoadLayout, textured: bool
) -> GroundParts:
    """Build the ground: level, or a terrain that follows sloped roads from below.

    Args:
        settings: Surface and its scale.
        network: The network.
        roads: `RoadParts.layout`.
        textured: False gives a matt constant colour.

    Raises:
        ConfigError: If the surface is unknown.
    """
    tile = metres_per_tile(settings.texture) * settings.scale
    name = f"ground:{settings.texture}"
    materials: dict[str, Bsdf] = {name: surface_material(settings.texture, textured=textured)}
    near = network.location.boundary[:2]
    walls = merge_meshes([])
    height_at: Callable[[Floats], Floats]
    if roads.cells.is_flat:
        mesh = level_ground(network, roads)
        level = road_level(roads, network) - DROP
        height_at = partial(_level, level)
    else:
        mesh, height_at = terrain(roads, network)
        walls = retaining_walls(roads, height_at)
    mesh = replace(mesh, uvs=planar_uvs(mesh.vertices, tile=tile, near=near))
    static = [StaticPart("ground", "ground", Part(mesh, name))]
    if len(walls.faces):
        materials[KERB] = MATERIALS[KERB]
        static.append(StaticPart("ground/walls", "ground", Part(walls, KERB)))
    return GroundParts(tuple(static), materials, height_at)


def _level(height: float, places: Floats) -> Floats:
    """The same height everywhere, (n,) [m]."""
    return np.full(len(places), height)


def level_ground(network: Network, roads: RoadLayout) -> Mesh:
    """A disc just below level roads."""
    x0, y0, x1, y1 = network.location.boundary
    if len(roads.outline):
        # Some files carry a boundary that does not hold their roads.
        extent = np.array([[x0, y0], [x1, y1], *shapely.total_bounds(roads.outline).reshape(2, 2)])
        (x0, y0), (x1, y1) = extent.min(axis=0), extent.max(axis=0)
    centre = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1), road_level(roads, network) - DROP])
    reach = 0.5 * float(np.hypot(x1 - x0, y1 - y0))
    near = np.linspace(0.0, reach + 200.0, 12)[1:]
    far = np.geomspace(reach + 400.0, reach + RADIUS, 12)
    grid = polar_grid(np.concatenate([near, far]), segments=48)
    return Mesh(grid.vertices + centre, grid.faces)


def road_level(roads: RoadLayout, network: Network) -> float:
    """Height of level roads [m]: of those that are built, or else of all."""
    quads = roads.cells.quads[..., 2]
    known: Floats = quads[np.isfinite(quads)]
    if not len(known):
        known = np.array([lane.shape[0, 2] for lane in network.lanes.values()])
    return float(known.mean()) if len(known) else 0.0
