"""Windows of a car, each a dark pane within a black frame."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.shapes.car_body import PILLAR_LEAN, CarShape
from sumo3dviz_pt.shapes.car_cuts import FAR, Cut, cut_region, tag_of
from sumo3dviz_pt.shapes.cutting import Surface
from sumo3dviz_pt.shapes.implicit import intersect


def cut_windows(surface: Surface, shape: CarShape) -> Surface:
    """Cut side windows, windscreen and rear window into a body."""
    surface = _side_windows(surface, shape)
    surface = _windscreen(surface, shape)
    return _rear_window(surface, shape)


def _side_windows(surface: Surface, shape: CarShape) -> Surface:
    """Panes within a black frame; the outlines follow belt, roof and screens."""
    recipe = shape.recipe

    def frame(d: Floats, y: Floats, z: Floats, *, inset: float = 0.0) -> Floats:
        pane = intersect(shape.belt(d) + 0.012 + inset - z, z - shape.roof(d) + 0.078 + inset, 0.03)
        ahead = (shape.windscreen(z) + 0.225 + inset - d) / np.hypot(1.0, shape.rake)
        slope = np.minimum(np.abs(shape.backlight.slope(z)), 2.0)
        behind = d - (shape.backlight(z) - recipe.window_end - inset)
        return intersect(intersect(pane, ahead, 0.03), behind / np.hypot(1.0, slope), 0.05)

    def pane(d: Floats, y: Floats, z: Floats) -> Floats:
        inside = frame(d, y, z, inset=0.022)
        for middle, half in recipe.pillars:
            inside = np.maximum(inside, half - np.abs(d - PILLAR_LEAN * (z - 0.9) - middle))
        return inside

    def on_side(centroids: Floats, normals: Floats) -> Bools:
        above = centroids[:, 2] > shape.belt(centroids[:, 0]) - 0.02
        return np.asarray((np.abs(normals[:, 1]) > 0.5) & above)

    trim, glass = tag_of("trim"), tag_of("glass")
    surface = cut_region(surface, shape, Cut(frame, trim, on_side))
    return cut_region(surface, shape, Cut(pane, glass, on_side, (trim,)))


def _windscreen(surface: Surface, shape: CarShape) -> Surface:
    """The windscreen with a black rim."""
    recipe = shape.recipe
    low, high = recipe.cowl[1], float(shape.roof(recipe.header))

    def rim(d: Floats, y: Floats, z: Floats, *, inset: float = 0.0) -> Floats:
        side = y - (shape.side_glass(d, z) - 0.062 - inset)
        pane = intersect(side, z - (high - 0.015 - inset) + 0.02 * y**2, 0.06)
        pane = intersect(pane, low + 0.012 + inset - z, 0.03)
        return np.where(d < recipe.header + 0.35, pane, FAR)

    def ahead(centroids: Floats, normals: Floats) -> Bools:
        near = (centroids[:, 0] < recipe.header + 0.3) & (centroids[:, 2] > low - 0.02)
        return np.asarray((normals[:, 0] < -0.2) & near)

    trim = tag_of("trim")
    surface = cut_region(surface, shape, Cut(rim, trim, ahead))
    pane = Cut(lambda d, y, z: rim(d, y, z, inset=0.03), tag_of("glass"), ahead, (trim,))
    return cut_region(surface, shape, pane)


def _rear_window(surface: Surface, shape: CarShape) -> Surface:
    """The rear window with a black rim."""
    recipe = shape.recipe
    low, high = recipe.rear_window
    begin = float(shape.backlight(high)) - 0.35

    def rim(d: Floats, y: Floats, z: Floats, *, inset: float = 0.0) -> Floats:
        side = y - (shape.side_glass(d, z) - 0.085 - inset)
        pane = intersect(intersect(side, z - (high - inset), 0.07), low + inset - z, 0.05)
        return np.where(d > begin, pane, FAR)

    def behind(centroids: Floats, normals: Floats) -> Bools:
        within = (centroids[:, 2] > low - 0.03) & (centroids[:, 0] > begin)
        return np.asarray((normals[:, 0] > 0.2) & within)

    trim = tag_of("trim")
    surface = cut_region(surface, shape, Cut(rim, trim, behind))
    pane = Cut(lambda d, y, z: rim(d, y, z, inset=0.028), tag_of("glass"), behind, (trim,))
    return cut_region(surface, shape, pane)
