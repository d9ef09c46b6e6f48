"""Finds where vehicles may drive, asphalt of junctions between their lanes included."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import subtract, union
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.network import Lane, Network
from sumo3dviz_pt.world.placement.lane_index import LaneIndex
from sumo3dviz_pt.world.roads.style import is_footway


@dataclass(frozen=True, slots=True, eq=False)
class DrivenGround:
    """Lanes and the asphalt of junctions, searchable.

    Attributes:
        lanes: Carriageway lanes.
        outlines: A tree of the outlines of junctions.
        walks: A tree of footways and walking areas, which lie on junctions.
        crossings: A tree of crossings, which lie on the asphalt.
        known: Asphalt of junctions by their place in `outlines`; it grows.
    """

    lanes: LaneIndex
    outlines: shapely.STRtree
    walks: shapely.STRtree
    crossings: shapely.STRtree
    known: dict[int, shapely.Geometry] = field(default_factory=dict)

    def covers(self, places: Floats, *, margin: float = 0.0) -> Bools:
        """Return whether places, (m, 2) [m], may be driven on, or lie within a margin [m] of it."""
        covered = self.lanes.covers(places, margin=margin)
        if not len(places) or not len(self.outlines.geometries):
            return covered
        spots = shapely.points(places)
        asked, found = self.outlines.query(spots, predicate="dwithin", distance=margin)
        for key in np.unique(found).tolist():
            own = asked[found == key]
            covered[own] |= shapely.dwithin(spots[own], self._asphalt(key), margin)
        return covered

    def _asphalt(self, key: int) -> shapely.Geometry:
        """What vehicles may drive on in a junction, besides lanes."""
        if key not in self.known:
            outline = self.outlines.geometries[key]
            walks, crossings = (
                tree.geometries[tree.query(outline, predicate="intersects")]
                for tree in (self.walks, self.crossings)
            )
            paved = subtract(union(walks), list(crossings))
            self.known[key] = subtract(outline, [paved])
        return self.known[key]


def driven_ground(network: Network, lanes: LaneIndex) -> DrivenGround:
    """Index where vehicles may drive in a network with these lanes."""
    outlines = [
        _area(junction.outline)
        for junction in network.junctions.values()
        if junction.type != "internal" and len(junction.outline) > 2
    ]
    walks, crossings = [], []
    for edge in network.edges.values():
        if edge.function == "walkingarea":
            walks += [_area(lane.shape) for lane in edge.lanes if len(lane.shape) > 2]
        elif edge.function == "crossing":
            crossings += [_strip(lane) for lane in edge.lanes]
        elif edge.function == "normal":
            walks += [_strip(lane) for lane in edge.lanes if is_footway(lane)]
    return DrivenGround(lanes, *(shapely.STRtree(some) for some in (outlines, walks, crossings)))


def _strip(lane: Lane) -> shapely.Geometry:
    """A lane from above."""
    line = shapely.LineString(lane.shape[:, :2])
    return line.buffer(lane.width / 2, cap_style="flat")


def _area(outline: Floats) -> shapely.Geometry:
    """An outline, (n, 3) [m], as a valid area."""
    return shapely.make_valid(shapely.Polygon(np.round(outline[:, :2], 3)))
