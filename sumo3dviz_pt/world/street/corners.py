"""Furniture on the corners of streets: at their outer border, out of people's way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import areal
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.world.street.furniture import FurnitureItem, hides_nothing, off_lanes
from sumo3dviz_pt.world.street.places import Site


@dataclass(frozen=True, slots=True)
class _CornerItem:
    """A kind of furniture on corners.

    Attributes:
        often: Share of corners that have one.
        room: Radius around its middle that it takes up [m].
        half: Half of how deep it is [m].
    """

    often: float
    room: float
    half: float


# fmt: off
_KINDS: Mapping[str, _CornerItem] = {
    #                           often room  half
    "cabinet":            _CornerItem(0.75, 0.60, 0.18),
    "advertising_column": _CornerItem(0.30, 0.75, 0.72),
    "bicycle_stand":      _CornerItem(0.55, 0.60, 0.42),
    "post_box":           _CornerItem(0.40, 0.35, 0.22),
    "bin":                _CornerItem(0.70, 0.25, 0.22),
    "bench":              _CornerItem(0.40, 0.95, 0.32),
}
# fmt: on

_GAPS = (0.12, 0.5, 1.2, 1.9, 2.6)
"""From the outer border to the back of a piece, the first that fits [m]."""

_SMALLEST = 25.0
"""Smaller corners stay empty [m2]."""

_PATH = 0.5
"""From walkers' shortest lines to a piece [m]."""

_ROAD = 2.0
"""Borders with a carriageway, a crossing or a footway this near are no outer ones [m]."""


def place_corners(edges: Sequence[Edge], network: Network, site: Site) -> list[FurnitureItem]:
    """Place furniture on corners, chosen by the seed.

    Args:
        edges: Those that are walking areas are the corners.
        network: The road network.
        site: What is free; furniture is added to it.
    """
    pieces: list[FurnitureItem] = []
    for edge in edges:
        outline = edge.lanes[0].shape if edge.function == "walkingarea" else np.zeros((0, 3))
        if len(outline) < 3:
            continue
        area = areal(shapely.make_valid(shapely.Polygon(outline[:, :2])))
        if area.area > _SMALLEST:
            pieces += _on_corner(edge, area, network, site)
    return pieces


def _on_corner(
    edge: Edge, area: shapely.Geometry, network: Network, site: Site
) -> list[FurnitureItem]:
    """Pieces along the outer border of one corner."""
    # Find its outer border, and the lines along which people walk.
    seed = site.around.seed
    doors = _doors(edge, network)
    paths = shapely.union_all([shapely.LineString(pair) for pair in combinations(doors, 2)])
    spots, inward = _outer_border(area, doors, site)
    # Put pieces there, some of them a little further in.
    pieces: list[FurnitureItem] = []
    for name, kind in _KINDS.items():
        if not len(spots) or share_of(seed, edge.id, name) > kind.often:
            continue
        inside = area.buffer(-kind.half)
        for gap in _GAPS:
            places = spots + (gap + kind.half) * inward
            dots = shapely.points(places)
            fits = site.free(places, radius=kind.room) & shapely.contains(inside, dots)
            good = np.flatnonzero(fits & (shapely.distance(dots, paths) > _PATH + kind.half))
            if not len(good):
                continue
            k = int(good[int(share_of(seed, edge.id, name, "at") * len(good))])
            z = float(site.standing(places[k : k + 1])[0])
            yaw = float(np.arctan2(inward[k, 1], inward[k, 0]))
            piece = FurnitureItem(name, (float(places[k, 0]), float(places[k, 1]), z), yaw)
            if off_lanes(piece, site) and hides_nothing(name, places[k : k + 1], site)[0]:
                site.use(places[k : k + 1])
                pieces.append(piece)
                break
    return pieces


def _doors(edge: Edge, network: Network) -> list[Floats]:
    """Where walkers enter a corner: ends of crossings and footways that touch it."""
    outline = shapely.Polygon(edge.lanes[0].shape[:, :2]).buffer(0.4)
    junction = edge.id[1:].rpartition("_")[0]
    doors: list[Floats] = []
    for other in network.edges.values():
        near = (
            other.id.startswith(f":{junction}_")
            if other.function == "crossing"
            else (junction in {other.from_junction, other.to_junction})
        )
        if not near or other.function in {"walkingarea", "internal"}:
            continue
        for lane in other.lanes:
            if "pedestrian" not in lane.allowed or not len(lane.shape):
                continue
            for end in (lane.shape[0, :2], lane.shape[-1, :2]):
                if outline.contains(shapely.Point(end)):
                    doors.append(end)
    return doors


def _outer_border(
    area: shapely.Geometry, doors: Sequence[Floats], site: Site
) -> tuple[Floats, Floats]:
    """Points of the border away from roads and doors, and unit vectors inwards, (n, 2) each."""
    part = max(getattr(area, "geoms", [area]), key=lambda one: one.area)
    ring = shapely.orient_polygons(part).exterior
    at = np.arange(0.25, ring.length, 0.5)
    points = shapely.get_coordinates(shapely.line_interpolate_point(ring, at))
    ahead = shapely.get_coordinates(shapely.line_interpolate_point(ring, at + 0.05)) - points
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    inward = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    outer = ~site.around.index.covers(points, margin=_ROAD)
    for door in doors:
        outer &= np.hypot(*(points - door).T) > _ROAD
    return points[outer], inward[outer]
