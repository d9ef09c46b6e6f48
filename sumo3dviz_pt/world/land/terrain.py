"""A terrain that follows sloped roads from below.

Heights are known on the roads only. Between and beyond them the nearest roads'
heights are blended and smoothed; then every grid cell that a road crosses is pushed
below it, so that no hill pokes through. Walls close what is left under road edges.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely
from scipy import ndimage, spatial
from scipy.interpolate import RegularGridInterpolator

from sumo3dviz_pt.library.mesh.grids import height_field
from sumo3dviz_pt.library.mesh.planar import polygon_parts
from sumo3dviz_pt.library.mesh.walls import walls
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.world.land.horizon import Land
from sumo3dviz_pt.world.roads.heights import surface_heights
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.mesh import area_rings

_MARGIN = 0.10
"""How far the terrain stays below the roads at least [m]."""

_CELL = 10.0
"""Grid spacing near what is built [m]."""

_COARSE = 40.0
"""Grid spacing in the rest of the network [m]."""

_MOST = 260
"""Most grid lines near what is built, per axis; larger places get a wider grid."""

_FAR = 20_000.0
"""Where the terrain ends [m]."""

_HIGHEST_WALL = 9.0
"""Roads this far above the terrain [m] are bridges."""

_BRIDGE_SIDE = 1.2
"""Height of a bridge's side [m]."""

HeightAt = Callable[[Floats], Floats]


def terrain(
    roads: RoadLayout, network: Network, *, land: Land | None = None
) -> tuple[Mesh, HeightAt]:
    """Build the terrain's mesh, and a function that gives its height at points (n, 2) [m].

    Args:
        roads: What is built; the grid is fine around it.
        network: All roads, which give the heights further away.
        land: Its hills are added, if given.
    """
    samples = road_samples(roads)
    lanes = np.concatenate([lane.shape for lane in network.lanes.values()])
    x, y = (
        _grid_lines(samples[:, axis], (float(lanes[:, axis].min()), float(lanes[:, axis].max())))
        for axis in (0, 1)
    )
    thin = samples[:: max(len(samples) // 40_000, 1)]
    z = _blended(thin, lanes, x, y=y)
    z = _pushed_below(samples, x, y, z=z)
    if land is not None:
        z = z + _hills(land, x, y)
    field = RegularGridInterpolator((y, x), z, bounds_error=False, fill_value=None)

    def height_at(points: Floats) -> Floats:
        """Return height of the terrain at points, (n, 2) [m], as (n,) [m]."""
        return np.asarray(field(np.asarray(points)[:, 1::-1]))

    return height_field(x, y, z), height_at


def _hills(land: Land, x: Floats, y: Floats) -> Floats:
    """Height of the land's hills over the grid, (m, n) [m]."""
    xx, yy = np.meshgrid(x, y)
    return land.heights(np.column_stack([xx.ravel(), yy.ravel()])).reshape(xx.shape)


def road_samples(roads: RoadLayout, *, spacing: float = 2.5) -> Floats:
    """Return points along the outlines of the road surface, (n, 3) [m].

    Args:
        roads: The roads.
        spacing: Largest distance between neighbours [m].
    """
    parts = [(p, i) for i, shape in enumerate(roads.cells.polygons) for p in polygon_parts(shape)]
    rings = shapely.segmentize([part.exterior for part, _ in parts], spacing)
    flat, ring = shapely.get_coordinates(rings, return_index=True)
    cell = np.array([i for _, i in parts], dtype=np.int64)[ring]
    return np.column_stack([flat, surface_heights(roads.cells, cell, flat)])


def retaining_walls(roads: RoadLayout, height_at: HeightAt) -> Mesh:
    """Build walls from the outer edges of the roads down into the terrain."""
    rings = area_rings(roads.outline, roads.cells)
    bottoms = []
    for ring in rings:
        depth = ring[:, 2] - height_at(ring[:, :2])
        # Higher up it is a bridge, which shows only its own side.
        depth = np.where(depth > _HIGHEST_WALL, _BRIDGE_SIDE, np.maximum(depth, 0.0) + 0.5)
        bottoms.append(ring - depth[:, None] * np.array([0.0, 0.0, 1.0]))
    return walls(rings, bottoms)


def _grid_lines(near: Floats, whole: tuple[float, float]) -> Floats:
    """Grid lines of one axis.

    Args:
        near: Coordinates of what is built, (n,) [m]; the lines are densest there.
        whole: Where the network begins and ends [m]; from there they thin out to the
            horizon.
    """
    low, high = float(near.min()) - 60.0, float(near.max()) + 60.0
    begin, end = min(whole[0], low), max(whole[1], high)
    fine = np.linspace(low, high, _count(high - low, _CELL, _MOST))
    before = np.linspace(begin, low, _count(low - begin, _COARSE, _MOST // 2))[:-1]
    after = np.linspace(high, end, _count(end - high, _COARSE, _MOST // 2))[1:]
    beyond = np.geomspace(_COARSE, _FAR, 32)
    return np.concatenate([begin - beyond[::-1], before, fine, after, end + beyond])


def _count(length: float, spacing: float, most: int) -> int:
    """Number of grid lines for a stretch [m]."""
    return max(2, min(int(np.ceil(length / spacing)) + 1, most)) if length > 0.0 else 1


def _blended(built: Floats, lanes: Floats, x: Floats, *, y: Floats) -> Floats:
    """Inverse-distance heights of the nearest roads, smoothed, (m, n) [m]."""
    xx, yy = np.meshgrid(x, y)
    grid = np.column_stack([xx.ravel(), yy.ravel()])
    samples = np.concatenate([built, lanes])
    count = min(12, len(samples))
    away, near = (np.asarray(v) for v in spatial.cKDTree(samples[:, :2]).query(grid, k=count))
    weights = 1.0 / (away**2 + 4.0)
    z = (weights * samples[near, 2]).sum(axis=1) / weights.sum(axis=1)
    smooth = ndimage.gaussian_filter(z.reshape(xx.shape), 2.0, mode="nearest")
    # Built roads carry the truth, so smoothing fades in with distance from them; roads
    # that are not built may be tunnels, whose pits it softens.
    from_built = np.asarray(spatial.cKDTree(built[:, :2]).query(grid)[0])
    share = np.clip(from_built / 60.0, 0.0, 1.0).reshape(xx.shape)
    return np.asarray((1 - share) * z.reshape(xx.shape) + share * smooth)


def _pushed_below(samples: Floats, x: Floats, y: Floats, *, z: Floats) -> Floats:
    """Lower the corners of every grid cell below all road points in it."""
    column = np.clip(np.searchsorted(x, samples[:, 0]) - 1, 0, len(x) - 2)
    row = np.clip(np.searchsorted(y, samples[:, 1]) - 1, 0, len(y) - 2)
    lowest = np.full_like(z, np.inf)
    for i in (0, 1):
        for j in (0, 1):
            np.minimum.at(lowest, (row + i, column + j), samples[:, 2] - _MARGIN)
    return np.asarray(np.minimum(z, lowest))
