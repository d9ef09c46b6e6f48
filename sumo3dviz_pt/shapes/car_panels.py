"""Windows, lamps, grilles and shut lines, cut into the body of a car."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.shapes.car_body import WELL_DEPTH, CarShape
from sumo3dviz_pt.shapes.car_recipe import MATERIALS, Panel
from sumo3dviz_pt.shapes.cutting import Surface, refine, retag, split
from sumo3dviz_pt.shapes.implicit import Field, intersect, polygon

Where = Callable[[Floats, Floats], Bools]
"""Chooses faces by centroids (d, y, z), (m, 3) [m], and unit normals, (m, 3)."""

HOLE = -1
"""Tag of faces that are cut away where the wheels are."""

_GAP = 0.004
_TOLERANCE = 0.0025
_FAR = 1.0
_LEAN = 0.06


@dataclass(frozen=True, slots=True)
class Finish:
    """What a face's tag means.

    Attributes:
        material: One of `MATERIALS`.
        recess: How far the face is pushed in along d, positive backwards [m].
    """

    material: str
    recess: float = 0.0


def finishes(panels: tuple[Panel, ...]) -> tuple[Finish, ...]:
    """All finishes of a car; panel k has tag `len(MATERIALS) + k`, wheel wells have `HOLE`."""
    plain = tuple(Finish(name) for name in MATERIALS)
    signs = {"front": 1.0, "rear": -1.0}
    return plain + tuple(Finish(p.material, p.recess * signs.get(p.view, 0.0)) for p in panels)


def cut_panels(surface: Surface, shape: CarShape) -> Surface:
    """Cut everything that a recipe asks for into a body.

    Args:
        surface: The bare body, all paint.
        shape: The body.

    Returns:
        The surface with tags as in `finishes`.
    """
    surface = _cut_dark_parts(surface, shape)
    surface = _cut_side_windows(surface, shape)
    surface = _cut_windscreen(surface, shape)
    surface = _cut_rear_window(surface, shape)
    for number, panel in enumerate(shape.recipe.panels):
        surface = _cut_panel(surface, shape, number)
    return _cut_gaps(surface, shape)


def _tag(material: str) -> int:
    """Tag of a material without recess."""
    return MATERIALS.index(material)


def _everywhere(centroids: Floats, normals: Floats) -> Bools:
    """Choose all faces."""
    return np.ones(len(centroids), dtype=np.bool_)


@dataclass(frozen=True, slots=True)
class _Cut:
    """One region to be cut out and given another tag."""

    curve: Field
    tag: int
    where: Where = _everywhere
    over: tuple[int, ...] = (0,)


def _cut(surface: Surface, shape: CarShape, cut: _Cut) -> Surface:
    """Split along a curve and retag what lies inside."""
    surface = split(refine(surface, cut.curve, shape.field, tolerance=_TOLERANCE), cut.curve)
    centroids = surface.centroids
    inside = (cut.curve(*centroids.T) < 0.0) & cut.where(centroids, surface.face_normals)
    return retag(surface, inside, cut.tag, cut.over)


def _cut_line(surface: Surface, shape: CarShape, line: Field, where: Where) -> Surface:
    """Cut a thin dark strip along the zero set of a curve."""
    surface = refine(surface, line, shape.field, tolerance=_TOLERANCE)
    for side in (-_GAP, _GAP):
        surface = split(surface, lambda d, y, z, side=side: line(d, y, z) + side)
    centroids = surface.centroids
    inside = (np.abs(line(*centroids.T)) < _GAP) & where(centroids, surface.face_normals)
    return retag(surface, inside, _tag("trim"), (_tag("paint"),))


def _cut_dark_parts(surface: Surface, shape: CarShape) -> Surface:
    """Wheel wells with their lips, the underside, claddings and a pickup's bed."""
    recipe = shape.recipe

    def well(d: Floats, y: Floats, z: Floats) -> Floats:
        away = shape.from_axle(d, z) - recipe.arch_radius
        return np.where(z < 2.2 * recipe.wheel.radius + 0.2,
                        np.maximum(away, shape.half - WELL_DEPTH - y), _FAR)

    surface = _cut(surface, shape, _Cut(well, HOLE))
    lip = recipe.arch_radius + max(recipe.cladding, 0.012)
    sill = recipe.clearance + (0.15 if recipe.cladding else 0.055)

    def dark(d: Floats, y: Floats, z: Floats) -> Floats:
        near = np.where(z < 2.2 * recipe.wheel.radius + 0.2, shape.from_axle(d, z) - lip, _FAR)
        return np.minimum(near, z - sill)

    surface = _cut(surface, shape, _Cut(dark, _tag("trim")))
    if not recipe.bed:
        return surface
    first, last, floor = recipe.bed
    wide = shape.half * 0.93 - 0.09

    def bed(d: Floats, y: Floats, z: Floats) -> Floats:
        inside = np.maximum(np.maximum(first - d, d - last), y - wide) - 0.012
        return np.where(z > floor - 0.1, inside, _FAR)

    return _cut(surface, shape, _Cut(bed, _tag("trim"), lambda c, n: c[:, 2] > floor - 0.02))


def _cut_side_windows(surface: Surface, shape: CarShape) -> Surface:
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
            inside = np.maximum(inside, half - np.abs(d - _LEAN * (z - 0.9) - middle))
        return inside

    def on_side(centroids: Floats, normals: Floats) -> Bools:
        above = centroids[:, 2] > shape.belt(centroids[:, 0]) - 0.02
        return np.asarray((np.abs(normals[:, 1]) > 0.5) & above)

    trim, glass = _tag("trim"), _tag("glass")
    surface = _cut(surface, shape, _Cut(frame, trim, on_side))
    return _cut(surface, shape, _Cut(pane, glass, on_side, (trim,)))


def _cut_windscreen(surface: Surface, shape: CarShape) -> Surface:
    """The windscreen with a black rim."""
    recipe = shape.recipe
    low, high = recipe.cowl[1], float(shape.roof(recipe.header))

    def rim(d: Floats, y: Floats, z: Floats, *, inset: float = 0.0) -> Floats:
        side = y - (shape.side_glass(d, z) - 0.062 - inset)
        pane = intersect(side, z - (high - 0.015 - inset) + 0.02 * y**2, 0.06)
        pane = intersect(pane, low + 0.012 + inset - z, 0.03)
        return np.where(d < recipe.header + 0.35, pane, _FAR)

    def ahead(centroids: Floats, normals: Floats) -> Bools:
        near = (centroids[:, 0] < recipe.header + 0.3) & (centroids[:, 2] > low - 0.02)
        return np.asarray((normals[:, 0] < -0.2) & near)

    trim = _tag("trim")
    surface = _cut(surface, shape, _Cut(rim, trim, ahead))
    pane = _Cut(lambda d, y, z: rim(d, y, z, inset=0.03), _tag("glass"), ahead, (trim,))
    return _cut(surface, shape, pane)


def _cut_rear_window(surface: Surface, shape: CarShape) -> Surface:
    """The rear window with a black rim."""
    recipe = shape.recipe
    low, high = recipe.rear_window
    begin = float(shape.backlight(high)) - 0.35

    def rim(d: Floats, y: Floats, z: Floats, *, inset: float = 0.0) -> Floats:
        side = y - (shape.side_glass(d, z) - 0.085 - inset)
        pane = intersect(intersect(side, z - (high - inset), 0.07), low + inset - z, 0.05)
        return np.where(d > begin, pane, _FAR)

    def behind(centroids: Floats, normals: Floats) -> Bools:
        within = (centroids[:, 2] > low - 0.03) & (centroids[:, 0] > begin)
        return np.asarray((normals[:, 0] > 0.2) & within)

    trim = _tag("trim")
    surface = _cut(surface, shape, _Cut(rim, trim, behind))
    pane = _Cut(lambda d, y, z: rim(d, y, z, inset=0.028), _tag("glass"), behind, (trim,))
    return _cut(surface, shape, pane)


def _projected(panel: Panel, shape: CarShape, *, rounded: bool = True) -> Field:
    """Field of a panel's outline, projected along its view and limited in reach."""
    outline = np.asarray(panel.outline, dtype=np.float64)
    foot = float(outline[0, 1])
    if panel.view != "side":
        outline = _both_sides(outline)
    radius = panel.radius if rounded else 0.0
    length, (reach, growth) = shape.recipe.length, panel.reach

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        if panel.view == "side":
            return np.where(y > 0.25, polygon(d, z, outline, radius=radius), _FAR)
        if panel.view == "top":
            inside = polygon(d, np.abs(y), outline, radius=radius)
            return np.where(z > shape.recipe.shoulder - 0.05, inside, _FAR)
        behind = d if panel.view == "front" else length - d
        inside = polygon(np.abs(y), z, outline, radius=radius)
        limit = behind - reach - growth * (z - foot)
        return np.where(behind < reach + 0.5, intersect(inside, limit, min(radius, 0.02)), _FAR)

    return field


def _both_sides(outline: Floats) -> Floats:
    """Complete an outline in (|y|, z) that ends in the middle by its mirror image."""
    middle = np.flatnonzero(np.abs(outline[:, 0]) < 1e-9)
    if len(middle) != 2:
        return outline
    # Begin where the outline leaves the middle and end where it comes back.
    begin = middle[1] if middle[1] - middle[0] == 1 else 0
    half = np.roll(outline, -begin, axis=0)
    return np.concatenate([half, (half * np.array([-1.0, 1.0]))[-2:0:-1]])


def _facing(panel: Panel) -> Where:
    """Faces that look towards a panel's view."""
    axis, sign = {"front": (0, -1.0), "rear": (0, 1.0), "side": (1, 1.0), "top": (2, 1.0)}[
        panel.view
    ]
    least = -0.2 if axis == 0 else 0.3
    return lambda centroids, normals: sign * normals[:, axis] > least


def _cut_panel(surface: Surface, shape: CarShape, number: int) -> Surface:
    """Cut one panel of the recipe."""
    panels = shape.recipe.panels
    panel = panels[number]
    known = finishes(panels)
    over = tuple(tag for tag, finish in enumerate(known) if finish.material in panel.over)
    tag = len(MATERIALS) + number
    cut = _Cut(_projected(panel, shape), tag, _facing(panel), over)
    return _cut(surface, shape, cut)


def _cut_gaps(surface: Surface, shape: CarShape) -> Surface:
    """Shut lines of doors and bonnet, then those that the recipe adds."""
    for first, last in shape.recipe.doors:
        line = _door(shape, first, last)
        surface = _cut_line(surface, shape, line, lambda c, n: np.abs(n[:, 1]) > 0.3)
    surface = _cut_line(surface, shape, _bonnet(shape), _on_bonnet(shape))
    for gap in shape.recipe.gaps:
        surface = _cut_line(surface, shape, _projected(gap, shape), _facing(gap))
    return surface


def _door(shape: CarShape, first: float, last: float) -> Field:
    """Outline of a door between two d, ending at wheel arch, roof and screens."""
    recipe = shape.recipe

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        upright = d - _LEAN * (z - 0.9)
        along = intersect(first - upright, upright - last, 0.04)
        # Above the belt the window's frame is the door's edge.
        high = np.maximum(recipe.clearance + 0.125 - z, z - shape.roof(d) + 0.09)
        door = intersect(along, high, 0.05)
        door = intersect(door, recipe.arch_radius + 0.045 - shape.from_axle(d, z), 0.03)
        ahead = (shape.windscreen(z) + 0.235 - d) / np.hypot(1.0, shape.rake)
        door = intersect(door, ahead, 0.03)
        behind = d - shape.backlight(z) + recipe.window_end - 0.012
        door = np.maximum(door, np.where(z > shape.belt(d) + 0.03, behind, -_FAR))
        return np.where(y > 0.3, door, _FAR)

    return field


def _bonnet(shape: CarShape) -> Field:
    """The bonnet's side and rear shut lines."""
    recipe = shape.recipe

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        side = np.abs(y) - (shape.half * shape.plan(d) * 0.955 - 0.060)
        lid = intersect(side, d - recipe.bonnet + 0.10 * (y / shape.half) ** 2, 0.1)
        return np.where((z > recipe.shoulder - 0.1) & (d < recipe.bonnet + 0.3), lid, _FAR)

    return field


def _on_bonnet(shape: CarShape) -> Where:
    """Faces of the bonnet's upper side."""
    low, high = float(shape.top(0.12)) - 0.02, shape.recipe.cowl[1] + 0.05
    return lambda c, n: (n[:, 2] > 0.3) & (c[:, 2] > low) & (c[:, 2] < high)
