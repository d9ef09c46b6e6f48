"""What closes an open plain where a scenario brings nothing: far hedgerows, woods, villages.

They lie farther away than single trees and are as cheap as they look small.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.library.plants.woods import CORE_FACES, FarTrees, far_trees
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.land.far_woods import grown
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.build import REACH, Plot

FARTHEST = 2800.0
"""Farther away there are only the hills' own woods [m]."""

MOST = 60_000
"""Triangles of all far trees, at most."""

_TUFTS = 24
_OFF = 12.0  # distance from everything paved [m]
_BLOCK = 240.0  # spacing of places that may bear a hedgerow, a wood or a village [m]
_WALLS = np.array([[0.55, 0.52, 0.46], [0.62, 0.6, 0.56], [0.42, 0.34, 0.27], [0.5, 0.44, 0.36]])
_ROOFS = np.array([[0.22, 0.085, 0.055], [0.16, 0.075, 0.05], [0.09, 0.085, 0.085]])
_LINE, _WOOD, _VILLAGE = 0.46, 0.22, 0.035  # share of the places that bear each


def plant_far(plot: Plot, *, around: Surroundings) -> tuple[StaticPart, ...]:
    """Build hedgerows, woods and villages around the cameras of a shot, far away.

    Args:
        plot: What they keep off.
        around: Ground, cameras and the seed.
    """
    blocks = _blocks(around)
    spots: list[Floats] = []
    houses: list[Floats] = []
    for block in blocks:
        rng = np.random.default_rng(
            int(share_of(around.seed, "far", str(block[0]), str(block[1])) * 2**48)
        )
        middle = (np.array(block) + rng.uniform(0.0, 1.0, 2)) * _BLOCK
        what = rng.random()
        if what < _LINE:
            spots.append(_line(middle, rng))
        elif what < _LINE + _WOOD:
            spots.append(middle + rng.normal(0, 1, (22, 2)) * rng.uniform(15.0, 48.0, 2))
        elif what < _LINE + _WOOD + _VILLAGE:
            houses.append(middle + rng.normal(0, 1, (26, 2)) * [85.0, 55.0])
            spots.append(middle + rng.normal(0, 1, (30, 2)) * [100.0, 65.0])
    found = _trees(_allowed(spots, plot, around), around)
    return (*found, *_houses(_allowed(houses, plot, around), around))


def _blocks(around: Surroundings) -> list[tuple[int, int]]:
    """Cells of a world grid in the picture and not near, sorted."""
    if not len(around.viewpoints):
        return []
    steps = int(FARTHEST / _BLOCK) + 1
    own = np.unique(np.floor(around.viewpoints[:, :2] / _BLOCK).astype(np.int64), axis=0)
    x, y = np.meshgrid(*[np.arange(-steps, steps + 1)] * 2)
    cells = np.unique(
        (own[:, None] + np.column_stack([x.ravel(), y.ravel()])).reshape(-1, 2), axis=0
    )
    middles: Floats = np.asarray((cells + 0.5) * _BLOCK, dtype=np.float64)
    away = around.distances(middles)
    keep = (away > REACH - _BLOCK) & (away < FARTHEST) & around.pictured(middles, radius=_BLOCK)
    return [(int(a), int(b)) for a, b in cells[keep]]


def _line(middle: Floats, rng: np.random.Generator) -> Floats:
    """A broken hedgerow along one of the two directions of fields, (n, 2) [m]."""
    way = np.array([(2.0, 1.0), (-1.0, 2.0)][int(rng.random() < 0.4)]) / 5.0**0.5
    along = np.arange(-110.0, 110.0, 8.5)
    along = along[np.sin(along / 21.0 + rng.uniform(0, 6.28)) > -0.5]
    return np.asarray(middle + along[:, None] * way + rng.normal(0, 1.6, (len(along), 2)))


def _allowed(groups: Sequence[Floats], plot: Plot, around: Surroundings) -> Floats:
    """Places of groups that are far, seen and free, (n, 2) [m]."""
    places = np.concatenate([np.zeros((0, 2)), *groups])
    if len(places):
        keep = (around.distances(places) > REACH) & around.pictured(places, radius=15.0)
        places = places[keep]
    return places[plot.free(places, margin=_OFF)] if len(places) else places


def _trees(places: Floats, around: Surroundings) -> list[StaticPart]:
    """Far trees at places, those left out that are too many."""
    rng = np.random.default_rng(around.seed + 47)
    # Chance among near and far ones, or the budget would end at a ring.
    rank = around.distances(places) * rng.uniform(0.35, 1.0, len(places))
    places = places[np.argsort(rank, kind="stable")][: MOST // (CORE_FACES + _TUFTS)]
    trees = grown(places, around.height_at(places), 1.0, rng)
    small = rng.uniform(0.55, 1.1, len(places))
    trees = FarTrees(trees.feet, trees.widths, trees.heights * small, trees.cones, trees.tints)
    mesh, tint = far_trees(trees, tufts=_TUFTS, rng=rng, eyes=around.eyes)
    if not len(mesh.faces):
        return []
    return [StaticPart("ground/planted", "ground", Part(mesh, "leaf", tint))]


def _houses(places: Floats, around: Surroundings) -> list[StaticPart]:
    """Boxes under gables, in two parts: walls and roofs."""
    rng = np.random.default_rng(around.seed + 53)
    walls: list[Mesh] = []
    roofs: list[Mesh] = []
    for x, y, z in np.column_stack([places, around.height_at(places)]):
        size = np.array([rng.uniform(4.5, 8.0), rng.uniform(3.5, 5.0), rng.uniform(3.5, 6.0)])
        turn = 0.46 + 0.5 * np.pi * rng.integers(0, 2) + rng.normal(0, 0.12)
        one, top = _house(size, turn, np.array([x, y, z - 0.3]))
        walls.append(one)
        roofs.append(top)
    found = []
    for name, meshes, palette in (("wall", walls, _WALLS), ("roof", roofs, _ROOFS)):
        if meshes:
            mesh = merge_meshes(meshes)
            colours = palette[rng.integers(0, len(palette), len(meshes))]
            tint = np.repeat(colours, len(meshes[0].faces), axis=0)
            found.append(StaticPart(f"ground/village/{name}", "ground", Part(mesh, name, tint)))
    return found


def _house(size: Floats, turn: float, foot: Floats) -> tuple[Mesh, Mesh]:
    """Walls with gables, and a roof: half length, half width and height of the walls [m]."""
    a, b, h = size
    ridge = h + 0.85 * b
    base = [[-a, -b], [a, -b], [a, b], [-a, b]]
    corners = [[*corner, level] for level in (0.0, h) for corner in base]
    points = np.array([*corners, [-a, 0.0, ridge], [a, 0.0, ridge]])
    c, s = np.cos(turn), np.sin(turn)
    world = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + foot
    gables = [[5, 6, 9], [7, 4, 8]]
    below = [[0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [3, 0, 4, 7]]
    sides = np.array([*([i, j, k] for i, j, k, _ in below), *([i, k, m] for i, _, k, m in below)])
    sides = np.concatenate([sides, gables])
    slopes = np.array([[4, 5, 9], [4, 9, 8], [6, 7, 8], [6, 8, 9]])
    return Mesh(world, sides), Mesh(world[4:], slopes - 4)
