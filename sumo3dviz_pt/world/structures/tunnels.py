"""Tunnels: their linings and lamps, and the ground above them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import union
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.mesh import smooth_normals
from sumo3dviz_pt.world.structures.concrete import MATERIAL, concrete
from sumo3dviz_pt.world.structures.deep_roads import lid_height, lid_mesh, tunnels_of
from sumo3dviz_pt.world.structures.linings import lining, tunnel_lamps

HeightAt = Callable[[Floats], Floats]


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
    found = tunnels_of(layout, ground)
    if not found:
        return Tunnels((), terrain_at)
    top = lid_height(layout, found, ground)
    whole = union([tunnel.lid for tunnel in found])
    shapely.prepare(whole)

    def height_at(places: Floats) -> Floats:
        """Return height of the ground at places, (n, 2) [m], as (n,) [m]."""
        flat = np.asarray(places, dtype=np.float64)[:, :2]
        z = np.array(terrain_at(flat))
        on = np.flatnonzero(shapely.intersects_xy(whole, flat[:, 0], flat[:, 1]))
        if len(on):
            z[on] = np.maximum(z[on], top(flat[on]))
        return z

    bare = [lid_mesh(tunnel, top, terrain_at) for tunnel in found]
    lids = [
        Mesh(lid.vertices, lid.faces, smooth_normals(lid.vertices, lid.faces))
        for lid in bare
        if len(lid.faces)
    ]
    shell = merge_meshes([lining(tunnel, layout, height_at) for tunnel in found])
    part = StaticPart("ground/tunnels", "ground", Part(concrete(shell), MATERIAL))
    return Tunnels(tuple(lids), height_at, (part,), tunnel_lamps(found, layout))
