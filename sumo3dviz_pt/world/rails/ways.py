"""Where rails lie and what they lie in, and which signals are the railway's.

Tracks lie in ballast for trains, in grass for trams on their own, in the street elsewhere.

A network has one list of signalled connections. By the type of the junction that they lead into
they belong to a street's traffic light, to a level crossing with its barriers, or to a rail signal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts, subtract, triangulate_many, union
from sumo3dviz_pt.library.mesh.shading import smooth_normals
from sumo3dviz_pt.model.geometry import Mesh, merge_meshes
from sumo3dviz_pt.model.network import Connection, Junction, Lane, Network
from sumo3dviz_pt.world.roads.cells import Cells
from sumo3dviz_pt.world.roads.strips import (
    BALLAST,
    GRASS_TRACK,
    RAIL_CLASSES,
    Strip,
    has_rails,
    junction_of,
)

Guard = Literal["street", "level crossing", "rail signal"]
"""What stops the traffic of a connection."""

LEVEL_CROSSING, RAIL_SIGNAL = "rail_crossing", "rail_signal"

TRAINS = RAIL_CLASSES - {"tram", "cable_car"}
"""vClasses that run on ballast."""

_GUARDS: dict[str, Guard] = {LEVEL_CROSSING: "level crossing", RAIL_SIGNAL: "rail signal"}


def guard_of(network: Network, link: Connection) -> Guard:
    """Return what stops the traffic of a signalled connection."""
    junction = _junction_ahead(network, link)
    return "street" if junction is None else _GUARDS.get(junction.type, "street")


def only_rails(lane: Lane) -> bool:
    """Return whether nothing but rail vehicles may use a lane."""
    return bool(lane.allowed) and lane.allowed <= RAIL_CLASSES


def at_level_crossing(network: Network, crossing_id: str) -> bool:
    """Return whether people cross at a level crossing, where nothing is painted for them."""
    junction = network.junctions.get(junction_of(crossing_id))
    return junction is not None and junction.type == LEVEL_CROSSING


def _junction_ahead(network: Network, link: Connection) -> Junction | None:
    """The junction that a connection leads through."""
    edge = network.edges[network.lanes[link.from_lane].edge_id]
    key = junction_of(edge.id) if edge.id.startswith(":") else edge.to_junction
    return network.junctions.get(key)


def bare_ways(network: Network) -> frozenset[str]:
    """Return internal lanes without rails, though only rail vehicles may use them.

    SUMO writes a lane for every turn that a tram is allowed to make. Rails lie only where
    they lead from a track to a track, and nowhere where a tram would turn round.
    """
    railed: set[str] = set()
    bare: set[str] = set()
    following = {k.from_lane: k.via for k in network.connections if k.from_lane.startswith(":")}
    for link in network.connections:
        if not link.via or link.from_lane.startswith(":"):
            continue
        lanes = railed if _joins_tracks(network, link) else bare
        # A way may have several lanes one after the other.
        via = link.via
        while via and via not in lanes:
            lanes.add(via)
            via = following.get(via, "")
    return frozenset(bare - railed)


def _joins_tracks(network: Network, link: Connection) -> bool:
    """Whether a connection leads from a track to another."""
    ends = (network.lanes[key] for key in (link.from_lane, link.to_lane))
    return link.direction not in {"t", "T"} and all(has_rails(lane) for lane in ends)


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
