"""Laws of what is paved beside roads, and of the ground below it; each yields what breaks it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import StaticPart

_GROUND = ("ground", "ground/far", "areas/area:ground_grass")
_SLABS = ("areas/area:asphalt_old", "areas/area:concrete")


def faces_up(parts: Sequence[StaticPart]) -> Floats:
    """Triangles that are seen from above, (n, 3, 3) [m]."""
    meshes = [part.part.mesh for part in parts]
    corners = np.concatenate([np.zeros((0, 3, 3)), *(m.vertices[m.faces] for m in meshes)])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(corners[across[:, 2] > 0.3 * np.linalg.norm(across, axis=1)])


def highest(corners: Floats, places: Floats) -> Floats:
    """Height of the topmost triangle at places, (n,) [m]; -inf where there is none."""
    tree = shapely.STRtree(shapely.polygons(corners[..., :2]))
    asked, face = tree.query(shapely.points(places), predicate="intersects")
    a, b, c = (corners[face, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    z = a[:, 2] - ((places[asked] - a[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2]
    found = np.full(len(places), -np.inf)
    np.maximum.at(found, asked, z)
    return found


def points_on(corners: Floats, step: float) -> Floats:
    """Places on a grid over triangles, (n, 2) [m]."""
    low, high = corners[..., :2].min(axis=(0, 1)), corners[..., :2].max(axis=(0, 1))
    x, y = np.meshgrid(*(np.arange(a + 0.13, b, step) for a, b in zip(low, high, strict=True)))
    places = np.column_stack([x.ravel(), y.ravel()])
    return np.asarray(places[np.isfinite(highest(corners, places))])


def plan_of(parts: Sequence[StaticPart]) -> shapely.Geometry:
    """What parts cover from above."""
    return shapely.union_all(shapely.polygons(faces_up(parts)[..., :2]), grid_size=1e-4)


def paved_beside(static: Sequence[StaticPart]) -> dict[str, list[StaticPart]]:
    """Forecourts, and bays and yards, by name; those that there are."""
    found = {
        "forecourts": [part for part in static if "/court/" in part.id],
        "slabs": [part for part in static if part.id in _SLABS],
    }
    return {name: parts for name, parts in found.items() if parts}


def ground_over_paving(static: Sequence[StaticPart], *, step: float) -> Iterator[str]:
    """Yield where the ground or its grass lies above what is paved beside roads.

    Args:
        static: All that does not move.
        step: Distance of the places that are looked at [m].
    """
    ground = faces_up([part for part in static if part.id in _GROUND])
    blades = [part for part in static if part.id.startswith("ground/blades/")]
    for name, parts in paved_beside(static).items():
        tops = faces_up(parts)
        places = points_on(tops, step)
        over = highest(ground, places) - highest(tops, places)
        if (over >= 0.0).any():
            many = f"{(over >= 0.0).sum()} of {len(places)} places"
            x, y = places[np.argmax(over)]
            yield f"{name}: the ground is above {many}, by {over.max():.2f} m at ({x:.1f}, {y:.1f})"
        # Tips of blades lean over the border.
        inner = plan_of(parts).buffer(-0.25)
        shapely.prepare(inner)
        for part in blades:
            inside = shapely.contains_xy(inner, part.part.mesh.vertices[:, :2])
            if inside.any():
                yield f"{name}: {inside.sum()} corners of {part.id} stand there"


def paved_twice(static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield which two things beside roads pave one place."""
    plans = {name: plan_of(parts) for name, parts in paved_beside(static).items()}
    names = list(plans)
    for number, one in enumerate(names):
        for other in names[number + 1 :]:
            shared = plans[one].intersection(plans[other]).area
            if shared > 0.01:
                yield f"{one} and {other} share {shared:.2f} m2"
        faces = faces_up(paved_beside(static)[one])
        twice = float(shapely.area(shapely.polygons(faces[..., :2])).sum() - plans[one].area)
        if twice > 0.1:
            yield f"{one} share {twice:.2f} m2 with each other"
