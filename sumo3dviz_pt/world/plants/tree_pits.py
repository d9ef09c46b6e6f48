"""Pits of soil around trees that stand in pavements, each in a frame of stone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats, Mesh, belonging, merge_meshes
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.traffic import Poi
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings

REACH = 130.0
"""Pits farther from every camera than this are left out [m]."""

_WIDE = 1.5  # width of a pit [m]
_STONE = 0.12  # width of its frame [m]
_RISE = 0.025  # how high the frame stands over the pavement [m]
_CELLS = 9  # patches of its soil along a side
_SOIL = np.array([[0.075, 0.056, 0.038], [0.055, 0.042, 0.030], [0.10, 0.075, 0.045]])
_GROWTH = np.array([0.07, 0.105, 0.032])


def tree_pits(
    pois: Sequence[Poi],
    paved: Sequence[shapely.Polygon],
    *,
    standing: HeightAt,
    around: Surroundings,
) -> tuple[StaticPart, ...]:
    """Build pits around the trees that stand in pavements.

    Args:
        pois: All points of interest.
        paved: Pavements.
        standing: Height of pavements at places, (n, 2) -> (n,) [m].
        around: Lanes, cameras and the seed.
    """
    # Choose the trees.
    trees = [poi for poi in pois if kind_of(poi.type, poi.source) == "trees"]
    places = np.array([poi.position for poi in trees], dtype=np.float64).reshape(-1, 2)
    inside = np.zeros(len(places), dtype=np.bool_)
    if len(places) and len(paved):
        spots = shapely.points(places)
        inside[shapely.STRtree(list(paved)).query(spots, predicate="within")[0]] = True
    inside &= (around.distances(places) < REACH) & around.pictured(places, radius=2.0)
    if not inside.any():
        return ()
    # Build a pit at each, square to the road beside it.
    places = places[inside]
    names = [tree.id for tree, kept in zip(trees, inside, strict=True) if kept]
    along = np.tile([1.0, 0.0], (len(places), 1))
    if around.index.tree is not None:
        along = around.index.directions[around.index.nearest(places)[0]]
    soils, frames, tints = [], [], []
    for name, place, level, way in zip(names, places, standing(places), along, strict=True):
        rng = np.random.default_rng(int(share_of(around.seed, "pit", name) * 2**48))
        soil, frame = _pit(np.array([*place, level]), way, rng)
        soils.append(belonging(soil, f"pit:{name}"))
        frames.append(belonging(frame, f"pit:{name}"))
        tints.append(_soil_tints(len(soil.faces), rng))
    return (
        StaticPart("pits/soil", "trees", Part(merge_meshes(soils), "bark", np.concatenate(tints))),
        StaticPart("pits/frame", "trees", Part(merge_meshes(frames), "kerb")),
    )


def _pit(place: Floats, way: Floats, rng: np.random.Generator) -> tuple[Mesh, Mesh]:
    """Heaped soil and its frame, square to a direction."""
    x, y = np.array([*way, 0.0]), np.array([-way[1], way[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    line = np.linspace(-0.5, 0.5, _CELLS + 1) * _WIDE
    a, b = (grid.ravel() for grid in np.meshgrid(line, line))
    # Soil: a grid that is heaped a little towards the stem.
    rise = 0.008 + 0.05 * np.clip(1.0 - np.hypot(a, b) / (0.5 * _WIDE), 0.0, 1.0)
    rise = rise + rng.uniform(0.0, 0.012, len(a)) * (np.maximum(abs(a), abs(b)) < 0.49 * _WIDE)
    points = place + a[:, None] * x + b[:, None] * y + rise[:, None] * up
    n = _CELLS + 1
    i = (np.arange(_CELLS) + n * np.arange(_CELLS)[:, None]).ravel()
    faces = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
    # The frame: four rings, joined by walls and a top.
    half, outer = 0.5 * _WIDE, 0.5 * _WIDE + _STONE
    rings = []
    for size, level in ((half, 0.0), (half, _RISE), (outer, _RISE), (outer, -0.02)):
        ring = [(-size, -size), (size, -size), (size, size), (-size, size)]
        rings += [place + u * x + v * y + level * up for u, v in ring]
    k = np.arange(4)
    sides = []
    for low in (0, 4, 8):
        p, q = low + k, low + (k + 1) % 4
        sides += [np.stack([p, q + 4, q], 1), np.stack([p, p + 4, q + 4], 1)]
    return Mesh(points, faces), Mesh(np.array(rings), np.concatenate(sides))


def _soil_tints(count: int, rng: np.random.Generator) -> Floats:
    """Reflectance of soil with some growth, (count, 3)."""
    tint = _SOIL[rng.integers(0, len(_SOIL), count)] * rng.uniform(0.8, 1.2, (count, 1))
    green = rng.random(count) < 0.15
    tint[green] = _GROWTH * rng.uniform(0.8, 1.2, (int(green.sum()), 1))
    return tint
