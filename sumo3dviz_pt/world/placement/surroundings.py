"""What things are placed by: ground, lanes, cameras, chance, squares of the world, names.

Faces of the world belong to things with names; see `Mesh.things`. A name depends on what a thing is
and where it stands, never on cameras or chance, so it is the same in all films of a place.

Each square of the world, a tile, is filled by what lies in and around it. What a tile holds is a
pure function of its place: no camera that looks at it decides what stands there. So shots of one
scene show the same world, and tiles that were built for one shot serve the next.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.buildings.shop_words import ENGLISH
from sumo3dviz_pt.model.camera import CameraPath, in_mirrors, in_picture, in_view
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, settled
from sumo3dviz_pt.model.network import Edge, Network
from sumo3dviz_pt.world.memory import Memory
from sumo3dviz_pt.world.placement.clearance import Clearance
from sumo3dviz_pt.world.placement.lanes import LaneIndex, build_lane_index


def thing_of(name: str) -> str:
    """Return the name of the thing that an object's faces belong to, such as `tree:poi_7`.

    Args:
        name: Of the object: its kind, a colon, and its id.
    """
    kind, _, own = name.partition(":")
    return f"{kind.removesuffix('s')}:{own}"


def thing_at(kind: str, place: Iterable[float]) -> str:
    """Return the name of a thing that has no id: what it is, and where, to 0.1 m.

    Args:
        kind: What it is, such as `bench`.
        place: x, y, and maybe z, [m].
    """
    # Adding 0 makes -0 a 0.
    return f"{kind}:" + ",".join(f"{round(float(one), 1) + 0.0:.1f}" for one in place)


_SINK = 0.05  # how far the ground lies below the nearest road [m]
_USUAL = 100.0  # distance that counts where no camera is known [m]

HeightAt = Callable[[Floats], Floats]
"""Height of the ground at places, (n, 2) [m], as (n,) [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What objects are placed by.

    Attributes:
        index: The network's lanes.
        height_at: Height of the ground.
        viewpoints: Where cameras are during the shot, (n, 3) [m]; n may be 0.
        seed: Of all chance.
        camera_path: Where cameras look, or None: then everything counts as seen.
        clearance: Cameras that nothing grows into or before.
        dark: Whether lamps are lit.
        memory: What was built of the world.
        season: What leaves look like.
        language: Of what is written on shops.
        windy: Whether wind moves plants.
    """

    index: LaneIndex
    height_at: HeightAt
    viewpoints: Floats
    seed: int
    camera_path: CameraPath | None = None
    clearance: Clearance = field(default_factory=Clearance)
    dark: bool = False
    memory: Memory = field(default_factory=Memory)
    season: str = "summer"
    language: str = ENGLISH
    windy: bool = False

    @property
    def eyes(self) -> Floats | None:
        """Where the cameras are, (n, 3) [m]; None if that is not known."""
        return None if self.camera_path is None else self.camera_path.eyes

    def distances(self, places: Floats) -> Floats:
        """Return the distance in plan of places, (n, 2) [m], to the nearest camera, (n,) [m].

        It is 100 m without cameras.
        """
        if not len(self.viewpoints):
            return np.full(len(places), _USUAL)
        away, _ = cKDTree(self.viewpoints[:, :2]).query(places[:, :2])
        return settled(away)

    def seen(self, places: Floats, *, radius: float) -> Bools:
        """Return which balls around places, (n, 2) [m], some camera may see, shadows included."""
        if self.camera_path is None or not len(places):
            return np.ones(len(places), dtype=np.bool_)
        centres = np.column_stack([places, self.height_at(places)])
        return np.asarray(in_view(self.camera_path, centres, radius=radius).any(axis=1))

    def pictured(self, places: Floats, *, radius: float, by: CameraPath | None = None) -> Bools:
        """Return which balls around places, (n, 2) [m], lie in a camera's picture or its mirrors.

        Args:
            places: On the ground.
            radius: Of the balls [m].
            by: The camera; default: any of the shot's.
        """
        camera_path = by or self.camera_path
        if camera_path is None or not len(places):
            return np.ones(len(places), dtype=np.bool_)
        centres = np.column_stack([places, self.height_at(places)])
        seen = in_picture(camera_path, centres, radius=radius)
        if camera_path.behind is not None:
            seen |= in_mirrors(camera_path, centres, radius=radius)
        return np.asarray(seen.any(axis=1))


def surroundings(
    lanes: Network | LaneIndex,
    *,
    seed: int,
    viewpoints: Floats | None = None,
    camera_path: CameraPath | None = None,
    height_at: HeightAt | None = None,
    clearance: Clearance | None = None,
) -> Surroundings:
    """Return what objects of a network are placed by.

    Args:
        lanes: The roads that houses face; they give heights unless those are given.
        seed: Of sizes, models and colours.
        viewpoints: Cameras of the shot, (n, 3) [m]; default the camera path's, else none.
        camera_path: Where the cameras look; what they never see is left out.
        height_at: Height of the ground; default a little below the nearest road.
        clearance: Cameras that nothing grows into or before; default those of the shot.
    """
    index = lanes if isinstance(lanes, LaneIndex) else build_lane_index(lanes)
    if viewpoints is None:
        viewpoints = np.zeros((0, 3)) if camera_path is None else camera_path.positions
    ground = height_at or (lambda places: index.heights(places) - _SINK)
    points = settled(viewpoints).reshape(-1, 3)
    if clearance is None:
        way = camera_path or CameraPath.all_round(points)
        clearance = Clearance((way,)) if len(way.positions) else Clearance()
    return Surroundings(index, ground, points, seed, camera_path=camera_path, clearance=clearance)


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
    tiles = [Tile(size, int(column), int(row)) for column, row in cells]
    spots = shapely.points(np.unique(np.round(eyes[:, :2]), axis=0))
    boxes = shapely.STRtree([tile.box() for tile in tiles])
    within = np.unique(boxes.query(spots, predicate="dwithin", distance=reach + 1.0)[1])
    tiles = [tiles[k] for k in within.tolist()]
    middles = np.array([tile.middle for tile in tiles]).reshape(-1, 2)
    seen = around.seen(middles, radius=size * 0.5**0.5 + beyond)
    return [tile for tile, shown in zip(tiles, seen, strict=True) if shown]


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
