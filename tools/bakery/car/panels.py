"""Lamps, grilles and dark parts of a car, cut into its body."""

from __future__ import annotations

import numpy as np

from bakery.car.body import WELL_DEPTH, CarShape
from bakery.car.cuts import FAR, HOLE, RegionCut, Where, cut_region, finishes, tag_of
from bakery.car.recipe import MATERIALS, CarPanel
from bakery.halves import both_sides
from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import Field, intersect, polygon, rounded_box
from sumo3dviz_pt.model.geometry import Floats


def cut_panels(surface: Surface, shape: CarShape) -> Surface:
    """Cut the panels of the recipe, in its order."""
    for number in range(len(shape.recipe.panels)):
        surface = _cut_panel(surface, shape, number)
    return surface


def cut_dark_parts(surface: Surface, shape: CarShape) -> Surface:
    """Cut wheel wells with their lips, the underside, claddings and a pickup's bed."""
    recipe = shape.recipe

    def well(d: Floats, y: Floats, z: Floats) -> Floats:
        away = shape.from_axle(d, z) - recipe.arch_radius
        return np.where(
            z < 2.2 * recipe.wheel.radius + 0.2, np.maximum(away, shape.half - WELL_DEPTH - y), FAR
        )

    surface = cut_region(surface, shape, RegionCut(well, HOLE))
    lip = recipe.arch_radius + max(recipe.cladding, 0.012)
    sill = recipe.clearance + (0.15 if recipe.cladding else 0.055)

    def dark(d: Floats, y: Floats, z: Floats) -> Floats:
        near = np.where(z < 2.2 * recipe.wheel.radius + 0.2, shape.from_axle(d, z) - lip, FAR)
        return np.minimum(near, z - sill)

    surface = cut_region(surface, shape, RegionCut(dark, tag_of("trim")))
    surface = _handle_cups(surface, shape)
    if recipe.bed is None:
        return surface
    pit = recipe.bed
    wide = shape.half * 0.93 - 0.09

    def bed(d: Floats, y: Floats, z: Floats) -> Floats:
        inside = np.maximum(np.maximum(pit.begin - d, d - pit.end), y - wide) - 0.012
        return np.where(z > pit.floor - 0.1, inside, FAR)

    above = RegionCut(bed, tag_of("trim"), lambda c, n: c[:, 2] > pit.floor - 0.02)
    return cut_region(surface, shape, above)


def handle_places(shape: CarShape) -> tuple[tuple[float, float], ...]:
    """Return (d, z) of the door handles [m]."""
    behind = [last - 0.17 for _, last in shape.recipe.doors]
    return tuple((d, float(shape.crease(d)) + shape.recipe.handle) for d in behind)


def _handle_cups(surface: Surface, shape: CarShape) -> Surface:
    """The dark hollows behind door handles."""
    for d0, z0 in handle_places(shape):

        def cup(d: Floats, y: Floats, z: Floats, d0: float = d0, z0: float = z0) -> Floats:
            return rounded_box(d - d0 - 0.005, z - z0 + 0.002, (0.062, 0.024), 0.022)

        surface = cut_region(
            surface, shape, RegionCut(cup, tag_of("gap"), lambda c, n: n[:, 1] > 0.5)
        )
    return surface


def projected(panel: CarPanel, shape: CarShape, *, rounded: bool = True) -> Field:
    """Return the field of a panel's outline, projected along its view and limited in reach.

    Args:
        panel: The panel.
        shape: The body.
        rounded: Whether its corners are.
    """
    outline = np.asarray(panel.outline, dtype=np.float64)
    foot = float(outline[0, 1])
    if panel.view != "side":
        outline = both_sides(outline)
    radius = panel.radius if rounded else 0.0
    length, reach = shape.recipe.length, panel.reach

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        if panel.view == "side":
            return np.where(y > 0.25, polygon(d, z, outline, radius=radius), FAR)
        if panel.view == "top":
            inside = polygon(d, np.abs(y), outline, radius=radius)
            return np.where(z > shape.recipe.shoulder - 0.05, inside, FAR)
        behind = d if panel.view == "front" else length - d
        inside = polygon(np.abs(y), z, outline, radius=radius)
        limit = behind - reach - panel.growth * (z - foot)
        return np.where(behind < reach + 0.5, intersect(inside, limit, min(radius, 0.02)), FAR)

    return field


def facing(panel: CarPanel) -> Where:
    """Choose the faces that look towards a panel's view."""
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
    cut = RegionCut(projected(panel, shape), tag, facing(panel), over)
    return cut_region(surface, shape, cut)
