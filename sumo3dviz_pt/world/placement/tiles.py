"""Squares of the world, each filled by what lies in and around it.

What a tile holds is a pure function of its place: no camera that looks at it decides what
stands there. So shots of one scene show the same world, and tiles that were built for one
shot serve the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.surroundings import Surroundings

_ORIGIN = np.array([17.3, 41.9])
"""A corner of the grid [m]; borders of tiles seldom run along the streets of a regular town."""


@dataclass(frozen=True, slots=True, order=True)
class Tile:
    """A square of the plan.

    Attributes:
        size: Of its sides [m].
        column, row: Its number in the grid of that size.
    """

    size: float
    column: int
    row: int

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north [m]."""
        x, y = (_ORIGIN + self.size * np.array([self.column, self.row])).tolist()
        return x, y, x + self.size, y + self.size

    @property
    def middle(self) -> Floats:
        """(2,) [m]."""
        return _ORIGIN + self.size * (np.array([self.column, self.row]) + 0.5)

    def box(self, margin: float = 0.0) -> shapely.Polygon:
        """Return the square, and a margin [m] around it."""
        x0, y0, x1, y1 = self.bounds
        return shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)

    def depth(self, places: Floats) -> Floats:
        """Return how deep inside places, (n, 2) [m], lie, (n,) [m]; negative outside."""
        away = np.abs(places[:, :2] - self.middle).max(axis=1, initial=0.0)
        return np.asarray(self.size / 2.0 - away)

    def holds(self, places: Floats) -> Bools:
        """Return which places, (n, 2) [m], lie in it; each place lies in one tile of a size."""
        own = _cells(places, self.size)
        return np.asarray((own == [self.column, self.row]).all(axis=1))


def tiles_seen(around: Surroundings, *, size: float, reach: float, beyond: float) -> list[Tile]:
    """Return the tiles of which a camera sees something, in a fixed order.

    Args:
        around: The cameras.
        size: Of the tiles [m].
        reach: Tiles farther than this from every camera are left out [m].
        beyond: What belongs to a tile may stand out this far [m].
    """
    eyes = around.viewpoints
    if not len(eyes):
        return []
    steps = int(np.ceil(reach / size)) + 1
    x, y = np.meshgrid(*[np.arange(-steps, steps + 1)] * 2)
    near = np.column_stack([x.ravel(), y.ravel()])
    cells = np.unique(
        (np.unique(_cells(eyes, size), axis=0)[:, None] + near).reshape(-1, 2), axis=0
    )
    found = [Tile(size, int(column), int(row)) for column, row in cells]
    spots = shapely.points(np.unique(np.round(eyes[:, :2]), axis=0))
    boxes = shapely.STRtree([tile.box() for tile in found])
    within = np.unique(boxes.query(spots, predicate="dwithin", distance=reach + 1.0)[1])
    found = [found[k] for k in within.tolist()]
    middles = np.array([tile.middle for tile in found]).reshape(-1, 2)
    seen = around.seen(middles, radius=size * 0.5**0.5 + beyond)
    return [tile for tile, kept in zip(found, seen, strict=True) if kept]


def edges_in(network: Network, box: shapely.Polygon, memory: Memory) -> list[Edge]:
    """Return edges of which a lane may run through a box, by edge id.

    Args:
        network: The network.
        box: Parallel to the axes [m].
        memory: Of the network's world.
    """
    edges, tree = memory.of(("edges by place",), partial(_edges_by_place, network))
    return [edges[k] for k in sorted(tree.query(box).tolist())]


def _edges_by_place(network: Network) -> tuple[Sequence[Edge], shapely.STRtree]:
    """All edges with lanes, by id, and the boxes around them."""
    edges = [edge for _, edge in sorted(network.edges.items()) if edge.lanes]
    ends = [np.concatenate([lane.shape[:, :2] for lane in edge.lanes]) for edge in edges]
    boxes = [shapely.box(*some.min(axis=0), *some.max(axis=0)) for some in ends]
    return edges, shapely.STRtree(boxes)


def _cells(places: Floats, size: float) -> Ints:
    """Numbers of the tiles that places, (n, 2) [m], lie in, (n, 2)."""
    return np.asarray(np.floor((places[:, :2] - _ORIGIN) / size), dtype=np.int64)
