"""Roads too far away to show more than their surface: a ribbon for each lane, no kerbs, no paint.

They are built of all lanes at once and are not cut where they overlap, which takes a hundredth
of the time of a road in detail.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.materials.by_key import metres_per_tile, planar_uvs, shows_wear
from sumo3dviz_pt.library.mesh.triangulate import triangulate_many
from sumo3dviz_pt.model.geometry import UNWORN, Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Junction, Network
from sumo3dviz_pt.world.roads.cells import Polygons
from sumo3dviz_pt.world.roads.style import PAVING, is_skipped, junction_surface, look_of, style_of

_SHARPEST = 2.0
"""The outer corner of a bend lies at most this far out, by half of the ribbon's width."""

_STEP = 0.01
"""By how much what overlaps lies above each other [m]."""


class Line(NamedTuple):
    """The middle of a ribbon.

    Attributes:
        points: (n, 3) [m], n >= 2.
        width: [m].
    """

    points: Floats
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class PlainRoads:
    """Roads without details.

    Attributes:
        meshes: By surface key.
        outlines: Of lanes and junctions from above, (n,) polygons that may overlap.
        points: On them, (m, 3) [m].
    """

    meshes: dict[str, Mesh] = field(default_factory=dict)
    outlines: Polygons = field(default_factory=lambda: np.zeros(0, dtype=object))
    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))


def plain_roads(
    network: Network, settings: RoadSettings, *, near: tuple[float, float], textured: bool
) -> PlainRoads:
    """Build the lanes of normal edges and the junctions of a network as ribbons and areas.

    Args:
        network: The network.
        settings: Surfaces and widths of lanes.
        near: A point of the network [m] near which texture coordinates are small.
        textured: False leaves out what says how worn a surface is.
    """
    lanes, areas = _lanes_by_surface(network, settings), _junctions_by_surface(network, settings)
    # Where they overlap, pavements lie above roads and those above junctions.
    meshes: dict[str, Mesh] = {}
    outlines: list[Polygons] = [np.zeros(0, dtype=object)]
    for surface in sorted({*lanes, *areas}):
        ribbon = ribbons(lanes.get(surface, ()))
        shapes, filled = _areas(areas.get(surface, ()))
        mesh = merge_meshes([_lifted(ribbon.mesh, _STEP * (surface == PAVING)), filled])
        outlines += [ribbon.outlines, shapes]
        if len(mesh.faces):
            meshes[surface] = _shown(mesh, surface, near, textured)
    points = np.concatenate([np.zeros((0, 3)), *(mesh.vertices for mesh in meshes.values())])
    return PlainRoads(meshes, np.concatenate(outlines), points)


def _lanes_by_surface(network: Network, settings: RoadSettings) -> dict[str, list[Line]]:
    """Middles and widths of the lanes that are drawn."""
    found: dict[str, list[Line]] = {}
    for edge in network.edges.values():
        if edge.function not in {"normal", "connector"}:
            continue
        style = style_of(edge.id, settings)
        for lane in edge.lanes:
            if not is_skipped(lane) and len(lane.shape) > 1:
                look = look_of(lane, style)
                found.setdefault(look.surface, []).append(Line(lane.shape, look.width))
    return found


def _junctions_by_surface(network: Network, settings: RoadSettings) -> dict[str, list[Junction]]:
    """The junctions that have an area."""
    found: dict[str, list[Junction]] = {}
    for key, junction in network.junctions.items():
        if junction.type != "internal" and len(junction.outline) > 2:
            found.setdefault(junction_surface(network, key, settings), []).append(junction)
    return found


def _lifted(mesh: Mesh, height: float) -> Mesh:
    """A mesh moved up [m]."""
    return Mesh(mesh.vertices + np.array([0.0, 0.0, height]), mesh.faces)


@dataclass(frozen=True, slots=True, eq=False)
class Ribbons:
    """Lines with a width.

    Attributes:
        mesh: Of all of them.
        outlines: Of each from above, (n,) valid polygons.
    """

    mesh: Mesh
    outlines: Polygons


def ribbons(lines: Sequence[Line]) -> Ribbons:
    """Build ribbons along lines, all at once."""
    if not lines:
        return Ribbons(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), np.zeros(0, object))
    counts = np.array([len(line) for line, _ in lines])
    points = np.concatenate([line for line, _ in lines])
    half = np.repeat([0.5 * width for _, width in lines], counts)
    owner = np.repeat(np.arange(len(lines)), counts)
    across = half[:, None] * _mitres(points, owner)
    left, right = points.copy(), points.copy()
    left[:, :2] += across
    right[:, :2] -= across
    # Two triangles between each point and the next of its line.
    start = np.flatnonzero(owner[1:] == owner[:-1])
    n = len(points)
    quads = np.stack([start + n, start + n + 1, start + 1, start], axis=1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    # Around each line: its right side forwards, its left side backwards.
    order = np.lexsort((np.concatenate([np.arange(n), 2 * n - np.arange(n)]), np.tile(owner, 2)))
    ring = np.concatenate([right, left])[order, :2]
    rings = shapely.linearrings(ring, indices=np.tile(owner, 2)[order])
    return Ribbons(
        Mesh(np.concatenate([left, right]), faces), shapely.make_valid(shapely.polygons(rings))
    )


def _mitres(points: Floats, owner: Ints) -> Floats:
    """Vectors that carry each point of many lines one metre to the left of its line, (n, 2)."""
    steps = np.diff(points[:, :2], axis=0)
    inside = owner[1:] == owner[:-1]
    length = np.linalg.norm(steps, axis=1)
    good = inside & (length > 1e-9)
    sides = np.zeros_like(steps)
    sides[good] = np.column_stack([-steps[good, 1], steps[good, 0]]) / length[good, None]
    total = np.zeros((len(points), 2))
    total[:-1] += sides
    total[1:] += sides
    long = np.linalg.norm(total, axis=1)
    met = np.zeros(len(points), dtype=np.int64)
    met[:-1] += good
    met[1:] += good
    # |n1 + n2|^2 = 2 (1 + n1 . n2), so dividing twice by the length gives the mitre.
    reach = np.where(met > 1, np.minimum(2.0 / np.maximum(long, 1e-9), _SHARPEST), 1.0)
    return np.asarray(total / np.maximum(long, 1e-9)[:, None] * reach[:, None])


def _areas(junctions: Sequence[Junction]) -> tuple[Polygons, Mesh]:
    """Outlines of junctions from above, and their surfaces."""
    if not junctions:
        return np.zeros(0, dtype=object), Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    shapes = [shapely.make_valid(shapely.Polygon(node.outline[:, :2])) for node in junctions]
    parts = [part for shape in shapes for part in shapely.get_parts(shape)]
    parts = [part for part in parts if isinstance(part, shapely.Polygon) and part.area > 0.0]
    flat, faces, _ = triangulate_many(parts)
    known = np.concatenate([node.outline for node in junctions])
    heights = known[cKDTree(known[:, :2]).query(flat)[1], 2] if len(flat) else np.zeros(0)
    return np.array(parts, dtype=object), Mesh(np.column_stack([flat, heights - _STEP]), faces)


def _shown(mesh: Mesh, surface: str, near: tuple[float, float], textured: bool) -> Mesh:
    """A mesh as its surface is shown."""
    uvs = planar_uvs(mesh.vertices, tile=metres_per_tile(surface), near=near)
    wear = np.tile(UNWORN, (len(mesh.vertices), 1)) if textured and shows_wear(surface) else None
    return Mesh(mesh.vertices, mesh.faces, None, uvs, wear)
