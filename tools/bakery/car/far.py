"""The far level of a car: its body simplified to a few triangles, wheels as short cylinders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bakery.car.body import CarShape, body_surface
from bakery.car.conform import land
from bakery.car.cuts import tag_of
from bakery.car.equipment import roof_equipment
from bakery.car.panels import cut_panels
from bakery.car.recipe import MATERIALS, CarPanel, CarRecipe
from bakery.car.windows import cut_far_windows
from bakery.mesh.cutting import Surface
from bakery.mesh.simplify import simplify
from sumo3dviz_pt.library.mesh.solids import box, lathe, moved, on_both_sides, superellipsoid
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Ints

_SPACING = 0.08  # of the body's grid [m]
_HALF_FACES = 300  # of half the body
_SEGMENTS = 12  # facets around a wheel
_OUTSET = 0.012  # of the wheels against those of the near level [m]
_FEW_SIDES = 6  # facets of what stands on the roof
_LIGHTS = ("projector", "reflector", "eye")
# Materials of panels that are seen from afar, and what stands for them.
_SHOWN = {
    "lamp_clear": "lamp_clear",
    "lamp_white": "lamp_white",
    "lamp_red": "lamp_red",
    "lamp_dark_red": "lamp_red",
    "livery_blue": "livery_blue",
    "gap": "gap",
    "trim": "trim",
    "gloss_black": "trim",
    "chrome": "chrome",
}
_SMALLEST = 0.012
"""Panels with less area are not seen from afar [m2]."""


def far_surface(shape: CarShape) -> Surface:
    """Mesh the half body with y >= 0 with few faces, its windows without frames.

    Args:
        shape: The body.

    Returns:
        A surface whose tags are places in `MATERIALS`.
    """
    seen = _seen_panels(shape.recipe)
    surface = cut_far_windows(body_surface(shape, spacing=_SPACING), shape)
    framed = Surface(surface.vertices, surface.faces, _retagged(surface, "gloss_black", "glass"))
    surface = cut_panels(framed, replace(shape, recipe=seen))
    names = [*MATERIALS, *(_SHOWN[panel.material] for panel in seen.panels)]
    tags = np.array([tag_of(name) for name in names])[surface.tags]
    surface = simplify(
        Surface(surface.vertices, surface.faces, tags), faces=_HALF_FACES, largest=1.0
    )
    under = (surface.face_normals[:, 2] < -0.7) & (surface.tags == 0)
    return Surface(surface.vertices, surface.faces, np.where(under, tag_of("trim"), surface.tags))


def _retagged(surface: Surface, old: str, new: str) -> Ints:
    """Tags with one material replaced by another."""
    return np.where(surface.tags == tag_of(old), tag_of(new), surface.tags)


def _seen_panels(recipe: CarRecipe) -> CarRecipe:
    """The recipe with the outlines of lamps and large dark parts as its only panels."""
    panels = tuple(
        replace(panel, recess=0.0, over=("paint", "trim", "gap", "lamp_clear", "lamp_red"))
        for panel in recipe.panels
        if panel.material in _SHOWN and _area(panel) > _SMALLEST
    )
    return replace(recipe, panels=panels)


def _area(panel: CarPanel) -> float:
    """Area of a panel's outline [m2]."""
    a = np.asarray(panel.outline)
    b = np.roll(a, -1, axis=0)
    return abs(float((a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]).sum())) / 2.0


def far_details(shape: CarShape) -> Iterator[MaterialMesh]:
    """Build plates, mirrors, head lamps and what stands on the roof.

    Yields:
        Material and mesh, in the body frame.
    """
    recipe = shape.recipe
    for view, height in zip(("front", "rear"), recipe.plates, strict=True):
        x = float(land(shape, view, [(0.0, height)]).points[0, 0])
        low, high = (x - 0.03, -0.26, height - 0.056), (x + 0.03, 0.26, height + 0.056)
        yield "plate", box(low, high)
    d = recipe.cowl[0] + 0.38
    z, y = float(shape.belt(d)) + 0.10, shape.half + 0.055
    cap = superellipsoid((0.07, 0.11, 0.068), squareness=2.6, segments=6, rings=4)
    yield from on_both_sides([(recipe.mirror, moved(cap, -d + 0.02, y, z))])
    for disc in recipe.discs:
        if disc.style in _LIGHTS:
            x, y, z = land(shape, disc.view, [disc.at]).points[0]
            half = 0.75 * disc.radius
            light = box((x - 0.02, y - half, z - half), (x + 0.004, y + half, z + half))
            yield from on_both_sides([("lamp_white", light)])
    yield from roof_equipment(shape, _FEW_SIDES)


def far_wheels(shape: CarShape, *, track: float) -> Iterator[MaterialMesh]:
    """Build four wheels as short cylinders with bright discs, flush with the flanks.

    Args:
        shape: The body.
        track: |y| of the wheels' middles [m].

    Yields:
        Material and mesh, in the body frame.
    """
    wheel = shape.recipe.wheel
    r, w, rim = wheel.radius, wheel.width / 2.0, wheel.radius * wheel.rim
    tyre = lathe([(r, -w), (r, w), (rim, w)], segments=_SEGMENTS, crease=0.8)
    disc = lathe([(rim, w), (0.0, w)], segments=_SEGMENTS, crease=0.9)
    for d in shape.recipe.axles:
        for material, mesh in (("rubber", tyre), ("disc", disc)):
            yield from on_both_sides([(material, moved(mesh, -d, track + _OUTSET, r))])
