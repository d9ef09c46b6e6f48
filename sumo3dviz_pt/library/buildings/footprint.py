"""Buildings over any footprint: its outline, and which style suits it."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.library.buildings.build import raised
from sumo3dviz_pt.library.buildings.design import Design, Walls
from sumo3dviz_pt.library.buildings.shell import Shell
from sumo3dviz_pt.library.buildings.styles import SUITING, BuildingStyle, Footprint
from sumo3dviz_pt.model.geometry import Floats, settled

_SMALL, _HOME, _LARGE = 30.0, 240.0, 1100.0  # areas of sheds, of homes, of halls [m2]
_LOW, _BLOCK, _TOWER = 4.0, 9.0, 24.0  # heights of one storey, of blocks, of towers [m]


def cleaned(shape: Floats, *, tolerance: float = 0.25) -> Floats | None:
    """Trace the outline of a footprint, counter-clockwise without repeats, (n, 2) [m].

    Args:
        shape: (n, 2) [m], closed or not, crossing itself or not.
        tolerance: Smaller corners are cut [m].

    Returns:
        None if less than 6 m2 are left.
    """
    if len(shape) < 3:
        return None
    valid = shapely.make_valid(Polygon(settled(shape[:, :2])))
    parts = [p for p in shapely.get_parts(valid).tolist() if p.geom_type == "Polygon"]
    if not parts:
        return None
    largest = max(parts, key=lambda part: float(part.area)).simplify(tolerance)
    if largest.area < 6.0 or largest.buffer(-0.3).is_empty:
        return None
    corners: Floats = shapely.get_coordinates(shapely.orient_polygons(largest).exterior)[:-1]
    # Simplifying keeps a ring's two ends, even where they coincide.
    kept: Floats = corners[np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) > 0.05]
    return kept if len(kept) > 2 else None


def style_for(plan: Floats, height: float, *, share: float) -> BuildingStyle:
    """Choose a style that suits a footprint.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls [m].
        share: In [0, 1); chooses among those that suit.
    """
    fits = SUITING[footprint_of(plan, height)]
    return fits[int(share * len(fits))]


def footprint_of(plan: Floats, height: float) -> Footprint:
    """Tell what sort of footprint a plan, (n, 2) [m], is under walls of a height [m]."""
    polygon = Polygon(plan)
    if polygon.area < _SMALL:
        return "shed"
    around = polygon.minimum_rotated_rectangle
    corners = shapely.get_coordinates(around.exterior)
    sides = np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1))
    slender, boxy = float(sides[1] / sides[0]), polygon.area > 0.8 * around.area
    if height >= _BLOCK:
        return "tower" if height > _TOWER else "long_block" if slender > 2.5 else "block"
    return _low_footprint(polygon.area, height, slender if boxy else 0.0)


def _low_footprint(area: float, height: float, slender: float) -> Footprint:
    """Tell what sort a low footprint is; slender is 0 for those that are no rectangles."""
    if area > _LARGE:
        return "large"
    if area > _HOME or not slender:
        return "wide"
    if height < _LOW:
        return "low_house"
    return "long_house" if slender > 1.9 else "house"


def extruded(
    plan: Floats,
    height: float,
    *,
    level: int,
    seed: int,
    style: BuildingStyle,
    fronts: Collection[int] = (),
) -> Shell:
    """Raise a building over a footprint.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls above the ground [m].
        level: Level of detail.
        seed: Of all chance.
        style: Says which designs it may have.
        fronts: Numbers of walls at a street; default the longest one.
    """
    design: Design = style.designs[seed % len(style.designs)]
    if not fronts:
        after = np.roll(plan, -1, axis=0)
        fronts = (int(np.argmax(settled(np.linalg.norm(after - plan, axis=1)))),)
    walls = Walls(fronts)
    return raised(plan, design, height=height, level=level, seed=seed, walls=walls)
