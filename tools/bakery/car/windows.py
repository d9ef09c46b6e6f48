"""Windows of a car, each a dark pane within a black frame.

Close by the renderer shows the cabin behind a pane (see `sumo3dviz_pt/render/cabins.py`); from afar
seats are a paler tint of the glass.
"""

from __future__ import annotations

import numpy as np

from bakery.car.body import PILLAR_LEAN, CarShape
from bakery.car.cuts import FAR, RegionCut, cut_region, tag_of
from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import intersect, rounded_box
from sumo3dviz_pt.model.geometry import Bools, Floats


def cut_windows(surface: Surface, shape: CarShape) -> Surface:
    """Cut side windows, windscreen and rear window into a body, and the cowl's dark strip."""
    return _cut(surface, shape, tinted=False)


def cut_far_windows(surface: Surface, shape: CarShape) -> Surface:
    """Cut the same, with what is seen through them as tints."""
    return _cut(surface, shape, tinted=True)


def _cut(surface: Surface, shape: CarShape, *, tinted: bool) -> Surface:
    """Cut all windows."""
    surface = _side_windows(surface, shape, tinted=tinted)
    surface = _cowl(surface, shape)
    surface = _windscreen(surface, shape, tinted=tinted)
    return _rear_window(surface, shape, tinted=tinted)


def _glass(tinted: bool) -> int:
    """Tag of panes."""
    return tag_of("glass" if tinted else "cabin_pane")


def _side_windows(surface: Surface, shape: CarShape, *, tinted: bool) -> Surface:
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

    black, glass = tag_of("gloss_black"), _glass(tinted)
    if recipe.frame != "gloss_black":
        bright = RegionCut(
            lambda d, y, z: frame(d, y, z, inset=-0.013), tag_of(recipe.frame), on_side
        )
        surface = cut_region(surface, shape, bright)
    over = (tag_of("paint"), tag_of(recipe.frame))
    surface = cut_region(surface, shape, RegionCut(frame, black, on_side, over))
    surface = cut_region(surface, shape, RegionCut(pane, glass, on_side, (black,)))
    if not tinted:
        return surface

    def beyond(d: Floats, y: Floats, z: Floats) -> Floats:
        return intersect(frame(d, y, z, inset=0.07), -_seats_from_side(shape, d, z), 0.01)

    return cut_region(surface, shape, RegionCut(beyond, tag_of("glass_seat"), on_side, (glass,)))


def _seats_from_side(shape: CarShape, d: Floats, z: Floats) -> Floats:
    """Seats and head rests in the side view, one row to each door."""
    rows = np.full_like(d, FAR)
    for _, last in shape.recipe.doors:
        place = last - 0.12 + 0.25 * (z - 1.0)
        floor = float(shape.belt(last))
        back = rounded_box(d - place, z - floor + 0.08, (0.09, 0.19), 0.06)
        head = rounded_box(d - place - 0.01, z - floor - 0.19, (0.05, 0.085), 0.04)
        rows = np.minimum(rows, np.minimum(back, head))
    return rows


def _seats_from_ahead(shape: CarShape, y: Floats, z: Floats, low: float) -> Floats:
    """Seats, head rests and the inner mirror as seen through the windscreen."""
    away = np.abs(y) - 0.20 * shape.recipe.width
    back = rounded_box(away, z - low - 0.02, (0.19, 0.16), 0.07)
    head = rounded_box(away, z - low - 0.27, (0.11, 0.075), 0.05)
    mirror = rounded_box(y, z - low - 0.345, (0.11, 0.03), 0.02)
    return np.minimum(np.minimum(back, head), mirror)


def _cowl(surface: Surface, shape: CarShape) -> Surface:
    """The dark strip between bonnet and windscreen, where the wipers turn."""
    recipe = shape.recipe

    def strip(d: Floats, y: Floats, z: Floats) -> Floats:
        behind = recipe.bonnet + 0.012 - 0.10 * (y / shape.half) ** 2 - d
        side = y - (shape.half * shape.plan(d) * 0.955 - 0.075)
        return intersect(intersect(behind, side, 0.05), z - recipe.cowl[1] - 0.03, 0.01)

    def on_top(centroids: Floats, normals: Floats) -> Bools:
        near = (centroids[:, 0] < recipe.header) & (centroids[:, 2] > recipe.shoulder)
        return np.asarray((normals[:, 2] > 0.3) & near)

    return cut_region(surface, shape, RegionCut(strip, tag_of("trim"), on_top))


def _windscreen(surface: Surface, shape: CarShape, *, tinted: bool) -> Surface:
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

    black, over = tag_of("gloss_black"), (tag_of("paint"), tag_of("trim"))
    surface = cut_region(surface, shape, RegionCut(rim, black, ahead, over))
    glass = _glass(tinted)
    pane = RegionCut(lambda d, y, z: rim(d, y, z, inset=0.03), glass, ahead, (black,))
    surface = cut_region(surface, shape, pane)
    if not tinted:
        return surface

    def beyond(d: Floats, y: Floats, z: Floats) -> Floats:
        inside = np.maximum(rim(d, y, z, inset=0.11), low + 0.15 - z)
        return intersect(inside, -_seats_from_ahead(shape, y, z, low + 0.09), 0.01)

    return cut_region(surface, shape, RegionCut(beyond, tag_of("glass_seat"), ahead, (glass,)))


def _rear_window(surface: Surface, shape: CarShape, *, tinted: bool) -> Surface:
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

    black = tag_of("gloss_black")
    surface = cut_region(surface, shape, RegionCut(rim, black, behind))
    glass = _glass(tinted)
    pane = RegionCut(lambda d, y, z: rim(d, y, z, inset=0.028), glass, behind, (black,))
    surface = cut_region(surface, shape, pane)
    if not tinted:
        return surface

    def beyond(d: Floats, y: Floats, z: Floats) -> Floats:
        # Light falls through the other windows over shelf and seats.
        shelf = low + 0.28 * (high - low)
        inside = np.maximum(rim(d, y, z, inset=0.06), shelf - z)
        return intersect(inside, -_rests_from_behind(shape, y, z, shelf), 0.01)

    return cut_region(surface, shape, RegionCut(beyond, tag_of("glass_seat"), behind, (glass,)))


def _rests_from_behind(shape: CarShape, y: Floats, z: Floats, shelf: float) -> Floats:
    """Head rests of both rows and the front seats' backs as seen through the rear window."""
    away = np.abs(y) - 0.21 * shape.recipe.width
    rear = rounded_box(away, z - shelf, (0.125, 0.075), 0.035)
    front = rounded_box(away + 0.035, z - shelf - 0.06, (0.085, 0.085), 0.05)
    return np.minimum(rear, front)
