"""What grows on lots between houses that stay open: trees behind a hedge.

Without it one would look through such gaps over empty fields in the middle of a town.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.placement.sightlines import TREE, hides, in_the_way
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.build import planted
from sumo3dviz_pt.world.rows.lots import SOURCE, Rows, Yard

_GAP = 5.5  # between trees [m]
_EDGE = 2.6  # distance of trunks from the border of the lot [m]
_DENSE = 0.9  # share of places that bear one
_OVERLAP = 0.15  # by how much neighbours may overlap [m]
_HEDGE = 0.7  # how far the hedge's middle lies behind the building line [m]
_THICK = 0.5  # half the width of a hedge [m]
_LOOKED_OVER = 4.0  # cameras higher than this above the roads look over hedges [m]
_SPECIES = ("maple", "lime", "birch", "lime")


def gardens(rows: Rows) -> tuple[Yard, ...]:
    """Open lots that no house reaches into, nor another open lot before them."""
    areas = [shapely.Polygon(yard.plan).buffer(-_OVERLAP) for yard in rows.yards]
    houses = shapely.STRtree([shapely.Polygon(house.plan) for house in rows.houses])
    others = shapely.STRtree(areas)
    return tuple(
        yard
        for number, (yard, area) in enumerate(zip(rows.yards, areas, strict=True))
        if not len(houses.query(area, predicate="intersects"))
        and others.query(area, predicate="intersects").min(initial=number) == number
    )


def yard_trees(yards: Sequence[Yard], around: Surroundings) -> tuple[Poi, ...]:
    """Place trees on open lots, as points of interest.

    Args:
        yards: The lots.
        around: Trees keep clear of cameras and of what they look at.
    """
    found = [
        (f"yard:{yard.id}:{number}", place, species)
        for yard in yards
        for number, (place, species) in enumerate(_trees(yard, around.seed))
    ]
    places = np.array([place for _, place, _ in found]).reshape(-1, 2)
    gone = in_the_way(places, around, crown=TREE).tolist()
    return tuple(
        planted(*tree, tall=True) for tree, yields in zip(found, gone, strict=True) if not yields
    )


def yard_hedges(yards: Sequence[Yard], around: Surroundings) -> tuple[Polygon, ...]:
    """Place hedges along the streets that open lots lie at, as lines.

    Args:
        yards: The lots.
        around: Hedges keep clear of cameras at the height of people and of what they look at.
    """
    found = []
    for yard in yards:
        front = shapely.LineString(yard.plan[: yard.fronts + 1])
        line = front.offset_curve(_HEDGE, join_style="mitre")
        hidden = hides(line.buffer(_THICK), around, over=_LOOKED_OVER)
        if line.geom_type == "LineString" and line.length > 2.0 and not hidden:
            shape = shapely.get_coordinates(line)
            found.append(Polygon(f"yard:{yard.id}", "hedge", shape, False, None, SOURCE))
    return tuple(found)


def _trees(yard: Yard, seed: int) -> Iterator[tuple[Floats, str]]:
    """Places and species of trees in rows that are out of line."""
    inner = shapely.Polygon(yard.plan).buffer(-_EDGE)
    if inner.is_empty:
        return
    rng = np.random.default_rng(int(share_of(seed, "yard trees", yard.id) * 2**48))
    x0, y0, x1, y1 = inner.bounds
    for x in np.arange(x0 + 0.3, x1, _GAP):
        for y in np.arange(y0 + 0.3, y1, _GAP):
            place = np.array([x, y]) + rng.uniform(-0.9, 0.9, 2)
            species = _SPECIES[int(rng.integers(len(_SPECIES)))]
            if shapely.contains_xy(inner, *place) and rng.random() < _DENSE:
                yield place, species
