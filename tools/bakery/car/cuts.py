"""Cuts regions and lines into a car's body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bakery.car.body import CarShape
from bakery.car.recipe import MATERIALS, CarPanel
from bakery.mesh.cutting import Surface, refine, retag, split
from bakery.mesh.implicit import Field, values_at
from sumo3dviz_pt.model.geometry import Bools, Floats

Where = Callable[[Floats, Floats], Bools]
"""Chooses faces by centroids (d, y, z), (m, 3) [m], and unit normals, (m, 3)."""

HOLE = -1
"""Tag of faces that are cut away where the wheels are."""

FAR = 1.0
"""Value of a curve's field where it does not reach [m]."""

_GAP = 0.003  # half width of shut lines [m]
_TOLERANCE = 0.0025  # of cuts [m]


@dataclass(frozen=True, slots=True)
class CarFinish:
    """What a face's tag means.

    Attributes:
        material: One of `MATERIALS`.
        recess: How far the face is pushed into the body [m].
    """

    material: str
    recess: float = 0.0


def finishes(panels: tuple[CarPanel, ...], *, gap: float = 0.0) -> tuple[CarFinish, ...]:
    """Return all finishes of a car; panel k has tag `len(MATERIALS) + k`, wheel wells `HOLE`.

    Args:
        panels: Of the recipe.
        gap: Depth of shut lines [m].
    """
    plain = tuple(CarFinish(name, gap if name == "gap" else 0.0) for name in MATERIALS)
    return plain + tuple(CarFinish(panel.material, panel.recess) for panel in panels)


def tag_of(material: str) -> int:
    """Tag of a material without recess."""
    return MATERIALS.index(material)


def everywhere(centroids: Floats, normals: Floats) -> Bools:
    """Choose all faces."""
    return np.ones(len(centroids), dtype=np.bool_)


@dataclass(frozen=True, slots=True)
class RegionCut:
    """One region to be cut out and given another tag.

    Attributes:
        curve: Negative inside the region.
        tag: Of the faces inside.
        where: Which faces the cut may retag.
        over: Tags that it replaces.
    """

    curve: Field
    tag: int
    where: Where = everywhere
    over: tuple[int, ...] = (0,)


def cut_region(surface: Surface, shape: CarShape, cut: RegionCut) -> Surface:
    """Split along a curve and retag what lies inside.

    Args:
        surface: Half the body.
        shape: The body that the surface follows.
        cut: The region.
    """
    surface = split(refine(surface, cut.curve, shape.field, tolerance=_TOLERANCE), cut.curve)
    centroids = surface.centroids
    inside = (values_at(cut.curve, centroids) < 0.0) & cut.where(centroids, surface.face_normals)
    return retag(surface, inside, cut.tag, cut.over)


def _shifted(line: Field, by: float) -> Field:
    """A curve beside a curve [m]."""
    return lambda d, y, z: np.asarray(line(d, y, z) + by)


def cut_line(surface: Surface, shape: CarShape, line: Field, where: Where) -> Surface:
    """Cut a thin dark strip along the zero set of a curve.

    Args:
        surface: Half the body.
        shape: The body that the surface follows.
        line: The curve.
        where: Which faces the cut may retag.
    """
    surface = refine(surface, line, shape.field, tolerance=_TOLERANCE)
    for side in (-_GAP, _GAP):
        surface = split(surface, _shifted(line, side))
    centroids = surface.centroids
    inside = (np.abs(values_at(line, centroids)) < _GAP) & where(centroids, surface.face_normals)
    return retag(surface, inside, tag_of("gap"), (tag_of("paint"), tag_of("gap")))
