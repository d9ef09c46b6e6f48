"""Pavements beside urban streets for which a network has none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import shapely

from sumo3dviz_pt.library.mesh.planar import areal, polygon_parts, subtract, union
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.world.street.places import drives
from sumo3dviz_pt.world.town.character import URBAN, Character

WIDTH = 2.0
"""Of pavements [m]."""

_LEAST = 3.0  # smaller pieces are left out [m2]


def lacks_walk(edge: Edge) -> bool:
    """Return whether an edge has no lane for people on foot beside its carriageway."""
    return not any("pedestrian" in lane.allowed and not drives(lane) for lane in edge.lanes)


def pavements(
    network: Network,
    edges: Sequence[Edge],
    characters: Mapping[str, Character],
    ground: shapely.Geometry,
    bays: Sequence[shapely.Geometry] = (),
) -> list[shapely.Polygon]:
    """Return a strip around what is paved, where that belongs to urban streets.

    Args:
        network: The roads.
        edges: Those that may have pavements.
        characters: What they run through.
        ground: Everything that is paved, rails too.
        bays: Beside lanes; pavements lie behind them.
    """
    zones: list[shapely.Geometry] = []
    ends: dict[str, bool] = {}
    for edge in edges:
        if edge.id not in characters:
            continue
        bare = characters[edge.id] in URBAN and lacks_walk(edge)
        for name in (edge.from_junction, edge.to_junction):
            ends[name] = ends.get(name, True) and bare
        if bare:
            zones += [
                shapely.LineString(lane.shape[:, :2]).buffer(
                    lane.width / 2.0 + WIDTH + 0.5, cap_style="flat"
                )
                for lane in edge.lanes
            ]
    if not zones:
        return []
    junctions = [network.junctions[name] for name, bare in sorted(ends.items())
                 if bare and name in network.junctions]  # fmt: skip
    zones += [
        shapely.make_valid(shapely.Polygon(one.outline[:, :2])).buffer(WIDTH + 0.5)
        for one in junctions
        if len(one.outline) > 2
    ]
    whole = union([ground, *bays])
    zones += [bay.buffer(WIDTH + 0.5) for bay in bays]
    strip = shapely.intersection(whole.buffer(WIDTH, quad_segs=3), union(zones))
    free = subtract(areal(strip), [whole])
    return [part for part in polygon_parts(free) if part.area > _LEAST]
