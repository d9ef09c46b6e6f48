"""Pieces that stick out of a car's body: mirrors, handles, plates, rails."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.shapes.car_body import CarShape
from sumo3dviz_pt.shapes.solids import box, mirrored, moved, superellipsoid, tube

Piece = tuple[str, Mesh]
"""Material and mesh in the frame (d, y, z) turned to face forward: x = -d."""


def attached(shape: CarShape) -> Iterator[Piece]:
    """Plates and roof rails, which count for the car's length and height."""
    for material, mesh in _rails(shape):
        yield material, mesh
        yield material, mirrored(mesh)
    yield from _plates(shape)


def details(shape: CarShape) -> Iterator[Piece]:
    """Mirrors and handles, which may stick out of the car's width."""
    for material, mesh in (*_mirror(shape), *_handles(shape)):
        yield material, mesh
        yield material, mirrored(mesh)


def surface_d(shape: CarShape, y: float, z: float, *, front: bool) -> float:
    """Distance d at which a ray along the car meets its front or rear at (y, z) [m]."""
    length = shape.recipe.length
    d = np.linspace(-0.1 if front else length + 0.1, length / 2, 2000)
    inside = shape.field(d, np.full_like(d, y), np.full_like(d, z)) < 0.0
    return float(d[inside.argmax()])


def _mirror(shape: CarShape) -> Iterator[Piece]:
    """The left door mirror with its glass and foot."""
    d, half = shape.recipe.cowl[0] + 0.36, shape.half
    z = float(shape.belt(d)) + 0.085
    y = half + 0.045
    shell = superellipsoid((0.085, 0.108, 0.070), squareness=2.8, segments=14, rings=8)
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
    spots = [(y, z) for y in (0.0, 0.13, 0.26) for z in (-0.056, 0.0, 0.056)]
    for front, height in zip((True, False), shape.recipe.plates, strict=True):
        sign = 1.0 if front else -1.0
        outer = max(-sign * surface_d(shape, y, height + z, front=front) for y, z in spots) * sign
        for material, reach, half_y, half_z in (
            ("trim", 0.002, 0.27, 0.064),
            ("plate", 0.006, 0.26, 0.056),
        ):
            ends = sorted((outer + sign * reach, outer - sign * 0.06))
            low = (ends[0], -half_y, height - half_z)
            yield material, box(low, (ends[1], half_y, height + half_z))
