"""Shut lines of doors, bonnet, boot, bumpers and fuel flap."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bakery.car.body import PILLAR_LEAN, CarShape
from bakery.car.cuts import FAR, Where, cut_line
from bakery.car.panels import facing, projected
from bakery.mesh.cutting import Surface
from bakery.mesh.implicit import Field, intersect, rounded_box
from sumo3dviz_pt.model.geometry import Floats


def cut_gaps(surface: Surface, shape: CarShape) -> Surface:
    """Cut the shut lines of doors and bonnet, then those that the recipe adds."""
    for first, last in shape.recipe.doors:
        line = _door(shape, first, last)
        surface = cut_line(surface, shape, line, lambda c, n: np.abs(n[:, 1]) > 0.3)
    surface = cut_line(surface, shape, _bonnet(shape), _on_bonnet(shape))
    for line, where in _joints(shape):
        surface = cut_line(surface, shape, line, where)
    if shape.recipe.flap:
        surface = cut_line(surface, shape, _flap(shape), lambda c, n: n[:, 1] > 0.5)
    for gap in shape.recipe.gaps:
        surface = cut_line(surface, shape, projected(gap, shape), facing(gap))
    return surface


def _door(shape: CarShape, first: float, last: float) -> Field:
    """Outline of a door between two d, ending at wheel arch, roof and screens."""
    recipe = shape.recipe

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        upright = d - PILLAR_LEAN * (z - 0.9)
        along = intersect(first - upright, upright - last, 0.04)
        # Above the belt the window's frame is the door's edge.
        high = np.maximum(recipe.clearance + 0.125 - z, z - shape.roof(d) + 0.09)
        door = intersect(along, high, 0.05)
        door = intersect(door, recipe.arch_radius + 0.045 - shape.from_axle(d, z), 0.03)
        ahead = (shape.windscreen(z) + 0.235 - d) / np.hypot(1.0, shape.rake)
        door = intersect(door, ahead, 0.03)
        behind = d - shape.backlight(z) + recipe.window_end - 0.012
        door = np.maximum(door, np.where(z > shape.belt(d) + 0.03, behind, -FAR))
        return np.where(y > 0.3, door, FAR)

    return field


def _joints(shape: CarShape) -> Iterator[tuple[Field, Where]]:
    """Where the bumpers meet the wings; the rear one runs around the car."""
    if not shape.recipe.joints:
        return
    front, rear = shape.recipe.joints
    first, last = shape.recipe.axles
    yield (
        lambda d, y, z: np.where(d < first, z - front + 0.05 * (d - first), FAR),
        lambda c, n: (c[:, 0] < first) & (n[:, 1] > 0.4) & (np.abs(n[:, 2]) < 0.6),
    )
    yield (
        lambda d, y, z: np.where(d > last, z - rear, FAR),
        lambda c, n: (c[:, 0] > last) & (np.abs(n[:, 2]) < 0.7),
    )


def _flap(shape: CarShape) -> Field:
    """The fuel flap."""
    at, height = shape.recipe.flap
    return lambda d, y, z: rounded_box(d - at, z - height, (0.085, 0.075), 0.03)


def _bonnet(shape: CarShape) -> Field:
    """The bonnet's side and rear shut lines."""
    recipe = shape.recipe

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        side = np.abs(y) - (shape.half * shape.plan(d) * 0.955 - 0.060)
        lid = intersect(side, d - recipe.bonnet + 0.10 * (y / shape.half) ** 2, 0.1)
        return np.where((z > recipe.shoulder - 0.1) & (d < recipe.bonnet + 0.3), lid, FAR)

    return field


def _on_bonnet(shape: CarShape) -> Where:
    """Faces of the bonnet's upper side."""
    low, high = float(shape.top(0.12)) - 0.02, shape.recipe.cowl[1] + 0.05
    return lambda c, n: (n[:, 2] > 0.3) & (c[:, 2] > low) & (c[:, 2] < high)
