"""Which edge or junction each face of the roads belongs to.

Roads are cut, worn and painted as surfaces, not edge by edge, so it is found afterwards, by the
middles of faces, and only where somebody asks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh
from sumo3dviz_pt.world.roads.cells import Cells
from sumo3dviz_pt.world.roads.layout import RoadLayout

_KINDS = {
    "faces": "kerb",
    "gutter": "kerb",
    "joints": "kerb",
    "kerb": "kerb",
    "stones": "kerb",
    "verge": "verge",
}
"""What parts of roads are that are no lanes, by the second word of their ids."""


@dataclass(frozen=True, slots=True, eq=False)
class RoadOwners:
    """Tells which edge or junction faces of roads belong to.

    Attributes:
        cells: The road surface.
        edges: Ids of the normal edges among its owners.
    """

    cells: Cells
    edges: frozenset[str]

    def things(self, part: str, mesh: Mesh) -> tuple[tuple[str, int], ...]:
        """Return what the faces of a part of the roads belong to; see `Mesh.things`.

        Names are `edge:` and `junction:` with the id of the carriageway, `sidewalk:` with that of
        raised footways, and `marking:`, `kerb:`, `verge:` and `rails:` with that of the nearest.

        Args:
            part: Its id, such as `road/wear/asphalt`.
            mesh: In world coordinates.
        """
        if not len(self.cells.polygons) or part.startswith("road/beyond"):
            return ()
        nearest = _cells_at(self.cells, mesh.vertices[mesh.faces].mean(axis=1))
        first, _, rest = part.partition("/")
        other = _KINDS.get(rest.split("/")[0], "")
        names = self._names({"markings": "marking", "rails": "rails"}.get(first, other))
        return tuple((names[cell], len(list(run))) for cell, run in groupby(nearest.tolist()))

    def _names(self, kind: str) -> Sequence[str]:
        """Names of what belongs to each cell; of lanes and footways if there is no other kind."""
        names = []
        for owner, raised in zip(self.cells.owners, self.cells.raised.tolist(), strict=True):
            lane = "edge" if owner in self.edges else "junction"
            names.append(f"{kind or ('sidewalk' if raised else lane)}:{owner}")
        return names


def owners_of_roads(layout: RoadLayout) -> RoadOwners:
    """Return whom roads belong to."""
    return RoadOwners(layout.cells, frozenset(layout.strips))


def _cells_at(cells: Cells, points: Floats) -> Ints:
    """Return the cell that each point lies on, or else the nearest, (n,)."""
    spots = shapely.points(points[:, :2])
    asked, cell = cells.tree.query(spots, predicate="intersects")
    found = np.full(len(points), -1)
    if cells.is_flat:
        found[asked[::-1]] = cell[::-1]
    else:
        # Of cells above each other, the one at the point's height.
        away = np.abs(cells.heights(cell, points[asked, :2]) - points[asked, 2])
        order = np.lexsort((-cell, -away, asked))
        found[asked[order]] = cell[order]
    beside = np.flatnonzero(found < 0)
    if len(beside):
        near, cell = cells.tree.query_nearest(spots[beside], all_matches=False)
        found[beside[near]] = cell
    return found
