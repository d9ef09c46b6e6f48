"""What carries roads above the ground: decks on piers, and walls where no slope has room."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.library.mesh.polyline import densified, mitres
from sumo3dviz_pt.library.mesh.walls import between
from sumo3dviz_pt.library.street.barriers import swept, upright_boxes
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.land.terrain import STEEPEST
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.levels import Border, Levels, levels_of
from sumo3dviz_pt.world.structures.concrete import MATERIAL, concrete
from sumo3dviz_pt.world.structures.decks import deck_mesh, decks_of
from sumo3dviz_pt.world.structures.piers import piers

HIGHEST_WALL = 9.0
"""Roads this far above the ground [m] stand on bridges."""

_STEP = 3.0
"""Distance of points along walls and parapets [m]; that of the terrain's points."""

_SEEN = 0.15
"""Walls lower than this [m] are hidden by the slope beside the road."""

_FALL = 0.9
"""Drops of more than this [m] get a parapet."""

_FOOT = 0.5
"""How far walls reach into the ground [m]."""

_BEYOND = 2
"""Points by which parapets reach beyond the drop."""

_BEAM = np.array([(0.02, -0.42), (0.02, 0.16), (-0.36, 0.16), (-0.36, -0.42)])
"""Section of the beam along an edge: to the left and up [m]."""

_RAILS = ((0.28, 0.02), (0.56, 0.02), (0.84, 0.02), (1.12, 0.035))
"""Heights of a parapet's rails above the road and half their thickness [m]."""

_POST = 2.0
"""Distance of a parapet's posts [m]."""

_FARTHEST = 300.0
"""Parapets farther from every camera [m] are left out."""

_AXIS = -0.18
"""Where a parapet stands, to the left of the road's border [m]."""

HeightAt = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, eq=False)
class _Side:
    """The side of a road above the ground.

    Attributes:
        line: Points along the border, (n, 3) [m]; a closed one repeats its first.
        depth: Of the ground below them, (n,) [m].
        spanning: Where the road is a bridge, (n,).
    """

    line: Floats
    depth: Floats
    spanning: Bools


def build_structures(layout: RoadLayout, height_at: HeightAt) -> tuple[StaticPart, ...]:
    """Build bridges and retaining walls; nothing where roads lie on the ground.

    Args:
        layout: The roads.
        height_at: Height of the ground.
    """
    if layout.cells.is_flat:
        return ()
    zone = bridge_zone(levels_of(layout))
    sides = _sides(layout, height_at)
    decks = decks_of(layout, zone, height_at)
    shell = [*(_walls(side) for side in sides), *(_beams(side) for side in sides)]
    shell += [deck_mesh(deck, layout) for deck in decks]
    shell.append(piers(layout, decks, height_at))
    return _parts("walls", MATERIAL, [concrete(merge_meshes(_bare(shell)))])


def build_parapets(
    layout: RoadLayout, height_at: HeightAt, *, eyes: Floats | None = None
) -> tuple[StaticPart, ...]:
    """Build posts and rails along bridges and walls.

    Args:
        layout: The roads.
        height_at: Height of the ground.
        eyes: Cameras, (n, 3) [m]: only what stands near them is built; default everything.
    """
    if layout.cells.is_flat:
        return ()
    found = [mesh for side in _sides(layout, height_at) for mesh in _parapets(side, eyes)]
    return _parts("parapets", "galvanised", found)


def _parts(name: str, material: str, meshes: list[Mesh]) -> tuple[StaticPart, ...]:
    """One part of several meshes, if they have any face."""
    whole = merge_meshes(meshes)
    return (StaticPart(f"ground/{name}", "ground", Part(whole, material)),) * bool(len(whole.faces))


def _sides(layout: RoadLayout, height_at: HeightAt) -> list[_Side]:
    """The sides of roads along all borders, which are kept in the layout's memory."""

    def found() -> list[_Side]:
        levels = levels_of(layout)
        lines = [_dense(border) for border in levels.borders]
        beside = [line[:, :2] - 0.08 * mitres(line) for line in lines]
        ends = np.cumsum([len(line) for line in lines])[:-1]
        if not lines:
            return []
        ground = np.split(height_at(np.concatenate(beside)), ends)
        zone = bridge_zone(levels)
        shapely.prepare(zone)
        return [_side(line, z, zone) for line, z in zip(lines, ground, strict=True)]

    return layout.memory.of(("sides",), found)


def bridge_zone(levels: Levels) -> shapely.Geometry:
    """Return where upper roads may be bridges: above lower roads and their slopes."""
    crossings = levels.crossings
    if not len(crossings.shared):
        return shapely.Polygon()
    reach = crossings.gap / STEEPEST + 6.0
    return union(shapely.buffer(crossings.shared, reach, quad_segs=4))


def _dense(border: Border) -> Floats:
    """Points along a border, (n, 3) [m]; of a closed one, the first comes again."""
    line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
    return densified(line, _STEP)


def _side(line: Floats, ground: Floats, zone: shapely.Geometry) -> _Side:
    """The side of the road along a line above ground of given heights, (n,) [m]."""
    depth = line[:, 2] - ground
    crossing = np.asarray(shapely.intersects_xy(zone, line[:, 0], line[:, 1]))
    return _Side(line, depth, (crossing & (depth > _FALL)) | (depth > HIGHEST_WALL))


def _walls(side: _Side) -> Mesh:
    """Walls from the border down into the ground, where the road is no bridge."""
    low = side.depth > _SEEN
    shown = (low[1:] | low[:-1]) & ~(side.spanning[1:] | side.spanning[:-1])
    meshes = []
    for part in _stretches(shown):
        top = side.line[part]
        depth = np.maximum(side.depth[part], 0.0) + _FOOT
        meshes.append(between(top, top - depth[:, None] * [0.0, 0.0, 1.0]))
    return merge_meshes(meshes)


def _beams(side: _Side) -> Mesh:
    """Beams along borders beside a drop."""
    falls = [part for part in _stretches(_falling(side)) if part.stop - part.start > 1]
    return merge_meshes(_bare([swept(side.line[part], _BEAM) for part in falls]))


def _parapets(side: _Side, eyes: Floats | None) -> Iterator[Mesh]:
    """Posts and rails along borders beside a drop, near cameras."""
    falls = _falling(side)
    if eyes is not None:
        away, _ = cKDTree(eyes[:, :2]).query(side.line[:, :2])
        falls &= np.asarray(away)[1:] < _FARTHEST
    for part in _stretches(falls):
        line = side.line[part]
        for height, half in _RAILS:
            square = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
            yield swept(line, square + np.array([_AXIS, height]))
        high = _RAILS[-1][0]
        posts = densified(line, _POST)
        yield upright_boxes(posts, (-0.03, _AXIS - 0.03, 0.0), (0.03, _AXIS + 0.03, high))


def _falling(side: _Side) -> Bools:
    """Along which stretches between points the ground lies so low that one could fall, (n-1,)."""
    low = side.depth > _FALL
    falls = low[1:] | low[:-1]
    for _ in range(_BEYOND):
        falls = falls | np.roll(np.append(falls, False), 1)[:-1] | np.append(falls[1:], False)
    return np.asarray(falls)


def _stretches(shown: Bools) -> Iterator[slice]:
    """Slices of points along runs of stretches that are shown, (n-1,)."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]]).astype(np.int64)))
    for start, end in ends.reshape(-1, 2):
        yield slice(int(start), int(end) + 1)


def _bare(meshes: list[Mesh]) -> list[Mesh]:
    """Meshes without normals, so that they can be joined with others that have none."""
    return [Mesh(mesh.vertices, mesh.faces) for mesh in meshes]
