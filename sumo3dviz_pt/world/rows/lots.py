"""Houses in rows, yards between them, and the land between streets that they stand on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.library.buildings.parcels import Lot, lots_along
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.placement.tiles import Tile

SOURCE = "street_fronts"
"""The `source` of areas that rows take."""

DEPTHS = (12.5, 9.5, 7.0)
"""Depths of houses, the first that fits [m]."""

MARGIN = 250.0
"""Blocks of land up to this size belong to one tile [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class House:
    """A house in a row.

    Attributes:
        id: Unique.
        plan: Counter-clockwise corners, (n, 2) [m]; its front walls come first.
        fronts: How many walls look at a street.
        blind: Numbers of walls that neighbours share.
        corner: Whether it stands at a corner.
        main: Whether its street has two lanes or more each way.
    """

    id: str
    plan: Floats
    fronts: int
    blind: tuple[int, ...]
    corner: bool
    main: bool

    @property
    def name(self) -> tuple[str | bytes | int | tuple[int, ...], ...]:
        """Everything that its mesh depends on, as a name in a memory."""
        return self.id, self.plan.tobytes(), self.fronts, self.blind, self.corner, self.main


@dataclass(frozen=True, slots=True, eq=False)
class Yard:
    """A lot in a row on which no house stands.

    Attributes:
        id: Unique.
        plan: As a house's, (n, 2) [m].
        fronts: How many sides look at a street.
    """

    id: str
    plan: Floats
    fronts: int


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows of houses.

    Attributes:
        houses: Tile by tile.
        forecourts: What is paved between pavements and houses.
        yards: Lots that stay open; they may overlap houses of another street.
        why: Why there are none, where the scene has none.
    """

    houses: tuple[House, ...] = ()
    forecourts: tuple[shapely.Polygon, ...] = ()
    yards: tuple[Yard, ...] = ()
    why: str = ""

    def polygons(self) -> tuple[Polygon, ...]:
        """Return houses and forecourts as areas on which nothing else may stand."""
        found = [
            Polygon(f"row:{house.id}", "building", house.plan, True, None, SOURCE)
            for house in self.houses
        ]
        for number, area in enumerate(self.forecourts):
            ring = shapely.get_coordinates(area.exterior)
            found.append(Polygon(f"court:{number}", "forecourt", ring, True, None, SOURCE))
        return tuple(found)


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Land between streets, as far as one tile knows it.

    Attributes:
        land: Its outline, cut off at a margin around the tile.
        tile: The tile whose houses are wanted.
    """

    land: shapely.Polygon
    tile: Tile

    @property
    def is_small(self) -> bool:
        """Whether it belongs to one tile as a whole."""
        x0, y0, x1, y1 = self.land.bounds
        return bool(max(x1 - x0, y1 - y0) <= MARGIN)

    @property
    def room(self) -> shapely.Geometry:
        """Where the tile's houses may stand."""
        if not self.is_small:
            return shapely.intersection(self.land, self.tile.box())
        x0, y0, x1, y1 = self.land.bounds
        own = self.tile.holds(np.array([[x0 + x1, y0 + y1]]) / 2.0)[0]
        # What ends at the margin is the rest of a larger block, far from the tile.
        whole = self.tile.box(MARGIN - 0.01).covers(shapely.box(x0, y0, x1, y1))
        return self.land if own and whole else shapely.Polygon()

    def lots(self, fit: Callable[[Floats], Bools], seed: int) -> list[Lot]:
        """Divide its building lines, those of a larger block only within the tile.

        Args:
            fit: Which places, (n, 2) [m], may bear a front.
            seed: Of widths.
        """

        def share(place: Floats, word: str) -> float:
            """Return a random number of a place, whatever else is built."""
            return share_of(seed, "row", f"{place[0]:.0f}", f"{place[1]:.0f}", word)

        area = shapely.orient_polygons(self.land)
        lines = [shapely.get_coordinates(ring) for ring in (area.exterior, *area.interiors)]
        if not self.is_small:
            lines = [piece for line in lines for piece in self._cut(line)]
        return [
            lot for line in lines for lot in lots_along(line, fit, depth=DEPTHS[0], share=share)
        ]

    def _cut(self, ring: Floats) -> list[Floats]:
        """Those pieces of a ring that lie in the tile, in the ring's direction."""
        inside = shapely.intersection(shapely.LineString(ring), self.tile.box())
        parts = shapely.get_parts(shapely.line_merge(inside, directed=True))
        lines = [part for part in parts if part.geom_type == "LineString"]
        return [shapely.get_coordinates(line) for line in lines]
