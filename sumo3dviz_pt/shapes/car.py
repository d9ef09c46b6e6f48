"""Builds a passenger car from its recipe: near and far level."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, Transform
from sumo3dviz_pt.shapes.car_body import WELL_DEPTH, CarShape, body_surface, car_shape
from sumo3dviz_pt.shapes.car_cuts import HOLE, Finish, finishes
from sumo3dviz_pt.shapes.car_details import attached, details
from sumo3dviz_pt.shapes.car_far import far_surface, far_wheels
from sumo3dviz_pt.shapes.car_gaps import cut_gaps
from sumo3dviz_pt.shapes.car_panels import cut_dark_parts, cut_panels
from sumo3dviz_pt.shapes.car_recipe import MATERIALS, CarRecipe, read_recipe
from sumo3dviz_pt.shapes.car_windows import cut_windows
from sumo3dviz_pt.shapes.cutting import Surface, corner_normals, weld
from sumo3dviz_pt.shapes.simplify import simplify
from sumo3dviz_pt.shapes.solids import by_material, mirrored, moved
from sumo3dviz_pt.shapes.vehicle import BakedVehicle, Builder
from sumo3dviz_pt.shapes.wheel import build_wheel, well_shell

_SPACING = 0.055
_HALF_FACES = 6000
_FLIP = np.array([-1.0, 1.0, 1.0])


def build_car(recipe: CarRecipe) -> BakedVehicle:
    """Build both levels of a car; the same recipe gives the same meshes."""
    shape = car_shape(recipe)
    track = recipe.width / 2.0 - recipe.wheel.width / 2.0 - 0.012
    body = [*_body_pieces(shape), *attached(shape)]
    fit = _fit(recipe, np.concatenate([mesh.vertices for _, mesh in body]))
    near = [(name, fit.mesh(mesh)) for name, mesh in (*body, *details(shape))]
    hull = list(_far_pieces(shape))
    fit = _fit(recipe, np.concatenate([mesh.vertices for _, mesh in hull]))
    far = [(name, fit.mesh(mesh)) for name, mesh in hull]
    return BakedVehicle(
        by_material([*near, *_wheels(shape, track)]),
        by_material([*far, *far_wheels(shape, track=track)]),
    )


def _fit(recipe: CarRecipe, points: Floats) -> Transform:
    """Stretch a body by the last millimetres to its declared size."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.array([high[0] - low[0], 2.0 * high[1], high[2]])
    scale = np.array([recipe.length, recipe.width, recipe.height]) / size
    return Transform.from_pose((-high[0] * scale[0], 0.0, 0.0), scale=scale)


def _body_pieces(shape: CarShape) -> Iterator[tuple[str, Mesh]]:
    """The cut body, both halves."""
    surface = body_surface(shape, spacing=_SPACING)
    for cut in (cut_dark_parts, cut_windows, cut_panels, cut_gaps):
        surface = cut(surface, shape)
    surface = simplify(surface, faces=_HALF_FACES)
    owner, normals = corner_normals(shape.field, surface)
    known = finishes(shape.recipe.panels)
    for tag in np.unique(surface.tags[surface.tags != HOLE]):
        chosen = surface.tags == tag
        half = _half(
            surface, owner.reshape(-1, 3)[chosen], normals.reshape(-1, 3, 3)[chosen], known[tag]
        )
        for mesh in half:
            yield known[tag].material, mesh
            yield known[tag].material, mirrored(mesh)
    for material, mesh in _well_pieces(shape, surface):
        yield material, mesh
        yield material, mirrored(mesh)


def _far_pieces(shape: CarShape) -> Iterator[tuple[str, Mesh]]:
    """The far level's body, both halves."""
    surface = far_surface(shape)
    owner, normals = corner_normals(shape.field, surface, crease=0.7)
    corners, normals = owner.reshape(-1, 3), normals.reshape(-1, 3, 3)
    for tag in np.unique(surface.tags):
        chosen = surface.tags == tag
        finish = Finish(MATERIALS[tag])
        for mesh in _half(surface, corners[chosen], normals[chosen], finish):
            yield finish.material, mesh
            yield finish.material, mirrored(mesh)


def _well_pieces(shape: CarShape, surface: Surface) -> Iterator[tuple[str, Mesh]]:
    """Lips around the holes for the wheels, and dark shells behind."""
    hole = surface.faces[surface.tags == HOLE]
    yield "trim", _forward(_walls(surface.vertices, hole, np.array([0.0, -0.06, 0.0])))
    recipe = shape.recipe
    span = (shape.half - WELL_DEPTH - 0.01, shape.half - 0.03)
    lowest = recipe.clearance + 0.10 - recipe.wheel.radius
    shell = well_shell(recipe.arch_radius + 0.006, span, lowest=lowest)
    for d in recipe.axles:
        yield "trim", moved(shell, -d, 0.0, recipe.wheel.radius)


def _half(surface: Surface, owner: Ints, normals: Floats, finish: Finish) -> Iterator[Mesh]:
    """The faces of one finish in the body frame, pushed in, with walls around them."""
    positions = surface.vertices[owner]
    shift = np.array([finish.recess, 0.0, 0.0])
    yield _forward(
        weld(owner.reshape(-1), (positions + shift).reshape(-1, 3), normals.reshape(-1, 3))
    )
    if finish.recess != 0.0:
        yield _forward(_walls(surface.vertices, owner, shift))


def _forward(mesh: Mesh) -> Mesh:
    """Turn d backwards into x forwards."""
    assert mesh.normals is not None
    return replace(
        mesh,
        vertices=mesh.vertices * _FLIP,
        faces=mesh.faces[:, ::-1],
        normals=mesh.normals * _FLIP,
    )


def _walls(vertices: Floats, faces: Ints, shift: Floats) -> Mesh:
    """Quads between the rim of some faces and the same rim pushed in, seen from inside."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = len(vertices)
    back = sides[:, 1] * count + sides[:, 0]
    rim = sides[~np.isin(sides[:, 0] * count + sides[:, 1], back)]
    # The seam of the two halves is no rim.
    rim = rim[(np.abs(vertices[rim, 1]) > 1e-9).any(axis=1)]
    normal = np.cross(vertices[rim[:, 1]] - vertices[rim[:, 0]], shift)
    length = np.linalg.norm(normal, axis=1)
    # Where the rim runs along the shift, there is no wall.
    rim, normal = rim[length > 1e-6], (normal / (length[:, None] + 1e-20))[length > 1e-6]
    a, b = vertices[rim[:, 0]], vertices[rim[:, 1]]
    corners = np.stack([a, b, b + shift, a, b + shift, a + shift], axis=1)
    numbers = np.arange(6 * len(rim)).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), numbers, np.repeat(normal, 6, axis=0))


def _wheels(shape: CarShape, track: float) -> Iterator[tuple[str, Mesh]]:
    """Four wheels on the ground."""
    recipe = shape.recipe
    for material, mesh in build_wheel(recipe.wheel).items():
        for d in recipe.axles:
            placed = moved(mesh, -d, track, recipe.wheel.radius)
            yield material, placed
            yield material, mirrored(placed)


CAR = Builder(lambda recipe: build_car(read_recipe(recipe)))
"""Passenger cars."""
