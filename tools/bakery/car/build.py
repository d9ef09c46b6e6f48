"""Builds a passenger car from its recipe: the baked levels and the one for close views."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from bakery.build import BakedVehicle, Builder, FullVehicle
from bakery.car.body import CarShape, car_shape
from bakery.car.conform import CarFineness
from bakery.car.cuts import CarFinish
from bakery.car.details import attached, details
from bakery.car.equipment import equipment, equipment_lamps
from bakery.car.far import far_details, far_surface, far_wheels
from bakery.car.lamps import car_lamps
from bakery.car.ornaments import ornaments
from bakery.car.recipe import MATERIALS, CarRecipe, read_recipe
from bakery.car.shell import body_pieces, surface_pieces
from bakery.grime import Dirt, grimed
from bakery.halves import fit_to
from bakery.wheel import build_wheel
from sumo3dviz_pt.library.mesh.solids import by_material, moved, on_both_sides, solid_faces
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh, WheelPlace
from sumo3dviz_pt.model.geometry import Floats, Transform
from sumo3dviz_pt.model.scene import VehicleLamp

MIDDLE = CarFineness(spacing=0.055, faces=2500, step=0.2, sides=8)
"""Seen from ten metres on."""

FULL = CarFineness(spacing=0.04, faces=15000, step=0.04, sides=26, gap=0.011, bevels=True)
"""Seen from nearby."""


def build_car(recipe: CarRecipe) -> BakedVehicle:
    """Build the baked levels of a car; the same recipe gives the same meshes."""
    shape = car_shape(recipe)
    near, fit = _near(shape, MIDDLE)
    # From afar nobody sees how doors are hollow.
    plain = replace(shape, hollow=0.0, sharp=0.045)
    hull = list(_far_pieces(plain))
    far_fit = _fit(recipe, np.concatenate([mesh.vertices for _, mesh in hull]))
    far = [(name, far_fit.mesh(mesh)) for name, mesh in (*hull, *far_details(plain))]
    track = _track(recipe)
    lamps = (*car_lamps(shape), *equipment_lamps(shape))
    return BakedVehicle(
        by_material(_dirty(recipe, [*near, *_wheels(shape, track)])),
        by_material(_painted(recipe, [*far, *far_wheels(plain, track=track)])),
        tuple(_fitted(lamp, fit) for lamp in lamps),
        tuple(_wheel_places(recipe, track)),
        _cabin(shape),
    )


def _cabin(shape: CarShape) -> tuple[float, ...]:
    """Where the cabin lies and how large it is, as `cabin_of` reads it."""
    recipe = shape.recipe
    seat = recipe.doors[0][1] - 0.2
    # Where there are no doors for those behind, they sit close.
    rear = recipe.doors[1][1] - 0.12 if len(recipe.doors) > 1 else seat + 0.8
    belt = float(shape.belt(seat))
    half = float(shape.side_glass(np.array(seat), np.array(belt)))
    foot = float(shape.backlight(recipe.rear_window[0]))
    roof = float(shape.roof(seat)) - belt
    return (-seat, belt, rear - seat, roof, half, seat - recipe.cowl[0], foot - seat)


def build_full(recipe: CarRecipe) -> FullVehicle:
    """Build the level of a car for close views."""
    near, _ = _near(car_shape(recipe), FULL)
    wheel = build_wheel(recipe.wheel, fine=True).items()
    return FullVehicle(by_material(_dirty(recipe, near)), by_material(_painted(recipe, wheel)))


def _near(shape: CarShape, level: CarFineness) -> tuple[list[MaterialMesh], Transform]:
    """A car without wheels, and how it was stretched."""
    body = [*body_pieces(shape, level), *attached(shape, level)]
    fit = _fit(shape.recipe, np.concatenate([mesh.vertices for _, mesh in body]))
    rest = (*ornaments(shape, level), *details(shape, level), *equipment(shape, level))
    return [(name, fit.mesh(mesh)) for name, mesh in (*body, *rest)], fit


def _fit(recipe: CarRecipe, points: Floats) -> Transform:
    """Stretch a body by the last millimetres to its declared size."""
    size = (recipe.length, recipe.width, recipe.height)
    return fit_to(size, low=points.min(axis=0), high=points.max(axis=0))


def _fitted(lamp: VehicleLamp, fit: Transform) -> VehicleLamp:
    """A lamp on a body that was stretched."""
    x, y, z = fit.points(np.array([lamp.at]))[0]
    return VehicleLamp(lamp.role, (float(x), float(y), float(z)), lamp.size, lamp.yaw)


def _painted(recipe: CarRecipe, pieces: Iterable[MaterialMesh]) -> Iterator[MaterialMesh]:
    """Pieces as they are stored, with the material that this car is painted with."""
    for material, mesh in pieces:
        yield recipe.body if material == "paint" else material, solid_faces(mesh)


def _dirty(recipe: CarRecipe, pieces: Iterable[MaterialMesh]) -> Iterator[MaterialMesh]:
    """Pieces as `_painted`, the paint with road dirt on it."""
    dirt = Dirt(recipe.length, recipe.clearance, recipe.axles, recipe.wheel.radius)
    for material, mesh in _painted(recipe, pieces):
        if material == "paint":
            mesh = grimed(mesh, dirt)
        yield material, mesh


def _far_pieces(shape: CarShape) -> Iterator[MaterialMesh]:
    """The far level's body, both halves."""
    known = tuple(CarFinish(name) for name in MATERIALS)
    yield from on_both_sides(surface_pieces(shape, far_surface(shape), known, crease=0.7))


def _track(recipe: CarRecipe) -> float:
    """|y| of the wheels' middles [m]."""
    return recipe.width / 2.0 - recipe.wheel.width / 2.0 - 0.012


def _wheel_places(recipe: CarRecipe, track: float) -> Iterator[WheelPlace]:
    """Left and right wheels of both axles; the front ones steer."""
    for number, d in enumerate(recipe.axles):
        for y in (track, -track):
            radius = recipe.wheel.radius
            yield WheelPlace((-d, y, radius), radius, steered=number == 0)


def _wheels(shape: CarShape, track: float) -> Iterator[MaterialMesh]:
    """Four wheels on the ground."""
    recipe = shape.recipe
    for material, mesh in build_wheel(recipe.wheel).items():
        for d in recipe.axles:
            yield from on_both_sides([(material, moved(mesh, -d, track, recipe.wheel.radius))])


CAR = Builder(
    lambda recipe: build_car(read_recipe(recipe)), lambda recipe: build_full(read_recipe(recipe))
)
"""Passenger cars."""
