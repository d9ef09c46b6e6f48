"""Areas between lanes: junctions, walking areas and slivers between carriageways."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import shapely
from scipy import spatial

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.mesh.bands import densified
from sumo3dviz_pt.library.mesh.planar import closing, common, subtract, union
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.world.memory import Memory, digest_of
from sumo3dviz_pt.world.rails.ways import bare_ways
from sumo3dviz_pt.world.roads.cells import STOREY, Cells, Polygons, area_cells, fitted_heights
from sumo3dviz_pt.world.roads.strips import (
    PAVING,
    BoundsXY,
    Strip,
    bicycle_surface,
    cached_strips,
    in_region,
    is_footway,
    is_skipped,
    junction_of,
    junction_surface,
    look_of,
    style_of,
)

_REACH = 0.25
"""Gaps up to twice this width [m] between a junction and its lanes are closed."""

_STEP, _BY = 1.5, 2.0
"""Distance of points of known height along ways [m], and how far from a junction's outline lanes
give its height [m]."""

_CAR_SPACE = 1.3
"""Walking areas keep this far from the middle of vehicles' ways [m]."""

_CRUMB = 0.01
"""Ways that touch less of a footway leave it as it is [m2]."""


@dataclass(frozen=True, slots=True, eq=False)
class JunctionInside:
    """What SUMO puts inside a junction.

    Attributes:
        ways: Strips of vehicles' internal lanes.
        walks: Walking areas.
        paths: Strips of internal lanes for people on foot alone.
    """

    ways: tuple[Strip, ...]
    walks: tuple[Edge, ...]
    paths: tuple[Strip, ...] = ()

    @property
    def strips(self) -> tuple[Strip, ...]:
        """All ways and paths."""
        return (*self.ways, *self.paths)


def junction_insides(
    network: Network, settings: RoadSettings, *, region: BoundsXY | None, memory: Memory
) -> dict[str, JunctionInside]:
    """Find what lies inside all junctions that touch a region, by junction id.

    Args:
        network: The network.
        settings: Surfaces and widths of lanes.
        region: A box [m]; None is everywhere.
        memory: Of the network's world.
    """
    # Sort internal edges and walking areas by their junctions.
    ways: dict[str, list[Strip]] = {}
    paths: dict[str, list[Strip]] = {}
    walks: dict[str, list[Edge]] = {}
    bare = bare_ways(network)
    for edge in network.edges.values():
        owner = junction_of(edge.id)
        if not any(in_region(lane.shape, region, margin=lane.width) for lane in edge.lanes):
            continue
        if edge.function == "walkingarea":
            walks.setdefault(owner, []).append(edge)
        elif edge.function == "internal":
            strips = cached_strips(edge, settings, left_hand=network.left_hand, memory=memory)
            for strip in strips:
                among = paths if is_footway(strip.lane) else ways
                among.setdefault(owner, []).append(_without_rails(strip, bare))
    # Keep junctions with any of these, or with their outline in the region; none of waterways.
    touched = {
        key
        for key, junction in network.junctions.items()
        if junction.type != "internal" and in_region(junction.outline, region)
    } - _afloat(network)
    return {
        key: JunctionInside(
            tuple(ways.get(key, ())), tuple(walks.get(key, ())), tuple(paths.get(key, ()))
        )
        for key in network.junctions
        if key in touched or key in ways or key in walks or key in paths
    }


def _afloat(network: Network) -> frozenset[str]:
    """Junctions to which only ships come."""
    met: dict[str, list[bool]] = {}
    for edge in network.edges.values():
        for key in (edge.from_junction, edge.to_junction):
            met.setdefault(key, []).extend(is_skipped(lane) for lane in edge.lanes)
    return frozenset(key for key, skipped in met.items() if key and all(skipped))


def _without_rails(strip: Strip, bare: frozenset[str]) -> Strip:
    """A strip, without rails if it is one of the bare ways."""
    if strip.lane.id not in bare or not strip.look.rails:
        return strip
    return replace(strip, look=replace(strip.look, rails=False))


def known_heights(
    network: Network, insides: Mapping[str, JunctionInside], *, lanes: Cells, memory: Memory
) -> dict[str, Floats]:
    """Return points of known height in each junction that has any, (k, 3) [m] by its id.

    The carriageway and the walking areas of a junction share them, and junctions that touch each
    other share theirs, so that all of them meet.

    Args:
        network: The network.
        insides: Contents of junctions, by junction id.
        lanes: Surfaces around them.
        memory: Of the network's world.
    """
    tree = shapely.STRtree(lanes.polygons)
    own, shapes = {}, {}
    for key, inside in insides.items():
        outline = network.junctions[key].outline
        shape = _cached_shape(key, outline, inside.strips, memory=memory)
        areas = [edge.lanes[0].shape for edge in inside.walks]
        known = [
            densified(line, _STEP) for line in (*(s.lane.shape for s in inside.strips), *areas)
        ]
        if len(outline) >= 3:
            near = _near(tree, shape, distance=_BY)
            known.append(_ends_near(outline, lanes.quads[near]))
        whole = np.concatenate([np.zeros((0, 3)), *known])
        if len(whole) or len(outline):
            own[key] = whole if len(whole) else outline
            shapes[key] = shape
    return _shared(own, shapes)


def _shared(own: Mapping[str, Floats], shapes: Mapping[str, shapely.Geometry]) -> dict[str, Floats]:
    """Points of known height, with those of areas that touch on the same level.

    Args:
        own: Each area's own, (k, 3) [m].
        shapes: The areas.
    """
    keys, areas = list(own), [shapes[key] for key in own]
    if len(keys) < 2:
        return dict(own)
    one, other = shapely.STRtree(areas).query(areas, predicate="dwithin", distance=_REACH)
    beside: dict[str, list[Floats]] = {key: [own[key]] for key in keys}
    for i, j in zip(one, other, strict=True):
        if i == j or areas[i].is_empty or areas[j].is_empty:
            continue
        place = shapely.get_coordinates(shapely.shortest_line(areas[i], areas[j])).mean(axis=0)
        ends = [float(fitted_heights(own[keys[k]], place[None])[0]) for k in (i, j)]
        if abs(ends[0] - ends[1]) < STOREY:
            beside[keys[i]].append(own[keys[j]])
    return {key: np.concatenate(lists) for key, lists in beside.items()}


def without_ways(footways: Cells, insides: Mapping[str, JunctionInside]) -> Cells:
    """Return cells of which the raised ones leave vehicles' ways through junctions free.

    Args:
        footways: Lanes, walking areas or junctions.
        insides: Contents of junctions, by junction id.
    """
    ways = [s for inside in insides.values() for s in inside.ways if not _is_cycled(s)]
    cores = np.array([_core(strip) for strip in ways], dtype=object)
    tree = shapely.STRtree(footways.polygons)
    way, cell = tree.query(cores, predicate="intersects")
    polygons = footways.polygons.copy()
    for k, index in zip(way.tolist(), cell.tolist(), strict=True):
        shared = common(footways.polygons[index], cores[k])
        if not footways.raised[index] or shared.area < _CRUMB:
            continue
        # A way on a bridge above the footway, or below it, takes nothing from it.
        middle = shapely.get_coordinates(shapely.point_on_surface(shared))
        height = _height_of(ways[k], middle[0])
        if abs(float(footways.heights(np.array([index]), middle)[0]) - height) < STOREY:
            polygons[index] = subtract(polygons[index], [cores[k]])
    return replace(footways, polygons=polygons)


def walking_cells(
    insides: Mapping[str, JunctionInside],
    *,
    footways: Cells,
    known: Mapping[str, Floats],
    memory: Memory,
) -> Cells:
    """Build raised paving of walking areas, where no vehicle passes, grown to meet footways.

    Args:
        insides: Contents of junctions, by junction id.
        footways: What the paving meets.
        known: What `known_heights` gave.
        memory: Of the network's world.
    """
    polygons, knots, owners = [], [], []
    tree = shapely.STRtree(footways.polygons)
    for key, inside in insides.items():
        for edge in inside.walks:
            outline = edge.lanes[0].shape
            if len(outline) < 3:
                continue
            area = shapely.make_valid(shapely.Polygon(np.round(outline[:, :2], 3)))
            near = footways.polygons[_near(tree, area)]
            name = ("walk", edge.id, digest_of(*(way.lane.id for way in inside.ways), *near))
            make = partial(_paved_walk, area, near, inside.ways)
            polygons.append(memory.by_content.of(name, make))
            knots.append(known[key])
            owners.append(edge.id)
    surfaces = [PAVING] * len(polygons)
    return area_cells(polygons, knots=knots, surfaces=surfaces, raised=True, owners=owners)


def _paved_walk(area: shapely.Geometry, near: Polygons, ways: Sequence[Strip]) -> shapely.Geometry:
    """A walking area grown to meet the footways near it, without room for vehicles."""
    cores = [_core(strip) for strip in ways]
    grown = _closed(area, near) if len(near) else area
    return subtract(grown, [union(cores)])


def junction_cells(
    network: Network,
    settings: RoadSettings,
    *,
    insides: Mapping[str, JunctionInside],
    lanes: Cells,
    known: Mapping[str, Floats],
    memory: Memory,
) -> Cells:
    """Build junction surfaces: outline and internal lanes, grown to meet the lanes around.

    Args:
        network: The network.
        settings: Surfaces of roads.
        insides: Contents of junctions, by junction id.
        lanes: Surfaces around them.
        known: What `known_heights` gave.
        memory: Of the network's world.
    """
    polygons, knots, surfaces, on_foot, owners = [], [], [], [], []
    tree = shapely.STRtree(lanes.polygons)
    keep = memory.by_content
    for key, inside in insides.items():
        outline = network.junctions[key].outline
        shape = _cached_shape(key, outline, inside.strips, memory=memory)
        if shape.is_empty:
            continue
        around = lanes.polygons[_near(tree, shape)]
        name = ("joined junction", key, digest_of(shape, *around))
        polygons.append(keep.of(name, partial(_closed, shape, around)))
        knots.append(known[key])
        on_foot.append(bool(inside.paths) and not inside.ways)
        surfaces.append(PAVING if on_foot[-1] else junction_surface(network, key, settings))
        owners.append(key)
    made = area_cells(polygons, knots=knots, surfaces=surfaces, raised=False, owners=owners)
    # Where nobody drives, a junction lies as high as the footways that meet there.
    return replace(made, raised=np.array(on_foot, dtype=np.bool_))


def sliver_cells(
    network: Network, settings: RoadSettings, strips: Mapping[str, tuple[Strip, ...]]
) -> Cells:
    """Build fill narrow gaps between the two directions of roads.

    Args:
        network: The network.
        settings: Surfaces of roads.
        strips: Lanes of edges from right to left, by edge id.
    """
    polygons, knots, surfaces, owners = [], [], [], []
    for edge_id, other_id in opposite_edges(network, strips):
        sides = [s for key in (edge_id, other_id) for s in strips[key] if not s.look.raised]
        shapes = [strip.polygon for strip in sides]
        if not shapes or shapes[0].distance(shapes[-1]) > 2 * _REACH:
            continue
        whole = union(shapes)
        gaps = subtract(closing(whole, _REACH), [whole])
        if gaps.area < 1e-3:
            continue
        style = style_of(edge_id, settings)
        polygons.append(gaps)
        knots.append(np.concatenate([densified(s.lane.shape, _STEP) for s in sides]))
        surfaces.append(look_of(sides[0].lane, style, bicycle=bicycle_surface(settings)).surface)
        owners.append(edge_id)
    return area_cells(polygons, knots=knots, surfaces=surfaces, raised=False, owners=owners)


def opposite_edges(network: Network, edge_ids: Iterable[str]) -> list[tuple[str, str]]:
    """Return pairs of edges that join the same junctions in opposite directions."""
    by_ends: dict[tuple[str, str], list[str]] = {}
    for key in edge_ids:
        edge = network.edges[key]
        by_ends.setdefault((edge.from_junction, edge.to_junction), []).append(key)
    return [
        (key, other)
        for (start, end), group in by_ends.items()
        for key in group
        for other in by_ends.get((end, start), [])
        if key < other
    ]


def _near(tree: shapely.STRtree, shape: shapely.Geometry, *, distance: float = 2 * _REACH) -> Ints:
    """Numbers of what lies beside a shape, ascending; a tree gives them in an order of its own."""
    index = tree.query(shape, predicate="dwithin", distance=distance)
    return np.asarray(np.sort(index), dtype=np.int64)


def _core(strip: Strip) -> shapely.Geometry:
    """What a vehicle needs of its way, from above."""
    line = shapely.LineString(strip.lane.shape[:, :2])
    return line.buffer(min(_CAR_SPACE, 0.5 * strip.look.width))


def _is_cycled(strip: Strip) -> bool:
    """Whether a way is for bicycles and the like alone, which may ride on footways."""
    return bool(strip.lane.allowed) and strip.lane.allowed <= {"bicycle", "scooter"}


def _height_of(strip: Strip, place: Floats) -> float:
    """The height of a strip at a place, (2,) [m]."""
    line = shapely.LineString(strip.lane.shape[:, :2])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(strip.lane.shape[:, :2].T)))])
    return float(np.interp(line.project(shapely.Point(place)), along, strip.lane.shape[:, 2]))


def _cached_shape(
    key: str, outline: Floats, ways: Sequence[Strip], *, memory: Memory
) -> shapely.Geometry:
    """What `_junction_shape` gives, made once for all choices of roads."""
    name = ("junction", key, tuple(way.lane.id for way in ways))
    return memory.by_content.of(name, partial(_junction_shape, outline, ways))


def _junction_shape(outline: Floats, ways: Sequence[Strip]) -> shapely.Geometry:
    """A junction's outline with all its internal lanes, from above."""
    shapes = [strip.polygon for strip in ways]
    if len(outline) >= 3:
        shapes.append(shapely.make_valid(shapely.Polygon(np.round(outline[:, :2], 3))))
    return union(shapes)


def _closed(shape: shapely.Geometry, around: Polygons) -> shapely.Geometry:
    """A junction's shape and the narrow gaps between it and the lanes around it."""
    reach = shape.buffer(3.0, quad_segs=2)
    nearby = [common(cell, reach) for cell in around]
    filled = closing(union([shape, *nearby]), _REACH)
    return union([shape, common(filled, shape.buffer(2 * _REACH, quad_segs=2))])


def _ends_near(outline: Floats, quads: Floats) -> Floats:
    """Corners of lanes close to the corners of a junction's outline, (k, 3) [m]."""
    corners = quads[np.isfinite(quads).all(axis=(1, 2))].reshape(-1, 3)
    away, _ = spatial.cKDTree(outline[:, :2]).query(corners[:, :2])
    return np.asarray(corners[np.asarray(away) < _BY])
