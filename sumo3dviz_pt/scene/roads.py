"""Roads: surfaces, kerbs, rails and markings of a network as static parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.job import RoadSettings
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import Bsdf, Part, StaticPart
from sumo3dviz_pt.scene.materials import MATERIALS
from sumo3dviz_pt.scene.roads_areas import (
    JunctionInside,
    junction_cells,
    junction_insides,
    sliver_cells,
    walking_cells,
)
from sumo3dviz_pt.scene.roads_cells import Cells, join_cells, lane_cells, without_overlaps
from sumo3dviz_pt.scene.roads_mesh import (
    SIDEWALK_HEIGHT,
    kerb_faces,
    raised_area,
    surface_meshes,
)
from sumo3dviz_pt.scene.roads_strips import BoundsXY, Strip, network_strips
from sumo3dviz_pt.scene.surfaces import KERB, material_name, surface_material

_RAMP = 0.4
"""Walkers climb a kerb over this distance [m], half of it on either side."""


@dataclass(frozen=True, slots=True, eq=False)
class RoadLayout:
    """The road surface before it becomes meshes.

    Attributes:
        cells: Pieces without overlaps.
        strips: Lanes of normal edges, from right to left, by edge id.
        insides: Contents of junctions, by junction id.
    """

    cells: Cells
    strips: Mapping[str, tuple[Strip, ...]]
    insides: Mapping[str, JunctionInside]


@dataclass(frozen=True, slots=True, eq=False)
class RoadParts:
    """Roads, ready for the scene.

    Attributes:
        static: Surfaces, kerbs, rails and markings.
        materials: Their materials by name.
        layout: What they were made from; the ground needs it.
        surface_height_at: Extra height of the walkable surface [m] at points
            (n, 2) [m], as (n,): 0 on the carriageway, a kerb's height on footways.
    """

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    layout: RoadLayout
    surface_height_at: Callable[[Floats], Floats]


def layout_roads(
    network: Network, settings: RoadSettings, *, region: BoundsXY | None = None
) -> RoadLayout:
    """Lay out the road surface without overlaps or gaps.

    Args:
        network: The network.
        settings: Surfaces, widths and overrides.
        region: Only lanes and junctions that touch this box are built [m].
    """
    strips = network_strips(network, settings, region=region)
    insides = junction_insides(network, settings, region=region)
    carriageways = _lane_cells(strips, raised=False)
    footways = _lane_cells(strips, raised=True)
    lanes = join_cells([carriageways, footways])
    walks = walking_cells(insides)
    slivers = sliver_cells(network, settings, strips)
    junctions = junction_cells(network, settings, insides=insides, lanes=join_cells([lanes, walks]))
    cells = without_overlaps(join_cells([lanes, walks, slivers, junctions]))
    return RoadLayout(cells, strips, insides)


def build_roads(
    network: Network,
    settings: RoadSettings,
    *,
    textured: bool,
    region: BoundsXY | None = None,
) -> RoadParts:
    """Build the roads of a network.

    Args:
        network: The network.
        settings: Surfaces, markings, widths and overrides.
        textured: False gives matt constant colours.
        region: x0, y0, x1, y1 [m]; only lanes that touch it are built.

    Raises:
        ConfigError: If a surface is unknown.
    """
    layout = layout_roads(network, settings, region=region)
    near = network.location.boundary[:2]
    materials: dict[str, Bsdf] = {}
    static = []
    for surface, mesh in surface_meshes(layout.cells, near=near).items():
        name = KERB if surface == KERB else material_name(surface)
        materials[name] = MATERIALS[KERB] if surface == KERB else surface_material(
            surface, textured=textured
        )
        static.append(StaticPart(f"road/{surface}", "roads", Part(mesh, name)))
    for key, mesh, material in _details(layout):
        materials[material] = MATERIALS[material]
        static.append(StaticPart(key, "roads", Part(mesh, material)))
    return RoadParts(tuple(static), materials, layout, walking_height(layout))


def walking_height(layout: RoadLayout) -> Callable[[Floats], Floats]:
    """A function that gives the extra height of the walkable surface at points.

    It climbs smoothly across the kerb, so that walkers do not jump.
    """
    areas = raised_area(layout.cells)
    tree = shapely.STRtree(areas)
    edges = shapely.boundary(areas)
    edge_tree = shapely.STRtree(edges)

    def surface_height_at(points: Floats) -> Floats:
        """Extra height at points, (n, 2) [m], as (n,) [m]."""
        spots = shapely.points(np.asarray(points, dtype=np.float64)[:, :2])
        inside = np.zeros(len(spots), dtype=bool)
        inside[tree.query(spots, predicate="intersects")[0]] = True
        signed = np.where(inside, _RAMP, -_RAMP)
        (near, _), away = edge_tree.query_nearest(
            spots, max_distance=_RAMP, return_distance=True, all_matches=False
        )
        signed[near] = np.where(inside[near], away, -away)
        share = np.clip(signed / _RAMP + 0.5, 0.0, 1.0)
        return np.asarray(SIDEWALK_HEIGHT * share * share * (3.0 - 2.0 * share))

    return surface_height_at


def _lane_cells(strips: Mapping[str, tuple[Strip, ...]], *, raised: bool) -> Cells:
    """Cells of all lanes that are raised, or all that are not."""
    chosen = [
        (strip, key) for key, group in strips.items() for strip in group if strip.look.raised == raised
    ]
    return lane_cells([strip for strip, _ in chosen], [key for _, key in chosen])


def _details(layout: RoadLayout) -> list[tuple[str, Mesh, str]]:
    """Id, mesh and material of what stands on the surface."""
    parts = [("road/kerb_faces", kerb_faces(layout.cells), KERB)]
    return [part for part in parts if len(part[1].faces)]
