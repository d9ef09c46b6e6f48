"""The driver as he is seen through a car's windows: a figure on the panes.

Panes are opaque, so that the driver is drawn on them, 1.6 mm before the glass and as glossy as it
is: he lies under the same reflections.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bakery.car.body import CarShape
from bakery.car.conform import CarFineness, land
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh

_BEFORE = 0.0016
"""Distance of the first layer before the glass, and of each layer before the last [m]."""

_RINGS = 4  # of triangles of each figure

_HEAD = (0.075, 0.115)
"""Half width and height of a head as seen from ahead [m]."""

_PROFILE = (0.095, 0.115)
"""Half width and height of a head as seen from the side [m]."""


def driver(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Build head and shoulders of the driver in the windscreen and the side windows."""
    recipe, sides = shape.recipe, max(14, level.sides)
    seat = recipe.doors[0][1] - 0.24
    floor = float(shape.belt(seat))
    low, roof = recipe.cowl[1], float(shape.roof(seat))
    head = min(floor + 0.22, roof - 0.21)
    # Seen from ahead through a leaning pane, a head shows lower than it is.
    y, ahead = 0.2 * recipe.width, min(low + 0.30, float(shape.roof(recipe.header)) - 0.16)
    yield "glass", _spot(shape, "front", _oval((y, ahead), _HEAD, sides))
    face = _oval((y, ahead - 0.025), (0.8 * _HEAD[0], 0.72 * _HEAD[1]), sides)
    yield "glass_face", _spot(shape, "front", face, layer=2)
    bust = [(y - 0.21, low + 0.085), (y + 0.21, low + 0.085), (y + 0.2, ahead - 0.18)]
    bust += [(y + 0.06, ahead - 0.115), (y - 0.06, ahead - 0.115), (y - 0.2, ahead - 0.18)]
    yield "glass_coat", _spot(shape, "front", np.array(bust))
    yield "glass", _spot(shape, "side", _oval((seat, head), _PROFILE, sides))
    face = _oval((seat - 0.03, head - 0.025), (0.6 * _PROFILE[0], 0.7 * _PROFILE[1]), sides)
    yield "glass_face", _spot(shape, "side", face, layer=2)
    chest = [(seat - 0.15, floor + 0.055), (seat + 0.16, floor + 0.055), (seat + 0.15, head - 0.15)]
    chest += [(seat + 0.05, head - 0.09), (seat - 0.05, head - 0.1), (seat - 0.13, head - 0.19)]
    yield "glass_coat", _spot(shape, "side", np.array(chest))


def _oval(middle: Sequence[float], half: Sequence[float], sides: int) -> Floats:
    """Corners of an ellipse, (n, 2) [m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    return np.asarray(middle) + np.stack([np.cos(turn), np.sin(turn)], axis=1) * half


def _spot(shape: CarShape, view: str, outline: Floats, *, layer: int = 1) -> Mesh:
    """A convex outline laid on the body as concentric rings."""
    middle, count = outline.mean(axis=0), len(outline)
    shares = np.linspace(0.0, 1.0, _RINGS + 1)[1:, None, None]
    rings = (middle + shares * (outline - middle)).reshape(-1, 2)
    spots = land(shape, view, np.concatenate([[middle], rings]))
    points = spots.points + layer * _BEFORE * spots.normals
    ring = np.arange(count)
    after = (ring + 1) % count
    faces = [np.column_stack([np.zeros(count, np.int64), 1 + ring, 1 + after])]
    for k in range(_RINGS - 1):
        a, b = 1 + k * count, 1 + (k + 1) * count
        faces += [np.column_stack([a + ring, b + ring, b + after])]
        faces += [np.column_stack([a + ring, b + after, a + after])]
    triangles = np.concatenate(faces)
    a, b, c = points[triangles].transpose(1, 0, 2)
    inwards = (np.cross(b - a, c - a) * spots.normals[triangles[:, 0]]).sum(axis=1) < 0.0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return Mesh(points, triangles, spots.normals)
