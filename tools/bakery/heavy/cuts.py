"""Windows, doors, stripes and shut lines that are cut into the shell of a heavy vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bakery.halves import both_sides
from bakery.heavy.hull import Shell
from bakery.heavy.recipe import Axle, HullPanel
from bakery.mesh.cutting import Surface, refine, retag, split
from bakery.mesh.implicit import Field, polygon, values_at
from sumo3dviz_pt.model.geometry import Bools, Floats

HOLE = -1
"""Tag of faces that are cut away where the wheels are."""

UNDER = 1
"""Tag of the underside; 0 is the shell itself, panel k has `2 + k`."""

WELL_DEPTH = 0.42
"""How far wheel wells reach inwards from the flank [m]."""

_FAR = 1.0  # value of a field where it does not reach [m]
_TOLERANCE = 0.003  # of cuts [m]
# Axis of (d, y, z) along which a view looks, and the sign there of normals towards the viewer.
_AXES = {
    "front": (0, -1.0),
    "rear": (0, 1.0),
    "side": (1, 1.0),
    "left": (1, 1.0),
    "right": (1, 1.0),
    "top": (2, 1.0),
}


@dataclass(frozen=True, slots=True)
class HeavyFinish:
    """What a face's tag means.

    Attributes:
        material: Its name.
        shift: How far the face is pushed, along (d, y, z) [m].
        panel: What it was cut with.
    """

    material: str
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    panel: HullPanel | None = None


def finishes(shell: Shell) -> dict[int, HeavyFinish]:
    """Return all finishes of a shell by tag."""
    hull = shell.hull
    known = {0: HeavyFinish(hull.material), UNDER: HeavyFinish(hull.under)}
    for number, panel in enumerate((*hull.panels, *hull.gaps)):
        axis, sign = _AXES[panel.view]
        shift = [0.0, 0.0, 0.0]
        shift[axis] = -sign * panel.recess
        known[2 + number] = HeavyFinish(panel.material, (shift[0], shift[1], shift[2]), panel)
    return known


def on_side(panel: HullPanel, side: str) -> bool:
    """Return whether a panel is cut into the half on the `left` or `right`."""
    return panel.view not in ("left", "right") or panel.view == side


def cut_shell(surface: Surface, shell: Shell, wells: Field | None, *, side: str) -> Surface:
    """Cut everything that a shell has on one side.

    Args:
        surface: The half with y >= 0.
        shell: Where it comes from.
        wells: From `wheel_wells`, or None.
        side: `left` or `right`; the surface stands for either.
    """
    surface = _cut_underside(surface)
    known = finishes(shell)
    if wells is not None:
        surface = _cut(surface, shell, wells, HOLE, (0, UNDER))
    for tag, finish in known.items():
        panel = finish.panel
        if panel is None or not on_side(panel, side):
            continue
        over = _over(panel, known)
        if tag >= 2 + len(shell.hull.panels):
            surface = _cut_line(surface, shell, panel, tag, over)
        else:
            surface = _cut(surface, shell, projected(panel, shell), tag, over, panel)
    return surface


def _over(panel: HullPanel, known: dict[int, HeavyFinish]) -> tuple[int, ...]:
    """Tags that a panel replaces."""
    if not panel.over:
        return (0,)
    return tuple(tag for tag, finish in known.items() if finish.material in panel.over)


def _cut_underside(surface: Surface) -> Surface:
    """Tag faces that look down."""
    return retag(surface, surface.face_normals[:, 2] < -0.75, UNDER, (0,))


def wheel_wells(shell: Shell, axles: Sequence[Axle], *, radius: float) -> Field | None:
    """Return the field of a shell's wheel wells, or None if it has no arches.

    Args:
        shell: The shell.
        axles: Of the vehicle.
        radius: Of the tyres [m].
    """
    hull = shell.hull
    if not hull.arches:
        return None
    arch = radius + hull.arches

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        near = np.full(np.shape(d), np.inf)
        for axle in axles:
            near = np.minimum(near, np.hypot(d - axle.at, z - radius) - arch)
        inside = np.maximum(near, hull.half - WELL_DEPTH - y)
        return np.where(z < radius + 1.5 * arch, inside, _FAR)

    return field


def projected(panel: HullPanel, shell: Shell) -> Field:
    """Return the field of a panel's outline and its repetitions, projected along its view."""
    outline = np.asarray(panel.outline, dtype=np.float64)
    if panel.view in ("front", "rear"):
        outline = both_sides(outline)
    low, high = shell.bounds[:, 0]

    def field(d: Floats, y: Floats, z: Floats) -> Floats:
        if panel.view == "top":
            return polygon(_folded(d, panel), np.abs(y), outline, radius=panel.radius)
        if panel.view not in ("front", "rear"):
            return polygon(_folded(d, panel), z, outline, radius=panel.radius)
        inside = polygon(_folded(np.abs(y), panel), z, outline, radius=panel.radius)
        depth = (d - low if panel.view == "front" else high - d) - panel.reach
        return np.where(depth < _FAR, np.maximum(inside, depth), _FAR)

    return field


def _folded(u: Floats, panel: HullPanel) -> Floats:
    """The coordinate along which a panel is repeated, folded back to the first."""
    return u if panel.repeat <= 1 else np.asarray(u - panel.step * number_of(u, panel))


def number_of(u: Floats, panel: HullPanel) -> Floats:
    """Return which of the repetitions is the nearest, from 0."""
    first = np.asarray(panel.outline, dtype=np.float64)[:, 0]
    middle = 0.5 * (first.min() + first.max())
    return np.asarray(np.clip(np.round((u - middle) / panel.step), 0, panel.repeat - 1))


def _facing(surface: Surface, panel: HullPanel | None) -> Bools:
    """Faces that look towards a panel's view and that it may retag, (n,); all without a panel."""
    if panel is None:
        return np.ones(len(surface.faces), dtype=np.bool_)
    axis, sign = _AXES[panel.view]
    return np.asarray(sign * surface.face_normals[:, axis] > (-0.1 if axis == 0 else 0.45))


def _cut(
    surface: Surface,
    shell: Shell,
    curve: Field,
    tag: int,
    over: tuple[int, ...],
    panel: HullPanel | None = None,
) -> Surface:
    """Split along a curve and retag what lies inside."""
    surface = split(refine(surface, curve, shell.field, tolerance=_TOLERANCE), curve)
    inside = (values_at(curve, surface.centroids) < 0.0) & _facing(surface, panel)
    return retag(surface, inside, tag, over)


def _cut_line(
    surface: Surface, shell: Shell, panel: HullPanel, tag: int, over: tuple[int, ...]
) -> Surface:
    """Cut a thin dark strip along an outline."""
    line = projected(panel, shell)
    half = 0.5 * panel.width
    surface = refine(surface, line, shell.field, tolerance=_TOLERANCE)
    for shift in (-half, half):

        def beside(d: Floats, y: Floats, z: Floats, by: float = shift) -> Floats:
            return np.asarray(line(d, y, z) + by)

        surface = split(surface, beside)
    inside = (np.abs(values_at(line, surface.centroids)) < half) & _facing(surface, panel)
    return retag(surface, inside, tag, over)
