"""Kerbed islands: in the middle of roundabouts, and between carriageways that run side by side.

An island is a hole in what is paved that all traffic around it passes on the inner side: at its
left where traffic keeps right. City blocks are passed on the other side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.materials import KERB
from sumo3dviz_pt.library.mesh.bands import between
from sumo3dviz_pt.library.mesh.planar import polygon_parts, triangulate_many
from sumo3dviz_pt.library.plants.species import urn
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import LeftOut, Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi
from sumo3dviz_pt.world.placement.lanes import LaneIndex
from sumo3dviz_pt.world.placement.sightlines import SHRUB, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.trees import planted
from sumo3dviz_pt.world.roads.cells import heights_near
from sumo3dviz_pt.world.roads.layout import RoadLayout

FAMILY = "traffic islands"
"""What users call the family."""

_STONE, _TOP, _DEEP = 0.15, 0.12, 0.15  # width of kerb stones, their height and depth [m]
_NARROW = 0.8  # islands with a smaller radius are of stone; wider ones stay green [m]
_LEAST, _STRIP, _WIDEST = 0.25, 3.0, 40.0  # radii of what is an island, of strips, of all [m]
_ROUND = 0.7  # share of its smallest circle that a wide island fills
_FASTEST = 80.5 / 3.6  # faster roads have guard rails instead [m/s]
_BESIDE = 3.2  # from an island to the middles of the lanes around it [m]
_AROUND = 0.9  # share of an island's border that lanes pass on the inner side
_STEP = 2.0  # distance of places on a border [m]
_GAP, _INSIDE = 2.4, 2.2  # between shrubs, and from a kerb to them [m]
_DENSE = 0.35  # share of places with a shrub


@dataclass(frozen=True, slots=True, eq=False)
class Island:
    """A kerbed island.

    Attributes:
        shape: Its outline on the road.
        radius: Of the largest circle in it [m].
    """

    shape: shapely.Polygon
    radius: float

    @property
    def paved(self) -> bool:
        """Whether nothing grows on it."""
        return self.radius < _NARROW


@dataclass(frozen=True, slots=True, eq=False)
class IslandParts:
    """Islands, ready for the scene.

    Attributes:
        static: Kerbs.
        left_out: What was left out, and why.
    """

    static: tuple[StaticPart, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def islands_of(network: Network, layout: RoadLayout, lanes: LaneIndex) -> tuple[Island, ...]:
    """Find the islands between the roads of a layout.

    Args:
        network: Says how fast roads are, and on which side traffic keeps.
        layout: The roads.
        lanes: All lanes with their directions.
    """
    islands = []
    for area in layout.outline:
        for ring in area.interiors:
            hole = shapely.Polygon(ring)
            radius = round(float(shapely.maximum_inscribed_circle(hole, 0.01).length), 2)
            fits = _fits(hole, radius) and _is_passed_inside(hole, network, lanes)
            if fits and _is_slow(hole, network, layout):
                islands.append(Island(hole, radius))
    return tuple(islands)


def island_parts(
    islands: Sequence[Island], layout: RoadLayout, *, why: str | None = None
) -> IslandParts:
    """Build kerbs around islands; narrow ones are of stone altogether.

    Args:
        islands: All of them.
        layout: The roads that they lie between.
        why: Why there are none, or None.
    """
    if why is None and not islands:
        why = "no carriageways near the camera run around one"
    if why is not None:
        return IslandParts(left_out=(LeftOut(FAMILY, why),))
    mesh = merge_meshes([_kerb(island, layout) for island in islands])
    return IslandParts((StaticPart("islands/kerb", "roads", Part(mesh, KERB)),))


def island_shrubs(islands: Sequence[Island], around: Surroundings) -> tuple[Poi, ...]:
    """Place shrubs on islands that are wide enough, as points of interest.

    Args:
        islands: All of them.
        around: Shrubs keep clear of cameras and of what they look at.
    """
    shrubs = [shrub for island in islands for shrub in _shrubs(island, around.seed)]
    places = np.array([place for place, _ in shrubs]).reshape(-1, 2)
    gone = in_the_way(places, around, crown=SHRUB).tolist()
    return tuple(
        planted(f"island:{place[0]:.0f}:{place[1]:.0f}", place, species, tall=False)
        for (place, species), yields in zip(shrubs, gone, strict=True)
        if not yields
    )


def _fits(hole: shapely.Polygon, radius: float) -> bool:
    """Whether a hole is a narrow strip, or as round as the middle of a roundabout."""
    if not _LEAST <= radius <= _WIDEST:
        return False
    if radius <= _STRIP:
        return True
    circle = float(shapely.minimum_bounding_radius(hole))
    return bool(radius > _ROUND * circle)


def _is_passed_inside(hole: shapely.Polygon, network: Network, lanes: LaneIndex) -> bool:
    """Whether lanes around a hole have it on their inner side."""
    ring = hole.exterior
    at = np.arange(0.0, ring.length, min(_STEP, ring.length / 8))
    places = shapely.get_coordinates(shapely.line_interpolate_point(ring, at))
    index, away = lanes.nearest(places)
    near = away < np.hypot(_BESIDE, _STEP)  # lanes are sampled
    if not near.any() or near.mean() < _AROUND:
        return False
    step, way = places - lanes.points[index, :2], lanes.directions[index]
    left = way[:, 0] * step[:, 1] - way[:, 1] * step[:, 0] > 0.0
    inner = ~left if network.left_hand else left
    return bool(inner[near].mean() >= _AROUND)


def _is_slow(hole: shapely.Polygon, network: Network, layout: RoadLayout) -> bool:
    """Whether no fast road runs along a hole."""
    near = layout.cells.tree.query(hole, predicate="dwithin", distance=0.5)
    owners = {layout.cells.owners[k] for k in near.tolist()} & set(layout.strips)
    speeds = [lane.speed for key in owners for lane in network.edges[key].lanes]
    return max(speeds, default=0.0) < _FASTEST


def _kerb(island: Island, layout: RoadLayout) -> Mesh:
    """Kerb stones around an island: their top, and faces to the road and to the middle."""
    shape = island.shape
    inner = shape.buffer(-_STONE, join_style="mitre", mitre_limit=2.0)
    if island.paved:
        inner = shapely.Polygon()
    pieces = [_laid(shapely.difference(shape, inner), layout), _face(shape, layout)]
    pieces += [_face(part, layout, inward=True) for part in polygon_parts(inner)]
    return merge_meshes(pieces)


def _face(shape: shapely.Polygon, layout: RoadLayout, *, inward: bool = False) -> Mesh:
    """A wall around a shape, up to the top of the kerb, that looks outwards or inwards."""
    ring = shapely.get_coordinates(shapely.orient_polygons(shape).exterior)[:-1]
    ring = ring[::-1] if inward else ring
    road = heights_near(layout.cells, ring)
    high, low = (np.column_stack([ring, road + lift]) for lift in (_TOP, -_DEEP))
    return between(high, low, closed=True)


def _laid(shape: shapely.Geometry, layout: RoadLayout) -> Mesh:
    """An area at the height of the kerb's top."""
    flat, faces, _ = triangulate_many([part for part in polygon_parts(shape) if part.area > 1e-3])
    if not len(faces):
        return merge_meshes([])
    return Mesh(np.column_stack([flat, heights_near(layout.cells, flat) + _TOP]), faces)


def _shrubs(island: Island, seed: int) -> list[tuple[Floats, str]]:
    """Places and species of shrubs, on a grid that is out of line."""
    room = island.shape.buffer(-_INSIDE) if island.radius > _STRIP else shapely.Polygon()
    if room.is_empty:
        return []
    x0, y0, x1, y1 = (round(value) for value in room.bounds)
    shrubs, (kinds, _) = [], urn("islands")
    for x in np.arange(x0, x1, _GAP):
        for y in np.arange(y0, y1, _GAP):
            name = f"{x:.1f}:{y:.1f}"
            chance, turn = (share_of(seed, "island", name, word) for word in ("dense", "turn"))
            place = np.array([x, y]) + 0.8 * np.array([np.cos(7 * turn), np.sin(7 * turn)])
            if chance < _DENSE and shapely.contains_xy(room, *place):
                shrubs.append((place, kinds[int(turn * len(kinds))]))
    return shrubs
