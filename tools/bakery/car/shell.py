"""A car's cut body as meshes: halves, recesses with their walls, wheel wells."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bakery.car.body import WELL_DEPTH, CarShape, body_surface
from bakery.car.conform import CarFineness
from bakery.car.cuts import HOLE, CarFinish, RegionCut, cut_region, finishes
from bakery.car.gaps import cut_gaps
from bakery.car.panels import cut_dark_parts, cut_panels
from bakery.car.windows import cut_windows
from bakery.halves import forward, rim_of
from bakery.mesh.cutting import Surface, corner_normals
from bakery.mesh.implicit import gradient
from bakery.mesh.simplify import simplify
from bakery.wheel import well_shell
from sumo3dviz_pt.library.mesh.shading import weld
from sumo3dviz_pt.library.mesh.solids import moved, on_both_sides
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, Mesh


def body_pieces(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Build the cut body, both halves, with wheel wells."""
    surface = body_surface(shape, spacing=level.spacing)
    for cut in (cut_dark_parts, cut_windows, cut_panels, cut_gaps):
        surface = cut(surface, shape)
    known = (*finishes(shape.recipe.panels, gap=level.gap), CarFinish("paint"))
    surface = simplify(_creased(surface, shape, len(known) - 1), faces=level.faces)
    half = (*surface_pieces(shape, surface, known), *_well_pieces(shape, surface))
    yield from on_both_sides(half)


def _creased(surface: Surface, shape: CarShape, tag: int) -> Surface:
    """Tag the paint over the character line apart, so that simplification keeps the line."""

    def above(d: Floats, y: Floats, z: Floats) -> Floats:
        return np.asarray(shape.crease(d) - z)

    def on_flank(centroids: Floats, normals: Floats) -> Bools:
        return np.asarray(normals[:, 1] > 0.5)

    return cut_region(surface, shape, RegionCut(above, tag, on_flank))


def surface_pieces(
    shape: CarShape, surface: Surface, known: tuple[CarFinish, ...], *, crease: float = 0.45
) -> Iterator[MaterialMesh]:
    """Build half a body in the body's frame: its faces, some of them pushed in, and walls.

    Args:
        shape: The body.
        surface: Cut; faces tagged `HOLE` are left out.
        known: What the tags mean.
        crease: Angle above which an edge stays sharp [rad].
    """
    owner, normals = corner_normals(shape.field, surface, crease=crease)
    corners, normals = owner.reshape(-1, 3), normals.reshape(-1, 3, 3)
    inwards = _inwards(shape, surface)
    for tag in np.unique(surface.tags[surface.tags != HOLE]):
        chosen = surface.tags == tag
        at = corners[chosen].reshape(-1)
        places = surface.vertices[at] + known[tag].recess * inwards[at]
        facing = _facing(places, normals[chosen].reshape(-1, 3))
        yield known[tag].material, forward(weld(at, places, facing))
    for tag, mesh in _walls(surface, inwards, np.array([finish.recess for finish in known])):
        yield known[tag].material, forward(mesh)


def _facing(places: Floats, normals: Floats) -> Floats:
    """Normals of corners, (3m, 3), but those of their faces where the two disagree."""
    a, b, c = places.reshape(-1, 3, 3).transpose(1, 0, 2)
    flat = np.cross(b - a, c - a)
    flat = np.repeat(flat / (np.linalg.norm(flat, axis=1, keepdims=True) + 1e-20), 3, axis=0)
    return np.where((flat * normals).sum(axis=1, keepdims=True) < 0.1, flat, normals)


def _inwards(shape: CarShape, surface: Surface) -> Floats:
    """Unit vectors into the body at its vertices, (n, 3)."""
    slopes = gradient(shape.field, surface.vertices, step=0.006)
    # The two halves must fit together.
    slopes[np.abs(surface.vertices[:, 1]) < 1e-9, 1] = 0.0
    return np.asarray(-slopes / (np.linalg.norm(slopes, axis=1, keepdims=True) + 1e-12))


def _walls(surface: Surface, inwards: Floats, recess: Floats) -> Iterator[tuple[int, Mesh]]:
    """Walls between faces of different recess, by the tag whose material they get."""
    faces, count = surface.faces, len(surface.vertices)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    tags = np.tile(surface.tags, 3)
    keys = sides[:, 0] * count + sides[:, 1]
    order = np.argsort(keys, kind="stable")
    back = np.clip(
        np.searchsorted(keys, sides[:, 1] * count + sides[:, 0], sorter=order), 0, len(keys) - 1
    )
    other = order[back]
    paired = (sides[other, 0] == sides[:, 1]) & (sides[other, 1] == sides[:, 0])
    solid = paired & (tags != HOLE) & (tags[other] != HOLE)
    deep = np.where(tags == HOLE, 0.0, recess[tags])
    step = deep - np.where(tags[other] == HOLE, 0.0, recess[tags[other]])
    chosen = solid & (step > 1e-5)
    # The later cut owns the wall.
    owner = np.maximum(tags, tags[other])
    for tag in np.unique(owner[chosen]):
        rim = chosen & (owner == tag)
        a, b = sides[rim].T
        low, high = deep[rim, None], (deep - step)[rim, None]
        yield (
            int(tag),
            _quads(
                surface.vertices[a] + high * inwards[a],
                surface.vertices[b] + high * inwards[b],
                surface.vertices[b] + low * inwards[b],
                surface.vertices[a] + low * inwards[a],
            ),
        )


def _quads(a: Floats, b: Floats, c: Floats, d: Floats) -> Mesh:
    """Flat quads, corners (n, 3) each; those without area are left out."""
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    kept = (length > 1e-9) & (np.linalg.norm(np.cross(c - a, d - a), axis=1) > 1e-9)
    corners = np.stack([a, b, c, d], axis=1)[kept].reshape(-1, 3)
    first = 4 * np.arange(kept.sum())[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return Mesh(corners, faces, np.repeat(normal[kept] / length[kept, None], 4, axis=0))


def _well_pieces(shape: CarShape, surface: Surface) -> Iterator[MaterialMesh]:
    """Lips around the holes for the wheels, and dark shells behind."""
    hole = surface.faces[surface.tags == HOLE]
    yield "trim", forward(_lips(surface.vertices, hole, np.array([0.0, -0.06, 0.0])))
    recipe = shape.recipe
    span = (shape.half - WELL_DEPTH - 0.01, shape.half - 0.03)
    lowest = recipe.clearance + 0.10 - recipe.wheel.radius
    shell = well_shell(recipe.arch_radius + 0.006, span, lowest=lowest)
    for d in recipe.axles:
        yield "gap", moved(shell, -d, 0.0, recipe.wheel.radius)


def _lips(vertices: Floats, faces: Ints, shift: Floats) -> Mesh:
    """Quads between the rim of some faces and the same rim pushed in, seen from inside."""
    rim = rim_of(vertices, faces)
    a, b = vertices[rim[:, 0]], vertices[rim[:, 1]]
    return _quads(a, b, b + shift, a + shift)
