"""Lines through junctions where a road only goes on, widens, merges or splits."""

from __future__ import annotations

from collections.abc import Mapping

import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.world.roads.areas import JunctionInside
from sumo3dviz_pt.world.roads.markings.lines import Paint, SideColours, edge_paint
from sumo3dviz_pt.world.roads.strips import Strip
from sumo3dviz_pt.world.roads.style import style_of

_CLEAR = 0.8
"""Outer borders with another way this near get no line [m]."""


def through_paint(
    network: Network,
    settings: RoadSettings,
    insides: Mapping[str, JunctionInside],
    *,
    sides: SideColours,
) -> list[Paint]:
    """Paint dividers and edge lines inside junctions without crossing traffic.

    Args:
        network: The network.
        settings: Line width.
        insides: Contents of junctions, by junction id.
        sides: Materials of the lines along right and left borders.
    """
    inner = _inner_connections(network)
    paint = []
    for key, inside in insides.items():
        if not _is_through(network, key, inner.get(key, [])):
            continue
        ways: dict[str, list[Strip]] = {}
        for strip in inside.ways:
            ways.setdefault(strip.lane.edge_id, []).append(strip)
        sources = {c.via.rpartition("_")[0]: c.from_lane for c in inner[key] if c.direction != "t"}
        for edge_id, source in sources.items():
            outer_edge = network.lanes[source].edge_id
            if edge_id not in ways or not style_of(outer_edge, settings).markings:
                continue
            others = [s for other, group in ways.items() if other != edge_id for s in group]
            strips = tuple(ways[edge_id])
            side = _open_side(strips, others)
            edge = _with_speed(network.edges[edge_id], network.edges[outer_edge])
            paint += edge_paint(edge, strips, settings, sides=sides, open_side=side)
    return paint


def _inner_connections(network: Network) -> dict[str, list[Connection]]:
    """Connections between normal edges that run over internal lanes, by junction."""
    found: dict[str, list[Connection]] = {}
    for connection in network.connections:
        lane = network.lanes.get(connection.from_lane)
        if lane is None or connection.via not in network.lanes:
            continue
        edge = network.edges[lane.edge_id]
        if edge.function == "normal":
            found.setdefault(edge.to_junction, []).append(connection)
    return found


def _is_through(network: Network, key: str, connections: list[Connection]) -> bool:
    """Whether no vehicle's way crosses another one's in a junction."""
    if not connections or network.junctions[key].type.startswith("traffic_light"):
        return False
    targets: dict[str, set[str]] = {}
    sources: dict[str, set[str]] = {}
    for connection in connections:
        if connection.direction == "t":
            continue
        one = network.lanes[connection.from_lane].edge_id
        other = network.lanes[connection.to_lane].edge_id
        targets.setdefault(one, set()).add(other)
        sources.setdefault(other, set()).add(one)
    single_way = len(targets) == 1 or len(sources) == 1
    one_each = all(len(v) == 1 for v in [*targets.values(), *sources.values()])
    return bool(targets) and (single_way or (one_each and len(targets) <= 2))


def _open_side(strips: tuple[Strip, ...], others: list[Strip]) -> str:
    """Which outer borders run beside or into another way."""
    area = union([strip.polygon for strip in others])
    sides = [
        name
        for name, line in (("right", strips[0].right), ("left", strips[-1].left))
        if shapely.LineString(line[:, :2]).distance(area) < _CLEAR and not area.is_empty
    ]
    return "both" if len(sides) == 2 else "".join(sides)


def _with_speed(inner: Edge, outer: Edge) -> Edge:
    """An internal edge that is painted like the edge that leads into it."""
    return Edge(inner.id, inner.function, "", "", outer.lanes)
