"""What makes a taxi or a police car of a car: a lit sign or a light bar on its roof."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bakery.car.body import CarShape
from bakery.car.conform import CarFineness, land
from sumo3dviz_pt.library.mesh.solids import box, moved, shaded, superellipsoid
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import VehicleLamp

_SIGN = (0.075, 0.23, 0.062)
"""Half sizes of a taxi sign [m]."""

_BLOCK = (0.115, 0.2, 0.05)
"""Half sizes of a blue light [m]."""

_CLEAR = 0.006
"""Distance of lamps before what they shine from [m]."""

_BADGE, _BADGE_OUT = 0.034, 0.007
"""Height of letters at the rear, and their distance from the field of the body [m]."""

_LETTERS_OUT = 0.008
"""Distance of letters from the field of the body; its triangles are some millimetres off it [m]."""


def equipment(shape: CarShape, level: CarFineness) -> Iterator[MaterialMesh]:
    """Build what stands on the roof, and the letters on the flanks."""
    yield from _side_text(shape)
    if level.bevels:
        yield from _badges(shape)
    yield from roof_equipment(shape, max(10, level.sides))


def roof_equipment(shape: CarShape, sides: int) -> Iterator[MaterialMesh]:
    """Build what stands on the roof.

    Args:
        shape: The body.
        sides: Facets of round pieces.
    """
    at = _place(shape)
    if shape.recipe.equipment == "taxi_sign":
        yield from _sign(at, sides)
    elif shape.recipe.equipment == "light_bar":
        yield from _bar(at, sides)


def equipment_lamps(shape: CarShape) -> Iterator[VehicleLamp]:
    """Return what shines on the roof, forward and backward."""
    x, _, z = _place(shape)
    kind = shape.recipe.equipment
    for sign, yaw in ((1.0, 0.0), (-1.0, float(np.pi))):
        if kind == "taxi_sign":
            at = (x + sign * (_SIGN[0] + _CLEAR), 0.0, z + 0.075)
            yield VehicleLamp("sign", at, (0.38, 0.09), yaw)
        elif kind == "light_bar":
            for y in (0.38, -0.38):
                at = (x + sign * (_BLOCK[0] + _CLEAR), y, z + 0.075)
                yield VehicleLamp("blue", at, (0.34, 0.07), yaw)


def _place(shape: CarShape) -> Floats:
    """The roof's middle behind the windscreen, in the body's frame, (3,) [m]."""
    d = shape.recipe.header + 0.5
    return np.array([-d, 0.0, float(shape.roof(d))])


def _side_text(shape: CarShape) -> Iterator[MaterialMesh]:
    """Letters on both flanks, which read from the left on either."""
    flanks = shape.recipe.flanks
    if flanks is None:
        return
    d, z = flanks.at
    letters = lettering(flanks.text, height=flanks.height, weight=0.2)
    flat, numbers = np.unique(letters.reshape(-1, 2), axis=0, return_inverse=True)
    faces = numbers.reshape(-1, 3)
    for side in (1.0, -1.0):
        spots = land(shape, "side", np.column_stack([d + side * flat[:, 0], z + flat[:, 1]]))
        places = (spots.points + _LETTERS_OUT * spots.normals) * [1.0, side, 1.0]
        yield flanks.material, shaded(places, faces, crease=1.0)


def _badges(shape: CarShape) -> Iterator[MaterialMesh]:
    """Letters at the rear, beside the plate."""
    for side, text in zip((1.0, -1.0), shape.recipe.badges, strict=True):
        if not text:
            continue
        letters = lettering(text, height=_BADGE, weight=0.17, gap=0.3)
        flat, numbers = np.unique(letters.reshape(-1, 2), axis=0, return_inverse=True)
        wide = float(np.ptp(flat[:, 0]))
        # They begin, or end, as far from the plate as they are high.
        y = side * (0.36 + 0.5 * wide) - flat[:, 0]
        z = shape.recipe.plates[1] + 0.012 + flat[:, 1]
        spots = land(shape, "rear", np.column_stack([np.abs(y), z]))
        places = spots.points * [1.0, side, 1.0] + [-_BADGE_OUT, 0.0, 0.0]
        yield "chrome", shaded(places, numbers.reshape(-1, 3), crease=1.0)


def _sign(at: Floats, sides: int) -> Iterator[MaterialMesh]:
    """A box with letters on a black foot."""
    x, y, z = at
    yield "gloss_black", moved(box((-0.07, -0.2, -0.02), (0.07, 0.2, 0.016)), x, y, z)
    body = superellipsoid(_SIGN, squareness=5.0, segments=2 * sides, rings=sides)
    yield "lamp_sign", moved(body, x, y, z + 0.075)
    letters = lettering("TAXI", height=0.075, weight=0.2, gap=0.34).reshape(-1, 2)
    for sign in (1.0, -1.0):
        fixed = np.full(len(letters), x + sign * (_SIGN[0] + 0.002))
        places = np.column_stack([fixed, sign * letters[:, 0], letters[:, 1] + z + 0.077])
        yield "plate_ink", shaded(places, np.arange(len(places)).reshape(-1, 3), crease=0.3)


def _bar(at: Floats, sides: int) -> Iterator[MaterialMesh]:
    """Two blue blocks beside a dark middle, on feet."""
    x, y, z = at
    yield "gloss_black", moved(box((-0.09, -0.57, 0.012), (0.09, 0.57, 0.034)), x, y, z)
    for side in (0.4, -0.4):
        yield "gloss_black", moved(box((-0.05, -0.03, -0.04), (0.05, 0.03, 0.014)), x, y + side, z)
        block = superellipsoid(_BLOCK, squareness=4.0, segments=sides, rings=max(6, sides // 2))
        yield "lamp_blue", moved(block, x, y + 0.95 * side, z + 0.075)
    middle = superellipsoid((0.1, 0.19, 0.042), squareness=5.0, segments=sides, rings=6)
    yield "lamp_bowl", moved(middle, x, y, z + 0.07)
