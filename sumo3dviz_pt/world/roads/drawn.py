"""The road surface as it is drawn, which road users stand on.

Inside junctions on slopes, SUMO's ways contradict one another: where two cross, their heights
differ by up to a metre. Only one surface can be drawn there, so it lies above some ways and
below others. It is asked here how far away it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.planar import polygon_parts
from sumo3dviz_pt.library.mesh.triangulate import Triangles, triangulate_all
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.world.memory import digest_of
from sumo3dviz_pt.world.roads.cells import STOREY
from sumo3dviz_pt.world.roads.heights import surface_heights
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.mesh import with_kerb_tops
from sumo3dviz_pt.world.roads.uneven import is_uneven, pieces_of

LEVEL = 3.0
"""Surfaces farther above or below a road user belong to another level [m]."""

_FADING = LEVEL - STOREY
"""Over the last part of that distance its effect fades [m]; nearer levels were cut to one."""

_BESIDE = 1.0
"""Beside the road, the effect of its surface fades over this distance [m]."""

_SMALLEST = 1e-5
"""Slimmer triangles stand upright where two heights meet [m2, twice the area]."""


class _Offers(NamedTuple):
    """Triangles on which points may stand.

    Attributes:
        point: Numbers of the points, (m,).
        gap: How far above each point its triangle lies [m], (m,).
        away: How far beside the point the triangle lies, from above [m], (m,).
    """

    point: Ints
    gap: Floats
    away: Floats


@dataclass(frozen=True, eq=False)
class DrawnSurface:
    """Triangles of carriageways, and of footways as if they had no kerbs.

    Attributes:
        corners: Of the triangles, (m, 3, 3) [m].
    """

    corners: Floats

    @cached_property
    def tree(self) -> shapely.STRtree:
        """Of all triangles from above."""
        return shapely.STRtree(shapely.polygons(self.corners[..., :2]))

    def rise_at(self, points: Floats) -> Floats:
        """Return how far the surface of the points' own level lies above them.

        The nearest surface above or below a point counts; it fades out beside the road, and
        where it is so far away that it belongs to another level.

        Args:
            points: (n, 3) [m].

        Returns:
            (n,) [m]; 0 where there is no surface.
        """
        rise = np.zeros(len(points))
        found = np.zeros(len(points), dtype=np.bool_)
        for offers in self._offers(points, found):
            # The nearest is written last and so stays.
            order = np.lexsort((-np.abs(offers.gap), -np.round(offers.away, 3)))
            order = order[np.abs(offers.gap[order]) < LEVEL]
            gap, away = offers.gap[order], offers.away[order]
            near = np.clip((LEVEL - np.abs(gap)) / _FADING, 0.0, 1.0)
            rise[offers.point[order]] = gap * near * np.clip(1.0 - away / _BESIDE, 0.0, 1.0)
            found[offers.point[order]] = True
        return rise

    def _offers(self, points: Floats, found: np.ndarray) -> Iterator[_Offers]:
        """Yield triangles below points; then those beside points that have found none."""
        spots = shapely.points(points[:, :2])
        point, face = self.tree.query(spots, predicate="intersects")
        yield _Offers(point, self._gaps(face, points[point]), np.zeros(len(point)))
        rest = np.flatnonzero(~found)
        asked, face = self.tree.query(spots[rest], predicate="dwithin", distance=_BESIDE)
        point = rest[asked]
        lines = shapely.shortest_line(self.tree.geometries[face], spots[point])
        feet = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 0]
        beside = np.column_stack([feet, points[point, 2]])
        away = np.hypot(*(feet - points[point, :2]).T)
        yield _Offers(point, self._gaps(face, beside), away)

    def _gaps(self, face: Ints, points: Floats) -> Floats:
        """How far triangles lie above points, (m,) [m]."""
        a, b, c = (self.corners[face, k] for k in range(3))
        normal = np.cross(b - a, c - a)
        away = points[:, :2] - a[:, :2]
        height = a[:, 2] - (away * normal[:, :2]).sum(axis=1) / normal[:, 2]
        return np.asarray(height - points[:, 2])


def drawn_surface(layout: RoadLayout) -> DrawnSurface | None:
    """Return the surface that is drawn of roads; None where all of it has one height."""
    if layout.cells.is_flat:
        return None
    return layout.memory.of(("drawn surface",), lambda: _surface(layout))


def _surface(layout: RoadLayout) -> DrawnSurface:
    """The triangles of all cells, at the heights of the road without kerbs."""
    cells = layout.memory.of(("kerb tops",), lambda: with_kerb_tops(layout.cells, layout.raised))

    def triangles(index: int) -> Triangles:
        polygon = cells.polygons[index]
        # This is the name by which the mesh of the surface keeps them, too.
        name = ("rest", digest_of(polygon), is_uneven(cells, index), (), ())
        return layout.memory.by_content.of(
            name, lambda: triangulate_all(pieces_of(cells, index, polygon_parts(polygon)))
        )

    found = [triangles(index) for index in range(len(cells.polygons))]
    flat = np.concatenate([np.zeros((0, 2)), *(some for some, _ in found)])
    owner = np.repeat(np.arange(len(found)), [len(some) for some, _ in found])
    starts = np.cumsum([0, *(len(some) for some, _ in found)])[:-1]
    moved = [faces + start for (_, faces), start in zip(found, starts, strict=True)]
    faces = np.concatenate([np.zeros((0, 3), np.int64), *moved])
    vertices = np.column_stack([flat, surface_heights(cells, owner, flat)])
    corners = vertices[faces]
    sides = corners[:, 1:, :2] - corners[:, :1, :2]
    twice = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    return DrawnSurface(corners[twice > _SMALLEST])
