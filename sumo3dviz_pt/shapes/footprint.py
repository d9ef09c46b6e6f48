"""Buildings over any footprint: walls with windows, gabled or flat roofs."""

from __future__ import annotations

import numpy as np
import shapely

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.shapes.buildings import FOUNDATION
from sumo3dviz_pt.shapes.facade import FAR, Facade, wall
from sumo3dviz_pt.shapes.roofs import flat_roof, gable_roof, upright
from sumo3dviz_pt.shapes.shell import Shell, joined, stood_up

_STOREY = 3.0
_SHED = 30.0  # area below which a building has no windows [m2]
_GABLED = 380.0  # area up to which a rectangle has a gabled roof [m2]


def cleaned(shape: Floats, *, tolerance: float = 0.25) -> Floats | None:
    """The outline of a footprint, counter-clockwise without repeats, (n, 2) [m].

    Args:
        shape: (n, 2) [m], closed or not, crossing itself or not.
        tolerance: Smaller corners are cut [m].

    Returns:
        None if less than 6 m2 are left.
    """
    if len(shape) < 3:
        return None
    valid = shapely.make_valid(shapely.Polygon(shape[:, :2]))
    parts = [p for p in shapely.get_parts(valid).tolist() if p.geom_type == "Polygon"]
    if not parts:
        return None
    largest = max(parts, key=lambda part: float(part.area)).simplify(tolerance)
    if largest.area < 6.0:
        return None
    corners: Floats = shapely.get_coordinates(shapely.orient_polygons(largest).exterior)[:-1]
    return corners


def extruded(plan: Floats, height: float, *, level: int, seed: int) -> Shell:
    """A building over a footprint.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls above the ground [m].
        level: Level of detail.
        seed: Tilts panes and lowers blinds.
    """
    rng = np.random.default_rng(seed)
    polygon = shapely.Polygon(plan)
    storeys = max(round(height / _STOREY), 1)
    floors = np.linspace(0.0, height, storeys + 1)
    facade = Facade(bay=float(rng.uniform(2.7, 3.4)), width=1.15, height=1.35)
    if polygon.area < _SHED:
        facade = Facade(bay=1e9)
    after = np.roll(plan, -1, axis=0)
    parts: list[Shell] = [{"plinth": upright(plan, FOUNDATION, 0.0)}]
    for a, b in zip(plan, after, strict=True):
        length = float(np.linalg.norm(b - a))
        parts.append(stood_up(wall(length, floors, facade, level=level, rng=rng), a, b))
    parts.append(_roof(polygon, plan, height, level))
    return joined(parts)


def _roof(polygon: shapely.Polygon, plan: Floats, height: float, level: int) -> Shell:
    """A gabled roof where the plan is nearly a rectangle, else a flat one."""
    around = shapely.orient_polygons(polygon.minimum_rotated_rectangle)
    if polygon.area > 0.86 * around.area and polygon.area < _GABLED and height < 12.0:
        box = shapely.get_coordinates(around.exterior)[:-1]
        first = np.linalg.norm(box[1] - box[0]) >= np.linalg.norm(box[2] - box[1])
        pitch = 0.65 if polygon.area > _SHED else 0.35
        return gable_roof(box, height, pitch=pitch, ridge_along_first=bool(first), level=level)
    return flat_roof(plan, height, parapet=0.5, level=level if len(plan) <= 8 else FAR)
