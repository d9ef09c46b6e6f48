"""Tree lines and forests beyond what is built, as cheap far trees."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
import shapely
from scipy.spatial import cKDTree

from sumo3dviz_pt.library.plants.woods import CORE_FACES, FarTrees, far_trees
from sumo3dviz_pt.model.camera_path import CameraPath, in_mirrors, in_picture
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.land.horizon import Land
from sumo3dviz_pt.world.land.relief import relief

LINE_TUFTS, GROVE_TUFTS = 110, 34
"""Triangles around the core of a single tree, and of a grove farther away."""

MOST = 24_000
"""Triangles of the tree line, and again of the groves, at most."""

_LEAVES = np.array([[0.088, 0.140, 0.040], [0.070, 0.122, 0.036], [0.050, 0.088, 0.036]])
_CLEAR = 45.0  # distance from objects and cameras [m]
_NEAREST = 230.0  # closer to a camera they would not pass for trees [m]
_GROVE = 2.6  # width of a grove by that of a tree


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """What woods must leave free, and the cameras that look at them.

    Attributes:
        taken: Objects and cameras, (n, 2) [m].
        camera_path: Where the cameras look, or None: then everything counts as seen.
    """

    taken: Floats
    camera_path: CameraPath | None = None


def woods(land: Land, *, height_at: Callable[[Floats], Floats], room: Room) -> tuple[Part, ...]:
    """Build a tree line at the fields' edge and groves on the hills behind.

    Args:
        land: What grows where.
        height_at: Height of the ground.
        room: What they leave free; what no camera sees is left out.
    """
    if not land.wooded:
        return ()
    rng = np.random.default_rng(land.seed + 29)
    eyes = None if room.camera_path is None else room.camera_path.eyes
    parts = []
    for places, scale, tufts in (
        (_line(land, rng), 1.0, LINE_TUFTS),
        (_groves(land, rng), _GROVE, GROVE_TUFTS),
    ):
        trees = grown(places, height_at(places), scale, rng)
        trees = _chosen(trees, room, MOST // (CORE_FACES + tufts))
        mesh, tint = far_trees(trees, tufts=tufts, rng=rng, eyes=eyes)
        if len(mesh.faces):
            parts.append(Part(mesh, "leaf", tint))
    return tuple(parts)


def occupied(pois: Sequence[Poi], polygons: Sequence[Polygon], eyes: Floats) -> Floats:
    """Return where woods must not stand: objects and cameras, (n, 2) [m].

    Args:
        pois: All points of interest.
        polygons: All polygons and lines.
        eyes: Cameras, (k, 3) [m].
    """
    points = np.array([poi.position for poi in pois], dtype=np.float64).reshape(-1, 2)
    return np.concatenate([points, *(item.shape[:, :2] for item in polygons), eyes[:, :2]])


def _line(land: Land, rng: np.random.Generator) -> Floats:
    """Places in a broken belt around the hull, nearest first, (n, 2) [m]."""
    belt = land.hull.buffer(300.0, quad_segs=8).exterior
    at = np.arange(0.0, belt.length, 6.5)
    spine = shapely.get_coordinates(shapely.line_interpolate_point(belt, at))
    # The belt swings in and out, so that it is no circle.
    centre = np.array(land.hull.centroid.coords[0])
    outward = (spine - centre) / np.linalg.norm(spine - centre, axis=1, keepdims=True)
    phase = rng.uniform(0, 6.28, 3)
    swing = sum(
        np.sin(at / length + p) for length, p in zip((170.0, 73.0, 39.0), phase, strict=True)
    )
    places = spine + outward * (45.0 * swing + rng.normal(0, 14.0, len(at)))[:, None]
    hedged = np.sin(at / 260.0 + phase[1]) + 0.6 * np.sin(at / 97.0 + phase[2]) > -0.45
    return np.asarray(places[hedged & (land.away(places) > 180.0)])


def _groves(land: Land, rng: np.random.Generator) -> Floats:
    """Places of groves in wooded land, nearest first, (n, 2) [m]."""
    cover = land.relief or relief(land.seed + 11)
    x0, y0, x1, y1 = land.hull.buffer(2600.0).bounds
    step = max(30.0, float(np.hypot(x1 - x0, y1 - y0)) / 190.0)
    x, y = np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step))
    places = np.column_stack([x.ravel(), y.ravel()])
    places = places + rng.uniform(-0.45, 0.45, places.shape) * step
    away = land.away(places)
    likely = cover.wooded(places, away) > rng.uniform(0.2, 0.8, len(places))
    keep = likely & (away > 420.0) & (away < 2600.0)
    return np.asarray(places[keep][np.argsort(away[keep], kind="stable")])


def _chosen(trees: FarTrees, room: Room, most: int) -> FarTrees:
    """Trees that stand free and in the picture, the nearest to a camera."""
    feet = trees.feet
    keep = np.ones(len(feet), dtype=np.bool_)
    if len(room.taken) and len(feet):
        distance, _ = cKDTree(room.taken).query(feet[:, :2])
        keep &= np.asarray(distance) > _CLEAR
    rank = np.arange(len(feet))
    if room.camera_path is not None and len(feet):
        seen = in_picture(room.camera_path, feet, radius=40.0)
        seen |= in_mirrors(room.camera_path, feet, radius=40.0)
        keep &= seen.any(axis=1)
        eyes = np.asarray(cKDTree(room.camera_path.positions[:, :2]).query(feet[:, :2])[0])
        keep &= eyes > _NEAREST
        rank = np.argsort(eyes, kind="stable")
    index = rank[keep[rank]][:most]
    columns = (getattr(trees, field.name)[index] for field in fields(FarTrees))
    return FarTrees(*columns)


def grown(places: Floats, ground: Floats, scale: float, rng: np.random.Generator) -> FarTrees:
    """Return trees or groves with sizes and colours drawn by chance.

    Args:
        places: (n, 2) [m].
        ground: Its height there, (n,) [m].
        scale: Width by that of a tree.
        rng: Source of chance.
    """
    count = len(places)
    cones = (rng.random(count) < 0.22).astype(np.float64)
    heights = rng.uniform(8.0, 15.0, count) * (1.0 + 0.25 * cones) * min(scale, 1.25)
    widths = rng.uniform(8.5, 14.0, count) * (1.0 - 0.4 * cones) * scale
    which = np.where(cones > 0.5, 2, rng.integers(0, 2, count))
    tints = _LEAVES[which] * rng.uniform(0.8, 1.2, (count, 1))
    feet = np.column_stack([places, ground - 0.2])
    return FarTrees(feet, widths, heights, cones, tints)
