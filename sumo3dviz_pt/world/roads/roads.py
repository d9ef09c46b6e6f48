"""The roads of a network as static parts, and their drawn surface, which road users stand on.

The parts are surfaces, kerbs, rails and markings.

Inside junctions on slopes, SUMO's ways contradict one another: where two cross, their heights
differ by up to a metre. Only one surface can be drawn there, so it lies above some ways and below
others. `DrawnSurface.rise_at` tells how far it lies above or below a point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.materials import (
    KERB,
    MATERIALS,
    material_name,
    metres_per_tile,
    planar_uvs,
    surface_material,
)
from sumo3dviz_pt.library.mesh.planar import Triangles, polygon_parts, triangulate_all
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.scene import Bsdf, Part, StaticPart
from sumo3dviz_pt.world.memory import Memory, digest_of
from sumo3dviz_pt.world.rails.tracks import track_parts, track_rise
from sumo3dviz_pt.world.rails.ways import shoulder
from sumo3dviz_pt.world.roads.cells import STOREY, Polygons, surface_heights
from sumo3dviz_pt.world.roads.drops import Drops, find_drops, is_uneven, pieces_of, rise_at
from sumo3dviz_pt.world.roads.kerbs import kerb_parts
from sumo3dviz_pt.world.roads.layers import Layer, make_base, road_layers, unworn
from sumo3dviz_pt.world.roads.layout import RoadLayout, layout_roads, levels_of, plain_roads
from sumo3dviz_pt.world.roads.mesh import (
    kerb_faces,
    kerb_rings,
    surface_meshes,
    verges,
    with_kerb_tops,
)
from sumo3dviz_pt.world.roads.stairs import stairs_of
from sumo3dviz_pt.world.roads.strips import BALLAST, BoundsXY

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
    layers = [Layer("road", _material(key), mesh) for key, mesh in base.surfaces.items()]
    kerbs = kerb_rings(layout.cells, layout.raised, drops)
    layers.append(Layer("road/faces", KERB, kerb_faces(kerbs)))
    ends = [(border.line, border.closed) for border in levels_of(layout).borders]
    sides = verges(ends, surface=verge, near=near)
    sides = unworn(sides) if verge in base.worn else sides
    layers.append(Layer("road/verge", _material(verge), sides))
    slope = shoulder(layout.cells)
    uvs = planar_uvs(slope.vertices, tile=metres_per_tile(BALLAST), near=near)
    layers.append(Layer("rails/shoulder", _material(BALLAST), replace(slope, uvs=uvs)))
    stairs = stairs_of(network, focus)
    layers.append(Layer("road/stairs", KERB, stairs.mesh))
    # What lies on top; then all that is not empty becomes parts.
    layers += road_layers(network, settings, base, region=region)
    static: tuple[StaticPart, ...] = tuple(
        StaticPart(
            f"{layer.family}/{layer.material.removeprefix('surface:')}",
            "markings" if layer.family == "markings" else "roads",
            Part(layer.mesh, layer.material),
        )
        for layer in layers
        if len(layer.mesh.faces)
    )
    if base.worn:
        static = (*static, *kerb_parts(base, drops, kerbs))
    rise = track_rise(layout)
    static = (*static, *track_parts(layout, rise, focus))
    names = {part.part.material for part in static}
    materials = {name: _bsdf(name, textured=textured) for name in sorted(names)}
    walked_on = stairs.walked_on(WalkingHeight(layout.raised, drops))
    return RoadParts(static, materials, layout, walked_on, rise)


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
        return np.asarray(eased(share, rise))


LEVEL = 3.0
"""Surfaces farther above or below a road user belong to another level [m]."""

_FADING = LEVEL - STOREY
"""Over the last part of that distance its effect fades [m]; nearer levels were cut to one."""

_BESIDE = 1.0
"""Beside the road, the effect of its surface fades over this distance [m]."""

_SMALLEST = 1e-5
"""Slimmer triangles stand upright where two heights meet [m2, twice the area]."""


class _Offers(NamedTuple):
    """Triangles on which points may stand.

    Attributes:
        point: Numbers of the points, (m,).
        gap: How far above each point its triangle lies [m], (m,).
        away: How far beside the point the triangle lies, from above [m], (m,).
    """

    point: Ints
    gap: Floats
    away: Floats


@dataclass(frozen=True, eq=False)
class DrawnSurface:
    """Triangles of carriageways, and of footways as if they had no kerbs.

    Attributes:
        corners: Of the triangles, (m, 3, 3) [m].
    """

    corners: Floats

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Of all triangles from above."""
        return shapely.STRtree(shapely.polygons(self.corners[..., :2]))

    def rise_at(self, points: Floats) -> Floats:
        """Return how far the surface of the points' own level lies above them.

        The nearest surface above or below a point counts; it fades out beside the road, and
        where it is so far away that it belongs to another level.

        Args:
            points: (n, 3) [m].

        Returns:
            (n,) [m]; 0 where there is no surface.
        """
        rise = np.zeros(len(points))
        known = np.zeros(len(points), dtype=np.bool_)
        for offers in self._offers(points, known):
            # The nearest is written last and so stays.
            order = np.lexsort((-np.abs(offers.gap), -np.round(offers.away, 3)))
            order = order[np.abs(offers.gap[order]) < LEVEL]
            gap, away = offers.gap[order], offers.away[order]
            near = np.clip((LEVEL - np.abs(gap)) / _FADING, 0.0, 1.0)
            rise[offers.point[order]] = gap * near * np.clip(1.0 - away / _BESIDE, 0.0, 1.0)
            known[offers.point[order]] = True
        return rise

    def _offers(self, points: Floats, known: np.ndarray) -> Iterator[_Offers]:
        """Yield triangles below points; then those beside points that have found none."""
        spots = shapely.points(points[:, :2])
        point, face = self.tree.query(spots, predicate="intersects")
        yield _Offers(point, self._gaps(face, points[point]), np.zeros(len(point)))
        rest = np.flatnonzero(~known)
        near, face = self.tree.query(spots[rest], predicate="dwithin", distance=_BESIDE)
        point = rest[near]
        lines = shapely.shortest_line(self.tree.geometries[face], spots[point])
        feet = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 0]
        beside = np.column_stack([feet, points[point, 2]])
        away = np.hypot(*(feet - points[point, :2]).T)
        yield _Offers(point, self._gaps(face, beside), away)

    def _gaps(self, face: Ints, points: Floats) -> Floats:
        """How far triangles lie above points, (m,) [m]."""
        a, b, c = (self.corners[face, k] for k in range(3))
        normal = np.cross(b - a, c - a)
        away = points[:, :2] - a[:, :2]
        height = a[:, 2] - (away * normal[:, :2]).sum(axis=1) / normal[:, 2]
        return np.asarray(height - points[:, 2])


def drawn_surface(layout: RoadLayout) -> DrawnSurface | None:
    """Return the surface that is drawn of roads; None where all of it has one height."""
    if layout.cells.is_flat:
        return None
    return layout.memory.of(("drawn surface",), lambda: _surface(layout))


def _surface(layout: RoadLayout) -> DrawnSurface:
    """The triangles of all cells, at the heights of the road without kerbs."""
    cells = layout.memory.of(("kerb tops",), lambda: with_kerb_tops(layout.cells, layout.raised))

    def triangles(index: int) -> Triangles:
        polygon = cells.polygons[index]
        # This is the name by which the mesh of the surface keeps them, too.
        name = ("rest", digest_of(polygon), is_uneven(cells, index), (), ())
        return layout.memory.by_content.of(
            name, lambda: triangulate_all(pieces_of(cells, index, polygon_parts(polygon)))
        )

    pieces = [triangles(index) for index in range(len(cells.polygons))]
    flat = np.concatenate([np.zeros((0, 2)), *(some for some, _ in pieces)])
    owner = np.repeat(np.arange(len(pieces)), [len(some) for some, _ in pieces])
    starts = np.cumsum([0, *(len(some) for some, _ in pieces)])[:-1]
    moved = [faces + start for (_, faces), start in zip(pieces, starts, strict=True)]
    faces = np.concatenate([np.zeros((0, 3), np.int64), *moved])
    vertices = np.column_stack([flat, surface_heights(cells, owner, flat)])
    corners = vertices[faces]
    sides = corners[:, 1:, :2] - corners[:, :1, :2]
    twice = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    return DrawnSurface(corners[twice > _SMALLEST])
