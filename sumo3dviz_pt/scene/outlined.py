"""Static objects with a shape of their own: fences along lines, buildings over areas."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from sumo3dviz_pt.job import ObjectSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.scene.chance import share_of
from sumo3dviz_pt.scene.kinds import Kind, building_palette, colour_in, surface_tiles
from sumo3dviz_pt.scene.lane_index import LaneIndex
from sumo3dviz_pt.scene.surroundings import Surroundings
from sumo3dviz_pt.shapes import fence
from sumo3dviz_pt.shapes.building_styles import HOMES
from sumo3dviz_pt.shapes.footprint import cleaned, extruded
from sumo3dviz_pt.shapes.shell import paint

_PIECE = 20  # steps of a fence that share a level of detail
_FACES = 15.0  # how far a fence looks for the lanes it guards [m]
_NUMBERS = (("height", 1.0), ("building:height", 1.0), ("levels", 3.0), ("building:levels", 3.0))


def line_parts(
    kind: Kind, settings: ObjectSettings, items: Sequence[Polygon], how: tuple[Surroundings, float]
) -> list[Part]:
    """Guard rails along polylines, always of their real size; a colour paints them."""
    around, shrink = how
    colour = colour_in(settings)
    parts: list[Part] = []
    for item in items:
        shape = item.shape[:, :2]
        if np.ptp(shape, axis=0).max() < 1.0:
            continue
        flat = fence.resampled(np.vstack([shape, shape[:1]]) if item.fill else shape)
        line = np.column_stack([flat, around.height_at(flat)])
        sides, drop = guarded_sides(flat, around.index), fence.end_drop(line)
        for first in range(0, len(line) - 1, _PIECE):
            piece = slice(first, first + _PIECE + 1)
            nearest = around.distances(flat[piece]).min()
            level = int(np.searchsorted(np.array(kind.levels) * shrink, nearest, side="right"))
            mesh = fence.fence(line[piece], drop[piece], sides=sides, level=level)
            if colour is None:
                parts.append(Part(mesh, "steel"))
            else:
                parts.append(Part(mesh, "sign", np.tile(colour, (len(mesh.faces), 1))))
    return parts


def guarded_sides(line: Floats, index: LaneIndex) -> tuple[int, ...]:
    """On which sides of a fence, (n, 2) [m], lanes run: 1 left, -1 right."""
    nearest, distance = index.nearest(line)
    if index.tree is None or not (distance < _FACES).any():
        return (1,)
    along = np.gradient(line, axis=0)
    towards = index.points[nearest, :2] - line
    cross = along[:, 0] * towards[:, 1] - along[:, 1] * towards[:, 0]
    left = float((cross[distance < _FACES] > 0).mean())
    if left > 0.8:
        return (1,)
    return (-1,) if left < 0.2 else (1, -1)


def area_parts(
    kind: Kind, settings: ObjectSettings, items: Sequence[Polygon], how: tuple[Surroundings, float]
) -> list[Part]:
    """Buildings over polygons, with their own or plausible heights."""
    around, shrink = how
    parts: list[Part] = []
    for item in items:
        name = f"{kind.name}:{item.id}"
        centre = item.shape[:, :2].mean(axis=0)
        distance = around.distances(centre[None])
        level = int(np.searchsorted(np.array(kind.levels) * shrink, distance[0], side="right"))
        plan = cleaned(item.shape[:, :2] - centre, tolerance=(0.15, 0.4, 1.0)[level])
        if plan is None or _holds_camera(plan + centre, around):
            continue
        height = height_of(item, float(shapely.Polygon(plan).area), around.seed)
        seed = int(share_of(around.seed, name, "shell") * 2**32)
        shell = extruded(plan, height * settings.scale, level=level, seed=seed)
        model = "brick" if share_of(around.seed, name, "model") < 0.2 else "plaster"
        colours = building_palette(HOMES[model], settings, seed=around.seed, name=name, level=level)
        # Slopes: stand on the lowest corner of the ground.
        z = float(np.min(around.height_at(plan + centre)))
        shift = np.array([*centre, z])
        placed = {role: quads + shift for role, quads in shell.items()}
        parts += paint(placed, colours, tiles=surface_tiles())
    return parts


def height_of(item: Polygon, area: float, seed: int) -> float:
    """Height of a building's walls [m]: from its params, else seeded by its area [m2]."""
    for key, unit in _NUMBERS:
        try:
            given = float(item.params.get(key, "").strip().removesuffix("m")) * unit
        except ValueError:
            continue
        if 2.0 <= given <= 400.0:
            return given
    low, high = (2.5, 3.2) if area < 40 else (4.5, 7.0) if area < 300 else (6.0, 13.0)
    if area > 700:
        low, high = 7.0, 18.0
    return low + (high - low) * share_of(seed, item.id, "height")


def _holds_camera(plan: Floats, around: Surroundings) -> bool:
    """Whether a camera stands in a footprint."""
    if not len(around.viewpoints):
        return False
    wide = shapely.Polygon(plan).buffer(around.keep_clear)
    return bool(shapely.contains_xy(wide, around.viewpoints[:, :2]).any())
