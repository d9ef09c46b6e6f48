"""The far level of a car: its body simplified to a few triangles, wheels as short cylinders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Ints, Mesh
from sumo3dviz_pt.shapes.car_body import CarShape, body_surface
from sumo3dviz_pt.shapes.car_cuts import tag_of
from sumo3dviz_pt.shapes.car_panels import cut_panels
from sumo3dviz_pt.shapes.car_recipe import MATERIALS, CarRecipe
from sumo3dviz_pt.shapes.car_windows import cut_windows
from sumo3dviz_pt.shapes.cutting import Surface
from sumo3dviz_pt.shapes.simplify import simplify
from sumo3dviz_pt.shapes.solids import lathe, mirrored, moved

_SPACING = 0.08
_HALF_FACES = 116
_SEGMENTS = 8
_OUTSET = 0.012
_LAMPS = {"glass": "lamp_white", "lamp_red": "lamp_red"}


def far_surface(shape: CarShape) -> Surface:
    """The half body with y >= 0 and few faces; windows without frames, lamps without detail.

    Args:
        shape: The body.

    Returns:
        A surface whose tags are places in `MATERIALS`.
    """
    lamps = _lamps_only(shape.recipe)
    surface = cut_windows(body_surface(shape, spacing=_SPACING), shape)
    framed = Surface(surface.vertices, surface.faces, _retagged(surface, "trim", "glass"))
    surface = cut_panels(framed, replace(shape, recipe=lamps))
    names = [*MATERIALS, *(_LAMPS[panel.material] for panel in lamps.panels)]
    tags = np.array([tag_of(name) for name in names])[surface.tags]
    surface = simplify(
        Surface(surface.vertices, surface.faces, tags), faces=_HALF_FACES, largest=1.0
    )
    under = (surface.face_normals[:, 2] < -0.7) & (surface.tags == 0)
    return Surface(surface.vertices, surface.faces, np.where(under, tag_of("trim"), surface.tags))


def _retagged(surface: Surface, old: str, new: str) -> Ints:
    """Tags with one material replaced by another."""
    return np.where(surface.tags == tag_of(old), tag_of(new), surface.tags)


def _lamps_only(recipe: CarRecipe) -> CarRecipe:
    """The recipe with the outlines of its lamps as its only panels."""
    panels = tuple(
        replace(panel, recess=0.0, over=("paint",))
        for panel in recipe.panels
        if panel.material in _LAMPS and "glass" not in panel.over
    )
    return replace(recipe, panels=panels)


def far_wheels(shape: CarShape, *, track: float) -> Iterator[tuple[str, Mesh]]:
    """Four wheels as short cylinders with bright discs, flush with the flanks.

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
        for material, mesh in (("rubber", tyre), ("rim", disc)):
            placed = moved(mesh, -d, track + _OUTSET, r)
            yield material, placed
            yield material, mirrored(placed)
