"""Buildings over any footprint: which design suits it, and its outline."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import shapely
from shapely.geometry import Polygon

from sumo3dviz_pt.library.buildings.build import Design, Walls, raised
from sumo3dviz_pt.library.buildings.designs import SHED
from sumo3dviz_pt.library.buildings.palettes import CLAY, FACADES, Colours
from sumo3dviz_pt.library.buildings.shell import Shell
from sumo3dviz_pt.library.buildings.styles import BLOCKS, HOMES, SHOPS, Style
from sumo3dviz_pt.model.geometry import Floats, settled

_SMALL, _HOME, _LARGE = 30.0, 240.0, 1100.0  # areas of sheds, of homes, of halls [m2]
_SHED_STYLE = Style((SHED,), (3.0, 5.0), (3.0, 5.0), (2.3, 3.0), Colours(FACADES, CLAY))


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


def style_for(plan: Floats, height: float, *, share: float) -> Style:
    """The style that suits a footprint.

    Args:
        plan: Counter-clockwise corners, (n, 2) [m].
        height: Of the walls [m].
        share: In [0, 1); chooses among those that suit.
    """
    polygon = Polygon(plan)
    if polygon.area < _SMALL:
        return _SHED_STYLE
    fits = _fitting(polygon, height)
    return fits[int(share * len(fits))]


def _fitting(polygon: Polygon, height: float) -> tuple[Style, ...]:
    """Styles for a footprint, the usual ones more than once."""
    around = polygon.minimum_rotated_rectangle
    corners = shapely.get_coordinates(around.exterior)
    sides = np.sort(np.linalg.norm(np.diff(corners[:3], axis=0), axis=1))
    slender, boxy = float(sides[1] / sides[0]), polygon.area > 0.8 * around.area
    if height < 9.0:
        return _low(polygon.area, height, slender if boxy else 0.0)
    old = (BLOCKS["plaster"],) * 4 + (BLOCKS["brick"],) * 3
    if height > 24.0:
        return BLOCKS["slab"], BLOCKS["slab"], BLOCKS["office"], BLOCKS["curtain_wall"]
    slabs = (BLOCKS["slab"],) * (3 if slender > 2.5 else 1)
    return (*old, *slabs, BLOCKS["office"])


def _low(area: float, height: float, slender: float) -> tuple[Style, ...]:
    """Styles for low footprints; slender is 0 for those that are no rectangles."""
    if area > _LARGE:
        return SHOPS["hall"], SHOPS["hall"], SHOPS["supermarket"]
    if area > _HOME or not slender:
        return SHOPS["pavilion"], HOMES["bungalow"], BLOCKS["office"]
    if height < 4.0:
        return (HOMES["bungalow"],)
    if slender > 1.9:
        return HOMES["row"], HOMES["row"], HOMES["plaster"]
    return HOMES["plaster"], HOMES["plaster"], HOMES["brick"], HOMES["hipped"]


def extruded(
    plan: Floats,
    height: float,
    *,
    level: int,
    seed: int,
    style: Style,
    fronts: Collection[int] = (),
) -> Shell:
    """A building over a footprint.

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
