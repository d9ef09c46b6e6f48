"""What tracks lie in: ballast for trains, grass for trams on their own, the street elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract, union
from sumo3dviz_pt.library.mesh.triangulate import triangulate_many
from sumo3dviz_pt.model.geometry import Mesh, merge_meshes
from sumo3dviz_pt.world.rails.guards import only_rails
from sumo3dviz_pt.world.roads.cells import Cells
from sumo3dviz_pt.world.roads.mesh import smooth_normals
from sumo3dviz_pt.world.roads.strips import Strip
from sumo3dviz_pt.world.roads.style import BALLAST, GRASS_TRACK

SHOULDER, _FALL = 0.6, 0.14
"""Width of the slope beside ballast, and how far it falls [m]."""

_SHARED = 0.02
"""Share of a track that roads may cover before it counts as one in a street."""


def with_own_tracks(strips: Mapping[str, tuple[Strip, ...]]) -> dict[str, tuple[Strip, ...]]:
    """Return strips with grass where trams have a track of their own.

    A track is a tram's own where all lanes of its edge are for rail vehicles and no other
    carriageway or footway lies on it.

    Args:
        strips: Lanes of edges from right to left, by edge id.
    """
    own = {key for key, group in strips.items() if all(only_rails(s.lane) for s in group)}
    if not any("tram" in s.lane.allowed for key in own for s in strips[key]):
        return dict(strips)
    others = [s.polygon for key, group in strips.items() if key not in own for s in group]
    tree = shapely.STRtree(others)
    return {
        key: tuple(_on_grass(strip, tree) for strip in group) if key in own else group
        for key, group in strips.items()
    }


def _on_grass(strip: Strip, others: shapely.STRtree) -> Strip:
    """A tram's strip on grass, unless it lies in a street."""
    if "tram" not in strip.lane.allowed:
        return strip
    area = strip.polygon
    near = others.geometries[others.query(area, predicate="intersects")]
    shared = shapely.area(shapely.intersection(near, area)).sum() if len(near) else 0.0
    if shared > _SHARED * area.area:
        return strip
    return replace(strip, look=replace(strip.look, surface=GRASS_TRACK))


def shoulder(cells: Cells) -> Mesh:
    """Build the slope of ballast beside tracks, down into the ground; without texture."""
    chosen = np.flatnonzero(np.array(cells.surfaces) == BALLAST)
    if not len(chosen):
        return merge_meshes([])
    whole = union(cells.polygons[chosen])
    wide = whole.buffer(SHOULDER, quad_segs=2)
    tree = shapely.STRtree(cells.polygons)
    near = tree.query(wide, predicate="intersects")
    parts = polygon_parts(subtract(wide, [union(cells.polygons[near])]))
    flat, faces, _ = triangulate_many([part for part in parts if part.area > 1e-3])
    if not len(faces):
        return merge_meshes([])
    # Its inner border is as high as the bed, its outer one lies in the ground.
    away = shapely.distance(whole, shapely.points(flat))
    beds = shapely.STRtree(cells.polygons[chosen])
    spot, cell = beds.query_nearest(shapely.points(flat), all_matches=False)
    heights = np.zeros(len(flat))
    heights[spot] = cells.heights(chosen[cell], flat[spot])
    vertices = np.column_stack([flat, heights - np.clip(away / SHOULDER, 0.0, 1.0) * _FALL])
    return Mesh(vertices, faces, smooth_normals(vertices, faces))
