"""Turns cut shells into meshes by material, near and far."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bakery.halves import rim_of
from bakery.heavy.cuts import (
    HOLE,
    WELL_DEPTH,
    HeavyFinish,
    cut_shell,
    finishes,
    number_of,
    wheel_wells,
)
from bakery.heavy.hull import Shell, shell_of, shell_surface
from bakery.heavy.recipe import BoxRecipe, Hull, HullPanel
from bakery.mesh.cutting import Surface, corner_normals
from bakery.mesh.simplify import simplify
from bakery.wheel import well_shell
from sumo3dviz_pt.library.mesh.shading import share_normals, weld
from sumo3dviz_pt.library.mesh.solids import mirrored, moved
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, area_vectors

_TILT = 0.006  # of panes against each other, as a slope
_FAR_SPACING = 2.2  # of the far level's grid, in spacings of the near one
_FAR_CREASE = 0.5  # angle above which an edge of the far level stays sharp [rad]
_FAR_PANEL = 0.09  # least area of panels at the far level [m2]
_FAR_LAMP = 0.008  # least area of lamps there [m2]


def hull_pieces(recipe: BoxRecipe, hull: Hull) -> Iterator[MaterialMesh]:
    """Build a shell in full, both sides."""
    shell = shell_of(hull)
    wells = wheel_wells(shell, recipe.axles, radius=recipe.wheel.radius)
    surface = shell_surface(shell, spacing=hull.spacing)
    for side in _sides(hull):
        cut = simplify(cut_shell(surface, shell, wells, side=side), faces=hull.faces)
        for material, mesh in _half(shell, cut, fine=True):
            yield from _placed(material, mesh, side)
    if wells is not None:
        for material, mesh in _well_pieces(recipe, hull):
            yield from _placed(material, mesh, "both")


def _sides(hull: Hull) -> tuple[str, ...]:
    """Which halves are to be made: one that serves for both, or two."""
    views = {panel.view for panel in (*hull.panels, *hull.gaps)}
    return ("left", "right") if views & {"left", "right"} else ("both",)


def _placed(material: str, mesh: Mesh, side: str) -> Iterator[MaterialMesh]:
    """A half on its side, or on both."""
    if side != "right":
        yield material, mesh
    if side != "left":
        yield material, mirrored(mesh)


def _half(shell: Shell, surface: Surface, *, fine: bool) -> Iterator[MaterialMesh]:
    """Meshes of one half, finish by finish."""
    known = finishes(shell)
    owner, normals = corner_normals(shell.field, surface) if fine else _face_normals(surface)
    corners, normals = owner.reshape(-1, 3), normals.reshape(-1, 3, 3)
    for tag in np.unique(surface.tags[surface.tags != HOLE]).tolist():
        chosen = surface.tags == tag
        finish = known[tag]
        shift = np.array(finish.shift)
        tilted = _tilted(surface, corners[chosen], normals[chosen], finish, tag)
        positions = surface.vertices[corners[chosen]] + shift
        yield (
            finish.material,
            weld(corners[chosen].reshape(-1), positions.reshape(-1, 3), tilted.reshape(-1, 3)),
        )
        if shift.any():
            yield finish.material, walls(surface.vertices, corners[chosen], shift)


def _face_normals(surface: Surface) -> tuple[Ints, Floats]:
    """Shading normals of a coarse surface, whose faces lie too far off its field."""
    owner = surface.faces.reshape(-1)
    areas = np.repeat(area_vectors(surface.vertices, surface.faces), 3, axis=0)
    return owner, share_normals(owner, areas, crease=_FAR_CREASE)


def _tilted(
    surface: Surface, corners: Ints, normals: Floats, finish: HeavyFinish, tag: int
) -> Floats:
    """Normals of panes, each a little off the next, so that reflections break at mullions."""
    panel = finish.panel
    if (
        finish.material not in ("glass", "pane_dark")
        or panel is None
        or panel.view in ("front", "rear", "top")
    ):
        return normals
    number = number_of(surface.vertices[corners].mean(axis=1)[:, 0], panel)
    along = ((0.618 * number + 0.377 * tag) % 1.0 - 0.5) * 2.0 * _TILT
    upwards = ((0.755 * number + 0.57 * tag) % 1.0 - 0.5) * 2.0 * _TILT
    turned = normals + np.stack([along, np.zeros_like(along), upwards], axis=1)[:, None, :]
    return np.asarray(turned / np.linalg.norm(turned, axis=2, keepdims=True))


def walls(vertices: Floats, faces: Ints, shift: Floats) -> Mesh:
    """Build quads between the rim of some faces and the same rim pushed in, seen from inside.

    Args:
        vertices: (n, 3) [m].
        faces: The faces that are pushed in, (m, 3).
        shift: By how much, (3,) [m].
    """
    rim = rim_of(vertices, faces)
    normal = np.cross(vertices[rim[:, 1]] - vertices[rim[:, 0]], shift)
    length = np.linalg.norm(normal, axis=1)
    # Where the rim runs along the shift, there is no wall.
    rim, normal = rim[length > 1e-6], (normal / (length[:, None] + 1e-20))[length > 1e-6]
    a, b = vertices[rim[:, 0]], vertices[rim[:, 1]]
    corners = np.stack([a, b, b + shift, a, b + shift, a + shift], axis=1)
    numbers = np.arange(6 * len(rim)).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), numbers, np.repeat(normal, 6, axis=0))


def _well_pieces(recipe: BoxRecipe, hull: Hull) -> Iterator[MaterialMesh]:
    """Dark arches with a wall behind them, in the half with y >= 0."""
    first, last = min(d for _, d in hull.nose), max(d for _, d in hull.tail)
    floor = min(z for _, z in hull.bottom)
    radius = recipe.wheel.radius
    lowest = max(floor + 0.05 - radius, -0.6 * radius)
    span = (hull.half - WELL_DEPTH - 0.01, hull.half - 0.012)
    shell = well_shell(radius + hull.arches + 0.004, span, lowest=lowest)
    # The shell is made for x forwards; turning it round keeps it looking inwards.
    for axle in recipe.axles:
        if first < axle.at < last:
            yield "trim", moved(shell, axle.at, 0.0, radius)


def far_hull(hull: Hull, recipe: BoxRecipe, *, faces: int) -> Iterator[MaterialMesh]:
    """Build a shell with few faces: its large panels only, no shut lines.

    Args:
        hull: The shell.
        recipe: Of the whole vehicle.
        faces: Triangles to aim at, for one half.
    """
    plain = replace(
        hull, panels=tuple(_flat(panel) for panel in hull.panels if _seen_far(panel)), gaps=()
    )
    shell = shell_of(plain)
    surface = shell_surface(shell, spacing=_FAR_SPACING * hull.spacing)
    for side in _sides(plain):
        cut = cut_shell(surface, shell, None, side=side)
        cut = simplify(cut, faces=faces, largest=0.08)
        for material, mesh in _half(shell, cut, fine=False):
            yield from _placed(material, mesh, side)


def _flat(panel: HullPanel) -> HullPanel:
    """A panel without the refinements that only near eyes see."""
    return replace(panel, recess=0.0, radius=0.0)


def _seen_far(panel: HullPanel) -> bool:
    """Whether a panel is large enough for the far level."""
    points = np.asarray(panel.outline)
    area = float(np.prod(points.max(axis=0) - points.min(axis=0)))
    return area > (_FAR_LAMP if panel.material.startswith("lamp") else _FAR_PANEL)
