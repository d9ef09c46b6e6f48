"""Tunnels: their linings, head walls and lamps, and the ground above them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import between, densified
from sumo3dviz_pt.library.mesh.planar import (
    common,
    polygon_parts,
    triangulate,
    triangulate_many,
    union,
)
from sumo3dviz_pt.library.mesh.shading import smooth_normals
from sumo3dviz_pt.model.geometry import Floats, Mesh, arc_length, merge_meshes, unit
from sumo3dviz_pt.model.scene import LampSet, Part, StaticPart
from sumo3dviz_pt.world.roads.cells import STOREY
from sumo3dviz_pt.world.roads.layout import RoadLayout, levels_of
from sumo3dviz_pt.world.structures.bridges import MATERIAL, concrete
from sumo3dviz_pt.world.structures.deep_roads import Mouth, Tunnel, lid_height, lid_mesh, tunnels_of

LAMP_SET, DAY_SET = "tunnel_lamps", "tunnel_lamps_day"
"""Lamps that always shine, and those near mouths that shine by day."""

_STEP = 3.0
"""Distance of points along walls [m]."""

_FOOT = 0.3
"""How far walls reach below the road [m]."""

_THICK, _COPING, _LINTEL = 0.6, 0.5, 0.8
"""Thickness of a head wall, how far it stands above the ground behind it, and its height above the
opening, at least [m]."""

_APART, _SIZE = 12.0, (1.2, 0.25)
"""Distance of lamps along a lane [m]; their length and width [m]."""

_ENTRANCE, _CLOSE, _BRIGHTER = 60.0, 4.0, 12.0
"""How far from a mouth [m] eyes are used to daylight; there, by day, lamps hang this close [m] and
shine that much brighter (CIE 88:2004, threshold zone)."""

_RADIANCE = (0.06, 0.047, 0.034)
"""Of a lamp, in scene units of 32,000 cd/m2: 1,500 lm, of the colour of street lamps."""

HeightAt = Callable[[Floats], Floats]


def lining(tunnel: Tunnel, layout: RoadLayout, ground_at: HeightAt) -> Mesh:
    """Build the walls and the ceiling of a tunnel, and the head walls at its mouths.

    Args:
        tunnel: What is lined.
        layout: The roads.
        ground_at: Height of the ground, above it too.
    """
    parts = [*_walls(tunnel, layout, ground_at), *_ceilings(tunnel, layout, ground_at)]
    parts += [_head_wall(mouth, tunnel, ground_at) for mouth in tunnel.mouths]
    return merge_meshes([Mesh(part.vertices, part.faces) for part in parts])


def _walls(tunnel: Tunnel, layout: RoadLayout, ground_at: HeightAt) -> Iterator[Mesh]:
    """Walls along the borders of the road in a tunnel, seen from the road."""
    inside = tunnel.area.buffer(0.3, join_style="mitre")
    shapely.prepare(inside)
    for border in levels_of(layout).borders:
        line = np.vstack([border.line, border.line[:1]]) if border.closed else border.line
        dense = densified(line, 0.5 * _STEP)
        within = shapely.intersects_xy(inside, dense[:, 0], dense[:, 1])
        within &= ground_at(dense[:, :2]) - dense[:, 2] > STOREY
        ends = np.flatnonzero(np.diff(np.concatenate([[False], within, [False]]).astype(np.int64)))
        for start, end in ends.reshape(-1, 2):
            if end - start > 1:
                foot = dense[start:end][::-1]
                up = np.array([0.0, 0.0, 1.0])
                yield between(foot + tunnel.height * up, foot - _FOOT * up)


def _ceilings(tunnel: Tunnel, layout: RoadLayout, ground_at: HeightAt) -> Iterator[Mesh]:
    """The ceiling above each cell, seen from below."""
    cells = layout.cells
    for k in np.sort(cells.tree.query(tunnel.area, predicate="intersects")):
        piece = common(cells.polygons[k], tunnel.area)
        flat, faces, _ = triangulate_many(polygon_parts(piece))
        if not len(faces):
            continue
        z = cells.heights(np.full(len(flat), k), flat)
        if (ground_at(flat) - z).min() > STOREY:
            yield Mesh(np.column_stack([flat, z + tunnel.height]), faces[:, ::-1])


def _head_wall(mouth: Mouth, tunnel: Tunnel, ground_at: HeightAt) -> Mesh:
    """A wall that holds the ground back, with an opening for the road."""
    # Its top follows the ground behind it, over the whole opening and its lintel.
    wide = mouth.half + 1.5 * (tunnel.height + 5.0)
    aside = np.linspace(-wide, wide, 2 * round(wide / _STEP) + 1)
    behind = [_placed(mouth, np.column_stack([aside, 0.0 * aside]), -k)[:, :2] for k in (0.3, 1.2)]
    high = np.max([ground_at(places) for places in behind], axis=0) - mouth.middle[2] + _COPING
    over = np.abs(aside) < mouth.half + _STEP
    high = np.where(over, np.maximum(high, tunnel.height + _LINTEL), high)
    high[over] = high[over].max()
    high = np.maximum(high, 0.0)
    hole = mouth.half + 0.05
    foot = [(-hole, -1.0), (-hole, tunnel.height), (hole, tunnel.height), (hole, -1.0)]
    rim = np.column_stack([aside, high])[::-1]
    shape = shapely.Polygon([(-wide, -1.0), *foot, (wide, -1.0), *rim.tolist()])
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
    """Build lamps below the ceilings: one set for day and night, one for days; or none.

    Args:
        tunnels: Where they hang.
        layout: The roads.
    """
    always = [spot for tunnel in tunnels for spot in _spots(tunnel, layout, _APART)]
    close = [spot for tunnel in tunnels for spot in _spots(tunnel, layout, _CLOSE)]
    mouths = np.array([mouth.middle[:2] for some in tunnels for mouth in some.mouths])
    near = [
        (place, ahead)
        for place, ahead in close
        if len(mouths) and np.linalg.norm(mouths - place[:2], axis=1).min() < _ENTRANCE
    ]
    sets = ((LAMP_SET, always, 1.0), (DAY_SET, near, _BRIGHTER))
    return tuple(_lamp_set(name, spots, times) for name, spots, times in sets if spots)


def _lamp_set(name: str, spots: Sequence[tuple[Floats, Floats]], times: float) -> LampSet:
    """Flat lamps at places, (3,) [m], along directions, (2,)."""
    long, wide = (0.5 * size for size in _SIZE)
    corners = np.array([(-long, -wide), (long, -wide), (long, wide), (-long, wide)])
    meshes = []
    for place, ahead in spots:
        aside = np.array([-ahead[1], ahead[0]])
        flat = place[:2] + corners[:, :1] * ahead + corners[:, 1:] * aside
        square = np.column_stack([flat, np.full(4, place[2])])
        meshes.append(Mesh(square, np.array([(0, 2, 1), (0, 3, 2)])))
    count = len(spots)
    return LampSet(
        name,
        "street lamps",
        merge_meshes(meshes),
        np.repeat(np.arange(count), 2),
        tuple(f"{name}/{k}" for k in range(count)),
        sampled=True,
        radiance=np.tile(times * np.array(_RADIANCE), (count, 1)),
        tint=np.full((2 * count, 3), 0.5),
    )


def _spots(tunnel: Tunnel, layout: RoadLayout, apart: float) -> Iterator[tuple[Floats, Floats]]:
    """Places of lamps above the middles of lanes, (3,) [m], and the lanes' directions, (2,)."""
    inside = tunnel.area.buffer(-0.3)
    lines = [s.lane.shape for some in layout.strips.values() for s in some if not s.look.raised]
    for line in lines:
        along = arc_length(line[:, :2])
        at = np.arange(0.5 * apart, along[-1], apart)
        points, ends, back = (
            np.stack([np.interp(at + more, along, line[:, k]) for k in range(3)], axis=1)
            for more in (0.0, 0.5, -0.5)
        )
        ahead = unit((ends - back)[:, :2])
        under = shapely.intersects_xy(inside, points[:, 0], points[:, 1])
        for place, way in zip(points[under], ahead[under], strict=True):
            yield place + np.array([0.0, 0.0, tunnel.height - 0.12]), way


@dataclass(frozen=True, slots=True, eq=False)
class Tunnels:
    """All tunnels.

    Attributes:
        lids: The ground above them.
        height_at: Height of the ground, on lids too, (n, 2) -> (n,) [m].
        static: Linings and head walls.
        lamps: Below the ceilings.
    """

    lids: tuple[Mesh, ...]
    height_at: HeightAt
    static: tuple[StaticPart, ...] = ()
    lamps: tuple[LampSet, ...] = ()


def build_tunnels(layout: RoadLayout, ground: HeightAt, terrain_at: HeightAt) -> Tunnels:
    """Build all tunnels of a layout; nothing where there are none.

    Args:
        layout: The roads.
        ground: Height of the ground as if the deep roads were not there.
        terrain_at: Height of the terrain, in which tunnels are open cuttings.
    """
    tunnels = tunnels_of(layout, ground)
    if not tunnels:
        return Tunnels((), terrain_at)
    top = lid_height(layout, tunnels, ground)
    whole = union([tunnel.lid for tunnel in tunnels])
    shapely.prepare(whole)

    def height_at(places: Floats) -> Floats:
        """Return height of the ground at places, (n, 2) [m], as (n,) [m]."""
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        z = np.array(terrain_at(flat))
        on = np.flatnonzero(shapely.intersects_xy(whole, flat[:, 0], flat[:, 1]))
        if len(on):
            z[on] = np.maximum(z[on], top(flat[on]))
        return z

    bare = [lid_mesh(tunnel, top, terrain_at) for tunnel in tunnels]
    lids = [
        Mesh(lid.vertices, lid.faces, smooth_normals(lid.vertices, lid.faces))
        for lid in bare
        if len(lid.faces)
    ]
    shell = merge_meshes([lining(tunnel, layout, height_at) for tunnel in tunnels])
    part = StaticPart("ground/tunnels", "ground", Part(concrete(shell), MATERIAL))
    return Tunnels(tuple(lids), height_at, (part,), tunnel_lamps(tunnels, layout))
