"""Builds heavy vehicles from their recipes: shells with what is cut in, pieces, wheels, lamps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bakery.build import BakedVehicle, Builder, FullVehicle
from bakery.grime import Dirt, grimed
from bakery.halves import fit_to, forward
from bakery.heavy.body import far_hull, hull_pieces
from bakery.heavy.hull import shell_of, surface_at
from bakery.heavy.pieces import build_far_piece, build_piece
from bakery.heavy.recipe import BoxRecipe, read_box
from bakery.heavy.wheels import far_box_wheels, full_wheel, inner_tyres, is_reversed, wheels_of
from sumo3dviz_pt.library.mesh.solids import by_material
from sumo3dviz_pt.library.vehicles.lamps import find_lamps
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh, WheelPlace
from sumo3dviz_pt.model.geometry import Floats, Mesh

_FAR_FACES = 260  # of half the shells at the far level, all together
_FULL_FACES = 2  # at the full level, in faces of the near one
_LOW = 0.3  # height of the lower edges of bodies [m]


def build_box(recipe: BoxRecipe) -> BakedVehicle:
    """Build both levels of a heavy vehicle; the same recipe gives the same meshes.

    Raises:
        ConfigError: If a lamp lies beside the vehicle.
    """
    near = _level(recipe, _near_bodies(recipe), _pieces(recipe, far=False))
    far = _level(recipe, _far_bodies(recipe), _pieces(recipe, far=True))
    near += [_placed(p) for axle in recipe.axles for p in wheels_of(recipe.wheel, axle)]
    far += [_placed(p) for p in far_box_wheels(recipe.wheel, recipe.axles)]
    lamps = tuple(find_lamps(recipe.lamps, [mesh for _, mesh in near]))
    shown = by_material(_dirty(recipe, near))
    return BakedVehicle(shown, by_material(far), lamps, _wheel_places(recipe))


def full_box(recipe: BoxRecipe) -> FullVehicle:
    """Build the level for close views: finer shells, wheels of their own.

    Twin wheels turn without their inner tyres, which stay with the body.
    """
    hulls = tuple(replace(hull, faces=_FULL_FACES * hull.faces) for hull in recipe.hulls)
    body = _level(recipe, _near_bodies(replace(recipe, hulls=hulls)), _pieces(recipe, far=False))
    body += [_placed(p) for axle in recipe.axles for p in inner_tyres(recipe.wheel, axle)]
    wheel = [_placed(piece) for piece in full_wheel(recipe.wheel, recipe.axles)]
    return FullVehicle(by_material(_dirty(recipe, body)), by_material(wheel))


def _dirty(recipe: BoxRecipe, pieces: Iterable[MaterialMesh]) -> Iterator[MaterialMesh]:
    """Pieces, the paint with road dirt on it."""
    axles = tuple(axle.at for axle in recipe.axles)
    dirt = Dirt(recipe.length, _LOW, axles, recipe.wheel.radius)
    for material, mesh in pieces:
        if material == "paint":
            mesh = grimed(mesh, dirt)
        yield material, mesh


def _near_bodies(recipe: BoxRecipe) -> Iterator[MaterialMesh]:
    """The shells in full."""
    for hull in recipe.hulls:
        yield from hull_pieces(recipe, hull)


def _far_bodies(recipe: BoxRecipe) -> Iterator[MaterialMesh]:
    """The shells with few faces, which they share by their sizes."""
    faces = [hull.faces for hull in recipe.hulls]
    for hull in recipe.hulls:
        yield from far_hull(hull, recipe, faces=max(60, _FAR_FACES * hull.faces // sum(faces)))


@dataclass(frozen=True, slots=True, eq=False)
class _Fixed:
    """A piece that is fixed to a shell; `outside` ones may stick out of the declared size."""

    material: str
    mesh: Mesh
    outside: bool


def _pieces(recipe: BoxRecipe, *, far: bool) -> Iterator[_Fixed]:
    """What is fixed to the shells, in the frame (d, y, z)."""
    shells = [shell_of(hull) for hull in recipe.hulls]

    def ground(view: str, point: Floats) -> float:
        return surface_at(shells, view, point)

    build = build_far_piece if far else build_piece
    for piece in recipe.pieces:
        if far and not piece.far:
            continue
        for mesh in build(piece, ground):
            yield _Fixed(piece.material, mesh, piece.outside)


def _level(
    recipe: BoxRecipe, bodies: Iterable[MaterialMesh], pieces: Iterable[_Fixed]
) -> list[MaterialMesh]:
    """Everything but wheels in the body's frame, stretched by millimetres to its size."""
    hulls = [_placed(piece) for piece in bodies]
    fixed = [replace(item, mesh=forward(item.mesh)) for item in pieces]
    inside = [mesh for _, mesh in hulls] + [item.mesh for item in fixed if not item.outside]
    bounds = np.stack([mesh.bounds for mesh in inside])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    fit = fit_to((recipe.length, recipe.width, recipe.height), low=low, high=high)
    return [(material, fit.mesh(mesh)) for material, mesh in hulls] + [
        (item.material, fit.mesh(item.mesh)) for item in fixed
    ]


def _placed(piece: MaterialMesh) -> MaterialMesh:
    """A piece in the body's frame."""
    return piece[0], forward(piece[1])


def _wheel_places(recipe: BoxRecipe) -> tuple[WheelPlace, ...]:
    """Where the wheels turn, left and right of each axle."""
    radius = recipe.wheel.radius
    return tuple(
        WheelPlace(
            (-axle.at, side * (axle.out - 0.5 * recipe.wheel.width), radius),
            radius,
            axle.steered,
            is_reversed(recipe.wheel, axle),
        )
        for axle in recipe.axles
        for side in (1.0, -1.0)
    )


BOX = Builder(lambda recipe: build_box(read_box(recipe)), lambda recipe: full_box(read_box(recipe)))
"""Vans, buses, lorries and their trailers."""
