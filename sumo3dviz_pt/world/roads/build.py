"""Roads: surfaces, kerbs, rails and markings of a network as static parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.materials.by_key import (
    KERB,
    material_name,
    metres_per_tile,
    planar_uvs,
    surface_material,
)
from sumo3dviz_pt.library.materials.named import MATERIALS
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scene import Bsdf, Part, StaticPart
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.rails.beds import shoulder
from sumo3dviz_pt.world.rails.tracks import track_parts, track_rise
from sumo3dviz_pt.world.roads.cells import Polygons
from sumo3dviz_pt.world.roads.drops import Drops, find_drops, rise_at
from sumo3dviz_pt.world.roads.kerbs import kerb_parts
from sumo3dviz_pt.world.roads.layers import Layer, make_base, road_layers, unworn
from sumo3dviz_pt.world.roads.layout import RoadLayout, layout_roads
from sumo3dviz_pt.world.roads.levels import levels_of
from sumo3dviz_pt.world.roads.mesh import kerb_faces, surface_meshes, verges
from sumo3dviz_pt.world.roads.plain import plain_roads
from sumo3dviz_pt.world.roads.strips import BoundsXY
from sumo3dviz_pt.world.roads.style import BALLAST

_RAMP = 0.4
"""Walkers climb a kerb over this distance [m], half of it on either side."""


@dataclass(frozen=True, slots=True, eq=False)
class RoadParts:
    """Roads, ready for the scene.

    Attributes:
        static: Surfaces, kerbs, rails and markings.
        materials: Their materials by name.
        layout: What they were made from; the ground needs it.
        surface_height_at: Extra height of the walkable surface [m] at points
            (n, 2) [m], as (n,): 0 on the carriageway, a kerb's height on footways.
        rail_height_at: The same of the heads of rails, on which trains stand; None where
            all rails are as high as roads.
    """

    static: tuple[StaticPart, ...]
    materials: Mapping[str, Bsdf]
    layout: RoadLayout
    surface_height_at: Callable[[Floats], Floats]
    rail_height_at: Callable[[Floats], Floats] | None = None


def build_roads(
    network: Network,
    settings: RoadSettings,
    *,
    textured: bool,
    region: BoundsXY | None = None,
    focus: BoundsXY | None = None,
    memory: Memory | None = None,
) -> RoadParts:
    """Build the roads of a network.

    Args:
        network: The network.
        settings: Surfaces, markings, widths and overrides.
        textured: False gives matt constant colours.
        region: x0, y0, x1, y1 [m]; only lanes that touch it are built.
        focus: Box around the camera's path [m], near which wear is finer.
        memory: What was built of this network.

    Raises:
        ConfigError: If a surface is unknown.
    """
    # Lay out the surface once per region.
    memory, name = memory or Memory(), ("roads", region)
    lay = partial(layout_roads, network, settings, region=region, memory=memory.within(*name))
    layout = memory.of(name, lay)
    # Surfaces, kerbs and the slopes around them.
    near = network.location.boundary[:2]
    drops = find_drops(network, layout.cells, focus)
    surfaces = surface_meshes(
        layout.cells, raised=layout.raised, near=near, drops=drops, memory=layout.memory
    )
    base = make_base(layout, surfaces, textured=textured, near=near, focus=focus)
    verge = settings.colour or settings.surface
    found = [Layer("road", _material(key), mesh) for key, mesh in base.surfaces.items()]
    found.append(Layer("road/faces", KERB, kerb_faces(layout.cells, layout.raised, drops)))
    ends = [(border.line, border.closed) for border in levels_of(layout).borders]
    sides = verges(ends, surface=verge, near=near)
    sides = unworn(sides) if verge in base.worn else sides
    found.append(Layer("road/verge", _material(verge), sides))
    slope = shoulder(layout.cells)
    uvs = planar_uvs(slope.vertices, tile=metres_per_tile(BALLAST), near=near)
    found.append(Layer("rails/shoulder", _material(BALLAST), replace(slope, uvs=uvs)))
    # What lies on top; then all that is not empty becomes parts.
    found += road_layers(network, settings, base, region=region)
    static: tuple[StaticPart, ...] = tuple(
        StaticPart(
            f"{layer.family}/{layer.material.removeprefix('surface:')}",
            "markings" if layer.family == "markings" else "roads",
            Part(layer.mesh, layer.material),
        )
        for layer in found
        if len(layer.mesh.faces)
    )
    if base.worn:
        static = (*static, *kerb_parts(base, drops))
    rise = track_rise(layout)
    static = (*static, *track_parts(layout, rise, focus))
    names = {part.part.material for part in static}
    materials = {name: _bsdf(name, textured=textured) for name in sorted(names)}
    return RoadParts(static, materials, layout, WalkingHeight(layout.raised, drops), rise)


def with_plain(
    roads: RoadParts, network: Network, settings: RoadSettings, *, textured: bool, memory: Memory
) -> RoadParts:
    """Return roads with others beyond them that show no more than their surface.

    Args:
        roads: Those in detail.
        network: The others.
        settings: Surfaces and widths.
        textured: False gives matt constant colours.
        memory: Where the plain roads of this network are kept.
    """
    near = network.location.boundary[:2]
    make = partial(plain_roads, network, settings, near=near, textured=textured)
    beyond = memory.of(("plain",), make)
    static = tuple(
        StaticPart(f"road/beyond/{key}", "roads", Part(mesh, _material(key)))
        for key, mesh in beyond.meshes.items()
    )
    names = {part.part.material for part in static}
    return replace(
        roads,
        static=(*roads.static, *static),
        materials={**roads.materials, **{n: _bsdf(n, textured=textured) for n in sorted(names)}},
        layout=replace(roads.layout, beyond=beyond),
    )


def _material(surface: str) -> str:
    """The material's name of a surface or of kerb stones."""
    return KERB if surface == KERB else material_name(surface)


def _bsdf(name: str, *, textured: bool) -> Bsdf:
    """The material of a name that `_material` gave, or of `MATERIALS`."""
    if name in MATERIALS:
        return MATERIALS[name]
    return surface_material(name.removeprefix("surface:"), textured=textured)


@dataclass(frozen=True, eq=False)
class WalkingHeight:
    """Tells the extra height of the walkable surface: a kerb's on footways, else 0.

    It climbs smoothly across the kerb, so that walkers do not jump.

    Attributes:
        areas: Footways.
        drops: Where they are lower.
    """

    areas: Polygons
    drops: Drops

    @cached_property
    def _tree(self) -> shapely.STRtree:
        """Of the footways."""
        return shapely.STRtree(self.areas)

    @cached_property
    def _edges(self) -> shapely.STRtree:
        """Of their kerbs."""
        return shapely.STRtree(shapely.boundary(self.areas))

    def __call__(self, points: Floats) -> Floats:
        """Return the extra height at points, (n, 2) [m], as (n,) [m]."""
        spots = shapely.points(np.asarray(points, dtype=np.float64)[:, :2])
        inside = np.zeros(len(spots), dtype=bool)
        inside[self._tree.query(spots, predicate="intersects")[0]] = True
        # Measure the distance from the kerb, positive on the footway.
        signed = np.where(inside, _RAMP, -_RAMP)
        (near, _), away = self._edges.query_nearest(
            spots, max_distance=_RAMP, return_distance=True, all_matches=False
        )
        signed[near] = np.where(inside[near], away, -away)
        # Climb across it.
        share = np.clip(signed / _RAMP + 0.5, 0.0, 1.0)
        rise = np.zeros(len(spots))
        rise[share > 0.0] = rise_at(self.drops, np.asarray(points)[share > 0.0, :2])
        return np.asarray(rise * share * share * (3.0 - 2.0 * share))
