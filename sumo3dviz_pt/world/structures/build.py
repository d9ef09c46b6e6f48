"""What carries roads above the ground: decks on piers, and walls where no slope has room."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.materials.by_key import KERB
from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.library.mesh.polyline import mitres
from sumo3dviz_pt.library.mesh.walls import between
from sumo3dviz_pt.library.street.barriers import swept, upright_boxes
from sumo3dviz_pt.model.geometry import Bools, Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.land.terrain import STEEPEST, densified
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.levels import Border, Levels, levels_of
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
    """Build bridges, parapets and retaining walls; nothing where roads lie on the ground.

    Args:
        layout: The roads.
        height_at: Height of the ground.
    """
    if layout.cells.is_flat:
        return ()
    levels = levels_of(layout)
    zone = bridge_zone(levels)
    sides = [_side(border, zone, height_at) for border in levels.borders]
    decks = decks_of(layout, zone, height_at)
    concrete = [*(_walls(side) for side in sides), *(_beams(side) for side in sides)]
    concrete += [deck_mesh(deck, layout) for deck in decks]
    concrete.append(piers(layout, decks, height_at))
    rails = merge_meshes([mesh for side in sides for mesh in _parapets(side)])
    found = [
        StaticPart("ground/walls", "ground", Part(merge_meshes(_bare(concrete)), KERB)),
        StaticPart("ground/parapets", "ground", Part(rails, "galvanised")),
    ]
    return tuple(part for part in found if len(part.part.mesh.faces))


def bridge_zone(levels: Levels) -> shapely.Geometry:
    """Return where upper roads may be bridges: above lower roads and their slopes."""
    crossings = levels.crossings
    if not len(crossings.shared):
        return shapely.Polygon()
    reach = crossings.gap / STEEPEST + 6.0
    return union(shapely.buffer(crossings.shared, reach, quad_segs=4))


def _side(border: Border, zone: shapely.Geometry, height_at: HeightAt) -> _Side:
    """The side of the road along a border."""
    line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
    line = densified(line, _STEP)
    beside = line[:, :2] - 0.08 * mitres(line)
    depth = line[:, 2] - height_at(beside)
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


def _parapets(side: _Side) -> Iterator[Mesh]:
    """Posts and rails along borders beside a drop."""
    for part in _stretches(_falling(side)):
        line = densified(side.line[part], _POST)
        for height, half in _RAILS:
            square = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
            yield swept(line, square + np.array([_AXIS, height]))
        high = _RAILS[-1][0]
        yield upright_boxes(line, (-0.03, _AXIS - 0.03, 0.0), (0.03, _AXIS + 0.03, high))


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
