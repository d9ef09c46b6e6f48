"""Pieces that stick out of a car's body: mirrors, handles, plates, rails."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.shapes.car_body import CarShape
from sumo3dviz_pt.shapes.solids import box, mirrored, moved, superellipsoid, tube

Piece = tuple[str, Mesh]
"""Material and mesh in the frame (d, y, z) turned to face forward: x = -d."""


def details(shape: CarShape) -> Iterator[Piece]:
    """All pieces of a car, both sides, in the body frame."""
    for material, mesh in (*_mirror(shape), *_handles(shape), *_rails(shape)):
        yield material, mesh
        yield material, mirrored(mesh)
    yield from _plates(shape)


def surface_d(shape: CarShape, y: float, z: float, *, front: bool) -> float:
    """d at which a ray along the car meets its front or rear at (y, z) [m]."""
    length = shape.recipe.length
    d = np.linspace(-0.1, length / 2, 2000) if front else np.linspace(length + 0.1, length / 2, 2000)
    inside = shape.field(d, np.full_like(d, y), np.full_like(d, z)) < 0.0
    return float(d[inside.argmax()])


def _mirror(shape: CarShape) -> Iterator[Piece]:
    """The left door mirror with its glass and foot."""
    d, half = shape.recipe.cowl[0] + 0.36, shape.half
    z = float(shape.belt(d)) + 0.085
    y = half + 0.055
    shell = superellipsoid((0.095, 0.115, 0.078), squareness=2.6, segments=14, rings=8)
    # Flatten the back, where the glass sits.
    vertices = shell.vertices.copy()
    vertices[:, 0] = np.maximum(vertices[:, 0], -0.035)
    yield "paint", moved(Mesh(vertices, shell.faces, shell.normals), -d, y, z)
    yield "glass", moved(box((-0.038, -0.085, -0.052), (-0.03, 0.085, 0.052)), -d, y, z)
    yield "trim", moved(box((-0.03, -0.17, -0.075), (0.03, -0.02, -0.045)), -d, y, z)


def _handles(shape: CarShape) -> Iterator[Piece]:
    """One handle near the rear edge of each door."""
    for _, last in shape.recipe.doors:
        d = last - 0.16
        z = float(shape.crease(d)) + 0.055
        y = np.linspace(shape.half + 0.1, 0.4, 800)
        inside = shape.field(np.full_like(y, d), y, np.full_like(y, z)) < 0.0
        bar = superellipsoid((0.095, 0.022, 0.015), squareness=3.0, segments=10, rings=6)
        yield "paint", moved(bar, -d, float(y[inside.argmax()]) + 0.008, z)


def _rails(shape: CarShape) -> Iterator[Piece]:
    """A roof rail that comes down at both ends."""
    if not shape.recipe.rails:
        return
    first, last = shape.recipe.header + 0.15, shape.recipe.length - 0.75
    d = np.linspace(first, last, 12)
    roof = shape.roof(d)
    y = shape.side_glass(d, roof - 0.06) - 0.05
    lift = 0.035 * np.minimum(1.0, np.minimum(d - first, last - d) / 0.12)
    yield "chrome", tube(np.stack([-d, y, roof - 0.055 + lift], axis=1), radius=0.014)


def _plates(shape: CarShape) -> Iterator[Piece]:
    """Number plates of 520 x 112 mm on dark holders."""
    length = shape.recipe.length
    for front, z in zip((True, False), shape.recipe.plates, strict=True):
        sign = 1.0 if front else -1.0
        outer = -min(surface_d(shape, y, z, front=True) for y in (0.0, 0.2)) if front else 0.0
        if not front:
            outer = -max(surface_d(shape, y, z, front=False) for y in (0.0, 0.2))
        outer = min(outer, -0.012) if front else max(outer, 0.012 - length)
        for material, reach, half_y, half_z in (("trim", 0.006, 0.27, 0.064),
                                                ("plate", 0.010, 0.26, 0.056)):
            ends = sorted((outer + sign * reach, outer - sign * 0.05))
            yield material, box((ends[0], -half_y, z - half_z), (ends[1], half_y, z + half_z))
