"""Lays out the whole road surface without overlaps or gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.rails.beds import with_own_tracks
from sumo3dviz_pt.world.roads.areas import (
    JunctionInside,
    junction_cells,
    junction_insides,
    known_heights,
    sliver_cells,
    walking_cells,
    without_ways,
)
from sumo3dviz_pt.world.roads.cells import (
    Cells,
    Polygons,
    join_cells,
    lane_cells,
    without_overlaps,
)
from sumo3dviz_pt.world.roads.mesh import outer_area, without_crumbs
from sumo3dviz_pt.world.roads.plain import PlainRoads
from sumo3dviz_pt.world.roads.strips import BoundsXY, Strip, network_strips
from sumo3dviz_pt.world.roads.style import with_style


@dataclass(frozen=True, slots=True, eq=False)
class RoadLayout:
    """The road surface before it becomes meshes.

    Attributes:
        cells: Pieces without overlaps.
        strips: Lanes of normal edges, from right to left, by edge id.
        insides: Contents of junctions, by junction id.
        raised: Connected footways from above, (n,) polygons.
        outline: Connected pieces of everything that is paved and built in detail, (n,) polygons.
        memory: What was built on it, by cells and strips; a part of the world's memory.
        beyond: Roads farther away, which show no more than their surface.
    """

    cells: Cells
    strips: Mapping[str, tuple[Strip, ...]]
    insides: Mapping[str, JunctionInside]
    raised: Polygons
    outline: Polygons
    memory: Memory = field(default_factory=Memory)
    beyond: PlainRoads = field(default_factory=PlainRoads)

    @property
    def paved(self) -> list[shapely.Polygon]:
        """Everything that is paved, in detail or not; pieces beyond may overlap."""
        return [*self.outline, *self.beyond.outlines]


def layout_roads(
    network: Network,
    settings: RoadSettings,
    *,
    region: BoundsXY | None = None,
    memory: Memory | None = None,
) -> RoadLayout:
    """Lay out the road surface without overlaps or gaps.

    Args:
        network: The network.
        settings: Surfaces, widths and overrides.
        region: Only lanes and junctions that touch this box are built [m].
        memory: Keeps what is built on this layout; no other layout may use it.
    """
    memory = memory or Memory()
    settings = with_style(settings, network)
    strips = with_own_tracks(network_strips(network, settings, region=region, memory=memory))
    insides = junction_insides(network, settings, region=region, memory=memory)
    carriageways = _lane_cells(strips, raised=False)
    footways = without_ways(_lane_cells(strips, raised=True), insides)
    lanes = join_cells([carriageways, footways])
    known = known_heights(network, insides, lanes=lanes, memory=memory)
    walks = walking_cells(insides, footways=footways, known=known, memory=memory)
    walks = without_ways(walks, insides)
    slivers = sliver_cells(network, settings, strips)
    around = join_cells([lanes, walks])
    junctions = junction_cells(
        network, settings, insides=insides, lanes=around, known=known, memory=memory
    )
    junctions = without_ways(junctions, insides)
    joined = without_overlaps(join_cells([lanes, walks, slivers, junctions]))
    cells, raised = without_crumbs(joined)
    return RoadLayout(cells, strips, insides, raised, outer_area(cells), memory)


def _lane_cells(strips: Mapping[str, tuple[Strip, ...]], *, raised: bool) -> Cells:
    """Cells of all lanes that are raised, or all that are not."""
    chosen = [
        (strip, key)
        for key, group in strips.items()
        for strip in group
        if strip.look.raised == raised
    ]
    return lane_cells([strip for strip, _ in chosen], [key for _, key in chosen])
