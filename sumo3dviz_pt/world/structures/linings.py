"""Linings, head walls and lamps of tunnels."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import common, polygon_parts
from sumo3dviz_pt.library.mesh.polyline import densified
from sumo3dviz_pt.library.mesh.triangulate import triangulate, triangulate_many
from sumo3dviz_pt.library.mesh.walls import between
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.lamps import LampSet, Lobe
from sumo3dviz_pt.model.vectors import arc_length, unit
from sumo3dviz_pt.world.roads.cells import STOREY
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.levels import levels_of
from sumo3dviz_pt.world.structures.deep_roads import Mouth, Tunnel

LAMP_SET = "tunnel_lamps"

_STEP = 3.0
"""Distance of points along walls [m]."""

_FOOT = 0.3
"""How far walls reach below the road [m]."""

_THICK, _COPING = 0.6, 0.5
"""Thickness of a head wall, and how far it stands above the ground behind it [m]."""

_APART, _SIZE = 12.0, (1.2, 0.25)
"""Distance of lamps along a lane [m]; their length and width [m]."""

_RADIANCE = (0.18, 0.14, 0.10)
"""Of a lamp, in scene units of 32,000 cd/m2: 4,500 lm, of the colour of street lamps."""

HeightAt = Callable[[Floats], Floats]


def lining(tunnel: Tunnel, layout: RoadLayout, top: HeightAt) -> Mesh:
    """Build the walls and the ceiling of a tunnel, and the head walls at its mouths.

    Args:
        tunnel: What is lined.
        layout: The roads.
        top: Height of the ground above it.
    """
    parts = [*_walls(tunnel, layout, top), *_ceilings(tunnel, layout, top)]
    parts += [_head_wall(mouth, tunnel, top) for mouth in tunnel.mouths]
    return merge_meshes([Mesh(part.vertices, part.faces) for part in parts])


def _walls(tunnel: Tunnel, layout: RoadLayout, top: HeightAt) -> Iterator[Mesh]:
    """Walls along the borders of the road in a tunnel, seen from the road."""
    inside = tunnel.area.buffer(0.3, join_style="mitre")
    shapely.prepare(inside)
    for border in levels_of(layout).borders:
        line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
        dense = densified(line, 0.5 * _STEP)
        within = shapely.intersects_xy(inside, dense[:, 0], dense[:, 1])
        within &= top(dense[:, :2]) - dense[:, 2] > STOREY
        ends = np.flatnonzero(np.diff(np.concatenate([[False], within, [False]]).astype(np.int64)))
        for start, end in ends.reshape(-1, 2):
            if end - start > 1:
                foot = dense[start:end][::-1]
                up = np.array([0.0, 0.0, 1.0])
                yield between(foot + tunnel.height * up, foot - _FOOT * up)


def _ceilings(tunnel: Tunnel, layout: RoadLayout, top: HeightAt) -> Iterator[Mesh]:
    """The ceiling above each cell, seen from below."""
    cells = layout.cells
    for k in np.sort(cells.tree.query(tunnel.area, predicate="intersects")):
        piece = common(cells.polygons[k], tunnel.area)
        flat, faces, _ = triangulate_many(polygon_parts(piece))
        if not len(faces):
            continue
        z = cells.heights(np.full(len(flat), k), flat)
        if (top(flat) - z).min() > STOREY:
            yield Mesh(np.column_stack([flat, z + tunnel.height]), faces[:, ::-1])


def _head_wall(mouth: Mouth, tunnel: Tunnel, top: HeightAt) -> Mesh:
    """A wall that holds the ground back, with an opening for the road."""
    ground = mouth.middle[2]
    behind = mouth.middle[:2] - 0.5 * mouth.outward
    high = float(top(behind[None])[0]) - ground + _COPING
    wide = mouth.half + 1.5 * high + 2.0
    hole = mouth.half + 0.05
    shape = shapely.Polygon(
        [
            (-wide, -1.0),
            (-hole, -1.0),
            (-hole, tunnel.height),
            (hole, tunnel.height),
            (hole, -1.0),
            (wide, -1.0),
            (wide, high),
            (-wide, high),
        ]
    )
    flat, faces = triangulate(shape)
    ring = shapely.get_coordinates(shapely.orient_polygons(shape).exterior)[:-1]
    front, back = _THICK, -0.05
    return merge_meshes(
        [
            Mesh(_placed(mouth, flat, front), faces[:, ::-1]),
            Mesh(_placed(mouth, flat, back), faces),
            between(_placed(mouth, ring, front), _placed(mouth, ring, back), closed=True),
        ]
    )


def _placed(mouth: Mouth, places: Floats, ahead: float) -> Floats:
    """Places across a mouth and up, (n, 2), so far before it, as points, (n, 3) [m]."""
    flat = mouth.middle[:2] + places[:, :1] * mouth.across + ahead * mouth.outward
    return np.column_stack([flat, mouth.middle[2] + places[:, 1]])


def tunnel_lamps(tunnels: Sequence[Tunnel], layout: RoadLayout) -> tuple[LampSet, ...]:
    """Build lamps below the ceilings, which shine by day and night; none without tunnels.

    Args:
        tunnels: Where they hang.
        layout: The roads.
    """
    frames = [frame for tunnel in tunnels for frame in _lamp_places(tunnel, layout)]
    if not frames:
        return ()
    long, wide = (0.5 * size for size in _SIZE)
    corners = np.array([(-long, -wide), (long, -wide), (long, wide), (-long, wide)])
    meshes = []
    for place, ahead in frames:
        aside = np.array([-ahead[1], ahead[0]])
        flat = place[:2] + corners[:, :1] * ahead + corners[:, 1:] * aside
        square = np.column_stack([flat, np.full(4, place[2])])
        meshes.append(Mesh(square, np.array([(0, 2, 1), (0, 3, 2)])))
    count = len(frames)
    return (
        LampSet(
            LAMP_SET,
            "street lamps",
            merge_meshes(meshes),
            np.repeat(np.arange(count), 2),
            tuple(f"{LAMP_SET}/{k}" for k in range(count)),
            sampled=True,
            radiance=np.tile(_RADIANCE, (count, 1)),
            tint=np.full((2 * count, 3), 0.5),
            lobe=Lobe(),
        ),
    )


def _lamp_places(tunnel: Tunnel, layout: RoadLayout) -> Iterator[tuple[Floats, Floats]]:
    """Places of lamps, (3,) [m], and the directions of their lanes, (2,)."""
    inside = tunnel.area.buffer(-0.3)
    for strips in layout.strips.values():
        for strip in strips:
            if strip.look.raised:
                continue
            line = strip.lane.shape
            along = arc_length(line[:, :2])
            at = np.arange(0.5 * _APART, along[-1], _APART)
            if not len(at):
                continue
            points, ends = (
                np.stack([np.interp(at + more, along, line[:, k]) for k in range(3)], axis=1)
                for more in (0.0, 0.5)
            )
            back = np.stack([np.interp(at - 0.5, along, line[:, k]) for k in range(3)], axis=1)
            ahead = unit((ends - back)[:, :2])
            under = shapely.intersects_xy(inside, points[:, 0], points[:, 1])
            for place, way in zip(points[under], ahead[under], strict=True):
                yield place + np.array([0.0, 0.0, tunnel.height - 0.12]), way
